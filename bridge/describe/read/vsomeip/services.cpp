// Services, events and eventgroups of a vsomeip configuration.
#include <fmt/format.h>

#include "bridge/describe/read/vsomeip/vsomeip_reader.hpp"

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
  if (instance_id && !provided_.insert({*service_id, instance_id}).second) {
    warning(node, fmt::format("a second description of instance 0x{:04x} of service 0x{:04x} is left out, "
                              "as vsomeip does",
                              someip::value(*instance_id), someip::value(*service_id)));
    return;
  }
  const std::size_t at = service_of(*service_id, node);
  Instance instance{.name = instance_id ? fmt::format("instance_{:04x}", someip::value(*instance_id)) : "",
                    .service = model_.services[at].name,
                    .service_id = service_id,
                    .id = instance_id,
                    .place = place(node)};
  if (const JsonNode* unicast = node.find("unicast"); unicast != nullptr && unicast->text != "local") {
    instance.address = address(unicast, "the address of the service");
    // A service of another host is told to those who use it without service discovery.
    if (instance.address && settings_.address && instance.address != settings_.address) {
      instance.role = Instance::Role::required;
    }
  }
  const auto endpoint = [this](const JsonNode* reliability, const std::string& what) {
    if (reliability != nullptr && reliability->kind == JsonNode::Kind::array) {
      const JsonNode* first = reliability->elements.empty() ? nullptr : &reliability->elements.front();
      if (reliability->elements.size() > 1) {
        warning(*reliability, "only the first of several ports is used");
      }
      reliability = first;
    }
    if (reliability == nullptr || reliability->kind != JsonNode::Kind::object) {
      return port(reliability, what);
    }
    check_keys(*reliability, vsomeip_keys::port);
    for (const char* key : {"enable-magic-cookies", "magic-cookies"}) {
      if (const JsonNode* cookies = reliability->find(key); truth(cookies, false)) {
        left_out(cookies, "magic cookies are left out");
      }
    }
    return port(reliability->find("port"), what);
  };
  instance.tcp_port = endpoint(node.find("reliable"), "a TCP port");
  instance.udp_port = endpoint(node.find("unreliable"), "a UDP port");

  Service& service = model_.services[at];
  each(node.find("events"), "an event", JsonNode::Kind::object,
       [&](const JsonNode& one) { event(one, service, instance); });
  std::optional<Endpoint> shared;  // of older releases: one group for all eventgroups of the service
  if (const JsonNode* group = object(node.find("multicast"), "a multicast group")) {
    check_keys(*group, vsomeip_keys::multicast);
    if (const auto group_address = address(group->find("address"), "the address of a group")) {
      shared = Endpoint{*group_address, port(group->find("port"), "the port of a group").value_or(0)};
    }
  }
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
  model_.instances.push_back(std::move(instance));
}

void VsomeipReader::event(const JsonNode& node, Service& service, const Instance& instance) {
  check_keys(node, vsomeip_keys::event);
  const auto id = this->id<someip::MethodId>(node.find("event"), "an event id");
  if (!id) {
    if (node.find("event") == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return;
  }
  if (has_event(service, *id)) {  // of another instance
    return;
  }
  Transfer transfer{.transport = usual_transport(instance)};
  if (const JsonNode* reliable = node.find("is_reliable")) {
    transfer.transport = truth(reliable, false) ? Transport::tcp : Transport::udp;
  }
  std::optional<std::chrono::microseconds> cycle;
  for (const char* key : {"update-cycle", "cycle"}) {
    if (const auto time = milliseconds(node.find(key), "a cycle"); time && time->count() != 0) {
      cycle = *time;
    }
  }
  if (truth(node.find("is_field"), false)) {
    events_[{*service.id, *id}] = {true, service.fields.size()};
    service.fields.push_back({.name = fmt::format("field_{:04x}", someip::value(*id)),
                              .payload = {.known = false},
                              .notifier = id,
                              .has_getter = false,
                              .has_setter = false,
                              .notifier_transfer = transfer,
                              .cycle = cycle,
                              .place = place(node)});
    return;
  }
  add_event(service, {.name = fmt::format("event_{:04x}", someip::value(*id)),
                      .id = id,
                      .transfer = transfer,
                      .cycle = cycle,
                      .place = place(node)});
}

void VsomeipReader::multicast(const JsonNode& node, const std::optional<Endpoint>& shared, Multicast& group) {
  const JsonNode* multicast = node.find("multicast");
  if (multicast != nullptr && multicast->kind == JsonNode::Kind::object) {
    check_keys(*multicast, vsomeip_keys::multicast);
    if (const auto found = address(multicast->find("address"), "the address of a group")) {
      group.group = {*found, port(multicast->find("port"), "the port of a group").value_or(0)};
    }
  } else if (const auto found = address(multicast, "the address of a group")) {
    group.group.address = *found;
  } else if (shared && truth(node.find("is_multicast"), true)) {
    group.group = *shared;
    group.threshold = 1;
  }
  if (const auto threshold = number(node.find("threshold"), "a threshold", 0, 0xffff'ffff)) {
    group.threshold = static_cast<std::uint32_t>(std::min<std::uint64_t>(*threshold, 255));
  }
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
  Multicast group{.eventgroup = *id};
  multicast(node, shared, group);
  if (!group.group.address.is_unspecified()) {
    if (group.group.port == 0) {
      group.group.port = instance.udp_port.value_or(0);
    }
    // Of two eventgroups with one id vsomeip takes the last.
    const auto [found, is_new] = multicast_.emplace(*id, instance.multicast.size());
    if (is_new) {
      instance.multicast.emplace_back();
    }
    instance.multicast[found->second] = group;
  }
  each(node.find("events"), "an event", JsonNode::Kind::string,
       [&](const JsonNode& one) { in_eventgroup(one, *id, of, instance); });
}

void VsomeipReader::in_eventgroup(const JsonNode& node, someip::EventgroupId group, Service& service,
                                  const Instance& instance) {
  // Older files describe the event here.
  const JsonNode* id_node = node.kind == JsonNode::Kind::object ? node.find("event") : &node;
  const auto id = this->id<someip::MethodId>(id_node, "an event id");
  if (!id) {
    if (id_node == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return;
  }
  if (!has_event(service, *id)) {
    if (node.kind == JsonNode::Kind::object) {
      event(node, service, instance);
    } else {
      add_event(service, {.name = fmt::format("event_{:04x}", someip::value(*id)),
                          .id = id,
                          .transfer = {.transport = usual_transport(instance)},
                          .place = place(node)});
    }
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
  if (const auto bytes = number(node.find("max-segment-length"), "the bytes of a segment", 16, 0xffff)) {
    transfer.segment_bytes = static_cast<std::uint32_t>(*bytes / 16 * 16);
    if (*bytes % 16 != 0) {
      warning(*node.find("max-segment-length"),
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
    const Transfer& usual = is_request ? settings_.requests : settings_.responses;
    transfer.debounce = usual.debounce;
    transfer.retention = usual.retention;
    if (const auto time = milliseconds(member.find("debounce-time"), "a time")) {
      transfer.debounce = *time;
    }
    if (const auto time = milliseconds(member.find("maximum-retention-time"), "a time")) {
      transfer.retention = *time;
    }
  }
}

}  // namespace trestle::describe
