#pragma once
#include <spdlog/sinks/base_sink.h>

#include <mutex>
#include <string>

namespace trestle::test {

/// What has been logged, which may be asked for while others log.
class LogSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  [[nodiscard]] std::string str() {
    const std::lock_guard lock{mutex_};
    return text_;
  }
  [[nodiscard]] bool has(const std::string& part) { return str().find(part) != std::string::npos; }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    text_.append(line.data(), line.size());
  }
  void flush_() override {}

  std::string text_;
};

}  // namespace trestle::test
