#include "bridge/conform/replay/copies.hpp"

#include <algorithm>

namespace trestle::conform {

bool Copies::is_copy(const traffic::Place& place, const someip::Message& message) {
  if (place.transport != Transport::udp) {
    return false;
  }
  while (!recent_.empty() && (recent_.size() >= most_recent || recent_.front().time + within < place.time)) {
    recent_.pop_front();
  }
  // In one frame the same message may well stand twice.
  const bool copy = std::ranges::any_of(recent_, [&](const Recent& one) {
    return one.frame != place.frame && one.flow.from == place.flow.from && one.flow.to == place.flow.to &&
           one.header == message.header && std::ranges::equal(one.payload, message.payload);
  });
  if (!copy) {
    recent_.push_back({place.time,
                       place.frame,
                       place.flow,
                       message.header,
                       {message.payload.begin(), message.payload.end()}});
  }
  return copy;
}

bool CopyCount::message(const traffic::Place& place, std::size_t /*offset*/, const someip::Message& message) {
  if (place.transport == Transport::udp) {
    ++messages_;
    copies_ += seen_.is_copy(place, message) ? 1U : 0U;
  }
  return true;
}

void CopyCount::undecodable(const traffic::Place& /*place*/, std::size_t /*offset*/, ByteView /*bytes*/,
                            const traffic::Violation& /*violation*/) {}

void CopyCount::broken_frame(const traffic::Place& /*place*/, const traffic::Violation& /*violation*/) {}

}  // namespace trestle::conform
