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
  auto service_id = id<someip::ServiceId>(service_node, "a service id");
  const auto instance_id = this->instance_id(instance_node, 0xfffe);
  if (!service_id) {
    // What else is wrong in it is told at once. Nothing is done with a model that has an error.
    service_id = stand_in_;
    stand_in_ = someip::ServiceId{static_cast<std::uint16_t>(someip::value(stand_in_) - 1)};
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
  const std::size_t at = service_of(*service_id, place(node));
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
  add_description(std::move(instance), node);
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

void VsomeipReader::add_description(Instance instance, const JsonNode& node) {
  if (!instance.id) {
    append_instance(std::move(instance));
    return;
  }
  std::vector<std::size_t>& all = described_[{*instance.service_id, instance.id}];
  const auto same = std::ranges::find_if(all, [&](std::size_t one) {
    return hosts_of_instances_[one] == host_ && model_.instances[one].role == instance.role;
  });
  if (same != all.end()) {
    Instance& known = model_.instances[*same];
    if (!can_compare(known, instance, node)) {
      return;
    }
    if (known.place.file == file_) {
      warning(node, fmt::format("a second description of instance 0x{:04x} of {}: what it adds is taken, but "
                                "vsomeip takes the first alone",
                                someip::value(*instance.id), instance.service));
    }
    join(*same, instance);
    return;
  }
  // Two hosts may list a service that one of them offers: describe::join() tells of it.
  if (!all.empty()) {
    const std::size_t first = all.front();
    const bool are_servers =
        instance.role == Instance::Role::provided && model_.instances[first].role == Instance::Role::provided;
    if (!are_servers) {
      if (!can_compare(model_.instances[first], instance, node)) {
        return;
      }
      Instance known = model_.instances[first];
      Instance other = instance;
      take_address(known, hosts_[hosts_of_instances_[first]]);
      take_address(other, host());
      known.role = Instance::Role::provided;
      describe::add_instance(known, other, contradictions_);
    }
  }
  all.push_back(model_.instances.size());
  append_instance(std::move(instance));
}

bool VsomeipReader::can_compare(const Instance& known, const Instance& other, const JsonNode& node) {
  constexpr std::size_t most = 10'000'000;  // each group of the second is looked for in those of the first
  compared_ += (known.multicast.size() + 1) * (other.multicast.size() + 1);
  if (compared_ > most) {
    error(node,
          "descriptions of instances that were described before have too many multicast groups to "
          "compare them all: describe each instance once");
  }
  return compared_ <= most;
}

void VsomeipReader::join(std::size_t index, const Instance& other) {
  Instance& known = model_.instances[index];
  const Transport before = usual_transport(known);
  const Instance::Role role = std::exchange(known.role, Instance::Role::provided);  // a server's endpoint
  describe::add_instance(known, other, contradictions_);
  known.role = role;
  const Transport after = usual_transport(known);
  if (after != before || after != usual_transport(other)) {
    transports_.try_emplace(*known.service_id, index);
  }
}

void VsomeipReader::set_transports(Service& service, const Instance& instance) {
  const auto set = [transport = usual_transport(instance)](Transfer& transfer) {
    if (!transfer.transport_at) {
      transfer.transport = transport;
    }
  };
  for (Event& event : service.events) {
    set(event.transfer);
  }
  for (Method& method : service.methods) {
    set(method.request_transfer);
    set(method.response_transfer);
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
    Event& event = event_of(service, one.id, instance, said.place);
    if (said.transport_at) {
      event.transfer.transport = said.transport;
      event.transfer.transport_at = said.transport_at;
    }
    event.cycle = said.cycle ? said.cycle : event.cycle;
  }
}

void VsomeipReader::make_fields(Service& service) {
  std::vector<Event> events;
  for (Event& event : service.events) {
    const auto said = said_events_.find({*service.id, *event.id});
    if (said == said_events_.end() || !said->second.is_field) {
      events.push_back(std::move(event));
      continue;
    }
    service.fields.push_back({.name = fmt::format("field_{:04x}", someip::value(*event.id)),
                              .payload = {.known = false},
                              .notifier = event.id,
                              .has_getter = false,
                              .has_setter = false,
                              .eventgroups = std::move(event.eventgroups),
                              .notifier_transfer = event.transfer,
                              .cycle = event.cycle,
                              .e2e = std::move(event.e2e),
                              .place = event.place});
  }
  service.events = std::move(events);
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
  const std::string name = fmt::format("event 0x{:04x}", someip::value(event.id));
  const bool is_one_instance = event.instance == other.instance;
  /// @return whether both say it, and not the same
  const auto add = [](auto& value, std::optional<Place>& at, const auto& other_value,
                      const std::optional<Place>& other_at) {
    if (!at && other_at) {
      value = other_value;
      at = other_at;
    }
    return at && other_at && value != other_value;
  };
  const auto truth_text = [](bool is) { return std::string{is ? "true" : "false"}; };
  const auto time_text = [](const auto& time) { return documents::to_string(Duration{*time}); };
  if (add(event.is_field, event.is_field_at, other.is_field, other.is_field_at)) {
    // vsomeip itself asks its applications, and not the configuration, whether an event is a field.
    problems_[other.is_field_at->file].warning(
        other.is_field_at->mark, fmt::format("{} has is_field {} here, but {} at {}: the first is taken",
                                             name, truth_text(other.is_field), truth_text(event.is_field),
                                             to_string(model_, *event.is_field_at)));
  }
  if (add(event.transport, event.transport_at, other.transport, other.transport_at)) {
    differ(name, "is_reliable", {truth_text(event.transport == Transport::tcp), *event.transport_at},
           {truth_text(other.transport == Transport::tcp), *other.transport_at}, is_one_instance);
  }
  if (add(event.cycle, event.cycle_at, other.cycle, other.cycle_at)) {
    differ(name, "the cycle", {time_text(event.cycle), *event.cycle_at},
           {time_text(other.cycle), *other.cycle_at}, is_one_instance);
  }
}

void VsomeipReader::differ(const std::string& message, std::string_view what, const SaidValue& first,
                           const SaidValue& second, bool is_one_instance) {
  if (is_one_instance) {
    contradictions_.add(message, what, first, second);
    return;
  }
  problems_[second.place.file].warning(
      second.place.mark,
      fmt::format("{} has {} {} here, but {} at {}, of another instance: an interface has "
                  "one for all, and the first is taken",
                  message, what, second.value, first.value, to_string(model_, first.place)));
}

bool VsomeipReader::says(const Message& message, std::string_view what, std::string text,
                         const JsonNode& node) {
  const SaidValue value{std::move(text), place(node)};
  const EventKey key{*message.service.id, message.id};
  const InstanceKey instance{*message.service.id, message.instance.id};
  const auto [known, is_new] =
      said_messages_.try_emplace({key, message.is_request, what}, std::pair{value, instance});
  const auto& [first, of] = known->second;
  if (!is_new && first.value != value.value) {
    const char* const kind = message.is_request                            ? "the request of method"
                             : someip::value(message.id) >= first_event_id ? "event"
                                                                           : "the answer of method";
    differ(fmt::format("{} 0x{:04x}", kind, someip::value(message.id)), what, first, value, of == instance);
  }
  return is_new;
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
    group.group_at = place(*multicast);
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
    if (group.threshold > 0 && node.find("multicast") == nullptr) {
      warning(
          *node.find("threshold"),
          fmt::format("the threshold {} of eventgroup 0x{:04x} is left out: without \"multicast\", all of "
                      "its subscribers get events by unicast",
                      group.threshold, someip::value(id)));
    }
    return;
  }
  group.has_usual_port = group.group.port == 0;
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
  auto& groups = event_of(service, *id, instance, place(node)).eventgroups;
  if (std::ranges::find(groups, group) == groups.end()) {
    groups.push_back(group);
  }
}

Event& VsomeipReader::event_of(Service& service, someip::MethodId id, const Instance& instance,
                               const Place& at) {
  const auto [found, is_new] = events_.emplace(EventKey{*service.id, id}, service.events.size());
  if (is_new) {
    service.events.push_back({.name = fmt::format("event_{:04x}", someip::value(id)),
                              .id = id,
                              .payload = {.known = false},
                              .transfer = {.transport = usual_transport(instance)},
                              .place = at});
  }
  return service.events[found->second];
}

Method& VsomeipReader::method_of(Service& service, someip::MethodId id, const Instance& instance,
                                 const Place& at) {
  const auto [found, is_new] = methods_.emplace(EventKey{*service.id, id}, service.methods.size());
  if (is_new) {
    const Transfer transfer{.transport = usual_transport(instance)};
    service.methods.push_back({.name = fmt::format("method_{:04x}", someip::value(id)),
                               .id = id,
                               .request = {.known = false},
                               .response = {.known = false},
                               .request_transfer = transfer,
                               .response_transfer = transfer,
                               .place = at});
  }
  return service.methods[found->second];
}

Transfer& VsomeipReader::transfer_of(const Message& message, const JsonNode& node) {
  const auto& [service, id, is_request, instance] = message;
  if (!is_request && (has_event(service, id) || someip::value(id) >= first_event_id)) {
    return event_of(service, id, instance, place(node)).transfer;
  }
  Method& method = method_of(service, id, instance, place(node));
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
  const Message message{service, *id, is_request, instance};
  Transfer& transfer = transfer_of(message, node);
  if (transfer.segment_bytes == 0) {
    transfer.segment_bytes = vsomeip_segment_bytes;
  }
  if (!is_object) {
    return;
  }
  check_keys(node, vsomeip_keys::tp_of_method);
  const JsonNode* const length = node.find("max-segment-length");
  if (const auto said = number(length, "the bytes of a segment", 16, 0xffff)) {
    const auto bytes = static_cast<std::uint32_t>(*said / 16 * 16);
    if (*said % 16 != 0) {
      warning(*length, fmt::format("a segment has a multiple of 16 bytes: {} is used", bytes));
    }
    if (says(message, "the bytes of a segment", fmt::to_string(bytes), *length)) {
      transfer.segment_bytes = bytes;
      transfer.segment_bytes_at = place(*length);
    }
  }
  const JsonNode* const separation = node.find("separation-time");
  if (const auto said = number(separation, "a time in microseconds", 0, 1'000'000'000)) {
    const std::chrono::microseconds time{*said};
    if (says(message, "the time between segments", documents::to_string(Duration{time}), *separation)) {
      transfer.separation = time;
    }
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
    const Message message{service, static_cast<someip::MethodId>(*number), is_request, instance};
    Transfer& transfer = transfer_of(message, member);
    check_keys(member, vsomeip_keys::debounce_of_method);
    if (!transfer.retention_at) {
      const Transfer& usual = is_request ? host().requests : host().responses;
      transfer.debounce = usual.debounce;
      transfer.retention = usual.retention;
      transfer.retention_at = place(member);
    }
    const auto time = [&](const char* key, std::string_view what, std::chrono::microseconds& to) {
      const JsonNode* const found = member.find(key);
      const auto said = milliseconds(found, "a time");
      if (said && says(message, what, documents::to_string(Duration{*said}), *found)) {
        to = *said;
      }
    };
    time("debounce-time", "the debounce time", transfer.debounce);
    time("maximum-retention-time", "the retention time", transfer.retention);
  }
}

}  // namespace trestle::describe
