#pragma once
#include <chrono>
#include <functional>
#include <memory>

#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::carry {

/// Has a route look at what has changed: at once, in a handler of its own. Where the last looks have led to
/// many changes, with a pause: each makes or ends something in DDS, which costs milliseconds in all programs
/// of the domain, and a peer can offer and withdraw a service a thousand times a second.
class CalmUpdates {
 public:
  static constexpr int at_once = 4;  ///< changes without a pause; then one in each `pause`
  static constexpr std::chrono::milliseconds pause{200};

  /// @param update  returns whether it has changed something. Not called once this object has ended.
  CalmUpdates(RouteClock& clock, std::function<bool()> update);
  CalmUpdates(const CalmUpdates&) = delete;
  CalmUpdates& operator=(const CalmUpdates&) = delete;

  /// Something has happened.
  void look_soon();
  /// Looks now, if that was due to be done soon and no pause holds it back: for a caller that cannot wait
  /// for the handler.
  void look_if_due();

 private:
  void look();

  RouteClock& clock_;
  std::function<bool()> update_;
  int changes_left_ = at_once;
  RouteClock::TimePoint filled_;  ///< when changes_left_ was last full, or raised by one
  std::unique_ptr<RouteTimer> look_;
};

}  // namespace trestle::carry
