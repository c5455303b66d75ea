#include "bridge/carry/runtime/service_work.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace trestle::carry {

ServiceWork::ServiceWork(const RouteContext& context, Work work, Deadline deadline)
    : context_{context},
      work_{std::move(work)},
      deadline_{std::move(deadline)},
      timer_{context.clock.timer([this] { run(); })} {}

std::function<void()> ServiceWork::waker() {
  return [&io = context_.io, weak = weak_from_this()] {
    boost::asio::post(io, [weak] {
      if (const auto self = weak.lock()) {
        self->run();
      }
    });
  };
}

void ServiceWork::run() {
  if (!stopped_) {
    work_(context_.clock.now());
    arm();
  }
}

void ServiceWork::arm() {
  const auto deadline = stopped_ ? std::nullopt : deadline_();
  if (deadline == timer_->armed()) {
    return;
  }
  if (deadline) {
    timer_->set(*deadline);
  } else {
    timer_->cancel();
  }
}

void ServiceWork::stop() {
  stopped_ = true;
  timer_->cancel();
}

}  // namespace trestle::carry
