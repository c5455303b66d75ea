#pragma once
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>

#include "bridge/carry/runtime/route_context.hpp"

namespace trestle::carry {

/// Has the work() of a ROS service's client or server called on the thread that runs the io_context: when a
/// thread of DDS asks for it, and when something is due there.
class ServiceWork : public std::enable_shared_from_this<ServiceWork> {
 public:
  using Work = std::function<void(dds::TimePoint now)>;
  using Deadline = std::function<std::optional<dds::TimePoint>()>;

  /// To be held by a shared_ptr.
  ServiceWork(const RouteContext& context, Work work, Deadline deadline);

  /// What DDS calls, on any thread; it may outlive this object.
  [[nodiscard]] std::function<void()> waker();
  /// To be called when the deadline may be another one.
  void arm();
  /// Nothing is called any more.
  void stop();

 private:
  void run();

  const RouteContext& context_;
  Work work_;
  Deadline deadline_;
  std::unique_ptr<RouteTimer> timer_;
  bool stopped_ = false;
};

}  // namespace trestle::carry
