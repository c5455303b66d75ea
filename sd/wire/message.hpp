// sd/wire: bytes of service discovery to values and back. No state.
//
//   message.hpp  an SD message: flags, entries, and the options that each entry refers to
//   entry.hpp    Find, Offer, Subscribe and their like
//   option.hpp   endpoints, configuration, load balancing, MAC groupcast; offer_options.hpp: an Offer's
//   writer.hpp   puts entries and their options into a message, and shares equal options
//
// Unknown options are kept; what they mean for an entry is decided in sd/core/entry_options.hpp.
#pragma once
#include <cassert>

#include "sd/wire/option.hpp"
#include "someip/wire/header.hpp"

namespace trestle::sd {

/// What is wrong with an SD message, and where: in bytes from the start of the SOME/IP payload.
struct WireFault {
  WireError error{};
  std::size_t offset = 0;
  friend constexpr bool operator==(const WireFault&, const WireFault&) = default;
};

/// Bits of the Flags field; the others are reserved.
inline constexpr std::uint8_t reboot_flag = 0x80;                 ///< [feat_req_someipsd_40]
inline constexpr std::uint8_t unicast_flag = 0x40;                ///< [feat_req_someipsd_87]
inline constexpr std::uint8_t explicit_initial_data_flag = 0x20;  ///< [feat_req_someipsd_1187]

/// The SOME/IP header of every SD message; only the session differs, and the client where the network gives
/// prefixes to the Client IDs of its nodes.  [feat_req_someipsd_26]
[[nodiscard]] constexpr someip::Header sd_header(SessionId session, someip::ClientId client = {}) noexcept {
  return {.service = ServiceId{0xffff},
          .method = someip::MethodId{0x8100},
          .client = client,
          .session = session,
          .protocol = someip::protocol_version,
          .interface_version = 1,
          .type = someip::MessageType::notification,
          .return_code = someip::ReturnCode::ok};
}

/// Whether `header` is that of an SD message: its Message ID, versions and type decide. The Client ID may be
/// any, since stacks and test suites disagree about it, and the return code of an event means nothing.
[[nodiscard]] bool is_sd(const someip::Header& header) noexcept;

/// Walks over the whole options array, also where no entry points to.
class OptionCursor {
 public:
  /// @param options  the options array
  /// @param origin   where it begins in the payload, for offset()
  constexpr OptionCursor(ByteView options, std::size_t origin) noexcept : rest_{options}, offset_{origin} {}

  /// The next option, or nothing at the end or at the first one that is longer than the array's rest.
  [[nodiscard]] std::optional<Option> next() noexcept;
  /// bad_option_length when next() stopped early.
  [[nodiscard]] constexpr std::optional<WireError> error() const noexcept { return error_; }
  /// Where the next option begins, or the one that could not be read. In bytes of the payload.
  [[nodiscard]] constexpr std::size_t offset() const noexcept { return offset_; }

 private:
  ByteView rest_;
  std::size_t offset_;
  std::optional<WireError> error_;
};

/// A decoded SD message: flags and views of its arrays, which point into the decoded bytes and die with them.
/// Reading an entry or an option costs the same wherever it stands.
class SdMessage {
 public:
  /// The whole Flags byte, reserved bits included.
  [[nodiscard]] constexpr std::uint8_t flags() const noexcept { return flags_; }
  [[nodiscard]] constexpr bool reboot() const noexcept { return (flags_ & reboot_flag) != 0; }
  [[nodiscard]] constexpr bool unicast() const noexcept { return (flags_ & unicast_flag) != 0; }
  [[nodiscard]] constexpr bool explicit_initial_data() const noexcept {
    return (flags_ & explicit_initial_data_flag) != 0;
  }
  /// The 24 reserved bits after the flags.  [feat_req_someipsd_42]
  [[nodiscard]] constexpr std::uint32_t reserved() const noexcept { return reserved_; }

  [[nodiscard]] constexpr std::size_t entry_count() const noexcept { return entries_.size() / entry_bytes; }
  [[nodiscard]] Entry entry(std::size_t index) const noexcept {
    assert(index < entry_count());
    return decode_entry(entries_.subspan(index * entry_bytes).first<entry_bytes>());
  }
  /// Where an entry begins in the payload, in bytes.
  [[nodiscard]] static constexpr std::size_t entry_offset(std::size_t index) noexcept {
    return entries_origin + index * entry_bytes;
  }

  /// The option at `index` of the options array, as an OptionRun counts; nothing when the array ends, or
  /// breaks, before it.
  [[nodiscard]] std::optional<Option> option(std::size_t index) const noexcept;
  /// The `position`th option that `entry` references, of its entry.option_count(): the first run's options
  /// come before the second's.  [feat_req_someipsd_342]
  /// @return the option, or WireError::bad_option_reference as option() gives nothing.
  [[nodiscard]] Result<Option> option_of(const Entry& entry, std::size_t position) const noexcept;
  [[nodiscard]] constexpr OptionCursor options() const noexcept { return {options_, options_origin()}; }
  /// Where the options array begins in the payload, in bytes.
  [[nodiscard]] constexpr std::size_t options_origin() const noexcept {
    return entries_origin + entries_.size() + 4;
  }

  /// What stands behind the options array, normally nothing. It has no meaning.
  [[nodiscard]] constexpr ByteView trailing() const noexcept { return trailing_; }

 private:
  /// @cond  Doxygen takes it for that of someip/wire/header.hpp.
  friend tl::expected<SdMessage, WireFault> decode(ByteView payload) noexcept;
  /// @endcond

  static constexpr std::size_t entries_origin = 8;
  /// A run starts at 255 at most and is 15 long at most.
  static constexpr std::size_t addressable_options = 256 + 14;

  std::uint8_t flags_ = 0;
  std::uint32_t reserved_ = 0;
  ByteView entries_;
  ByteView options_;
  ByteView trailing_;
  std::size_t option_count_ = 0;
  std::array<std::uint16_t, addressable_options> option_offsets_;  // the first option_count_ are valid
};

/// Decodes the payload of an SD message.  [feat_req_someipsd_44]
///
/// Judges nothing but the two arrays' lengths. In particular an options array that breaks off in the middle
/// is no error here, because the entries before it still deserve an answer [feat_req_someipsd_1164]: option()
/// and OptionCursor tell of it, and find_fault() looks for everything.
///
/// @return the message, or
///         truncated           `payload` ends before both length fields are read;
///         bad_entries_length  the entries array is longer than the payload or no multiple of 16;
///         bad_options_length  the options array is longer than the payload, or than any UDP datagram.
[[nodiscard]] tl::expected<SdMessage, WireFault> decode(ByteView payload) noexcept;

/// The same for a whole SOME/IP message.
/// @return as decode() above, or not_sd (offset 0) as is_sd() tells.
[[nodiscard]] tl::expected<SdMessage, WireFault> decode(const someip::Message& message) noexcept;

/// The first thing wrong in a decoded message, judged strictly: options that don't fit into their array or
/// have a bad length or value, unknown entry types, references to options that are not there. For tools; the
/// state machine judges each entry by itself.
/// @return bad_option_length, bad_value, bad_entry_type or bad_option_reference with its place, or nothing.
[[nodiscard]] std::optional<WireFault> find_fault(const SdMessage& message) noexcept;

/// Writes a decoded message again, entry by entry and option by option as they stand: unless an option breaks
/// off, it comes out as it went in, with reserved bits, unreferenced options and trailing bytes.
/// @return the payload, at the front of `room`; no_room; or bad_option_length for a broken options array.
[[nodiscard]] Result<ByteView> encode(const SdMessage& message, ByteSpan room) noexcept;

}  // namespace trestle::sd
