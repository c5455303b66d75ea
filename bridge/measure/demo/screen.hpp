#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <string>

#include "bridge/cli/terminal.hpp"
#include "bridge/measure/demo/figures.hpp"

namespace trestle::measure::demo {

/// The table of figures, many lines.
/// @param rate  shown in it: the one of now while running, that of the whole run at the end.
/// @param lost  likewise.
[[nodiscard]] std::string table(const Figures& figures, Figures::Rate rate, std::uint64_t lost,
                                const cli::Colours& colours);

/// The figures of now in one line, for files and pipes.
[[nodiscard]] std::string one_line(const Figures& figures, std::int64_t now_ns, std::chrono::seconds running);

/// Shows the demo on standard output: on a terminal one screen that is drawn again and again, otherwise
/// lines.
class Screen {
 public:
  /// @param title  what is shown above it, once.
  Screen(std::string title, bool is_terminal, cli::Colours colours);

  /// Something that happened.
  void log(const std::string& line);
  /// Called often; draws when it is time to.
  void update(const Figures& figures, std::int64_t now_ns);
  /// The last picture, which stays.
  void finish(const Figures& figures, const std::string& fault);

 private:
  void redraw(const std::string& text);

  std::string title_;
  bool is_terminal_;
  cli::Colours colours_;
  std::deque<std::string> last_logs_;
  std::size_t drawn_lines_ = 0;  ///< on the terminal, to be drawn over
  std::int64_t started_ns_ = -1;
  std::int64_t next_ns_ = 0;
};

}  // namespace trestle::measure::demo
