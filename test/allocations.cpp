#include "test/allocations.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {
#if defined(__unix__)
thread_local
#endif
    std::size_t count = 0;
}  // namespace

bool trestle::test::malloc_is_counted() {
#if defined(TRESTLE_COUNT_MALLOC)
  return true;
#else
  return false;
#endif
}

// NOLINTBEGIN(*-no-malloc, *-owning-memory, *-reserved-identifier, cert-dcl*, *-identifier-naming)
#if defined(TRESTLE_COUNT_MALLOC)

// The program's own functions go before those of the C library, which operator new calls as well.
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  ++count;
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  ++count;
  return __libc_calloc(number, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  ++count;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++count;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** place, std::size_t alignment, std::size_t size) noexcept {
  ++count;
  *place = __libc_memalign(alignment, size);
  return *place == nullptr ? 12 : 0;  // ENOMEM
}

}  // extern "C"

#else

// Sanitizers have a malloc() of their own, and boards another C library: there operator new is counted alone.
// All forms are here, as sanitizers bring those that are missing, and these would not call ours. Not inlined,
// or GCC would see free() called on what operator new gave, and warn.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++count;
  return std::malloc(size == 0 ? 1 : size);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* const memory = operator new(size, std::nothrow);
  if (memory == nullptr) {
    throw std::bad_alloc{};
  }
  return memory;
}
// An aligned place has the one that it is part of in front.
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto unit = static_cast<std::size_t>(alignment);
  auto* const memory = static_cast<std::byte*>(operator new(size + unit));
  std::byte* const place = memory + unit - reinterpret_cast<std::uintptr_t>(memory) % unit;
  std::memcpy(place - sizeof memory, &memory, sizeof memory);
  return place;
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment,
                                     const std::nothrow_t&) noexcept {
  return operator new(size, alignment);
}
[[gnu::noinline]] void* operator new[](std::size_t size) {
  return operator new(size);
}
[[gnu::noinline]] void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return operator new(size, std::nothrow);
}
[[gnu::noinline]] void* operator new[](std::size_t size, std::align_val_t alignment) {
  return operator new(size, alignment);
}
[[gnu::noinline]] void* operator new[](std::size_t size, std::align_val_t alignment,
                                       const std::nothrow_t&) noexcept {
  return operator new(size, alignment);
}

[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* place, std::align_val_t) noexcept {
  if (place != nullptr) {
    void* memory = nullptr;
    std::memcpy(&memory, static_cast<std::byte*>(place) - sizeof memory, sizeof memory);
    std::free(memory);
  }
}
[[gnu::noinline]] void operator delete(void* place, std::size_t, std::align_val_t alignment) noexcept {
  operator delete(place, alignment);
}
[[gnu::noinline]] void operator delete[](void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* place, std::align_val_t alignment) noexcept {
  operator delete(place, alignment);
}
[[gnu::noinline]] void operator delete[](void* place, std::size_t, std::align_val_t alignment) noexcept {
  operator delete(place, alignment);
}

#endif
// NOLINTEND(*-no-malloc, *-owning-memory, *-reserved-identifier, cert-dcl*, *-identifier-naming)

std::size_t trestle::test::allocations() {
  return count;
}
