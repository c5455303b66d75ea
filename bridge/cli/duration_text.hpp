#pragma once
#include <cstdint>
#include <string>

namespace trestle::cli {

/// "812 ns", "3.45 us", "12.3 ms", "1.20 s": three digits that matter.
[[nodiscard]] std::string duration_text(std::int64_t duration_ns);

}  // namespace trestle::cli
