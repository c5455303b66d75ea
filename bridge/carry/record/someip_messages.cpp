#include "bridge/carry/record/someip_messages.hpp"

#include <vector>

#include "bridge/traffic/learn.hpp"

namespace trestle::carry {
namespace {

/// Services and subscriptions of discovery that are remembered.
constexpr std::size_t max_seen = 10'000;

}  // namespace

SomeipMessages::SomeipMessages(std::uint16_t sd_port, OnMessage on_message)
    : on_message_{std::move(on_message)}, network_{max_seen}, reader_{{sd_port}, *this}, frames_{reader_} {}

void SomeipMessages::finish() {
  frames_.finish();
  reader_.finish();
}

bool SomeipMessages::message(const traffic::Place& place, std::size_t /*offset*/,
                             const someip::Message& message) {
  ++found_;
  const TimePoint time{place.time.time_since_epoch()};
  if (sd::is_sd(message.header)) {
    std::vector<traffic::Sighting> sightings;
    network_.on_message(message, place.flow.from, place.flow.to, time, sightings);
    for (const traffic::Sighting& one : sightings) {
      traffic::learn(reader_, one);
    }
  }
  if (!is_tp(message.header.type)) {
    on_message_(place, message);
    return true;
  }
  const auto whole = segments_.add(place.flow, message, time);
  if (!whole) {
    ++malformed_;
  } else if (*whole) {
    on_message_(place, {(*whole)->header, (*whole)->payload});
  }
  return true;
}

void SomeipMessages::undecodable(const traffic::Place& /*place*/, std::size_t /*offset*/, ByteView /*bytes*/,
                                 const traffic::Violation& /*violation*/) {
  ++found_;
  ++malformed_;
}

void SomeipMessages::broken_frame(const traffic::Place& /*place*/, const traffic::Violation& /*violation*/) {
  ++malformed_;
}

}  // namespace trestle::carry
