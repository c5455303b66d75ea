#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "sd/wire/message.hpp"

namespace trestle::sd {

/// The key of the item of a configuration option by which a subscriber tells how many bytes of datagrams the
/// socket has room for that it receives events at: what it asked for as SO_RCVBUF, and was granted. A server
/// that knows the key sends large events in bursts of that size, all others ignore it. In an offer it tells
/// the same of the socket for requests.  [feat_req_someipsd_946] [feat_req_someipsd_1147]
inline constexpr std::string_view receive_buffer_key = "trestle.rcvbuf";

/// A configuration option with that item alone.
class ReceiveBufferOption {
 public:
  explicit ReceiveBufferOption(std::uint32_t bytes) noexcept;
  /// Points into this object.
  [[nodiscard]] Option view() const noexcept {
    return {OptionType::configuration, ByteView{body_}.first(size_)};
  }

 private:
  // Reserved byte, length, key, '=', at most ten digits, end mark.
  std::array<std::byte, 3 + receive_buffer_key.size() + 11> body_{};
  std::size_t size_ = 0;
};

/// The keys of two more items, beside that one, by which two nodes tell each other what their sockets have
/// room for: in a message to one peer that has no entries, and this one option. A number that the other one
/// is to give back, and that of the other one. Who gives it back receives what is sent to its address.
inline constexpr std::string_view question_key = "trestle.ask";
inline constexpr std::string_view answer_key = "trestle.answer";

/// What a node tells in such a message. 0: not told.
struct NodeTold {
  std::uint32_t receive_buffer_bytes = 0;  ///< of each of its UDP sockets
  std::uint32_t question = 0;
  std::uint32_t answer = 0;
};

/// A configuration option with what of that is not 0.
class NodeToldOption {
 public:
  explicit NodeToldOption(const NodeTold& told) noexcept;
  /// Points into this object.
  [[nodiscard]] Option view() const noexcept {
    return {OptionType::configuration, ByteView{body_}.first(size_)};
  }

 private:
  std::array<std::byte, 96> body_{};
  std::size_t size_ = 0;
};

/// What the configuration options of such a message tell: of each item the first one.
[[nodiscard]] NodeTold told_in(const SdMessage& message) noexcept;

/// What a configuration tells by its first item with that key: bytes, up to what the type holds. 0: there is
/// none, or its value is no decimal number.
[[nodiscard]] std::uint32_t receive_buffer_in(ConfigurationCursor configuration) noexcept;

}  // namespace trestle::sd
