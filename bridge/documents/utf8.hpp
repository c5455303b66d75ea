#pragma once
#include <optional>
#include <string>

#include "bridge/documents/problem.hpp"

namespace trestle::documents {

/// Makes UTF-8 of the text of a file. Old editors write "Größe" in Windows-1252 or ISO 8859-1, so that a byte
/// which is not UTF-8 is taken as a character of these. What begins like UTF-16 stays as it is.
/// @return where the first such byte is, its column counted in bytes; nothing: there is none, and the text is
///         as before.
[[nodiscard]] std::optional<Mark> make_utf8(std::string& text);

/// The same, with a warning about the first such byte.
/// @param file  its name.
[[nodiscard]] std::optional<Problem> make_utf8(std::string& text, const std::string& file);

}  // namespace trestle::documents
