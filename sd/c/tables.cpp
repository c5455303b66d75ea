#include "sd/c/tables.hpp"

#include <memory>

namespace trestle::c {
namespace {

template <typename Visit>
void for_each_table(const Sizes& sizes, Tables& tables, Visit visit) noexcept {
  visit(sizes.services, tables.services);
  visit(sizes.methods, tables.methods);
  visit(sizes.events, tables.events);
  visit(sizes.fields, tables.fields);
  visit(sizes.events + sizes.fields, tables.event_groups);
  visit(sizes.eventgroups, tables.eventgroups);
  visit(sizes.needs, tables.needs);
  visit(sizes.subscriptions, tables.subscriptions);
}

// The bounds of trestle.h, which a C compiler cannot know.
static_assert(TRESTLE_SERVICE_BYTES_ >=
              sizeof(sd::slots::Offer) + sizeof(device::ServiceSlot) + sizeof(device::Service));
static_assert(TRESTLE_EVENTGROUP_BYTES_ >= sizeof(sd::slots::OfferedEventgroup) + sizeof(sd::Eventgroup));
static_assert(TRESTLE_EVENT_BYTES_ >=
              sizeof(device::EventSlot) + sizeof(device::Field) + sizeof(EventgroupIds));
static_assert(TRESTLE_SUBSCRIBER_BYTES_ >= sizeof(sd::slots::Subscriber));
static_assert(TRESTLE_PEER_BYTES_ >= sizeof(sd::slots::Peer));
static_assert(TRESTLE_NEED_BYTES_ >=
              sizeof(sd::slots::Requirement) + sizeof(device::NeedSlot) + sizeof(device::Need));
static_assert(TRESTLE_SUBSCRIPTION_BYTES_ >= sizeof(sd::slots::Subscription) +
                                                 sizeof(device::SubscriptionSlot) +
                                                 sizeof(device::Subscription));
static_assert(TRESTLE_REMOTE_BYTES_ >= sizeof(sd::slots::Remote));
static_assert(TRESTLE_CALL_BYTES_ >= sizeof(someip::CallSlot) + sizeof(std::uint16_t));
static_assert(TRESTLE_ENTRY_BYTES_ >= sizeof(sd::slots::PendingEntry));
static_assert(TRESTLE_NOTE_BYTES_ >= sizeof(sd::Happening));
static_assert(TRESTLE_SEND_BYTES_ >= sizeof(device::SendSlot));
static_assert(TRESTLE_TP_BYTES_ >= sizeof(someip::TpSlot) + sizeof(std::uint32_t));
static_assert(TRESTLE_METHOD_BYTES_ >= sizeof(device::Method));

Tables lay_out(const Sizes& sizes, ByteSpan memory) noexcept {
  Tables tables;
  std::size_t end = 0;
  for_each_table(sizes, tables, [&]<typename T>(std::size_t count, std::span<T>& table) {
    end = device::aligned(end, alignof(T));
    void* const at = memory.data() + end;
    std::uninitialized_value_construct_n(static_cast<T*>(at), count);
    table = {static_cast<T*>(at), count};
    end += count * sizeof(T);
  });
  return tables;
}

/// Takes the next `count` entries of a table.
template <typename T>
std::span<T> take(std::span<T>& table, std::size_t count) noexcept {
  const std::span<T> taken = table.first(count);
  table = table.subspan(count);
  return taken;
}

std::span<const device::EventgroupId> copy_ids(
    std::span<const std::uint16_t, TRESTLE_EVENTGROUPS_PER_EVENT> from,
    std::span<EventgroupIds>& room) noexcept {
  EventgroupIds& ids = take(room, 1).front();
  std::size_t count = 0;
  while (count < ids.size() && from[count] != 0) {
    ids[count] = id<device::EventgroupId>(from[count]);
    ++count;
  }
  return std::span{ids}.first(count);
}

device::Service copy(const trestle_service& from, Tables& room) noexcept {
  const auto methods = take(room.methods, from.method_count);
  for (std::size_t i = 0; i < methods.size(); ++i) {
    methods[i] = {.id = id<device::MethodId>(from.methods[i].id),
                  .kind = static_cast<someip::MethodKind>(from.methods[i].kind)};
  }
  const auto events = take(room.events, from.event_count);
  for (std::size_t i = 0; i < events.size(); ++i) {
    events[i] = {.id = id<device::MethodId>(from.events[i].id),
                 .eventgroups = copy_ids(from.events[i].eventgroups, room.event_groups)};
  }
  const auto fields = take(room.fields, from.field_count);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const trestle_field& field = from.fields[i];
    fields[i] = {.getter = id<device::MethodId>(field.getter),
                 .setter = id<device::MethodId>(field.setter),
                 .notifier = id<device::MethodId>(field.notifier),
                 .eventgroups = copy_ids(field.eventgroups, room.event_groups),
                 .room = std::as_writable_bytes(std::span{field.room, field.room_bytes}),
                 .initial_bytes = field.has_value ? std::optional{field.initial_bytes} : std::nullopt,
                 .judged = field.judged};
  }
  const auto eventgroups = take(room.eventgroups, from.eventgroup_count);
  for (std::size_t i = 0; i < eventgroups.size(); ++i) {
    eventgroups[i] = {.id = id<device::EventgroupId>(from.eventgroups[i])};
  }
  return {.service = id<device::ServiceId>(from.service),
          .instance = id<device::InstanceId>(from.instance),
          .major = from.major,
          .minor = from.minor,
          .port = from.port,
          .methods = methods,
          .events = events,
          .fields = fields,
          .eventgroups = eventgroups};
}

device::Need copy(const trestle_need& from, Tables& room) noexcept {
  const auto subscriptions = take(room.subscriptions, from.eventgroup_count);
  for (std::size_t i = 0; i < subscriptions.size(); ++i) {
    subscriptions[i].eventgroup = id<device::EventgroupId>(from.eventgroups[i]);
  }
  return {.service = id<device::ServiceId>(from.service),
          .instance = id<device::InstanceId>(from.instance),
          .major = from.major,
          .port = from.port,
          .receive_buffer_bytes = from.receive_buffer_bytes,
          .subscriptions = subscriptions};
}

}  // namespace

Sizes sizes_of(const trestle_settings& settings) noexcept {
  Sizes sizes{.services = settings.service_count, .needs = settings.need_count};
  for (const trestle_service& one : std::span{settings.services, settings.service_count}) {
    sizes.methods += one.method_count;
    sizes.events += one.event_count;
    sizes.fields += one.field_count;
    sizes.eventgroups += one.eventgroup_count;
  }
  for (const trestle_need& one : std::span{settings.needs, settings.need_count}) {
    sizes.subscriptions += one.eventgroup_count;
  }
  return sizes;
}

bool are_within(const Sizes& sizes, const trestle_limits& limits) noexcept {
  return sizes.services <= limits.services && sizes.methods <= limits.methods &&
         sizes.events + sizes.fields <= limits.events && sizes.eventgroups <= limits.eventgroups &&
         sizes.needs <= limits.needs && sizes.subscriptions <= limits.subscriptions;
}

std::size_t tables_bytes(const Sizes& sizes) noexcept {
  std::size_t end = 0;
  Tables none;
  for_each_table(sizes, none, [&end]<typename T>(std::size_t count, const std::span<T>& /*table*/) {
    end = device::aligned(end, alignof(T)) + count * sizeof(T);
  });
  return end;
}

std::size_t most_tables_bytes(const trestle_limits& limits) noexcept {
  const Sizes sizes{.services = limits.services,
                    .methods = limits.methods,
                    .fields = limits.events,
                    .eventgroups = limits.eventgroups,
                    .needs = limits.needs,
                    .subscriptions = limits.subscriptions};
  static_assert(sizeof(device::Field) >= sizeof(device::Event));
  return tables_bytes(sizes) + device::memory_alignment;  // empty tables may begin at different places
}

Tables copy_tables(const trestle_settings& from, const Sizes& sizes, ByteSpan memory) noexcept {
  const Tables all = lay_out(sizes, memory);
  Tables rest = all;
  for (std::size_t i = 0; i < all.services.size(); ++i) {
    all.services[i] = copy(from.services[i], rest);
  }
  for (std::size_t i = 0; i < all.needs.size(); ++i) {
    all.needs[i] = copy(from.needs[i], rest);
  }
  return all;
}

}  // namespace trestle::c
