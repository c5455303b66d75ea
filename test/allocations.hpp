#pragma once
#include <cstddef>

/// For programs that allocations.cpp is part of: it counts the uses of operator new, and where neither a
/// sanitizer nor a board is in the way, of malloc() and the like.
namespace trestle::test {

/// Whether malloc() is counted, too.
[[nodiscard]] bool malloc_is_counted();

/// How often this thread has asked for memory so far.
[[nodiscard]] std::size_t allocations();

/// How often it is during `work`.
template <typename Work>
std::size_t allocations_of(Work work) {
  const std::size_t before = allocations();
  work();
  return allocations() - before;
}

}  // namespace trestle::test
