#undef _FORTIFY_SOURCE  // whose headers have these functions already
#include "test/copies.hpp"

#include <atomic>
#include <cstdint>

#include "bridge/messages/convert/program/byte_swap.hpp"

// From the linker: where the code of this program is.
extern "C" const char __executable_start;  // NOLINT
extern "C" const char etext;

namespace trestle::test {
namespace {

constexpr std::size_t counted_from = 1024;
std::atomic<std::size_t> ours{0};
std::atomic<std::size_t> others{0};

void count(std::size_t bytes, const void* caller) {
  if (bytes >= counted_from) {
    const auto at = reinterpret_cast<std::uintptr_t>(caller);
    const bool in_program = at >= reinterpret_cast<std::uintptr_t>(&__executable_start) &&
                            at < reinterpret_cast<std::uintptr_t>(&etext);
    (in_program ? ours : others).fetch_add(bytes, std::memory_order_relaxed);
  }
}

// The compiler must not make a call of memcpy out of these; the volatile pointers see to it.
void* copy_up(void* to, const void* from, std::size_t bytes) {
  auto* out = static_cast<volatile unsigned char*>(to);
  const auto* in = static_cast<const volatile unsigned char*>(from);
  for (std::size_t i = 0; i < bytes; ++i) {
    out[i] = in[i];
  }
  return to;
}

void* copy_down(void* to, const void* from, std::size_t bytes) {
  auto* out = static_cast<volatile unsigned char*>(to);
  const auto* in = static_cast<const volatile unsigned char*>(from);
  for (std::size_t i = bytes; i > 0; --i) {
    out[i - 1] = in[i - 1];
  }
  return to;
}

}  // namespace

Copies copies() {
  return {ours.load(), others.load()};
}

}  // namespace trestle::test

using namespace trestle::test;

extern "C" {

void* memcpy(void* to, const void* from, std::size_t bytes) {
  count(bytes, __builtin_return_address(0));
  return copy_up(to, from, bytes);
}

void* memmove(void* to, const void* from, std::size_t bytes) {
  count(bytes, __builtin_return_address(0));
  return to <= from ? copy_up(to, from, bytes) : copy_down(to, from, bytes);
}

// Our own, trestle::copy_bytes(): the linker puts this in its place.
void __wrap__ZN7trestle10copy_bytesEPSt4bytePKS0_mb(std::byte* to, const std::byte* from,  // NOLINT
                                                    std::size_t bytes, bool /*blocks*/) {
  count(bytes, __builtin_return_address(0));
  copy_up(to, from, bytes);
}

// Our own, trestle::messages::copy_swapped(), likewise; the second one is the name that it has then.
void __real__ZN7trestle8messages12copy_swappedEPSt4bytePKS1_mmNS0_7ShuffleE(
    std::byte* to,  // NOLINT
    const std::byte* from, std::size_t count, std::size_t width, trestle::messages::Shuffle shuffle);
void __wrap__ZN7trestle8messages12copy_swappedEPSt4bytePKS1_mmNS0_7ShuffleE(
    std::byte* to,  // NOLINT
    const std::byte* from, std::size_t numbers, std::size_t width, trestle::messages::Shuffle shuffle) {
  count(numbers * width, __builtin_return_address(0));
  __real__ZN7trestle8messages12copy_swappedEPSt4bytePKS1_mmNS0_7ShuffleE(to, from, numbers, width, shuffle);
}

// What the C library's headers make of them where the size of the destination is known.
void* __memcpy_chk(void* to, const void* from, std::size_t bytes, std::size_t /*room*/) {  // NOLINT
  count(bytes, __builtin_return_address(0));
  return copy_up(to, from, bytes);
}

void* __memmove_chk(void* to, const void* from, std::size_t bytes, std::size_t /*room*/) {  // NOLINT
  count(bytes, __builtin_return_address(0));
  return to <= from ? copy_up(to, from, bytes) : copy_down(to, from, bytes);
}
}
