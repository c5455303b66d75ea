#pragma once
#include <cstddef>
#include <memory>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::someip {

/// A TpReassembler with memory from the heap. A slot's pages are only taken from the system as segments fill
/// them, so generous limits cost nothing until they are needed.
class Reassembly {
 public:
  Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits);

  [[nodiscard]] TpReassembler& machine() noexcept { return *machine_; }
  [[nodiscard]] const TpReassembler& machine() const noexcept { return *machine_; }

 private:
  std::vector<std::unique_ptr<std::byte[]>> buffers_;
  std::vector<TpGap> gaps_;
  std::vector<TpSlot> slots_;
  std::optional<TpReassembler> machine_;
};

}  // namespace trestle::someip
