#include "bridge/carry/runtime/loop_guard.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <utility>

namespace trestle::carry {
namespace {

constexpr std::chrono::seconds pause_between_lines{10};

std::unique_lock<std::mutex> held(std::mutex* mutex) {
  return mutex != nullptr ? std::unique_lock{*mutex} : std::unique_lock<std::mutex>{};
}

}  // namespace

LoopGuard::LoopGuard(boost::asio::io_context& io, std::string what, const LoopCheck::Limits& limits,
                     std::mutex* mutex)
    : what_{std::move(what)}, mutex_{mutex}, check_{limits}, timer_{io} {}

LoopGuard::~LoopGuard() = default;

void LoopGuard::arm() {
  if (armed_) {
    return;
  }
  {
    const auto lock = held(mutex_);
    if (!check_.deadline()) {
      return;
    }
    timer_.expires_at(*check_.deadline());
  }
  armed_ = true;
  timer_.async_wait([this, alive = std::weak_ptr{alive_}](const boost::system::error_code& cancelled) {
    if (!cancelled && !alive.expired()) {
      judge();
    }
  });
}

void LoopGuard::judge() {
  armed_ = false;
  const auto now = std::chrono::steady_clock::now();
  std::string through;
  {
    const auto lock = held(mutex_);
    if (!check_.judge(now)) {
      on_trial_ = check_.deadline().has_value();
      return;
    }
    on_trial_ = false;
    through = through_;
  }
  if (!told_ || now - *told_ >= pause_between_lines) {
    told_ = now;
    spdlog::error(
        "{}: this route seems to loop through {}: what it carries comes back from there. It is kept from "
        "going round for long, and counted as `looped`; end the ring (docs/several_bridges.md)",
        what_, through);
  }
}

}  // namespace trestle::carry
