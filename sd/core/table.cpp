#include "sd/core/table.hpp"

namespace trestle::sd {

SlotBase* TableBase::take() noexcept {
  for (std::uint16_t index = 0; index < size_; ++index) {
    SlotBase& empty = slot(index);
    if (empty.slot_state == SlotBase::State::empty) {
      take(empty, index);
      return &empty;
    }
  }
  return nullptr;
}

void TableBase::take(SlotBase& empty, std::size_t index) noexcept {
  empty.index = static_cast<std::uint16_t>(index);
  empty.generation = static_cast<std::uint16_t>(empty.generation == 0xffff ? 1 : empty.generation + 1);
  empty.slot_state = SlotBase::State::in_use;
  empty.loss = SlotBase::no_loss;
  if (used_end_ <= index) {
    used_end_ = static_cast<std::uint16_t>(index + 1);
  }
}

void TableBase::remove(SlotBase& slot_of_this) noexcept {
  slot_of_this.slot_state = SlotBase::State::empty;
  while (used_end_ > 0 && slot(used_end_ - 1U).slot_state == SlotBase::State::empty) {
    --used_end_;
  }
}

std::size_t TableBase::free_slots() const noexcept {
  std::size_t free = 0;
  for (std::size_t index = 0; index < size_; ++index) {
    free += slot(index).slot_state == SlotBase::State::empty ? 1 : 0;
  }
  return free;
}

bool TableBase::is_valid(std::uint16_t index, std::uint16_t generation) const noexcept {
  return index < size_ && slot(index).slot_state == SlotBase::State::in_use &&
         slot(index).generation == generation;
}

}  // namespace trestle::sd
