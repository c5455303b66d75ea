#pragma once
#include <cstddef>
#include <memory>
#include <memory_resource>
#include <mutex>

namespace trestle::someip {

/// Not std::pmr::synchronized_pool_resource: each takes one of a process's 1024 keys of thread-specific data.
class SharedPool {
 public:
  [[nodiscard]] void* allocate(std::size_t bytes, std::size_t alignment) {
    const std::lock_guard lock{mutex_};
    return pool_.allocate(bytes, alignment);
  }
  void deallocate(void* place, std::size_t bytes, std::size_t alignment) {
    const std::lock_guard lock{mutex_};
    pool_.deallocate(place, bytes, alignment);
  }

 private:
  std::mutex mutex_;
  std::pmr::unsynchronized_pool_resource pool_;
};

/// Memory for objects that come and go, kept for those that come next. Any thread may take and give back.
/// The memory lives as long as an allocator of it, thus as what std::allocate_shared() made with one.
template <typename T>
class PoolAllocator {
 public:
  using value_type = T;

  PoolAllocator() : pool_{std::make_shared<SharedPool>()} {}
  template <typename U>
  PoolAllocator(const PoolAllocator<U>& other) noexcept : pool_{other.pool_} {}  // NOLINT(*-explicit-*)

  [[nodiscard]] T* allocate(std::size_t number) {
    return static_cast<T*>(pool_->allocate(sizeof(T) * number, alignof(T)));
  }
  void deallocate(T* place, std::size_t number) noexcept {
    pool_->deallocate(place, sizeof(T) * number, alignof(T));
  }
  template <typename U>
  bool operator==(const PoolAllocator<U>& other) const noexcept {
    return pool_ == other.pool_;
  }

 private:
  template <typename U>
  friend class PoolAllocator;

  std::shared_ptr<SharedPool> pool_;
};

}  // namespace trestle::someip
