#include "sd/net/discovery_sender.hpp"

#include <algorithm>
#include <cerrno>

namespace trestle::sd {
namespace {

using someip::SendStatus;

// A table of neighbours that is full shows as ENOBUFS over IPv4, and so over IPv6.
SendStatus classified(SendStatus status, const Endpoint& to) {
  return status == SendStatus::failed && to.address.v6 && errno == EINVAL ? SendStatus::would_block : status;
}

}  // namespace

SendStatus DiscoverySender::attempt(const Endpoint& to, ByteView bytes) {
  if (to.address.is_multicast()) {
    return classified(ways_.group(to, bytes), to);
  }
  SendStatus status = SendStatus::would_block;
  if (!single_full_) {
    status = classified(ways_.single(to, bytes), to);
    // Else the system had no place for this neighbour, and may have some for others.
    single_full_ = status == SendStatus::would_block && (errno == EAGAIN || errno == EWOULDBLOCK);
  }
  return status == SendStatus::would_block && ways_.known(to.address) ? classified(ways_.group(to, bytes), to)
                                                                      : status;
}

int DiscoverySender::send(const Endpoint& to, ByteView bytes, TimePoint now) {
  on_time(now);
  single_full_ = false;
  const SendStatus status = waiting_.any_for(to) ? SendStatus::would_block : attempt(to, bytes);
  if (status == SendStatus::failed) {
    const int why = errno;
    ++counters_.discovery_not_sent;
    return why;
  }
  if (status == SendStatus::would_block) {
    using Rank = WaitingDatagrams::Rank;
    const bool first = to.address.is_multicast() || ways_.known(to.address);
    if (waiting_.empty()) {
      pause_ = retry_min;
      next_try_ = now + pause_;
    }
    ++counters_.discovery_waited;
    waiting_.add(to, bytes, first ? Rank::first : Rank::others, now);
    take_drops();
  }
  return 0;
}

std::size_t DiscoverySender::retry(TimePoint now) {
  single_full_ = false;
  const std::size_t done = waiting_.retry(now, [this](const Endpoint& to, ByteView bytes) {
    const SendStatus status = attempt(to, bytes);
    counters_.discovery_not_sent += status == SendStatus::failed ? 1 : 0;
    return status;
  });
  take_drops();
  return done;
}

void DiscoverySender::on_time(TimePoint now) {
  if (waiting_.empty() || now < next_try_) {
    return;
  }
  pause_ = retry(now) > 0 ? retry_min : std::min(2 * pause_, retry_max);
  next_try_ = now + pause_;
}

std::optional<TimePoint> DiscoverySender::deadline() const noexcept {
  return waiting_.empty() ? std::nullopt : std::optional{next_try_};
}

void DiscoverySender::finish(TimePoint now) {
  retry(now);
  forget();
}

void DiscoverySender::forget() noexcept {
  counters_.discovery_outdated += waiting_.clear();
}

void DiscoverySender::take_drops() noexcept {
  const WaitingDatagrams::Drops drops = waiting_.take_drops();
  counters_.discovery_no_room += drops.no_room;
  counters_.discovery_outdated += drops.too_old;
}

}  // namespace trestle::sd
