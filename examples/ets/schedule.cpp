#include "ets/schedule.hpp"

#include <algorithm>

#include <trestle/someip/wire/payload_reader.hpp>

namespace ets {

using std::chrono::milliseconds;

void Schedule::trigger(const Trigger& what, ByteView parameters, TimePoint now) noexcept {
  PayloadReader in{parameters};
  milliseconds wait{in.u32()};
  milliseconds how_long{in.u32()};
  milliseconds pause{in.u32()};
  if (in.error()) {
    wait = how_long = pause = milliseconds{0};
  }
  auto place = std::ranges::find(places_, nullptr, &Place::what);
  if (place == places_.end()) {
    place = std::shift_left(places_.begin(), places_.end(), 1);
  }
  *place = {.what = &what, .due = now + wait, .left = how_long, .pause = std::max(pause, milliseconds{1})};
}

const Trigger* Schedule::next(TimePoint now) noexcept {
  const auto place = std::ranges::find_if(
      places_, [&](const Place& one) { return one.what != nullptr && trestle::is_due(one.due, now); });
  if (place == places_.end()) {
    return nullptr;
  }
  const Trigger* const what = place->what;
  place->left -= place->pause;
  if (place->left > milliseconds{0}) {
    place->due = now + place->pause;  // from now on: after a stall there is no burst
  } else {
    *std::shift_left(place, places_.end(), 1) = {};
  }
  return what;
}

std::optional<TimePoint> Schedule::deadline() const noexcept {
  std::optional<TimePoint> first;
  for (const Place& one : places_) {
    if (one.what != nullptr && (!first || one.due < *first)) {
      first = one.due;
    }
  }
  return first;
}

}  // namespace ets
