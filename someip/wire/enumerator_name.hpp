#pragma once
#include <array>
#include <cstddef>

namespace trestle::someip {

/// The name of an enumerator, in a table of all of them in their order.
/// @tparam last  the last one: a table with too few names, or too many, does not compile.
/// @return `other` for a value that is none of them.
template <auto last, std::size_t count>
[[nodiscard]] constexpr const char* enumerator_name(const std::array<const char*, count>& names,
                                                    decltype(last) value,
                                                    const char* other = "unknown") noexcept {
  static_assert(count == static_cast<std::size_t>(last) + 1);
  const auto index = static_cast<std::size_t>(value);
  return index < count ? names[index] : other;
}

}  // namespace trestle::someip
