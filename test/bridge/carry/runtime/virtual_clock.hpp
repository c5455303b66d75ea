#pragma once
#include <algorithm>
#include <utility>
#include <vector>

#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::test {

/// Time that passes only when a test says so.
class VirtualClock final : public carry::RouteClock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  [[nodiscard]] std::chrono::nanoseconds since_1970() const override {
    return std::chrono::hours{490'000} + now_.time_since_epoch();
  }
  [[nodiscard]] std::unique_ptr<carry::RouteTimer> timer(std::function<void()> due) override {
    return std::make_unique<Timer>(*this, std::move(due));
  }

  /// Calls back all that is due until then, each at its time.
  /// @param work  is done after each, and at the end.
  template <typename Work>
  void pass(std::chrono::nanoseconds time, const Work& work) {
    const TimePoint end = now_ + time;
    work();
    while (Timer* const next = first_due(end)) {
      now_ = std::max(now_, *next->armed());
      next->call_back();
      work();
    }
    now_ = end;
  }
  void pass(std::chrono::nanoseconds time) {
    pass(time, [] {});
  }
  /// How many timers wait.
  [[nodiscard]] std::ptrdiff_t armed() const {
    return std::ranges::count_if(timers_, [](const Timer* one) { return one->armed().has_value(); });
  }

 private:
  class Timer final : public carry::RouteTimer {
   public:
    Timer(VirtualClock& clock, std::function<void()> due) : clock_{clock}, due_{std::move(due)} {
      clock_.timers_.push_back(this);
    }
    ~Timer() override { std::erase(clock_.timers_, this); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    void set(TimePoint when) override { armed_ = when; }
    void cancel() override { armed_.reset(); }
    [[nodiscard]] std::optional<TimePoint> armed() const override { return armed_; }
    void call_back() {
      armed_.reset();
      const auto due = due_;  // which may end this timer
      due();
    }

   private:
    VirtualClock& clock_;
    std::function<void()> due_;
    std::optional<TimePoint> armed_;
  };

  // The first of all, or nothing if it is later than that.
  [[nodiscard]] Timer* first_due(TimePoint end) const {
    Timer* first = nullptr;
    for (Timer* const one : timers_) {
      if (one->armed() && *one->armed() <= end && (first == nullptr || *one->armed() < *first->armed())) {
        first = one;
      }
    }
    return first;
  }

  TimePoint now_{std::chrono::hours{1}};
  std::vector<Timer*> timers_;
};

}  // namespace trestle::test
