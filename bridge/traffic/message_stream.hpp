#pragma once
#include <vector>

#include "bridge/traffic/message_sink.hpp"

namespace trestle::traffic {

/// Longer messages on TCP are taken for a sign of having lost the step. In bytes, as Length counts.
inline constexpr std::uint32_t max_stream_length = 64U << 20U;

/// Finds the messages in one direction of a TCP connection. Where it cannot know their boundaries (a
/// recording that begins inside, a gap, a Length that cannot be) it looks for the next header; in captures
/// with magic cookies that is often one.  [feat_req_someip_586]
class MessageStream {
 public:
  /// @param from_start  whether a message is known to begin at `offset`.
  MessageStream(bool from_start, std::uint64_t offset) noexcept
      : in_step_{from_start}, offset_{offset}, searched_from_{offset} {}

  /// Takes the next bytes and passes on the messages that are complete now.
  void add(const Place& place, ByteView bytes, MessageSink& sink);
  /// The next `lost` bytes will never come.
  void skip(const Place& place, std::uint64_t lost, MessageSink& sink);
  /// The stream ends: reports a message that is cut off, at the place of the last bytes.
  void finish(const Place& place, MessageSink& sink) const;

  /// Bytes that wait for the rest of their message.
  [[nodiscard]] std::size_t unread() const noexcept { return unread_.size(); }

 private:
  std::size_t read_message(const Place& place, ByteView bytes, std::size_t offset, MessageSink& sink);
  std::size_t find_message(const Place& place, ByteView bytes, std::size_t offset, MessageSink& sink);
  void report_search(const Place& place, std::size_t until, MessageSink& sink) const;

  bool in_step_;
  std::vector<std::byte> unread_;
  std::size_t offset_;         ///< of `unread_` in the direction
  std::size_t searched_from_;  ///< while not in step: where the search began
};

}  // namespace trestle::traffic
