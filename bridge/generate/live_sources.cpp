#include "bridge/generate/live_sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "bridge/cli/session.hpp"
#include "bridge/generate/capture_model.hpp"
#include "bridge/messages/types/interface_name.hpp"
#include "bridge/traffic/capture_reader.hpp"
#include "bridge/traffic/live/live_frames.hpp"
#include "dds_adapter/ros_names.hpp"
#include "pcaps/traffic.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::generate {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view reply = "Reply";
constexpr std::string_view response_suffix = messages::service_suffixes[1];

/// The service of a topic that its server replies on: "rr/addReply" is "/add".
std::optional<std::string> service_of_reply(std::string_view topic) {
  if (!topic.starts_with("rr/") || !topic.ends_with(reply)) {
    return std::nullopt;
  }
  topic.remove_prefix(2);
  topic.remove_suffix(reply.size());
  return std::string{topic};
}

/// A topic, service or action, by the names that ROS has.
struct Named {
  std::string name;
  std::string type;
};

/// What a writer belongs to; nothing: to nothing of ROS, or to a part that does not count by itself.
std::optional<Named> named_of(const dds::FoundWriter& writer) {
  constexpr std::string_view send_goal = "/_action/send_goal";
  constexpr std::string_view send_goal_type = "_SendGoal";
  const auto type = dds::type_of_ros(writer.type);
  if (!type) {
    return std::nullopt;
  }
  if (auto topic = dds::topic_of_ros(writer.topic)) {
    return Named{std::move(*topic), *type};
  }
  auto service = service_of_reply(writer.topic);
  if (!service || !type->ends_with(response_suffix)) {
    return std::nullopt;
  }
  std::string name = type->substr(0, type->size() - response_suffix.size());
  if (service->ends_with(send_goal) && name.ends_with(send_goal_type)) {
    service->resize(service->size() - send_goal.size());
    name.resize(name.size() - send_goal_type.size());
  }
  return Named{std::move(*service), std::move(name)};
}

/// What nodes have by themselves, and what names that begin with "_" hide.
bool is_of_every_node(const Named& one) {
  return one.name == "/rosout" || one.name == "/parameter_events" ||
         one.type.starts_with("rcl_interfaces/") || one.type.starts_with("type_description_interfaces/") ||
         one.name.find("/_") != std::string::npos;
}

bool is_among(std::span<const std::string> names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace

describe::Reading listen_to_network(const std::string& where, cli::NetworkOptions network, double seconds) {
  describe::Reading reading;
  const std::string place = where.empty() ? "network" : "network:" + where;
  const bool is_address = someip::parse_address(where).has_value();
  if (is_address) {
    network.set_address(where);
  }
  try {
    const traffic::Where place_of_it = traffic::where_of(is_address ? std::string{} : where, network);
    cli::Session session{seconds};
    traffic::CaptureReader* learner = nullptr;
    CaptureModel sink{[&](Transport transport, const Endpoint& at) { learner->learn(transport, at); }};
    traffic::CaptureReader reader{{network.config_without_address().port}, sink};
    learner = &reader;
    pcaps::Traffic frames_of{reader};
    const traffic::LiveFrames frames{session, place_of_it,
                                     [&](const pcaps::Frame& frame) { frames_of.on_frame(frame); },
                                     [&](ByteView datagram, const Endpoint& from, const Endpoint& to) {
                                       sink.sd_datagram(datagram, from, to, traffic::wall_clock());
                                     }};
    session.run();
    frames.check();
    frames_of.finish();
    reader.finish();
    reading = sink.reading(place);
    if (sink.messages() == 0) {
      reading.problems.push_back({.severity = documents::Problem::Severity::warning,
                                  .file = place,
                                  .mark = {},
                                  .text = fmt::format("no SOME/IP message was seen in {} s", seconds)});
    }
  } catch (const std::runtime_error& failure) {
    reading.problems.push_back({.file = place, .mark = {}, .text = failure.what()});
  }
  return reading;
}

std::vector<describe::RosInterface> interfaces_of(std::span<const dds::FoundWriter> graph,
                                                  std::span<const std::string> only,
                                                  const std::string& place) {
  std::map<std::string, std::string, std::less<>> types;  // by name
  for (const dds::FoundWriter& one : graph) {
    if (auto found = named_of(one);
        found && (only.empty() ? !one.bridge && !is_of_every_node(*found) : is_among(only, found->name))) {
      types.emplace(std::move(found->name), std::move(found->type));
    }
  }
  std::vector<describe::RosInterface> interfaces;
  for (const auto& [name, type] : types) {
    interfaces.push_back({.type = type, .name = name, .place = fmt::format("{} {}", place, name)});
  }
  return interfaces;
}

std::vector<std::string> brought_by_bridges(std::span<const dds::FoundWriter> graph) {
  std::map<std::string, bool, std::less<>> names;  // whether only bridges have it
  for (const dds::FoundWriter& one : graph) {
    if (const auto found = named_of(one); found && !is_of_every_node(*found)) {
      bool& is_brought = names.try_emplace(found->name, true).first->second;
      is_brought = is_brought && one.bridge;
    }
  }
  std::vector<std::string> brought;
  for (const auto& [name, is_brought] : names) {
    if (is_brought) {
      brought.push_back(name);
    }
  }
  return brought;
}

}  // namespace trestle::generate
