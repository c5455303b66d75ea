#include "someip/core/tp_pacing.hpp"

#include <algorithm>

namespace trestle::someip {
namespace {

constexpr std::size_t charged_bytes = 2304;  // that Linux counts for a full segment
constexpr std::size_t share = 2;             // of the requested size: a quarter of the real buffer

}  // namespace

std::size_t burst_into(std::size_t receive_buffer_bytes, std::size_t least) noexcept {
  return receive_buffer_bytes == 0
             ? default_burst
             : std::clamp(receive_buffer_bytes / share / charged_bytes, least, most_burst);
}

std::size_t PaceWindow::room(const TpPacing& pacing, TimePoint now) noexcept {
  const Duration since = now - begin_;
  if (since >= pacing.separation) {
    // Counted from the previous burst, so that late timers do not slow the stream down more and more.
    begin_ = since - pacing.separation < pacing.separation ? begin_ + pacing.separation : now;
    sent_ = 0;
  }
  const std::size_t burst = pacing.burst.value_or(default_burst);
  return burst - std::min(burst, sent_);
}

TimePoint PaceWindow::resume(const TpPacing& pacing) const noexcept {
  return pacing.separation < TimePoint::max() - begin_ ? begin_ + pacing.separation : TimePoint::max();
}

}  // namespace trestle::someip
