#include "bridge/carry/config/pattern_conflicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bridge/carry/config/topic_pattern.hpp"

namespace trestle::carry {
namespace {

using someip::value;

struct PortUser {
  const char* kind;
  const Route* route;
};

/// The owner of an id, for error messages; `name` is its topic or ROS service.
struct IdOwner {
  const char* kind;
  std::string name;
  int line;
};

std::multimap<someip::ServiceId, IdOwner> owners_of_ids(const std::vector<RouteInFile>& routes,
                                                        const std::vector<MethodInFile>& methods) {
  std::multimap<someip::ServiceId, IdOwner> owners;
  for (const RouteInFile& in_file : routes) {
    if (in_file.good.contains("service")) {
      owners.emplace(in_file.route.service, IdOwner{"route", in_file.route.topic, in_file.route.mark.line});
    }
  }
  for (const MethodInFile& in_file : methods) {
    if (in_file.good.contains("service")) {
      owners.emplace(in_file.method.service,
                     IdOwner{"method", in_file.method.ros_service, in_file.method.mark.line});
    }
  }
  return owners;
}

}  // namespace

const TopicPattern* pattern_of(const std::vector<TopicPattern>& patterns, std::string_view topic) {
  const auto at = std::ranges::find_if(patterns, [&](const TopicPattern& pattern) {
    return matches(pattern.topics, topic) &&
           std::ranges::none_of(pattern.exclude,
                                [&](const std::string& excluded) { return matches(excluded, topic); });
  });
  return at == patterns.end() ? nullptr : &*at;
}

void report_pattern_conflicts(const std::vector<PatternInFile>& patterns,
                              const std::vector<RouteInFile>& routes, std::uint16_t sd_port,
                              documents::Problems& problems) {
  std::vector<PortUser> users;
  for (const RouteInFile& in_file : routes) {
    if (in_file.good.contains("port") && in_file.good.contains("direction")) {
      users.push_back({"route", &in_file.route});
    }
  }
  for (const PatternInFile& in_file : patterns) {
    const Route& route = in_file.pattern.route;
    if (!in_file.good.contains("port")) {
      continue;
    }
    const documents::Mark at = in_file.good.find("port")->second;
    if (route.port == sd_port) {
      // [feat_req_someip_676]
      problems.error(at, fmt::format("port: {} is service discovery's own port", route.port));
    }
    const auto other = std::ranges::find_if(users, [&](const PortUser& user) {
      return user.route->port == route.port && user.route->direction != route.direction;
    });
    if (other != users.end()) {
      problems.error(
          at,
          fmt::format("port: {} is used the other way ({}) by the {} in line {}; take two ports", route.port,
                      to_string(other->route->direction), other->kind, other->route->mark.line));
    }
    users.push_back({"pattern", &route});
  }
}

void report_lock_conflicts(const BridgeConfig& config, const std::vector<RouteInFile>& routes,
                           const std::vector<MethodInFile>& methods, documents::Problems& lock_problems) {
  const auto owners = owners_of_ids(routes, methods);
  for (const LockedTopic& locked : config.locked) {
    const auto [begin, end] = owners.equal_range(locked.service);
    for (auto at = begin; at != end; ++at) {
      const IdOwner& owner = at->second;
      if (owner.name != locked.topic) {
        lock_problems.error(
            locked.mark,
            fmt::format("service: 0x{:04x} of {} also belongs to the {} {} in line {} of {}: give that "
                        "one another id, or remove this line, so that {} gets a new id",
                        value(locked.service), locked.topic, owner.kind, owner.name, owner.line, config.file,
                        locked.topic));
      }
    }
    const TopicPattern* const pattern = pattern_of(config.patterns, locked.topic);
    if (pattern != nullptr && pattern->route.direction == Direction::dds_to_someip &&
        !pattern->services.has(locked.service)) {
      lock_problems.error(
          locked.mark,
          fmt::format("service: 0x{:04x} of {} is outside of 0x{:04x}-0x{:04x}, the ids of the pattern in "
                      "line {} of {}: widen that range, or remove this line, so that the topic gets a new id",
                      value(locked.service), locked.topic, value(pattern->services.first),
                      value(pattern->services.last), pattern->mark.line, config.file));
    }
  }
}

std::vector<RouteInFile> locked_routes(const BridgeConfig& config, const std::vector<RouteInFile>& routes,
                                       const TypeCheck& check_type, documents::Problems& lock_problems) {
  std::vector<RouteInFile> result;
  for (const LockedTopic& locked : config.locked) {
    const TopicPattern* const pattern = pattern_of(config.patterns, locked.topic);
    const bool has_route = std::ranges::any_of(
        routes, [&](const RouteInFile& in_file) { return in_file.route.topic == locked.topic; });
    if (pattern == nullptr || pattern->route.direction != Direction::someip_to_dds || has_route) {
      continue;
    }
    const std::string fault =
        check_type ? check_type({.type = locked.type}, pattern->route.rules, config.types).fault : "";
    if (!fault.empty()) {
      lock_problems.warning(locked.mark, fmt::format("type: {} gets no route: {}", locked.topic, fault));
      continue;
    }
    RouteInFile one{.route = pattern->route, .good = {}, .type_mark = pattern->mark};
    one.route.topic = locked.topic;
    one.route.type = locked.type;
    one.route.service = locked.service;
    if (pattern->follow_durability) {
      one.route.qos.transient_local = locked.transient_local && one.route.qos.reliable;
    }
    for (const char* const key :
         {"topic", "type", "direction", "service", "instance", "eventgroup", "event", "major", "minor"}) {
      one.good.emplace(key, pattern->mark);
    }
    if (pattern->route.port != 0) {
      one.good.emplace("port", pattern->mark);
    }
    result.push_back(std::move(one));
  }
  return result;
}

}  // namespace trestle::carry
