#include "bridge/cli/terminal.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace trestle::bridge {

bool is_terminal(int fd) {
  const char* kind = std::getenv("TERM");
  return isatty(fd) == 1 && kind != nullptr && std::string_view{kind} != "dumb";
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
          .cyan = "\033[36m",
          .off = "\033[0m"};
}

}  // namespace trestle::bridge
