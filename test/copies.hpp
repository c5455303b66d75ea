#pragma once
#include <cstddef>

/// For programs that copies.cpp is part of: it replaces memcpy and memmove by ones that count, for all shared
/// libraries too.
namespace trestle::test {

/// Bytes of copies of at least 1 KB each. Smaller ones are of headers and strings, not of payloads.
struct Copies {
  std::size_t ours = 0;    ///< by the code of the program: of Trestle, as it is linked in, and of the test
  std::size_t others = 0;  ///< by shared libraries, such as Fast DDS
};

/// What has been copied so far, by all threads.
[[nodiscard]] Copies copies();

/// How often `bytes` were copied: in whole copies, as headers and the like make a bit more.
[[nodiscard]] constexpr std::size_t times(std::size_t copied, std::size_t bytes) {
  return (copied + bytes / 20) / bytes;
}

}  // namespace trestle::test
