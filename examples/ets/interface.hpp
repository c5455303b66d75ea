// examples/ets: the Enhanced Testability Service, as far as it is the same on every device. Like the core of
// Trestle it allocates nothing, throws nothing, and knows no socket and no clock.
//
//   interface.hpp  the interface: its methods as bytes in and bytes out, its fields, its events
//   schedule.hpp   when events are sent that were triggered
#pragma once
#include <array>
#include <chrono>
#include <optional>

#include <trestle/someip/core/e2e/config.hpp>
#include <trestle/someip/wire/header.hpp>
#include <trestle/someip/wire/types.hpp>

namespace ets {

using namespace trestle::someip;
using trestle::ByteSpan;
using trestle::ByteView;

inline constexpr ServiceId service{0x0101};         // as the specification reserves it
inline constexpr ServiceId second_service{0x0102};  // shares the ports of the first
inline constexpr ServiceId old_and_new{0x0103};     // in two major versions
// What the device uses as a client: by itself, and when it is told to.
inline constexpr ServiceId used_by_itself{0x0111};
inline constexpr ServiceId used_when_told{0x0110};

inline constexpr MethodId reset_interface{0x01};
inline constexpr MethodId suspend_interface{0x02};
inline constexpr MethodId echo_uint8{0x08};
inline constexpr MethodId client_activate{0x2f};
inline constexpr MethodId client_deactivate{0x30};
inline constexpr MethodId client_subscribe{0x32};
inline constexpr MethodId last_value_tcp{0x3b};
inline constexpr MethodId last_value_udp{0x3c};
inline constexpr MethodId last_value_multicast{0x3d};

inline constexpr MethodId event_uint8{0x8001};
inline constexpr MethodId event_array{0x8002};
inline constexpr MethodId event_reliable{0x8003};
inline constexpr MethodId event_e2e_shaped{0x8004};
inline constexpr MethodId event_multicast{0x800b};
inline constexpr MethodId event_two_receivers{0x800c};
inline constexpr MethodId field_uint8{0x8006};
inline constexpr MethodId field_array{0x8007};

/// How long the service is away after suspendInterface.
inline constexpr std::chrono::milliseconds suspended_for{500};

/// Methods that answer with what they got, or with what becomes of it.
inline constexpr std::array<MethodId, 20> echoes{
    echo_uint8,     MethodId{0x09}, MethodId{0x0a}, MethodId{0x0b}, MethodId{0x0e},
    MethodId{0x12}, MethodId{0x13}, MethodId{0x14}, MethodId{0x15}, MethodId{0x16},
    MethodId{0x17}, MethodId{0x19}, MethodId{0x1f}, MethodId{0x23}, MethodId{0x35},
    MethodId{0x36}, MethodId{0x37}, MethodId{0x3e}, MethodId{0x3f}, MethodId{0x41}};

/// The same of uint32 with end-to-end protection, one for each profile.
inline constexpr std::array<MethodId, 14> protected_echoes{
    MethodId{0x50}, MethodId{0x51}, MethodId{0x52}, MethodId{0x53}, MethodId{0x54},
    MethodId{0x55}, MethodId{0x56}, MethodId{0x57}, MethodId{0x58}, MethodId{0x59},
    MethodId{0x5a}, MethodId{0x5b}, MethodId{0x5c}, MethodId{0x5d}};

[[nodiscard]] constexpr bool is_protected(MethodId method) noexcept {
  return method >= protected_echoes.front() && method <= protected_echoes.back();
}
/// Where one of `protected_echoes` stands among them.
[[nodiscard]] constexpr std::size_t place_of_protected(MethodId method) noexcept {
  return static_cast<std::size_t>(value(method)) - value(protected_echoes.front());
}
/// How one of `protected_echoes` is protected, requests and responses.
[[nodiscard]] const e2e::Config& protection_of(MethodId method) noexcept;

/// Memory for an answer.
struct Room {
  ByteSpan answer;  ///< as many bytes as the request has, and room_beside more, are enough
  /// For text in UTF-16, which is looked at in UTF-8: 3 bytes for each 2 of the request are enough.
  std::span<char> text;
};
inline constexpr std::size_t room_beside = 16;

/// Answers one of `echoes`, or one of `protected_echoes` whose E2E header has been taken out.
/// @return the answer's payload, at the front of `room.answer`; or the error to answer with:
///         malformed_message, unknown_method, or not_ok when `room` is too small.
[[nodiscard]] Result<ByteView, ReturnCode> echo(MethodId method, ByteView payload, const Room& room) noexcept;

/// A field, and its first value.
struct FieldOfInterface {
  MethodId getter{};
  std::optional<MethodId> setter{};
  std::optional<MethodId> notifier{};
  ByteView initial{};
};

/// A method without return that makes an event be sent, and what the event holds.
struct Trigger {
  MethodId method{};
  MethodId event{};
  ByteView payload{};
};

namespace values {
template <typename... Numbers>
constexpr std::array<std::byte, sizeof...(Numbers)> bytes_of(Numbers... numbers) {
  return {static_cast<std::byte>(numbers)...};
}
// With their types written out: GCC 12 puts constants of a deduced type into RAM.
inline constexpr std::array<std::byte, 1> zero = bytes_of(0);
inline constexpr std::array<std::byte, 1> one = bytes_of(1);
inline constexpr std::array<std::byte, 7> one_two_three = bytes_of(0, 0, 0, 3, 1, 2, 3);
inline constexpr std::array<std::byte, 1> number_42 = bytes_of(42);
inline constexpr std::array<std::byte, 1> number_43 = bytes_of(43);
inline constexpr std::array<std::byte, 1> number_44 = bytes_of(44);
inline constexpr std::array<std::byte, 1> number_45 = bytes_of(45);
inline constexpr std::array<std::byte, 6> four_and_two = bytes_of(0, 0, 0, 2, 4, 2);
inline constexpr std::array<std::byte, 17> in_shape_of_e2e =
    bytes_of(0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 5);
}  // namespace values

inline constexpr std::array<FieldOfInterface, 4> fields{{
    {MethodId{0x26}, MethodId{0x27}, field_uint8, values::zero},
    {MethodId{0x28}, MethodId{0x29}, field_array, values::one_two_three},
    {MethodId{0x2a}, MethodId{0x2b}, std::nullopt, values::zero},
    {MethodId{0x25}, std::nullopt, std::nullopt, values::one},  // the interface version
}};

inline constexpr std::array<Trigger, 6> triggers{{
    {MethodId{0x03}, event_uint8, values::number_42},
    {MethodId{0x04}, event_array, values::four_and_two},
    {MethodId{0x05}, event_reliable, values::number_43},
    {MethodId{0x06}, event_e2e_shaped, values::in_shape_of_e2e},
    {MethodId{0x3a}, event_multicast, values::number_44},
    {MethodId{0x70}, event_two_receivers, values::number_45},
}};

}  // namespace ets
