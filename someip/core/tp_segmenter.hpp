#pragma once
#include <array>
#include <optional>

#include "someip/wire/tp.hpp"

namespace trestle::someip {

/// One datagram of a segmented message: `header`, then `bytes` bytes of the original's payload from `offset`
/// on. The driver gathers the two, so the payload is never copied.
struct TpSegment {
  std::array<std::byte, header_bytes + tp_header_bytes> header{};
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

/// Cuts a message into SOME/IP-TP segments, first to last, all but the last of the same size and as large as
/// allowed.  [feat_req_someiptp_777] [feat_req_someiptp_778] [feat_req_someiptp_779] [feat_req_someiptp_780]
///
/// Knows only the payload's size. Pacing is the caller's: take the next segment when it may be sent.
///
///     for (TpSegmenter segments{header, payload.size()}; const auto segment = segments.next();) {
///       send(segment->header, payload.subspan(segment->offset, segment->bytes));
///     }
class TpSegmenter {
 public:
  /// @param header         the original's header. Its session must not be 0: the session ties the segments
  ///                       together.  [feat_req_someiptp_762] [feat_req_someiptp_763]
  /// @param payload_bytes  at most 0xfffffff7, what the Length field of the original could say.
  /// @param segment_bytes  payload per segment; a multiple of 16, from 16 to 65472.  [feat_req_someiptp_772]
  TpSegmenter(const Header& header, std::size_t payload_bytes,
              std::size_t segment_bytes = tp_default_segment_bytes) noexcept;

  /// The next segment, or nothing after the last. An empty payload makes one empty segment.
  [[nodiscard]] std::optional<TpSegment> next() noexcept;

  /// How many segments the message has, sent or not.
  [[nodiscard]] constexpr std::size_t size() const noexcept {
    return payload_bytes_ == 0 ? 1 : (payload_bytes_ - 1) / segment_bytes_ + 1;  // nothing here wraps
  }
  /// Payload of each segment but the last.
  [[nodiscard]] constexpr std::size_t segment_bytes() const noexcept { return segment_bytes_; }
  /// Whether next() has given the last segment.
  [[nodiscard]] constexpr bool done() const noexcept { return done_; }
  /// How much of the payload next() has handed out, in bytes.
  [[nodiscard]] constexpr std::size_t offset() const noexcept { return offset_; }

 private:
  std::size_t payload_bytes_;
  std::size_t segment_bytes_;
  std::size_t offset_ = 0;
  bool done_ = false;
  /// Of a segment in the middle: only the TP header, and the last one's Length, differ from it.
  std::array<std::byte, header_bytes + tp_header_bytes> header_{};
};

}  // namespace trestle::someip
