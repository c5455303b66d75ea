// someip/wire: bytes to values and back. Nothing else: no state, no sockets, no memory of its own.
//
//   header.hpp          the SOME/IP header, whole messages, several messages in a datagram
//   tp.hpp              the header of SOME/IP-TP segments
//   payload_reader.hpp  payloads: numbers, strings, arrays, structs, unions, tagged members
//   payload_writer.hpp  the other direction; both follow payload_rules.hpp
//   endpoint.hpp        addresses and ports
//   bytes.hpp           reading and writing numbers; remembers the first failure
//   types.hpp           ids as types of their own, Result, WireError
//
// A codec checks bounds and rejects nothing else: what is allowed is decided in someip/core.
#pragma once
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle::someip {

/// What a message is; all other bytes are invalid.  [feat_req_someip_95] [feat_req_someip_684]
enum class MessageType : std::uint8_t {
  request = 0x00,
  request_no_return = 0x01,  ///< fire and forget
  notification = 0x02,       ///< event or field notifier
  response = 0x80,
  error = 0x81,
  tp_request = 0x20,
  tp_request_no_return = 0x21,
  tp_notification = 0x22,
  tp_response = 0xa0,
  tp_error = 0xa1,
};

/// The bit that marks a segment of a larger message.  [feat_req_someip_761]
inline constexpr std::uint8_t tp_flag = 0x20;

/// Whether the type has the TP flag, be it one of the above or not.
[[nodiscard]] constexpr bool is_tp(MessageType type) noexcept {
  return (static_cast<std::uint8_t>(type) & tp_flag) != 0;
}
/// The type that the segments of such a message have.
[[nodiscard]] constexpr MessageType with_tp(MessageType type) noexcept {
  return MessageType{static_cast<std::uint8_t>(static_cast<std::uint8_t>(type) | tp_flag)};
}
/// The type of the message that such segments make up.
[[nodiscard]] constexpr MessageType without_tp(MessageType type) noexcept {
  return MessageType{static_cast<std::uint8_t>(static_cast<std::uint8_t>(type) & ~tp_flag)};
}

/// Outcome of a request, in responses and errors. 0x20 to 0x5e belong to the application.
enum class ReturnCode : std::uint8_t {
  ok = 0x00,
  not_ok = 0x01,
  unknown_service = 0x02,
  unknown_method = 0x03,
  not_ready = 0x04,
  not_reachable = 0x05,
  timeout = 0x06,
  wrong_protocol_version = 0x07,
  wrong_interface_version = 0x08,
  malformed_message = 0x09,
  wrong_message_type = 0x0a,
  e2e_repeated = 0x0b,
  e2e_wrong_sequence = 0x0c,
  e2e = 0x0d,
  e2e_not_available = 0x0e,
  e2e_no_new_data = 0x0f,
};

inline constexpr std::size_t header_bytes = 16;
inline constexpr std::size_t length_field_at = 4;  ///< where the Length field begins
/// The part of the header that the Length field counts.  [feat_req_someip_77]
inline constexpr std::size_t length_covered_header_bytes = 8;
inline constexpr std::uint8_t protocol_version = 1;  ///< [feat_req_someip_90]

/// The SOME/IP header without its Length, which follows from the payload.  [feat_req_someip_45]
struct Header {
  ServiceId service{};
  MethodId method{};
  ClientId client{};
  SessionId session{};
  std::uint8_t protocol = protocol_version;
  std::uint8_t interface_version = 0;  ///< major version of the service  [feat_req_someip_92]
  MessageType type = MessageType::request;
  ReturnCode return_code = ReturnCode::ok;
  friend constexpr bool operator==(const Header&, const Header&) = default;
};

namespace e2e {
struct CheckResult;
}

/// A decoded message. `payload` points into the decoded bytes and dies with them.
struct Message {
  Header header{};
  ByteView payload{};
  /// What end-to-end protection found out, in handlers of messages that have it (sd/net/e2e_spec.hpp): valid
  /// during the call, and `payload` is then without the E2E header. Else null.
  const e2e::CheckResult* check = nullptr;
  /// Header and payload together, in bytes.
  [[nodiscard]] constexpr std::size_t size() const noexcept { return header_bytes + payload.size(); }
};

/// Decodes the SOME/IP message at the front of `bytes`.  [feat_req_someip_45]
///
/// Accepts every value of a field: it is the core that rejects an unknown version or type, and answers.
///
/// @param bytes  a whole UDP datagram, or the unread part of a TCP stream; what follows is left alone.
/// @return the message, or
///         WireError::truncated   `bytes` ends first; on TCP, call again with more;
///         WireError::bad_length  Length is below 8 bytes: ignore the message.  [feat_req_someip_798]
[[nodiscard]] Result<Message> decode(ByteView bytes) noexcept;

/// Writes the 16 header bytes for a payload of `payload_bytes`; the payload follows them on the wire.
/// @return the bytes written, at the front of `room`, or WireError::no_room, or WireError::bad_length when
///         the payload is larger than the Length field can say.
[[nodiscard]] Result<ByteView> encode_header(const Header& header, std::size_t payload_bytes,
                                             ByteSpan room) noexcept;

/// Writes header and payload.
/// @return the bytes written, at the front of `room`, or an error as encode_header().
[[nodiscard]] Result<ByteView> encode(const Header& header, ByteView payload, ByteSpan room) noexcept;

/// Walks over the messages of one UDP datagram, which may hold several.  [feat_req_someip_702]
///
///     for (MessageCursor cursor{datagram}; auto message = cursor.next();) { ... }
///     // cursor.error() tells whether and why it stopped before the end, cursor.offset() where.
class MessageCursor {
 public:
  explicit constexpr MessageCursor(ByteView datagram) noexcept : datagram_{datagram} {}

  /// The next message, or nothing at the end or at the first message that cannot be decoded.
  [[nodiscard]] std::optional<Message> next() noexcept;
  /// Why next() stopped early; nothing while all is well.
  [[nodiscard]] constexpr std::optional<WireError> error() const noexcept { return error_; }
  /// Where the next message begins, or the one that could not be decoded. In bytes.
  [[nodiscard]] constexpr std::size_t offset() const noexcept { return offset_; }

 private:
  ByteView datagram_;
  std::size_t offset_ = 0;
  std::optional<WireError> error_;
};

}  // namespace trestle::someip
