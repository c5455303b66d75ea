#include "bridge/carry/config/method_conflicts.hpp"

#include <fmt/format.h>

#include <map>
#include <tuple>

namespace trestle::carry {
namespace {

using someip::value;
using Good = std::map<std::string, documents::Mark, std::less<>>;

bool is_good(const Good& good, std::initializer_list<const char*> keys) {
  return std::ranges::all_of(keys, [&](const char* key) { return good.contains(key); });
}

std::string in_words(someip::ServiceId service, someip::InstanceId instance) {
  return fmt::format("service 0x{:04x} instance 0x{:04x}", value(service), value(instance));
}

/// What methods and routes have in common: a service instance that they offer or use. A getter that is
/// answered by a route counts as a use of its own.
struct Use {
  const char* kind;  ///< "method" or "route"
  const char* key;   ///< the key of its id in the file
  bool is_called;    ///< otherwise it is an event; events are compared elsewhere
  const Good* good;
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
    if (is_good(in_file.good, {"service", "instance", "event", "direction"})) {
      uses.push_back({"route", "event", false, &in_file.good, route.mark, route.service, route.instance,
                      route.event, route.direction == Direction::dds_to_someip, route.port, route.major,
                      route.minor});
    }
  }
  for (const RouteInFile& in_file : routes) {
    const Route& route = in_file.route;
    if (route.getter && is_good(in_file.good, {"service", "instance", "getter", "server"})) {
      uses.push_back({"field", "getter", true, &in_file.good, route.mark, route.service, route.instance,
                      route.getter->id, true, route.port, route.major, route.minor});
    }
  }
  for (const MethodInFile& in_file : methods) {
    const MethodRoute& method = in_file.method;
    if (is_good(in_file.good, {"service", "instance", key_of(method), "server"})) {
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
    if (is_good(in_file.good, {"ros_service"})) {
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
  const std::string whose = in_words(method.service, method.instance);
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
    if (here != there && is_good(*method.good, {key}) && is_good(*other.good, {key})) {
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
        problems.error(at,
                       fmt::format("port: {} already belongs to {} (line {}); instances of one service need "
                                   "ports of their own",
                                   use->port, in_words(other->service, other->instance), other->mark.line));
        break;
      }
    }
  }
}

/// For a server we are one client: its requests for a method share one counter, for all instances.
void protection_of_calls(const std::vector<MethodInFile>& methods, documents::Problems& problems) {
  std::map<std::pair<someip::ServiceId, someip::MethodId>, const MethodRoute*> firsts;
  for (const MethodInFile& in_file : methods) {
    const MethodRoute& method = in_file.method;
    if (!method.e2e || method.server != Server::someip ||
        !is_good(in_file.good, {"service", key_of(method), "server"})) {
      continue;
    }
    const auto [first, is_new] = firsts.try_emplace({method.service, method.method}, &method);
    if (!is_new && first->second->e2e != method.e2e) {
      problems.error(in_file.good.find("service")->second,
                     fmt::format("service: method 0x{:04x} of service 0x{:04x} has another e2e in line {}: "
                                 "all instances must have the same",
                                 value(method.method), value(method.service), first->second->mark.line));
    }
  }
}

}  // namespace

void report_method_conflicts(const std::vector<MethodInFile>& methods, const std::vector<RouteInFile>& routes,
                             std::uint16_t sd_port, documents::Problems& problems) {
  names(methods, problems);
  const std::vector<Use> uses = uses_of(methods, routes);
  instances_of_methods(uses, problems);
  ports_of_methods(uses, sd_port, problems);
  protection_of_calls(methods, problems);
}

}  // namespace trestle::carry
