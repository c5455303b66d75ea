#include "bridge/carry/runtime/bridge.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <map>
#include <stdexcept>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/dds_receiver.hpp"
#include "bridge/carry/runtime/dds_words.hpp"
#include "bridge/carry/runtime/discovered_routes.hpp"
#include "bridge/carry/runtime/event_to_topic.hpp"
#include "bridge/carry/runtime/getter_to_topic.hpp"
#include "bridge/carry/runtime/methods.hpp"
#include "bridge/carry/runtime/node_config.hpp"
#include "bridge/carry/runtime/offered_services.hpp"
#include "bridge/carry/runtime/publisher_watch.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/service_offer.hpp"
#include "bridge/carry/runtime/silence_watch.hpp"
#include "bridge/carry/runtime/start_at.hpp"
#include "bridge/carry/runtime/topic_to_event.hpp"
#include "bridge/carry/runtime/topic_watch.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"

namespace trestle::carry {
namespace {

// A name that is wrong is better said here than by the socket that needs it first.
void check_interface(const std::string& name) {
  if (!name.empty() && if_nametoindex(name.c_str()) == 0) {
    throw std::runtime_error{"interface: there is no network interface '" + name + "' (see: ip link)"};
  }
}

std::vector<dds::ParticipantConfig::Server> servers(const std::vector<DiscoveryServer>& configured) {
  std::vector<dds::ParticipantConfig::Server> result;
  result.reserve(configured.size());
  for (const DiscoveryServer& server : configured) {
    result.push_back({server.address, server.port});
  }
  return result;
}

bool is_as_published(const QosSettings& qos) {
  return qos.reliability_as_published || qos.durability_as_published;
}

// A reader that follows its publishers is about to ask for what they offer: nothing to warn of.
bool is_followed(const std::map<std::string, QosSettings>& following, const dds::Event& event) {
  if (event.kind != dds::Event::Kind::incompatible_qos || !event.ours_reads) {
    return false;
  }
  const auto route = following.find(event.topic);
  return route != following.end() &&
         ((event.detail == "reliability" && route->second.reliability_as_published) ||
          (event.detail == "durability" && route->second.durability_as_published) ||
          (event.detail == "durability, reliability" && route->second.durability_as_published &&
           route->second.reliability_as_published));
}

// The interface that has our address, if it is not the configured one; as SilenceReason wants it.
std::string other_interface(const SomeipSettings& settings) {
  const unsigned found = someip::interface_of(settings.address);
  if (settings.interface.empty() || found == 0 || found == if_nametoindex(settings.interface.c_str())) {
    return {};
  }
  std::array<char, IF_NAMESIZE> name{};
  return fmt::format("{} is not that of `interface` {}, but of {}", someip::to_string(settings.address),
                     settings.interface, if_indextoname(found, name.data()) == nullptr ? "?" : name.data());
}

void log_dds(spdlog::logger& logger, const dds::Event& event) {
  using Kind = dds::Event::Kind;
  const bool bad = event.kind == Kind::incompatible_qos || event.kind == Kind::incompatible_type ||
                   event.kind == Kind::other_type_hash || event.kind == Kind::deadline_missed ||
                   event.kind == Kind::liveliness_lost || event.kind == Kind::small_send_buffer;
  logger.log(bad ? spdlog::level::warn : spdlog::level::info, "DDS {}", in_words(event));
}

}  // namespace

struct Bridge::State {
  State(boost::asio::io_context& io, const BridgeConfig& config, Report& watcher)
      : report{watcher},
        watch{std::make_shared<TopicWatch>(io)},
        publishers{io},
        node{start_at(config, config.someip.mark, [&] {
          const auto log_at = [this](spdlog::level::level_enum level) {
            return [this, level](const std::string& line) {
              spdlog::log(level, "SD {}", line);
              report.discovery(line);
            };
          };
          return std::make_unique<sd::Node>(io, node_config(config), log_at(spdlog::level::info),
                                            log_at(spdlog::level::warn));
        })} {}

  void join_dds(boost::asio::io_context& io, const BridgeConfig& config) {
    std::map<std::string, QosSettings> following;  // by topic
    for (const Route& route : config.routes) {
      if (is_as_published(route.qos)) {
        following.emplace(dds::ros_topic_name(route.topic), route.qos);
      }
    }
    if (!following.empty()) {
      watch->watch_writers([this] { publishers.changed(); });
    }
    participant = start_at(config, config.dds.mark, [&] {
      return std::make_unique<dds::Participant>(dds::ParticipantConfig{
          .domain = config.dds.domain.value_or(0),
          .name = "trestle",
          .interfaces = config.dds.interfaces,
          .shared_memory = config.dds.shared_memory,
          .lease = config.dds.lease,
          .node = config.dds.node,
          .enclave = config.dds.security.enclave,
          .gid_bytes = gid_bytes(config.dds.ros_distro),
          .profiles_file = config.dds.profiles,
          .profile = config.dds.profile,
          .discovery_servers = servers(config.dds.discovery_servers),
          .security_folder = security_folder(config.dds.security),
          .polled = receives_samples(),
          .strict_types = config.dds.strict_types,
          .frees_samples = true,
          .on_event =
              [log = logger, watched = watch, following = std::move(following)](const dds::Event& event) {
                if (!is_followed(following, event)) {
                  log_dds(*log, event);
                }
                watched->on_event(event);
              },
          .on_writers = [watched = watch] { watched->on_writers(); }});
    });
    if (participant->incoming() >= 0) {
      receiver.emplace(io, *participant);
    }
    for (const std::string& line : participant->buffers_not_granted()) {
      logger->warn("DDS {}", line);
    }
    if (participant->shares_memory()) {
      logger->warn(
          "dds: shared memory is in use: a process on this host that uses it with another build of Fast DDS "
          "can end the bridge{}",
          dds::shared_memory_can_abort()
              ? "; with this version of Fast DDS one that is killed or stopped at the wrong moment can, too"
              : "");
    }
  }

  // What the checks of end-to-end protection find is published, if there are any, and how methods are.
  void publish_diagnostics(boost::asio::io_context& io, const BridgeConfig& config,
                           messages::TypeLibrary& types) {
    const auto look = [this, routes = config.diagnostics.wanted] {
      std::vector<Diagnosis> found;
      for (const auto& route : inbound) {
        if (auto one = route->diagnosis()) {
          found.push_back(std::move(*one));
        }
      }
      for (const auto& getter : getters) {
        if (getter->e2e() != nullptr) {
          found.push_back(getter->diagnosis());
        }
      }
      methods->append_diagnoses(found);
      if (routes) {
        std::ranges::transform(outbound, std::back_inserter(found),
                               [](const auto& one) { return one->state(); });
        std::ranges::transform(inbound, std::back_inserter(found),
                               [](const auto& one) { return one->state(); });
        if (discovered) {
          discovered->append_diagnoses(found);
        }
      }
      return found;
    };
    const bool has_checks =
        std::ranges::any_of(config.methods, [](const auto& one) { return one.e2e.has_value(); }) ||
        std::ranges::any_of(getters, [](const auto& one) { return one->e2e() != nullptr; }) ||
        std::ranges::any_of(inbound, [](const auto& route) { return route->diagnosis().has_value(); });
    if (look().empty() || !(has_checks || config.diagnostics.wanted)) {
      return;
    }
    diagnostics = start_at(config, config.diagnostics.mark, [&] {
      return std::make_unique<Diagnostics>(io, *participant, config.diagnostics,
                                           user_data_of(Diagnostics::type, types), look);
    });
    // Who comes new is told at once, and not with the next period only.
    watch->watch(dds::ros_topic_name(config.diagnostics.topic), TopicWatch::End::writer,
                 [this] { diagnostics->changed(); });
    for (const auto& route : inbound) {
      route->on_e2e_change([this] { diagnostics->changed(); });
    }
    for (const auto& getter : getters) {
      if (E2eStatus* const status = getter->e2e()) {
        status->on_change([this] { diagnostics->changed(); });
      }
    }
    methods->on_change([this] { diagnostics->changed(); });
    if (config.diagnostics.wanted) {
      watch->watch_writers(diagnostics->asker());
      node->on_subscriptions(diagnostics->asker());
    }
  }

  // Who wants to know of the topic's publishers or readers is told of them from now on.
  void follow(EventToTopic& inbound_route, const Route& route) {
    if (route.presence.subscribe_while_read) {
      watch->watch(dds::ros_topic_name(route.topic), TopicWatch::End::writer,
                   [&inbound_route] { inbound_route.readers_changed(); });
    }
    if (route.qos.transient_local) {
      watch->watch(dds::ros_topic_name(route.topic), TopicWatch::End::writer,
                   [&inbound_route] { inbound_route.bridges_changed(); });
    }
  }
  void follow(ServiceOffer& offer, TopicToEvent& outbound_route, const Route& route) {
    if (route.presence.offer_while_published) {
      offer.needs([&outbound_route] { return outbound_route.published(); });
      watch->watch(dds::ros_topic_name(route.topic), TopicWatch::End::reader, [&offer] { offer.update(); });
    }
  }

  // Says why nothing comes.
  void watch_silence(boost::asio::io_context& io, const BridgeConfig& config) {
    silence.emplace(
        io,
        [this] {
          offered.clear();
          for (const sd::SeenOffer& one : node->seen_offers()) {
            offered[one.service].push_back(one);
          }
          published.clear();
          for (dds::FoundWriter& one : participant->writers()) {
            published[one.topic].push_back(std::move(one));
          }
          return SilenceWatch::Heard{.someip = node->seen_hosts(), .dds = participant->peers()};
        },
        [log = logger](const std::string& line) { log->warn("{}", line); });
    const std::string other = other_interface(config.someip);
    const auto watch_outbound = [this](const std::string& name, const TopicToEvent& one) {
      silence->add({.topic = name,
                    .received = [&one] { return one.received(); },
                    .reason =
                        [this, &one, topic = dds::ros_topic_name(name)] {
                          return one.silence(published[topic], participant->peers());
                        }});
    };
    auto in = inbound.begin();
    auto out = outbound.begin();
    for (const Route& route : config.routes) {
      if (route.direction == Direction::someip_to_dds) {
        silence->add({.topic = route.topic,
                      .received = [&one = **in] { return one.received(); },
                      .reason = [this, &one = **in, service = route.service,
                                 other] { return one.silence(offered[service], other); }});
        ++in;
      } else {
        watch_outbound(route.topic, **out);
        ++out;
      }
    }
    if (discovered) {
      discovered->append_silence(*silence);
      discovered->watched_by({.made = watch_outbound,
                              .ends = [this](const std::string& topic) { silence->remove(topic); },
                              .looked = diagnostics && config.diagnostics.wanted ? diagnostics->asker()
                                                                                 : std::function<void()>{}});
    }
    silence->start();
  }

  Report& report;
  /// For the threads of DDS, which are started after it has been fetched.
  std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  std::shared_ptr<TopicWatch> watch;
  PublisherWatch publishers;  ///< of routes whose quality of service is as published
  std::unique_ptr<dds::Participant> participant;
  std::optional<DdsReceiver> receiver;
  std::unique_ptr<sd::Node> node;
  std::vector<std::unique_ptr<GetterToTopic>> getters;
  std::vector<std::unique_ptr<ServiceOffer>> offers;
  std::vector<std::unique_ptr<TopicToEvent>> outbound;
  std::vector<std::unique_ptr<EventToTopic>> inbound;
  std::unique_ptr<DiscoveredRoutes> discovered;  ///< if there are patterns
  std::unique_ptr<Methods> methods;
  std::optional<SilenceWatch> silence;
  // What the routes to which nothing comes ask for, of the last look.
  std::map<someip::ServiceId, std::vector<sd::SeenOffer>> offered;
  std::map<std::string, std::vector<dds::FoundWriter>> published;
  std::unique_ptr<Diagnostics> diagnostics;  ///< if there is something to tell
};

Bridge::Bridge(boost::asio::io_context& io, const BridgeConfig& config, messages::TypeLibrary& types,
               Report& report) {
  std::vector<messages::ConversionPlan> plans;
  std::vector<std::string> user_data;
  for (const Route& route : config.routes) {
    plans.push_back(start_at(config, route.mark, [&] { return compile(route, types); }));
    user_data.push_back(user_data_of(route.type, types));
  }
  auto methods = std::make_unique<Methods>(config, types);
  start_at(config, config.someip.interface_mark, [&] { check_interface(config.someip.interface); });
  // First all sockets, which may be taken: who joins DDS is seen by others at once.
  state_ = std::make_unique<State>(io, config, report);
  state_->methods = std::move(methods);
  std::vector<OfferedService> services = offered_services(config.routes);
  for (const Route& route : config.routes) {
    if (route.getter) {
      state_->getters.push_back(std::make_unique<GetterToTopic>(route));
      state_->getters.back()->join(services);
    }
  }
  state_->methods->join_someip(io, *state_->node, services);
  for (const OfferedService& service : services) {
    state_->offers.push_back(start_at(config, service.mark, [&] {
      return std::make_unique<ServiceOffer>(*state_->node, service.spec, service.while_there);
    }));
  }
  for (std::size_t i = 0; i < config.routes.size(); ++i) {
    const Route& route = config.routes[i];
    if (route.direction == Direction::someip_to_dds) {
      state_->inbound.push_back(start_at(config, route.mark, [&] {
        return std::make_unique<EventToTopic>(*state_->node, route,
                                              subscription_of(config.routes, route, plans[i]),
                                              std::move(plans[i]), report);
      }));
      if (ServiceToMethod* const setter = state_->methods->setter_beside(route)) {
        state_->inbound.back()->on_value(
            [setter](std::optional<ByteView> value) { setter->note_value(value); });
      }
    }
  }
  if (!config.patterns.empty()) {
    state_->discovered = std::make_unique<DiscoveredRoutes>(io, *state_->node, config, types, report);
    state_->watch->watch_writers([discovered = state_->discovered.get()] { discovered->changed(); });
  }
  state_->join_dds(io, config);
  auto inbound = state_->inbound.begin();
  auto getter = state_->getters.begin();
  for (std::size_t i = 0; i < config.routes.size(); ++i) {
    const Route& route = config.routes[i];
    start_at(config, route.mark, [&] {
      if (route.direction == Direction::someip_to_dds) {
        state_->follow(**inbound, route);
        (*inbound++)->open(*state_->participant, user_data[i], config.someip.address);
        return;
      }
      const auto service = std::ranges::find_if(services, [&](const OfferedService& offered) {
        return offered.spec.service == route.service && offered.spec.instance == route.instance;
      });
      ServiceOffer& offer = *state_->offers[static_cast<std::size_t>(service - services.begin())];
      state_->outbound.push_back(
          std::make_unique<TopicToEvent>(io, *state_->node, offer, *state_->participant, route,
                                         std::move(plans[i]), user_data[i], config.someip.address, report));
      state_->follow(offer, *state_->outbound.back(), route);
      if (is_as_published(route.qos)) {
        state_->publishers.add(dds::ros_topic_name(route.topic), dds::ros_type_name(route.type),
                               mark_of(config.someip.address, route),
                               [&opened = *state_->outbound.back()](const PublishedQos& published) {
                                 opened.follow(published);
                               });
      }
      if (route.getter) {
        (*getter++)->open(offer);
      }
    });
  }
  state_->publishers.open(*state_->participant);
  state_->methods->join_dds(*state_->participant, state_->offers);
  state_->watch->watch_writers([methods = state_->methods.get()] { methods->bridges_changed(); });
  state_->publish_diagnostics(io, config, types);
  if (state_->discovered) {
    state_->discovered->open(*state_->participant);
  }
  state_->watch_silence(io, config);
  // Who has been found before somebody was told of it.
  for (const auto& offer : state_->offers) {
    offer->update();
  }
}

Bridge::~Bridge() = default;

void Bridge::stop() {
  state_->watch->stop();
  state_->publishers.stop();
  state_->silence->stop();
  for (const auto& offer : state_->offers) {
    offer->stop();
  }
  for (const auto& route : state_->inbound) {
    route->stop();
  }
  for (const auto& route : state_->outbound) {
    route->stop();
  }
  if (state_->discovered) {
    state_->discovered->stop();
  }
  state_->methods->stop();
  state_->node->shutdown();
}

std::vector<CounterGroup> Bridge::counters() const {
  using enum Counter::Kind;
  std::vector<CounterGroup> groups;
  for (const auto& route : state_->outbound) {
    groups.push_back(route->counters());
  }
  for (const auto& route : state_->inbound) {
    groups.push_back(route->counters());
  }
  if (state_->discovered) {
    state_->discovered->append_counters(groups);
  }
  for (const auto& getter : state_->getters) {
    groups.push_back(getter->counters());
  }
  state_->methods->append_counters(groups);
  const sd::NodeCounters node = state_->node->counters();
  const auto sender = state_->node->sender_counters();
  groups.push_back({"SOME/IP",
                    {{"datagrams_received", node.datagrams},
                     {"events_received", node.events},
                     {"datagrams_sent", sender.datagrams},
                     {"messages_sent", sender.messages},
                     {"calls_answered_with_an_error", node.requests_answered},
                     {"answers_refused", node.answers_refused, loss},
                     {"malformed", node.malformed, loss},
                     {"wrong_version", node.wrong_version, loss},
                     {"unexpected", node.unexpected, loss},
                     {"unknown_sender", node.unknown_sender, loss},
                     {"queue_full", sender.queue_full, loss},
                     {"slow_subscriber", sender.overtaken, loss},
                     {"refused_by_system", sender.refused, loss},
                     {"abandoned", sender.abandoned, loss},
                     {"bad_return_code", node.bad_return_code, loss},
                     {"e2e_not_protected", node.e2e_not_protected, loss},
                     {"receive_buffer_full", node.overflowed, loss}}});
  const auto server = state_->node->tcp_server_counters();
  const auto client = state_->node->tcp_client_counters();
  auto streams = server.streams;
  streams += client.streams;
  groups.push_back({"SOME/IP over TCP",
                    {{"messages_received", streams.received.messages},
                     {"messages_sent", streams.messages_sent},
                     {"accepted", server.accepted},
                     {"connected", client.connections},
                     {"failed_attempts", client.failed_attempts},
                     {"closed_as_idle", server.idle},
                     {"refused", server.refused, loss},
                     {"gave_way", server.gave_way, loss},
                     {"no_memory", streams.no_memory, loss},
                     {"bad_framing", server.bad_framing, loss},
                     {"timed_out", streams.timed_out, loss},
                     {"queue_full", streams.queue_full, loss},
                     {"slow_subscriber", streams.overtaken, loss},
                     {"not_connected", client.not_connected, loss}}});
  const someip::TpCounters tp = state_->node->reassembly_counters();
  CounterGroup segments{"SOME/IP-TP",
                        {{"segments_received", tp.segments}, {"messages_received", tp.messages}}};
  for (std::size_t i = 0; i < someip::tp_drop_count; ++i) {
    segments.counters.push_back({to_string(static_cast<someip::TpDrop>(i)), tp.drops[i], loss});
  }
  groups.push_back(std::move(segments));
  const sd::Counters& sd = state_->node->discovery_counters();
  groups.push_back({"SOME/IP-SD",
                    {{"datagrams_received", sd.datagrams_received},
                     {"datagrams_sent", sd.datagrams_sent},
                     {"entries_sent", sd.entries_sent},
                     {"nacks_sent", sd.nacks_sent},
                     {"reboots_detected", sd.reboots_detected},
                     {"down", sd.dropped_down, loss},
                     {"own_echoes", sd.dropped_own},
                     {"source", sd.dropped_source, loss},
                     {"not_sd", sd.dropped_not_sd, loss},
                     {"malformed", sd.dropped_malformed, loss},
                     {"no_room", sd.ignored_no_room, loss},
                     {"too_many", sd.ignored_too_many, loss},
                     {"too_many_reboots", sd.dropped_reboots, loss},
                     {"duplicates", sd.dropped_duplicates},
                     {"displaced", sd.displaced, loss},
                     {"unknown_type", sd.ignored_unknown_type, loss},
                     {"wrong_transport", sd.ignored_wrong_transport, loss},
                     {"unknown_subscriptions", sd.ignored_unknown_subscriptions, loss},
                     {"bad_options", sd.ignored_bad_options, loss},
                     {"offered_twice", node.offered_twice, loss},
                     {"conflicting_offer", sd.ignored_conflicting_offer, loss},
                     {"unexpected_ack", sd.ignored_unexpected_ack, loss},
                     {"unsendable", sd.unsendable_entries, loss},
                     {"not_sent", node.discovery_not_sent, loss},
                     {"waited_to_be_sent", node.discovery_waited},
                     {"not_sent_no_room", node.discovery_no_room, loss},
                     {"not_sent_in_time", node.discovery_outdated, loss}}});
  return groups;
}

}  // namespace trestle::carry
