#include "someip/wire/payload_writer.hpp"

#include <algorithm>
#include <cstring>

#include "someip/wire/utf.hpp"

namespace trestle::someip {
PayloadWriter& PayloadWriter::tagged(DataId id) noexcept {
  // Receivers would take padding behind a member for the next tag.
  if (tag_ || static_cast<std::uint16_t>(id) > max_data_id || rules_.alignment > 1) {
    fail(WireError::bad_tag);
  }
  tag_ = id;
  return *this;
}

void PayloadWriter::put_tag(WireType type) noexcept {
  const ByteSpan place = reserve(tag_bytes);
  if (!place.empty()) {
    store(place.data(), to_number({type, *tag_}));
  }
  tag_.reset();
}

void PayloadWriter::bytes(ByteView bytes) noexcept {
  if (tag_) {
    return fail(WireError::bad_tag);
  }
  const ByteSpan place = reserve(bytes.size());
  if (!place.empty()) {
    std::memcpy(place.data(), bytes.data(), bytes.size());
  }
}

void PayloadWriter::byte_array(ByteView elements) noexcept {
  const Open array = begin_array();
  bytes(elements);
  end(array);
}

void PayloadWriter::string(std::string_view text, StringEncoding encoding) noexcept {
  // BOM and terminator count [feat_req_someip_800], the length field itself does not [feat_req_someip_562].
  const Open string = begin(rules_.string_length, true);
  put_text(text, encoding);
  end(string);
}

void PayloadWriter::fixed_string(std::string_view text, std::size_t size) noexcept {
  // Only a length field tells receivers that do not know the member where it ends.
  const std::optional<Open> member = tag_ ? std::optional{begin_tagged()} : std::nullopt;
  const std::size_t start = position_;
  put_text(text, rules_.string_encoding);
  const std::size_t used = position_ - start;
  if (!error_) {
    used > size ? fail(WireError::bad_length) : zeros(size - used);
  }
  if (member) {
    end(*member);
  }
}

void PayloadWriter::put_text(std::string_view text, StringEncoding encoding) noexcept {
  const bool utf8 = encoding == StringEncoding::utf8;
  const std::endian order = encoding == StringEncoding::utf16le ? std::endian::little : std::endian::big;
  const bool terminate = rules_.string_terminator;
  const auto put_character = [&](char32_t code) {
    const ByteSpan place = reserve(utf8 ? utf8_bytes(code) : utf16_bytes(code));
    if (!place.empty()) {
      utf8 ? put_utf8(code, place.data()) : put_utf16(code, place.data(), order);
    }
  };
  if (rules_.string_bom) {
    put_character(byte_order_mark);  // [feat_req_someip_662]
  }
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty() && !error_;) {
    const auto character = first_utf8(rest);
    if (!character || (character->code == 0 && terminate)) {
      return fail(WireError::bad_string_encoding);
    }
    put_character(character->code);
    rest = rest.subspan(character->bytes);
  }
  if (terminate) {
    put_character(0);  // one zero byte, in UTF-16 two  [feat_req_someip_687] [feat_req_someip_639]
  }
}

PayloadWriter::Open PayloadWriter::begin_union(std::uint32_t type, std::size_t longest) noexcept {
  Open open;
  const std::size_t start = position_;
  if (type == 0 && !rules_.union_null) {
    fail(WireError::bad_union_type);
  }
  if (tag_) {
    open = begin_tagged();
    put_field(reserve(someip::bytes(rules_.union_type)), type, WireError::bad_union_type);
    return open;
  }
  if (rules_.union_length_first) {
    open = begin(rules_.union_length, true);
  }
  put_field(reserve(someip::bytes(rules_.union_type)), type, WireError::bad_union_type);
  if (!rules_.union_length_first) {
    open = begin(rules_.union_length, true);
  }
  open.start_ = start;
  open.contents_at_ = position_;  // Length leaves out the type field.  [feat_req_someip_272]
  open.padded_bytes_ = longest;
  open.variable_ = rules_.union_length != FieldWidth::none;
  return open;
}

PayloadWriter::Open PayloadWriter::begin(FieldWidth width, bool variable) noexcept {
  if (tag_) {
    return begin_tagged();
  }
  Open open;
  open.variable_ = variable;
  open.is_element_ = std::exchange(in_array_, false);
  open.start_ = position_;
  open.length_ = reserve(someip::bytes(width));
  open.contents_at_ = position_;
  return open;
}

PayloadWriter::Open PayloadWriter::begin_tagged() noexcept {
  Open open;
  open.shrinks_ = rules_.smallest_tagged_length;
  open.id_ = *tag_;
  open.is_element_ = std::exchange(in_array_, false);
  open.start_ = position_;
  const FieldWidth width = open.shrinks_ ? FieldWidth::bits32 : rules_.tagged_length;
  if (width == FieldWidth::none) {
    fail(WireError::bad_tag);
  }
  put_tag(WireType::configured_length);
  open.length_ = reserve(someip::bytes(width));
  open.contents_at_ = position_;
  return open;
}

ByteSpan PayloadWriter::shrink(const Open& element) noexcept {
  const std::size_t size = position_ - element.contents_at_;
  const FieldWidth width = smallest_width(size);
  const std::size_t length_at = element.contents_at_ - element.length_.size();
  const std::size_t contents_at = length_at + someip::bytes(width);
  std::memmove(&room_[contents_at], room_.data() + element.contents_at_, size);
  position_ = contents_at + size;
  store(&room_[length_at - tag_bytes], to_number({length_type(width), element.id_}));
  return room_.subspan(length_at, someip::bytes(width));
}

void PayloadWriter::end(const Open& element) noexcept {
  if (tag_) {
    fail(WireError::bad_tag);
  }
  if (error_) {
    return;
  }
  if (element.padded_bytes_ != 0) {
    const std::size_t used = position_ - element.contents_at_;
    if (used > element.padded_bytes_) {
      return fail(WireError::bad_length);
    }
    zeros(element.padded_bytes_ - used);
  }
  if (element.is_element_ && position_ == element.start_) {
    return fail(WireError::bad_length);
  }
  in_array_ = element.is_element_;
  const std::size_t size = position_ - element.contents_at_;
  put_field(element.shrinks_ ? shrink(element) : element.length_, size, WireError::bad_length);
  // Alignment counts from the start of the message, so it includes the header.  [feat_req_someip_711]
  const std::size_t unit = std::max<std::size_t>(rules_.alignment, 1);
  const std::size_t beyond = (header_bytes + position_) % unit;
  if (element.variable_ && beyond != 0) {
    zeros(unit - beyond);
  }
}

Result<ByteView> PayloadWriter::finish() const noexcept {
  if (error_ || tag_) {
    return tl::unexpected{error_.value_or(WireError::bad_tag)};
  }
  return ByteView{room_.first(position_)};
}

ByteSpan PayloadWriter::reserve(std::size_t size) noexcept {
  if (error_) {
    return {};
  }
  if (size > room_.size() - position_) {
    fail(WireError::no_room);
    return {};
  }
  const ByteSpan place = room_.subspan(position_, size);
  position_ += size;
  return place;
}

void PayloadWriter::zeros(std::size_t size) noexcept {
  std::ranges::fill(reserve(size), std::byte{0});
}

void PayloadWriter::fail(WireError error) noexcept {
  if (!error_) {
    error_ = error;
  }
}

void PayloadWriter::put_field(ByteSpan place, std::size_t number, WireError overflow) noexcept {
  if (error_ || place.empty()) {
    return;
  }
  if (number > (std::uint64_t{1} << (8 * place.size())) - 1) {
    return fail(overflow);
  }
  const std::endian order = rules_.length_fields_always_big ? std::endian::big : rules_.byte_order;
  if (place.size() == 1) {
    store(place.data(), static_cast<std::uint8_t>(number), order);
  } else if (place.size() == 2) {
    store(place.data(), static_cast<std::uint16_t>(number), order);
  } else {
    store(place.data(), static_cast<std::uint32_t>(number), order);
  }
}

}  // namespace trestle::someip
