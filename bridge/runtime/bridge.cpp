#include "bridge/runtime/bridge.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <stdexcept>

#include "bridge/runtime/dds_words.hpp"
#include "bridge/runtime/inbound_route.hpp"
#include "bridge/runtime/outbound_route.hpp"
#include "bridge/types/type_library.hpp"

namespace trestle::bridge {
namespace {

sd::NodeConfig node_config(const BridgeConfig& config) {
  const SdSettings& sd = config.someip.sd;
  sd::NodeConfig node{.address = config.someip.address,
                      .multicast_interface = config.someip.interface,
                      .multicast = sd.multicast,
                      .port = sd.port};
  node.timing = {.initial_delay_min = sd.initial_delay_min,
                 .initial_delay_max = sd.initial_delay_max,
                 .repetitions_base_delay = sd.repetitions_base_delay,
                 .repetitions_max = sd.repetitions_max,
                 .cyclic_offer_delay = sd.cyclic_offer_delay,
                 .request_response_delay_min = sd.request_response_delay_min,
                 .request_response_delay_max = sd.request_response_delay_max,
                 .ttl_s = static_cast<std::uint32_t>(sd.ttl.count())};
  node.check_subnet = sd.check_subnet;
  // One offer or subscription a route at most; of peers, room for many.
  const auto routes = static_cast<std::uint16_t>(std::min<std::size_t>(config.routes.size(), 4000));
  sd::Limits& limits = node.limits;
  limits.max_offers = std::max(limits.max_offers, routes);
  limits.max_eventgroups = std::max(limits.max_eventgroups, routes);
  limits.max_subscribers =
      std::max<std::uint16_t>(limits.max_subscribers, static_cast<std::uint16_t>(4 * routes));
  limits.max_requirements = std::max(limits.max_requirements, routes);
  limits.max_subscriptions = std::max(limits.max_subscriptions, routes);
  limits.max_pending_entries =
      std::max<std::uint16_t>(limits.max_pending_entries, static_cast<std::uint16_t>(4 * routes));
  // Large messages of all routes may be under way at once, even if one server has them all.
  node.max_reassemblies_per_sender = std::max(node.max_reassemblies_per_sender, config.routes.size());
  node.max_reassemblies = std::max(node.max_reassemblies, config.routes.size() + 16);
  node.max_message_bytes = 0;
  for (const Route& route : config.routes) {
    node.max_message_bytes = std::max(node.max_message_bytes, route.tp.max_message);
  }
  // A route has up to two messages on their way at once.
  node.max_queued_bytes =
      std::max(node.max_queued_bytes, 2 * (node.max_message_bytes + someip::header_bytes));
  return node;
}

ConversionPlan compile(const Route& route, TypeLibrary& types) {
  const auto fail = [&](const std::string& why) {
    return std::runtime_error{"route " + route.topic + ": " + route.type + " cannot be carried: " + why};
  };
  const auto tree = types.resolve(route.type);
  if (!tree) {
    throw fail(to_string(tree.error()));
  }
  auto plan = ConversionPlan::compile(*tree, route.rules);
  if (!plan) {
    throw fail(plan.error());
  }
  return std::move(*plan);
}

// A service to offer, and the first of its routes.
struct OfferedService {
  sd::ServiceSpec spec;
  Mark mark;
};

// Routes of one service instance share an offer.
std::vector<OfferedService> offered_services(const BridgeConfig& config) {
  std::vector<OfferedService> services;
  for (const Route& route : config.routes) {
    if (route.direction != Direction::dds_to_someip) {
      continue;
    }
    auto service = std::ranges::find_if(services, [&](const OfferedService& offered) {
      return offered.spec.service == route.service && offered.spec.instance == route.instance;
    });
    if (service == services.end()) {
      service = services.insert(services.end(), {.spec = {.service = route.service,
                                                          .instance = route.instance,
                                                          .major = route.major,
                                                          .minor = route.minor,
                                                          .udp_port = {}},
                                                 .mark = route.mark});
    }
    if (route.transport == Transport::tcp) {
      service->spec.tcp_port = route.port;
      service->spec.tcp_events.push_back(route.event);
    } else {
      service->spec.udp_port = route.port;
    }
    auto& groups = service->spec.eventgroups;
    auto group = std::ranges::find(groups, route.eventgroup, &sd::EventgroupSpec::id);
    if (group == groups.end()) {
      group = groups.insert(group, {.id = route.eventgroup});
    }
    if (route.multicast) {
      group->multicast = route.multicast->group;
      group->multicast_threshold = route.multicast->threshold;
    }
    group->events.push_back(route.event);
  }
  return services;
}

// All routes of an eventgroup share a subscription, which names every protocol that they need.
sd::SubscribeSpec subscription_of(const BridgeConfig& config, const Route& route) {
  const auto uses = [&](Transport transport) {
    return std::ranges::any_of(config.routes, [&](const Route& other) {
      return other.direction == route.direction && other.service == route.service &&
             other.instance == route.instance && other.eventgroup == route.eventgroup &&
             other.transport == transport;
    });
  };
  return {.service = route.service,
          .instance = route.instance,
          .major = route.major,
          .minor = route.minor,
          .eventgroup = route.eventgroup,
          .events = {route.event},
          .udp = uses(Transport::udp),
          .tcp = uses(Transport::tcp),
          .port = route.port};
}

// What keeps a part of the configuration from being carried out is said with its place in the file.
template <typename Start>
auto start_at(const BridgeConfig& config, Mark mark, const Start& start) {
  try {
    return start();
  } catch (const std::exception& error) {
    throw std::runtime_error{
        mark.line == 0 ? fmt::format("{}: {}", config.file, error.what())
                       : fmt::format("{}:{}:{}: {}", config.file, mark.line, mark.column, error.what())};
  }
}

// A name that is wrong is better said here than by the socket that needs it first.
void check_interface(const std::string& name) {
  if (!name.empty() && if_nametoindex(name.c_str()) == 0) {
    throw std::runtime_error{"interface: there is no network interface '" + name + "' (see: ip link)"};
  }
}

void log_dds(spdlog::logger& logger, const dds::Event& event) {
  using Kind = dds::Event::Kind;
  const bool bad = event.kind == Kind::incompatible_qos || event.kind == Kind::incompatible_type;
  logger.log(bad ? spdlog::level::warn : spdlog::level::info, "DDS {}", in_words(event));
}

// A large message comes faster than a busy receiver takes it out of the kernel's buffer.
void warn_of_small_buffers(const BridgeConfig& config, int granted) {
  constexpr int enough = 2 << 20;
  const bool large = std::ranges::any_of(config.routes, [](const Route& route) {
    return route.direction == Direction::someip_to_dds &&
           route.tp.max_message > someip::max_plain_payload_bytes;
  });
  if (large && granted < enough) {
    spdlog::warn(
        "the system grants UDP receive buffers of {} KB only: large messages may lose segments. As root: "
        "sysctl -w "
        "net.core.rmem_max={}",
        granted >> 10, 8 << 20);
  }
}

}  // namespace

struct Bridge::State {
  State(boost::asio::io_context& io, const BridgeConfig& config, Report& watcher)
      : report{watcher}, node{start_at(config, config.someip.mark, [&] {
          return std::make_unique<sd::Node>(io, node_config(config), [this](const std::string& line) {
            spdlog::info("SD {}", line);
            report.discovery(line);
          });
        })} {}

  void join_dds(const BridgeConfig& config) {
    participant = start_at(config, config.dds.mark, [&] {
      return std::make_unique<dds::Participant>(dds::ParticipantConfig{
          .domain = config.dds.domain,
          .name = "trestle",
          .interfaces = config.dds.interfaces,
          .shared_memory = config.dds.shared_memory,
          .on_event = [log = logger](const dds::Event& event) { log_dds(*log, event); }});
    });
  }

  Report& report;
  /// For the threads of DDS, which are started after it has been fetched.
  std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  std::unique_ptr<dds::Participant> participant;
  std::unique_ptr<sd::Node> node;
  std::vector<std::unique_ptr<OutboundRoute>> outbound;
  std::vector<std::unique_ptr<InboundRoute>> inbound;
};

Bridge::Bridge(boost::asio::io_context& io, const BridgeConfig& config, TypeLibrary& types, Report& report) {
  std::vector<ConversionPlan> plans;
  for (const Route& route : config.routes) {
    plans.push_back(start_at(config, route.mark, [&] { return compile(route, types); }));
  }
  start_at(config, config.someip.interface_mark, [&] { check_interface(config.someip.interface); });
  // First all sockets, which may be taken: who joins DDS is seen by others at once.
  state_ = std::make_unique<State>(io, config, report);
  warn_of_small_buffers(config, state_->node->receive_buffer_bytes());
  const std::vector<OfferedService> services = offered_services(config);
  std::vector<sd::OfferHandle> offers;
  offers.reserve(services.size());
  for (const OfferedService& service : services) {
    offers.push_back(start_at(config, service.mark, [&] { return state_->node->offer(service.spec); }));
  }
  for (std::size_t i = 0; i < config.routes.size(); ++i) {
    const Route& route = config.routes[i];
    if (route.direction == Direction::someip_to_dds) {
      state_->inbound.push_back(start_at(config, route.mark, [&] {
        return std::make_unique<InboundRoute>(*state_->node, route, subscription_of(config, route),
                                              std::move(plans[i]), report);
      }));
    }
  }
  state_->join_dds(config);
  auto inbound = state_->inbound.begin();
  for (std::size_t i = 0; i < config.routes.size(); ++i) {
    const Route& route = config.routes[i];
    start_at(config, route.mark, [&] {
      if (route.direction == Direction::someip_to_dds) {
        (*inbound++)->open(*state_->participant);
        return;
      }
      const auto service = std::ranges::find_if(services, [&](const OfferedService& offered) {
        return offered.spec.service == route.service && offered.spec.instance == route.instance;
      });
      state_->outbound.push_back(std::make_unique<OutboundRoute>(
          io, *state_->node, offers[static_cast<std::size_t>(service - services.begin())],
          *state_->participant, route, std::move(plans[i]), report));
    });
  }
}

Bridge::~Bridge() = default;

void Bridge::stop() {
  for (const auto& route : state_->outbound) {
    route->stop();
  }
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
  const sd::NodeCounters node = state_->node->counters();
  const auto sender = state_->node->sender_counters();
  groups.push_back({"SOME/IP",
                    {{"datagrams_received", node.datagrams},
                     {"events_received", node.events},
                     {"datagrams_sent", sender.datagrams},
                     {"messages_sent", sender.messages},
                     {"calls_answered_with_an_error", node.requests_answered},
                     {"malformed", node.malformed, loss},
                     {"wrong_version", node.wrong_version, loss},
                     {"unexpected", node.unexpected, loss},
                     {"unknown_sender", node.unknown_sender, loss},
                     {"queue_full", sender.queue_full, loss},
                     {"refused_by_system", sender.refused, loss},
                     {"abandoned", sender.abandoned, loss},
                     {"bad_return_code", node.bad_return_code, loss},
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
                     {"refused", server.refused, loss},
                     {"bad_framing", server.bad_framing, loss},
                     {"timed_out", streams.timed_out, loss},
                     {"queue_full", streams.queue_full, loss},
                     {"not_connected", client.not_connected, loss}}});
  const someip::TpCounters& tp = state_->node->reassembly_counters();
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
                     {"no_room", sd.dropped_no_room + sd.ignored_no_room, loss},
                     {"unknown_type", sd.ignored_unknown_type, loss},
                     {"wrong_transport", sd.ignored_wrong_transport, loss},
                     {"bad_options", sd.ignored_bad_options, loss},
                     {"conflicting_offer", sd.ignored_conflicting_offer, loss},
                     {"unexpected_ack", sd.ignored_unexpected_ack, loss},
                     {"unsendable", sd.unsendable_entries, loss},
                     {"not_sent", node.discovery_not_sent, loss}}});
  return groups;
}

}  // namespace trestle::bridge
