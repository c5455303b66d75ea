#include "sd/core/table.hpp"

namespace trestle::sd {

SlotBase* TableBase::take() noexcept {
  for (std::uint16_t index = 0; index < size_; ++index) {
    SlotBase& empty = slot(index);
    if (!empty.in_use) {
      empty.index = index;
      empty.generation = static_cast<std::uint16_t>(empty.generation == 0xffff ? 1 : empty.generation + 1);
      empty.in_use = true;
      if (used_end_ <= index) {
        used_end_ = static_cast<std::uint16_t>(index + 1);
      }
      return &empty;
    }
  }
  return nullptr;
}

void TableBase::remove(SlotBase& slot_of_this) noexcept {
  slot_of_this.in_use = false;
  while (used_end_ > 0 && !slot(used_end_ - 1U).in_use) {
    --used_end_;
  }
}

std::size_t TableBase::free_slots() const noexcept {
  std::size_t free = 0;
  for (std::size_t index = 0; index < size_; ++index) {
    free += slot(index).in_use ? 0 : 1;
  }
  return free;
}

bool TableBase::is_valid(std::uint16_t index, std::uint16_t generation) const noexcept {
  return index < size_ && slot(index).in_use && slot(index).generation == generation;
}

}  // namespace trestle::sd
