#include "someip/wire/tp.hpp"

#include "someip/wire/bytes.hpp"

namespace trestle::someip {

Result<TpView> decode_tp(const Message& message) noexcept {
  if (!is_tp(message.header.type)) {
    return tl::unexpected{WireError::bad_tp_flags};
  }
  if (message.payload.size() < tp_header_bytes) {
    return tl::unexpected{WireError::truncated};
  }
  const TpHeader header = to_tp_header(load<std::uint32_t>(message.payload.data()));
  const ByteView slice = message.payload.subspan(tp_header_bytes);
  if (header.more && slice.size() % tp_unit_bytes != 0) {
    return tl::unexpected{WireError::bad_tp_offset};
  }
  return TpView{header, slice};
}

Result<ByteView> encode_tp_header(const Header& header, TpHeader tp, std::size_t slice_bytes,
                                  ByteSpan room) noexcept {
  if (tp.offset % tp_unit_bytes != 0 || (tp.more && slice_bytes % tp_unit_bytes != 0)) {
    return tl::unexpected{WireError::bad_tp_offset};
  }
  if (room.size() < header_bytes + tp_header_bytes) {
    return tl::unexpected{WireError::no_room};
  }
  Header segment = header;
  segment.type = with_tp(header.type);
  // Length covers the TP header too.  [feat_req_someiptp_771]
  const Result<ByteView> head = encode_header(segment, tp_header_bytes + slice_bytes, room);
  if (!head) {
    return head;
  }
  store(room.data() + header_bytes, to_word(tp));
  return ByteView{room.first(header_bytes + tp_header_bytes)};
}

}  // namespace trestle::someip
