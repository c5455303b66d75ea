#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// A queue in the caller's memory.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::span<T> room) noexcept : room_{room} {}

  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// How many more push() takes.
  [[nodiscard]] std::size_t free_places() const noexcept { return room_.size() - size_; }
  TRESTLE_ONCE [[nodiscard]] T& operator[](std::size_t index) const noexcept {
    assert(index < size_);
    const std::size_t at = head_ + index;
    return room_[at < room_.size() ? at : at - room_.size()];
  }

  /// The next free place, now the last of the queue, for the caller to fill; nothing when it is full.
  [[nodiscard]] T* append() noexcept {
    if (free_places() == 0) {
      return nullptr;
    }
    ++size_;
    return &(*this)[size_ - 1];
  }
  /// The queue must not be empty.
  T pop() noexcept {
    assert(size_ > 0);
    T item = std::move(room_[head_]);
    head_ = static_cast<std::uint32_t>((head_ + 1) % room_.size());
    --size_;
    return item;
  }
  /// Takes out all that `unwanted` is true for; the others keep their order.
  template <typename Unwanted>
  void remove_if(Unwanted unwanted) noexcept {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!unwanted(std::as_const((*this)[i]))) {
        keep(i, kept++);
      }
    }
    size_ = static_cast<std::uint32_t>(kept);
  }
  void clear() noexcept { size_ = 0; }

 private:
  TRESTLE_ONCE void keep(std::size_t index, std::size_t place) noexcept {
    if (index != place) {
      (*this)[place] = (*this)[index];
    }
  }

  std::span<T> room_;
  std::uint32_t head_ = 0;
  std::uint32_t size_ = 0;
};

}  // namespace trestle::sd
