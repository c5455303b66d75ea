#include "bridge/carry/config/load_action.hpp"

#include "bridge/carry/config/load_e2e.hpp"
#include "bridge/carry/config/load_route.hpp"
#include "bridge/carry/config/load_version.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/load_wire.hpp"

namespace trestle::carry {
namespace {

/// What the parts of an action have in common.
struct Common {
  std::string name;
  std::string package;  ///< of the action type: "nav2_msgs/action/"
  std::string type;     ///< the rest of the type: "NavigateToPose"
  Server server = Server::someip;
  Transport transport = Transport::udp;
  bool any_transport = true;  ///< no transport was given
  std::map<std::string, documents::Mark, std::less<>> good;
  MethodRoute method;  ///< ids, version, port and rules
  Duration result_timeout = std::chrono::hours{1};
  someip::EventgroupId eventgroup{};
};

void load_action_endpoint(documents::Section& section, Common& common, documents::Problems& problems) {
  if (section.read("transport", udp_or_tcp(), common.transport)) {
    common.any_transport = false;
  }
  const auto port = documents::as<std::uint16_t>(documents::whole_number(1, 65535));
  if (common.server == Server::ros && common.good.contains("server")) {
    if (section.require("port", port, common.method.port)) {
      common.good.emplace("port", section.use_mark("port"));
    }
  } else if (section.read("port", port, common.method.port) && common.good.contains("server")) {
    problems.error(
        section.use_mark("port"),
        "port: is where we offer an action, with server: ros; a SOME/IP server names its port in its offer");
  }
  if (section.read("offer", documents::one_of<bool>({{"while_served", false}, {"always", true}}),
                   common.method.offer_always) &&
      common.server != Server::ros && common.good.contains("server")) {
    problems.error(section.use_mark("offer"), "offer: is for actions with server: ros");
  }
}

MethodInFile method_of(const Common& common, const char* name, const std::string& type) {
  MethodInFile result{common.method, common.good, {}};
  result.method.ros_service = common.name + "/_action/" + name;
  result.method.type = type;
  result.method.server = common.server;
  if (!common.any_transport || common.server == Server::ros) {
    result.method.transport = common.transport;
  }
  result.type_mark = common.method.mark;
  return result;
}

RouteInFile route_of(const Common& common, const char* name, const std::string& type) {
  RouteInFile result{{}, common.good, common.method.mark};
  Route& route = result.route;
  route.topic = common.name + "/_action/" + name;
  route.type = type;
  route.direction = common.server == Server::ros ? Direction::dds_to_someip : Direction::someip_to_dds;
  route.service = common.method.service;
  route.instance = common.method.instance;
  route.eventgroup = common.eventgroup;
  route.major = common.method.major;
  route.minor = common.method.minor;
  route.transport = common.transport;
  route.port = common.method.port;
  route.rules = common.method.rules;
  route.tp = common.method.tp;
  // ROS clients also see from the topics whether the server is there.
  route.presence.offer_while_published = common.server == Server::ros && !common.method.offer_always;
  route.presence.write_while_offered = common.server == Server::someip;
  route.from_bridges = common.method.from_bridges;
  route.mark = common.method.mark;
  return result;
}

/// Reads ids by their names; each one is required.
template <typename Into>
void load_ids(documents::Section& section, const char* key, std::uint64_t min, std::uint64_t max,
              documents::Problems& problems, std::initializer_list<std::pair<const char*, Into>> names) {
  const YAML::Node node = section.child(key);
  if (!node) {
    problems.error(
        section.mark(),
        std::string{"'"} + key + "' is missing in action: expected a mapping with the ids of its " + key);
    return;
  }
  documents::Section ids{node, key, problems};
  for (const auto& [name, in_file] : names) {
    someip::MethodId id{};
    if (ids.require(name, documents::as<someip::MethodId>(documents::id_number(min, max)), id)) {
      const documents::Mark mark = ids.use_mark(name);
      if constexpr (std::is_same_v<Into, MethodInFile*>) {
        in_file->method.method = id;
        in_file->good.emplace("method", mark);
      } else {
        in_file->route.event = id;
        in_file->good.emplace("event", mark);
      }
    }
  }
  ids.finish();
}

}  // namespace

ActionInFile load_action(const YAML::Node& node, documents::Problems& problems) {
  Common common;
  documents::Section section{node, "action", problems};
  common.method.mark = section.mark();
  const auto require = [&](const char* key, const auto& format, auto& into) {
    const bool is_good = section.require(key, format, into);
    if (is_good) {
      common.good.emplace(key, section.use_mark(key));
    }
    return is_good;
  };

  const documents::Format<std::string> name{
      "an action such as /arm/move (absolute; letters, digits, '_')",
      [](std::string_view text) -> std::optional<std::string> {
        return messages::is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
      }};
  if (require("action", name, common.name)) {
    // The names of the parts are made from it.
    common.good.emplace("ros_service", section.use_mark("action"));
    common.good.emplace("topic", section.use_mark("action"));
  }
  std::string type;
  const documents::Format<std::string> type_name{
      "an action type such as example_interfaces/action/Fibonacci",
      [](std::string_view text) -> std::optional<std::string> {
        return messages::is_action_type_name(text) ? std::optional<std::string>{text} : std::nullopt;
      }};
  if (require("type", type_name, type)) {
    common.package = type.substr(0, type.rfind('/') + 1);
    common.type = type.substr(type.rfind('/') + 1);
  }
  if (require("server", documents::one_of<Server>({{"someip", Server::someip}, {"ros", Server::ros}}),
              common.server)) {
    common.good.emplace("direction", section.use_mark("server"));
  }
  // The ranges are those of a route.
  require("service", documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd)),
          common.method.service);
  require("instance", documents::as<someip::InstanceId>(documents::id_number(0x0001, 0xfffe)),
          common.method.instance);
  require("eventgroup", documents::as<someip::EventgroupId>(documents::id_number(0x0001, 0xfffe)),
          common.eventgroup);
  load_action_endpoint(section, common, problems);
  load_version(section, common.server == Server::someip, common.method.major, common.method.minor);
  common.good.emplace("major", section.use_mark("major"));
  common.good.emplace("minor", section.use_mark("minor"));
  section.read("result_timeout", documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{24}),
               common.result_timeout);
  load_from_bridges(section, common.server == Server::ros || !common.good.contains("server"),
                    "actions with server: ros", common.method.from_bridges, problems);
  load_calls(section, common.method, problems);
  if (const YAML::Node wire = section.child("wire")) {
    messages::load_wire(wire, common.method.rules, problems);
    if (!common.method.rules.types.empty()) {
      problems.error(section.use_mark("wire"),
                     "wire: the messages of an action have no types with rules of their own");
    }
  }

  ActionInFile action{{method_of(common, "send_goal", common.package + common.type + "_SendGoal"),
                       method_of(common, "cancel_goal", "action_msgs/srv/CancelGoal"),
                       method_of(common, "get_result", common.package + common.type + "_GetResult")},
                      {route_of(common, "feedback", common.package + common.type + "_FeedbackMessage"),
                       route_of(common, "status", "action_msgs/msg/GoalStatusArray")}};
  auto& [send_goal, cancel_goal, get_result] = action.methods;
  auto& [feedback, status] = action.routes;
  get_result.method.timeout = common.result_timeout;  // the answer comes only when the goal has ended
  status.route.qos = {{.reliable = true, .transient_local = true, .depth = 1}};
  load_ids<MethodInFile*>(
      section, "methods", 0x0001, 0x7fff, problems,
      {{"send_goal", &send_goal}, {"cancel_goal", &cancel_goal}, {"get_result", &get_result}});
  load_ids<RouteInFile*>(section, "events", 0x8000, 0xfffe, problems,
                         {{"feedback", &feedback}, {"status", &status}});
  load_e2e_of_parts(section, common.good.contains("direction") ? std::optional{common.server} : std::nullopt,
                    {{"send_goal", false, &send_goal.method.e2e},
                     {"cancel_goal", false, &cancel_goal.method.e2e},
                     {"get_result", false, &get_result.method.e2e},
                     {"feedback", true, &feedback.route.e2e},
                     {"status", true, &status.route.e2e}},
                    problems);
  load_subscribe(section, common.server == Server::someip || !common.good.contains("direction"),
                 "actions with server: someip", feedback.route.presence, problems);
  status.route.presence.subscribe_while_read = feedback.route.presence.subscribe_while_read;
  load_multicast(section, feedback, problems);
  status.route.multicast = feedback.route.multicast;  // both are in the same eventgroup
  section.finish();
  return action;
}

}  // namespace trestle::carry
