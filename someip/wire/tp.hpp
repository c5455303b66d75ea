#pragma once
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// SOME/IP-TP carries a message too large for a datagram in segments. Each is a SOME/IP message of its own:
/// the header of the original with the TP flag, a TP header, and a slice of the original's payload.

/// The largest payload that travels in one datagram; larger ones are segmented.  [feat_req_someip_318]
inline constexpr std::size_t max_plain_payload_bytes = 1400;
inline constexpr std::size_t tp_header_bytes = 4;
/// Offsets count in this unit, so every segment but the last is a multiple of it.  [feat_req_someiptp_768]
inline constexpr std::size_t tp_unit_bytes = 16;
/// The largest segment of 16-byte units that fits the 1400 bytes of a UDP message.  [feat_req_someiptp_773]
inline constexpr std::size_t tp_default_segment_bytes = 1392;

/// The 32 bits between header and slice: offset (28), reserved (3), more segments (1).
/// [feat_req_someiptp_766] [feat_req_someiptp_832]
struct TpHeader {
  std::uint32_t offset = 0;   ///< of the slice in the original's payload, in bytes; a multiple of 16
  bool more = false;          ///< false in the last segment only  [feat_req_someiptp_770]
  std::uint8_t reserved = 0;  ///< three bits, sent as 0, of no meaning on reception  [feat_req_someiptp_769]
  friend constexpr bool operator==(const TpHeader&, const TpHeader&) = default;
};

/// The four bytes of a TP header as a number.
[[nodiscard]] constexpr std::uint32_t to_word(TpHeader header) noexcept {
  return (header.offset & ~0xfU) | ((header.reserved & 7U) << 1U) | (header.more ? 1U : 0U);
}
/// A TP header from its four bytes as a number; any number is one.
[[nodiscard]] constexpr TpHeader to_tp_header(std::uint32_t word) noexcept {
  // The offset is the upper 28 bits of a 32 bit number whose lower four are zero.  [feat_req_someiptp_767]
  return TpHeader{word & ~0xfU, (word & 1U) != 0, static_cast<std::uint8_t>((word >> 1U) & 7U)};
}

/// A decoded segment. `slice` points into the decoded bytes and dies with them.
struct TpView {
  TpHeader header;
  ByteView slice;
};

/// Decodes the payload of a message whose type has the TP flag.
/// @return the segment, or
///         WireError::bad_tp_flags   the type has no TP flag: it is a message of its own;
///         WireError::truncated      the payload is shorter than a TP header;
///         WireError::bad_tp_offset  not the last segment, yet its length is no multiple of 16, so that no
///                                   offset could follow it.  [feat_req_someiptp_772] [feat_req_someiptp_792]
[[nodiscard]] Result<TpView> decode_tp(const Message& message) noexcept;

/// Writes SOME/IP header and TP header of one segment; the slice follows them on the wire. The message type
/// gets the TP flag, all else of `header` is the original's.  [feat_req_someiptp_765] [feat_req_someiptp_774]
/// @return the 20 bytes written, at the front of `room`, or WireError::no_room, or WireError::bad_tp_offset
///         when offset or length break the rules of decode_tp(), or WireError::bad_length when the slice is
///         larger than the Length field can say.
[[nodiscard]] Result<ByteView> encode_tp_header(const Header& header, TpHeader tp, std::size_t slice_bytes,
                                                ByteSpan room) noexcept;

}  // namespace trestle::someip
