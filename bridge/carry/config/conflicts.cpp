#include "bridge/carry/config/conflicts.hpp"

#include <fmt/format.h>

#include <map>
#include <tuple>

#include "bridge/carry/config/load_access.hpp"

namespace trestle::carry {
namespace {

using someip::value;

bool has(const GoodKeys& good, std::initializer_list<const char*> keys) {
  return std::ranges::all_of(keys, [&](const char* key) { return good.contains(key); });
}

documents::Mark mark(const RouteInFile& route, const char* key) {
  return route.good.find(key)->second;
}

std::string instance_name(someip::ServiceId service, someip::InstanceId instance) {
  return fmt::format("service 0x{:04x} instance 0x{:04x}", value(service), value(instance));
}
std::string instance_name(const Route& route) {
  return instance_name(route.service, route.instance);
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
    if (has(in_file.good, {"topic", "direction"})) {
      if (const auto* other = one_way.other({route.topic, route.direction}, in_file)) {
        problems.error(mark(in_file, "topic"),
                       fmt::format("topic: {} is already routed {} by the route in line {}", route.topic,
                                   to_string(route.direction), other->route.mark.line));
      }
    }
    if (has(in_file.good, {"topic", "type"})) {
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
    if (!has(in_file.good, {"service", "instance", "event", "direction"})) {
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
    if (!has(in_file.good, {"service", "instance", "direction"})) {
      continue;
    }
    const auto* other = firsts.other({route.service, route.instance, route.direction}, in_file);
    if (other == nullptr) {
      continue;
    }
    const auto agree = [&](const char* key, std::uint64_t here, std::uint64_t there) {
      if (here != there && has(in_file.good, {key}) && has(other->good, {key})) {
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
    if (!route.multicast || !has(in_file.good, {"service", "instance", "eventgroup"})) {
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

template <typename InFile>
void peers(const InFile& in_file, const std::vector<sd::Subnet>& peers, bool ipv6,
           documents::Problems& problems) {
  if (const auto found = in_file.good.find("peers"); found != in_file.good.end()) {
    check_peers(found->second, peers, ipv6, problems);
  }
}

void ports(const std::vector<RouteInFile>& routes, std::uint16_t sd_port, documents::Problems& problems) {
  std::map<std::uint16_t, std::vector<const RouteInFile*>> users;  // one route of each service instance
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (!has(in_file.good, {"port", "service", "instance", "direction"})) {
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

/// What methods and routes have in common: a service instance that they offer or use. A getter that is
/// answered by a route counts as a use of its own.
struct Use {
  const char* kind;  ///< "method" or "route"
  const char* key;   ///< the key of its id in the file
  bool is_called;    ///< otherwise it is an event; events are compared elsewhere
  const GoodKeys* good;
  documents::Mark mark;
  someip::ServiceId service;
  someip::InstanceId instance;
  someip::MethodId member;
  bool offered;
  std::uint16_t port;
  std::uint8_t major;
  std::uint32_t minor;
};

const char* key_of(const MethodRoute& method) {
  return method.access == messages::FieldAccess::get   ? "getter"
         : method.access == messages::FieldAccess::set ? "setter"
                                                       : "method";
}

const char* name_key_of(const MethodRoute& method) {
  return method.access == messages::FieldAccess::get   ? "get_service"
         : method.access == messages::FieldAccess::set ? "set_service"
                                                       : "ros_service";
}

std::vector<Use> uses_of(const std::vector<MethodInFile>& methods, const std::vector<RouteInFile>& routes) {
  std::vector<Use> uses;
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (has(in_file.good, {"service", "instance", "event", "direction"})) {
      uses.push_back({"route", "event", false, &in_file.good, route.mark, route.service, route.instance,
                      route.event, route.direction == Direction::dds_to_someip, route.port, route.major,
                      route.minor});
    }
  }
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (route.getter && has(in_file.good, {"service", "instance", "getter", "server"})) {
      uses.push_back({"field", "getter", true, &in_file.good, route.mark, route.service, route.instance,
                      route.getter->id, true, route.port, route.major, route.minor});
    }
  }
  for (const MethodInFile& in_file : methods) {
    const MethodRoute& method = in_file.method;
    if (has(in_file.good, {"service", "instance", key_of(method), "server"})) {
      uses.push_back({method.access == messages::FieldAccess::none ? "method" : "field", key_of(method), true,
                      &in_file.good, method.mark, method.service, method.instance, method.method,
                      method.server == Server::ros, method.port, method.major, method.minor});
    }
  }
  return uses;
}

void names(const std::vector<MethodInFile>& methods, documents::Problems& problems) {
  std::map<std::string, documents::Mark> firsts;
  for (const MethodInFile& in_file : methods) {
    if (has(in_file.good, {"ros_service"})) {
      const auto [first, is_new] = firsts.try_emplace(in_file.method.ros_service, in_file.method.mark);
      if (!is_new) {
        problems.error(in_file.good.find("ros_service")->second,
                       fmt::format("{}: {} already belongs to the method in line {}",
                                   name_key_of(in_file.method), first->first, first->second.line));
      }
    }
  }
}

/// Reports why a method and an earlier use cannot belong to one service.
void compare(const Use& method, const Use& other, documents::Problems& problems) {
  const std::string whose = instance_name(method.service, method.instance);
  const auto error = [&](const char* key, const std::string& text) {
    problems.error(method.good->find(key)->second, std::string{key} + ": " + text);
  };
  if (method.member == other.member) {
    error(method.key, fmt::format("{} id 0x{:04x} already belongs to the {} in line {}", whose,
                                  value(method.member), other.kind, other.mark.line));
  }
  if (method.offered != other.offered) {
    error("server", fmt::format("{} is {} by the {} in line {}: either we offer it or somebody else does",
                                whose, other.offered ? "offered" : "used", other.kind, other.mark.line));
    return;
  }
  const auto agree = [&](const char* key, std::uint64_t here, std::uint64_t there) {
    if (here != there && has(*method.good, {key}) && has(*other.good, {key})) {
      error(key, fmt::format("{} has {} in the {} in line {}", whose, there, other.kind, other.mark.line));
    }
  };
  agree("port", method.port, other.port);
  agree("major", method.major, other.major);
  if (method.offered) {
    agree("minor", method.minor, other.minor);
  }
}

void instances_of_methods(const std::vector<Use>& uses, documents::Problems& problems) {
  for (auto use = uses.begin(); use != uses.end(); ++use) {
    if (!use->is_called) {
      continue;
    }
    bool compared = false;  // one complaint is enough, the others would say the same
    for (auto other = uses.begin(); other != use; ++other) {
      const bool same = other->service == use->service && other->instance == use->instance;
      if (same && (!compared || other->member == use->member)) {
        compare(*use, *other, problems);
        compared = true;
      }
    }
  }
}

void ports_of_methods(const std::vector<Use>& uses, std::uint16_t sd_port, documents::Problems& problems) {
  for (auto use = uses.begin(); use != uses.end(); ++use) {
    if (!use->is_called || !use->good->contains("port")) {
      continue;
    }
    const documents::Mark at = use->good->find("port")->second;
    if (use->port == sd_port) {
      // [feat_req_someip_676]
      problems.error(at, fmt::format("port: {} is service discovery's own port", use->port));
      continue;
    }
    for (auto other = uses.begin(); other != use; ++other) {
      if (other->port != use->port || !other->good->contains("port")) {
        continue;
      }
      if (!other->offered) {
        problems.error(at, fmt::format("port: {} is used the other way by the {} in line {}; take two ports",
                                       use->port, other->kind, other->mark.line));
        break;
      }
      if (other->service == use->service && other->instance != use->instance) {
        // [feat_req_someip_445]
        problems.error(
            at, fmt::format("port: {} already belongs to {} (line {}); instances of one service need "
                            "ports of their own",
                            use->port, instance_name(other->service, other->instance), other->mark.line));
        break;
      }
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
    if (published && has(in_file.good, {"topic", "type"}) && in_file.route.topic == diagnostics.topic &&
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
  ports(routes, someip.port, problems);
  for (const RouteInFile& in_file : routes) {
    peers(in_file, in_file.route.peers, someip.address.v6, problems);
  }
}

void report_method_conflicts(const std::vector<MethodInFile>& methods, const std::vector<RouteInFile>& routes,
                             const SomeipSettings& someip, documents::Problems& problems) {
  names(methods, problems);
  const std::vector<Use> uses = uses_of(methods, routes);
  instances_of_methods(uses, problems);
  ports_of_methods(uses, someip.port, problems);
  for (const MethodInFile& in_file : methods) {
    peers(in_file, in_file.method.peers, someip.address.v6, problems);
  }
}

}  // namespace trestle::carry
