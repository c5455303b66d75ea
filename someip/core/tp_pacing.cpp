#include "someip/core/tp_pacing.hpp"

#include <algorithm>

namespace trestle::someip {
namespace {

constexpr std::size_t charged_bytes = 2304;     // that Linux counts for a full segment
constexpr std::size_t share = 2;                // of the requested size: a quarter of the real buffer
constexpr std::size_t untuned_bytes = 212'992;  // that Linux gives a socket without being asked

constexpr Duration period_of(const TpPacing& pacing) noexcept {
  return pacing.burst ? pacing.separation : pacing.separation / int{default_pieces};
}

}  // namespace

std::optional<std::size_t> burst_into(std::size_t receive_buffer_bytes, std::size_t least) noexcept {
  const std::size_t burst = std::clamp(receive_buffer_bytes / share / charged_bytes, least, most_burst);
  const bool as_untold = receive_buffer_bytes == 0 ||
                         (receive_buffer_bytes >= untuned_bytes && burst < default_pieces * default_piece);
  return as_untold ? std::nullopt : std::optional{burst};
}

std::optional<std::size_t> lesser_burst(const std::optional<std::size_t>& a,
                                        const std::optional<std::size_t>& b) noexcept {
  return a.value_or(default_burst) < b.value_or(default_burst) ? a : b;
}

std::size_t PaceWindow::room(const TpPacing& pacing, TimePoint now) noexcept {
  const std::size_t first = pacing.burst.value_or(default_burst);
  const std::size_t piece = pacing.burst.value_or(default_piece);
  const Duration period = period_of(pacing);
  while (now - begin_ >= period) {
    sent_ = std::min(sent_, first);  // another message may have had larger bursts
    if (sent_ <= piece) {
      // Counted from the previous burst, so that late timers do not slow the stream down more and more.
      begin_ = now - begin_ - period < period ? begin_ + period : now;
      sent_ = 0;
      is_first_ = true;
      break;
    }
    begin_ += period;
    sent_ -= piece;
    is_first_ = false;
  }
  // The first burst is made up for but for two pieces before the next one: the receiver may stand still, too.
  const std::size_t most = pacing.burst || is_first_ ? first : first - default_piece;
  return most - std::min(most, sent_);
}

TimePoint PaceWindow::resume(const TpPacing& pacing) const noexcept {
  const Duration period = period_of(pacing);
  return period < TimePoint::max() - begin_ ? begin_ + period : TimePoint::max();
}

}  // namespace trestle::someip
