#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>

#include "dds_adapter/service.hpp"

namespace trestle::carry {

/// Has the work() of a ROS service's client or server called on the thread that runs the io_context: when a
/// thread of DDS asks for it, and when something is due there.
class ServiceWork : public std::enable_shared_from_this<ServiceWork> {
 public:
  using Work = std::function<void(dds::TimePoint now)>;
  using Deadline = std::function<std::optional<dds::TimePoint>()>;

  /// To be held by a shared_ptr.
  ServiceWork(boost::asio::io_context& io, Work work, Deadline deadline);

  /// What DDS calls, on any thread; it may outlive this object.
  [[nodiscard]] std::function<void()> waker();
  /// To be called when the deadline may be another one.
  void arm();
  /// Nothing is called any more.
  void stop();

 private:
  void run();

  boost::asio::io_context& io_;
  Work work_;
  Deadline deadline_;
  boost::asio::steady_timer timer_;
  std::optional<dds::TimePoint> armed_;
  bool stopped_ = false;
};

}  // namespace trestle::carry
