#include "bridge/carry/config/load_method.hpp"

#include "bridge/carry/config/load_e2e.hpp"
#include "bridge/carry/config/load_route.hpp"
#include "bridge/carry/config/load_version.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/load_wire.hpp"

namespace trestle::carry {
namespace {

void load_method_endpoint(documents::Section& section, MethodInFile& into, documents::Problems& problems) {
  MethodRoute& method = into.method;
  const auto port = documents::as<std::uint16_t>(documents::whole_number(1, 65535));
  Transport transport{};
  if (section.read("transport", udp_or_tcp(), transport)) {
    method.transport = transport;
  }
  if (!into.good.contains("server")) {
    section.read("port", port, method.port);
  } else if (method.server == Server::ros) {
    if (section.require("port", port, method.port)) {
      into.good.emplace("port", section.use_mark("port"));
    }
    method.transport = method.transport.value_or(Transport::udp);
  } else if (section.read("port", port, method.port)) {
    problems.error(
        section.use_mark("port"),
        "port: is where we offer a method, with server: ros; a SOME/IP server names its port in its offer");
  }
}

}  // namespace

documents::Format<std::string> service_name() {
  return {"a service such as /arm/set_mode (absolute; letters, digits, '_')",
          [](std::string_view text) -> std::optional<std::string> {
            return messages::is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

documents::Format<std::string> service_type_name() {
  return {"a service type such as std_srvs/srv/SetBool",
          [](std::string_view text) -> std::optional<std::string> {
            return messages::is_service_type_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
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

void load_calls(documents::Section& section, MethodRoute& method, documents::Problems& problems) {
  section.read("timeout", documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{1}),
               method.timeout);
  section.read("max_calls", documents::as<std::size_t>(documents::whole_number(1, 10'000)), method.max_calls);
  section.read("max_message", message_size(), method.tp.max_message);
  if (const YAML::Node node = section.child("tp")) {
    documents::Section tp{node, "tp", problems};
    load_pacing(tp, method.tp);
    tp.finish();
  }
  section.read("ros_form",
               documents::one_of<ServiceForm>({{"auto", ServiceForm::automatic},
                                               {"fastrtps", ServiceForm::fastrtps},
                                               {"cyclonedds", ServiceForm::cyclonedds}}),
               method.form);
}

MethodInFile load_method(const YAML::Node& node, documents::Problems& problems) {
  MethodInFile result;
  MethodRoute& method = result.method;
  documents::Section section{node, "method", problems};
  method.mark = section.mark();
  const auto require = [&](const char* key, const auto& format, auto& into) {
    if (section.require(key, format, into)) {
      result.good.emplace(key, section.use_mark(key));
    }
  };

  require("ros_service", service_name(), method.ros_service);
  require("type", service_type_name(), method.type);
  result.type_mark = section.value_mark("type");
  require("server", documents::one_of<Server>({{"someip", Server::someip}, {"ros", Server::ros}}),
          method.server);
  // The ranges are those of a route.
  require("service", documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd)), method.service);
  require("instance", documents::as<someip::InstanceId>(documents::id_number(0x0001, 0xfffe)),
          method.instance);
  require("method", documents::as<someip::MethodId>(documents::id_number(0x0001, 0xfffe)), method.method);
  if (result.good.contains("method")) {
    check_method_id(section, "method", method.method, problems);
  }
  load_method_endpoint(section, result, problems);
  load_version(section, method.server == Server::someip, method.major, method.minor);
  result.good.emplace("major", section.use_mark("major"));
  result.good.emplace("minor", section.use_mark("minor"));
  if (section.read("offer", documents::one_of<bool>({{"while_served", false}, {"always", true}}),
                   method.offer_always) &&
      result.good.contains("server") && method.server != Server::ros) {
    problems.error(section.use_mark("offer"), "offer: is for methods with server: ros");
  }
  section.read("fire_and_forget", documents::truth(), method.fire_and_forget);
  load_from_bridges(section, method.server == Server::ros || !result.good.contains("server"),
                    "methods with server: ros", method.from_bridges, problems);
  load_calls(section, method, problems);
  if (const YAML::Node wire = section.child("wire")) {
    messages::load_wire(wire, method.rules, problems);
  }
  if (const YAML::Node e2e = section.child("e2e")) {
    method.e2e = load_method_e2e(
        e2e, result.good.contains("server") ? std::optional{method.server} : std::nullopt, problems);
  }
  section.finish();
  return result;
}

}  // namespace trestle::carry
