#pragma once
#include <sys/types.h>

#include <deque>
#include <string>
#include <vector>

namespace trestle::interop {

/// A program that we talk to in lines, through its standard input and output.
class PeerProcess {
 public:
  /// @param errors  a file that takes its standard error.
  PeerProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment,
              const std::string& errors);
  /// Closes its input, and kills it if it has not ended soon after.
  ~PeerProcess();
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  void tell(const std::string& line);
  /// Takes what it has printed so far. Never waits.
  void read();
  /// All lines it has printed.
  [[nodiscard]] const std::deque<std::string>& lines() const noexcept { return lines_; }
  /// How many of its lines begin with this.
  [[nodiscard]] std::size_t count(const std::string& beginning) const;
  /// Whether it has ended by itself.
  [[nodiscard]] bool ended();
  /// Kills it at once and without warning, with all that it has started.
  void kill();

 private:
  pid_t pid_ = -1;
  bool ended_ = false;
  int in_ = -1;
  int out_ = -1;
  std::string part_;
  std::deque<std::string> lines_;
};

}  // namespace trestle::interop
