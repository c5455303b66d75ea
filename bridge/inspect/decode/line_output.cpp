#include "bridge/inspect/decode/line_output.hpp"

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string_view>
#include <system_error>

namespace trestle::inspect {
namespace {

constexpr std::size_t buffer_bytes = std::size_t{64} << 10U;

}  // namespace

LineOutput::LineOutput(int fd) : fd_{fd} {
  std::signal(SIGPIPE, SIG_IGN);
}

void LineOutput::print(const Json& object) {
  // JSON is UTF-8, but text from the network need not be.
  buffer_ += object.dump(-1, ' ', false, Json::error_handler_t::replace);
  buffer_ += '\n';
  if (buffer_.size() >= buffer_bytes) {
    flush();
  }
}

void LineOutput::flush() {
  for (std::string_view rest{buffer_}; !rest.empty() && !closed_;) {
    const ssize_t written = ::write(fd_, rest.data(), rest.size());
    if (written >= 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EPIPE) {
      closed_ = true;
    } else if (errno != EINTR) {
      throw std::system_error{errno, std::generic_category(), "cannot write the output"};
    }
  }
  buffer_.clear();
}

}  // namespace trestle::inspect
