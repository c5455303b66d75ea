#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "bridge/messages/convert/converter.hpp"
#include "bridge/messages/convert/default_writer.hpp"
#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

class SomeipToCdr : Converter<SomeipToCdr, true, quick::LoopToCdr> {
  using Base = Converter<SomeipToCdr, true, quick::LoopToCdr>;
  friend Base;

 public:
  using Base::convert;

 private:
  SomeipToCdr(const quick::Source& source, std::size_t at, std::size_t limit, ConversionScratch& scratch)
      : Base{source, at, limit, scratch}, defaults_{program_, out_} {}

  /// The loop knows only the length fields that the rules ask for.
  [[nodiscard]] bool may_loop() const noexcept { return !announced_; }
  /// Bytes after the last field are ignored.  [feat_req_someip_168]
  static constexpr bool is_end(const Program& /*program*/, std::size_t /*left*/) noexcept { return true; }

  bool numbers(std::size_t i, const Op& op) {
    if (exceed(op.count, op.width, left())) {
      const std::size_t there = left() / op.width;
      return failure_.set(ConversionFault::truncated, at_ + there * op.width, i, there);
    }
    align(op.width);
    put_numbers(static_cast<std::size_t>(op.count), op);
    return true;
  }

  bool bools(std::size_t i, const Op& op) {
    if (op.count > left()) {
      return failure_.set(ConversionFault::truncated, at_ + left(), i, left());
    }
    put_bools(static_cast<std::size_t>(op.count));
    return true;
  }

  /// The first boolean is the lowest bit; unused bits are ignored.  [feat_req_someip_689]
  bool bits(std::size_t i, const Op& op) {
    if (op.width > left()) {
      return failure_.set(ConversionFault::truncated, at_, i);
    }
    const std::uint64_t number = load_number(in_ + at_, op.width, number_order(rules_, op));
    at_ += op.width;
    const auto count = static_cast<std::size_t>(op.count);
    std::byte* const to = out_.room(count);
    for (std::size_t bit = 0; bit < count; ++bit) {
      to[bit] = static_cast<std::byte>(number >> bit & 1U);
    }
    return true;
  }

  bool packed(std::size_t i, const Op& op) {
    if (op.fixed_bytes > left()) {
      return failure_.set(ConversionFault::truncated, at_, i);
    }
    for (const PackedNumber& one : program_.packed[op.members_at]) {
      align(one.width);
      store_number(out_.room(one.width), one.width, bits_of(in_ + at_, one), std::endian::native);
    }
    at_ += op.fixed_bytes;
    return true;
  }

  bool run_sequence(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::size_t length = 0;
    if (!read_length(op.length, length)) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const std::size_t end = at_ + length;
    const std::uint64_t element_bytes = op.count * op.width;
    // A shift if possible: a division would take longer than all the rest.
    std::uint64_t elements = op.count == 1 ? length >> std::countr_zero(op.width) : length / element_bytes;
    if (elements >= op.bound && rules_.cut_longer_arrays) {  // [feat_req_someipcompat_1199]
      elements = op.bound;
    } else if (elements * element_bytes != length) {
      return failure_.set(ConversionFault::bad_length, begin, i);
    }
    if (elements > op.bound) {
      return failure_.set(ConversionFault::bound_exceeded, begin, i);
    }
    if (elements > 0) {
      recording_ = nullptr;  // the next message rarely has the same number
    }
    write_u32(static_cast<std::uint32_t>(elements));
    if (op.kind == Op::Kind::bool_sequence) {
      put_bools(static_cast<std::size_t>(elements * op.count));
    } else if (elements > 0) {
      align(op.width);
      put_numbers(static_cast<std::size_t>(elements * op.count), op);
    }
    at_ = end;
    skip_padding();
    return true;
  }

  bool sequence(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::size_t length = 0;
    if (!read_length(op.length, length)) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    align(4);
    const std::size_t count_place = out_.copied();
    static_cast<void>(out_.room(4));
    const std::size_t outer = std::exchange(limit_, at_ + length);
    std::uint64_t elements = 0;
    while (at_ < limit_) {
      if (elements == op.bound && rules_.cut_longer_arrays) {  // [feat_req_someipcompat_1199]
        at_ = limit_;
        break;
      }
      if (elements == op.bound) {
        return failure_.set(ConversionFault::bound_exceeded, begin, i);
      }
      if (!some_elements(i, op, op.bound - elements, elements)) {
        return failure_.in_loop(elements);
      }
    }
    limit_ = outer;
    store_u32(out_.place(count_place), static_cast<std::uint32_t>(elements), std::endian::native);
    skip_padding();
    return true;
  }

  bool enclosed(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::size_t length = 0;
    if (!read_length(op.length, length)) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const std::size_t outer = std::exchange(limit_, at_ + length);
    if (!body(i, op)) {
      return false;
    }
    if (op.kind == Op::Kind::fixed_array && at_ != limit_ && !rules_.cut_longer_arrays) {
      return failure_.set(ConversionFault::bad_length, begin, i);
    }
    // Members that a newer version has added are skipped.  [feat_req_someip_601] [feat_req_someipcompat_1199]
    at_ = limit_;
    limit_ = outer;
    return true;
  }

  bool field(std::size_t i, const Op& op) {
    return op.may_miss && at_ == limit_ ? use_default(i) : block(i + 1, op.end);
  }

  bool use_default(std::size_t i) {
    return defaults_.write(i) || failure_.set(ConversionFault::too_large, at_, i);
  }

  /// Members may come in any order, so all are located first and then converted in the order of the type.
  bool tagged(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    const std::size_t outer = limit_;
    if (op.length != FieldWidth::none) {
      std::size_t length = 0;
      if (!read_length(op.length, length)) {
        return failure_.set(ConversionFault::truncated, begin, i);
      }
      limit_ = at_ + length;
    }
    const std::size_t end = limit_;
    const std::size_t first = scratch_.members().size();
    scratch_.members().resize(first + static_cast<std::size_t>(op.count));
    if (!find_members(i, op, first)) {
      return false;
    }
    std::size_t index = first;
    for (std::size_t j = i + 1; j < op.end; j = program_.ops[j].end) {
      const MemberPlace place = scratch_.members()[index++];
      if (!place_member(j, program_.ops[j], place, begin)) {
        return false;
      }
    }
    scratch_.members().resize(first);
    at_ = end;
    limit_ = outer;
    return true;
  }

  /// Notes the places of the members, and skips those that the type does not have.
  bool find_members(std::size_t i, const Op& op, std::size_t first) {
    const std::vector<MemberId>& known = program_.members[op.members_at];
    while (at_ < limit_) {
      const std::size_t tag_at = at_;
      if (left() < someip::tag_bytes) {
        return failure_.set(ConversionFault::truncated, tag_at, i);
      }
      const someip::Tag tag = someip::to_tag(someip::load<std::uint16_t>(in_ + at_));
      at_ += someip::tag_bytes;
      const std::size_t value_at = at_;
      const auto number = someip::number_bytes(tag.type);
      std::size_t length = number.value_or(0);
      if (number ? length > left() : !read_length(someip::length_width(tag.type, rules_), length)) {
        return failure_.set(ConversionFault::truncated, tag_at, i);
      }
      at_ += length;
      const auto found = std::ranges::lower_bound(known, tag.id, {}, &MemberId::id);
      if (found == known.end() || found->id != tag.id) {
        continue;
      }
      MemberPlace& place = scratch_.members()[first + found->index];
      if (place.is_there) {
        return failure_.set(ConversionFault::bad_tag, tag_at, i);
      }
      place = {value_at, at_, tag.type, true};
    }
    return true;
  }

  static bool member(std::size_t /*i*/, const Op& /*op*/) noexcept { return false; }  // only within tagged()

  bool place_member(std::size_t j, const Op& op, const MemberPlace& place, std::size_t struct_at) {
    if (!place.is_there) {
      if (op.optional) {
        write_u32(0);
        return true;
      }
      return op.may_miss ? use_default(j) : failure_.set(ConversionFault::missing_member, struct_at, j);
    }
    const Op& body = program_.ops[j + 1];
    const auto number = someip::number_bytes(place.type);
    if (is_number(body) ? number != std::size_t{body.width} : number.has_value()) {
      return failure_.set(ConversionFault::bad_tag, place.at - someip::tag_bytes, j);
    }
    at_ = place.at;
    limit_ = place.end;
    if (!number) {
      announced_ = someip::length_width(place.type, rules_);
    }
    if (op.optional) {
      write_u32(1);
    }
    return block(j + 1, op.end) || (op.optional && failure_.in_loop(0));
  }

  bool choice(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    const std::size_t outer = limit_;
    std::size_t length = 0;
    std::size_t type = 0;
    if (!read_union_head(op, type, length)) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const std::size_t end = at_ + length;
    limit_ = end;
    bool is_known = type == 0 && rules_.union_null;
    for (std::size_t j = i + 1; j < op.end; j = program_.ops[j].end) {
      const bool is_it = program_.ops[j].count == type;
      is_known = is_known || is_it;
      write_u32(is_it ? 1 : 0);
      if (is_it && !block(j + 1, program_.ops[j].end)) {
        return failure_.in_loop(0);
      }
    }
    if (!is_known) {  // [feat_req_someip_273]
      return failure_.set(ConversionFault::bad_union, begin, i);
    }
    limit_ = outer;
    if (op.length == FieldWidth::none && op.count == 0) {
      return true;
    }
    at_ = end;  // behind the padding  [feat_req_someip_274]
    if (op.length != FieldWidth::none) {
      skip_padding();
    }
    return true;
  }

  /// Reads the type, and the length of the value behind it. False if one of them, or the value, is missing.
  bool read_union_head(const Op& op, std::size_t& type, std::size_t& length) noexcept {
    if (op.is_tagged) {  // the tag's length counts the type field too
      if (!read_length(op.length, length)) {
        return false;
      }
      const std::size_t end = at_ + length;
      if (length < bytes(op.type_width) || !read_number(op.type_width, type)) {
        return false;
      }
      length = end - at_;
      return true;
    }
    length = static_cast<std::size_t>(op.count);
    const bool has_length = op.length != FieldWidth::none;
    if (has_length && !op.type_first && !read_number(op.length, length)) {
      return false;
    }
    if (!read_number(op.type_width, type)) {
      return false;
    }
    if (has_length && op.type_first && !read_number(op.length, length)) {
      return false;
    }
    if (!has_length && length == 0) {  // ends with its value
      length = left();
    }
    return length <= left();
  }

  bool string(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    ByteView text;
    const StringFrame& frame = program_.frames[op.frame];
    if (!read_string(i, op, frame, text)) {
      return false;
    }
    align(4);
    const std::size_t size_place = out_.copied();
    static_cast<void>(out_.room(4));
    std::size_t size = text.size();
    if (!frame.utf16) {
      if (size > op.bound) {
        return failure_.set(ConversionFault::bound_exceeded, begin, i);
      }
      out_.put(text);
    } else {
      const std::endian order = utf16_order(frame.encoding);
      const std::size_t room =
          text.size() / 2 * 3;  // a unit of UTF-16 is never more than three bytes of UTF-8
      std::byte* const to = out_.room(room);
      size = 0;
      while (!text.empty()) {
        const auto character = someip::first_utf16(text, order);
        if (!character) {
          return failure_.set(ConversionFault::bad_encoding, begin, i);
        }
        someip::put_utf8(character->code, to + size);
        size += someip::utf8_bytes(character->code);
        text = text.subspan(character->bytes);
      }
      if (size > op.bound) {
        return failure_.set(ConversionFault::bound_exceeded, begin, i);
      }
      out_.give_back(room - size);
    }
    *out_.room(1) = std::byte{0};
    store_u32(out_.place(size_place), static_cast<std::uint32_t>(size + 1), std::endian::native);
    skip_padding_of(op);
    return true;
  }

  bool wstring(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    ByteView text;
    const StringFrame& frame = program_.frames[op.frame];
    if (!read_string(i, op, frame, text)) {
      return false;
    }
    const std::size_t units = text.size() / 2;
    if (units > op.bound) {
      return failure_.set(ConversionFault::bound_exceeded, begin, i);
    }
    write_u32(static_cast<std::uint32_t>(units));
    std::byte* const to = out_.room(4 * units);
    const std::endian order = utf16_order(frame.encoding);
    for (std::size_t unit = 0; unit < units; ++unit) {
      store_u32(to + 4 * unit, someip::load<std::uint16_t>(text.data() + 2 * unit, order),
                std::endian::native);
    }
    skip_padding_of(op);
    return true;
  }

  // Reading SOME/IP

  /// Reads a length field; false if it, or the bytes that it counts, are missing.
  bool read_length(FieldWidth width, std::size_t& length) noexcept {
    return read_number(std::exchange(announced_, std::nullopt).value_or(width), length) && length <= left();
  }

  /// Reads a length or type field.
  bool read_number(FieldWidth width, std::size_t& number) noexcept {
    if (left() < bytes(width)) {
      return false;
    }
    number = load_length(in_ + at_, width, length_order(rules_));
    at_ += bytes(width);
    return true;
  }

  /// The characters of a string, between BOM and terminator.
  bool read_string(std::size_t i, const Op& op, const StringFrame& frame, ByteView& text) {
    const std::size_t begin = at_;
    std::size_t length = op.fixed_bytes;
    if (op.length != FieldWidth::none ? !read_length(op.length, length) : length > left()) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    if (op.fixed_bytes != 0 && length != op.fixed_bytes) {
      return failure_.set(ConversionFault::bad_length, begin, i);
    }
    const auto found = text_within(frame, {in_ + at_, length}, op.fixed_bytes != 0);
    at_ += length;
    text = found.value_or(ByteView{});
    return found.has_value() || failure_.set(ConversionFault::bad_string, begin, i);
  }

  /// Skips the padding behind strings and dynamic arrays. Not all senders put it behind the last one.
  void skip_padding() noexcept {
    if (rules_.alignment > 1) {
      at_ += std::min(padding(at_, rules_.alignment), left());
    }
  }

  /// A string of a fixed size has no padding.
  void skip_padding_of(const Op& op) noexcept {
    if (op.fixed_bytes == 0) {
      skip_padding();
    }
  }

  // Writing CDR

  void align(std::size_t width) { align_cdr(out_, width); }
  void write_u32(std::uint32_t number) { write_cdr_u32(out_, number); }

  /// Only the lowest bit of a boolean's byte counts.  [feat_req_someip_817]
  void put_bools(std::size_t count) {
    const ByteView values{in_ + at_, count};
    if (all_bools(values)) {
      out_.put(values);
    } else {
      std::ranges::transform(values, out_.room(count), [](std::byte value) { return value & std::byte{1}; });
    }
    at_ += count;
  }

  std::optional<FieldWidth> announced_;  ///< the width of the next length field, if a tag announced it
  DefaultWriter defaults_;
};

}  // namespace

__attribute__((hot)) tl::expected<Gathered, ConversionError> ConversionPlan::someip_to_cdr(
    ByteView payload, ConversionScratch& scratch) const {
  if (payload.size() > max_converted_bytes) {
    return tl::unexpected{error_of_message(program_, ConversionFault::too_large, true, {})};
  }
  return SomeipToCdr::convert(
      {program_, payload.data(), std::endian::native, program_.rules.byte_order != std::endian::native},
      payload, reference_from_, scratch);
}

}  // namespace trestle::messages
