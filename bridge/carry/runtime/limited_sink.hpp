#pragma once
#include <spdlog/sinks/base_sink.h>

#include <memory>
#include <mutex>
#include <utility>

#include "bridge/carry/runtime/log_budget.hpp"

namespace trestle::carry {

/// Hands to another sink what a LogBudget allows, and says what was left out: with the next line after it, or
/// when flushed.
class LimitedSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit LimitedSink(std::shared_ptr<spdlog::sinks::sink> to) : to_{std::move(to)} {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const TimePoint now = std::chrono::steady_clock::now();
    say(budget_.left_out(now), message);
    if (budget_.take({message.payload.data(), message.payload.size()}, now)) {
      to_->log(message);
    }
  }
  void flush_() override {
    spdlog::details::log_msg message;
    message.time = spdlog::log_clock::now();
    say(budget_.left_out(), message);
    to_->flush();
  }
  void set_pattern_(const std::string& pattern) override { to_->set_pattern(pattern); }
  void set_formatter_(std::unique_ptr<spdlog::formatter> formatter) override {
    to_->set_formatter(std::move(formatter));
  }

 private:
  void say(const std::vector<std::string>& lines, spdlog::details::log_msg like) {
    like.level = spdlog::level::warn;
    for (const std::string& line : lines) {
      like.payload = {line.data(), line.size()};
      to_->log(like);
    }
  }

  std::shared_ptr<spdlog::sinks::sink> to_;
  LogBudget budget_;
};

}  // namespace trestle::carry
