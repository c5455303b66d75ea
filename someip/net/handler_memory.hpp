#pragma once
#include <array>
#include <boost/asio/bind_allocator.hpp>
#include <cstddef>
#include <new>
#include <utility>

namespace trestle::someip {

/// Memory for one operation of Asio at a time, for those that begin again and again: Asio itself keeps that
/// of two for all, and takes it from the heap when others are under way in between.
class HandlerMemory {
 public:
  HandlerMemory() = default;
  HandlerMemory(const HandlerMemory&) = delete;
  HandlerMemory& operator=(const HandlerMemory&) = delete;

  template <typename T>
  struct Allocator {
    using value_type = T;
    explicit Allocator(HandlerMemory& from) noexcept : memory{&from} {}
    template <typename U>
    Allocator(const Allocator<U>& other) noexcept : memory{other.memory} {}  // NOLINT(*-explicit-*)
    [[nodiscard]] T* allocate(std::size_t number) {
      return static_cast<T*>(memory->allocate(sizeof(T) * number));
    }
    void deallocate(T* place, std::size_t /*number*/) noexcept { memory->deallocate(place); }
    template <typename U>
    bool operator==(const Allocator<U>& other) const noexcept {
      return memory == other.memory;
    }
    HandlerMemory* memory;
  };

  /// The handler, which has to keep this object alive, with its operation in this memory.
  template <typename Handler>
  [[nodiscard]] auto hold(Handler&& handler) {
    return boost::asio::bind_allocator(Allocator<std::byte>{*this}, std::forward<Handler>(handler));
  }

 private:
  [[nodiscard]] void* allocate(std::size_t bytes) {
    if (used_ || bytes > room_.size()) {
      return ::operator new(bytes);
    }
    used_ = true;
    return room_.data();
  }
  void deallocate(void* place) noexcept {
    if (place == room_.data()) {
      used_ = false;
    } else {
      ::operator delete(place);
    }
  }

  alignas(std::max_align_t) std::array<std::byte, 256> room_;
  bool used_ = false;
};

}  // namespace trestle::someip
