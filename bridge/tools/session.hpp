#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "someip/wire/types.hpp"

namespace trestle::bridge {

/// The loop of a command that talks to the network: it ends on SIGINT and SIGTERM, when the time is up, when
/// nobody reads the output any more, or when the command says so.
class Session {
 public:
  /// @param timeout_s  0: none.
  explicit Session(double timeout_s);

  /// Runs until finish().
  void run() { io.run(); }
  void finish() { io.stop(); }
  [[nodiscard]] bool timed_out() const noexcept { return timed_out_; }

  /// Writes text to standard output at once; ends the session when that is closed.
  void print(const std::string& text);
  /// A line on standard error.
  static void note(const std::string& line);

  /// Calls `tick` every `period`, for the first time after one.
  void every(Duration period, std::function<void()> tick);

  boost::asio::io_context io{1};

 private:
  void arm(Duration period);

  boost::asio::signal_set stop_{io, SIGINT, SIGTERM};
  boost::asio::steady_timer timeout_{io};
  boost::asio::steady_timer ticker_{io};
  std::function<void()> tick_;
  bool timed_out_ = false;
};

}  // namespace trestle::bridge
