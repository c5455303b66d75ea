#include "pcaps/tcp_streams.hpp"

namespace trestle::pcaps {
namespace {

/// A sequence number further off than this belongs to another connection whose opening was not recorded.
constexpr std::int32_t max_jump_bytes = 1 << 24U;

}  // namespace

bool TcpStreams::accept(Stream& stream, const TcpSegment& segment) {
  const std::uint32_t sequence = segment.sequence + (segment.syn ? 1U : 0U);
  const auto next = static_cast<std::uint32_t>(stream.first_sequence + stream.delivered);
  // Sequence numbers wrap, so only their difference says which one is later.
  const auto ahead = static_cast<std::int32_t>(sequence - next);
  const bool repeated_syn = segment.syn && stream.saw_syn && sequence == stream.first_sequence;
  const bool other_connection =
      stream.started && ((segment.syn && !repeated_syn) || ahead > max_jump_bytes || ahead < -max_jump_bytes);
  if (!stream.started || other_connection) {
    if (!segment.syn && segment.payload.empty()) {
      return false;
    }
    stream.started = true;
    stream.saw_syn = segment.syn;
    stream.first_sequence = sequence;
    stream.delivered = 0;
    stream.pending.clear();
    stream.pending_bytes = 0;
    if (!segment.payload.empty()) {
      stream.pending.emplace(0, std::vector<std::byte>{segment.payload.begin(), segment.payload.end()});
      stream.pending_bytes = segment.payload.size();
    }
    return other_connection;
  }
  ByteView bytes = segment.payload;
  std::uint64_t position = stream.delivered;
  if (ahead < 0) {
    const auto old = static_cast<std::size_t>(-static_cast<std::int64_t>(ahead));
    bytes = bytes.subspan(std::min(old, bytes.size()));
  } else {
    position += static_cast<std::uint64_t>(ahead);
  }
  if (bytes.empty()) {
    return false;
  }
  std::vector<std::byte>& place = stream.pending[position];
  if (place.size() < bytes.size()) {
    stream.pending_bytes += bytes.size() - place.size();
    // The bytes that came first stay; a longer repetition only adds its end.
    place.insert(place.end(), bytes.begin() + static_cast<std::ptrdiff_t>(place.size()), bytes.end());
  }
  return false;
}

std::optional<StreamBytes> TcpStreams::take(Stream& stream, bool give_up_gaps) {
  while (!stream.pending.empty()) {
    const auto first = stream.pending.begin();
    const std::uint64_t position = first->first;
    const bool gap = position > stream.delivered;
    if (gap && !give_up_gaps && stream.pending_bytes <= limits_.max_pending_bytes &&
        stream.pending.size() <= limits_.max_pending_segments) {
      return std::nullopt;
    }
    stream.current = std::move(first->second);
    stream.pending_bytes -= stream.current.size();
    stream.pending.erase(first);
    if (position + stream.current.size() <= stream.delivered) {
      continue;  // all of it was in another segment
    }
    StreamBytes ready;
    ready.from_start = stream.saw_syn;
    ready.bytes = stream.current;
    ready.offset = position;
    if (gap) {
      ready.lost_before = position - stream.delivered;
      ++gaps_;
      lost_bytes_ += ready.lost_before;
    } else {
      ready.bytes = ready.bytes.subspan(static_cast<std::size_t>(stream.delivered - position));
      ready.offset = stream.delivered;
    }
    stream.delivered = ready.offset + ready.bytes.size();
    return ready;
  }
  return std::nullopt;
}

}  // namespace trestle::pcaps
