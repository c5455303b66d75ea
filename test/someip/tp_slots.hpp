#pragma once
#include <deque>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::test {

/// The memory of a reassembler, on the heap.
class TpSlots {
 public:
  TpSlots(std::size_t max_messages, std::size_t max_message_bytes) {
    for (std::size_t i = 0; i < max_messages; ++i) {
      auto& buffer = buffers_.emplace_back(max_message_bytes);
      auto& map = maps_.emplace_back(someip::tp_map_words(max_message_bytes), 0xa5a5a5a5U);
      slots_.emplace_back(buffer, map);
    }
  }
  [[nodiscard]] std::span<someip::TpSlot> slots() noexcept { return slots_; }

 private:
  std::deque<std::vector<std::byte>> buffers_;
  std::deque<std::vector<std::uint32_t>> maps_;  ///< not cleared, as nobody need do
  std::vector<someip::TpSlot> slots_;
};

}  // namespace trestle::test
