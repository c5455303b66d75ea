#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "bridge/picture/picture.hpp"

namespace trestle::carry {

/// {"trestle":1,"program":"1.0",...}: one line, without a line end. Ids are numbers.
[[nodiscard]] std::string to_json(const Picture& picture);
/// What is missing there has its default; what is not known is passed over.
/// @return the picture, or why it is none of this version.
[[nodiscard]] tl::expected<Picture, std::string> picture_from_json(std::string_view json);

[[nodiscard]] const char* to_string(RouteState state) noexcept;

}  // namespace trestle::carry
