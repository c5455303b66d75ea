#include "bridge/carry/config/elements.hpp"
#include "bridge/messages/types/names.hpp"

namespace trestle::carry {
namespace {

MethodInFile method_of(const MethodInFile& common, const std::string& name, std::string type) {
  MethodInFile result = common;
  result.method.ros_service += "/_action/" + name;
  result.method.type = std::move(type);
  return result;
}

/// Reads ids by their names; each one is required.
template <typename Into>
void load_ids(documents::Section& section, const char* key, std::uint64_t min, std::uint64_t max,
              documents::Problems& problems, std::initializer_list<std::pair<const char*, Into>> names) {
  section.note_required(key, documents::AskedKey::Kind::mapping);
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
    if (ids.require(name, id_of<someip::MethodId>(min, max), id)) {
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
  MethodInFile common;
  MethodRoute& method = common.method;
  Element element{node, "action", common.good, problems};
  method.mark = common.type_mark = element.mark();

  if (element.require("action",
                      documents::text_that("an action such as /arm/move (absolute; letters, digits, '_')",
                                           messages::is_topic_name, messages::topic_name_pattern),
                      method.ros_service)) {
    // The names of the parts are made from it.
    element.note("action", "ros_service");
    element.note("action", "topic");
  }
  std::string type;
  element.require("type",
                  documents::text_that("an action type such as example_interfaces/action/Fibonacci",
                                       messages::is_action_type_name, messages::name_pattern("action")),
                  type);
  load_service(element, method);
  someip::EventgroupId eventgroup{};
  element.require("eventgroup", id_of<someip::EventgroupId>(), eventgroup);
  Duration result_timeout = std::chrono::hours{1};
  element.read("result_timeout", documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{24}),
               result_timeout);
  load_calls(element, method, problems);
  if (!method.rules.types.empty()) {
    problems.error(element.use_mark("wire"),
                   "wire: the messages of an action have no types with rules of their own");
  }

  Route both = route_beside(common, {}, {}).route;
  load_multicast(element, both, problems);
  const auto route_of = [&](const char* name, std::string message) {
    RouteInFile result = route_beside(common, method.ros_service + "/_action/" + name, std::move(message));
    result.route.eventgroup = eventgroup;
    result.route.multicast = both.multicast;
    return result;
  };
  ActionInFile action{{method_of(common, "send_goal", type + "_SendGoal"),
                       method_of(common, "cancel_goal", "action_msgs/srv/CancelGoal"),
                       method_of(common, "get_result", type + "_GetResult")},
                      {route_of("feedback", type + "_FeedbackMessage"),
                       route_of("status", "action_msgs/msg/GoalStatusArray")}};
  auto& [send_goal, cancel_goal, get_result] = action.methods;
  auto& [feedback, status] = action.routes;
  get_result.method.timeout = result_timeout;  // the answer comes only when the goal has ended
  status.route.qos = {{.reliable = true, .transient_local = true, .depth = 1}};
  load_ids<MethodInFile*>(
      element, "methods", 0x0001, 0x7fff, problems,
      {{"send_goal", &send_goal}, {"cancel_goal", &cancel_goal}, {"get_result", &get_result}});
  load_ids<RouteInFile*>(element, "events", 0x8000, 0xfffe, problems,
                         {{"feedback", &feedback}, {"status", &status}});
  load_e2e_of_parts(element, element.has("server") ? std::optional{method.server} : std::nullopt,
                    {{"send_goal", false, &send_goal.method.e2e},
                     {"cancel_goal", false, &cancel_goal.method.e2e},
                     {"get_result", false, &get_result.method.e2e},
                     {"feedback", true, &feedback.route.e2e},
                     {"status", true, &status.route.e2e}},
                    problems);
  load_subscribe(element, method.server == Server::someip || !element.has("server"),
                 "actions with server: someip", feedback.route.presence, problems);
  status.route.presence.subscribe_while_read = feedback.route.presence.subscribe_while_read;
  element.finish();
  return action;
}

}  // namespace trestle::carry
