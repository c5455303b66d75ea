#pragma once
#include "someip/wire/bytes.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

using someip::EventgroupId;
using someip::InstanceId;
using someip::ServiceId;
using someip::SessionId;
using someip::WireError;

/// The type byte of an entry; others may come and are kept.  [feat_req_someipsd_47] [feat_req_someipsd_109]
enum class EntryType : std::uint8_t {
  find_service = 0x00,
  offer_service = 0x01,
  subscribe_eventgroup = 0x06,
  subscribe_eventgroup_ack = 0x07,
};

/// What an entry says: its type, and whether its TTL of 0 turns it into the opposite. [feat_req_someipsd_808]
enum class EntryKind : std::uint8_t {
  find_service,
  offer_service,
  stop_offer_service,
  subscribe_eventgroup,
  stop_subscribe_eventgroup,
  subscribe_eventgroup_ack,
  subscribe_eventgroup_nack,
  unknown,
};

/// The kind's name as it stands above, for logs and reports.
[[nodiscard]] const char* to_string(EntryKind kind) noexcept;

inline constexpr std::size_t entry_bytes = 16;
inline constexpr std::uint8_t any_major = 0xff;          ///< in a FindService  [feat_req_someipsd_239]
inline constexpr std::uint32_t any_minor = 0xffff'ffff;  ///< in a FindService  [feat_req_someipsd_239]
/// TTL that means "until the next reboot"; also the largest a TTL field can hold. In seconds.
inline constexpr std::uint32_t infinite_ttl_s = 0xff'ffff;

/// Options `index`, `index + 1`, ... of the message's options array, `count` of them. [feat_req_someipsd_336]
struct OptionRun {
  std::uint8_t index = 0;
  std::uint8_t count = 0;  ///< 0 to 15; an empty run's index means nothing  [feat_req_someipsd_343]
  friend constexpr bool operator==(const OptionRun&, const OptionRun&) = default;
};

/// One entry of 16 bytes. Service and eventgroup entries differ in the last four, which is why those are kept
/// as one number, read and written by the functions below.  [feat_req_someipsd_46]
struct Entry {
  EntryType type = EntryType::find_service;
  OptionRun first_run{};
  OptionRun second_run{};
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t ttl_s = 0;  ///< lifetime in seconds, 24 bits
  std::uint32_t tail = 0;   ///< the last four bytes

  [[nodiscard]] EntryKind kind() const noexcept;

  /// Of a service entry.  [feat_req_someipsd_47]
  [[nodiscard]] constexpr std::uint32_t minor() const noexcept { return tail; }

  /// Of an eventgroup entry, as are all that follow.  [feat_req_someipsd_109]
  [[nodiscard]] constexpr EventgroupId eventgroup() const noexcept {
    return EventgroupId{static_cast<std::uint16_t>(tail)};
  }
  /// Tells parallel subscriptions to one eventgroup apart; 0 to 15.
  [[nodiscard]] constexpr std::uint8_t counter() const noexcept {
    return static_cast<std::uint8_t>((tail >> 16U) & 0x0fU);
  }
  [[nodiscard]] constexpr bool initial_data_requested() const noexcept {
    return (tail & initial_data_bit) != 0;
  }

  static constexpr std::uint32_t initial_data_bit = 0x0080'0000;
  /// `tail` of an eventgroup entry whose reserved bits are 0.
  [[nodiscard]] static constexpr std::uint32_t eventgroup_tail(EventgroupId eventgroup, std::uint8_t counter,
                                                               bool initial_data) noexcept {
    return (initial_data ? initial_data_bit : 0U) | ((counter & 0x0fU) << 16U) | someip::value(eventgroup);
  }

  /// How many options both runs reference together.
  [[nodiscard]] constexpr std::size_t option_count() const noexcept {
    return std::size_t{first_run.count} + second_run.count;
  }

  friend constexpr bool operator==(const Entry&, const Entry&) = default;
};

/// Reads the 16 bytes of an entry; whatever they hold is an entry.
[[nodiscard]] Entry decode_entry(std::span<const std::byte, entry_bytes> bytes) noexcept;

/// Writes the 16 bytes of an entry; `ttl_s` and the run counts are cut to their 24 and 4 bits.
void encode(const Entry& entry, std::span<std::byte, entry_bytes> room) noexcept;

}  // namespace trestle::sd
