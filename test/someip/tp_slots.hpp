#pragma once
#include <deque>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::test {

/// The memory of a reassembler, on the heap.
class TpSlots {
 public:
  TpSlots(std::size_t max_messages, std::size_t max_message_bytes, std::size_t max_gaps) {
    for (std::size_t i = 0; i < max_messages; ++i) {
      auto& buffer = buffers_.emplace_back(max_message_bytes);
      auto& gaps = gaps_.emplace_back(max_gaps);
      slots_.emplace_back(buffer, gaps);
    }
  }
  [[nodiscard]] std::span<someip::TpSlot> slots() noexcept { return slots_; }

 private:
  std::deque<std::vector<std::byte>> buffers_;
  std::deque<std::vector<someip::TpGap>> gaps_;
  std::vector<someip::TpSlot> slots_;
};

}  // namespace trestle::test
