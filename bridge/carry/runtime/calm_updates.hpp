#pragma once
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>

namespace trestle::carry {

/// Has a route look at what has changed: at once, in a handler of its own. Where the last looks have led to
/// many changes, with a pause: each makes or ends something in DDS, which costs milliseconds in all programs
/// of the domain, and a peer can offer and withdraw a service a thousand times a second.
class CalmUpdates {
 public:
  static constexpr int at_once = 4;  ///< changes without a pause; then one in each `pause`
  static constexpr std::chrono::milliseconds pause{200};

  /// @param update  returns whether it has changed something. Not called once this object has ended.
  CalmUpdates(boost::asio::io_context& io, std::function<bool()> update);
  ~CalmUpdates();
  CalmUpdates(const CalmUpdates&) = delete;
  CalmUpdates& operator=(const CalmUpdates&) = delete;

  /// Something has happened.
  void look_soon();

 private:
  using Clock = std::chrono::steady_clock;
  void look();

  boost::asio::io_context& io_;
  std::function<bool()> update_;
  bool soon_ = false;  ///< look() will be called
  int changes_left_ = at_once;
  Clock::time_point filled_ = Clock::now();  ///< when changes_left_ was last full, or raised by one
  boost::asio::steady_timer timer_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace trestle::carry
