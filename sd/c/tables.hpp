#pragma once
#include "sd/core/device/device.hpp"
#include "trestle.h"

namespace trestle::c {

using EventgroupIds = std::array<device::EventgroupId, TRESTLE_EVENTGROUPS_PER_EVENT>;

/// The tables that the device reads, copied from those of C.
struct Tables {
  std::span<device::Service> services{};
  std::span<device::Method> methods{};
  std::span<device::Event> events{};
  std::span<device::Field> fields{};
  std::span<EventgroupIds> event_groups{};  // of events, then of fields
  std::span<sd::Eventgroup> eventgroups{};
  std::span<device::Need> needs{};
  std::span<device::Subscription> subscriptions{};
};

/// How large they are, by the limits. Events and fields share a limit.
struct Sizes {
  std::size_t services = 0;
  std::size_t methods = 0;
  std::size_t events = 0;
  std::size_t fields = 0;
  std::size_t eventgroups = 0;
  std::size_t needs = 0;
  std::size_t subscriptions = 0;
};

/// How many entries those of C have together.
[[nodiscard]] Sizes sizes_of(const trestle_settings& settings) noexcept;

[[nodiscard]] bool are_within(const Sizes& sizes, const trestle_limits& limits) noexcept;

[[nodiscard]] std::size_t tables_bytes(const Sizes& sizes) noexcept;
/// The most that tables within the limits can take: of events and fields, whichever is larger.
[[nodiscard]] std::size_t most_tables_bytes(const trestle_limits& limits) noexcept;

/// Copies the tables into `memory`, of tables_bytes() and aligned to device::memory_alignment.
[[nodiscard]] Tables copy_tables(const trestle_settings& from, const Sizes& sizes, ByteSpan memory) noexcept;

template <typename Id>
[[nodiscard]] constexpr Id id(std::uint16_t number) noexcept {
  return static_cast<Id>(number);
}

}  // namespace trestle::c
