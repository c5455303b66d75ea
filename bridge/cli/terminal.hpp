#pragma once
#include <cstddef>

namespace trestle::cli {

/// Escape sequences that colour what a person reads; all empty where they would be noise in a file or pipe.
struct Colours {
  const char* bold = "";
  const char* dim = "";
  const char* red = "";
  const char* green = "";
  const char* yellow = "";
  const char* cyan = "";
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

}  // namespace trestle::cli
