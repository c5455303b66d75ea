#include "bridge/cli/duration_text.hpp"

#include <fmt/format.h>

#include <array>

namespace trestle::cli {

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
