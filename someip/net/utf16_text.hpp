#pragma once
#include <string>
#include <string_view>

namespace trestle::someip {

/// The same text in UTF-8. A lone surrogate, which is not valid, becomes something not valid either.
[[nodiscard]] std::string to_utf8(std::u16string_view text);

/// The same text in UTF-16, up to the first character that is not valid UTF-8.
[[nodiscard]] std::u16string to_utf16(std::string_view text);

}  // namespace trestle::someip
