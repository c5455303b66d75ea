#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

namespace trestle::cli {

/// Escape sequences that colour what a person reads; all empty where they would be noise in a file or pipe.
struct Colours {
  const char* bold = "";
  const char* dim = "";
  const char* red = "";
  const char* green = "";
  const char* yellow = "";
  const char* off = "";
};

/// Whether somebody watches the terminal behind this file descriptor, one that understands escape sequences.
[[nodiscard]] bool is_terminal(int fd);

/// In character cells.
struct TerminalSize {
  std::size_t columns = 80;
  std::size_t rows = 24;
};
/// Of the terminal behind a file descriptor; the usual size when it doesn't tell.
[[nodiscard]] TerminalSize terminal_size(int fd);

/// The colours to use on a file descriptor: none unless it is a terminal, nor with NO_COLOR in the
/// environment.
[[nodiscard]] Colours colours_for(int fd);

/// "812 ns", "3.45 us", "12.3 ms", "1.20 s": three digits that matter.
[[nodiscard]] std::string duration_text(std::int64_t duration_ns);

}  // namespace trestle::cli
