#include "bridge/describe/write/routes/route_entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/messages/values/wire_yaml.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

template <typename Id>
std::string hex(Id id) {
  return fmt::format("0x{:04x}", someip::value(id));
}

/// The entries of one service instance.
class Entries {
 public:
  Entries(const Model& model, const Lowered& lowered, const Service& service, const Instance& instance,
          Side side, const RouteOptions& options, std::uint16_t port, std::vector<NotCarried>& not_carried)
      : model_{model},
        lowered_{lowered},
        service_{service},
        instance_{instance},
        side_{side},
        options_{options},
        port_{port},
        not_carried_{not_carried} {}

  std::vector<RouteEntry> run() {
    const auto index = static_cast<std::size_t>(&service_ - model_.services.data());
    const auto lowered = [&](LoweredMember::Kind kind, std::size_t member) {
      return lowered_.member(kind, index, member);
    };
    for (std::size_t i = 0; i < service_.events.size(); ++i) {
      event(service_.events[i], lowered(LoweredMember::Kind::event, i));
    }
    for (std::size_t i = 0; i < service_.methods.size(); ++i) {
      method(service_.methods[i], lowered(LoweredMember::Kind::method, i));
    }
    for (std::size_t i = 0; i < service_.fields.size(); ++i) {
      field(service_.fields[i], lowered(LoweredMember::Kind::field, i));
    }
    return std::move(entries_);
  }

 private:
  void event(const Event& event, const LoweredMember* lowered) {
    if (!complete(event.name, event.place, lowered, event.id.has_value(), !event.eventgroups.empty())) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["topic"] = name_of(event.name);
    node["type"] = lowered->type;
    node["direction"] = side_ == Side::client ? "someip_to_dds" : "dds_to_someip";
    put_service(node);
    node["eventgroup"] = hex(event.eventgroups.front());
    node["event"] = hex(*event.id);
    put_version(node);
    put_transport(node, event.transfer.transport);
    put_multicast(node, event.eventgroups.front(), event.transfer.transport);
    put_tp(node, event.transfer, side_ == Side::server);
    put_protection(node, event.e2e, "");
    put_wire(node, lowered->rules);
    if (event.eventgroups.size() > 1) {
      lacks(event.name, "all eventgroups but the first one", event.place);
    }
    if (event.selective) {
      lacks(event.name, "selective: the event goes to all subscribers", event.place);
    }
    entries_.push_back({"routes", service_.name + "." + event.name, full_name(service_.scope, service_.name),
                        std::move(node)});
  }

  void method(const Method& method, const LoweredMember* lowered) {
    if (!complete(method.name, method.place, lowered, method.id.has_value(), true)) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["ros_service"] = name_of(method.name);
    node["type"] = lowered->type;
    node["server"] = side_ == Side::client ? "someip" : "ros";
    put_service(node);
    node["method"] = hex(*method.id);
    put_version(node);
    if (side_ == Side::server || method.request_transfer.transport == Transport::tcp) {
      put_transport(node, method.request_transfer.transport);
    }
    if (method.fire_and_forget) {
      node["fire_and_forget"] = "true";
    }
    if (method.timeout) {
      node["timeout"] = documents::to_string(Duration{*method.timeout});
    }
    put_tp(node, side_ == Side::client ? method.request_transfer : method.response_transfer, true);
    put_protection(node, method.e2e, "");
    put_wire(node, lowered->rules);
    if (!method.fire_and_forget && lowered->response != lowered->rules) {
      lacks(method.name, "other rules for the answer than for the request", method.place);
    }
    entries_.push_back({"methods", service_.name + "." + method.name,
                        full_name(service_.scope, service_.name), std::move(node)});
  }

  void field(const Field& field, const LoweredMember* lowered) {
    const bool has_ids = (!field.has_getter || field.getter) && (!field.has_setter || field.setter) &&
                         (!field.has_notifier || field.notifier);
    if (!complete(field.name, field.place, lowered, has_ids,
                  !field.has_notifier || !field.eventgroups.empty())) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["topic"] = name_of(field.name);
    node["type"] = lowered->type;
    node["server"] = side_ == Side::client ? "someip" : "ros";
    put_service(node);
    if (field.has_notifier) {
      node["event"] = hex(*field.notifier);
      node["eventgroup"] = hex(field.eventgroups.front());
      put_multicast(node, field.eventgroups.front(), field.notifier_transfer.transport);
    }
    if (field.has_getter) {
      node["getter"] = hex(*field.getter);
    }
    if (field.has_setter) {
      node["setter"] = hex(*field.setter);
    }
    put_version(node);
    put_transport(node,
                  field.has_notifier ? field.notifier_transfer.transport : field.getter_transfer.transport);
    put_tp(node, side_ == Side::server ? field.notifier_transfer : field.setter_transfer, true);
    put_protection(node, field.e2e, "event");
    put_wire(node, lowered->rules);
    entries_.push_back({"fields", service_.name + "." + field.name, full_name(service_.scope, service_.name),
                        std::move(node)});
  }

  /// Whether a route can be made; tells what is missing.
  bool complete(const std::string& member, const Place& place, const LoweredMember* lowered, bool has_ids,
                bool has_eventgroup) {
    if (!has_ids || !service_.id || !instance_.id) {
      lacks(member, "it has no id", place);
    } else if (!has_eventgroup) {
      lacks(member, "it has no eventgroup", place);
    } else if (lowered == nullptr) {
      lacks(member, "its type has no form in ROS 2", place);
    } else {
      return true;
    }
    return false;
  }
  void lacks(const std::string& member, std::string what, const Place& place) {
    not_carried_.push_back({service_.name + "." + member, std::move(what), place});
  }

  /// "/car/door/moved"; with the instance's id where the service has several.
  [[nodiscard]] std::string name_of(const std::string& member) const {
    std::string name = options_.prefix;
    if (name.empty() || name.back() != '/') {
      name += '/';
    }
    name += ros_field_name(service_.name);
    const std::string full = full_name(service_.scope, service_.name);
    std::set<someip::InstanceId> ids;
    for (const Instance& other : model_.instances) {
      if (other.service == full && other.id) {
        ids.insert(*other.id);
      }
    }
    if (ids.size() > 1) {
      name += fmt::format("/instance_{}", someip::value(*instance_.id));
    }
    return name + "/" + ros_field_name(member);
  }

  void put_service(YAML::Node& node) const {
    node["service"] = hex(*service_.id);
    node["instance"] = hex(*instance_.id);
  }
  void put_version(YAML::Node& node) const {
    const std::uint8_t major = instance_.major.value_or(service_.major);
    if (major != 1) {
      node["major"] = fmt::to_string(major);
    }
    if (side_ == Side::client) {
      node["minor"] = instance_.minor && instance_.role == Instance::Role::required
                          ? fmt::to_string(*instance_.minor)
                          : std::string{"any"};
    } else if (service_.minor != 0) {
      node["minor"] = fmt::to_string(service_.minor);
    }
  }
  void put_transport(YAML::Node& node, Transport transport) const {
    if (transport == Transport::tcp) {
      node["transport"] = "tcp";
    }
    if (side_ == Side::server) {
      node["port"] = fmt::to_string(port_);
    }
  }
  void put_multicast(YAML::Node& node, someip::EventgroupId eventgroup, Transport transport) const {
    if (side_ != Side::server || transport == Transport::tcp) {
      return;
    }
    const auto found = std::ranges::find(instance_.multicast, eventgroup, &Multicast::eventgroup);
    if (found == instance_.multicast.end() || found->threshold == 0) {
      return;
    }
    YAML::Node multicast{YAML::NodeType::Map};
    multicast["address"] = someip::to_string(found->group.address);
    multicast["port"] = fmt::to_string(found->group.port);
    multicast["threshold"] = fmt::to_string(found->threshold);
    node["multicast"] = multicast;
  }
  static void put_tp(YAML::Node& node, const Transfer& transfer, bool we_send) {
    if (!we_send || transfer.transport == Transport::tcp) {
      return;
    }
    YAML::Node tp{YAML::NodeType::Map};
    if (const std::uint32_t bytes = transfer.segment_bytes / 16 * 16; bytes != 0) {
      tp["segment_bytes"] = fmt::to_string(bytes);
    }
    if (transfer.separation.count() > 0) {
      tp["separation"] = documents::to_string(Duration{transfer.separation});
      tp["burst"] = "1";
    }
    if (tp.size() != 0) {
      node["tp"] = tp;
    }
  }
  /// @param part  of a field: which of its messages is protected; else empty.
  static void put_protection(YAML::Node& node, const Protection& e2e, const char* part) {
    if (e2e.profile.empty()) {
      return;
    }
    YAML::Node yaml{YAML::NodeType::Map};
    yaml["profile"] = e2e.profile;
    for (const auto& [key, number] : e2e.numbers) {
      yaml[key] =
          key.find("id") != std::string::npos ? fmt::format("{:#06x}", number) : fmt::to_string(number);
    }
    for (const auto& [key, word] : e2e.words) {
      yaml[key] = word;
    }
    if (*part == '\0') {
      node["e2e"] = yaml;
    } else {
      node["e2e"][part] = yaml;
    }
  }

  static void put_wire(YAML::Node& node, const messages::MessageRules& rules) {
    if (const YAML::Node wire = messages::wire_yaml(rules); wire.size() != 0) {
      node["wire"] = wire;
    }
  }

  const Model& model_;
  const Lowered& lowered_;
  const Service& service_;
  const Instance& instance_;
  Side side_;
  const RouteOptions& options_;
  std::uint16_t port_;
  std::vector<NotCarried>& not_carried_;
  std::vector<RouteEntry> entries_{};
};

bool is_provided_too(const Model& model, const Instance& required) {
  return std::ranges::any_of(model.instances, [&](const Instance& other) {
    return other.role == Instance::Role::provided && other.service == required.service &&
           other.id == required.id;
  });
}

}  // namespace

std::uint16_t offer_port(const Instance& instance, std::uint16_t otherwise) {
  // The ports of a required instance are those of a client.
  return instance.role != Instance::Role::provided ? otherwise
         : instance.udp_port                       ? *instance.udp_port
                                                   : instance.tcp_port.value_or(otherwise);
}

std::vector<RouteEntry> route_entries(const Model& model, const Lowered& lowered, const Service& service,
                                      const Instance& instance, Side side, const RouteOptions& options,
                                      std::uint16_t port, std::vector<NotCarried>& not_carried) {
  return Entries{model, lowered, service, instance, side, options, port, not_carried}.run();
}

std::vector<RouteEntry> route_entries(const Model& model, const Lowered& lowered, const RouteOptions& options,
                                      std::vector<NotCarried>& not_carried) {
  std::vector<RouteEntry> all;
  not_carried.insert(not_carried.end(), lowered.not_carried.begin(), lowered.not_carried.end());
  std::set<std::tuple<std::string, someip::InstanceId, Side>> done;
  std::uint32_t next_port = options.first_port;
  for (const Instance& instance : model.instances) {
    const Service* service = model.service(instance.service);
    if (service == nullptr) {
      not_carried.push_back({instance.name.empty() ? instance.service : instance.name,
                             "the instance of a service that is not described", instance.place});
      continue;
    }
    const bool provided = instance.role == Instance::Role::provided;
    const Side side = options.side.value_or(provided ? Side::client : Side::server);
    if (instance.id && !done.emplace(instance.service, *instance.id, side).second) {
      continue;  // one that another machine provides or wants, too
    }
    if (!options.side && !provided && is_provided_too(model, instance)) {
      not_carried.push_back({service->name, "that it is required, as it is provided, too", instance.place});
      continue;
    }
    const std::uint16_t port = offer_port(instance, static_cast<std::uint16_t>(next_port));
    next_port += port == next_port && next_port < 0xffff ? 1 : 0;
    if (side == Side::server && provided && instance.tcp_port.value_or(port) != port) {
      not_carried.push_back({service->name, "its TCP port: it is offered at the UDP port", instance.place});
    }
    std::vector<RouteEntry> entries =
        route_entries(model, lowered, *service, instance, side, options, port, not_carried);
    all.insert(all.end(), std::make_move_iterator(entries.begin()), std::make_move_iterator(entries.end()));
  }
  return all;
}

}  // namespace trestle::describe
