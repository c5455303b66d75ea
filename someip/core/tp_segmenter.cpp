#include "someip/core/tp_segmenter.hpp"

#include <algorithm>
#include <cassert>

#include "someip/wire/bytes.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t max_payload_bytes = 0xffffffff - length_covered_header_bytes;
/// A UDP datagram has no room for more behind the two headers.
constexpr std::size_t max_segment_bytes = 65472;

constexpr std::size_t usable(std::size_t segment_bytes) noexcept {
  return std::clamp(segment_bytes - segment_bytes % tp_unit_bytes, tp_unit_bytes, max_segment_bytes);
}

}  // namespace

TpSegmenter::TpSegmenter(const Header& header, std::size_t payload_bytes, std::size_t segment_bytes) noexcept
    : payload_bytes_{std::min(payload_bytes, max_payload_bytes)}, segment_bytes_{usable(segment_bytes)} {
  assert(payload_bytes == payload_bytes_ && "longer than a SOME/IP message can be");
  assert(segment_bytes == segment_bytes_ && "no multiple of 16 bytes that fits a datagram");
  const Result<ByteView> written = encode_tp_header(header, TpHeader{}, segment_bytes_, header_);
  assert(written);
  static_cast<void>(written);
}

std::optional<TpSegment> TpSegmenter::next() noexcept {
  if (done_) {
    return std::nullopt;
  }
  const std::size_t rest = payload_bytes_ - offset_;
  const bool more = rest > segment_bytes_;
  // Constructed in place: copying fields that were just stored one by one would stall the processor.
  std::optional<TpSegment> segment{std::in_place};
  segment->header = header_;
  segment->offset = offset_;
  segment->bytes = more ? segment_bytes_ : rest;
  const TpHeader tp{static_cast<std::uint32_t>(offset_), more};
  store(segment->header.data() + header_bytes, to_word(tp));
  if (!more) {
    const std::size_t length = length_covered_header_bytes + tp_header_bytes + rest;
    store(segment->header.data() + length_field_at, static_cast<std::uint32_t>(length));
    done_ = true;
  }
  offset_ += segment->bytes;
  return segment;
}

}  // namespace trestle::someip
