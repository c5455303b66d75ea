#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "dds_adapter/copy_bytes.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// The bytes of a converted message in slices, to be sent or copied one after another.
///
/// Slices point into the conversion's input and into its ConversionScratch: they live until either the input
/// goes or the scratch is used again.
struct Gathered {
  std::span<const ByteView> slices;
  std::size_t bytes = 0;  ///< of all slices together
};

/// Copies all slices to `to`, which must have room for `gathered.bytes`.
inline void copy_to(const Gathered& gathered, std::byte* to) noexcept {
  for (const ByteView slice : gathered.slices) {
    copy_bytes(to, slice.data(), slice.size());
    to += slice.size();
  }
}

/// All slices in one piece of memory of its own.
[[nodiscard]] inline std::vector<std::byte> joined(const Gathered& gathered) {
  std::vector<std::byte> bytes;
  bytes.reserve(gathered.bytes);
  for (const ByteView slice : gathered.slices) {
    bytes.insert(bytes.end(), slice.begin(), slice.end());
  }
  return bytes;
}

}  // namespace trestle::messages
