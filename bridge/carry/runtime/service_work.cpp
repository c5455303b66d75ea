#include "bridge/carry/runtime/service_work.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace trestle::carry {

ServiceWork::ServiceWork(boost::asio::io_context& io, Work work, Deadline deadline)
    : io_{io}, work_{std::move(work)}, deadline_{std::move(deadline)}, timer_{io} {}

std::function<void()> ServiceWork::waker() {
  return [&io = io_, weak = weak_from_this()] {
    boost::asio::post(io, [weak] {
      if (const auto self = weak.lock()) {
        self->run();
      }
    });
  };
}

void ServiceWork::run() {
  if (!stopped_) {
    work_(std::chrono::steady_clock::now());
    arm();
  }
}

void ServiceWork::arm() {
  const auto deadline = stopped_ ? std::nullopt : deadline_();
  if (std::exchange(armed_, deadline) == deadline) {
    return;
  }
  if (!deadline) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*deadline);
  timer_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    if (const auto self = weak.lock(); self && !error) {
      self->armed_.reset();
      self->run();
    }
  });
}

void ServiceWork::stop() {
  stopped_ = true;
  timer_.cancel();
}

}  // namespace trestle::carry
