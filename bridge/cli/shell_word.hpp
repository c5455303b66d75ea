#pragma once
#include <string>
#include <string_view>

namespace trestle::cli {

/// The text in single quotes, as bash, zsh and fish take it. Fish alone would also read a backslash in them.
[[nodiscard]] std::string shell_quoted(std::string_view text);
/// The text as one word of a command that somebody copies into a shell: in quotes where it needs them.
[[nodiscard]] std::string shell_word(std::string_view text);

}  // namespace trestle::cli
