#include "bridge/carry/runtime/calm_updates.hpp"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <utility>

namespace trestle::carry {

CalmUpdates::CalmUpdates(boost::asio::io_context& io, std::function<bool()> update)
    : io_{io}, update_{std::move(update)}, timer_{io} {}

CalmUpdates::~CalmUpdates() = default;

void CalmUpdates::look_soon() {
  if (std::exchange(soon_, true)) {
    return;
  }
  const auto now = Clock::now();
  const auto grown = std::min<Clock::rep>((now - filled_) / pause, at_once - changes_left_);
  changes_left_ += static_cast<int>(grown);
  filled_ = changes_left_ == at_once ? now : filled_ + grown * pause;
  const auto run = [this, alive = std::weak_ptr{alive_}] {
    if (!alive.expired()) {
      look();
    }
  };
  if (changes_left_ > 0) {
    boost::asio::post(io_, run);
    return;
  }
  timer_.expires_at(filled_ + pause);
  timer_.async_wait([run](const boost::system::error_code& cancelled) {
    if (!cancelled) {
      run();
    }
  });
}

void CalmUpdates::look() {
  soon_ = false;
  const std::weak_ptr alive{alive_};
  if (update_() && !alive.expired()) {
    --changes_left_;
  }
}

}  // namespace trestle::carry
