#pragma once
#include <algorithm>
#include <cassert>
#include <cstddef>
#include <iterator>
#include <span>

#include "sd/core/events.hpp"

namespace trestle::sd {

/// What every slot of a Table begins with.
struct SlotBase {
  bool in_use = false;
  std::uint16_t generation = 0;
};

/// Slots in the caller's memory, taken and freed; walking over it meets those in use.
/// Its size never changes, and freeing a slot never moves another.
template <typename Slot>
class Table {
 public:
  explicit Table(std::span<Slot> slots) noexcept : slots_{slots} { assert(slots.size() < 0xffff); }

  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Slot;
    using difference_type = std::ptrdiff_t;
    using pointer = Slot*;
    using reference = Slot&;

    Iterator(Slot* at, Slot* end) noexcept : at_{at}, end_{end} { skip_unused(); }
    Slot& operator*() const noexcept { return *at_; }
    Iterator& operator++() noexcept {
      ++at_;
      skip_unused();
      return *this;
    }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }

   private:
    void skip_unused() noexcept {
      while (at_ != end_ && !at_->in_use) {
        ++at_;
      }
    }
    Slot* at_;
    Slot* end_;
  };

  // A table is a view, as a span is: its slots may be changed through a const one.
  [[nodiscard]] Iterator begin() const noexcept { return {slots_.data(), slots_.data() + used_end_}; }
  [[nodiscard]] Iterator end() const noexcept {
    return {slots_.data() + used_end_, slots_.data() + used_end_};
  }

  /// An empty slot, now in use; nothing when the table is full.
  [[nodiscard]] Slot* add() noexcept {
    const auto free = std::ranges::find(slots_, false, &Slot::in_use);
    if (free == slots_.end()) {
      return nullptr;
    }
    const auto generation = static_cast<std::uint16_t>(free->generation == 0xffff ? 1 : free->generation + 1);
    *free = Slot{};
    free->in_use = true;
    free->generation = generation;
    used_end_ = std::max(used_end_, static_cast<std::size_t>(free - slots_.begin()) + 1);
    return &*free;
  }

  void remove(Slot& slot) noexcept {
    slot.in_use = false;
    while (used_end_ > 0 && !slots_[used_end_ - 1].in_use) {
      --used_end_;
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return slots_.size(); }
  [[nodiscard]] std::size_t free_slots() const noexcept {
    return static_cast<std::size_t>(std::ranges::count(slots_, false, &Slot::in_use));
  }
  [[nodiscard]] Slot& operator[](std::uint16_t index) const noexcept { return slots_[index]; }
  [[nodiscard]] std::uint16_t index_of(const Slot& slot) const noexcept {
    return static_cast<std::uint16_t>(&slot - slots_.data());
  }

  template <typename AnyHandle>
  [[nodiscard]] AnyHandle handle_of(const Slot& slot) const noexcept {
    return {index_of(slot), slot.generation};
  }
  /// The slot of a handle; nothing when it has been freed since.
  template <typename Tag>
  [[nodiscard]] Slot* find(Handle<Tag> handle) const noexcept {
    if (handle.index >= slots_.size()) {
      return nullptr;
    }
    Slot& slot = slots_[handle.index];
    return slot.in_use && slot.generation == handle.generation ? &slot : nullptr;
  }

 private:
  std::span<Slot> slots_;
  std::size_t used_end_ = 0;  // no slot from here on is in use
};

}  // namespace trestle::sd
