#include "bridge/carry/runtime/report.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

namespace trestle::carry {

Report::Report(int fd) : fd_{fd} {
  if (fd_ >= 0) {
    fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
  }
}

void Report::carried(const Carried& carried) {
  if (fd_ < 0) {
    return;
  }
  const auto ns = [](Clock::time_point when) { return when.time_since_epoch().count(); };
  line(fmt::format(
      R"({{"event":"carried","route":{},"direction":"{}","session":{},"before_ns":{},"after_ns":{},"source_ns":{},"bytes":{}}})",
      nlohmann::json(carried.topic).dump(), to_string(carried.direction), value(carried.session),
      ns(carried.before), ns(carried.after), carried.source_time.count(), carried.bytes));
}

void Report::discovery(std::string_view text) {
  if (fd_ >= 0) {
    line(nlohmann::ordered_json{{"event", "discovery"}, {"text", text}}.dump());
  }
}

void Report::line(std::string json) {
  if (fd_ < 0) {
    return;
  }
  json += '\n';
  // A pipe takes a line of at most PIPE_BUF bytes as a whole or not at all.
  if (write(fd_, json.data(), json.size()) != static_cast<ssize_t>(json.size())) {
    ++lines_left_out_;
  }
}

}  // namespace trestle::carry
