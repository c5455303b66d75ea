#pragma once
#include <cassert>
#include <cstddef>
#include <span>
#include <utility>

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
  [[nodiscard]] T& operator[](std::size_t index) const noexcept {
    assert(index < size_);
    return room_[(head_ + index) % room_.size()];
  }

  /// There must be a free place.
  void push(const T& item) noexcept {
    assert(free_places() > 0);
    room_[(head_ + size_) % room_.size()] = item;
    ++size_;
  }
  /// The queue must not be empty.
  T pop() noexcept {
    assert(size_ > 0);
    T item = std::move(room_[head_]);
    head_ = (head_ + 1) % room_.size();
    --size_;
    return item;
  }
  /// Takes out all that `unwanted` is true for; the others keep their order.
  template <typename Unwanted>
  void remove_if(Unwanted unwanted) noexcept {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!unwanted(std::as_const((*this)[i]))) {
        if (kept != i) {
          (*this)[kept] = (*this)[i];
        }
        ++kept;
      }
    }
    size_ = kept;
  }
  void clear() noexcept { size_ = 0; }

 private:
  std::span<T> room_;
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace trestle::sd
