#include "someip/wire/header.hpp"

#include <limits>

#include "someip/wire/bytes.hpp"

namespace trestle::someip {
namespace {

/// Decodes into `message`, and says what is wrong with it. Its callers return the very object that this
/// fills: a copy of fields that were just stored one by one would stall, and this runs for every datagram.
std::optional<WireError> read(ByteView bytes, Message& message) noexcept {
  ByteReader in{bytes};
  Header& header = message.header;
  header.service = ServiceId{in.u16()};
  header.method = MethodId{in.u16()};
  const std::uint32_t length = in.u32();
  header.client = ClientId{in.u16()};
  header.session = SessionId{in.u16()};
  header.protocol = in.u8();
  header.interface_version = in.u8();
  header.type = MessageType{in.u8()};
  header.return_code = ReturnCode{in.u8()};
  if (in.failed()) {
    return WireError::truncated;
  }
  // Length counts from the Request ID on, so it includes half of the header  [feat_req_someip_77]. This check
  // keeps the subtraction from wrapping.  [feat_req_someip_798]
  if (length < length_covered_header_bytes) {
    return WireError::bad_length;
  }
  const std::size_t payload_bytes = length - length_covered_header_bytes;
  if (in.rest().size() < payload_bytes) {
    return WireError::truncated;
  }
  message.payload = in.rest().first(payload_bytes);
  return std::nullopt;
}

}  // namespace

Result<Message> decode(ByteView bytes) noexcept {
  Result<Message> message;
  if (const auto error = read(bytes, *message)) {
    message = tl::unexpected{*error};
  }
  return message;
}

Result<ByteView> encode_header(const Header& header, std::size_t payload_bytes, ByteSpan room) noexcept {
  if (payload_bytes > std::numeric_limits<std::uint32_t>::max() - length_covered_header_bytes) {
    return tl::unexpected{WireError::bad_length};
  }
  ByteWriter out{room};
  out.u16(value(header.service));
  out.u16(value(header.method));
  out.u32(static_cast<std::uint32_t>(length_covered_header_bytes + payload_bytes));
  out.u16(value(header.client));
  out.u16(value(header.session));
  out.u8(header.protocol);
  out.u8(header.interface_version);
  out.u8(static_cast<std::uint8_t>(header.type));
  out.u8(static_cast<std::uint8_t>(header.return_code));
  if (out.failed()) {
    return tl::unexpected{WireError::no_room};
  }
  return out.written();
}

Result<ByteView> encode(const Header& header, ByteView payload, ByteSpan room) noexcept {
  if (room.size() < header_bytes || room.size() - header_bytes < payload.size()) {
    return tl::unexpected{WireError::no_room};
  }
  const Result<ByteView> head = encode_header(header, payload.size(), room);
  if (!head) {
    return head;
  }
  ByteWriter out{room.subspan(header_bytes)};
  out.bytes(payload);
  return ByteView{room.first(header_bytes + payload.size())};
}

std::optional<Message> MessageCursor::next() noexcept {
  std::optional<Message> message;
  if (error_ || offset_ == datagram_.size()) {
    return message;
  }
  message.emplace();
  error_ = read(datagram_.subspan(offset_), *message);
  if (error_) {
    message.reset();
  } else {
    offset_ += message->size();
  }
  return message;
}

}  // namespace trestle::someip
