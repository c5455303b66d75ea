#include "bridge/carry/config/conflicts.hpp"

#include <fmt/format.h>

#include <map>
#include <tuple>

namespace trestle::carry {
namespace {

using someip::value;

bool has(const RouteInFile& route, std::initializer_list<const char*> keys) {
  return std::ranges::all_of(keys, [&](const char* key) { return route.good.contains(key); });
}

documents::Mark mark(const RouteInFile& route, const char* key) {
  return route.good.find(key)->second;
}

std::string instance_name(const Route& route) {
  return fmt::format("service 0x{:04x} instance 0x{:04x}", value(route.service), value(route.instance));
}

/// Finds the first route that has the same key; if there is none, remembers this one.
template <typename Key>
class Firsts {
 public:
  const RouteInFile* other(const Key& key, const RouteInFile& route) {
    const auto [at, is_new] = first_.try_emplace(key, &route);
    return is_new ? nullptr : at->second;
  }

 private:
  std::map<Key, const RouteInFile*> first_;
};

/// A topic is written or read once, and has one type.
void topics(const std::vector<RouteInFile>& routes, documents::Problems& problems) {
  Firsts<std::tuple<std::string, Direction>> one_way;
  Firsts<std::string> typed;
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (has(in_file, {"topic", "direction"})) {
      if (const auto* other = one_way.other({route.topic, route.direction}, in_file)) {
        problems.error(mark(in_file, "topic"),
                       fmt::format("topic: {} is already routed {} by the route in line {}", route.topic,
                                   to_string(route.direction), other->route.mark.line));
      }
    }
    if (has(in_file, {"topic", "type"})) {
      const auto* other = typed.other(route.topic, in_file);
      if (other != nullptr && other->route.type != route.type) {
        problems.error(mark(in_file, "type"),
                       fmt::format("type: {} is {} in the route in line {}", route.topic, other->route.type,
                                   other->route.mark.line));
      }
    }
  }
}

/// An event comes from one topic or goes to one topic. A bridge that receives its own event would send it
/// round for ever.
void events(const std::vector<RouteInFile>& routes, documents::Problems& problems) {
  Firsts<std::tuple<someip::ServiceId, someip::InstanceId, someip::MethodId>> firsts;
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (!has(in_file, {"service", "instance", "event", "direction"})) {
      continue;
    }
    if (const auto* other = firsts.other({route.service, route.instance, route.event}, in_file)) {
      const bool same_way = other->route.direction == route.direction;
      problems.error(
          mark(in_file, "event"),
          fmt::format("event: {} event 0x{:04x} is {} by the route in line {}", instance_name(route),
                      value(route.event),
                      same_way ? "already routed" : "also routed the other way, so it would come back here,",
                      other->route.mark.line));
    }
  }
}

/// Routes of one service instance are one offer, or one subscription: what they share must agree.
void instances(const std::vector<RouteInFile>& routes, documents::Problems& problems) {
  Firsts<std::tuple<someip::ServiceId, someip::InstanceId, Direction>> firsts;
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (!has(in_file, {"service", "instance", "direction"})) {
      continue;
    }
    const auto* other = firsts.other({route.service, route.instance, route.direction}, in_file);
    if (other == nullptr) {
      continue;
    }
    const auto agree = [&](const char* key, std::uint64_t here, std::uint64_t there) {
      if (here != there && has(in_file, {key}) && has(*other, {key})) {
        problems.error(mark(in_file, key), fmt::format("{}: {} has {} in the route in line {}", key,
                                                       instance_name(route), there, other->route.mark.line));
      }
    };
    agree("port", route.port, other->route.port);
    agree("major", route.major, other->route.major);
    agree("minor", route.minor, other->route.minor);
  }
}

/// All routes of one eventgroup are sent in the same way. If a route says nothing, the setting of another
/// route of the group counts.
void eventgroups(const std::vector<RouteInFile>& routes, bool ipv6, documents::Problems& problems) {
  Firsts<std::tuple<someip::ServiceId, someip::InstanceId, someip::EventgroupId>> firsts;
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (!route.multicast || !has(in_file, {"service", "instance", "eventgroup"})) {
      continue;
    }
    if (route.multicast->group.address.v6 != ipv6) {
      problems.error(mark(in_file, "multicast"),
                     "multicast: its address and that of someip are of different IP versions");
    }
    const auto* other = firsts.other({route.service, route.instance, route.eventgroup}, in_file);
    if (other != nullptr && other->route.multicast != route.multicast) {
      problems.error(mark(in_file, "multicast"),
                     fmt::format("multicast: {} eventgroup 0x{:04x} has another in the route in line {}",
                                 instance_name(route), value(route.eventgroup), other->route.mark.line));
    }
  }
}

void ports(const std::vector<RouteInFile>& routes, std::uint16_t sd_port, documents::Problems& problems) {
  std::map<std::uint16_t, std::vector<const RouteInFile*>> users;  // one route of each service instance
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (!has(in_file, {"port", "service", "instance", "direction"})) {
      continue;
    }
    if (route.port == sd_port) {
      // [feat_req_someip_676]
      problems.error(mark(in_file, "port"), fmt::format("port: {} is service discovery's own port", sd_port));
      continue;
    }
    bool is_new = true;
    for (const RouteInFile* other : users[route.port]) {
      const Route& there = other->route;
      const bool same_service = there.service == route.service;
      if (there.direction != route.direction) {
        problems.error(
            mark(in_file, "port"),
            fmt::format("port: {} is used the other way ({}) by the route in line {}; take two ports",
                        route.port, to_string(there.direction), there.mark.line));
      } else if (same_service && there.instance != route.instance) {
        // Messages name the service but not the instance: only the port distinguishes instances.
        // [feat_req_someip_445]
        problems.error(
            mark(in_file, "port"),
            fmt::format(
                "port: {} already belongs to {} (line {}); instances of one service need ports of their own",
                route.port, instance_name(there), there.mark.line));
      } else if (!same_service) {
        continue;  // services may share a port  [feat_req_someip_445]
      }
      is_new = false;
      break;
    }
    if (is_new) {
      users[route.port].push_back(&in_file);
    }
  }
}

}  // namespace

void report_diagnostics_conflicts(const std::vector<RouteInFile>& routes,
                                  const std::vector<MethodInFile>& methods,
                                  const DiagnosticsSettings& diagnostics, documents::Problems& problems) {
  const bool published =
      (diagnostics.wanted && !methods.empty()) ||
      std::ranges::any_of(routes,
                          [](const RouteInFile& one) {
                            return (one.route.e2e && one.route.direction == Direction::someip_to_dds) ||
                                   (one.route.getter && one.route.getter->e2e);
                          }) ||
      std::ranges::any_of(methods, [](const MethodInFile& one) { return one.method.e2e.has_value(); });
  for (const RouteInFile& in_file : routes) {
    if (published && has(in_file, {"topic", "type"}) && in_file.route.topic == diagnostics.topic &&
        in_file.route.type != "diagnostic_msgs/msg/DiagnosticArray") {
      problems.error(
          mark(in_file, "type"),
          fmt::format("type: {} is where the diagnostics of this bridge are published, so it must be "
                      "diagnostic_msgs/msg/DiagnosticArray (see `diagnostics: topic`)",
                      diagnostics.topic));
    }
  }
}

void report_conflicts(const std::vector<RouteInFile>& routes, const SomeipSettings& someip,
                      documents::Problems& problems) {
  topics(routes, problems);
  events(routes, problems);
  instances(routes, problems);
  eventgroups(routes, someip.address.v6, problems);
  ports(routes, someip.sd.port, problems);
}

}  // namespace trestle::carry
