#pragma once
#include <sys/types.h>

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trestle::measure::demo {

/// A process of the demo. It reports on its file descriptor 3; what it prints is kept for the case that it
/// fails. It cannot outlive this process: the kernel kills it when this one ends, however that comes.
class Child {
 public:
  /// The descriptor that the child reports on.
  static constexpr int report_fd = 3;

  /// Starts it.
  /// @param program  path of the program, also of a script.
  /// @throws std::system_error  it cannot be started.
  Child(std::string name, const std::string& program, const std::vector<std::string>& arguments);
  /// Kills it when it still runs.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] int reports() const noexcept { return report_.fd; }  ///< to poll; -1 when it has ended
  [[nodiscard]] int output() const noexcept { return output_.fd; }   ///< likewise

  /// Hands over the complete lines that it has reported.
  void read_reports(const std::function<void(std::string_view)>& on_line);
  /// Takes in what it has printed; `on_line` may be empty.
  void read_output(const std::function<void(std::string_view)>& on_line);

  /// Asks it to end: SIGINT, as Ctrl-C does.
  void stop();
  /// SIGKILL.
  void kill();
  /// Whether it has ended. Asks the system, without waiting.
  [[nodiscard]] bool ended();
  /// How it ended, in words; empty when it still runs, or ended well.
  [[nodiscard]] std::string fault() const;
  /// The last lines that it printed.
  [[nodiscard]] std::string last_output() const;

 private:
  struct Pipe {
    int fd = -1;
    std::string partial;  ///< a line that is not complete yet
  };
  static void read_lines(Pipe& pipe, const std::function<void(std::string_view)>& on_line);
  static void close_pipe(Pipe& pipe);

  std::string name_;
  pid_t pid_ = -1;
  Pipe report_;
  Pipe output_;
  std::deque<std::string> last_output_;
  bool asked_to_stop_ = false;
  std::optional<int> wait_status_;
};

}  // namespace trestle::measure::demo
