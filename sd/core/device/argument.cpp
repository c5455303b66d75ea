// Checks which descriptions a device accepts, and names the member that it does not accept.
#include "sd/core/device/argument.hpp"

#include <algorithm>

#include "sd/core/method_ids.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::device {

using sd::IdKind;

namespace {

constexpr BadArgument no_fault{};

constexpr BadArgument bad(Argument argument, std::size_t index = 0) noexcept {
  return {argument, static_cast<std::uint16_t>(index)};
}

bool are_of(std::span<const EventgroupId> groups, const Service& service) noexcept {
  return std::ranges::all_of(groups, [&](EventgroupId id) {
    return std::ranges::find(service.eventgroups, id, &sd::Eventgroup::id) != service.eventgroups.end();
  });
}

bool can_be(std::optional<std::uint32_t> ttl_s) noexcept {
  return !ttl_s || (*ttl_s >= 1 && *ttl_s <= sd::infinite_ttl_s);
}

// An id in a service, and what it belongs to.
struct Listed {
  MethodId id{};
  IdKind kind{};
  BadArgument where{};
};

std::size_t count_ids(const Service& service) noexcept {
  return service.methods.size() + service.events.size() + 3 * service.fields.size();
}

// The ids in one sequence: of methods, then events, then fields. A field has 0 for a missing part.
Listed id_at(const Service& service, std::size_t place) noexcept {
  if (place < service.methods.size()) {
    return {service.methods[place].id, IdKind::method, bad(Argument::method, place)};
  }
  place -= service.methods.size();
  if (place < service.events.size()) {
    return {service.events[place].id, IdKind::event, bad(Argument::listed_event, place)};
  }
  place -= service.events.size();
  const std::size_t index = place / 3;
  const Field& field = service.fields[index];
  switch (place % 3) {
    case 0:
      return {field.getter, IdKind::method, bad(Argument::field_getter, index)};
    case 1:
      return {field.setter, IdKind::method, bad(Argument::field_setter, index)};
    default:
      return {field.notifier, IdKind::event, bad(Argument::field_notifier, index)};
  }
}

// Methods and events share one space of ids.  [feat_req_someip_625]
BadArgument mistake_in_ids(const Service& service) noexcept {
  for (std::size_t i = 0; i < count_ids(service); ++i) {
    const Listed one = id_at(service, i);
    const bool may_be_0 = i >= service.methods.size() + service.events.size();
    if (one.id == MethodId{0}) {
      if (!may_be_0) {
        return one.where;
      }
      continue;
    }
    for (std::size_t before = 0; before < i; ++before) {
      if (id_at(service, before).id == one.id) {
        return one.where;
      }
    }
  }
  return no_fault;
}

BadArgument mistake_in_members(const Service& service) noexcept {
  for (std::size_t i = 0; i < service.eventgroups.size(); ++i) {
    const sd::Eventgroup& one = service.eventgroups[i];
    if (!someip::names_an_eventgroup(one.id) || !one.udp || one.tcp || one.multicast) {
      return bad(Argument::eventgroup, i);
    }
  }
  for (std::size_t i = 0; i < service.methods.size(); ++i) {
    if (service.methods[i].kind == someip::MethodKind::unknown) {
      return bad(Argument::method, i);
    }
  }
  for (std::size_t i = 0; i < service.events.size(); ++i) {
    if (!are_of(service.events[i].eventgroups, service)) {
      return bad(Argument::event_eventgroups, i);
    }
  }
  for (std::size_t i = 0; i < service.fields.size(); ++i) {
    const Field& one = service.fields[i];
    if (!are_of(one.eventgroups, service)) {
      return bad(Argument::field_eventgroups, i);
    }
    if (one.initial_bytes.value_or(0) > one.room.size()) {
      return bad(Argument::field_initial_bytes, i);
    }
  }
  return no_fault;
}

bool is_someip_service(ServiceId id) noexcept {
  return someip::names_a_service(id) && id != sd::other_protocols;
}

}  // namespace

const char* to_string(Argument argument) noexcept {
  static constexpr std::array names{"none",
                                    "service",
                                    "need",
                                    "field",
                                    "event",
                                    "request",
                                    "return_code",
                                    "service_id",
                                    "instance",
                                    "major",
                                    "port",
                                    "ttl_s",
                                    "subscription",
                                    "discovery",
                                    "eventgroup",
                                    "method",
                                    "listed_event",
                                    "event_eventgroups",
                                    "field_getter",
                                    "field_setter",
                                    "field_notifier",
                                    "field_eventgroups",
                                    "field_initial_bytes"};
  return someip::enumerator_name<Argument::field_initial_bytes>(names, argument);
}

BadArgument mistake_in(const Service& service) noexcept {
  if (!is_someip_service(service.service)) {
    return bad(Argument::service_id);
  }
  if (!someip::names_an_instance(service.instance)) {
    return bad(Argument::instance);
  }
  if (service.major == sd::any_major) {
    return bad(Argument::major);
  }
  if (!can_be(service.ttl_s)) {
    return bad(Argument::ttl_s);
  }
  const BadArgument member = mistake_in_members(service);
  return member == no_fault ? mistake_in_ids(service) : member;
}

BadArgument mistake_in(const Need& need) noexcept {
  if (!is_someip_service(need.service)) {
    return bad(Argument::service_id);
  }
  if (need.instance == InstanceId{0} ||
      (need.instance == someip::any_instance && !need.subscriptions.empty())) {
    return bad(Argument::instance);
  }
  for (std::size_t i = 0; i < need.subscriptions.size(); ++i) {
    const Subscription& one = need.subscriptions[i];
    if (!can_be(one.ttl_s)) {
      return bad(Argument::ttl_s, i);
    }
    if (!someip::names_an_eventgroup(one.eventgroup) ||
        one.silence_timeout.value_or(Duration{1}) <= Duration::zero()) {
      return bad(Argument::subscription, i);
    }
  }
  return no_fault;
}

std::optional<MethodId> unusual_id(const Service& service, std::size_t number) noexcept {
  for (std::size_t i = 0; i < count_ids(service); ++i) {
    const Listed one = id_at(service, i);
    const bool unusual =
        one.id != MethodId{0} && (sd::is_reserved(one.id) || sd::is_for_other_kind(one.id, one.kind));
    if (unusual && number-- == 0) {
      return one.id;
    }
  }
  return std::nullopt;
}

}  // namespace trestle::device
