#include "bridge/carry/config/elements.hpp"
#include "bridge/carry/config/load_access.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/load_wire.hpp"

namespace trestle::carry {

documents::Format<std::string> service_name() {
  return documents::text_that("a service such as /arm/set_mode (absolute; letters, digits, '_')",
                              messages::is_topic_name, messages::topic_name_pattern);
}

documents::Format<std::string> service_type_name() {
  return documents::text_that("a service type such as std_srvs/srv/SetBool", messages::is_service_type_name,
                              messages::name_pattern("srv"));
}

void check_method_id(const documents::Section& section, const char* key, someip::MethodId method,
                     documents::Problems& problems) {
  // Advice of the specification; deployments with higher ids exist.  [feat_req_someip_626]
  if (someip::value(method) >= 0x8000) {
    problems.warning(
        section.value_mark(key),
        std::string{key} + ": ids from 0x8000 on are meant for events; is this the one the peer uses?");
  }
}

void load_service(Element& element, MethodRoute& method) {
  if (element.require("server", documents::one_of<Server>({{"someip", Server::someip}, {"ros", Server::ros}}),
                      method.server)) {
    element.note("server", "direction");
  }
  element.require("service", service_id(), method.service);
  element.require("instance", id_of<someip::InstanceId>(), method.instance);
}

void load_calls(Element& element, MethodRoute& method, documents::Problems& problems) {
  Transport transport{};
  if (element.read("transport", udp_or_tcp(), transport)) {
    method.transport = transport;
  }
  const bool is_offered = element.has("server") && method.server == Server::ros;
  if (is_offered) {
    element.require("port", port_number(), method.port);
    method.transport = method.transport.value_or(Transport::udp);
  } else if (element.read("port", port_number(), method.port) && element.has("server")) {
    problems.error(element.use_mark("port"),
                   std::string{"port: is where we offer "} + (element.name() == "action" ? "an " : "a ") +
                       element.name() + ", with server: ros; a SOME/IP server names its port in its offer");
  }
  const std::string where = element.name() + "s with server: ros";
  if (element.read("offer", documents::one_of<bool>({{"while_served", false}, {"always", true}}),
                   method.offer_always) &&
      element.has("server") && !is_offered) {
    problems.error(element.use_mark("offer"), "offer: is for " + where);
  }
  load_version(element, method.server == Server::someip || !element.has("server"), method.major,
               method.minor);
  load_from_bridges(element, is_offered || !element.has("server"), where, method.from_bridges, problems);
  if (load_peers(element, method.peers, problems)) {
    element.note("peers");
  }
  element.read("timeout", documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{1}),
               method.timeout);
  element.read("max_calls", documents::as<std::size_t>(documents::whole_number(1, 10'000)), method.max_calls);
  element.read("max_message", message_size(), method.tp.max_message);
  if (const YAML::Node node = element.child("tp")) {
    documents::Section tp{node, "tp", problems};
    load_pacing(tp, method.tp);
    tp.finish();
  }
  element.read("ros_form",
               documents::one_of<ServiceForm>({{"auto", ServiceForm::automatic},
                                               {"fastrtps", ServiceForm::fastrtps},
                                               {"cyclonedds", ServiceForm::cyclonedds}}),
               method.form);
  if (const YAML::Node wire = element.child("wire")) {
    messages::load_wire(wire, method.rules, problems);
  }
}

RouteInFile route_beside(const MethodInFile& common, std::string topic, std::string type) {
  const MethodRoute& method = common.method;
  const bool is_offered = method.server == Server::ros;
  RouteInFile result{{}, common.good, common.type_mark};
  Route& route = result.route;
  route.topic = std::move(topic);
  route.type = std::move(type);
  route.direction = is_offered ? Direction::dds_to_someip : Direction::someip_to_dds;
  route.service = method.service;
  route.instance = method.instance;
  route.major = method.major;
  route.minor = method.minor;
  route.transport = method.transport.value_or(Transport::udp);
  route.port = method.port;
  route.rules = method.rules;
  route.tp = method.tp;
  // ROS clients also see from the topics whether the server is there.
  route.presence.offer_while_published = is_offered && !method.offer_always;
  route.presence.write_while_offered = !is_offered;
  route.from_bridges = method.from_bridges;
  route.peers = method.peers;
  route.mark = method.mark;
  return result;
}

MethodInFile load_method(const YAML::Node& node, documents::Problems& problems) {
  MethodInFile result;
  MethodRoute& method = result.method;
  Element element{node, "method", result.good, problems};
  method.mark = element.mark();
  element.require("ros_service", service_name(), method.ros_service);
  element.require("type", service_type_name(), method.type);
  result.type_mark = element.value_mark("type");
  load_service(element, method);
  if (element.require("method", id_of<someip::MethodId>(), method.method)) {
    check_method_id(element, "method", method.method, problems);
  }
  element.read("fire_and_forget", documents::truth(), method.fire_and_forget);
  load_calls(element, method, problems);
  if (const YAML::Node e2e = element.child("e2e")) {
    method.e2e =
        load_method_e2e(e2e, element.has("server") ? std::optional{method.server} : std::nullopt, problems);
  }
  element.finish();
  return result;
}

}  // namespace trestle::carry
