#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <cstdint>
#include <functional>
#include <string>

#include "bridge/cli/on_signal.hpp"
#include "sd/net/busy_run.hpp"
#include "someip/wire/types.hpp"

namespace trestle::cli {

/// The loop of a command that talks to the network: it ends on SIGINT and SIGTERM, when the time is up, when
/// nobody reads the output any more, or when the command says so.
class Session {
 public:
  /// @param timeout_s  0: none.
  explicit Session(double timeout_s);

  /// Runs until finish().
  /// @param busy_poll  as in sd::run_busy().
  void run(Duration busy_poll = {}) { sd::run_busy(io, busy_poll); }
  void finish() { io.stop(); }
  [[nodiscard]] bool timed_out() const noexcept { return timed_out_; }

  /// Writes text to standard output at once; ends the session when that is closed.
  void print(const std::string& text);
  /// A line on standard error.
  static void note(const std::string& line);
  /// Likewise, a warning.
  static void warn(const std::string& line);
  /// note(), for what a Node tells of discovery.
  static std::function<void(const std::string& line)> log(bool quiet);

  /// Calls `tick` every `period`, for the first time after one.
  void every(Duration period, std::function<void()> tick);

  boost::asio::io_context io{1};

 private:
  void arm(Duration period);

  OnSignal stop_{io, {SIGINT, SIGTERM}, [this](int) { finish(); }};
  boost::asio::steady_timer timeout_{io};
  boost::asio::steady_timer ticker_{io};
  std::function<void()> tick_;
  bool timed_out_ = false;
};

}  // namespace trestle::cli
