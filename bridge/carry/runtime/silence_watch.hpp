#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/carry/runtime/route_clock.hpp"
#include "bridge/picture/causes.hpp"

namespace trestle::carry {

/// Says why nothing comes on a route: 5 s after the start, and then every 5 s what has changed. For routes
/// that begin later, after 5 to 10 s; for routes on which something came before, when no sender is left. It
/// writes only some lines, however many routes there are: routes with the same cause share a line.
/// On the thread that runs the io_context, with one timer for all.
class SilenceWatch {
 public:
  static constexpr std::chrono::seconds period{5};
  /// Of one look, beside one for each cause.
  static constexpr std::size_t most_lines = 5;

  /// A route, as it is looked at.
  struct Watched {
    std::string topic;
    std::function<std::uint64_t()> received;  ///< how many messages have come
    std::function<RoutePicture()> picture;
    std::uint64_t before = 0;  ///< messages, at the last look
    Why told{};
    bool is_new = false;  ///< too short a time there to be told of
  };

  /// @param prepare  is called before the pictures of a look are asked for, and gives what is around them
  /// all.
  /// @param tell  a line for the log.
  SilenceWatch(RouteClock& clock, std::function<const Picture&()> prepare,
               std::function<void(const std::string&)> tell)
      : prepare_{std::move(prepare)}, tell_{std::move(tell)}, clock_{clock}, next_look_{clock.timer([this] {
          look();
          arm();
        })} {}
  SilenceWatch(const SilenceWatch&) = delete;
  SilenceWatch& operator=(const SilenceWatch&) = delete;

  void add(Watched route) {
    route.is_new = started_;
    routes_.push_back(std::move(route));
    arm();
  }
  /// Of a route that ends.
  void remove(const std::string& topic);
  void start() {
    started_ = true;
    arm();
  }
  void stop() {
    started_ = false;
    routes_.clear();
    next_look_->cancel();
  }

 private:
  void look();
  void arm();

  std::function<const Picture&()> prepare_;
  std::function<void(const std::string&)> tell_;
  std::vector<Watched> routes_;
  bool started_ = false;
  const RouteClock& clock_;
  const std::unique_ptr<RouteTimer> next_look_;
};

}  // namespace trestle::carry
