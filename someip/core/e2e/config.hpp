// someip/core/e2e: end-to-end protection (AUTOSAR E2E), without sockets, clock or heap.
//
//   config.hpp         the profiles and their parameters
//   layout.hpp         a profile as data: where its fields are, which CRC it has
//   protector.hpp      writes counter, length, Data ID and CRC into a message
//   checker.hpp        checks them
//   state_machine.hpp  what the last checks together say of the communication
//   crc.hpp            the CRCs
//
// docs/e2e.md explains the profiles; docs/internals/adding.md how to add one.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <string_view>
#include <variant>

/// The E2E profiles of AUTOSAR's "E2E Protocol Specification" (PRS) as plain values. Names, units (bits) and
/// meanings are AUTOSAR's, so that a system description can be copied field by field.
///
/// Positions count from the first byte of the *Data*: in SOME/IP that is the Request ID, so the default of 64
/// bits puts the E2E header between Return Code and payload.  [feat_req_someip_102] [feat_req_someip_103]
namespace trestle::someip::e2e {

/// After the Request ID, versions, Message Type and Return Code: where the payload begins.
inline constexpr std::uint32_t someip_offset_bits = 64;

/// How the 16 bits of a Data ID enter the CRC of profiles 1 and 11.
enum class DataIdMode : std::uint8_t {
  both,         ///< both bytes, low one first: variants 1A and 11A
  alternating,  ///< the low byte with even counters, the high byte with odd ones: variant 1B; not in profile
                ///< 11
  low,          ///< the low byte alone; not in profile 11
  nibble,       ///< low byte in the CRC, low nibble of the high byte in the message: variants 1C and 11C
};

/// How profiles 1 and 2 report a first message and one after a disturbance to the state machine.
enum class Behavior : std::uint8_t {
  r4_2,      ///< first message: wrong_sequence; while synchronising: as if synchronised
  pre_r4_2,  ///< first message: ok; while synchronising: wrong_sequence
};

/// When profiles 1 and 2 accept a counter. The other profiles have the single `max_delta_counter`.
struct EarlySequence {
  /// How many messages may be missing between two valid ones, 0 to 14: with 1, counter 1 may be followed by 2
  /// or 3. Each further check without a valid message allows one more. (AUTOSAR's name misleads.)
  std::uint8_t max_delta_counter_init = 1;
  /// More messages missing or repeated than this in a row and the next good one starts a synchronisation, 0
  /// to 14 (profile 2: 15). The largest value switches this off.
  std::uint8_t max_no_new_or_repeated_data = 14;
  /// How many good messages a synchronisation takes; 0: none is needed, and no jump of the counter forgiven.
  std::uint8_t sync_counter_init = 0;
  Behavior behavior = Behavior::r4_2;
  friend constexpr bool operator==(const EarlySequence&, const EarlySequence&) = default;
};

/// Profile 1: 8-bit CRC, 4-bit counter (0 to 14), up to 30 bytes.
struct Profile1 {
  std::uint16_t data_id = 0;  ///< with DataIdMode::nibble only the low 12 bits are used
  DataIdMode data_id_mode = DataIdMode::both;
  std::uint32_t data_bits = 0;                         ///< length of the Data: a multiple of 8, at most 240
  std::uint32_t crc_offset_bits = someip_offset_bits;  ///< a multiple of 8
  std::uint32_t counter_offset_bits = someip_offset_bits + 8;          ///< a multiple of 4
  std::uint32_t data_id_nibble_offset_bits = someip_offset_bits + 12;  ///< a multiple of 4
  EarlySequence sequence{};
  friend constexpr bool operator==(const Profile1&, const Profile1&) = default;
};

/// Profile 2: 8-bit CRC, 4-bit counter (0 to 15), one Data ID for each counter value.
struct Profile2 {
  std::array<std::uint8_t, 16> data_id_list{};
  std::uint32_t data_bits = 0;                     ///< length of the Data: a multiple of 8
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the 2-byte header: a multiple of 8
  EarlySequence sequence{};
  friend constexpr bool operator==(const Profile2&, const Profile2&) = default;
};

/// Profiles 4 and 44: 12-byte header with 16-bit length and counter, 32-bit Data ID and CRC.
struct Profile4 {
  std::uint32_t data_id = 0;
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the header: a multiple of 8
  std::uint32_t min_data_bits = 0;         ///< of the whole Data; 0: just what is needed for the header
  std::uint32_t max_data_bits = 4096 * 8;  ///< AUTOSAR's limit; the length field allows 65535 * 8
  std::uint32_t max_delta_counter = 1;     ///< largest step between two counters, 1 to 65534
  friend constexpr bool operator==(const Profile4&, const Profile4&) = default;
};
/// The same bytes as profile 4.
struct Profile44 : Profile4 {};

/// Profiles 4m and 44m, for methods: 16-byte header, profile 4's and then message type, result and source id.
struct Profile4m : Profile4 {};
struct Profile44m : Profile4 {};

/// Profile 5: 3-byte header with 16-bit CRC and 8-bit counter; fixed length.
struct Profile5 {
  std::uint16_t data_id = 0;                       ///< not sent, but in the CRC
  std::uint32_t data_bits = 0;                     ///< length of the Data: a multiple of 8, at most 4096 * 8
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the header: a multiple of 8
  std::uint32_t max_delta_counter = 1;             ///< 1 to 254
  /// AUTOSAR sends the CRC's low byte first; vsomeip up to 3.7.4 its high byte.
  std::endian crc_order = std::endian::little;
  friend constexpr bool operator==(const Profile5&, const Profile5&) = default;
};

/// Profile 6: 5-byte header with 16-bit CRC, 16-bit length and 8-bit counter.
struct Profile6 {
  std::uint16_t data_id = 0;                       ///< not sent, but in the CRC
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the header: a multiple of 8
  std::uint32_t min_data_bits = 0;         ///< of the whole Data; 0: just what is needed for the header
  std::uint32_t max_data_bits = 4096 * 8;  ///< AUTOSAR's limit; the length field allows 65535 * 8
  std::uint32_t max_delta_counter = 1;     ///< 1 to 254
  friend constexpr bool operator==(const Profile6&, const Profile6&) = default;
};

/// Profile 7: 20-byte header with 64-bit CRC, 32-bit length, counter and Data ID.
struct Profile7 {
  std::uint32_t data_id = 0;
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the header: a multiple of 8
  std::uint32_t min_data_bits = 0;           ///< of the whole Data; 0: just what is needed for the header
  std::uint32_t max_data_bits = 0xfffffff8;  ///< 512 MiB
  std::uint32_t max_delta_counter = 1;       ///< 1 to 0xfffffffe
  friend constexpr bool operator==(const Profile7&, const Profile7&) = default;
};
/// Profile 7m, for methods: 24-byte header, profile 7's and then message type, result and source id.
struct Profile7m : Profile7 {};
/// Profile 8: as 7 with a 32-bit CRC, so a 16-byte header.
struct Profile8 : Profile7 {};
/// Profile 8m, for methods: 20-byte header, profile 8's and then message type, result and source id.
struct Profile8m : Profile7 {};

/// Profile 11: profile 1's bytes (variants 11A and 11C) with the sequence rules of the newer profiles.
struct Profile11 {
  std::uint16_t data_id = 0;                   ///< with DataIdMode::nibble only the low 12 bits are used
  DataIdMode data_id_mode = DataIdMode::both;  ///< both or nibble
  std::uint32_t data_bits = 0;                 ///< length of the Data: a multiple of 8, at most 240
  std::uint32_t crc_offset_bits = someip_offset_bits;                  ///< a multiple of 8
  std::uint32_t counter_offset_bits = someip_offset_bits + 8;          ///< a multiple of 4
  std::uint32_t data_id_nibble_offset_bits = someip_offset_bits + 12;  ///< a multiple of 4
  std::uint32_t max_delta_counter = 1;                                 ///< 1 to 13
  friend constexpr bool operator==(const Profile11&, const Profile11&) = default;
};

/// Profile 22: profile 2's bytes with the sequence rules of the newer profiles.
struct Profile22 {
  std::array<std::uint8_t, 16> data_id_list{};
  std::uint32_t data_bits = 0;                     ///< length of the Data: a multiple of 8
  std::uint32_t offset_bits = someip_offset_bits;  ///< of the 2-byte header: a multiple of 8
  std::uint32_t max_delta_counter = 1;             ///< 1 to 14
  friend constexpr bool operator==(const Profile22&, const Profile22&) = default;
};

using Config = std::variant<Profile1, Profile2, Profile4, Profile4m, Profile5, Profile6, Profile7, Profile7m,
                            Profile8, Profile11, Profile22, Profile44, Profile44m, Profile8m>;

/// A setting that cannot be: `field` is its name above (or in StateMachineConfig), `must` what it has to be.
struct ConfigError {
  std::string_view field;
  std::string_view must;
};

/// What profiles 4m, 7m, 8m and 44m say of a method's message beside the data; the other profiles ignore it.
struct MethodInfo {
  bool response = false;  ///< message type: request or response
  bool error = false;     ///< message result: ok or error
  /// Who asked (the client), in request and response alike; 28 bits.
  std::uint32_t source_id = 0;
};

}  // namespace trestle::someip::e2e
