#pragma once
#include <cassert>
#include <cstddef>
#include <iterator>
#include <span>
#include <utility>

#include "sd/core/events.hpp"

namespace trestle::sd {

/// What every slot of a Table begins with.
struct SlotBase {
  /// Whether the slot is taken.
  enum class State : std::uint8_t {
    empty,
    lost,  // nobody finds it any more, but its end is still to be told
    in_use,
  };
  static constexpr std::uint8_t no_loss = 0;

  /// Its end, or that of something it stands for, is to be told as soon as there is room for the event.
  void set_loss(LossReason reason) noexcept {
    loss = static_cast<std::uint8_t>(1U + static_cast<unsigned>(reason));
  }
  [[nodiscard]] LossReason loss_reason() const noexcept { return static_cast<LossReason>(loss - 1U); }

  std::uint16_t index = 0;
  std::uint16_t generation = 0;
  State slot_state = State::empty;
  std::uint8_t loss = no_loss;
};

/// What of a Table does not depend on the type of its slots, and so is in a program once.
class TableBase {
 public:
  void remove(SlotBase& slot) noexcept;
  /// Takes it out of what the table shows, but keeps what it says until remove().
  static void lose(SlotBase& slot, LossReason reason) noexcept {
    slot.slot_state = SlotBase::State::lost;
    slot.set_loss(reason);
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// All slots from this index on are empty.
  [[nodiscard]] std::size_t used_end() const noexcept { return used_end_; }
  [[nodiscard]] std::size_t free_slots() const noexcept;

 protected:
  TRESTLE_ONCE TableBase(void* slots, std::size_t size, std::size_t slot_bytes) noexcept
      : slots_{static_cast<std::byte*>(slots)},
        size_{static_cast<std::uint16_t>(size)},
        slot_bytes_{static_cast<std::uint16_t>(slot_bytes)} {
    assert(size < 0xffff);
  }

  [[nodiscard]] SlotBase& slot(std::size_t index) const noexcept {
    return *static_cast<SlotBase*>(static_cast<void*>(slots_ + index * slot_bytes_));
  }
  /// The first slot in this state or a later one, and the one after another; nothing when there is none.
  template <SlotBase::State state>
  TRESTLE_ONCE [[nodiscard]] SlotBase* first() const noexcept {
    return next(0, state);
  }
  template <SlotBase::State state>
  TRESTLE_ONCE [[nodiscard]] SlotBase* after(const SlotBase& slot) const noexcept {
    return next(std::size_t{slot.index} + 1, state);
  }
  /// Whether it is that of a slot in use.
  [[nodiscard]] bool is_valid(std::uint16_t index, std::uint16_t generation) const noexcept;
  /// Takes an empty slot; nothing when there is none.
  [[nodiscard]] SlotBase* take() noexcept;
  void take(SlotBase& empty, std::size_t index) noexcept;

  /// The one in use behind which all slots were searched last, or the first; nothing when there is none.
  TRESTLE_ONCE [[nodiscard]] SlotBase* first_to_search() const noexcept {
    SlotBase* const found = next(found_, SlotBase::State::in_use);
    return found != nullptr ? found : next(0, SlotBase::State::in_use);
  }
  TRESTLE_ONCE [[nodiscard]] SlotBase* next_to_search(const SlotBase& slot) const noexcept {
    SlotBase* const found = after<SlotBase::State::in_use>(slot);
    return found != nullptr ? found : next(0, SlotBase::State::in_use);
  }
  void note_found(const SlotBase& slot) const noexcept { found_ = slot.index; }

  std::byte* slots_;

 private:
  [[nodiscard]] SlotBase* next(std::size_t index, SlotBase::State state) const noexcept {
    for (; index < used_end_; ++index) {
      if (slot(index).slot_state >= state) {
        return &slot(index);
      }
    }
    return nullptr;
  }

  std::uint16_t size_;
  std::uint16_t slot_bytes_;
  std::uint16_t used_end_ = 0;
  mutable std::uint16_t found_ = 0;  // by the last search()
};

/// Slots in the caller's memory; walking over it meets those in use. Freeing a slot never moves another.
template <typename Slot>
class Table : public TableBase {
 public:
  explicit Table(std::span<Slot> slots) noexcept : TableBase{slots.data(), slots.size(), sizeof(Slot)} {}

  /// Stays valid whichever slots are freed.
  template <SlotBase::State state>
  class Iterator {
   public:
    TRESTLE_INLINE explicit Iterator(const Table& table) noexcept
        : table_{&table}, at_{table.template first<state>()} {}
    Slot& operator*() const noexcept { return static_cast<Slot&>(*at_); }
    TRESTLE_INLINE Iterator& operator++() noexcept {
      at_ = table_->template after<state>(*at_);
      return *this;
    }
    friend bool operator==(const Iterator& a, std::default_sentinel_t /*end*/) noexcept {
      return a.at_ == nullptr;
    }

   private:
    const Table* table_;
    SlotBase* at_;
  };

  // A table is a view, as a span is: its slots may be changed through a const one.
  TRESTLE_INLINE [[nodiscard]] auto begin() const noexcept {
    return Iterator<SlotBase::State::in_use>{*this};
  }
  [[nodiscard]] std::default_sentinel_t end() const noexcept { return {}; }

  /// Those in use, and those whose end is still to be told.
  class All {
   public:
    explicit All(const Table& table) noexcept : table_{&table} {}
    TRESTLE_INLINE [[nodiscard]] auto begin() const noexcept {
      return Iterator<SlotBase::State::lost>{*table_};
    }
    [[nodiscard]] std::default_sentinel_t end() const noexcept { return {}; }

   private:
    const Table* table_;
  };
  [[nodiscard]] All all() const noexcept { return All{*this}; }

  /// The first slot in use that `wanted` is true for; nothing when there is none.
  template <typename Wanted>
  [[nodiscard]] Slot* find_if(Wanted wanted) const noexcept {
    for (Slot& slot : *this) {
      if (wanted(slot)) {
        return &slot;
      }
    }
    return nullptr;
  }

  /// As find_if(), where one at most is wanted, unless `in_order`: begins at the one that was found last, for
  /// peers name things in the order in which they named them before.
  template <typename Wanted>
  [[nodiscard]] Slot* search(Wanted wanted, bool in_order = false) const noexcept {
    if constexpr (!optimised_for_many) {
      return find_if(wanted);
    }
    SlotBase* const first = in_order ? this->template first<SlotBase::State::in_use>() : first_to_search();
    for (SlotBase* at = first; at != nullptr;) {
      if (wanted(std::as_const(static_cast<Slot&>(*at)))) {
        note_found(*at);
        return static_cast<Slot*>(at);
      }
      at = next_to_search(*at);
      at = at == first ? nullptr : at;
    }
    return nullptr;
  }

  /// An empty slot, now in use; nothing when the table is full.
  TRESTLE_ONCE [[nodiscard]] Slot* add() noexcept {
    SlotBase* const taken = take();
    if (taken == nullptr) {
      return nullptr;
    }
    const SlotBase base = *taken;
    Slot& slot = static_cast<Slot&>(*taken);
    slot = Slot{};
    static_cast<SlotBase&>(slot) = base;
    return &slot;
  }

  /// An empty slot of the caller's choice, now in use.
  [[nodiscard]] Slot* add_at(Slot& slot) noexcept {
    take(slot, static_cast<std::size_t>(&slot - &(*this)[0]));
    const SlotBase base = static_cast<const SlotBase&>(slot);
    slot = Slot{};
    static_cast<SlotBase&>(slot) = base;
    return &slot;
  }

  [[nodiscard]] Slot& operator[](std::uint16_t index) const noexcept {
    return static_cast<Slot*>(static_cast<void*>(slots_))[index];
  }

  template <typename AnyHandle>
  [[nodiscard]] AnyHandle handle_of(const Slot& slot) const noexcept {
    return {slot.index, slot.generation};
  }
  /// The slot of a handle; nothing when it has been freed since.
  template <typename Tag>
  [[nodiscard]] Slot* find(Handle<Tag> handle) const noexcept {
    return is_valid(handle.index, handle.generation) ? &(*this)[handle.index] : nullptr;
  }
};

}  // namespace trestle::sd
