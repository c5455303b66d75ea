#pragma once
#include <cstdint>
#include <string>

namespace trestle::documents {

/// A place in a file, both from 1. Line 0 stands for the file as a whole.
struct Mark {
  int line = 0;
  int column = 0;
  friend constexpr bool operator==(const Mark&, const Mark&) = default;
};

/// A place in one of several files.
struct Place {
  std::uint32_t file = 0;  ///< index in a list of their names
  Mark mark{};
  friend bool operator==(const Place&, const Place&) = default;
};

/// One thing that is wrong, or looks wrong, in a file.
struct Problem {
  /// With an error, the file cannot be used. With a warning it can.
  enum class Severity : std::uint8_t { error, warning };
  Severity severity = Severity::error;
  std::string file;
  Mark mark;
  std::string text;  ///< one line: what is there, and what was expected
};

/// "bridge.yaml:12:5: error: ...", without a line end. A problem of the whole file has no line and column.
[[nodiscard]] std::string to_string(const Problem& problem);

}  // namespace trestle::documents
