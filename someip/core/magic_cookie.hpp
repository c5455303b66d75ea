#pragma once
#include <array>
#include <optional>

#include "someip/wire/header.hpp"

namespace trestle::someip {

/// Which end of a TCP connection sends.
enum class StreamEnd : std::uint8_t { client, server };

/// The header of a Magic Cookie message, which has no payload.  [feat_req_someip_609]
[[nodiscard]] constexpr Header magic_cookie_header(StreamEnd sender) noexcept {
  const bool client = sender == StreamEnd::client;
  return {.service = ServiceId{0xffff},
          .method = MethodId{static_cast<std::uint16_t>(client ? 0x0000 : 0x8000)},
          .client = ClientId{0xdead},
          .session = SessionId{0xbeef},
          .interface_version = 1,
          .type = client ? MessageType::request_no_return : MessageType::notification};
}

/// A Magic Cookie message, whole.  [feat_req_someip_589]
[[nodiscard]] constexpr std::array<std::byte, header_bytes> magic_cookie(StreamEnd sender) noexcept {
  const auto bytes = [](auto... number) { return std::array{static_cast<std::byte>(number)...}; };
  const bool client = sender == StreamEnd::client;
  return bytes(0xff, 0xff, client ? 0x00 : 0x80, 0x00, 0, 0, 0, 8, 0xde, 0xad, 0xbe, 0xef, protocol_version,
               1, client ? 0x01 : 0x02, 0);
}

/// Says before which messages of a TCP connection a Magic Cookie is to be sent: the first one, and then once
/// in every interval in which messages are sent at all.  [feat_req_someip_593] [feat_req_someip_594]
class CookieSchedule {
 public:
  explicit constexpr CookieSchedule(Duration interval = std::chrono::seconds{10}) noexcept
      : interval_{interval} {}

  /// A message is about to be sent: whether a cookie goes before it.
  [[nodiscard]] constexpr bool before_message(TimePoint now) noexcept {
    if (last_ && now - *last_ < interval_) {
      return false;
    }
    last_ = now;
    return true;
  }

 private:
  Duration interval_;
  std::optional<TimePoint> last_;
};

}  // namespace trestle::someip
