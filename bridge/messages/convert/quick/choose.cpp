#include <algorithm>

#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/quick.hpp"

namespace trestle::messages::quick {
namespace {

/// How the loop handles an operation.
Op::Loop loop_of(const Program& program, const Op& op) {
  const bool is_few = !exceed(op.count, op.width, most_few_bytes);
  const bool has_usual_length = !program.quick.is_usual || op.length == someip::FieldWidth::bits32;
  switch (op.kind) {
    case Op::Kind::numbers:
      return is_few ? Op::Loop::numbers : Op::Loop::no;
    case Op::Kind::bools:
      return is_few ? Op::Loop::bools : Op::Loop::no;
    case Op::Kind::string:
      return program.quick.strings.is_plain && op.fixed_bytes == 0 && op.frame == 0 && has_usual_length
                 ? Op::Loop::string
                 : Op::Loop::no;
    case Op::Kind::number_sequence:
      return program.quick.strings.is_plain && has_usual_length ? Op::Loop::array : Op::Loop::no;
    case Op::Kind::sequence:
      return program.quick.strings.is_plain && has_usual_length ? Op::Loop::if_empty : Op::Loop::no;
    default:
      return Op::Loop::no;
  }
}

bool is_without_arrays(const Op& op) {
  return op.loop == Op::Loop::numbers || op.loop == Op::Loop::bools || op.loop == Op::Loop::string;
}

/// The loop handles numbers and booleans under any rules, because their place in SOME/IP does not matter.
/// Strings and arrays only in UTF-8 and without padding behind them: others are rare.
void choose_loop(Program& program) {
  QuickWays& quick = program.quick;
  quick.strings = QuickFrame{program.rules};
  quick.is_usual = quick.strings == usual_strings &&
                   program.rules.array_length == someip::FieldWidth::bits32 &&
                   program.rules.string_length == someip::FieldWidth::bits32;
  for (Op& op : program.ops) {
    op.loop = loop_of(program, op);
    quick.loop = quick.loop || op.loop != Op::Loop::no;
    quick.arrays = quick.arrays || op.loop == Op::Loop::array;
  }
  for (std::size_t i = 0; i < program.ops.size(); ++i) {
    Op& op = program.ops[i];
    // A loop that also handles arrays is slower for strings, and elements with arrays are seldom short.
    op.all_in_loop = (op.kind == Op::Kind::sequence || op.kind == Op::Kind::repeat) &&
                     std::all_of(program.ops.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                                 program.ops.begin() + op.end, is_without_arrays);
  }
}

/// A series of operations can be remembered as long as their results depend only on their own bytes and the
/// place of these in CDR.
void find_repeating(Program& program) {
  std::vector<Op>& ops = program.ops;
  for (std::size_t i = ops.size(); i-- > 0;) {
    // Padding depends on the place in SOME/IP, and fields that may be missing depend on the end of the
    // message. Tagged members come in any order, and their length fields are shortened afterwards. Packed
    // numbers do not tell a shape where they are, nor that their place in CDR matters.
    ops[i].repeats = program.rules.alignment <= 1 && !ops[i].may_miss && ops[i].kind != Op::Kind::tagged &&
                     ops[i].kind != Op::Kind::packed;
    for (std::size_t j = i + 1; j < program.behind(i); j = program.behind(j)) {
      ops[i].repeats = ops[i].repeats && ops[j].repeats;
    }
  }
}

/// Whether enough operations at the front of [begin, end) repeat: a few are as quick without a shape.
bool pays(const Program& program, std::size_t begin, std::size_t end) {
  std::size_t i = begin;
  while (i < end && program.ops[i].repeats) {
    i = program.behind(i);
  }
  return i - begin >= Shape::least_operations;
}

/// A MessageShape needs an array of single bytes, which are copied unchanged. Enough operations must stand
/// before it, and all of them must repeat. The part after it must not depend on the length of the array, so
/// it must be single bytes, too.
void choose_message_shape(Program& program) {
  const std::vector<Op>& ops = program.ops;
  const auto is_array = [](const Op& op) {
    return op.kind == Op::Kind::number_sequence && op.count * op.width == 1 &&
           op.length == someip::FieldWidth::bits32;
  };
  const auto is_bytes = [](const Op& op) {
    return (op.kind == Op::Kind::numbers && op.width == 1) || op.kind == Op::Kind::bools;
  };
  std::size_t i = 0;
  while (i < ops.size() && !is_array(ops[i])) {
    i = program.behind(i);
  }
  if (i < ops.size() && pays(program, 0, i) &&
      std::ranges::all_of(ops.begin(), ops.begin() + static_cast<std::ptrdiff_t>(i), &Op::repeats) &&
      std::all_of(ops.begin() + static_cast<std::ptrdiff_t>(i) + 1, ops.end(), is_bytes)) {
    program.quick.array_at = i;
  }
}

/// Whether a message is mostly numbers, such as a laser scan: it has arrays of numbers, and at most one
/// string or other array.
bool is_mostly_numbers(const Program& program) {
  std::size_t arrays = 0;
  std::size_t others = 0;
  for (std::size_t i = 0; i < program.ops.size(); i = program.behind(i)) {
    const Op::Loop loop = program.ops[i].loop;
    arrays += loop == Op::Loop::array ? 1U : 0U;
    others += loop != Op::Loop::array && loop != Op::Loop::numbers && loop != Op::Loop::bools ? 1U : 0U;
  }
  return arrays > 0 && others <= 1;
}

/// Shapes are used for the front of a message, for elements of arrays, and for the content of a length field
/// in front of the message. The loop is quicker if it handles all or most of that.
void choose_shapes(Program& program) {
  program.quick.front =
      program.quick.array_at != 0 || (program.ops[0].kind != Op::Kind::structure &&
                                      pays(program, 0, program.ops.size()) && !is_mostly_numbers(program));
  std::uint8_t slot = 0;
  for (std::size_t i = 0; i < program.ops.size() && slot + 1U < Memory::slots; ++i) {
    Op& op = program.ops[i];
    const bool is_message = i == 0 && op.kind == Op::Kind::structure;
    const bool is_element = op.kind == Op::Kind::sequence && !op.all_in_loop;
    if ((is_message || is_element) && pays(program, i + 1, op.end)) {
      op.slot = ++slot;
    }
  }
}

}  // namespace

void choose(Program& program) {
  choose_loop(program);
  find_repeating(program);
  choose_message_shape(program);
  choose_shapes(program);
}

}  // namespace trestle::messages::quick
