#include "bridge/messages/convert/program_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "bridge/messages/convert/conversion_plan.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

/// Numbers in one row of bits.
constexpr std::size_t max_packed_numbers = max_fields_per_type;

}  // namespace

std::uint64_t capped_times(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > std::numeric_limits<std::uint64_t>::max() / b
             ? std::numeric_limits<std::uint64_t>::max()
             : a * b;
}

bool ProgramBuilder::is_row() const {
  return program.ops.size() > barrier_ && program.ops.back().kind == Op::Kind::packed;
}

bool ProgramBuilder::is_row_open() const {
  return is_row() && !program.packed.back().empty() && row_bits() % 8 != 0;
}

std::uint32_t ProgramBuilder::row_bits() const {
  const PackedNumber& last = program.packed.back().back();
  return last.at + last.bits;
}

void ProgramBuilder::end_row() {
  if (is_row()) {
    close();
  }
}

Least ProgramBuilder::pack(PackedNumber number, std::uint64_t count, Label label) {
  if (!is_row()) {
    append({.kind = Op::Kind::packed,
            .members_at = static_cast<std::uint32_t>(program.packed.size()),
            .count = 0},
           std::move(label));
    program.packed.emplace_back();
  } else {
    label.first = program.ops.back().count;
    program.labels.back().push_back(std::move(label));
  }
  Op& op = program.ops.back();
  std::vector<PackedNumber>& row = program.packed.back();
  if (count > max_packed_numbers - row.size()) {
    complain_(fmt::format("more than {} numbers in one row of bits", max_packed_numbers));
    return {};
  }
  const Least least{capped_times(count, number.width), 0};
  const std::uint32_t before = op.fixed_bytes;
  for (std::uint64_t i = 0; i < count; ++i) {
    number.at = row.empty() ? 0 : row_bits();
    row.push_back(number);
  }
  op.count = row.size();
  op.fixed_bytes = (row_bits() + 7) / 8;
  return {least.cdr, op.fixed_bytes - before};
}

Least ProgramBuilder::run(Op op, std::uint64_t count, Label label) {
  const Least least{capped_times(count, op.width), capped_times(count, op.width)};
  if (program.ops.size() > barrier_) {
    Op& last = program.ops.back();
    if (last.kind == op.kind && last.width == op.width && last.other_order == op.other_order) {
      label.first = last.count;
      last.count += count;
      program.labels.back().push_back(std::move(label));
      return least;
    }
  }
  op.count = count;
  append(op, std::move(label));
  return least;
}

bool ProgramBuilder::has_fixed_size(std::size_t begin) const {
  return std::all_of(program.ops.begin() + static_cast<std::ptrdiff_t>(begin), program.ops.end(),
                     [](const Op& op) {
                       switch (op.kind) {
                         case Op::Kind::numbers:
                         case Op::Kind::bools:
                         case Op::Kind::bits:
                         case Op::Kind::packed:
                         case Op::Kind::repeat:
                         case Op::Kind::alternative:
                           return true;
                         case Op::Kind::field:
                           return !op.may_miss;
                         case Op::Kind::structure:
                         case Op::Kind::fixed_array:
                           return op.length == FieldWidth::none;
                         case Op::Kind::choice:
                           return op.length == FieldWidth::none && op.count != 0;
                         default:
                           return false;
                       }
                     });
}

std::optional<Op> ProgramBuilder::only_run(std::size_t loop) const {
  if (program.ops.size() != loop + 2) {
    return std::nullopt;
  }
  const Op& inner = program.ops.back();
  const bool is_run = inner.kind == Op::Kind::numbers || inner.kind == Op::Kind::bools;
  return is_run ? std::optional{inner} : std::nullopt;
}

void ProgramBuilder::append(const Op& op, Label label) {
  program.ops.push_back(op);
  program.labels.emplace_back().push_back(std::move(label));
}

void ProgramBuilder::drop_from(std::size_t op) {
  program.ops.resize(op);
  program.labels.resize(op);
}

}  // namespace trestle::messages
