#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "sd/wire/option.hpp"

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

/// What a configuration tells by its first item with that key: bytes, up to what the type holds. 0: there is
/// none, or its value is no decimal number.
[[nodiscard]] std::uint32_t receive_buffer_in(ConfigurationCursor configuration) noexcept;

}  // namespace trestle::sd
