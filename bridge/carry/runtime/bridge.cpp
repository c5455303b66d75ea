#include "bridge/carry/runtime/bridge.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <stdexcept>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/carry/runtime/dds_receiver.hpp"
#include "bridge/carry/runtime/dds_words.hpp"
#include "bridge/carry/runtime/discovered_routes.hpp"
#include "bridge/carry/runtime/make_routes.hpp"
#include "bridge/carry/runtime/network_picture.hpp"
#include "bridge/carry/runtime/node_config.hpp"
#include "bridge/carry/runtime/node_counters.hpp"
#include "bridge/carry/runtime/onlookers.hpp"
#include "bridge/carry/runtime/participant_config.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/shared_subscription.hpp"
#include "bridge/carry/runtime/silence_watch.hpp"
#include "bridge/carry/runtime/start_at.hpp"
#include "bridge/carry/runtime/ways_back.hpp"
#include "bridge/documents/ids_in_line.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/picture/causes.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"

namespace trestle::carry {
namespace {

// How many the process may have.
std::size_t descriptor_limit() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<std::size_t>(limit.rlim_cur) : SIZE_MAX;
}

// A name that is wrong is better said here than by the socket that needs it first.
void check_interface(const std::string& name) {
  if (!name.empty() && if_nametoindex(name.c_str()) == 0) {
    throw std::runtime_error{"interface: there is no network interface '" + name + "' (see: ip link)"};
  }
}

// A reader that follows its publishers is about to ask for what they offer: nothing to warn of.
bool is_followed(const std::map<std::string, QosSettings>& following, const dds::Happening& happening) {
  if (happening.kind != dds::Happening::Kind::incompatible_qos || !happening.ours_reads) {
    return false;
  }
  const auto route = following.find(happening.topic);
  return route != following.end() &&
         ((happening.detail == "reliability" && route->second.reliability_as_published) ||
          (happening.detail == "durability" && route->second.durability_as_published) ||
          (happening.detail == "durability, reliability" && route->second.durability_as_published &&
           route->second.reliability_as_published));
}

// The interface that has our address, if it is not the configured one; as SomeipPicture wants it.
std::string other_interface_of(const SomeipSettings& settings) {
  const unsigned found = someip::interface_of(settings.address);
  if (settings.multicast_interface.empty() || found == 0 ||
      found == if_nametoindex(settings.multicast_interface.c_str())) {
    return {};
  }
  std::array<char, IF_NAMESIZE> name{};
  return fmt::format("{} is not that of `interface` {}, but of {}", someip::to_string(settings.address),
                     settings.multicast_interface,
                     if_indextoname(found, name.data()) == nullptr ? "?" : name.data());
}

void log_dds(spdlog::logger& logger, const dds::Happening& happening) {
  using Kind = dds::Happening::Kind;
  const bool bad = happening.kind == Kind::incompatible_qos || happening.kind == Kind::incompatible_type ||
                   happening.kind == Kind::other_type_hash || happening.kind == Kind::deadline_missed ||
                   happening.kind == Kind::liveliness_lost || happening.kind == Kind::small_send_buffer;
  logger.log(bad ? spdlog::level::warn : spdlog::level::info, "DDS {}", in_words(happening));
}

/// Names behind the ids, which stay: other programs have them alone.
std::string with_names(const std::string& line, const IdNames& names) {
  if (names.empty()) {
    return line;
  }
  const auto behind = [](const std::string& name) { return name.empty() ? name : " (" + name + ")"; };
  return documents::with_ids_replaced(line, [&](const documents::IdsInLine& ids) {
    return ids.eventgroup_text +
           (ids.eventgroup ? behind(names.eventgroup(ids.service, *ids.eventgroup)) : std::string{}) +
           ids.between + ids.service_text + "." + ids.instance_text + behind(names.service(ids.service));
  });
}

}  // namespace

struct Bridge::State {
  State(boost::asio::io_context& io, const BridgeConfig& config, messages::TypeLibrary& types, Report& report,
        IdNames id_names)
      : clock{clock_of(io)},
        watch{std::make_shared<TopicWatch>(io)},
        publishers{*clock},
        context{.io = io,
                .clock = *clock,
                .report = report,
                .address = config.someip.address,
                .values = &values,
                .watch = watch.get(),
                .publishers = &publishers},
        routes{make_routes(context, config, types), config},
        ways_back{config},
        onlookers{*clock},
        file{config.file},
        someip_settings{config.someip},
        other_interface{other_interface_of(config.someip)},
        domain{config.dds.domain},
        names{std::move(id_names)},
        started{clock->now()} {}

  void join_someip(const BridgeConfig& config) {
    node = start_at(config, config.someip.mark, [&] {
      const auto log_at = [this](spdlog::level::level_enum level) {
        return [this, level](const std::string& line) {
          spdlog::log(level, "SD {}", with_names(line, names));
          context.report.discovery(line);
        };
      };
      sd::NodeConfig settings = node_config(config, descriptor_limit());
      settings.is_way_back_known = [this](const sd::RemoteService& service) {
        return context.dds != nullptr && ways_back.are_known(*context.dds, service);
      };
      return std::make_unique<sd::Node>(context.io, settings, log_at(spdlog::level::info),
                                        log_at(spdlog::level::warn));
    });
    someip = someip_side_of(*node);
    context.someip = someip.get();
    routes.join_someip(*someip);
  }

  void join_dds(const BridgeConfig& config) {
    std::map<std::string, QosSettings> following;  // by topic
    for (const Route& route : config.routes) {
      if (is_as_published(route.qos)) {
        following.emplace(dds::ros_topic_name(route.topic), route.qos);
      }
    }
    if (!following.empty()) {
      watch->watch_writers([this] { publishers.changed(); });
    }
    dds::ParticipantConfig settings = participant_config(config.dds);
    settings.polled = receives_samples();
    settings.on_event = [log = logger, watched = watch,
                         following = std::move(following)](const dds::Happening& happening) {
      if (!is_followed(following, happening)) {
        log_dds(*log, happening);
      }
      watched->on_event(happening);
    };
    settings.on_writers = [watched = watch] { watched->on_writers(); };
    participant = start_at(config, config.dds.mark,
                           [&] { return std::make_unique<dds::Participant>(std::move(settings)); });
    dds = dds_side_of(*participant);
    context.dds = dds.get();
    if (participant->incoming() >= 0) {
      receiver.emplace(context.io, *participant);
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
  void publish_diagnostics(const BridgeConfig& config, messages::TypeLibrary& types) {
    const auto look = [this, all = config.diagnostics.wanted] {
      std::vector<Diagnosis> found;
      for (const auto& [mark, route] : routes) {
        route->append_diagnoses(found, all);
      }
      if (all && discovered) {
        discovered->append_diagnoses(found);
      }
      return found;
    };
    const bool has_checks =
        std::ranges::any_of(routes, [](const auto& one) { return one.route->has_checks(); });
    if (look().empty() || !(has_checks || config.diagnostics.wanted)) {
      return;
    }
    diagnostics = start_at(config, config.diagnostics.mark, [&] {
      return std::make_unique<Diagnostics>(*clock, *dds, config.diagnostics,
                                           user_data_of(Diagnostics::type, types), look);
    });
    // Who comes new is told at once, and not with the next period only.
    watch->watch(dds::ros_topic_name(config.diagnostics.topic), TopicWatch::End::writer,
                 [this] { diagnostics->changed(); });
    for (const auto& [mark, route] : routes) {
      route->on_change([this] { diagnostics->changed(); });
    }
    if (config.diagnostics.wanted) {
      watch->watch_writers(diagnostics->asker());
      node->on_subscriptions(diagnostics->asker());
    }
  }

  // What is around the routes now.
  void look_around(Surroundings& all) const {
    all = {};
    for (const sd::SeenOffer& one : node->seen_offers()) {
      all.offers[one.service].push_back(one);
    }
    for (dds::FoundWriter& one : participant->writers()) {
      all.writers[one.topic].push_back(std::move(one));
    }
    SomeipPicture& seen = all.networks.someip;
    const sd::SdCounters& discovery = node->discovery_counters();
    seen.address = someip::to_string(context.address);
    seen.interface = someip_settings.multicast_interface;
    seen.port = someip_settings.port;
    seen.other_interface = other_interface;
    seen.discovery_received = discovery.messages_received;
    seen.outside_subnet = discovery.dropped_source;
    seen.reboots = discovery.reboots_detected;
    seen.heard = static_cast<std::uint32_t>(node->seen_hosts());
    all.networks.dds.domain = domain;
    all.networks.dds.guid = participant->guid();
    all.networks.dds.heard = static_cast<std::uint32_t>(participant->peers());
  }

  void watch_silence_of(const RunningRoute& route) {
    if (const std::string* const topic = route.awaited()) {
      silence->add({.topic = *topic,
                    .received = [&route] { return route.received(); },
                    .picture =
                        [this, &route] {
                          RoutePicture picture = route.picture(around);
                          names.name(picture);
                          return picture;
                        }});
    }
  }

  // Says why nothing comes.
  void watch_silence(const BridgeConfig& config) {
    silence.emplace(
        *clock,
        [this]() -> const Picture& {
          look_around(around);
          return around.networks;
        },
        [log = logger](const std::string& line) { log->warn("{}", line); });
    for (const auto& [mark, route] : routes) {
      watch_silence_of(*route);
    }
    if (discovered) {
      discovered->append_silence(*silence);
      discovered->watched_by({.made = [this](const RunningRoute& route) { watch_silence_of(route); },
                              .ends = [this](const std::string& topic) { silence->remove(topic); },
                              .looked = diagnostics && config.diagnostics.wanted ? diagnostics->asker()
                                                                                 : std::function<void()>{}});
    }
    silence->start();
  }

  [[nodiscard]] std::shared_ptr<RunningRoute> route_of(std::uint64_t id) const {
    const auto found = std::ranges::find_if(ids, [&](const auto& one) { return one.second == id; });
    return found == ids.end() ? nullptr : found->first.lock();
  }

  /// For the threads of DDS, which are started after it has been fetched.
  std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  const std::unique_ptr<RouteClock> clock;
  std::shared_ptr<TopicWatch> watch;
  PublisherWatch publishers;  ///< of routes whose quality of service is as published
  FieldValues values;
  std::unique_ptr<dds::Participant> participant;
  std::optional<DdsReceiver> receiver;
  std::unique_ptr<DdsSide> dds;
  std::unique_ptr<sd::Node> node;
  std::unique_ptr<SomeipSide> someip;
  RouteContext context;
  std::optional<boost::asio::thread_pool> disk;  ///< of the lock file
  std::optional<DiscoveredRoutes> discovered;    ///< if there are patterns
  Routes routes;                                 ///< of the configuration and of the patterns
  WaysBack ways_back;
  Onlookers onlookers;
  /// Of routes, by which others know them. What is kept here keeps an address from being that of another.
  std::map<std::weak_ptr<RunningRoute>, std::uint64_t, std::owner_less<>> ids;
  std::uint64_t last_id = 0;
  std::optional<SilenceWatch> silence;
  Surroundings around;  ///< of the last look of it
  const std::string file;
  const SomeipSettings someip_settings;
  const std::string other_interface;
  const std::uint32_t domain;
  const IdNames names;
  const RouteClock::TimePoint started;
  bool stopping = false;
  std::unique_ptr<Diagnostics> diagnostics;  ///< if there is something to tell
};

Bridge::Bridge(boost::asio::io_context& io, const BridgeConfig& config, messages::TypeLibrary& types,
               Report& report, IdNames names)
    : state_{std::make_unique<State>(io, config, types, report, std::move(names))} {
  State& state = *state_;
  start_at(config, config.someip.interface_mark, [&] { check_interface(config.someip.multicast_interface); });
  // First all sockets, which may be taken: who joins DDS is seen by others at once.
  state.join_someip(config);
  if (!config.patterns.empty()) {
    state.disk.emplace(1);
    state.discovered.emplace(state.context, state.routes, config, types, state.disk->get_executor());
    state.watch->watch_writers([&discovered = *state.discovered] { discovered.changed(); });
  }
  state.join_dds(config);
  state.routes.join_dds();
  state.publishers.open(*state.dds);
  state.watch->watch_writers([&state] {
    for (const auto& [mark, route] : state.routes) {
      route->writers_changed();
    }
  });
  state.publish_diagnostics(config, types);
  if (state.discovered) {
    state.discovered->open();
  }
  state.watch_silence(config);
  // Who has been found before somebody was told of it.
  state.routes.update_offers();
}

Bridge::~Bridge() = default;

void Bridge::stop() {
  state_->stopping = true;
  state_->watch->stop();
  state_->publishers.stop();
  state_->silence->stop();
  state_->routes.stop();
  if (state_->discovered) {
    state_->discovered->stop();
  }
  state_->node->shutdown();
}

std::vector<CounterGroup> Bridge::counters() const {
  std::vector<CounterGroup> groups;
  for (const auto& [mark, route] : state_->routes) {
    groups.push_back(route->counters());
  }
  if (state_->discovered) {
    state_->discovered->append_counters(groups);
  }
  append_counters(groups, counts_of(*state_->node));
  return groups;
}

Picture Bridge::picture() const {
  const State& state = *state_;
  Surroundings around;
  state.look_around(around);
  Picture picture = std::move(around.networks);
  picture.pid = static_cast<std::uint32_t>(::getpid());
  picture.configuration = state.file;
  picture.at_ns = state.clock->since_1970().count();
  picture.running_s = std::chrono::duration<double>{state.clock->now() - state.started}.count();
  picture.stopping = state.stopping;
  for (const auto& [mark, route] : state.routes) {
    picture.routes.push_back(route->picture(around));
    picture.routes.back().counters = pictures_of(route->counters().counters);
  }
  if (state.discovered) {
    state.discovered->append_pictures(picture.routes);
  }
  for (RoutePicture& route : picture.routes) {
    state.names.name(route);
  }
  state.routes.append_offers(picture.someip.own_offers);
  append_networks(picture, *state.node, *state.participant);
  explain(picture);
  return picture;
}

sd::Node& Bridge::node() noexcept {
  return *state_->node;
}

std::string Bridge::share_with_routes(sd::SubscribeSpec& wish) const {
  std::vector<const Route*> routes;
  for (const auto& [mark, route] : state_->routes) {
    if (const Route* const one = route->looked_at()) {
      routes.push_back(one);
    }
  }
  return carry::share_with_routes(routes, wish);
}

std::optional<LookedAt> Bridge::look_at(std::size_t index) {
  std::size_t at = 0;
  for (const auto& [mark, route] : state_->routes) {
    if (at++ == index) {
      const Route* const what = route->looked_at();
      if (what == nullptr) {
        return std::nullopt;
      }
      std::optional<LookedAt> result{std::in_place};
      result->name = what->topic;
      result->type = what->type;
      result->rules = what->rules;
      result->mapping = what->mapping;
      result->newest = state_->onlookers.look(route);
      return result;
    }
  }
  return std::nullopt;
}

std::vector<RouteTitle> Bridge::titles() {
  State& state = *state_;
  std::erase_if(state.ids, [](const auto& one) { return one.first.expired(); });
  std::vector<RouteTitle> result;
  for (const auto& [mark, route] : state.routes) {
    if (const Route* const what = route->looked_at()) {
      const auto [at, is_new] = state.ids.try_emplace(route, state.last_id + 1);
      state.last_id += is_new ? 1 : 0;
      result.push_back({.id = at->second,
                        .topic = what->topic,
                        .type = what->type,
                        .service = value(what->service),
                        .instance = value(what->instance),
                        .event = value(what->event)});
    }
  }
  return result;
}

const Route* Bridge::route(std::uint64_t id) const {
  const auto route = state_->route_of(id);
  return route ? route->looked_at() : nullptr;
}

std::shared_ptr<void> Bridge::follow(std::uint64_t id, MessageSink sink) {
  const auto route = state_->route_of(id);
  return route ? state_->onlookers.follow(route, std::move(sink)) : nullptr;
}

}  // namespace trestle::carry
