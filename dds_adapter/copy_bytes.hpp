#pragma once
#include <cstddef>

namespace trestle {

/// Whether this processor should rather not copy with the C library's memcpy.
extern const bool slow_memcpy;

/// As memcpy, for many bytes.
/// @param blocks  by a loop of our own, where the processor has what it takes.
void copy_bytes(std::byte* to, const std::byte* from, std::size_t size, bool blocks = slow_memcpy) noexcept;

}  // namespace trestle
