#pragma once
#include <cstddef>

/// For programs that allocations_by.cpp is part of: it replaces malloc() and operator new by ones that count,
/// for all shared libraries too.
namespace trestle::test {

/// How often memory was asked for. The standard library does so for whoever calls it.
struct AllocationsBy {
  std::size_t ours = 0;    ///< by the code of the program: of Trestle, as it is linked in, and of the test
  std::size_t others = 0;  ///< by shared libraries, such as Fast DDS
};

/// What has been counted so far, of all threads.
[[nodiscard]] AllocationsBy allocations_by();

}  // namespace trestle::test
