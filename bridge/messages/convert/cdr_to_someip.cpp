#include <algorithm>
#include <cstring>
#include <utility>

#include "bridge/messages/convert/converter.hpp"
#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

class CdrToSomeip : Converter<CdrToSomeip, false, quick::LoopToSomeip> {
  using Base = Converter<CdrToSomeip, false, quick::LoopToSomeip>;
  friend Base;

 public:
  using Base::convert;

 private:
  using Base::Base;

  static constexpr bool may_loop() noexcept { return true; }
  /// RTPS pads samples to a multiple of four.
  static bool is_end(const Program& program, std::size_t left) noexcept {
    return left < 4 || program.may_be_longer;
  }

  struct LengthField {
    std::size_t place;  ///< in the scratch memory
    std::size_t begin;  ///< position of the bytes that it counts
    FieldWidth width;
  };

  bool numbers(std::size_t i, const Op& op) {
    align(op.width);
    if (exceed(op.count, op.width, left())) {
      const std::size_t there = left() / op.width;
      return failure_.set(ConversionFault::truncated, at_ + there * op.width, i, there);
    }
    put_numbers(static_cast<std::size_t>(op.count), op);
    return true;
  }

  bool bools(std::size_t i, const Op& op) { return put_bools(i, op.count); }

  bool put_bools(std::size_t i, std::uint64_t count) {
    if (count > left()) {
      return failure_.set(ConversionFault::truncated, at_ + left(), i, left());
    }
    // A DDS reader refuses other values too, and SOME/IP does not allow them.  [feat_req_someip_817]
    const ByteView bytes{in_ + at_, static_cast<std::size_t>(count)};
    if (!all_bools(bytes)) {
      const auto bad = static_cast<std::size_t>(
          std::ranges::find_if(bytes, [](std::byte byte) { return byte > std::byte{1}; }) - bytes.begin());
      return failure_.set(ConversionFault::bad_bool, at_ + bad, i, bad);
    }
    out_.put(bytes);
    at_ += bytes.size();
    return true;
  }

  /// The first boolean is the lowest bit; unused bits are 0.  [feat_req_someip_689]
  bool bits(std::size_t i, const Op& op) {
    const auto count = static_cast<std::size_t>(op.count);
    if (count > left()) {
      return failure_.set(ConversionFault::truncated, at_ + left(), i, left());
    }
    std::uint64_t number = 0;
    for (std::size_t bit = 0; bit < count; ++bit) {
      const auto value = std::to_integer<std::uint64_t>(in_[at_ + bit]);
      if (value > 1) {
        return failure_.set(ConversionFault::bad_bool, at_ + bit, i, bit);
      }
      number |= value << bit;
    }
    at_ += count;
    store_number(out_.room(op.width), op.width, number, number_order(rules_, op));
    return true;
  }

  bool packed(std::size_t i, const Op& op) {
    std::byte* const to = out_.room(op.fixed_bytes);
    std::fill_n(to, op.fixed_bytes, std::byte{0});
    std::size_t index = 0;
    for (const PackedNumber& one : program_.packed[op.members_at]) {
      align(one.width);
      if (left() < one.width) {
        return failure_.set(ConversionFault::truncated, at_, i, index);
      }
      const std::uint64_t number = load_number(in_ + at_, one.width, source_.order);
      if (one.is_bool && number > 1) {
        return failure_.set(ConversionFault::bad_bool, at_, i, index);
      }
      if (!has_room_for(one, number)) {
        return failure_.set(ConversionFault::bound_exceeded, at_, i, index);
      }
      put_bits(to, one, number);
      at_ += one.width;
      ++index;
    }
    return true;
  }

  bool run_sequence(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::uint32_t elements = 0;
    if (!read_count(i, op, elements)) {
      return false;
    }
    if (elements > 0) {
      align(op.width);
    }
    const std::uint64_t element_bytes = op.count * op.width;
    if (exceed(elements, element_bytes, left())) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    if (elements > 0) {
      recording_ = nullptr;  // the next message rarely has the same number
    }
    const auto numbers = static_cast<std::size_t>(elements * op.count);
    if (!write_length(op.length, numbers * op.width)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    if (op.kind == Op::Kind::bool_sequence) {
      if (!put_bools(i, numbers)) {
        return false;
      }
    } else if (elements > 0) {
      put_numbers(numbers, op);
    }
    pad();
    return true;
  }

  bool sequence(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::uint32_t elements = 0;
    if (!read_count(i, op, elements)) {
      return false;
    }
    if (exceed(elements, op.min_cdr, left())) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const LengthField length = open_length(op.length);
    if (!Base::elements(i, op, elements)) {
      return false;
    }
    if (!close_length(length)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    pad();
    return true;
  }

  bool enclosed(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    const LengthField length = open_length(op.length);
    if (!body(i, op)) {
      return false;
    }
    return close_length(length) || failure_.set(ConversionFault::length_overflow, begin, i);
  }

  bool field(std::size_t i, const Op& op) { return block(i + 1, op.end); }

  bool tagged(std::size_t i, const Op& op) { return enclosed(i, op); }

  bool member(std::size_t i, const Op& op) {
    if (op.optional) {
      std::uint32_t count = 0;
      if (!read_count(i, op, count)) {
        return false;
      }
      if (count == 0) {
        return true;
      }
    }
    const std::size_t tag_place = out_.copied();
    const std::size_t begin = out_.position() + someip::tag_bytes;
    const Op& body = program_.ops[i + 1];
    const auto type = is_number(body) ? someip::number_type(body.width) : someip::WireType::configured_length;
    someip::store(out_.room(someip::tag_bytes), to_number(someip::Tag{type, op.id}));
    if (!block(i + 1, op.end)) {
      return op.optional && failure_.in_loop(0);
    }
    if (rules_.smallest_tagged_length && !is_number(body)) {
      shrink_length(tag_place, out_.position() - begin - 4, op.id);
    }
    return true;
  }

  /// Replaces the length field of 32 bits behind a tag by the smallest one that can hold `length`.
  void shrink_length(std::size_t tag_place, std::size_t length, someip::DataId id) {
    const FieldWidth width = someip::smallest_width(length);
    someip::store(out_.place(tag_place), to_number(someip::Tag{someip::length_type(width), id}));
    const std::size_t place = tag_place + someip::tag_bytes;
    store_length(out_.place(place), width, length, length_order(rules_));
    if (bytes(width) < 4) {
      out_.cut(place + bytes(width), 4 - bytes(width));
    }
  }

  bool choice(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    const bool type_first = !op.is_tagged && op.type_first;
    std::size_t type_place = out_.copied();
    if (type_first) {
      static_cast<void>(out_.room(bytes(op.type_width)));
    }
    LengthField length = open_length(op.length);
    if (!type_first) {
      type_place = out_.copied();
      static_cast<void>(out_.room(bytes(op.type_width)));
    }
    const std::size_t data = out_.position();
    if (!op.is_tagged) {
      length.begin = data;  // the length does not count the type field  [feat_req_someip_272]
    }
    std::size_t type = 0;
    bool chosen = false;
    for (std::size_t j = i + 1; j < op.end; j = program_.ops[j].end) {
      std::uint32_t count = 0;
      const std::size_t count_at = at_;
      if (!read_count(j, program_.ops[j], count)) {
        return false;
      }
      if (count == 0) {
        continue;
      }
      if (chosen) {  // [feat_req_someip_263]
        return failure_.set(ConversionFault::bad_union, count_at, j);
      }
      chosen = true;
      type = static_cast<std::size_t>(program_.ops[j].count);
      if (!block(j + 1, program_.ops[j].end)) {
        return failure_.in_loop(0);
      }
    }
    if (!chosen && !rules_.union_null) {
      return failure_.set(ConversionFault::bad_union, begin, i);
    }
    if (op.length == FieldWidth::none && op.count != 0) {  // [feat_req_someip_583]
      const std::size_t used = out_.position() - data;
      if (used > op.count) {
        return failure_.set(ConversionFault::length_overflow, begin, i);
      }
      const std::size_t size = static_cast<std::size_t>(op.count) - used;
      std::fill_n(out_.room(size), size, std::byte{0});
    }
    store_length(out_.place(type_place), op.type_width, type, length_order(rules_));
    if (op.length != FieldWidth::none) {
      if (!close_length(length)) {
        return failure_.set(ConversionFault::length_overflow, begin, i);
      }
      pad();
    }
    return true;
  }

  bool string(std::size_t i, const Op& op) {
    std::uint32_t size = 0;
    const std::size_t begin = at_;
    if (!read_u32(size) || size > left()) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    ByteView text{in_ + at_, size};
    at_ += size;
    // The size includes the terminator, so CDR does not know size 0. Some writers use it for an empty string,
    // and all readers take it as one.
    if (!text.empty()) {
      if (text.back() != std::byte{0}) {
        return failure_.set(ConversionFault::bad_string, begin, i);
      }
      text = text.first(text.size() - 1);
      // Receivers would end the text at the first zero.
      if (ends_with_zero(op) && std::memchr(text.data(), 0, text.size()) != nullptr) {
        return failure_.set(ConversionFault::bad_string, begin, i);
      }
    }
    if (text.size() > op.bound) {
      return failure_.set(ConversionFault::bound_exceeded, begin, i);
    }
    const LengthField length = open_length(op.length);
    const StringFrame& frame = frame_of(op);
    write(frame.bom);
    if (!frame.utf16) {
      out_.put(text);
    } else if (!put_utf16(text, utf16_order(frame.encoding))) {
      return failure_.set(ConversionFault::bad_encoding, begin, i);
    }
    write(frame.terminator);
    return end_string(i, op, length, begin);
  }

  /// False if it is not well-formed UTF-8.
  bool put_utf16(ByteView text, std::endian order) {
    const std::size_t room = 2 * text.size();  // a byte of UTF-8 is never more than a unit of UTF-16
    std::byte* const to = out_.room(room);
    std::size_t written = 0;
    while (!text.empty()) {
      const auto character = someip::first_utf8(text);
      if (!character) {
        return false;
      }
      someip::put_utf16(character->code, to + written, order);
      written += someip::utf16_bytes(character->code);
      text = text.subspan(character->bytes);
    }
    out_.give_back(room - written);
    return true;
  }

  /// In CDR a wstring is a count and then four bytes for each UTF-16 unit, without terminator.
  bool wstring(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    std::uint32_t units = 0;
    if (!read_count(i, op, units)) {
      return false;
    }
    if (units > left() / 4) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const std::size_t bytes = 2 * std::size_t{units};
    const LengthField length = open_length(op.length);
    const StringFrame& frame = frame_of(op);
    write(frame.bom);
    std::byte* to = out_.room(bytes);
    const std::endian to_order = utf16_order(frame.encoding);
    for (std::uint32_t unit = 0; unit < units; ++unit, at_ += 4, to += 2) {
      const auto character = someip::load<std::uint32_t>(in_ + at_, source_.order);
      if (character > 0xffff) {
        return failure_.set(ConversionFault::bad_encoding, at_, i);
      }
      if (character == 0 && ends_with_zero(op)) {
        return failure_.set(ConversionFault::bad_string, at_, i);
      }
      someip::store(to, static_cast<std::uint16_t>(character), to_order);
    }
    write(frame.terminator);
    return end_string(i, op, length, begin);
  }

  [[nodiscard]] const StringFrame& frame_of(const Op& op) const noexcept { return program_.frames[op.frame]; }

  [[nodiscard]] bool ends_with_zero(const Op& op) const noexcept {
    return !frame_of(op).terminator.empty() || op.fixed_bytes != 0;
  }

  /// Called after the terminator has been written.
  bool end_string(std::size_t i, const Op& op, const LengthField& length, std::size_t begin) {
    if (op.fixed_bytes != 0) {  // [feat_req_someip_233]
      const std::size_t used = out_.position() - length.begin;
      if (used > op.fixed_bytes) {
        return failure_.set(ConversionFault::length_overflow, begin, i);
      }
      std::fill_n(out_.room(op.fixed_bytes - used), op.fixed_bytes - used, std::byte{0});
    }
    if (!close_length(length)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    if (op.fixed_bytes == 0) {
      pad();
    }
    return true;
  }

  // Reading CDR

  static constexpr std::size_t aligned(std::size_t at, std::size_t width) noexcept {
    return (at + width - 1) & ~(width - 1);
  }
  void align(std::size_t width) noexcept {
    const std::size_t begin = std::exchange(at_, aligned(at_, width));
    if (recording_ != nullptr) [[unlikely]] {
      recording_->padding(begin, at_);
    }
  }

  bool read_u32(std::uint32_t& number) noexcept {
    align(4);
    if (left() < 4) {
      return false;
    }
    number = load_u32(in_ + at_, source_.order);
    at_ += 4;
    return true;
  }

  bool read_count(std::size_t i, const Op& op, std::uint32_t& count) {
    const std::size_t begin = at_;
    if (!read_u32(count)) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    return count <= op.bound || failure_.set(ConversionFault::bound_exceeded, begin, i);
  }

  // Writing SOME/IP

  bool write_length(FieldWidth width, std::size_t length) {
    store_length(out_.room(bytes(width)), width, length, length_order(rules_));
    return fits(width, length);
  }

  LengthField open_length(FieldWidth width) {
    const std::size_t place = out_.copied();
    static_cast<void>(out_.room(bytes(width)));
    return {place, out_.position(), width};
  }

  bool close_length(const LengthField& field) {
    if (field.width == FieldWidth::none) {
      return true;
    }
    const std::size_t length = out_.position() - field.begin;
    store_length(out_.place(field.place), field.width, length, length_order(rules_));
    return fits(field.width, length);
  }

  /// Zeros up to the alignment, after each string and dynamic array.  [feat_req_someip_239]
  void pad() {
    if (rules_.alignment > 1) {
      const std::size_t size = padding(out_.position(), rules_.alignment);
      std::fill_n(out_.room(size), size, std::byte{0});
    }
  }
};

}  // namespace

__attribute__((hot)) tl::expected<Gathered, ConversionError> ConversionPlan::cdr_to_someip(
    ByteView sample, ConversionScratch& scratch) const {
  if (sample.size() > max_converted_bytes) {
    return tl::unexpected{error_of_message(program_, ConversionFault::too_large, false, {})};
  }
  if (sample.size() < encapsulation_bytes) {
    return tl::unexpected{error_of_message(program_, ConversionFault::truncated, false, sample)};
  }
  // 0x0000 is big endian, 0x0001 little endian; the two bytes of options say nothing that matters.
  if (sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    return tl::unexpected{error_of_message(program_, ConversionFault::bad_encapsulation, false, sample)};
  }
  const ByteView body = sample.subspan(encapsulation_bytes);
  const std::endian order = sample[1] == std::byte{0} ? std::endian::big : std::endian::little;
  auto payload = CdrToSomeip::convert({program_, body.data(), order, order != program_.rules.byte_order},
                                      body, reference_from_, scratch);
  if (!payload) [[unlikely]] {
    payload.error().offset += encapsulation_bytes;
  }
  return payload;
}

}  // namespace trestle::messages
