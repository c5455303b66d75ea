#pragma once
#include <list>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "pcaps/network.hpp"

namespace trestle::pcaps {

/// The next bytes of one direction of a TCP connection, in order and each byte once.
struct StreamBytes {
  std::uint64_t offset = 0;  ///< of the first byte in its direction; the first one seen has 0
  /// Bytes between the previous chunk and this one that the capture lacks. They are counted in `offset`.
  std::uint64_t lost_before = 0;
  /// The connection's opening is in the capture; otherwise offset 0 may be in the middle of anything.
  bool from_start = false;
  ByteView bytes;  ///< valid during the call only
};

/// Brings the segments of TCP connections into order: retransmissions, overlaps and segments out of order.
/// A gap is given up once more is waiting behind it than the limits allow, or at finish().
class TcpStreams {
 public:
  struct Limits {
    std::size_t max_streams = 4096;  ///< directions; one more drops the least recently used
    std::size_t max_pending_bytes = std::size_t{1} << 20U;  ///< behind a gap, per direction
    std::size_t max_pending_segments = 256;
  };

  explicit TcpStreams(const Limits& limits) : limits_{limits} {}

  /// Takes a segment and calls `deliver(const Endpoint& from, const Endpoint& to, const StreamBytes&)` for
  /// what it makes available. Before the first bytes of a new connection between the same endpoints it calls
  /// `closed(from, to)`.
  template <typename Deliver, typename Closed>
  void add(const Endpoint& from, const Endpoint& to, const TcpSegment& segment, Deliver&& deliver,
           Closed&& closed) {
    Stream& stream = find(from, to, closed);
    if (accept(stream, segment)) {
      closed(from, to);
    }
    while (const std::optional<StreamBytes> ready = take(stream, false)) {
      deliver(from, to, *ready);
    }
  }

  /// Delivers what is still waiting behind gaps.
  template <typename Deliver>
  void finish(Deliver&& deliver) {
    for (auto& [key, stream] : streams_) {
      while (const std::optional<StreamBytes> ready = take(stream, true)) {
        deliver(key.first, key.second, *ready);
      }
    }
  }

  [[nodiscard]] std::uint64_t gaps() const noexcept { return gaps_; }
  [[nodiscard]] std::uint64_t lost_bytes() const noexcept { return lost_bytes_; }

 private:
  using Key = std::pair<Endpoint, Endpoint>;
  struct Stream {
    bool started = false;
    bool saw_syn = false;
    std::uint32_t first_sequence = 0;
    std::uint64_t delivered = 0;  ///< offset of the next byte to deliver
    std::map<std::uint64_t, std::vector<std::byte>> pending;
    std::size_t pending_bytes = 0;
    std::vector<std::byte> current;  ///< what `take` last handed out
    std::list<Key>::iterator use;
  };

  template <typename Closed>
  Stream& find(const Endpoint& from, const Endpoint& to, Closed& closed) {
    const Key key{from, to};
    if (const auto found = streams_.find(key); found != streams_.end()) {
      uses_.splice(uses_.end(), uses_, found->second.use);
      return found->second;
    }
    if (streams_.size() >= limits_.max_streams) {
      closed(uses_.front().first, uses_.front().second);
      streams_.erase(uses_.front());
      uses_.pop_front();
    }
    uses_.push_back(key);
    Stream& stream = streams_[key];
    stream.use = std::prev(uses_.end());
    return stream;
  }

  /// True when the segment belongs to a new connection and the old state was thrown away.
  bool accept(Stream& stream, const TcpSegment& segment);
  std::optional<StreamBytes> take(Stream& stream, bool give_up_gaps);

  Limits limits_;
  std::map<Key, Stream> streams_;
  std::list<Key> uses_;  ///< least recently used first
  std::uint64_t gaps_ = 0;
  std::uint64_t lost_bytes_ = 0;
};

}  // namespace trestle::pcaps
