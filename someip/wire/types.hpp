#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tl/expected.hpp>

// Where size counts, GCC has to be told what is to be in a program once, and what is smaller when inlined.
#if defined __OPTIMIZE_SIZE__ && !defined __clang__
#define TRESTLE_ONCE [[gnu::noinline, gnu::noclone]]
#define TRESTLE_INLINE [[gnu::always_inline]]
#else
#define TRESTLE_ONCE
#define TRESTLE_INLINE
#endif

namespace trestle {

// Where size counts, there is little of everything: what pays only with hundreds of services is left out.
#ifdef __OPTIMIZE_SIZE__
constexpr bool optimised_for_many = false;
#else
constexpr bool optimised_for_many = true;
#endif

using ByteView = std::span<const std::byte>;
using ByteSpan = std::span<std::byte>;

/// A moment of the monotonic clock. The core only compares and adds; it never asks a clock.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;
using Duration = std::chrono::nanoseconds;

/// Whether the moment `due` has come. By the numbers, as GCC makes far more code of std::chrono's <=>.
[[nodiscard]] constexpr bool is_due(TimePoint due, TimePoint now) noexcept {
  return due.time_since_epoch().count() <= now.time_since_epoch().count();
}
[[nodiscard]] constexpr TimePoint earlier(TimePoint a, TimePoint b) noexcept {
  return is_due(a, b) ? a : b;
}

namespace someip {

/// Names a service on the wire.  [feat_req_someip_538] [feat_req_someip_539]
enum class ServiceId : std::uint16_t {};
/// Tells instances of one service apart.  [feat_req_someip_542] [feat_req_someip_543]
enum class InstanceId : std::uint16_t {};
/// A method (below 0x8000) or an event (0x8000 and above).  [feat_req_someip_625] [feat_req_someip_626]
enum class MethodId : std::uint16_t {};
/// A set of events that is subscribed to as one.  [feat_req_someip_545] [feat_req_someip_546]
enum class EventgroupId : std::uint16_t {};
/// Names a caller on the wire; to the server it is only a number.  [feat_req_someip_699]
enum class ClientId : std::uint16_t {};
/// Tells messages of one sender apart; 0: it does not count.  [feat_req_someip_88] [feat_req_someip_700]
enum class SessionId : std::uint16_t {};

/// In a Find or a subscription to offers: every instance.  [feat_req_someip_579]
inline constexpr InstanceId any_instance{0xffff};

/// Whether an id can name one service, instance or eventgroup: 0x0000 is reserved, 0xffff means all or none.
/// [feat_req_someip_627] [feat_req_someip_579] [feat_req_someipids_555]
[[nodiscard]] constexpr bool names_a_service(ServiceId id) noexcept {
  return id != ServiceId{0} && id != ServiceId{0xffff};
}
[[nodiscard]] constexpr bool names_an_instance(InstanceId id) noexcept {
  return id != InstanceId{0} && id != any_instance;
}
[[nodiscard]] constexpr bool names_an_eventgroup(EventgroupId id) noexcept {
  return id != EventgroupId{0} && id != EventgroupId{0xffff};
}

/// The value of an id, of any of the types above.
template <typename Id>
requires std::is_enum_v<Id>
[[nodiscard]] constexpr std::uint16_t value(Id id) noexcept {
  return static_cast<std::uint16_t>(id);
}

/// Why bytes could not be read or written. Each decoder says which of these it returns and when.
enum class WireError : std::uint8_t {
  truncated,             ///< the input ends before the item does
  bad_length,            ///< a length field contradicts its contents or its limits
  no_room,               ///< the output buffer is too small
  bad_tp_offset,         ///< TP: payload that is no multiple of 16 bytes in a segment that is not the last
  bad_tp_flags,          ///< TP: a message without the TP flag where one is needed
  bad_string_encoding,   ///< a string without the BOM or terminator that its rules demand, or not valid UTF
  bad_union_type,        ///< a type selector that names no member
  bad_tag,               ///< a wire type that is not the member's, or a tag where there can be none
  not_sd,                ///< not a SOME/IP-SD message: wrong Message ID, type or version
  bad_entries_length,    ///< SD: entries array length no multiple of 16 or beyond the message
  bad_options_length,    ///< SD: options array length beyond the message
  bad_option_length,     ///< SD: an option whose length does not fit its type or the array
  bad_entry_type,        ///< SD: an entry type that is not known
  bad_option_reference,  ///< SD: an option run beyond the options array
  bad_value,             ///< a field holds a value that its type does not have
};

/// The error's name as it stands above, for logs and reports.
[[nodiscard]] const char* to_string(WireError error) noexcept;

/// A value, or why there is none.
template <typename T, typename E = WireError>
using Result = tl::expected<T, E>;

}  // namespace someip
}  // namespace trestle
