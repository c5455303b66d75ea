#include "bridge/cli/session.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>

namespace trestle::cli {

Session::Session(double timeout_s) {
  // A closed pipe is noticed by print(), which lets offers and subscriptions be withdrawn.
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
      std::clearerr(stdout);  // no failure: the reader has enough
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

void Session::every(Duration period, std::function<void()> tick) {
  tick_ = std::move(tick);
  ticker_.expires_after(period);
  arm(period);
}

void Session::arm(Duration period) {
  ticker_.async_wait([this, period](const boost::system::error_code& error) {
    if (!error) {
      // From when it was due, so that being late does not add up; but what was missed is not made up for.
      ticker_.expires_at(std::max(ticker_.expiry() + period, std::chrono::steady_clock::now()));
      arm(period);
      tick_();
    }
  });
}

}  // namespace trestle::cli
