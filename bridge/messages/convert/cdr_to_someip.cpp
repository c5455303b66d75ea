#include <algorithm>
#include <cstring>
#include <utility>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/expectation.hpp"
#include "bridge/messages/convert/failure.hpp"
#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/quick_to_someip.hpp"
#include "bridge/messages/convert/quick/stretch.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

/// Of a whole message.
Shape::Conversion whole_to_someip(const Program& program, std::endian order) noexcept {
  return {.program = program.number, .to_cdr = false, .order = order, .position = 0};
}

/// Whether so many bytes may follow the last field: RTPS pads samples to a multiple of four.
bool may_follow(const Program& program, std::size_t left) noexcept {
  return left < 4 || program.may_be_longer;
}

class CdrToSomeip {
 public:
  /// @param at  in the body, where to begin.
  CdrToSomeip(const QuickToSomeip& quick, std::size_t at, ConversionScratch& out)
      : program_{quick.program},
        rules_{program_.rules},
        in_{quick.body},
        at_{at},
        order_{quick.order},
        swap_{quick.swap},
        strings_{program_.strings},
        wide_strings_{program_.wide_strings},
        quick_{quick},
        out_{out} {}

  /// @param begin  the first operation that is left to do.
  bool convert(std::size_t begin) {
    const std::size_t end = program_.ops.size();
    if (!(begin == 0 && program_.fields == 0 ? fields(0, end) : block(begin, end))) {
      return false;
    }
    return may_follow(program_, in_.size() - at_) ||
           failure_.set(ConversionFault::trailing_bytes, at_, Program::no_op);
  }

  /// After convert() was false; its offset counts from the encapsulation header on.
  [[nodiscard]] ConversionError error() const {
    ConversionError error = failure_.error(program_, false, in_);
    error.offset += encapsulation_bytes;
    return error;
  }

  // For convert_stretch().

  [[nodiscard]] ConversionScratch& out() noexcept { return out_; }
  [[nodiscard]] const Program& program() const noexcept { return program_; }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  void skip(std::size_t bytes) noexcept { at_ += bytes; }
  std::size_t quick(std::size_t begin, std::size_t end, std::uint64_t& times) {
    return quick_to_someip<false>(quick_, begin, end, times, at_, out_);
  }
  [[nodiscard]] Shape* recording() const noexcept { return recording_; }
  void recording(Shape* shape) noexcept { recording_ = shape; }
  [[nodiscard]] ByteView rest() const noexcept { return in_.last(left()); }
  [[nodiscard]] Shape::Conversion conversion() const noexcept {
    return {.program = program_.number, .to_cdr = false, .order = order_, .position = at_};
  }

  bool block(std::size_t begin, std::size_t end) {
    for (std::size_t i = quick(begin, end); i < end; i = quick(i, end)) {
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
        case Op::Kind::bits:
          good = bits(i, op);
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
        case Op::Kind::fixed_array:
        case Op::Kind::tagged:
          good = enclosed(i, op);
          next = op.end;
          break;
        case Op::Kind::field:
          good = block(i + 1, op.end);
          next = op.end;
          break;
        case Op::Kind::member:
          good = member(i, op);
          next = op.end;
          break;
        case Op::Kind::choice:
          good = choice(i, op);
          next = op.end;
          break;
        case Op::Kind::alternative:  // only within a choice
          break;
      }
      if (!good) {
        return false;
      }
      i = next;
    }
    return true;
  }

 private:
  struct LengthField {
    std::size_t place;  ///< in the scratch
    std::size_t begin;  ///< position of what it counts
    FieldWidth width;
  };

  /// The fields of the message.
  bool fields(std::size_t begin, std::size_t end) {
    return program_.has_shape ? convert_stretch(*this, 0, begin, end) : block(begin, end);
  }

  /// Whether the operations have to do all by themselves, so that it can be seen.
  bool is_recorded() noexcept {
    if (recording_ != nullptr && !recording_->has_room_to(at_)) [[unlikely]] {
      recording_ = nullptr;
    }
    return recording_ != nullptr;
  }

  std::size_t quick(std::size_t i, std::size_t end) {
    std::uint64_t once = 1;
    return i == end || !may_begin_quick(program_, i) || is_recorded() ? i
           : program_.quick_arrays ? quick_to_someip<true>(quick_, i, end, once, at_, out_)
                                   : quick(i, end, once);
  }

  bool numbers(std::size_t i, const Op& op) {
    align(op.width);
    if (exceed(op.count, op.width, left())) {
      const std::size_t there = left() / op.width;
      return failure_.set(ConversionFault::truncated, at_ + there * op.width, i, there);
    }
    put_numbers(static_cast<std::size_t>(op.count), op);
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

  /// The first boolean is the lowest bit; bits that stand for nothing are 0.  [feat_req_someip_689]
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
      recording_ = nullptr;  // the next one has as many only by chance
    }
    const auto numbers = static_cast<std::size_t>(elements * op.count);
    if (!write_length(op.length, numbers * op.width)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    if (op.kind == Op::Kind::bool_sequence) {
      if (!bools(i, numbers)) {
        return false;
      }
    } else {
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
    if (!loop(i, op, elements)) {
      return false;
    }
    if (!close_length(length)) {
      return failure_.set(ConversionFault::length_overflow, begin, i);
    }
    pad();
    return true;
  }

  bool loop(std::size_t i, const Op& op, std::uint64_t count) {
    std::uint64_t done = 0;
    return convert_elements(*this, op, i + 1, count, done) || failure_.in_loop(done);
  }

  bool repeat(std::size_t i, const Op& op) {
    if (exceed(op.count, op.min_cdr, left())) {
      return failure_.set(ConversionFault::truncated, at_, i);
    }
    return loop(i, op, op.count);
  }

  bool enclosed(std::size_t i, const Op& op) {
    const std::size_t begin = at_;
    const LengthField length = open_length(op.length);
    if (!(i + 1 == program_.fields ? fields(i + 1, op.end) : block(i + 1, op.end))) {
      return false;
    }
    return close_length(length) || failure_.set(ConversionFault::length_overflow, begin, i);
  }

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

  /// Makes the length field of 32 bits behind a tag the smallest that can say `length`.
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
    const bool type_first = !op.is_tagged && !rules_.union_length_first;
    std::size_t type_place = out_.copied();
    if (type_first) {
      static_cast<void>(out_.room(bytes(rules_.union_type)));
    }
    LengthField length = open_length(op.length);
    if (!type_first) {
      type_place = out_.copied();
      static_cast<void>(out_.room(bytes(rules_.union_type)));
    }
    const std::size_t data = out_.position();
    if (!op.is_tagged) {
      length.begin = data;  // it leaves out the type field  [feat_req_someip_272]
    }
    std::size_t type = 0;
    std::size_t chosen = 0;
    for (std::size_t j = i + 1; j < op.end; j = program_.ops[j].end) {
      ++type;
      std::uint32_t count = 0;
      const std::size_t count_at = at_;
      if (!read_count(j, program_.ops[j], count)) {
        return false;
      }
      if (count == 0) {
        continue;
      }
      if (chosen != 0) {  // [feat_req_someip_263]
        return failure_.set(ConversionFault::bad_union, count_at, j);
      }
      chosen = type;
      if (!block(j + 1, program_.ops[j].end)) {
        return failure_.in_loop(0);
      }
    }
    if (chosen == 0 && !rules_.union_null) {
      return failure_.set(ConversionFault::bad_union, begin, i);
    }
    if (op.length == FieldWidth::none) {  // [feat_req_someip_583]
      const std::size_t size = static_cast<std::size_t>(op.count) - (out_.position() - data);
      std::fill_n(out_.room(size), size, std::byte{0});
    }
    store_length(out_.place(type_place), rules_.union_type, chosen, length_order(rules_));
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
      if (ends_with_zero(op) && std::memchr(text.data(), 0, text.size()) != nullptr) {
        return failure_.set(ConversionFault::bad_string, begin, i);
      }
    }
    if (text.size() > op.bound) {
      return failure_.set(ConversionFault::bound_exceeded, begin, i);
    }
    const LengthField length = open_length(op.length);
    write(strings_.bom);
    if (rules_.string_encoding == someip::StringEncoding::utf8) {
      out_.put(text);
    } else if (!put_utf16(text)) {
      return failure_.set(ConversionFault::bad_encoding, begin, i);
    }
    write(strings_.terminator);
    return end_string(i, op, length, begin);
  }

  /// False: not well-formed UTF-8.
  bool put_utf16(ByteView text) {
    const std::endian order = utf16_order(rules_.string_encoding);
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
    write(wide_strings_.bom);
    std::byte* to = out_.room(bytes);
    const std::endian to_order = utf16_order(wide_encoding(rules_));
    for (std::uint32_t unit = 0; unit < units; ++unit, at_ += 4, to += 2) {
      const auto character = someip::load<std::uint32_t>(in_.data() + at_, order_);
      if (character > 0xffff) {
        return failure_.set(ConversionFault::bad_encoding, at_, i);
      }
      if (character == 0 && ends_with_zero(op)) {
        return failure_.set(ConversionFault::bad_string, at_, i);
      }
      someip::store(to, static_cast<std::uint16_t>(character), to_order);
    }
    write(wide_strings_.terminator);
    return end_string(i, op, length, begin);
  }

  [[nodiscard]] bool ends_with_zero(const Op& op) const noexcept {
    return rules_.string_terminator || op.fixed_bytes != 0;
  }

  /// Behind the terminator.
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

  [[nodiscard]] std::size_t left() const noexcept { return at_ < in_.size() ? in_.size() - at_ : 0; }

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
  void put_numbers(std::size_t count, const Op& op) {
    const std::size_t width = op.width;
    const bool swap = width > 1 && swap_ != op.other_order;
    if (recording_ != nullptr && !recording_->numbers(at_, out_.copied(), count, width, swap)) [[unlikely]] {
      recording_ = nullptr;
    }
    const std::size_t bytes = count * width;
    if (!swap) {
      out_.put(in_.subspan(std::min(at_, in_.size()), bytes));
    } else if (bytes <= most_quick_bytes) {
      copy_few_numbers(out_.room(bytes), in_.data() + at_, count, width, true);
    } else {
      copy_swapped(out_.room(bytes), in_.data() + at_, count, width);
    }
    at_ += bytes;
  }

  void write(ByteView bytes) { copy_few(out_.room(bytes.size()), bytes.data(), bytes.size()); }

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

  const Program& program_;
  const someip::PayloadRules& rules_;
  ByteView in_;        ///< the body: alignment counts from its front
  std::size_t at_;     ///< may lie behind the end after align()
  std::endian order_;  ///< of the CDR
  bool swap_;          ///< numbers differ in byte order, unless the operation's is the other one
  const StringFrame& strings_;
  const StringFrame& wide_strings_;
  const QuickToSomeip& quick_;
  ConversionScratch& out_;
  Shape* recording_ = nullptr;
  Failure failure_;
};

__attribute__((noinline)) tl::expected<Gathered, ConversionError> by_operations(
    const Program& program, const Shape::Conversion& conversion, ByteView body, std::size_t reference_from,
    ConversionScratch& scratch) {
  scratch.begin(reference_from);
  const QuickToSomeip quick{program, body, conversion.order, conversion.order != program.rules.byte_order};
  const auto [begin, at] =
      begin_quickly(program, body, scratch, [&](std::uint64_t& times, std::size_t& place) {
        return quick_to_someip<true>(quick, 0, program.ops.size(), times, place, scratch);
      });
  if (begin == program.ops.size() && may_follow(program, body.size() - at)) {
    return scratch.finish();
  }
  CdrToSomeip converter{quick, at, scratch};
  if (!converter.convert(begin)) {
    return tl::unexpected{converter.error()};
  }
  const Gathered made = scratch.finish();
  if (program.array_at != 0) {
    scratch.message().learn(program, scratch.shape(0), conversion, body.first(converter.at()), made);
  }
  return made;
}

}  // namespace

__attribute__((hot)) tl::expected<Gathered, ConversionError> ConversionPlan::cdr_to_someip(
    ByteView sample, ConversionScratch& scratch) const {
  if (sample.size() > max_converted_bytes) {
    return tl::unexpected{
        ConversionError{ConversionFault::too_large,
                        0,
                        {},
                        expectation(program_, ConversionFault::too_large, Program::no_op, false, {})}};
  }
  // 0x0000 is big endian, 0x0001 little endian; the two bytes of options say nothing that matters.
  if (sample.size() < encapsulation_bytes || sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    const auto fault =
        sample.size() < encapsulation_bytes ? ConversionFault::truncated : ConversionFault::bad_encapsulation;
    return tl::unexpected{
        ConversionError{fault, 0, {}, expectation(program_, fault, Program::no_op, false, sample)}};
  }
  const ByteView body = sample.subspan(encapsulation_bytes);
  const auto conversion =
      whole_to_someip(program_, sample[1] == std::byte{0} ? std::endian::big : std::endian::little);
  if (Gathered made; program_.array_at != 0 && scratch.message().convert(conversion, body, made)) {
    return scratch.referencing_from(reference_from_, made);
  }
  return by_operations(program_, conversion, body, reference_from_, scratch);
}

}  // namespace trestle::messages
