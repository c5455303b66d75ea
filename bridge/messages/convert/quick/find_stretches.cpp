#include "bridge/messages/convert/quick/find_stretches.hpp"

#include <algorithm>

#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/shape.hpp"

namespace trestle::messages {
namespace {

std::size_t behind(const std::vector<Op>& ops, std::size_t i) {
  return std::max<std::size_t>(i + 1, ops[i].end);
}

void find_repeating(Program& program) {
  std::vector<Op>& ops = program.ops;
  for (std::size_t i = ops.size(); i-- > 0;) {
    // Padding depends on the place in SOME/IP, what may be missing on where the message ends. Tagged members
    // come in any order, and their length fields are made shorter afterwards.
    ops[i].repeats = program.rules.alignment <= 1 && !ops[i].may_miss && ops[i].kind != Op::Kind::tagged;
    for (std::size_t j = i + 1; j < behind(ops, i); j = behind(ops, j)) {
      ops[i].repeats = ops[i].repeats && ops[j].repeats;
    }
  }
}

bool is_quick(const Program& program, const Op& op) {
  return may_be_quick(op) &&
         (op.kind != Op::Kind::string || (op.fixed_bytes == 0 && program.quick_strings.is_plain));
}

void find_quick(Program& program) {
  std::vector<Op>& ops = program.ops;
  for (std::size_t i = 0; i < ops.size(); ++i) {
    ops[i].is_quick = (ops[i].kind == Op::Kind::sequence || ops[i].kind == Op::Kind::repeat) &&
                      std::all_of(ops.begin() + static_cast<std::ptrdiff_t>(i) + 1, ops.begin() + ops[i].end,
                                  [&](const Op& op) { return is_quick(program, op); });
  }
}

bool pays(const std::vector<Op>& ops, std::size_t begin, std::size_t end) {
  std::size_t i = begin;
  while (i < end && ops[i].repeats) {
    i = behind(ops, i);
  }
  return i - begin >= Shape::least_operations;
}

/// Of a message that is nothing but what repeats, and the first array of bytes among that; 0: of none.
std::size_t array_behind_front(const Program& program) {
  const std::vector<Op>& ops = program.ops;
  std::size_t found = 0;
  for (std::size_t i = program.fields; i < ops.size(); i = behind(ops, i)) {
    const Op& op = ops[i];
    if (!op.repeats) {
      return 0;
    }
    if (found == 0 && op.kind == Op::Kind::number_sequence && op.count * op.width == 1 &&
        op.length == someip::FieldWidth::bits32) {
      found = i;
    }
  }
  return program.fields == 0 && program.has_shape ? found : 0;
}

bool has_only_bytes(const std::vector<Op>& ops, std::size_t begin) {
  return std::all_of(ops.begin() + static_cast<std::ptrdiff_t>(begin), ops.end(), [](const Op& op) {
    return (op.kind == Op::Kind::numbers && op.width == 1) || op.kind == Op::Kind::bools;
  });
}

/// The first array of numbers of a message that is quick operations and arrays, if it has at most one text or
/// array of anything else: more of them are quicker compared with those of the message before.
std::size_t numbers_with_little_else(const Program& program) {
  std::size_t found = Program::no_op;
  std::size_t others = 0;
  for (std::size_t i = 0; i < program.ops.size(); i = behind(program.ops, i)) {
    const Op& op = program.ops[i];
    if (op.kind == Op::Kind::number_sequence) {
      found = std::min(found, i);
    } else if (op.kind == Op::Kind::sequence || (op.kind == Op::Kind::string && is_quick(program, op))) {
      ++others;
    } else if (!is_quick(program, op)) {
      return Program::no_op;
    }
  }
  return others <= 1 ? found : Program::no_op;
}

}  // namespace

void find_stretches(Program& program) {
  std::vector<Op>& ops = program.ops;
  find_repeating(program);
  find_quick(program);
  const bool is_struct =
      program.rules.struct_length != someip::FieldWidth::none && ops[0].kind == Op::Kind::structure;
  program.fields = is_struct ? 1 : 0;
  program.has_shape = pays(ops, program.fields, ops.size());
  program.array_at = array_behind_front(program);
  program.bytes_behind_array = program.array_at != 0 && has_only_bytes(ops, behind(ops, program.array_at));
  program.quick_arrays = program.quick_strings.is_plain &&
                         std::ranges::find(ops, Op::Kind::number_sequence, &Op::kind) != ops.end();
  program.numbers_at =
      program.quick_arrays && program.array_at == 0 ? numbers_with_little_else(program) : Program::no_op;
  std::uint8_t slot = 0;
  for (std::size_t i = 0; i < ops.size() && slot + 1U < Program::slots; ++i) {
    if (ops[i].kind == Op::Kind::sequence && !ops[i].is_quick && pays(ops, i + 1, ops[i].end)) {
      ops[i].slot = ++slot;
    }
  }
}

}  // namespace trestle::messages
