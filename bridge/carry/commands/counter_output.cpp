#include "bridge/carry/commands/counter_output.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <utility>

#include "bridge/carry/runtime/takes_at_once.hpp"

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

constexpr auto look_again = 100ms;  // whether somebody has read
constexpr auto last_patience = 2s;  // with a reader that reads nothing

}  // namespace

bool CounterOutput::write(std::string text) {
  if (written_ < text_.size()) {
    return false;
  }
  text_ = std::move(text);
  written_ = 0;
  write_rest();
  return true;
}

bool CounterOutput::finish(const std::string& text) {
  text_ += text;
  while (written_ < text_.size() && takes_at_once(fd_, last_patience)) {
    write_some();
  }
  return !failed_ && written_ == text_.size();
}

void CounterOutput::write_rest() {
  while (written_ < text_.size() && takes_at_once(fd_)) {
    write_some();
  }
  if (written_ < text_.size()) {
    retry_.expires_after(look_again);
    retry_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        write_rest();
      }
    });
  }
}

void CounterOutput::write_some() {
  const ssize_t size =
      ::write(fd_, text_.data() + written_, std::min<std::size_t>(text_.size() - written_, PIPE_BUF));
  if (size >= 0) {
    written_ += static_cast<std::size_t>(size);
  } else if (errno != EINTR && errno != EAGAIN) {
    failed_ = failed_ || errno != EPIPE;
    written_ = text_.size();
  }
}

}  // namespace trestle::carry
