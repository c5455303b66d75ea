#include "bridge/carry/runtime/methods.hpp"

#include <algorithm>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/start_at.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

// The ROS side of a method.
dds::ServiceConfig service_config(const MethodRoute& method, messages::TypeLibrary& types) {
  using enum dds::RosForm;
  dds::ServiceConfig config;
  config.name = method.ros_service;
  config.type = method.type;
  config.form = method.form == ServiceForm::fastrtps     ? fastrtps
                : method.form == ServiceForm::cyclonedds ? cyclonedds
                                                         : automatic;
  config.max_calls = method.max_calls;
  // As max_sample_bytes() of a route.
  config.max_sample_bytes = std::max(dds::default_max_sample_bytes, 8 * method.tp.max_message);
  const std::string of_service = user_data_of_service(method.type, types);
  config.request_user_data = user_data_of(method.type + "_Request", types) + of_service;
  config.reply_user_data = user_data_of(method.type + "_Response", types) + of_service;
  return config;
}

}  // namespace

Methods::Compiled Methods::compile(const MethodRoute& method, messages::TypeLibrary& types) {
  const auto fail = [&](const std::string& why) {
    return std::runtime_error{"method " + method.ros_service + ": " + method.type +
                              " cannot be carried: " + why};
  };
  if (method.access != messages::FieldAccess::none) {
    const auto field = resolve_field_service(types, method.type, method.value_type, method.access);
    if (!field) {
      throw fail(field.error());
    }
    auto plans = compile_field_service(*field, method.access, method.rules);
    if (!plans) {
      throw fail(plans.error());
    }
    return {std::move(*plans), service_config(method, types)};
  }
  const auto service = types.resolve_service(method.type);
  if (!service) {
    throw fail(to_string(service.error()));
  }
  messages::MessageRules rules = method.rules;
  // The answer to ROS that a method without one does not give is made of defaults.
  rules.default_missing =
      rules.default_missing || (method.fire_and_forget && method.server == Server::someip);
  auto plans = compile_service(*service, rules);
  if (!plans) {
    throw fail(plans.error());
  }
  return {std::move(*plans), service_config(method, types), FailureReply::of(method.type, service->response)};
}

Methods::Methods(const BridgeConfig& config, messages::TypeLibrary& types) : config_{config} {
  for (const MethodRoute& method : config.methods) {
    compiled_.push_back(start_at(config, method.mark, [&] { return compile(method, types); }));
    const BridgeMark mark = mark_of(config.someip.address, method);
    compiled_.back().ros.bridge = to_text(mark);
    compiled_.back().ros.takes_bridge = [mark](std::string_view other) { return goes_on(mark, other); };
  }
}

void Methods::join_someip(boost::asio::io_context& io, sd::Node& node,
                          std::vector<OfferedService>& services) {
  for (std::size_t i = 0; i < config_.methods.size(); ++i) {
    const MethodRoute& method = config_.methods[i];
    if (method.server == Server::someip) {
      to_someip_.push_back(start_at(config_, method.mark, [&] {
        return std::make_unique<ServiceToMethod>(node, method, std::move(compiled_[i].plans),
                                                 std::move(compiled_[i].ros), std::move(compiled_[i].failure),
                                                 config_.someip.address);
      }));
      continue;
    }
    to_ros_.push_back(std::make_unique<MethodToService>(io, method, std::move(compiled_[i].plans),
                                                        std::move(compiled_[i].ros), config_.someip.address));
    OfferedService& service = offered_service(services,
                                              {.service = method.service,
                                               .instance = method.instance,
                                               .major = method.major,
                                               .minor = method.minor,
                                               .udp_port = {}},
                                              method.mark);
    service.while_there |= !method.offer_always;
    (method.transport == Transport::tcp ? service.spec.tcp_port : service.spec.udp_port) = method.port;
    service.spec.methods.push_back(to_ros_.back()->spec());
    if (method.e2e) {
      service.spec.e2e.push_back(served(method.method, *method.e2e, !method.fire_and_forget));
    }
  }
}

ServiceToMethod* Methods::setter_beside(const Route& notifier) const {
  const auto found = std::ranges::find_if(to_someip_, [&](const auto& one) {
    const MethodRoute& method = one->method();
    return method.notifier == notifier.event && method.service == notifier.service &&
           method.instance == notifier.instance;
  });
  return found == to_someip_.end() ? nullptr : found->get();
}

void Methods::join_dds(dds::Participant& participant,
                       const std::vector<std::unique_ptr<ServiceOffer>>& offers) {
  auto to_ros = to_ros_.begin();
  auto to_someip = to_someip_.begin();
  for (const MethodRoute& method : config_.methods) {
    if (method.server == Server::someip) {
      (*to_someip++)->open(participant);
      continue;
    }
    MethodToService& opened = **to_ros++;
    ServiceOffer& offer = **std::ranges::find_if(offers, [&](const auto& one) {
      return one->spec().service == method.service && one->spec().instance == method.instance;
    });
    if (!method.offer_always) {
      offer.needs([&opened] { return opened.ready(); });
    }
    start_at(config_, method.mark, [&] { opened.open(participant, [&offer] { offer.update(); }); });
  }
}

void Methods::bridges_changed() {
  for (const auto& method : to_someip_) {
    method->bridges_changed();
  }
}

void Methods::stop() {
  for (const auto& method : to_ros_) {
    method->stop();
  }
  for (const auto& method : to_someip_) {
    method->stop();
  }
}

void Methods::append_counters(std::vector<CounterGroup>& groups) const {
  for (const auto& method : to_ros_) {
    groups.push_back(method->counters());
  }
  for (const auto& method : to_someip_) {
    groups.push_back(method->counters());
  }
}

void Methods::append_diagnoses(std::vector<Diagnosis>& diagnoses) const {
  for (const auto& method : to_ros_) {
    method->append_diagnoses(diagnoses);
  }
  for (const auto& method : to_someip_) {
    method->append_diagnoses(diagnoses);
  }
}

void Methods::on_change(const std::function<void()>& changed) {
  for (const auto& method : to_ros_) {
    method->on_change(changed);
  }
  for (const auto& method : to_someip_) {
    method->on_change(changed);
  }
}

}  // namespace trestle::carry
