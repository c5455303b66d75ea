#include "sd/core/device/memory.hpp"

#include <memory>

namespace trestle::device {

std::optional<MemoryView> lay_out(const Limits& limits, ByteSpan memory) noexcept {
  void* const begin = memory.data();
  std::size_t space = memory.size();
  void* first_aligned = begin;
  const bool fits = are_possible(limits) && memory.size() >= memory_bytes(limits) &&
                    std::align(memory_alignment, 0, first_aligned, space) == begin;
  if (!fits) {
    return std::nullopt;
  }
  MemoryView view;
  std::size_t end = 0;
  for_each_table(limits, view, [&]<typename Slot>(std::size_t count, std::span<Slot>& table) {
    end = aligned(end, alignof(Slot));
    void* const at = memory.data() + end;
    end += count * sizeof(Slot);
    auto* const slots = static_cast<Slot*>(at);
    if constexpr (std::is_default_constructible_v<Slot>) {
      std::uninitialized_value_construct_n(slots, count);
    }
    table = {slots, count};  // the TP slots are made below
  });
  const std::size_t map_words = someip::tp_map_words(limits.tp_buffer_bytes);
  for (std::size_t i = 0; i < limits.tp_buffers; ++i) {
    std::construct_at(&view.tp_slots[i],
                      view.tp_bytes.subspan(i * limits.tp_buffer_bytes, limits.tp_buffer_bytes),
                      view.tp_maps.subspan(i * map_words, map_words));
  }
  return view;
}

}  // namespace trestle::device
