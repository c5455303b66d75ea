#include "sd/net/discovery_sender.hpp"

#include <cerrno>

namespace trestle::sd {
namespace {

using someip::SendStatus;

// When the neighbour table is full, the error is ENOBUFS over IPv4 but EINVAL over IPv6; treat both alike.
SendStatus classified(SendStatus status, const Endpoint& to) {
  return status == SendStatus::failed && to.address.v6 && errno == EINVAL ? SendStatus::would_block : status;
}

// Whether the socket buffer is full. Else there is no room for this neighbour, or none in the interface.
bool is_buffer_full() {
  return errno == EAGAIN || errno == EWOULDBLOCK;
}

}  // namespace

SendStatus DiscoverySender::attempt(const Endpoint& to, ByteView bytes, bool& heard_here) {
  if (to.address.is_multicast()) {
    const SendStatus status = classified(ways_.group(to, bytes, heard_here), to);
    heard_here = heard_here || (status == SendStatus::would_block && !is_buffer_full());
    return status;
  }
  const bool doubtful = single_full_ || no_neighbours_;
  const bool known = doubtful && ways_.known(to.address);
  if (doubtful && !known) {
    return SendStatus::would_block;
  }
  if (!single_full_) {
    const SendStatus status = classified(ways_.single(to, bytes), to);
    if (status != SendStatus::would_block) {
      return status;
    }
    (is_buffer_full() ? single_full_ : no_neighbours_) = true;
  }
  return known || ways_.known(to.address) ? classified(ways_.group(to, bytes, false), to)
                                          : SendStatus::would_block;
}

int DiscoverySender::send(const Endpoint& to, ByteView bytes, TimePoint now) {
  on_time(now);
  single_full_ = no_neighbours_ = false;
  bool heard_here = false;
  const SendStatus status = waiting_.any_for(to) ? SendStatus::would_block : attempt(to, bytes, heard_here);
  if (status == SendStatus::failed) {
    const int why = errno;
    ++counters_.discovery_not_sent;
    return why;
  }
  if (status == SendStatus::would_block) {
    using Rank = WaitingDatagrams::Rank;
    const bool first = to.address.is_multicast() || ways_.known(to.address);
    const bool none = waiting_.empty();
    ++counters_.discovery_waited;
    waiting_.add(to, bytes, first ? Rank::first : Rank::others, heard_here, now);
    take_drops();
    if (none || first) {
      pause_ = least_pause();
      next_try_ = none ? now + pause_ : std::min(next_try_, now + pause_);
    }
  }
  return 0;
}

std::size_t DiscoverySender::retry(TimePoint now) {
  single_full_ = no_neighbours_ = false;
  const std::size_t done = waiting_.retry(now, [this](const Endpoint& to, ByteView bytes, bool& heard_here) {
    const SendStatus status = attempt(to, bytes, heard_here);
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
  pause_ = retry(now) > 0 ? least_pause() : std::min(2 * pause_, retry_max);
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

bool WaitingDatagrams::any_for(const Endpoint& to) const noexcept {
  return std::ranges::find(waiting_, to, &Waiting::to) != waiting_.end();
}

bool WaitingDatagrams::any_first() const noexcept {
  return std::ranges::find(waiting_, Rank::first, &Waiting::rank) != waiting_.end();
}

void WaitingDatagrams::add(const Endpoint& to, ByteView bytes, Rank rank, bool heard_here, TimePoint now) {
  drop_old(now);
  if (waiting_.size() >= most_) {
    ++drops_.no_room;
    const auto gives_way = std::ranges::find(waiting_, Rank::others, &Waiting::rank);
    if (gives_way == waiting_.end()) {
      return;
    }
    waiting_.erase(gives_way);
  }
  waiting_.push_back({to, {bytes.begin(), bytes.end()}, rank, heard_here, now});
}

void WaitingDatagrams::drop_old(TimePoint now) {
  while (!waiting_.empty() && now - waiting_.front().since > max_age_) {
    waiting_.pop_front();
    ++drops_.too_old;
  }
}

std::size_t WaitingDatagrams::clear() noexcept {
  const std::size_t dropped = waiting_.size();
  waiting_.clear();
  return dropped;
}

}  // namespace trestle::sd
