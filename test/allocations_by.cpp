#include "test/allocations_by.hpp"

#include <execinfo.h>
#include <link.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <new>

// From the linker: where the code of this program is.
extern "C" const char __executable_start;  // NOLINT
extern "C" const char etext;

namespace trestle::test {
namespace {

std::atomic<std::size_t> ours{0};
std::atomic<std::size_t> others{0};

struct Range {
  std::uintptr_t begin = 0;
  std::uintptr_t end = 0;
  [[nodiscard]] bool has(const void* place) const {
    const auto at = reinterpret_cast<std::uintptr_t>(place);
    return at >= begin && at < end;
  }
};

Range program() {
  return {reinterpret_cast<std::uintptr_t>(&__executable_start), reinterpret_cast<std::uintptr_t>(&etext)};
}

// Of the standard libraries; known once the program runs, before which nothing is counted.
std::array<Range, 2> libraries;
std::atomic<bool> counting{false};

// The program's libraries are loaded before it runs. The first backtrace() takes memory.
const bool known = [] {
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t /*size*/, void* /*data*/) {
        const bool cxx = std::strstr(info->dlpi_name, "libstdc++.so") != nullptr;
        if (cxx || std::strstr(info->dlpi_name, "libc.so") != nullptr) {
          Range& range = libraries[cxx ? 0 : 1];
          range.begin = info->dlpi_addr;
          for (int i = 0; i < info->dlpi_phnum; ++i) {
            const auto& part = info->dlpi_phdr[i];
            if (part.p_type == PT_LOAD) {
              range.end = info->dlpi_addr + part.p_vaddr + part.p_memsz;
            }
          }
        }
        return 0;
      },
      nullptr);
  std::array<void*, 4> frames{};
  backtrace(frames.data(), static_cast<int>(frames.size()));
  counting = true;
  return true;
}();

bool is_standard(const void* place) {
  return libraries[0].has(place) || libraries[1].has(place);
}

// Whoever called the standard library, if that is the caller.
bool is_ours(const void* caller) {
  if (!is_standard(caller)) {
    return program().has(caller);
  }
  std::array<void*, 24> frames{};
  const int number = backtrace(frames.data(), static_cast<int>(frames.size()));
  bool found = false;
  for (int i = 0; i < number; ++i) {
    const void* const frame = frames[static_cast<std::size_t>(i)];
    found = found || frame == caller;
    if (found && !is_standard(frame)) {
      return program().has(frame);
    }
  }
  return false;
}

void count(const void* caller) {
  if (counting.load(std::memory_order_relaxed)) {
    (is_ours(caller) ? ours : others).fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace

AllocationsBy allocations_by() {
  return {ours.load(), others.load()};
}

}  // namespace trestle::test

using namespace trestle::test;

// NOLINTBEGIN(*-no-malloc, *-owning-memory, *-reserved-identifier, cert-dcl*, *-identifier-naming)
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  count(__builtin_return_address(0));
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  count(__builtin_return_address(0));
  return __libc_calloc(number, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  count(__builtin_return_address(0));
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  count(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** place, std::size_t alignment, std::size_t size) noexcept {
  count(__builtin_return_address(0));
  *place = __libc_memalign(alignment, size);
  return *place == nullptr ? 12 : 0;  // ENOMEM
}

}  // extern "C"
// NOLINTEND(*-no-malloc, *-owning-memory, *-reserved-identifier, cert-dcl*, *-identifier-naming)
