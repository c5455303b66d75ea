#pragma once
#include <bit>
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle::bridge {

/// Writes UTF-8 as UTF-16.
/// @param to  room for twice the bytes of `utf8`.
/// @return bytes written, or nothing when `utf8` is not valid UTF-8 (overlong forms and surrogates included).
[[nodiscard]] std::optional<std::size_t> utf8_to_utf16(ByteView utf8, std::byte* to,
                                                       std::endian order) noexcept;

/// Writes UTF-16 as UTF-8.
/// @param utf16  an even number of bytes.
/// @param to  room for one and a half times the bytes of `utf16`.
/// @return bytes written, or nothing when `utf16` has a surrogate without its other half.
[[nodiscard]] std::optional<std::size_t> utf16_to_utf8(ByteView utf16, std::byte* to,
                                                       std::endian order) noexcept;

}  // namespace trestle::bridge
