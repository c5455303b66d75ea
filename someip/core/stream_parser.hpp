#pragma once
#include <optional>

#include "someip/wire/counters.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// What a StreamParser has seen.
struct StreamCounters {
  std::uint64_t messages = 0;  ///< handed out by next()
  std::uint64_t cookies = 0;   ///< Magic Cookies, of either direction
  // Framing was lost: from there on all is skipped until the next cookie.
  std::uint64_t bad_length = 0;  ///< a Length below 8  [feat_req_someip_798]
  std::uint64_t too_large = 0;   ///< a message that the buffer could not take
  std::uint64_t skipped_bytes = 0;
  std::uint64_t resynchronised = 0;  ///< times that a cookie ended the skipping
  constexpr StreamCounters& operator+=(const StreamCounters& other) noexcept {
    add_counters(*this, other);
    return *this;
  }
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    visit("messages_received", messages, traffic);
    visit("magic_cookies", cookies, traffic);
    visit("bad_length", bad_length, loss);
    visit("too_large", too_large, loss);
    visit("skipped_bytes", skipped_bytes, loss);
    visit("resynchronised", resynchronised, traffic);
  }
  friend constexpr bool operator==(const StreamCounters&, const StreamCounters&) = default;
};

/// Finds the messages in the bytes of one direction of a TCP connection, whatever pieces they come in,
/// beginning anywhere.  [feat_req_someip_585] [feat_req_someip_664] [feat_req_someip_702]
///
///     parser.feed(chunk);
///     while (const auto message = parser.next()) { ... }
///     if (parser.lost() && parser.counters().cookies == 0) { close the connection }
///
/// A message that lies whole in a chunk is handed out where it lies. One that does not is put together in the
/// buffer; the bytes that it lacks may be received straight into it, without a copy:
///
///     const std::size_t received = receive(parser.missing(), chunk_room);   // in this order
///     const std::size_t direct = parser.filled(received);
///     while (const auto message = parser.next()) { ... }
///     parser.feed(chunk_room.first(received - direct)); ...
///
/// Where a message ends is only known from its Length. If that cannot be true, there is no telling where the
/// next message begins until a Magic Cookie says so; without them the connection is of no more use.
/// [feat_req_someip_586] No payload is searched for cookies while framing holds: it could forge messages.
///
/// The buffer may be smaller than the largest message, so that announcing much takes no memory: when next()
/// has returned nothing and waiting() is not 0, use() has to bring a larger one before next() goes on.
class StreamParser {
 public:
  /// @param buffer  takes a message, header and payload, that comes in pieces; at least 16 bytes. Its size is
  ///                also the limit for those that don't. Outlives the parser.
  explicit StreamParser(ByteSpan buffer) noexcept : StreamParser{buffer, buffer.size()} {}
  /// @param max_bytes  the largest message, header and payload, instead of the size of the buffer.
  StreamParser(ByteSpan buffer, std::size_t max_bytes) noexcept;

  /// The next bytes of the stream. They must live until next() has returned nothing, which must have been so
  /// before the next call.
  void feed(ByteView chunk) noexcept;

  /// The next message, or nothing until more is fed. Cookies are counted and left out. The payload points
  /// into the chunk or the buffer, until the next call of anything here.
  [[nodiscard]] std::optional<Message> next() noexcept;

  /// The part of the buffer where the rest of the message under way belongs; empty while it is not known how
  /// much that is. To be asked after next() returned nothing.
  [[nodiscard]] ByteSpan missing() const noexcept;
  /// `bytes` bytes of the stream were received, the first of them into missing().
  /// @return how many of them that were; the others are to be fed.
  std::size_t filled(std::size_t bytes) noexcept;

  /// Bytes of the chunk that the buffer has no room for.
  [[nodiscard]] std::size_t waiting() const noexcept { return chunk_.size(); }
  /// Bytes in the buffer that are still needed.
  [[nodiscard]] std::size_t held() const noexcept { return held_; }
  /// Header and payload of the message under way; 0 while its header is not complete.
  [[nodiscard]] std::size_t needed() const noexcept { return needed_; }
  /// Goes on in another buffer, that begins with the held() bytes of this one.
  void use(ByteSpan buffer) noexcept { buffer_ = buffer; }

  /// Whether framing is lost, and a cookie is being looked for.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Whether a message has begun and is not complete: a stream that ends here was cut off.
  [[nodiscard]] bool in_message() const noexcept { return !lost_ && held_ != 0; }
  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] std::optional<Message> whole(ByteView bytes) noexcept;
  [[nodiscard]] bool framed(ByteView header) noexcept;
  [[nodiscard]] bool hold(std::size_t until) noexcept;
  void find_cookie() noexcept;

  ByteSpan buffer_;
  std::size_t max_bytes_;
  ByteView chunk_;          ///< not yet looked at
  std::size_t held_ = 0;    ///< bytes at the front of the buffer that came before the chunk
  std::size_t needed_ = 0;  ///< size of the message that begins with them; 0: its header is not complete
  bool lost_ = false;
  StreamCounters counters_;
};

}  // namespace trestle::someip
