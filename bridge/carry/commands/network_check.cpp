#include "bridge/carry/commands/network_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "bridge/carry/config/pattern_conflicts.hpp"
#include "bridge/carry/runtime/node_config.hpp"
#include "bridge/carry/runtime/participant_config.hpp"
#include "bridge/carry/runtime/surroundings.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/picture/causes.hpp"
#include "dds_adapter/ros_names.hpp"
#include "sd/net/node.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/net_error.hpp"

namespace trestle::carry {
namespace {

/// Both networks, joined without being of use to anybody.
class Look {
 public:
  explicit Look(const BridgeConfig& config)
      : config_{config}, node_{io_, settings_of(config)}, participant_{quiet(config)} {
    std::set<std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t>> wanted;
    for (const Route& route : config.routes) {
      if (route.direction == Direction::someip_to_dds) {
        wanted.emplace(route.service, route.instance, route.major);
      }
    }
    for (const MethodRoute& method : config.methods) {
      if (method.server == Server::someip) {
        wanted.emplace(method.service, method.instance, method.major);
      }
    }
    for (const auto& [service, instance, major] : wanted) {
      node_.require({.service = service, .instance = instance, .major = major, .minor = sd::any_minor});
    }
  }

  void wait(std::chrono::milliseconds time) {
    io_.restart();
    io_.run_for(time);
  }

  /// What each route would see now.
  [[nodiscard]] Picture picture() const {
    Surroundings around;
    for (const sd::SeenOffer& one : node_.seen_offers()) {
      around.offers[one.service].push_back(one);
    }
    std::size_t writers = 0;
    for (dds::FoundWriter& one : participant_.writers()) {
      around.writers[one.topic].push_back(std::move(one));
      ++writers;
    }
    Picture result;
    result.someip.address = someip::to_string(config_.someip.address);
    result.someip.interface = config_.someip.multicast_interface;
    result.someip.port = config_.someip.port;
    result.someip.discovery_received = node_.discovery_counters().messages_received;
    result.someip.outside_subnet = node_.discovery_counters().dropped_source;
    result.someip.heard = static_cast<std::uint32_t>(node_.seen_hosts());
    result.dds.domain = config_.dds.domain;
    result.dds.heard = static_cast<std::uint32_t>(participant_.peers());
    result.dds.writers = static_cast<std::uint32_t>(writers);
    for (const Route& route : config_.routes) {
      result.routes.push_back(route.direction == Direction::someip_to_dds ? of_service(route, around)
                                                                          : of_topic(route, around));
    }
    for (const MethodRoute& method : config_.methods) {
      RoutePicture one = picture_of(method);
      one.someip.offers = pictures_of(around.offers_of(method.service));
      one.dds.open = method.server == Server::someip ||
                     !around.writers_of(dds::ros_reply_topic(method.ros_service)).empty();
      result.routes.push_back(std::move(one));
    }
    for (const TopicPattern& pattern : config_.patterns) {
      if (pattern.route.direction == Direction::dds_to_someip) {
        result.routes.push_back(of_pattern(pattern, around));
      }
    }
    explain(result);
    return result;
  }

 private:
  static sd::NodeConfig settings_of(const BridgeConfig& config) {
    sd::NodeConfig settings = node_config(config);
    settings.gateway_to.reset();  // nothing is carried back
    return settings;
  }
  static dds::ParticipantConfig quiet(const BridgeConfig& config) {
    dds::ParticipantConfig settings = participant_config(config.dds);
    settings.name = "trestle check";
    settings.node.clear();
    return settings;
  }
  static RoutePicture of_service(const Route& route, const Surroundings& around) {
    RoutePicture result = picture_of(route);
    result.someip.offers = pictures_of(around.offers_of(route.service));
    return result;
  }
  static RoutePicture of_topic(const Route& route, const Surroundings& around) {
    RoutePicture result = picture_of(route);
    result.dds.qos.reliable = result.dds.qos.reliable && !route.qos.reliability_as_published;
    result.dds.qos.transient_local = result.dds.qos.transient_local && !route.qos.durability_as_published;
    for (const dds::FoundWriter& one : around.writers_of(dds::ros_topic_name(route.topic))) {
      if (!one.bridge && result.dds.writers.size() < most_in_picture) {
        result.dds.writers.push_back(picture_of(one));
      }
    }
    if (has_fitting_writer(result)) {
      result.dds.matched = 1;
      result.received = 1;  // it would be, when something is published
    }
    return result;
  }
  [[nodiscard]] RoutePicture of_pattern(const TopicPattern& pattern, const Surroundings& around) const {
    RoutePicture result = picture_of(pattern);
    for (const auto& [topic, writers] : around.writers) {
      const auto name = dds::topic_of_ros(topic);
      if (name && pattern_of(config_.patterns, *name) == &pattern) {
        const bool brought = std::ranges::all_of(writers, &dds::FoundWriter::bridge);
        result.pattern.brought = result.pattern.brought || brought;
        result.pattern.routes += brought ? 0U : 1U;
      }
    }
    return result;
  }

  const BridgeConfig& config_;
  boost::asio::io_context io_{1};
  sd::Node node_;
  const dds::Participant participant_;
};

bool is_there(const RoutePicture& route) {
  return route.cause.words.empty();
}

std::string text_of(const Picture& picture, const BridgeConfig& config, const cli::Colours& colours) {
  const auto there = std::ranges::count_if(picture.routes, is_there);
  std::string out =
      fmt::format("{}{}{}: {}{} of {} routes would find their sources now{}\n", colours.bold, config.file,
                  colours.off, there == std::ssize(picture.routes) ? colours.green : colours.yellow, there,
                  picture.routes.size(), colours.off);
  out += fmt::format("  {}SOME/IP{} {}: {} other host{}\n", colours.dim, colours.off, picture.someip.address,
                     picture.someip.heard, picture.someip.heard == 1 ? "" : "s");
  out += fmt::format("  {}DDS{}     domain {}: {} other participant{}\n\n", colours.dim, colours.off,
                     picture.dds.domain, picture.dds.heard, picture.dds.heard == 1 ? "" : "s");
  std::size_t width = 0;
  for (const RoutePicture& one : picture.routes) {
    width = std::max(width, one.name.size());
  }
  for (const RoutePicture& one : picture.routes) {
    out +=
        fmt::format("  {:<{}}  {}  {}{}{}\n", one.name, width, one.direction == "dds_to_someip" ? "->" : "<-",
                    is_there(one) ? colours.green : colours.yellow,
                    is_there(one) ? "there" : documents::printable(one.cause.words), colours.off);
  }
  return out;
}

}  // namespace

NetworkCheck check_network(const BridgeConfig& config, std::chrono::milliseconds patience,
                           const cli::Colours& colours) {
  std::optional<Look> look;
  try {
    look.emplace(config);
  } catch (const someip::NetError& error) {
    throw std::runtime_error{
        fmt::format("{}: {}; if that is the bridge itself, 'trestle status' says what it finds", config.file,
                    error.what())};
  }
  const auto end = std::chrono::steady_clock::now() + patience;
  for (;;) {
    look->wait(std::chrono::milliseconds{200});
    const Picture picture = look->picture();
    const bool is_all = std::ranges::all_of(picture.routes, is_there);
    if (is_all || std::chrono::steady_clock::now() >= end) {
      return {text_of(picture, config, colours), is_all};
    }
  }
}

}  // namespace trestle::carry
