#include "bridge/cli/session.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>

namespace trestle::cli {

Session::Session(double timeout_s) {
  // print() notices a closed pipe, so that offers and subscriptions can still be withdrawn.
  std::signal(SIGPIPE, SIG_IGN);
  if (timeout_s > 0) {
    timeout_.expires_after(std::chrono::duration_cast<Duration>(std::chrono::duration<double>{timeout_s}));
    timeout_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        timed_out_ = true;
        finish();
      }
    });
  }
}

void Session::print(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  if (std::fflush(stdout) != 0) {
    if (errno == EPIPE) {
      std::clearerr(stdout);  // not a failure: the reader wants no more
    }
    finish();
  }
}

void Session::note(const std::string& line) {
  std::fprintf(stderr, "%s\n", line.c_str());
}

void Session::warn(const std::string& line) {
  note("warning: " + line);
}

std::function<void(const std::string& line)> Session::log(bool quiet) {
  return [quiet](const std::string& line) {
    if (!quiet) {
      note(line);
    }
  };
}

void Session::every(Duration period, std::function<void()> tick) {
  tick_ = std::move(tick);
  ticker_.expires_after(period);
  arm(period);
}

void Session::arm(Duration period) {
  ticker_.async_wait([this, period](const boost::system::error_code& error) {
    if (!error) {
      // Counted from the time when it was due, so that delays do not add up; missed ticks are not made up
      // for.
      ticker_.expires_at(std::max(ticker_.expiry() + period, std::chrono::steady_clock::now()));
      arm(period);
      tick_();
    }
  });
}

}  // namespace trestle::cli
