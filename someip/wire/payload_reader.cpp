#include "someip/wire/payload_reader.hpp"

#include <algorithm>

#include "someip/wire/utf.hpp"

namespace trestle::someip {
namespace {

bool is_zero(std::byte byte) noexcept {
  return byte == std::byte{0};
}

/// The characters before the first zero of `unit` bytes, or all of them.
ByteView before_zero(ByteView text, std::size_t unit) noexcept {
  for (std::size_t at = 0; at + unit <= text.size(); at += unit) {
    if (std::ranges::all_of(text.subspan(at, unit), is_zero)) {
      return text.first(at);
    }
  }
  return text;
}

std::string_view as_text(ByteView utf8) noexcept {
  // Characters may alias anything, so this one cast is sound.
  return {static_cast<const char*>(static_cast<const void*>(utf8.data())), utf8.size()};
}

}  // namespace

std::optional<DataId> PayloadReader::next_member() noexcept {
  const std::size_t start = position_;
  if (member_) {  // the previous member was not read
    const std::optional<std::size_t> number = number_bytes(*member_);
    if (number) {
      member_.reset();
      take(*number);
    } else {
      end(begin(FieldWidth::none, true, false));
    }
  }
  if (rules_.alignment > 1) {
    fail(WireError::bad_tag);
  }
  if (error_ || position_ == limit_) {
    position_ = error_ ? start : position_;
    return std::nullopt;
  }
  const ByteView bytes = take(tag_bytes);
  if (error_) {
    return std::nullopt;
  }
  const Tag tag = to_tag(load<std::uint16_t>(bytes.data()));
  member_ = tag.type;
  return tag.id;
}

void PayloadReader::expect_number(std::size_t bytes) noexcept {
  if (*member_ != number_type(bytes)) {
    fail(WireError::bad_tag);
  }
  member_.reset();
}

ByteView PayloadReader::bytes(std::size_t size) noexcept {
  if (member_) {  // a tagged member is a number, or has a length field
    fail(WireError::bad_tag);
  }
  return take(size);
}

ByteView PayloadReader::byte_array() noexcept {
  const Open array = begin_array();
  const ByteView elements = take(limit_ - position_);
  end(array);
  return elements;
}

std::string_view PayloadReader::string(std::span<char> room, StringEncoding encoding) noexcept {
  const Open string = begin(rules_.string_length, false, true);
  if (error_) {
    return {};
  }
  if (!string.bounded_) {  // without a length field only the interface knows the size: see fixed_string()
    fail(WireError::bad_length);
    return {};
  }
  const std::size_t start = position_;
  const std::string_view result = read_text(take(string.end_ - position_), false, encoding, room);
  end(string);
  if (error_) {
    position_ = start;
  }
  return result;
}

std::string_view PayloadReader::fixed_string(std::size_t size, std::span<char> room) noexcept {
  const bool tagged = member_.has_value();
  const Open member = tagged ? begin(FieldWidth::none, false, false) : Open{};
  const ByteView bytes = take(size);
  const std::string_view text =
      error_ ? std::string_view{} : read_text(bytes, true, rules_.string_encoding, room);
  if (tagged) {
    end(member);
  }
  return text;
}

std::string_view PayloadReader::read_text(ByteView bytes, bool fixed, StringEncoding encoding,
                                          std::span<char> room) noexcept {
  const bool utf8 = encoding == StringEncoding::utf8;
  const std::endian order = encoding == StringEncoding::utf16le ? std::endian::little : std::endian::big;
  const std::size_t unit = utf8 ? 1 : 2;
  // An odd last byte is ignored.  [feat_req_someip_641]
  bytes = bytes.first(bytes.size() - bytes.size() % unit);
  if (rules_.string_bom) {
    const auto first = utf8 ? first_utf8(bytes) : first_utf16(bytes, order);
    if (!first || first->code != byte_order_mark) {  // [feat_req_someip_666]
      fail(WireError::bad_string_encoding);
      return {};
    }
    bytes = bytes.subspan(first->bytes);
  }
  ByteView characters = bytes;
  if (fixed || rules_.string_terminator) {
    characters = before_zero(bytes, unit);
    const ByteView after = bytes.subspan(characters.size());
    // Zeros may follow the terminator: to fill a fixed size, or for alignment [feat_req_someip_239].
    if ((rules_.string_terminator && after.empty()) || !std::ranges::all_of(after, is_zero)) {
      fail(WireError::bad_string_encoding);
      return {};
    }
  }
  if (!utf8) {
    return utf16_text(characters, order, room);
  }
  if (!is_utf8(characters)) {
    fail(WireError::bad_string_encoding);
    return {};
  }
  return as_text(characters);
}

std::string_view PayloadReader::utf16_text(ByteView characters, std::endian order,
                                           std::span<char> room) noexcept {
  const ByteSpan to = std::as_writable_bytes(room);
  std::size_t written = 0;
  while (!characters.empty()) {
    const auto character = first_utf16(characters, order);
    if (!character) {
      fail(WireError::bad_string_encoding);
      return {};
    }
    const std::size_t size = utf8_bytes(character->code);
    if (size > to.size() - written) {
      fail(WireError::no_room);
      return {};
    }
    put_utf8(character->code, to.data() + written);
    written += size;
    characters = characters.subspan(character->bytes);
  }
  return {room.data(), written};
}

PayloadReader::Union PayloadReader::begin_union(std::uint32_t members, std::size_t longest) noexcept {
  const std::size_t start = position_;
  Union result;
  std::size_t size = longest;
  const bool tagged = member_.has_value();
  if (tagged) {  // the tag's length field is used, which counts the type field too
    result.open = begin(FieldWidth::none, true, false);
  } else if (rules_.union_length_first && rules_.union_length != FieldWidth::none) {
    size = field(rules_.union_length);
  }
  const std::size_t type = field(rules_.union_type);
  if (!tagged && !rules_.union_length_first && rules_.union_length != FieldWidth::none) {
    size = field(rules_.union_length);
  }
  if (!error_ && (type > members || (type == 0 && !rules_.union_null))) {
    position_ = start;
    fail(WireError::bad_union_type);
  }
  if (!tagged) {
    result.open.outer_limit_ = limit_;
    result.open.extensible_ = true;
    result.open.variable_ = rules_.union_length != FieldWidth::none;
  }
  if (!tagged && (rules_.union_length != FieldWidth::none || longest != 0)) {
    bound(result.open, size);  // Length leaves out the type field.  [feat_req_someip_272]
  }
  result.type = error_ ? 0 : static_cast<std::uint32_t>(type);
  return result;
}

PayloadReader::Open PayloadReader::begin(FieldWidth width, bool extensible, bool variable) noexcept {
  Open open;
  open.outer_limit_ = limit_;
  open.extensible_ = extensible;
  open.variable_ = variable;
  open.last_position_ = payload_.size() + 1;
  if (member_) {
    width = length_width(*member_, rules_);
    if (number_bytes(*member_) || width == FieldWidth::none) {
      fail(WireError::bad_tag);
    }
    member_.reset();
    open.variable_ = false;
  }
  if (width != FieldWidth::none) {
    bound(open, field(width));
  }
  return open;
}

void PayloadReader::bound(Open& open, std::size_t size) noexcept {
  if (error_) {
    return;
  }
  if (size > limit_ - position_) {
    return fail(size > payload_.size() - position_ ? WireError::truncated : WireError::bad_length);
  }
  open.bounded_ = true;
  open.end_ = position_ + size;
  limit_ = open.end_;
}

bool PayloadReader::more(Open& array) noexcept {
  if (error_ || position_ == limit_) {
    return false;
  }
  if (position_ == array.last_position_) {
    fail(WireError::bad_length);
    return false;
  }
  array.last_position_ = position_;
  return true;
}

void PayloadReader::end(const Open& element) noexcept {
  if (error_) {
    return;
  }
  if (element.bounded_ && position_ != element.end_) {
    if (!element.extensible_) {
      return fail(WireError::bad_length);
    }
    position_ = element.end_;
  }
  limit_ = element.outer_limit_;
  const std::size_t unit = std::max<std::size_t>(rules_.alignment, 1);
  const std::size_t beyond = (header_bytes + position_) % unit;  // [feat_req_someip_711]
  if (element.variable_ && beyond != 0) {
    position_ += std::min(unit - beyond, limit_ - position_);
  }
}

ByteView PayloadReader::take(std::size_t size) noexcept {
  if (error_) {
    return {};
  }
  if (size > limit_ - position_) {
    fail(size > payload_.size() - position_ ? WireError::truncated : WireError::bad_length);
    return {};
  }
  const ByteView taken = payload_.subspan(position_, size);
  position_ += size;
  return taken;
}

void PayloadReader::fail(WireError error) noexcept {
  if (!error_) {
    error_ = error;
  }
}

std::size_t PayloadReader::field(FieldWidth width) noexcept {
  const std::endian order = rules_.length_fields_always_big ? std::endian::big : rules_.byte_order;
  const ByteView bytes = take(someip::bytes(width));
  switch (bytes.empty() ? FieldWidth::none : width) {
    case FieldWidth::none:
      break;
    case FieldWidth::bits8:
      return load<std::uint8_t>(bytes.data(), order);
    case FieldWidth::bits16:
      return load<std::uint16_t>(bytes.data(), order);
    case FieldWidth::bits32:
      return load<std::uint32_t>(bytes.data(), order);
  }
  return 0;
}

}  // namespace trestle::someip
