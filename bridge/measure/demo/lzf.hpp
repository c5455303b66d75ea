#pragma once
#include "someip/wire/types.hpp"

namespace trestle::measure::demo {

/// Expands LZF-compressed bytes, as PCD files have them, into exactly the whole of `to`.
/// @return false when they are damaged, or more or fewer bytes come out.
[[nodiscard]] bool expand_lzf(ByteView from, ByteSpan to) noexcept;

}  // namespace trestle::measure::demo
