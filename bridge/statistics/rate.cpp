#include "bridge/statistics/rate.hpp"

#include <utility>

namespace trestle::statistics {

void Rate::note(TimePoint now, std::size_t bytes) noexcept {
  if (now_.count == 0 || now - now_.start >= window) {
    before_ = now - now_.start < 2 * window ? now_ : Window{};
    now_ = {.start = now};
  }
  ++now_.count;
  now_.bytes += bytes;
}

Rate::Value Rate::at(TimePoint now) const noexcept {
  if (now_.count == 0 || now - now_.start >= 2 * window) {
    return {};
  }
  const std::uint64_t count = now_.count + before_.count;
  const TimePoint start = before_.count > 0 ? before_.start : now_.start;
  const double seconds = std::chrono::duration<double>{now - start}.count();
  // A single one tells of no rate, and neither do a few that came just now.
  if (count < 2 || seconds < 0.1) {
    return {};
  }
  // The time begins with the first one, and ends somewhere between the last one and the next.
  const double rate = (static_cast<double>(count) - 0.5) / seconds;
  const double bytes_each = static_cast<double>(now_.bytes + before_.bytes) / static_cast<double>(count);
  return {.count = rate, .bytes = rate * bytes_each};
}

}  // namespace trestle::statistics
