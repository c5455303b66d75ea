#pragma once
#include <cstddef>

/// For programs that allocations.cpp is part of: it replaces operator new by one that counts.
namespace trestle::test {

/// How often operator new was called so far. Not for several threads.
[[nodiscard]] std::size_t allocations();

/// How often it is called during `work`.
template <typename Work>
std::size_t allocations_of(Work work) {
  const std::size_t before = allocations();
  work();
  return allocations() - before;
}

}  // namespace trestle::test
