#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/messages/convert/first_complaint.hpp"
#include "bridge/messages/convert/program/program.hpp"

namespace trestle::messages {

/// Fewest bytes of something on either side.
struct Least {
  std::uint64_t cdr = 0;
  std::uint64_t someip = 0;
};

/// The product, or the largest number if that is larger.
[[nodiscard]] std::uint64_t capped_times(std::uint64_t a, std::uint64_t b);

/// Puts the operations of a conversion program in a row, and joins neighbours that can be one operation.
class ProgramBuilder {
 public:
  ProgramBuilder(const someip::PayloadRules& rules, FirstComplaint& complain)
      : program{rules}, complain_{complain} {}

  Program program;

  void append(const Op& op, Label label);
  /// Takes back the last operations, from that one on.
  void drop_from(std::size_t op);
  /// Numbers or booleans like `op`; joined with the operation just before if that is of the same kind.
  Least run(Op op, std::uint64_t count, Label label);

  /// So many numbers in bits, behind those that were the last thing.
  Least pack(PackedNumber number, std::uint64_t count, Label label);
  /// Whether numbers in bits were the last thing, and ended within a byte.
  [[nodiscard]] bool is_row_open() const;
  /// What follows begins with a byte.
  void end_row();

  /// An operation around those that `body` appends.
  template <typename Body>
  Least enclosed(const Op& kind, const std::string& path, const Body& body) {
    const std::size_t op = program.ops.size();
    append(kind, {.path = path});
    close();
    Least least = body();
    program.ops[op].end = static_cast<std::uint32_t>(program.ops.size());
    close();
    least.someip += bytes(kind.length);
    return least;
  }

  struct Loop {
    std::size_t op;
    Least least;          ///< of one element
    std::size_t barrier;  ///< the barrier before the loop
  };
  /// An operation whose body, one element, `body` appends.
  template <typename Body>
  Loop loop(const Op& kind, const std::string& path, const Body& body) {
    const std::size_t before = barrier_;
    const std::size_t op = program.ops.size();
    append(kind, {.path = path});
    close();
    const Least least = body();
    program.ops[op].end = static_cast<std::uint32_t>(program.ops.size());
    program.ops[op].min_cdr = least.cdr;
    program.ops[op].min_someip = least.someip;
    close();  // nothing after the loop joins its body
    return {op, least, before};
  }
  /// The body of a loop, if it is a single run: then the loop can be a run itself.
  [[nodiscard]] std::optional<Op> only_run(std::size_t loop) const;

  /// Whether the operations from `begin` on always take the same number of bytes in SOME/IP.
  [[nodiscard]] bool has_fixed_size(std::size_t begin) const;

  /// All operations until now are complete: nothing joins them.
  void close() { barrier_ = program.ops.size(); }
  /// Operations from Loop::barrier on may be joined again.
  void reopen(std::size_t barrier) { barrier_ = barrier; }

 private:
  [[nodiscard]] bool is_row() const;
  [[nodiscard]] std::uint32_t row_bits() const;

  FirstComplaint& complain_;
  std::size_t barrier_ = 0;  ///< operations before this one are complete: nothing joins them
};

}  // namespace trestle::messages
