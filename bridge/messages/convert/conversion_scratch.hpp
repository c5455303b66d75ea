#pragma once
#include <cstddef>
#include <vector>

#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/quick/quick.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::messages {

/// Where a tagged member of the input stands, while the struct that holds it is converted.
struct MemberPlace {
  std::size_t at = 0;  ///< behind the tag
  std::size_t end = 0;
  someip::WireType type{};
  bool is_there = false;
};

/// Memory for conversions, one after another: for their results, and for what quick::Memory remembers of the
/// messages before. In steady state nothing is allocated.
///
/// Made once by the caller, for one thread; the members after reserve() are for the converters.
class ConversionScratch {
 public:
  /// Makes room for results of which `bytes` are copied, not referenced.
  void reserve(std::size_t bytes) { output_.reserve(bytes); }

  [[nodiscard]] Output& output() noexcept { return output_; }
  [[nodiscard]] quick::Memory& memory() noexcept { return memory_; }
  [[nodiscard]] const quick::Memory& memory() const noexcept { return memory_; }
  /// Places of the members of all structs that are being converted, the innermost struct's last.
  [[nodiscard]] std::vector<MemberPlace>& members() noexcept { return members_; }

 private:
  Output output_;
  quick::Memory memory_;
  std::vector<MemberPlace> members_;
};

}  // namespace trestle::messages
