#pragma once
#include "sd/core/device/description.hpp"
#include "someip/core/call_table.hpp"
#include "someip/core/tp_reassembler.hpp"

namespace trestle::device {

// The slots of a device's tables; only their sizes matter to others.

/// One service of Settings, while it is offered.
struct ServiceSlot {
  sd::OfferHandle offer{};
  std::optional<std::uint16_t> unusual_told{};  // how many of its unusual ids; nothing: all
};

/// An event or a field.
struct EventSlot {
  someip::SessionCounter sessions{};
  std::uint32_t value_bytes = 0;  // of a field
  bool has_value = false;
};

/// One need of Settings, while it is looked for.
struct NeedSlot {
  sd::RequirementHandle requirement{};
  sd::RemoteHandle server{};  // that calls go to
};

/// One eventgroup of a need.
struct SubscriptionSlot {
  sd::SubscriptionHandle handle{};
};

/// A message that waits to be sent.
struct SendSlot {
  /// `finished`: sent, and the application is still to be told.
  enum class State : std::uint8_t { unused, waiting, finished };
  /// Where the payload is: in the device's memory, in the room of a field, in the application's memory.
  enum class Payload : std::uint8_t { copied, of_field, of_application };
  static constexpr std::uint16_t one_receiver = 0xffff;

  State state = State::unused;
  Payload kind = Payload::copied;
  std::uint16_t service = one_receiver;  // whose subscribers it goes to
  std::uint16_t from_port = 0;
  std::uint16_t next_receiver = 0;
  Endpoint to;
  someip::Header header;
  std::uint32_t number = 0;  // the lower, the earlier
  const std::byte* payload = nullptr;
  std::size_t bytes = 0;
  std::size_t offset = 0;  // of the next segment
};

/// Views of the memory of a Device: the sizes are its limits.
struct MemoryView {
  sd::StorageView discovery{};
  std::span<ServiceSlot> services{};
  std::span<EventSlot> events{};
  std::span<NeedSlot> needs{};
  std::span<SubscriptionSlot> subscriptions{};
  std::span<someip::CallSlot> calls{};
  std::span<std::uint16_t> timed_out{};  // generations of calls whose end is to be told
  std::span<SendSlot> sends{};
  std::span<std::uint8_t> receivers{};  // of each send, a bit for each subscriber
  ByteSpan send_bytes{};
  std::span<someip::TpSlot> tp_slots{};
  std::span<std::uint32_t> tp_maps{};
  std::span<std::uint32_t> tp_senders{};  // of each slot, whose last message it had
  ByteSpan tp_bytes{};
};

inline constexpr std::uint16_t silent_hosts = guards ? 2 : 0;

[[nodiscard]] constexpr sd::Limits discovery_limits(const Limits& limits) noexcept {
  return {.max_offers = limits.services,
          .max_eventgroups = limits.eventgroups,
          .max_subscribers = limits.subscribers,
          .max_requirements = limits.needs,
          .max_subscriptions = limits.subscriptions,
          .max_remote_services = limits.remote_services,
          .max_peers = limits.peers,
          .max_tcp_connections = 0,
          .max_pending_entries = limits.pending_entries,
          .max_configurations = 0,
          .max_configuration_bytes = 0,
          .max_pending_events = limits.pending_events,
          .max_silent_hosts = silent_hosts};
}

/// Bytes of the bit map of one send.
[[nodiscard]] constexpr std::size_t receiver_bytes(const Limits& limits) noexcept {
  return (limits.subscribers + std::size_t{7}) / 8;
}

/// Calls `visit(count, view)` with the size of each table and the view of it in `memory`, in their order.
template <typename Visit>
constexpr void for_each_table(const Limits& limits, MemoryView& memory, Visit visit) noexcept {
  visit(limits.services, memory.discovery.offers);
  visit(limits.eventgroups, memory.discovery.eventgroups);
  visit(limits.subscribers, memory.discovery.subscribers);
  visit(limits.needs, memory.discovery.requirements);
  visit(limits.subscriptions, memory.discovery.subscriptions);
  visit(limits.remote_services, memory.discovery.remotes);
  visit(limits.peers + std::size_t{1}, memory.discovery.peers);  // as Storage has it
  visit(limits.pending_entries, memory.discovery.pending_entries);
  visit(limits.pending_events, memory.discovery.pending_events);
  visit(silent_hosts, memory.discovery.silences);
  visit(silent_hosts, memory.discovery.rivals);
  visit(limits.services, memory.services);
  visit(limits.events, memory.events);
  visit(limits.needs, memory.needs);
  visit(limits.subscriptions, memory.subscriptions);
  visit(limits.calls, memory.calls);
  visit(limits.calls, memory.timed_out);
  visit(limits.sends, memory.sends);
  visit(limits.sends * receiver_bytes(limits), memory.receivers);
  visit(limits.send_bytes, memory.send_bytes);
  visit(limits.tp_buffers, memory.tp_slots);
  visit(limits.tp_buffers * someip::tp_map_words(limits.tp_buffer_bytes), memory.tp_maps);
  visit(limits.tp_buffers, memory.tp_senders);
  visit(std::size_t{limits.tp_buffers} * limits.tp_buffer_bytes, memory.tp_bytes);
}

inline constexpr std::size_t memory_alignment = alignof(std::uint64_t);

/// Where the next table begins.
[[nodiscard]] constexpr std::size_t aligned(std::size_t at, std::size_t alignment) noexcept {
  return (at + alignment - 1) / alignment * alignment;
}

/// How many bytes of memory a device with these limits needs beside itself.
[[nodiscard]] constexpr std::size_t memory_bytes(const Limits& limits) noexcept {
  std::size_t end = 0;
  MemoryView none;
  for_each_table(limits, none, [&end]<typename Slot>(std::size_t count, const std::span<Slot>& /*view*/) {
    static_assert(alignof(Slot) <= memory_alignment);
    end = aligned(end, alignof(Slot)) + count * sizeof(Slot);
  });
  return end;
}

/// Whether the limits keep their own rules.
[[nodiscard]] constexpr bool are_possible(const Limits& limits) noexcept {
  return limits.sends >= 2 && limits.pending_entries >= limits.services + limits.subscriptions &&
         limits.remote_services >= limits.needs && limits.calls <= 0x8000 &&
         (limits.calls == 0 || limits.needs > 0);
}

/// Divides `memory` into the tables of a device.
/// @param memory  aligned to memory_alignment, memory_bytes() of it; outlives the device and serves no other.
/// @return nothing if it is too small or not aligned, or are_possible() is false.
[[nodiscard]] std::optional<MemoryView> lay_out(const Limits& limits, ByteSpan memory) noexcept;

}  // namespace trestle::device
