#include "bridge/carry/config/load_field.hpp"

#include "bridge/carry/config/load_e2e.hpp"
#include "bridge/carry/config/load_route.hpp"
#include "bridge/carry/config/load_version.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/load_wire.hpp"

namespace trestle::carry {
namespace {

/// The keys that all parts of a field share.
struct FieldKeys {
  std::string topic;
  std::string type;
  std::optional<Transport> transport;
  std::map<std::string, documents::Mark, std::less<>> good;
  MethodRoute method;  ///< ids, version, port and rules
  documents::Mark type_mark;
  std::optional<E2eSettings> e2e_of_event;
  std::optional<E2eSettings> e2e_of_getter;
  std::optional<E2eSettings> e2e_of_setter;

  [[nodiscard]] bool is_of(Server server) const { return good.contains("server") && method.server == server; }
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

void load_field_endpoint(documents::Section& section, FieldKeys& field, documents::Problems& problems) {
  Transport transport{};
  if (section.read("transport", udp_or_tcp(), transport)) {
    field.transport = transport;
  }
  const auto port = documents::as<std::uint16_t>(documents::whole_number(1, 65535));
  const bool is_offered = field.method.server == Server::ros && field.good.contains("server");
  if (is_offered) {
    if (section.require("port", port, field.method.port)) {
      field.good.emplace("port", section.use_mark("port"));
    }
  } else if (section.read("port", port, field.method.port) && field.good.contains("server")) {
    problems.error(
        section.use_mark("port"),
        "port: is where we offer a field, with server: ros; a SOME/IP server names its port in its offer");
  }
  if (section.read("offer", documents::one_of<bool>({{"while_served", false}, {"always", true}}),
                   field.method.offer_always) &&
      field.good.contains("server") && !is_offered) {
    problems.error(section.use_mark("offer"), "offer: is for fields with server: ros");
  }
}

/// The notifier, if there is one.
std::optional<RouteInFile> load_notifier(documents::Section& section, const FieldKeys& field,
                                         documents::Problems& problems) {
  RouteInFile result{{}, field.good, field.type_mark};
  Route& route = result.route;
  // The ranges are those of a route.
  const bool has_event = section.read(
      "event", documents::as<someip::MethodId>(documents::id_number(0x0001, 0xfffe)), route.event);
  if (section.is_missing("event")) {
    section.read("eventgroup", documents::as<someip::EventgroupId>(documents::id_number(0x0001, 0xfffe)),
                 route.eventgroup);
    static_cast<void>(section.child("multicast"));
    load_subscribe(section, true, "", route.presence, problems);
    for (const char* key : {"eventgroup", "multicast", "subscribe"}) {
      if (!section.is_missing(key)) {
        problems.error(section.use_mark(key),
                       std::string{key} + ": belongs to the `event`, which is missing");
      }
    }
    return std::nullopt;
  }
  if (has_event) {
    result.good.emplace("event", section.use_mark("event"));
    check_event_id(section, route.event, problems);
  }
  if (section.require("eventgroup", documents::as<someip::EventgroupId>(documents::id_number(0x0001, 0xfffe)),
                      route.eventgroup)) {
    result.good.emplace("eventgroup", section.use_mark("eventgroup"));
  }
  const MethodRoute& method = field.method;
  route.topic = field.topic;
  route.type = field.type;
  route.direction = method.server == Server::ros ? Direction::dds_to_someip : Direction::someip_to_dds;
  route.service = method.service;
  route.instance = method.instance;
  route.major = method.major;
  route.minor = method.minor;
  route.transport = field.transport.value_or(Transport::udp);
  route.port = method.port;
  route.rules = method.rules;
  route.tp = method.tp;
  route.qos = {{.reliable = true, .transient_local = true, .depth = 1}};
  route.presence.offer_while_published = method.server == Server::ros && !method.offer_always;
  route.presence.write_while_offered = method.server == Server::someip;
  load_subscribe(section, !field.is_of(Server::ros), "fields with server: someip", route.presence, problems);
  load_multicast(section, result, problems);
  route.e2e = field.e2e_of_event;
  route.from_bridges = method.from_bridges;
  route.mark = method.mark;
  return result;
}

/// The getter or setter as a method, if there is one.
/// @param notifier  its route answers a getter that has no service.
std::optional<MethodInFile> load_access(documents::Section& section, const AccessKeys& keys,
                                        const FieldKeys& field, RouteInFile* notifier,
                                        documents::Problems& problems) {
  MethodInFile result{field.method, field.good, field.type_mark};
  MethodRoute& method = result.method;
  method.access = keys.access;
  method.value_type = field.type;
  method.e2e = keys.access == messages::FieldAccess::get ? field.e2e_of_getter : field.e2e_of_setter;
  const bool has_id = !section.is_missing(keys.id);
  if (section.read(keys.id, documents::as<someip::MethodId>(documents::id_number(0x0001, 0xfffe)),
                   method.method)) {
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
  if (method.server == Server::ros) {
    method.transport = field.transport.value_or(Transport::udp);
  } else {
    method.transport = field.transport;
  }
  if (has_name) {
    result.good.emplace("ros_service", section.use_mark(keys.service));
  } else if (field.good.contains("topic")) {
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
  } else if (field.good.contains("type")) {
    method.type = field_service_name(field.type, keys.access);
  }
  return result;
}

}  // namespace

FieldInFile load_field(const YAML::Node& node, documents::Problems& problems) {
  FieldKeys field;
  MethodRoute& method = field.method;
  documents::Section section{node, "field", problems};
  method.mark = section.mark();
  const auto require = [&](const char* key, const auto& format, auto& into) {
    if (section.require(key, format, into)) {
      field.good.emplace(key, section.use_mark(key));
    }
  };

  require("topic", topic_name(), field.topic);
  require("type", type_name(), field.type);
  field.type_mark = section.value_mark("type");
  require("server", documents::one_of<Server>({{"someip", Server::someip}, {"ros", Server::ros}}),
          method.server);
  if (const auto server = field.good.find("server"); server != field.good.end()) {
    field.good.emplace("direction", server->second);
  }
  // The ranges are those of a route.
  require("service", documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd)), method.service);
  require("instance", documents::as<someip::InstanceId>(documents::id_number(0x0001, 0xfffe)),
          method.instance);
  load_field_endpoint(section, field, problems);
  load_version(section, method.server == Server::someip, method.major, method.minor);
  field.good.emplace("major", section.use_mark("major"));
  field.good.emplace("minor", section.use_mark("minor"));
  load_from_bridges(section, method.server == Server::ros || !field.good.contains("server"),
                    "fields with server: ros", method.from_bridges, problems);
  load_calls(section, method, problems);
  if (const YAML::Node wire = section.child("wire")) {
    messages::load_wire(wire, method.rules, problems);
  }

  load_e2e_of_parts(section, field.good.contains("server") ? std::optional{method.server} : std::nullopt,
                    {{"event", true, &field.e2e_of_event},
                     {"getter", false, &field.e2e_of_getter},
                     {"setter", false, &field.e2e_of_setter}},
                    problems);

  FieldInFile result{load_notifier(section, field, problems), {}};
  for (const AccessKeys& keys : {getter_keys, setter_keys}) {
    if (auto part = load_access(section, keys, field, result.route ? &*result.route : nullptr, problems)) {
      result.methods.push_back(std::move(*part));
    }
  }
  for (const auto& [key, e2e] : {std::pair{"event", &field.e2e_of_event},
                                 {getter_keys.id, &field.e2e_of_getter},
                                 {setter_keys.id, &field.e2e_of_setter}}) {
    if (*e2e && section.is_missing(key)) {
      problems.error(section.use_mark("e2e"),
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
      section.is_missing("event") && section.is_missing(getter_keys.id) && section.is_missing(setter_keys.id);
  if (has_none) {
    // [feat_req_someip_632]
    problems.error(section.mark(), "a field needs at least one of 'event', 'getter' and 'setter'");
  }
  section.finish();
  return result;
}

}  // namespace trestle::carry
