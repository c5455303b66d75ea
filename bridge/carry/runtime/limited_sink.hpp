#pragma once
#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>

#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "bridge/carry/runtime/log_budget.hpp"

namespace trestle::carry {

/// Hands to another sink what a LogBudget allows, and says what was left out: with the next line after it, or
/// when flushed. Nor does it wait for a reader that is too slow: see `takes`.
class LimitedSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  /// @param takes  whether the other sink takes a line without waiting. Lines are left out while it does not.
  explicit LimitedSink(std::shared_ptr<spdlog::sinks::sink> to, std::function<bool()> takes)
      : to_{std::move(to)}, takes_{std::move(takes)} {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (!takes_()) {
      ++unread_;
      return;
    }
    say_unread(message);
    const TimePoint now = std::chrono::steady_clock::now();
    say(budget_.left_out(now), message);
    if (budget_.take({message.payload.data(), message.payload.size()}, now,
                     message.level >= spdlog::level::err)) {
      to_->log(message);
    }
  }
  void flush_() override {
    if (!takes_()) {
      return;
    }
    spdlog::details::log_msg message;
    message.time = spdlog::log_clock::now();
    say_unread(message);
    say(budget_.left_out(), message);
    to_->flush();
  }
  void set_pattern_(const std::string& pattern) override { to_->set_pattern(pattern); }
  void set_formatter_(std::unique_ptr<spdlog::formatter> formatter) override {
    to_->set_formatter(std::move(formatter));
  }

 private:
  void say_unread(const spdlog::details::log_msg& like) {
    if (unread_ > 0) {
      say({fmt::format("{} lines of the log were left out here, because its reader was too slow", unread_)},
          like);
      unread_ = 0;
    }
  }
  void say(const std::vector<std::string>& lines, spdlog::details::log_msg like) {
    like.level = spdlog::level::warn;
    for (const std::string& line : lines) {
      like.payload = {line.data(), line.size()};
      to_->log(like);
    }
  }

  std::shared_ptr<spdlog::sinks::sink> to_;
  std::function<bool()> takes_;
  LogBudget budget_;
  std::uint64_t unread_ = 0;
};

}  // namespace trestle::carry
