#include "bridge/inspect/tools/watcher.hpp"

#include "bridge/inspect/decode/sd_json.hpp"
#include "bridge/traffic/learn.hpp"

namespace trestle::inspect {
namespace {

/// The most services, and the most subscriptions.
constexpr std::size_t max_seen = 10'000;

}  // namespace

Watcher::Watcher(std::uint16_t sd_port, Handler handler)
    : handler_{std::move(handler)}, network_{max_seen}, reader_{{sd_port}, *this} {}

void Watcher::on_frame(const pcaps::Frame& frame) {
  last_ = TimePoint{frame.time.time_since_epoch()};
  first_ = first_.value_or(last_);
  frames_.on_frame(frame);
}

void Watcher::finish() {
  frames_.finish();
  reader_.finish();
}

void Watcher::on_sd_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now) {
  std::vector<traffic::Sighting> sightings;
  network_.on_datagram(datagram, from, to, now, sightings);
  tell(sightings, now);
}

void Watcher::on_time(TimePoint now) {
  std::vector<traffic::Sighting> sightings;
  network_.on_time(now, sightings);
  tell(sightings, now);
}

bool Watcher::message(const traffic::Place& place, std::size_t /*offset*/, const someip::Message& message) {
  const TimePoint now{place.time.time_since_epoch()};
  if (!has_sd_id(message.header)) {
    traffic_.on_message(message, place.flow, place.transport.value_or(Transport::udp), now);
    return true;
  }
  std::vector<traffic::Sighting> sightings;
  const std::uint64_t before = network_.counters().malformed;
  network_.on_message(message, place.flow.from, place.flow.to, now, sightings);
  tell(sightings, now);
  return network_.counters().malformed == before;
}

void Watcher::undecodable(const traffic::Place& /*place*/, std::size_t /*offset*/, ByteView /*bytes*/,
                          const traffic::Violation& /*violation*/) {
  ++malformed_;
}

void Watcher::broken_frame(const traffic::Place& /*place*/, const traffic::Violation& /*violation*/) {
  ++malformed_;
}

std::uint64_t Watcher::malformed() const noexcept {
  return malformed_ + network_.counters().malformed + traffic_.counters().strange;
}

void Watcher::tell(const std::vector<traffic::Sighting>& sightings, TimePoint now) {
  for (const traffic::Sighting& one : sightings) {
    traffic::learn(reader_, one);
  }
  if (!sightings.empty()) {
    handler_(sightings, now);
  }
}

}  // namespace trestle::inspect
