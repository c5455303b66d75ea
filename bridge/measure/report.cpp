#include "bridge/measure/report.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

namespace trestle::measure {

namespace {

constexpr std::int64_t nanoseconds_per_second = 1'000'000'000;

std::int64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * nanoseconds_per_second + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_ns() {
  return clock_ns(CLOCK_MONOTONIC);
}
std::int64_t realtime_ns() {
  return clock_ns(CLOCK_REALTIME);
}

void Report::line(const nlohmann::json& event) {
  const std::string text = event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  const std::lock_guard lock{mutex_};
  std::size_t written = 0;
  while (written < text.size() && !closed_) {
    const ssize_t count = write(fd_, text.data() + written, text.size() - written);
    if (count > 0) {
      written += static_cast<std::size_t>(count);
    } else if (errno != EINTR) {
      closed_ = true;
    }
  }
}

bool Report::closed() {
  const std::lock_guard lock{mutex_};
  return closed_;
}

StopSignals::StopSignals() {
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  wakes_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wakes_ < 0) {
    throw std::system_error{errno, std::generic_category(), "eventfd"};
  }
}

StopSignals::~StopSignals() {
  close(wakes_);
}

bool StopSignals::wait_until(std::int64_t until_ns) {
  const std::int64_t left = std::max<std::int64_t>(until_ns - monotonic_ns(), 0);
  const timespec timeout{left / nanoseconds_per_second, left % nanoseconds_per_second};
  std::array<pollfd, 2> files{pollfd{signals_.fd(), POLLIN, 0}, pollfd{wakes_, POLLIN, 0}};
  if (!stopped_ && ppoll(files.data(), files.size(), &timeout, nullptr) > 0) {
    stopped_ = (files[0].revents & POLLIN) != 0;
    std::uint64_t count = 0;
    if ((files[1].revents & POLLIN) != 0 && read(wakes_, &count, sizeof(count)) < 0) {
      return stopped_;  // another reader was faster
    }
  }
  return stopped_;
}

void StopSignals::wake() const {
  const std::uint64_t one = 1;
  if (write(wakes_, &one, sizeof(one)) < 0) {
    return;  // the counter is full: the wait ends anyway
  }
}

}  // namespace trestle::measure
