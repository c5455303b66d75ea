#include "bridge/carry/config/elements.hpp"
#include "bridge/messages/types/names.hpp"

namespace trestle::carry {
namespace {

/// The keys that all parts of a field share.
struct FieldKeys {
  std::string topic;
  std::string type;
  MethodInFile common;
  std::optional<E2eSettings> e2e_of_event;
  std::optional<E2eSettings> e2e_of_getter;
  std::optional<E2eSettings> e2e_of_setter;
};

/// The keys that the getter and the setter each have.
struct AccessKeys {
  messages::FieldAccess access;
  const char* id;
  const char* service;
  const char* type;
  const char* suffix;  ///< for the name of the service, if none is given
};
constexpr AccessKeys getter_keys{messages::FieldAccess::get, "getter", "get_service", "get_type", "/get"};
constexpr AccessKeys setter_keys{messages::FieldAccess::set, "setter", "set_service", "set_type", "/set"};

/// The notifier, if there is one.
std::optional<RouteInFile> load_notifier(Element& element, const FieldKeys& field,
                                         documents::Problems& problems) {
  RouteInFile result = route_beside(field.common, field.topic, field.type);
  Route& route = result.route;
  const bool has_event = element.read_good("event", id_of<someip::MethodId>(), route.event);
  if (element.is_missing("event")) {
    element.read("eventgroup", id_of<someip::EventgroupId>(), route.eventgroup);
    static_cast<void>(element.child("multicast"));
    load_subscribe(element, true, "", route.presence, problems);
    for (const char* key : {"eventgroup", "multicast", "subscribe"}) {
      if (!element.is_missing(key)) {
        problems.error(element.use_mark(key),
                       std::string{key} + ": belongs to the `event`, which is missing");
      }
    }
    return std::nullopt;
  }
  if (has_event) {
    check_event_id(element, route.event, problems);
  }
  element.require("eventgroup", id_of<someip::EventgroupId>(), route.eventgroup);
  route.qos = {{.reliable = true, .transient_local = true, .depth = 1}};
  const bool is_offered = element.has("server") && field.common.method.server == Server::ros;
  load_subscribe(element, !is_offered, "fields with server: someip", route.presence, problems);
  load_multicast(element, route, problems);
  route.e2e = field.e2e_of_event;
  result.good = field.common.good;
  return result;
}

/// The getter or setter as a method, if there is one.
/// @param notifier  its route answers a getter that has no service.
std::optional<MethodInFile> load_access(documents::Section& section, const AccessKeys& keys,
                                        const FieldKeys& field, RouteInFile* notifier,
                                        documents::Problems& problems) {
  MethodInFile result = field.common;
  MethodRoute& method = result.method;
  method.access = keys.access;
  method.value_type = field.type;
  method.e2e = keys.access == messages::FieldAccess::get ? field.e2e_of_getter : field.e2e_of_setter;
  const bool has_id = !section.is_missing(keys.id);
  if (section.read(keys.id, id_of<someip::MethodId>(), method.method)) {
    result.good.emplace(keys.id, section.use_mark(keys.id));
    check_method_id(section, keys.id, method.method, problems);
  }
  const bool has_name = section.read(keys.service, service_name(), method.ros_service);
  const bool has_type = section.read(keys.type, service_type_name(), method.type);
  for (const char* key : {keys.service, keys.type}) {
    if (!has_id && !section.is_missing(key)) {
      problems.error(section.use_mark(key),
                     std::string{key} + ": belongs to the `" + keys.id + "`, which is missing");
    }
  }
  if (!has_id) {
    return std::nullopt;
  }
  if (keys.access == messages::FieldAccess::get && method.server == Server::ros && notifier != nullptr &&
      section.is_missing(keys.service) && section.is_missing(keys.type)) {
    if (result.good.contains(keys.id)) {
      notifier->route.getter = {method.method, method.e2e};
      notifier->good.emplace(keys.id, section.use_mark(keys.id));
    }
    return std::nullopt;
  }
  if (has_name) {
    result.good.emplace("ros_service", section.use_mark(keys.service));
  } else if (field.common.good.contains("topic")) {
    method.ros_service = field.topic + keys.suffix;
    result.good.emplace("ros_service", section.use_mark("topic"));
    if (section.is_missing(keys.service) && !messages::is_topic_name(method.ros_service)) {
      problems.error(section.use_mark("topic"),
                     std::string{"topic: is too long for the service that is named after it, with "} +
                         keys.suffix + "; give it another name by `" + keys.service + "`");
    }
  }
  if (has_type) {
    result.type_mark = section.value_mark(keys.type);
    result.type_key = keys.type;
  } else if (field.common.good.contains("type")) {
    method.type = field_service_name(field.type, keys.access);
  }
  return result;
}

}  // namespace

FieldInFile load_field(const YAML::Node& node, documents::Problems& problems) {
  FieldKeys field;
  MethodRoute& method = field.common.method;
  Element element{node, "field", field.common.good, problems};
  method.mark = element.mark();
  element.require("topic", topic_name(), field.topic);
  element.require("type", type_name(), field.type);
  field.common.type_mark = element.value_mark("type");
  load_service(element, method);
  load_calls(element, method, problems);
  load_e2e_of_parts(element, element.has("server") ? std::optional{method.server} : std::nullopt,
                    {{"event", true, &field.e2e_of_event},
                     {"getter", false, &field.e2e_of_getter},
                     {"setter", false, &field.e2e_of_setter}},
                    problems);

  FieldInFile result{load_notifier(element, field, problems), {}};
  for (const AccessKeys& keys : {getter_keys, setter_keys}) {
    if (auto part = load_access(element, keys, field, result.route ? &*result.route : nullptr, problems)) {
      result.methods.push_back(std::move(*part));
    }
  }
  for (const auto& [key, e2e] : {std::pair{"event", &field.e2e_of_event},
                                 {getter_keys.id, &field.e2e_of_getter},
                                 {setter_keys.id, &field.e2e_of_setter}}) {
    if (*e2e && element.is_missing(key)) {
      problems.error(element.use_mark("e2e"),
                     std::string{"e2e: has settings of the `"} + key + "`, which is missing");
    }
  }
  // A server that refuses a value says no more than that: the getter or the notifier gives the value for the
  // answer to ROS.
  if (!result.methods.empty() && method.server == Server::someip) {
    MethodRoute& last = result.methods.back().method;
    if (result.methods.size() == 2) {
      last.getter = {result.methods[0].method.method, field.e2e_of_getter};
    } else if (last.access == messages::FieldAccess::set && result.route) {
      last.notifier = result.route->route.event;
    }
  }
  const bool has_none =
      element.is_missing("event") && element.is_missing(getter_keys.id) && element.is_missing(setter_keys.id);
  if (has_none) {
    // [feat_req_someip_632]
    problems.error(element.mark(), "a field needs at least one of 'event', 'getter' and 'setter'");
  }
  element.finish();
  return result;
}

}  // namespace trestle::carry
