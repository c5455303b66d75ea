#include "bridge/cli/terminal.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string_view>

namespace trestle::cli {

bool is_terminal(int fd) {
  const char* kind = std::getenv("TERM");
  return isatty(fd) == 1 && kind != nullptr && std::string_view{kind} != "dumb";
}

TerminalSize terminal_size(int fd) {
  winsize size{};
  if (ioctl(fd, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return {};
  }
  return {size.ws_col, size.ws_row};
}

Colours colours_for(int fd) {
  // https://no-color.org: present and not empty.
  const char* no_color = std::getenv("NO_COLOR");
  if (!is_terminal(fd) || (no_color != nullptr && *no_color != '\0')) {
    return {};
  }
  return {.bold = "\033[1m",
          .dim = "\033[2m",
          .red = "\033[31m",
          .green = "\033[32m",
          .yellow = "\033[33m",
          .off = "\033[0m"};
}

std::string duration_text(std::int64_t duration_ns) {
  struct Unit {
    double size;
    const char* name;
  };
  constexpr std::array<Unit, 3> units{{{1e9, "s"}, {1e6, "ms"}, {1e3, "us"}}};
  const auto value = static_cast<double>(duration_ns);
  for (const Unit& unit : units) {
    // A value that would be rounded up to 1000 of the smaller unit is written as 1.00 of this one.
    if (value >= unit.size * 0.9995) {
      const double shown = value / unit.size;
      return fmt::format("{:.{}f} {}", shown, shown < 9.995 ? 2 : shown < 99.95 ? 1 : 0, unit.name);
    }
  }
  return fmt::format("{} ns", duration_ns);
}

}  // namespace trestle::cli
