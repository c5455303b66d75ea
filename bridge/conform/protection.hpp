#pragma once
#include <cstdint>
#include <string_view>

#include "bridge/conform/stimulus.hpp"

/// End-to-end protection as AUTOSAR's "E2E Protocol Specification" (PRS) describes it, bit by bit, so that a
/// mistake of someip/core/e2e cannot hide. Slow, and all the more plain.
namespace trestle::conform {

enum class E2eProfile : std::uint8_t { p1, p2, p4, p4m, p5, p6, p7, p7m, p8, p8m, p11, p22, p44, p44m };

/// How a method is protected, requests and responses alike, or an event. The header stands in front of the
/// payload.
struct E2eProtection {
  someip::MethodId id{};
  E2eProfile profile{};
  std::uint32_t data_id = 0;  ///< not of profiles 2 and 22
  Bytes data_ids{};           ///< 16, of profiles 2 and 22: one for each counter
  bool nibble = false;        ///< of profiles 1 and 11: variants 1C and 11C, else 1A and 11A
  std::uint32_t source = 0;   ///< of profiles 4m, 7m, 8m and 44m
};

/// Whether an event is protected, and no method.
[[nodiscard]] constexpr bool is_of_event(const E2eProtection& how) noexcept {
  return (value(how.id) & 0x8000U) != 0;
}

/// "1", "4m" and so on, as profiles name them.
[[nodiscard]] std::string_view to_string(E2eProfile profile) noexcept;

/// 4m, 7m, 8m and 44m: their header says whether a message is a request or a response.
[[nodiscard]] bool is_for_methods_alone(E2eProfile profile) noexcept;

/// Of the header, in bytes.
[[nodiscard]] std::size_t e2e_header_bytes(E2eProfile profile) noexcept;
/// The counter goes from 0 up to one less than this, and then to 0 again.
[[nodiscard]] std::uint64_t e2e_counter_end(E2eProfile profile) noexcept;
/// The counter of a protected payload, which is long enough for the header.
[[nodiscard]] std::uint32_t e2e_counter_of(E2eProfile profile, ByteView payload) noexcept;

/// @param before    what the CRC covers in front of the header: of SOME/IP, the 8 bytes from the Request ID
/// on.
/// @param response  of profiles with a message type.
/// @return the header, and the payload behind it.
[[nodiscard]] Bytes protect(const E2eProtection& how, ByteView before, ByteView payload,
                            std::uint32_t counter, bool response);

/// What a message has in front of its payload that the CRC covers.
[[nodiscard]] Bytes protected_header(const someip::Header& header);

}  // namespace trestle::conform
