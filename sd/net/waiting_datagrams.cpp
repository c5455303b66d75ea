#include "sd/net/waiting_datagrams.hpp"

namespace trestle::sd {

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
