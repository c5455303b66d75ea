#pragma once
#include <array>
#include <limits>
#include <string>

#include "bridge/messages/convert/conversion_plan.hpp"

namespace trestle::messages {

/// Where and why a converter stopped. Kept in numbers until somebody wants to read it.
class Failure {
 public:
  static constexpr std::uint64_t no_element = std::numeric_limits<std::uint64_t>::max();

  /// @param op  of the program.
  /// @param element  the number within the operation, or no_element for the operation as a whole.
  /// @return false, for the converter to return.
  bool set(ConversionFault fault, std::size_t offset, std::size_t op,
           std::uint64_t element = no_element) noexcept {
    fault_ = fault;
    offset_ = offset;
    op_ = op;
    element_ = element;
    return false;
  }

  /// Called by each loop that is left because of the failure, the innermost first.
  bool in_loop(std::uint64_t index) noexcept {
    if (loops_ < indices_.size()) {
      indices_[loops_++] = index;
    }
    return false;
  }

  /// @param to_cdr  the direction.
  /// @param in      the input that offsets count in, up to where what is at fault would have to end.
  [[nodiscard]] ConversionError error(const Program& program, bool to_cdr, ByteView in) const;

 private:
  ConversionFault fault_ = ConversionFault::truncated;
  std::size_t offset_ = 0;
  std::size_t op_ = 0;
  std::uint64_t element_ = no_element;
  std::size_t loops_ = 0;
  // Twice max_type_depth: a message has at most one loop to the next. Only what has been set is read.
  std::array<std::uint64_t, 64> indices_;  // NOLINT(cppcoreguidelines-pro-type-member-init)
};

/// What is wrong with a message as a whole, from its first byte on.
[[nodiscard]] ConversionError error_of_message(const Program& program, ConversionFault fault, bool to_cdr,
                                               ByteView in);

}  // namespace trestle::messages
