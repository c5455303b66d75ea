#include "bridge/describe/write/routes/route_entries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "bridge/describe/collecting.hpp"
#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/refused.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/wire_yaml.hpp"
#include "sd/wire/entry.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

// Why there is no route of a member.
constexpr const char* no_id = "it has no id";
constexpr const char* no_instance_id = "its instance has no id";
constexpr const char* no_eventgroup = "it has no eventgroup";

template <typename Id>
std::string hex(Id id) {
  return fmt::format("0x{:04x}", someip::value(id));
}

/// Neither "none" nor "any".
template <typename Id>
bool is_usual(Id id) {
  return someip::value(id) != 0 && someip::value(id) != 0xffff;
}

/// The one that a route has: the first that it can have.
std::optional<someip::EventgroupId> eventgroup_of(const std::vector<someip::EventgroupId>& all) {
  const auto found = std::ranges::find_if(all, is_usual<someip::EventgroupId>);
  return found == all.end() ? std::nullopt : std::optional{*found};
}

const char* to_text(Transport transport) {
  return transport == Transport::tcp ? "TCP" : "UDP";
}

/// The entries of one service instance.
class Entries {
 public:
  Entries(const RouteEntries& all, const Service& service, const Instance& instance, Side side,
          std::uint16_t port, std::vector<NotCarried>& not_carried)
      : lowered_{all.lowered()},
        service_{service},
        instance_{instance},
        side_{side},
        port_{port},
        not_carried_{not_carried},
        index_{static_cast<std::size_t>(&service - all.model().services.data())},
        prefix_{all.prefix_of(service, instance)},
        fixed_prefix_{all.prefix()} {
    if (const std::size_t at = prefix_.rfind("/instance_"); at != std::string::npos) {
      instance_part_ = prefix_.substr(at + 1) + "/";
    }
    const auto name = [](FreeNames& taken, const std::string& member) {
      return taken.take(ros_field_name(member), "_");
    };
    for (const Event& one : service.events) {
      event_names_.push_back(name(topics_, one.name));
    }
    for (const Field& one : service.fields) {
      field_names_.push_back(name(topics_, one.name));
    }
    for (const Method& one : service.methods) {
      method_names_.push_back(name(calls_, one.name));
    }
  }

  std::vector<RouteEntry> run() {
    for (std::size_t i = 0; i < service_.events.size(); ++i) {
      member({LoweredMember::Kind::event, i});
    }
    for (std::size_t i = 0; i < service_.methods.size(); ++i) {
      member({LoweredMember::Kind::method, i});
    }
    for (std::size_t i = 0; i < service_.fields.size(); ++i) {
      member({LoweredMember::Kind::field, i});
    }
    return std::move(entries_);
  }
  std::vector<RouteEntry> run(RouteMember one) {
    member(one);
    return std::move(entries_);
  }

 private:
  void member(RouteMember one) {
    const LoweredMember* const lowered = lowered_.member(one.kind, index_, one.index);
    switch (one.kind) {
      case LoweredMember::Kind::event:
        return event(service_.events[one.index], lowered, event_names_[one.index]);
      case LoweredMember::Kind::method:
        return method(service_.methods[one.index], lowered, method_names_[one.index]);
      case LoweredMember::Kind::field:
        return one.is_notifier_of_field
                   ? notifier(service_.fields[one.index], lowered, field_names_[one.index])
                   : field(service_.fields[one.index], lowered, field_names_[one.index]);
    }
  }

  void push(const char* list, const std::string& member, YAML::Node node) {
    entries_.push_back({list, service_.name + "." + member, member, full_name(service_.scope, service_.name),
                        instance_.id.value_or(someip::InstanceId{}), std::move(node)});
  }

  /// The notifier of a field as an event.
  void notifier(const Field& field, const LoweredMember* lowered, const std::string& name) {
    if (!field.has_notifier) {
      lacks(field.name, "the field has no notifier", field.place);
      return;
    }
    Event alone{.name = field.name,
                .id = field.notifier,
                .eventgroups = field.eventgroups,
                .transfer = field.notifier_transfer,
                .cycle = field.cycle,
                .e2e = field.e2e,
                .ros_name = field.ros_name};
    alone.place = field.place;
    event(alone, lowered, name);
  }

  void event(const Event& event, const LoweredMember* lowered, const std::string& name) {
    const std::optional<someip::EventgroupId> eventgroup = eventgroup_of(event.eventgroups);
    const std::string topic = name_of(name, event.ros_name);
    if (!complete(event.name, event.place, lowered, event.id.has_value(), eventgroup.has_value(), topic) ||
        !can_be_protected(event.name, event.e2e, false, event.place) ||
        !has_free_ids(event.name, {event.id}, event.place)) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["topic"] = topic;
    node["type"] = lowered->type;
    node["direction"] = side_ == Side::client ? "someip_to_dds" : "dds_to_someip";
    put_service(node);
    node["eventgroup"] = hex(*eventgroup);
    node["event"] = hex(*event.id);
    put_version(node);
    put_transport(node, event.transfer.transport);
    put_multicast(node, event.name, *eventgroup, event.transfer.transport);
    put_tp(node, event.name, event.transfer, event.place);
    put_protection(node, event.e2e, false, "");
    put_wire(node, lowered->rules);
    tell_of_sending(event.name, event.eventgroups, event.cycle, event.place);
    tell_of_times(event.name, {&event.transfer}, event.place);
    if (!event.selector.empty()) {
      lacks(event.name, "its selector " + event.selector, event.place);
    }
    if (event.selective) {
      lacks(event.name, "selective: the event goes to all subscribers", event.place);
    }
    push("routes", member_key(event.name, event.selector), std::move(node));
  }

  void method(const Method& method, const LoweredMember* lowered, const std::string& name) {
    const std::string service = name_of(name, method.ros_name);
    if (!complete(method.name, method.place, lowered, method.id.has_value(), true, service) ||
        !can_be_protected(method.name, method.e2e, true, method.place) ||
        !has_free_ids(method.name, {method.id}, method.place)) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["ros_service"] = service;
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
    if (method.timeout && (method.timeout->count() < 1 || *method.timeout > std::chrono::hours{1})) {
      lacks(method.name, "its timeout, which is not from 1 ms to 1 h", method.place);
    } else if (method.timeout) {
      node["timeout"] = documents::to_string(Duration{*method.timeout});
    }
    put_tp(node, method.name, side_ == Side::client ? method.request_transfer : method.response_transfer,
           method.place);
    put_protection(node, method.e2e, true, "");
    put_wire(node, lowered->rules);
    if (!method.fire_and_forget && lowered->response != lowered->rules) {
      lacks(method.name, "other rules for the answer than for the request", method.place);
    }
    if (!method.fire_and_forget && has_other_segments(method.request_transfer, method.response_transfer)) {
      lacks(method.name, "other segments of the answer than of the request", method.place);
    }
    tell_of_times(method.name, {&method.request_transfer, &method.response_transfer}, method.place);
    if (!method.selector.empty()) {
      lacks(method.name, "its selector " + method.selector, method.place);
    }
    push("methods", member_key(method.name, method.selector), std::move(node));
  }

  void field(const Field& field, const LoweredMember* lowered, const std::string& name) {
    const bool has_ids = (!field.has_getter || field.getter) && (!field.has_setter || field.setter) &&
                         (!field.has_notifier || field.notifier);
    const std::optional<someip::EventgroupId> eventgroup = eventgroup_of(field.eventgroups);
    const std::string topic = name_of(name, field.ros_name);
    const std::string longest = field.has_getter || field.has_setter ? topic + "/set" : topic;
    if (!complete(field.name, field.place, lowered, has_ids, !field.has_notifier || eventgroup, longest) ||
        (field.has_notifier && !can_be_protected(field.name, field.e2e, false, field.place)) ||
        (field.has_getter && !can_be_protected(field.name, field.getter_e2e, true, field.place)) ||
        (field.has_setter && !can_be_protected(field.name, field.setter_e2e, true, field.place)) ||
        !has_free_ids(
            field.name,
            {field.has_notifier ? field.notifier : std::nullopt,
             field.has_getter ? field.getter : std::nullopt, field.has_setter ? field.setter : std::nullopt},
            field.place)) {
      return;
    }
    YAML::Node node{YAML::NodeType::Map};
    node["topic"] = topic;
    node["type"] = lowered->type;
    node["server"] = side_ == Side::client ? "someip" : "ros";
    put_service(node);
    if (field.has_notifier) {
      node["event"] = hex(*field.notifier);
      node["eventgroup"] = hex(*eventgroup);
      put_multicast(node, field.name, *eventgroup, field.notifier_transfer.transport);
    }
    if (field.has_getter) {
      node["getter"] = hex(*field.getter);
    }
    if (field.has_setter) {
      node["setter"] = hex(*field.setter);
    }
    put_version(node);
    const Transport transport = field.has_notifier ? field.notifier_transfer.transport
                                : field.has_getter ? field.getter_transfer.transport
                                                   : field.setter_transfer.transport;
    put_transport(node, transport);
    const auto other = [&](bool there, const Transfer& transfer, const char* part) {
      if (there && transfer.transport != transport) {
        lacks(field.name,
              fmt::format("its {} by {}: the bridge uses one transport for a whole field, here {}", part,
                          to_text(transfer.transport), to_text(transport)),
              field.place);
      }
    };
    other(field.has_getter, field.getter_transfer, "getter");
    other(field.has_setter, field.setter_transfer, "setter");
    // What this side sends, if there is such a part.
    const bool is_notifier = field.has_notifier && (side_ == Side::server || !field.has_setter);
    const bool is_setter = field.has_setter && !is_notifier;
    put_tp(node, field.name,
           is_notifier ? field.notifier_transfer
           : is_setter ? field.setter_transfer
                       : field.getter_transfer,
           field.place);
    if (field.has_notifier) {
      put_protection(node, field.e2e, false, "event");
    }
    if (field.has_getter) {
      put_protection(node, field.getter_e2e, true, "getter");
    }
    if (field.has_setter) {
      put_protection(node, field.setter_e2e, true, "setter");
    }
    put_wire(node, lowered->rules);
    if (field.has_notifier) {
      tell_of_sending(field.name, field.eventgroups, field.cycle, field.place);
    }
    const Transfer none;
    tell_of_times(field.name,
                  {field.has_notifier ? &field.notifier_transfer : &none,
                   field.has_getter ? &field.getter_transfer : &none,
                   field.has_setter ? &field.setter_transfer : &none},
                  field.place);
    std::vector<const Transfer*> transfers;
    for (const auto& [there, transfer] : {std::pair{field.has_getter, &field.getter_transfer},
                                          {field.has_setter, &field.setter_transfer},
                                          {field.has_notifier, &field.notifier_transfer}}) {
      if (there) {
        transfers.push_back(transfer);
      }
    }
    if (std::ranges::any_of(transfers,
                            [&](const Transfer* one) { return has_other_segments(*one, *transfers[0]); })) {
      lacks(field.name, "getter, setter and notifier with different segments", field.place);
    }
    push("fields", field.name, std::move(node));
  }

  /// Whether a route can be made; tells what is missing.
  /// @param name  its topic or ROS service.
  bool complete(const std::string& member, const Place& place, const LoweredMember* lowered, bool has_ids,
                bool has_eventgroup, const std::string& name) {
    if (!has_ids || !service_.id) {
      lacks(member, no_id, place);
    } else if (!instance_.id) {
      lacks(member, no_instance_id, instance_.place);
    } else if (!has_eventgroup) {
      lacks(member, no_eventgroup, place);
    } else if (lowered == nullptr) {
      lacks(member, why_not_carried(lowered_, service_, member), place);
    } else if (!messages::is_topic_name(name) && messages::is_topic_name(fixed_prefix_ + "x")) {
      lacks(member, fmt::format("its name is none that ROS 2 takes: {}", name), place);
    } else {
      return true;
    }
    return false;
  }
  /// Without its protection a member would be carried with wrong values, so then it is not.
  bool can_be_protected(const std::string& member, const Protection& of_all, bool is_method,
                        const Place& place) {
    const Protection& e2e = of_all.of(instance_.id);
    const auto settings =
        e2e.profile.empty() ? tl::expected<E2eSettings, std::string>{} : e2e_settings(e2e, use_of(is_method));
    if (!settings) {
      lacks(member, fmt::format("its E2E protection cannot be done: {}", settings.error()), place);
    }
    return settings.has_value();
  }
  [[nodiscard]] E2eUse use_of(bool is_method) const {
    const bool is_client = side_ == Side::client;
    return is_method   ? is_client ? E2eUse::called : E2eUse::served
           : is_client ? E2eUse::received_event
                       : E2eUse::sent_event;
  }
  /// A service instance of a route file has each id once: a method and an event of one id are two.
  bool has_free_ids(const std::string& member, std::initializer_list<std::optional<someip::MethodId>> ids,
                    const Place& place) {
    std::set<someip::MethodId> own;
    for (const std::optional<someip::MethodId>& id : ids) {
      if (!id) {
        continue;
      }
      const auto other = ids_.find(*id);
      if (other != ids_.end() || !own.insert(*id).second) {
        lacks(member,
              fmt::format("its id is that of {}: {}", other != ids_.end() ? other->second : member, hex(*id)),
              place);
        return false;
      }
      if (!is_usual(*id)) {
        lacks(member, fmt::format("its id is none that a route can have: {}", hex(*id)), place);
        return false;
      }
    }
    for (const someip::MethodId id : own) {
      ids_.emplace(id, member);
    }
    return true;
  }
  /// What routes do not have of an event or a notifier.
  void tell_of_sending(const std::string& member, const std::vector<someip::EventgroupId>& eventgroups,
                       const std::optional<std::chrono::microseconds>& cycle, const Place& place) {
    if (eventgroups.size() > 1) {
      lacks(member, "all eventgroups but the first one", place);
    }
    if (cycle) {
      lacks(member, "its cycle", place);
    }
  }
  /// Once of a member. Of CommonAPI's time where nobody wrote another one, tell_of_settings() tells.
  void tell_of_times(const std::string& member, std::initializer_list<const Transfer*> all,
                     const Place& place) {
    if (std::ranges::any_of(
            all, [](const Transfer* one) { return is_collected(*one) && !is_usual_collecting(*one); })) {
      lacks(member, "its times of collecting several messages", place);
    }
  }
  static bool has_other_segments(const Transfer& one, const Transfer& other) {
    return one.segment_bytes != other.segment_bytes || one.separation != other.separation;
  }
  void lacks(const std::string& member, std::string what, const Place& place) {
    not_carried_.push_back({service_.name + "." + member, std::move(what), place});
  }

  /// "/car/door/moved", or its name in ROS, if that is fixed.
  [[nodiscard]] std::string name_of(const std::string& name, const std::string& fixed) const {
    if (fixed.empty()) {
      return prefix_ + "/" + name;
    }
    std::string rest = fixed.substr(fixed.front() == '/' ? 1 : 0);
    // The parts of an action stay together behind its name.
    const std::size_t whole = std::min(rest.find("/_action/"), rest.size());
    const std::size_t slash = rest.substr(0, whole).rfind('/');
    rest.insert(slash == std::string::npos ? 0 : slash + 1, instance_part_);
    return fixed_prefix_ + rest;
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
      node["minor"] =
          instance_.minor && *instance_.minor != sd::any_minor && instance_.role == Instance::Role::required
              ? fmt::to_string(*instance_.minor)
              : std::string{"any"};
    } else if (const std::uint32_t minor = instance_.minor.value_or(service_.minor);
               minor != 0 && minor != sd::any_minor) {
      node["minor"] = fmt::to_string(minor);
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
  void put_multicast(YAML::Node& node, const std::string& member, someip::EventgroupId eventgroup,
                     Transport transport) {
    if (side_ != Side::server || transport == Transport::tcp) {
      return;
    }
    const auto found = std::ranges::find(instance_.multicast, eventgroup, &Multicast::eventgroup);
    if (found == instance_.multicast.end() || found->threshold == 0) {
      return;
    }
    if (found->group.port == 0 || found->threshold > 0xffff ||
        !documents::multicast_address().read(someip::to_string(found->group.address))) {
      lacks(member, "its multicast group, which a route cannot have", instance_.place);
      return;
    }
    YAML::Node multicast{YAML::NodeType::Map};
    multicast["address"] = someip::to_string(found->group.address);
    multicast["port"] = fmt::to_string(found->group.port);
    multicast["threshold"] = fmt::to_string(found->threshold);
    node["multicast"] = multicast;
  }
  /// Also where the other side sends: a receiver needs none of it, but whoever reads the file does.
  void put_tp(YAML::Node& node, const std::string& member, const Transfer& transfer, const Place& place) {
    constexpr std::uint32_t most_bytes = 1392;
    constexpr std::chrono::microseconds longest = std::chrono::seconds{1};
    YAML::Node tp{YAML::NodeType::Map};
    if (const std::uint32_t bytes = transfer.segment_bytes; bytes != 0) {
      const std::uint32_t written = std::min(bytes, most_bytes) / 16 * 16;
      if (written != bytes) {
        lacks(member, fmt::format("segments of {} bytes: a multiple of 16, of at most 1392", bytes), place);
      }
      if (written != 0) {
        tp["segment_bytes"] = fmt::to_string(written);
      }
    }
    if (transfer.separation > longest) {
      lacks(member, "a pause between segments of more than 1 s", place);
    } else if (transfer.separation.count() > 0) {
      tp["separation"] = documents::to_string(Duration{transfer.separation});
      tp["burst"] = "1";
    }
    if (tp.size() != 0) {
      node["tp"] = tp;
    }
  }
  /// @param part  of a field: which of its messages is protected; else empty.
  void put_protection(YAML::Node& node, const Protection& of_all, bool is_method, const char* part) const {
    const Protection& e2e = of_all.of(instance_.id);
    if (e2e.profile.empty()) {
      return;
    }
    const YAML::Node yaml = e2e_yaml(e2e, use_of(is_method));
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

  const Lowered& lowered_;
  const Service& service_;
  const Instance& instance_;
  Side side_;
  std::uint16_t port_;
  std::vector<NotCarried>& not_carried_;
  std::size_t index_;
  std::string prefix_;
  std::string fixed_prefix_;     ///< of names that are fixed; ends in /
  std::string instance_part_{};  ///< "instance_2/" where the service has several
  FreeNames topics_{};
  FreeNames calls_{};
  std::map<someip::MethodId, std::string> ids_{};  ///< of which member each is
  std::vector<std::string> event_names_{};
  std::vector<std::string> method_names_{};
  std::vector<std::string> field_names_{};
  std::vector<RouteEntry> entries_{};
};

}  // namespace

std::uint16_t offer_port(const Instance& instance, std::uint16_t otherwise) {
  // The ports of a required instance are those of a client.
  return instance.role != Instance::Role::provided ? otherwise
         : instance.udp_port                       ? *instance.udp_port
                                                   : instance.tcp_port.value_or(otherwise);
}

RouteEntries::RouteEntries(const Model& model, const Lowered& lowered, const RouteOptions& options)
    : model_{model}, lowered_{lowered}, options_{options} {
  for (const Instance& one : model.instances) {
    if (one.id) {
      instances_[one.service].insert(*one.id);
    }
  }
  std::map<std::string, std::size_t> uses;
  std::map<std::string, std::size_t> uses_with_scope;
  const auto with_scope = [](const Service& service) {
    const std::string scope = service.scope.empty() ? std::string{} : ros_field_name(service.scope) + "/";
    return scope + ros_field_name(service.name);
  };
  for (const Service& one : model.services) {
    ++uses[ros_field_name(one.name)];
    ++uses_with_scope[with_scope(one)];
  }
  FreeNames taken;
  for (const Service& one : model.services) {
    std::string name = ros_field_name(one.name);
    if (uses[name] > 1) {
      name = with_scope(one);
    }
    if (uses_with_scope[name] > 1 && one.id) {
      name += fmt::format("_{:04x}", someip::value(*one.id));
    }
    names_.emplace(&one, taken.take(name, "_"));
  }
}

std::string RouteEntries::prefix_of(const Service& service, const Instance& instance) const {
  std::string name = options_.prefix;
  if (name.empty() || name.back() != '/') {
    name += '/';
  }
  const auto known = names_.find(&service);
  name += known == names_.end() ? ros_field_name(service.name) : known->second;
  const auto ids = instances_.find(full_name(service.scope, service.name));
  if (ids != instances_.end() && ids->second.size() > 1 && instance.id) {
    name += fmt::format("/instance_{}", someip::value(*instance.id));
  }
  return name;
}

std::vector<RouteEntry> RouteEntries::of(const Service& service, const Instance& instance, Side side,
                                         std::uint16_t port, std::vector<NotCarried>& not_carried) const {
  return Entries{*this, service, instance, side, port, not_carried}.run();
}

std::optional<RouteEntry> RouteEntries::of(const Service& service, const Instance& instance, Side side,
                                           std::uint16_t port, RouteMember member,
                                           std::vector<NotCarried>& not_carried) const {
  std::vector<RouteEntry> made = Entries{*this, service, instance, side, port, not_carried}.run(member);
  return made.empty() ? std::nullopt : std::optional{std::move(made.front())};
}

namespace {

/// The instances of a route file: which it can have, and where those are that it offers.
class Offers {
 public:
  Offers(const Model& model, std::uint16_t first_port) : next_port_{first_port} {
    const auto machine =
        std::ranges::find_if(model.machines, [](const Machine& one) { return one.sd_port.has_value(); });
    sd_port_ = machine == model.machines.end() ? usual_sd_port : *machine->sd_port;
  }

  /// Why no route can name the instance; empty: one can, or it lacks ids, which its members tell.
  std::string fault_of(const Service& service, const Instance& instance) {
    constexpr std::uint16_t last_service = 0xfffd;
    constexpr std::uint8_t any_major = 0xff;
    if (!service.id || !instance.id) {
      return {};
    }
    if (!is_usual(*service.id) || someip::value(*service.id) > last_service) {
      return fmt::format("its id is none that a route can have: {}", hex(*service.id));
    }
    if (!is_usual(*instance.id)) {
      return fmt::format("the id of its instance is none that a route can have: {}", hex(*instance.id));
    }
    if (instance.major.value_or(service.major) == any_major) {
      return "its major version 255, which means any";
    }
    const auto [at, is_new] = services_.try_emplace({*service.id, *instance.id}, &service);
    return at->second == &service
               ? std::string{}
               : fmt::format("its instance {}, which {} has too: {}", hex(*instance.id), at->second->name,
                             "a route file has one version of a service");
  }

  /// The port at which the bridge is, if it is the server.
  std::uint16_t port_of(const Service& service, const Instance& instance, Side side,
                        std::vector<NotCarried>& not_carried) {
    std::uint16_t port = offer_port(instance, static_cast<std::uint16_t>(next_port_));
    next_port_ += port == next_port_ && next_port_ < 0xffff ? 1 : 0;
    if (side == Side::client) {
      return port;
    }
    if (instance.role == Instance::Role::provided && instance.tcp_port.value_or(port) != port) {
      not_carried.push_back({service.name, "its TCP port: it is offered at the UDP port", instance.place});
    }
    // Messages do not name the instance: each needs a port of its own.  [feat_req_someip_445]
    std::set<std::uint16_t>& taken = ports_[service.id.value_or(someip::ServiceId{})];
    const std::uint16_t wanted = port;
    constexpr std::size_t most = 60'000;  // with more there might be no port to find
    while (taken.size() < most && (port == 0 || port == sd_port_ || taken.contains(port))) {
      port = static_cast<std::uint16_t>(next_port_);
      next_port_ = next_port_ < 0xffff ? next_port_ + 1 : 1;
    }
    taken.insert(port);
    if (port != wanted) {
      not_carried.push_back({service.name,
                             fmt::format("its port: {} is taken, so it is offered at {}", wanted, port),
                             instance.place});
    }
    return port;
  }

 private:
  static constexpr std::uint16_t usual_sd_port = 30490;

  std::uint16_t sd_port_ = usual_sd_port;
  std::uint32_t next_port_;
  std::map<std::pair<someip::ServiceId, someip::InstanceId>, const Service*> services_{};
  std::map<someip::ServiceId, std::set<std::uint16_t>> ports_{};
};

/// Topics, and ROS services, of which each belongs to one route.
class Names {
 public:
  /// Whether one with the entry's name is there already; tells so. If not, it is there now.
  bool has(const RouteEntry& entry, const Place& place, std::vector<NotCarried>& not_carried) {
    const bool is_method = std::string_view{entry.list} == "methods";
    const std::string name = entry.node[is_method ? "ros_service" : "topic"].Scalar();
    const auto [at, is_new] = (is_method ? services_ : topics_).try_emplace(name, entry.element);
    if (!is_new) {
      not_carried.push_back(
          {entry.element, fmt::format("its name is that of {}: {}", at->second, name), place});
    }
    return !is_new;
  }

 private:
  std::map<std::string, std::string> topics_{};
  std::map<std::string, std::string> services_{};
};

/// What a route file does not have of an instance.
void tell_of_instance(const Service& service, const Instance& instance,
                      std::vector<NotCarried>& not_carried) {
  const auto lacks = [&](bool is_there, const char* what) {
    if (is_there) {
      not_carried.push_back({service.name, what, instance.place});
    }
  };
  lacks(instance.timing.has_value(), "its times of service discovery");
  lacks(instance.priority || instance.weight, "load balancing");
  lacks(!instance.configuration.empty(), "configuration options");
}

}  // namespace

std::vector<RouteEntry> route_entries(const Model& model, const Lowered& lowered, const RouteOptions& options,
                                      std::vector<NotCarried>& not_carried) {
  const RouteEntries entries_of{model, lowered, options};
  const InstanceIndex index{model};
  std::set<std::pair<std::string, std::optional<someip::InstanceId>>> provided_ones;
  for (const Instance& instance : model.instances) {
    if (instance.role == Instance::Role::provided) {
      provided_ones.emplace(instance.service, instance.id);
      provided_ones.emplace(instance.service, std::nullopt);  // a required one without id is any of them
    }
  }
  std::vector<RouteEntry> all;
  not_carried.insert(not_carried.end(), lowered.not_carried.begin(), lowered.not_carried.end());
  // Each reason once: of several instances, and of what has no form in ROS 2 anyway.
  std::map<std::string, std::set<std::string>> formless;
  for (const NotCarried& one : lowered.not_carried) {
    formless[one.element].insert(one.what);
  }
  std::set<std::pair<std::string, std::string>> told;
  const auto tell = [&](const Service& service, std::vector<NotCarried> reasons) {
    for (NotCarried& one : reasons) {
      const std::string member = one.element.substr(std::min(service.name.size(), one.element.size()));
      const auto known = formless.find(full_name(service.scope, service.name) + member);
      const bool is_known =
          known != formless.end() && (one.what == no_eventgroup || one.what == no_id ||
                                      one.what == no_instance_id || known->second.contains(one.what));
      if (!is_known && told.emplace(one.element, one.what).second) {
        not_carried.push_back(std::move(one));
      }
    }
  };
  std::set<std::tuple<std::string, someip::InstanceId, Side>> done;
  Offers offers{model, options.first_port};
  Names names;
  const std::set<std::string, std::less<>> bases = only_bases(model);
  for (const Instance& instance : model.instances) {
    const Service* service = index.service(instance.service);
    if (service == nullptr) {
      not_carried.push_back(
          {label_of(instance), "the instance of a service that is not described", instance.place});
      continue;
    }
    if (bases.contains(instance.service)) {
      not_carried.push_back(
          {service->name, "it has no id and no instance, and others extend it", service->place});
      continue;
    }
    const bool provided = instance.role == Instance::Role::provided;
    const Side side = options.side.value_or(provided && !service->from_ros ? Side::client : Side::server);
    if (instance.id && !done.emplace(instance.service, *instance.id, side).second) {
      continue;  // one that another machine provides or wants, too
    }
    const bool is_there = !provided && provided_ones.contains({instance.service, instance.id});
    if (is_there && (!options.side || !instance.id)) {
      not_carried.push_back({service->name, "that it is required, as it is provided, too", instance.place});
      continue;
    }
    if (std::string fault = offers.fault_of(*service, instance); !fault.empty()) {
      not_carried.push_back({service->name, std::move(fault), instance.place});
      continue;
    }
    const std::uint16_t port = offers.port_of(*service, instance, side, not_carried);
    std::vector<NotCarried> reasons;
    std::vector<RouteEntry> entries = entries_of.of(*service, instance, side, port, reasons);
    take_out(entries, [&](const RouteEntry& one) { return names.has(one, instance.place, reasons); });
    tell_of_instance(*service, instance, reasons);
    tell(*service, std::move(reasons));
    all.insert(all.end(), std::make_move_iterator(entries.begin()), std::make_move_iterator(entries.end()));
  }
  return all;
}

}  // namespace trestle::describe
