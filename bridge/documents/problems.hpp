#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/documents/problem.hpp"

namespace YAML {
struct Mark;
}

namespace trestle::documents {

/// A place in the file, counted from 1, from one of yaml-cpp's, which counts from 0.
[[nodiscard]] Mark to_mark(const YAML::Mark& mark);

/// With control characters spelt out, so that a message stays one line and cannot steer a terminal.
[[nodiscard]] std::string printable(std::string_view text);
/// A piece of the file, quoted for a message: short and printable whatever it holds.
[[nodiscard]] std::string quote(std::string_view text);

/// Gathers what is wrong with one file.
class Problems {
 public:
  explicit Problems(std::string file) : file_{std::move(file)} {}

  void error(Mark mark, std::string text);
  void warning(Mark mark, std::string text);
  [[nodiscard]] bool has_errors() const noexcept { return errors_ > 0; }
  /// Everything gathered, in the file's order. What is wrong with an anchored piece is said once, however
  /// often it is used.
  [[nodiscard]] std::vector<Problem> take();

 private:
  std::string file_;
  std::vector<Problem> problems_;
  std::size_t errors_ = 0;
};

}  // namespace trestle::documents
