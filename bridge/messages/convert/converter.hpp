#pragma once
#include <algorithm>
#include <tl/expected.hpp>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/failure.hpp"
#include "bridge/messages/convert/quick/quick.hpp"

namespace trestle::messages {

/// Executes a program's operations on a message: what both directions have in common. `Side` is the class
/// that derives from this one. It does single operations, and says with may_loop() whether the loop can do
/// the next one, and with is_end() whether the message may end where it is.
/// @tparam is_to_cdr  the direction
/// @tparam Way        its way through the loop
template <typename Side, bool is_to_cdr, template <bool> class Way>
class Converter {
 public:
  /// @return the message, or why it cannot be converted.
  static tl::expected<Gathered, ConversionError> convert(const quick::Source& source, ByteView input,
                                                         std::size_t reference_from,
                                                         ConversionScratch& scratch) {
    const Program& program = source.program;
    if (Gathered made; program.quick.array_at != 0 && scratch.memory().convert(whole(source), input, made)) {
      return scratch.output().referencing_from(reference_from, made);
    }
    return by_operations(source, input, reference_from, scratch);
  }

 protected:
  Converter(const quick::Source& source, std::size_t at, std::size_t limit, ConversionScratch& scratch)
      : source_{source},
        program_{source.program},
        rules_{program_.rules},
        in_{source.in},
        at_{at},
        limit_{limit},
        out_{scratch.output()},
        scratch_{scratch} {}

  /// Does the operations in [begin, end).
  bool block(std::size_t begin, std::size_t end) {
    for (std::size_t i = loop(begin, end); i < end; i = loop(i, end)) {
      if (!one(i, program_.ops[i])) {
        return false;
      }
      i = program_.behind(i);
    }
    return true;
  }

  /// Does the body of the i-th operation.
  bool body(std::size_t i, const Op& op) {
    return op.slot != 0 ? stretch(op.slot, i + 1, op.end) : block(i + 1, op.end);
  }

  /// Does it so many times.
  bool elements(std::size_t i, const Op& op, std::uint64_t count) {
    std::uint64_t done = 0;
    while (done < count) {
      if (!some_elements(i, op, count - done, done)) {
        return failure_.in_loop(done);
      }
    }
    return true;
  }

  /// Does it once, or more often where the loop can.
  /// @param most  so often
  /// @param done  on return, so many more; if it failed, the one after those did.
  bool some_elements(std::size_t i, const Op& op, std::uint64_t most, std::uint64_t& done) {
    const std::size_t begin = i + 1;
    std::size_t next = begin;
    if (op.all_in_loop && recording_ == nullptr && side().may_loop()) {
      std::uint64_t left = most;
      next = run(begin, op.end, left, false);
      done += most - left;
      if (left == 0 || (left != most && next == begin)) {
        return true;
      }
    }
    const bool good = next != begin ? block(next, op.end) : body(i, op);
    done += good ? 1 : 0;
    return good;
  }

  /// Moves numbers over; that they are there has been checked.
  void put_numbers(std::size_t count, const Op& op) {
    const std::size_t width = op.width;
    const std::size_t bytes = count * width;
    const bool swap = width > 1 && source_.swap != op.other_order;
    if (recording_ != nullptr && !recording_->numbers(at_, out_.copied(), count, width, swap)) [[unlikely]] {
      recording_ = nullptr;
    }
    if (!swap) {
      out_.put({in_ + at_, bytes});
    } else if (bytes <= quick::most_few_bytes) {
      copy_few_numbers(out_.room(bytes), in_ + at_, count, width, true);
    } else {
      copy_swapped(out_.room(bytes), in_ + at_, count, width);
    }
    at_ += bytes;
  }

  void write(ByteView bytes) { copy_few(out_.room(bytes.size()), bytes.data(), bytes.size()); }

  [[nodiscard]] std::size_t left() const noexcept { return at_ < limit_ ? limit_ - at_ : 0; }

  const quick::Source& source_;
  const Program& program_;
  const someip::PayloadRules& rules_;
  const std::byte* in_;
  std::size_t at_;     ///< CDR: may lie behind the end when it was aligned
  std::size_t limit_;  ///< SOME/IP: the end of the array or struct that is being read; else of the message
  Output& out_;
  ConversionScratch& scratch_;
  quick::Shape* recording_ = nullptr;  ///< what is told of each operation
  Failure failure_;

 private:
  Side& side() noexcept { return static_cast<Side&>(*this); }

  __attribute__((noinline)) static tl::expected<Gathered, ConversionError> by_operations(
      const quick::Source& source, ByteView input, std::size_t reference_from, ConversionScratch& scratch) {
    const Program& program = source.program;
    Output& out = scratch.output();
    out.begin(reference_from);
    if (is_to_cdr) {
      std::ranges::copy(encapsulation, out.room(encapsulation_bytes));
    }
    const std::size_t end = program.ops.size();
    std::size_t at = 0;
    std::size_t begin = 0;
    // Many messages end in the loop that they begin with, and a converter takes as long to set up as that.
    if (program.quick.loop && !program.quick.front) {
      std::uint64_t once = 1;
      begin = quick::run<Way>(source, 0, end, once, at, input.size(), program.quick.arrays, out);
      if (begin == end && Side::is_end(program, input.size() - at)) {
        return out.finish();
      }
    }
    Side side{source, at, input.size(), scratch};
    Converter& converter = side;
    if (!(program.quick.front ? converter.stretch(0, 0, end) : converter.block(begin, end))) {
      return tl::unexpected{converter.failure_.error(program, is_to_cdr, {source.in, converter.limit_})};
    }
    if (!Side::is_end(program, converter.left())) {
      converter.failure_.set(ConversionFault::trailing_bytes, converter.at_, Program::no_op);
      return tl::unexpected{converter.failure_.error(program, is_to_cdr, input)};
    }
    const Gathered made = out.finish();
    if (program.quick.array_at != 0) {
      scratch.memory().learn(program, whole(source), input.first(converter.at_), made);
    }
    return made;
  }

  bool one(std::size_t i, const Op& op) {
    switch (op.kind) {
      case Op::Kind::numbers:
        return side().numbers(i, op);
      case Op::Kind::bools:
        return side().bools(i, op);
      case Op::Kind::bits:
        return side().bits(i, op);
      case Op::Kind::packed:
        return side().packed(i, op);
      case Op::Kind::string:
        return side().string(i, op);
      case Op::Kind::wstring:
        return side().wstring(i, op);
      case Op::Kind::number_sequence:
      case Op::Kind::bool_sequence:
        return side().run_sequence(i, op);
      case Op::Kind::sequence:
        return side().sequence(i, op);
      case Op::Kind::repeat:
        return exceed(op.count, is_to_cdr ? op.min_someip : op.min_cdr, left())
                   ? failure_.set(ConversionFault::truncated, at_, i)
                   : elements(i, op, op.count);
      case Op::Kind::structure:
      case Op::Kind::fixed_array:
        return side().enclosed(i, op);
      case Op::Kind::field:
        return side().field(i, op);
      case Op::Kind::tagged:
        return side().tagged(i, op);
      case Op::Kind::member:
        return side().member(i, op);
      case Op::Kind::choice:
        return side().choice(i, op);
      case Op::Kind::alternative:
        break;  // only within a choice
    }
    return false;
  }

  /// @param times  how often to do all of [begin, end); on return, how often is left
  std::size_t run(std::size_t begin, std::size_t end, std::uint64_t& times, bool arrays) {
    return quick::run<Way>(source_, begin, end, times, at_, limit_, arrays, out_);
  }

  /// Does operations as far as the loop can.
  std::size_t loop(std::size_t i, std::size_t end) {
    // Arrays of structs are mostly not empty.
    if (i == end || program_.ops[i].loop == Op::Loop::no || program_.ops[i].loop == Op::Loop::if_empty ||
        !side().may_loop() || is_recorded()) {
      return i;
    }
    std::uint64_t once = 1;
    return run(i, end, once, program_.quick.arrays);
  }

  // Shapes. The operations are done without the loop while one is recorded, so that each can tell what it
  // does.

  [[nodiscard]] static quick::Shape::Conversion whole(const quick::Source& source) noexcept {
    return {.program = source.program.number,
            .to_cdr = is_to_cdr,
            .order = source.order,
            .position = is_to_cdr ? encapsulation_bytes : 0};
  }

  bool is_recorded() noexcept {
    if (recording_ != nullptr && !recording_->has_room_to(at_)) [[unlikely]] {
      recording_ = nullptr;
    }
    return recording_ != nullptr;
  }

  /// Does the operations of a message's front, or of an element of an array. If what they did for the one
  /// before is remembered, and fits, that is taken instead.
  bool stretch(std::size_t slot, std::size_t begin, std::size_t end) {
    std::size_t i = begin;
    if (recording_ == nullptr) {
      quick::Shape& shape = scratch_.memory().shape(is_to_cdr, slot);
      const quick::Shape::Conversion conversion{.program = program_.number,
                                                .to_cdr = is_to_cdr,
                                                .order = source_.order,
                                                .position = is_to_cdr ? out_.position() : at_};
      const std::byte* const from = in_ + std::min(at_, limit_);
      if (shape.is(conversion, {from, left()})) {
        shape.write(from, out_.room(shape.writes()));
        at_ += shape.reads();
        i = shape.end();
      } else if (shape.is_due() && !record(shape, conversion, i, end)) {
        return false;
      }
    }
    return i == end || block(i, end);
  }

  /// Does the operations from `i` on, and tells `shape` what they do.
  /// @param i  on return, the first one that is no part of the shape and was not done.
  __attribute__((noinline, cold)) bool record(quick::Shape& shape, const quick::Shape::Conversion& conversion,
                                              std::size_t& i, std::size_t end) {
    const std::byte* const input = in_ + std::min(at_, limit_);
    const std::size_t copied = out_.copied();
    const std::size_t position = out_.position();
    shape.begin(conversion, i, at_, copied);
    recording_ = &shape;
    while (i < end && program_.ops[i].repeats) {
      if (!one(i, program_.ops[i])) {
        return false;
      }
      i = program_.behind(i);
      const bool is_referenced = out_.position() - position != out_.copied() - copied;
      if (recording_ == nullptr || is_referenced || !shape.keep(i, at_, out_.copied() - copied)) {
        break;
      }
    }
    recording_ = nullptr;
    shape.finish(input, out_.place(copied));
    return true;
  }
};

}  // namespace trestle::messages
