#include <algorithm>
#include <cstring>
#include <limits>

#include "bridge/convert/byte_swap.hpp"
#include "bridge/convert/conversion_plan.hpp"
#include "bridge/convert/failure.hpp"
#include "bridge/convert/wire_forms.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::bridge {
namespace {

using someip::FieldWidth;

class CdrToSomeip {
 public:
  CdrToSomeip(const Program& program, ByteView body, std::endian order, ConversionScratch& out)
      : program_{program},
        rules_{program.rules},
        in_{body},
        order_{order},
        swap_{order != rules_.byte_order},
        strings_{string_frame(rules_, rules_.string_encoding)},
        wide_strings_{string_frame(rules_, wide_encoding(rules_))},
        out_{out} {}

  bool convert() {
    if (!block(0, program_.ops.size())) {
      return false;
    }
    // RTPS pads samples to a multiple of four.
    return in_.size() - at_ < 4 || failure_.set(ConversionFault::trailing_bytes, at_, no_op);
  }

  /// After convert() was false; its offset counts from the encapsulation header on.
  [[nodiscard]] ConversionError error() const {
    ConversionError error = failure_.error(program_);
    error.offset += encapsulation_bytes;
    return error;
  }

 private:
  static constexpr std::size_t no_op = std::numeric_limits<std::size_t>::max();

  bool block(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end;) {
      const Op& op = program_.ops[i];
      bool good = false;
      std::size_t next = i + 1;
      switch (op.kind) {
        case Op::Kind::numbers:
          good = numbers(i, op);
          break;
        case Op::Kind::bools:
          good = bools(i, op.count);
          break;
        case Op::Kind::string:
          good = string(i, op);
          break;
        case Op::Kind::wstring:
          good = wstring(i, op);
          break;
        case Op::Kind::number_sequence:
        case Op::Kind::bool_sequence:
          good = run_sequence(i, op);
          break;
        case Op::Kind::sequence:
          good = sequence(i, op);
          next = op.end;
          break;
        case Op::Kind::repeat:
          good = repeat(i, op);
          next = op.end;
          break;
        case Op::Kind::structure:
          good = enclosed(i, op, rules_.struct_length);
          next = op.end;
          break;
        case Op::Kind::fixed_array:
          good = enclosed(i, op, rules_.fixed_array_length);
          next = op.end;
          break;
      }
      if (!good) {
        return false;
      }
      i = next;
    }
    return true;
  }

  bool numbers(std::size_t i, const Op& op) {
    align(op.width);
    if (op.count > left() / op.width) {
      const std::size_t there = left() / op.width;
      return failure_.set(ConversionFault::truncated, at_ + there * op.width, i, there);
    }
    put_numbers(static_cast<std::size_t>(op.count), op.width);
    return true;
  }

  bool bools(std::size_t i, std::uint64_t count) {
    if (count > left()) {
      return failure_.set(ConversionFault::truncated, at_ + left(), i, left());
    }
    // A DDS reader refuses other values too; sent on, they would not be what SOME/IP allows.
    // [feat_req_someip_817]
    const ByteView bytes = in_.subspan(at_, static_cast<std::size_t>(count));
    if (!all_bools(bytes)) {
      const auto bad = static_cast<std::size_t>(
          std::ranges::find_if(bytes, [](std::byte byte) { return byte > std::byte{1}; }) - bytes.begin());
      return failure_.set(ConversionFault::bad_bool, at_ + bad, i, bad);
    }
    out_.put(bytes);
    at_ += bytes.size();
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
    if (elements > left() / element_bytes) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const auto numbers = static_cast<std::size_t>(elements * op.count);
    if (!write_length(rules_.array_length, numbers * op.width)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    if (op.kind == Op::Kind::bool_sequence) {
      if (!bools(i, numbers)) {
        return false;
      }
    } else {
      put_numbers(numbers, op.width);
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
    if (elements > left() / op.min_cdr) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    const LengthField length = open_length(rules_.array_length);
    if (!loop(i, op, elements)) {
      return false;
    }
    if (!close_length(length)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    pad();
    return true;
  }

  bool repeat(std::size_t i, const Op& op) {
    if (op.count > left() / op.min_cdr) {
      return failure_.set(ConversionFault::truncated, at_, i);
    }
    return loop(i, op, op.count);
  }

  bool loop(std::size_t i, const Op& op, std::uint64_t count) {
    for (std::uint64_t k = 0; k < count; ++k) {
      if (!block(i + 1, op.end)) {
        return failure_.in_loop(k);
      }
    }
    return true;
  }

  bool enclosed(std::size_t i, const Op& op, FieldWidth width) {
    const std::size_t begin = at_;
    const LengthField length = open_length(width);
    if (!block(i + 1, op.end)) {
      return false;
    }
    return close_length(length) || failure_.set(ConversionFault::length_overflow, begin, i);
  }

  bool string(std::size_t i, const Op& op) {
    std::uint32_t size = 0;
    const std::size_t begin = at_;
    if (!read_u32(size) || size > left()) {
      return failure_.set(ConversionFault::truncated, begin, i);
    }
    ByteView text = in_.subspan(at_, size);
    at_ += size;
    // The size counts the terminator, so 0 is none that CDR knows: some write it for an empty string, and
    // all read it as one.
    if (!text.empty()) {
      if (text.back() != std::byte{0}) {
        return failure_.set(ConversionFault::bad_string, begin, i);
      }
      text = text.first(text.size() - 1);
      // Receivers would end the text at the first zero.
      if (rules_.string_terminator && std::memchr(text.data(), 0, text.size()) != nullptr) {
        return failure_.set(ConversionFault::bad_string, begin, i);
      }
    }
    if (text.size() > op.bound) {
      return failure_.set(ConversionFault::bound_exceeded, begin, i);
    }
    if (rules_.string_encoding != someip::StringEncoding::utf8) {
      return utf16_string(i, text, begin);
    }
    if (!write_length(rules_.string_length, strings_.overhead() + text.size())) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    write(strings_.bom);
    out_.put(text);
    write(strings_.terminator);
    pad();
    return true;
  }

  bool utf16_string(std::size_t i, ByteView text, std::size_t begin) {
    const LengthField length = open_length(rules_.string_length);
    write(strings_.bom);
    const std::endian order = utf16_order(rules_.string_encoding);
    const std::size_t room = 2 * text.size();  // a byte of UTF-8 is never more than a unit of UTF-16
    std::byte* const to = out_.room(room);
    std::size_t written = 0;
    while (!text.empty()) {
      const auto character = someip::first_utf8(text);
      if (!character) {
        return failure_.set(ConversionFault::bad_encoding, begin, i);
      }
      someip::put_utf16(character->code, to + written, order);
      written += someip::utf16_bytes(character->code);
      text = text.subspan(character->bytes);
    }
    out_.give_back(room - written);
    write(strings_.terminator);
    if (!close_length(length)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    pad();
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
    if (!write_length(rules_.string_length, wide_strings_.overhead() + bytes)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    write(wide_strings_.bom);
    std::byte* to = out_.room(bytes);
    const std::endian to_order = utf16_order(wide_encoding(rules_));
    for (std::uint32_t unit = 0; unit < units; ++unit, at_ += 4, to += 2) {
      const auto character = someip::load<std::uint32_t>(in_.data() + at_, order_);
      if (character > 0xffff) {
        return failure_.set(ConversionFault::bad_encoding, at_, i);
      }
      if (character == 0 && rules_.string_terminator) {
        return failure_.set(ConversionFault::bad_string, at_, i);
      }
      someip::store(to, static_cast<std::uint16_t>(character), to_order);
    }
    write(wide_strings_.terminator);
    pad();
    return true;
  }

  // Reading CDR

  [[nodiscard]] std::size_t left() const noexcept { return at_ < in_.size() ? in_.size() - at_ : 0; }

  void align(std::size_t width) noexcept { at_ = (at_ + width - 1) & ~(width - 1); }

  bool read_u32(std::uint32_t& number) noexcept {
    align(4);
    if (left() < 4) {
      return false;
    }
    number = load_u32(in_.data() + at_, order_);
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

  /// Moves numbers over; that they are there has been checked.
  void put_numbers(std::size_t count, std::size_t width) {
    const std::size_t bytes = count * width;
    if (width == 1 || !swap_) {
      out_.put(in_.subspan(std::min(at_, in_.size()), bytes));
    } else {
      copy_swapped(out_.room(bytes), in_.data() + at_, count, width);
    }
    at_ += bytes;
  }

  void write(ByteView bytes) {
    std::byte* to = out_.room(bytes.size());
    std::ranges::copy(bytes, to);
  }

  bool write_length(FieldWidth width, std::size_t length) {
    store_length(out_.room(bytes(width)), width, length, length_order(rules_));
    return fits(width, length);
  }

  struct LengthField {
    std::size_t place;  ///< in the scratch
    std::size_t begin;  ///< position of what it counts
    FieldWidth width;
  };

  LengthField open_length(FieldWidth width) {
    const std::size_t place = out_.copied();
    static_cast<void>(out_.room(bytes(width)));
    return {place, out_.position(), width};
  }

  bool close_length(const LengthField& field) {
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

  const Program& program_;
  const someip::PayloadRules& rules_;
  ByteView in_;         ///< the body: alignment counts from its front
  std::size_t at_ = 0;  ///< may lie behind the end after align()
  std::endian order_;   ///< of the CDR
  bool swap_;           ///< numbers differ in byte order
  StringFrame strings_;
  StringFrame wide_strings_;
  ConversionScratch& out_;
  Failure failure_;
};

}  // namespace

tl::expected<Gathered, ConversionError> ConversionPlan::cdr_to_someip(ByteView sample,
                                                                      ConversionScratch& scratch) const {
  if (sample.size() > max_converted_bytes) {
    return tl::unexpected{ConversionError{ConversionFault::too_large, 0, {}}};
  }
  // 0x0000 is big endian, 0x0001 little endian; the two bytes of options say nothing that matters.
  if (sample.size() < encapsulation_bytes || sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    return tl::unexpected{ConversionError{
        sample.size() < encapsulation_bytes ? ConversionFault::truncated : ConversionFault::bad_encapsulation,
        0,
        {}}};
  }
  scratch.begin(reference_from_);
  CdrToSomeip converter{program_, sample.subspan(encapsulation_bytes),
                        sample[1] == std::byte{0} ? std::endian::big : std::endian::little, scratch};
  if (!converter.convert()) {
    return tl::unexpected{converter.error()};
  }
  return scratch.finish();
}

}  // namespace trestle::bridge
