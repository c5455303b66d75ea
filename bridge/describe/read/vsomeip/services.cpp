// Services, events and eventgroups of a vsomeip configuration.
#include <fmt/format.h>

#include <tuple>

#include "bridge/describe/join.hpp"
#include "bridge/describe/join_instances.hpp"
#include "bridge/describe/read/vsomeip/vsomeip_reader.hpp"
#include "bridge/documents/format.hpp"

namespace trestle::describe {
namespace {

constexpr std::uint32_t vsomeip_segment_bytes = 1392;

Transport usual_transport(const Instance& instance) {
  return !instance.udp_port && instance.tcp_port ? Transport::tcp : Transport::udp;
}

}  // namespace

void VsomeipReader::services(const JsonNode* node) {
  each(node, "a service", JsonNode::Kind::object, [this](const JsonNode& one) { service(one); });
}

void VsomeipReader::service(const JsonNode& node) {
  check_keys(node, vsomeip_keys::service);
  const JsonNode* service_node = node.find("service");
  const JsonNode* instance_node = node.find("instance");
  if (service_node == nullptr || instance_node == nullptr) {
    error(node, std::string{"expected a \""} + (service_node == nullptr ? "service" : "instance") +
                    "\" with its id");
    return;
  }
  const auto service_id = id<someip::ServiceId>(service_node, "a service id");
  const auto instance_id = this->instance_id(instance_node, 0xfffe);
  if (!service_id) {
    return;
  }
  if (const JsonNode* protocol = node.find("protocol"); protocol != nullptr && protocol->text != "someip") {
    warning(*protocol, "a service of another protocol than \"someip\" is left out");
    return;
  }
  Instance instance{.name = instance_id ? fmt::format("instance_{:04x}", someip::value(*instance_id)) : "",
                    .service = fmt::format("service_{:04x}", someip::value(*service_id)),
                    .service_id = service_id,
                    .id = instance_id,
                    .place = place(node)};
  if (const JsonNode* unicast = node.find("unicast"); unicast != nullptr && unicast->text != "local") {
    instance.address = address(unicast, "the address of the service");
    instance.said_at["address"] = place(*unicast);
    // A service of another host is told to those who use it without service discovery.
    if (instance.address && host().address && instance.address != host().address) {
      instance.role = Instance::Role::required;
    }
  }
  for (const auto& [key, setting, port] : {std::tuple{"reliable", "tcp_port", &instance.tcp_port},
                                           {"unreliable", "udp_port", &instance.udp_port}}) {
    const JsonNode* const found = node.find(key);
    *port = endpoint(found, port == &instance.tcp_port ? "a TCP port" : "a UDP port");
    if (*port) {
      instance.said_at[setting] = place(*found);
    }
  }
  if (instance_id) {
    const auto [known, is_new] = provided_.try_emplace({*service_id, instance_id}, model_.instances.size());
    // Configurations of several hosts often list all services, whoever offers them.
    const bool is_of_another_host = !is_new && hosts_of_instances_[known->second] != host_ &&
                                    !instance.address && !model_.instances[known->second].address;
    if (!is_new && !is_of_another_host) {
      second(node, known->second, std::move(instance));
      return;
    }
  }
  const std::size_t at = service_of(*service_id, node);
  Service& service = model_.services[at];
  events(node, service, instance);
  const std::optional<Endpoint> shared = shared_group(node);
  multicast_.clear();
  each(node.find("eventgroups"), "an eventgroup", JsonNode::Kind::object,
       [&](const JsonNode& one) { eventgroup(one, shared, at, instance); });
  if (const JsonNode* settings = object(node.find("someip-tp"), "settings of SOME/IP-TP")) {
    tp(*settings, service, instance);
  }
  if (const JsonNode* times = object(node.find("debounce-times"), "times of nPDUs")) {
    check_keys(*times, vsomeip_keys::debounce);
    for (const bool is_request : {true, false}) {
      if (const JsonNode* part =
              object(times->find(is_request ? "requests" : "responses"), "times by method")) {
        debounce(*part, is_request, service, instance);
      }
    }
  }
  append_instance(std::move(instance));
}

std::optional<std::uint16_t> VsomeipReader::endpoint(const JsonNode* node, const std::string& what) {
  if (node != nullptr && node->kind == JsonNode::Kind::array) {
    const JsonNode* first = node->elements.empty() ? nullptr : &node->elements.front();
    if (node->elements.size() > 1) {
      warning(*node, "only the first of several ports is used");
    }
    node = first;
  }
  if (node == nullptr || node->kind != JsonNode::Kind::object) {
    return port(node, what);
  }
  check_keys(*node, vsomeip_keys::port);
  for (const char* key : {"enable-magic-cookies", "magic-cookies"}) {
    if (const JsonNode* cookies = node->find(key); truth(cookies, false)) {
      left_out(cookies, "magic cookies are left out");
    }
  }
  return port(node->find("port"), what);
}

/// Of older releases: one group for all eventgroups of the service.
std::optional<Endpoint> VsomeipReader::shared_group(const JsonNode& service) {
  const JsonNode* const group = object(service.find("multicast"), "a multicast group");
  if (group == nullptr) {
    return std::nullopt;
  }
  check_keys(*group, vsomeip_keys::multicast);
  const auto found = address(group->find("address"), "the address of a group");
  return found ? std::optional{Endpoint{*found, port(group->find("port"), "the port of a group").value_or(0)}}
               : std::nullopt;
}

void VsomeipReader::second(const JsonNode& node, std::size_t index, Instance other) {
  constexpr std::size_t most = 100;  // are compared: a hostile file may have many, of a large instance
  const auto leave_out = [&] {
    warning(node, fmt::format("a second description of instance 0x{:04x} of service 0x{:04x} is left out, "
                              "as vsomeip does",
                              someip::value(*other.id), someip::value(*other.service_id)));
  };
  if (++seconds_ > most) {
    leave_out();
    return;
  }
  const std::size_t before = contradictions_.count();
  Instance known = model_.instances[index];
  take_address(known, hosts_[hosts_of_instances_[index]]);
  take_address(other, host());
  known.role = other.role = Instance::Role::provided;  // whose endpoint it is, whoever uses it
  multicast_.clear();
  const std::optional<Endpoint> shared = shared_group(node);
  each(node.find("eventgroups"), "an eventgroup", JsonNode::Kind::object, [&](const JsonNode& one) {
    if (one.find("eventgroup") != nullptr) {
      if (const auto id = this->id<someip::EventgroupId>(one.find("eventgroup"), "an eventgroup id")) {
        group(one, *id, shared, other);
      }
    }
  });
  describe::add_instance(known, other, contradictions_);
  for (const VsomeipEvent& one : events_of(node, other)) {
    if (const auto event = said_events_.find({*other.service_id, one.id}); event != said_events_.end()) {
      VsomeipEvent first = event->second;
      join(first, one);
    }
  }
  if (contradictions_.count() == before) {
    leave_out();
  }
}

std::vector<VsomeipEvent> VsomeipReader::events_of(const JsonNode& node, const Instance& instance) {
  std::vector<VsomeipEvent> events;
  std::map<someip::MethodId, std::size_t> places;
  const auto take = [&](const JsonNode& one) {
    auto said = event(one, instance);
    if (!said) {
      return;
    }
    if (const auto [at, is_new] = places.try_emplace(said->id, events.size()); is_new) {
      events.push_back(std::move(*said));
    } else {
      join(events[at->second], *said);
    }
  };
  each(node.find("events"), "an event", JsonNode::Kind::object, take);
  // Older files describe events in their eventgroups.
  each(node.find("eventgroups"), "an eventgroup", JsonNode::Kind::object, [&](const JsonNode& group) {
    if (group.find("eventgroup") != nullptr) {
      each(group.find("events"), "an event", JsonNode::Kind::string, [&](const JsonNode& one) {
        if (one.kind == JsonNode::Kind::object) {
          take(one);
        }
      });
    }
  });
  return events;
}

void VsomeipReader::events(const JsonNode& node, Service& service, const Instance& instance) {
  for (const VsomeipEvent& one : events_of(node, instance)) {
    const auto [known, is_first] = said_events_.try_emplace(EventKey{*service.id, one.id}, one);
    if (!is_first) {
      join(known->second, one);
    }
    const VsomeipEvent& said = known->second;
    const bool is_new = !has_event(service, one.id);
    if (is_new && said.is_field) {
      events_[{*service.id, one.id}] = {true, service.fields.size()};
      service.fields.push_back({.name = fmt::format("field_{:04x}", someip::value(one.id)),
                                .payload = {.known = false},
                                .notifier = one.id,
                                .has_getter = false,
                                .has_setter = false,
                                .place = said.place});
    } else if (is_new) {
      add_event(
          service,
          {.name = fmt::format("event_{:04x}", someip::value(one.id)), .id = one.id, .place = said.place});
    }
    const auto [is_field, at] = events_.at({*service.id, one.id});
    Transfer& transfer = is_field ? service.fields[at].notifier_transfer : service.events[at].transfer;
    if (is_new || said.transport_at) {
      transfer.transport = said.transport;
      transfer.transport_at = said.transport_at;
    }
    auto& cycle = is_field ? service.fields[at].cycle : service.events[at].cycle;
    cycle = said.cycle ? said.cycle : cycle;
  }
}

std::optional<VsomeipEvent> VsomeipReader::event(const JsonNode& node, const Instance& instance) {
  check_keys(node, vsomeip_keys::event);
  const auto id = this->id<someip::MethodId>(node.find("event"), "an event id");
  if (!id) {
    if (node.find("event") == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return std::nullopt;
  }
  VsomeipEvent event{
      .id = *id, .instance = instance.id, .place = place(node), .transport = usual_transport(instance)};
  const auto said_at = [this](const JsonNode& found) {
    return is_placeholder(&found) ? std::nullopt : std::optional{place(found)};
  };
  if (const JsonNode* reliable = node.find("is_reliable")) {
    event.transport = truth(reliable, false) ? Transport::tcp : Transport::udp;
    event.transport_at = said_at(*reliable);
  }
  for (const char* key : {"update-cycle", "cycle"}) {
    const JsonNode* const found = node.find(key);
    if (const auto time = milliseconds(found, "a cycle"); time && time->count() != 0) {
      event.cycle = *time;
      event.cycle_at = place(*found);
    }
  }
  if (const JsonNode* field = node.find("is_field")) {
    event.is_field = truth(field, false);
    event.is_field_at = said_at(*field);
  }
  return event;
}

void VsomeipReader::join(VsomeipEvent& event, const VsomeipEvent& other) {
  const auto say = [&](const char* what, auto& value, std::optional<Place>& at, const auto& other_value,
                       const std::optional<Place>& other_at, const auto& text, bool is_used = true) {
    if (!at && other_at) {
      value = other_value;
      at = other_at;
    } else if (at && other_at && value != other_value) {
      if (!is_used) {
        problems_->warning(other_at->mark,
                           fmt::format("event 0x{:04x} has {} {} here, but {} at {}: the first is taken",
                                       someip::value(event.id), what, text(other_value), text(value),
                                       to_string(model_, *at)));
      } else if (event.instance == other.instance) {
        contradictions_.add(fmt::format("event 0x{:04x}", someip::value(event.id)), what, {text(value), *at},
                            {text(other_value), *other_at});
      } else {  // vsomeip lets each instance have its own
        problems_->warning(other_at->mark,
                           fmt::format("event 0x{:04x} has {} {} here, but {} at {}, of another instance: "
                                       "an interface has one for all, and the first is taken",
                                       someip::value(event.id), what, text(other_value), text(value),
                                       to_string(model_, *at)));
      }
    }
  };
  const auto truth_text = [](bool is) { return std::string{is ? "true" : "false"}; };
  const auto transport_text = [](Transport transport) {
    return std::string{transport == Transport::tcp ? "true" : "false"};
  };
  const auto time_text = [](const auto& time) { return documents::to_string(Duration{*time}); };
  // vsomeip itself asks its applications, and not the configuration, whether an event is a field.
  say("is_field", event.is_field, event.is_field_at, other.is_field, other.is_field_at, truth_text, false);
  say("is_reliable", event.transport, event.transport_at, other.transport, other.transport_at,
      transport_text);
  say("the cycle", event.cycle, event.cycle_at, other.cycle, other.cycle_at, time_text);
}

void VsomeipReader::multicast(const JsonNode& node, const std::optional<Endpoint>& shared, Multicast& group) {
  const JsonNode* multicast = node.find("multicast");
  if (multicast != nullptr && multicast->kind == JsonNode::Kind::object) {
    check_keys(*multicast, vsomeip_keys::multicast);
    if (const auto found = address(multicast->find("address"), "the address of a group")) {
      group.group = {*found, port(multicast->find("port"), "the port of a group").value_or(0)};
      group.group_at = place(*multicast);
    }
  } else if (const auto found = address(multicast, "the address of a group")) {
    group.group.address = *found;
  } else if (shared && truth(node.find("is_multicast"), true)) {
    group.group = *shared;
    group.group_at = place(node);
    group.threshold = 1;
  }
  const JsonNode* const threshold_node = node.find("threshold");
  if (const auto threshold = number(threshold_node, "a threshold", 0, 0xffff'ffff)) {
    group.threshold = static_cast<std::uint32_t>(std::min<std::uint64_t>(*threshold, 255));
    group.threshold_at = place(*threshold_node);
  }
}

void VsomeipReader::group(const JsonNode& node, someip::EventgroupId id,
                          const std::optional<Endpoint>& shared, Instance& instance) {
  Multicast group{.eventgroup = id};
  multicast(node, shared, group);
  if (group.group.address.is_unspecified()) {
    return;
  }
  if (group.group.port == 0) {
    group.group.port = instance.udp_port.value_or(0);
    group.group_at.reset();
  }
  const auto [found, is_new] = multicast_.emplace(id, instance.multicast.size());
  if (is_new) {
    instance.multicast.push_back(group);
    return;
  }
  const auto with = [&instance](Multicast one) {
    return Instance{.service = instance.service,
                    .service_id = instance.service_id,
                    .id = instance.id,
                    .multicast = {std::move(one)},
                    .place = instance.place};
  };
  Instance known = with(instance.multicast[found->second]);
  describe::add_instance(known, with(group), contradictions_);
  instance.multicast[found->second] = known.multicast.front();
}

void VsomeipReader::eventgroup(const JsonNode& node, const std::optional<Endpoint>& shared,
                               std::size_t service, Instance& instance) {
  check_keys(node, vsomeip_keys::eventgroup);
  const auto id = this->id<someip::EventgroupId>(node.find("eventgroup"), "an eventgroup id");
  if (!id) {
    if (node.find("eventgroup") == nullptr) {
      warning(node, "expected an \"eventgroup\" with its id; without it, vsomeip leaves this out");
    }
    return;
  }
  Service& of = model_.services[service];
  const auto by_id = [](const Eventgroup& group, someip::EventgroupId other) {
    return someip::value(group.id) < someip::value(other);
  };
  const auto at = std::lower_bound(of.eventgroups.begin(), of.eventgroups.end(), *id, by_id);
  if (at == of.eventgroups.end() || at->id != *id) {
    of.eventgroups.insert(
        at, {.name = fmt::format("eventgroup_{:04x}", someip::value(*id)), .id = *id, .place = place(node)});
  }
  group(node, *id, shared, instance);
  each(node.find("events"), "an event", JsonNode::Kind::string,
       [&](const JsonNode& one) { in_eventgroup(one, *id, of, instance); });
}

void VsomeipReader::in_eventgroup(const JsonNode& node, someip::EventgroupId group, Service& service,
                                  const Instance& instance) {
  // Older files describe the event here: events() has read it.
  const JsonNode* id_node = node.kind == JsonNode::Kind::object ? node.find("event") : &node;
  const auto id = this->id<someip::MethodId>(id_node, "an event id");
  if (!id) {
    if (id_node == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return;
  }
  if (!has_event(service, *id)) {
    add_event(service, {.name = fmt::format("event_{:04x}", someip::value(*id)),
                        .id = id,
                        .transfer = {.transport = usual_transport(instance)},
                        .place = place(node)});
  }
  const auto [is_field, at] = events_.at({*service.id, *id});
  auto& groups = is_field ? service.fields[at].eventgroups : service.events[at].eventgroups;
  if (std::ranges::find(groups, group) == groups.end()) {
    groups.push_back(group);
  }
}

Method& VsomeipReader::method_of(Service& service, someip::MethodId id, const Instance& instance,
                                 const JsonNode& node) {
  const auto [found, is_new] = methods_.emplace(EventKey{*service.id, id}, service.methods.size());
  if (!is_new) {
    return service.methods[found->second];
  }
  const Transfer transfer{.transport = usual_transport(instance)};
  service.methods.push_back({.name = fmt::format("method_{:04x}", someip::value(id)),
                             .id = id,
                             .request = {.known = false},
                             .response = {.known = false},
                             .request_transfer = transfer,
                             .response_transfer = transfer,
                             .place = place(node)});
  return service.methods.back();
}

Transfer& VsomeipReader::transfer_of(Service& service, someip::MethodId id, bool is_request,
                                     const Instance& instance, const JsonNode& node) {
  if (!is_request && (has_event(service, id) || someip::value(id) >= first_event_id)) {
    if (!has_event(service, id)) {
      add_event(service, {.name = fmt::format("event_{:04x}", someip::value(id)),
                          .id = id,
                          .transfer = {.transport = usual_transport(instance)},
                          .place = place(node)});
    }
    const auto [is_field, at] = events_.at({*service.id, id});
    return is_field ? service.fields[at].notifier_transfer : service.events[at].transfer;
  }
  Method& method = method_of(service, id, instance, node);
  return is_request ? method.request_transfer : method.response_transfer;
}

void VsomeipReader::tp(const JsonNode& node, Service& service, const Instance& instance) {
  check_keys(node, vsomeip_keys::tp);
  each(node.find("client-to-service"), "a method", JsonNode::Kind::string,
       [&](const JsonNode& one) { tp_of(one, true, service, instance); });
  each(node.find("service-to-client"), "a method or event", JsonNode::Kind::string,
       [&](const JsonNode& one) { tp_of(one, false, service, instance); });
}

void VsomeipReader::tp_of(const JsonNode& node, bool is_request, Service& service, const Instance& instance) {
  const bool is_object = node.kind == JsonNode::Kind::object;
  const JsonNode* id_node = is_object ? node.find("method") : &node;
  const auto id = this->id<someip::MethodId>(id_node, "a method or event id");
  if (!id) {
    if (id_node == nullptr) {
      error(node, "expected a \"method\" with its id");
    }
    return;
  }
  Transfer& transfer = transfer_of(service, *id, is_request, instance, node);
  transfer.segment_bytes = vsomeip_segment_bytes;
  if (!is_object) {
    return;
  }
  check_keys(node, vsomeip_keys::tp_of_method);
  const JsonNode* const length = node.find("max-segment-length");
  if (const auto bytes = number(length, "the bytes of a segment", 16, 0xffff)) {
    transfer.segment_bytes_at = place(*length);
    transfer.segment_bytes = static_cast<std::uint32_t>(*bytes / 16 * 16);
    if (*bytes % 16 != 0) {
      warning(*length,
              fmt::format("a segment has a multiple of 16 bytes: {} is used", transfer.segment_bytes));
    }
  }
  if (const auto time = number(node.find("separation-time"), "a time in microseconds", 0, 1'000'000'000)) {
    transfer.separation = std::chrono::microseconds{*time};
  }
}

void VsomeipReader::debounce(const JsonNode& node, bool is_request, Service& service,
                             const Instance& instance) {
  for (const JsonNode& member : node.members) {
    const auto number = whole(member.name);
    if (!number || *number == 0 || *number > 0xffff) {
      JsonNode name{.kind = JsonNode::Kind::string, .text = member.name, .mark = member.name_mark};
      error(name, "expected a method or event id, not " + what_it_is(name));
      continue;
    }
    Transfer& transfer =
        transfer_of(service, static_cast<someip::MethodId>(*number), is_request, instance, member);
    check_keys(member, vsomeip_keys::debounce_of_method);
    const Transfer& usual = is_request ? host().requests : host().responses;
    transfer.debounce = usual.debounce;
    transfer.retention = usual.retention;
    if (const auto time = milliseconds(member.find("debounce-time"), "a time")) {
      transfer.debounce = *time;
    }
    transfer.retention_at = place(member);
    if (const auto time = milliseconds(member.find("maximum-retention-time"), "a time")) {
      transfer.retention = *time;
    }
  }
}

}  // namespace trestle::describe
