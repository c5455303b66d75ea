#include "someip/wire/header.hpp"

#include <limits>

#include "someip/wire/bytes.hpp"

namespace trestle::someip {

Result<Message> decode(ByteView bytes) noexcept {
  ByteReader in{bytes};
  Header header;
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
    return tl::unexpected{WireError::truncated};
  }
  // Length counts from the Request ID on, so half of the header is inside it [feat_req_someip_77].
  // Asking first keeps the subtraction from wrapping.  [feat_req_someip_798]
  if (length < length_covered_header_bytes) {
    return tl::unexpected{WireError::bad_length};
  }
  const std::size_t payload_bytes = length - length_covered_header_bytes;
  if (in.rest().size() < payload_bytes) {
    return tl::unexpected{WireError::truncated};
  }
  return Message{header, in.rest().first(payload_bytes)};
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
  if (error_ || offset_ == datagram_.size()) {
    return std::nullopt;
  }
  const Result<Message> message = decode(datagram_.subspan(offset_));
  if (!message) {
    error_ = message.error();
    return std::nullopt;
  }
  offset_ += message->size();
  return *message;
}

}  // namespace trestle::someip
