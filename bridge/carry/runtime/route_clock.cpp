#include "bridge/carry/runtime/route_clock.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

namespace trestle::carry {
namespace {

class OwnTimer final : public RouteTimer {
 public:
  OwnTimer(boost::asio::io_context& io, std::function<void()> due)
      : timer_{io}, due_{std::make_shared<std::function<void()>>(std::move(due))} {}

  void set(TimePoint when) override {
    armed_ = when;
    timer_.expires_at(when);
    // One that is on its way already is not cancelled by Asio: it finds another time here.
    timer_.async_wait([this, when, weak = std::weak_ptr{due_}](const boost::system::error_code& cancelled) {
      const auto due = weak.lock();
      if (due && !cancelled && armed_ == when) {
        armed_.reset();
        (*due)();
      }
    });
  }
  void cancel() override {
    armed_.reset();
    timer_.cancel();
  }
  std::optional<TimePoint> armed() const override { return armed_; }

 private:
  boost::asio::steady_timer timer_;
  std::shared_ptr<std::function<void()>> due_;
  std::optional<TimePoint> armed_;
};

class OwnClock final : public RouteClock {
 public:
  explicit OwnClock(boost::asio::io_context& io) : io_{io} {}
  TimePoint now() const override { return std::chrono::steady_clock::now(); }
  std::chrono::nanoseconds since_1970() const override {
    return std::chrono::system_clock::now().time_since_epoch();
  }
  std::unique_ptr<RouteTimer> timer(std::function<void()> due) override {
    return std::make_unique<OwnTimer>(io_, std::move(due));
  }

 private:
  boost::asio::io_context& io_;
};

}  // namespace

std::unique_ptr<RouteClock> clock_of(boost::asio::io_context& io) {
  return std::make_unique<OwnClock>(io);
}

}  // namespace trestle::carry
