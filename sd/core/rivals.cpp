// Two servers that offer the same service: which of them is kept. Nobody can tell who is the honest one, but
// whoever holds the place has to answer: as soon as somebody else offers the service, our Subscribes are
// repeated by time until there is an answer, or too many are missing. Then the next who offers it has its
// turn.
#include "sd/core/hash.hpp"
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

namespace {

constexpr std::uint32_t ticks_mask = (std::uint32_t{1} << 30U) - 1;
constexpr Duration patience = std::chrono::milliseconds{400};  // for one answer

}  // namespace

std::optional<RemoteService> ServiceDiscovery::contested() const noexcept {
  if (contested_ >= remotes_.size() || remotes_[contested_].slot_state != SlotBase::State::in_use) {
    return std::nullopt;
  }
  return service_of(remotes_[contested_]);
}

std::optional<Takeover> ServiceDiscovery::take_takeover() noexcept {
  const std::uint16_t index = std::exchange(taken_over_, slots::Remote::none);
  if (index >= remotes_.size() || remotes_[index].slot_state != SlotBase::State::in_use) {
    return std::nullopt;
  }
  return Takeover{service_of(remotes_[index]), peers_[loser_].endpoint};
}

void ServiceDiscovery::not_answered(RemoteHandle service) noexcept {
  if (slots::Remote* const remote = remotes_.find(service)) {
    not_answered(*remote);
  }
}

void ServiceDiscovery::answered(RemoteHandle service) noexcept {
  if (slots::Remote* const remote = remotes_.find(service)) {
    answered(*remote);
  }
}

bool ServiceDiscovery::is_mute(RemoteHandle service) const noexcept {
  const slots::Remote* const remote = remotes_.find(service);
  return remote != nullptr && remote->unanswered == slots::Remote::is_mute;
}

// --- Whether they answer ----------------------------------------------------------------------------------

std::uint32_t ServiceDiscovery::key_of(const slots::Remote& remote) const noexcept {
  const auto address = std::as_bytes(std::span{peers_[remote.peer].endpoint.address.bytes});
  return std::max<std::uint32_t>(hash_of(someip::value(remote.service), address), 1);  // 0: none
}

// Else each offer with another port, or of another instance, would be a new beginning.
void ServiceDiscovery::remember(const slots::Remote& remote) noexcept {
  const std::uint32_t key = key_of(remote);
  auto place = std::ranges::find(silences_, key, &slots::Silence::key);
  if (place == silences_.end() && !silences_.empty()) {
    place = silences_.begin() + (next_silence_++ % std::max<std::size_t>(silences_.size(), 1));
  }
  *place = {key, slots::ticks(peers_[remote.peer].last_seen) & ticks_mask, remote.unanswered,
            slots::ticks(remote.proof_due) + 1};
}

void ServiceDiscovery::recall(slots::Remote& remote, TimePoint now) noexcept {
  const auto known = std::ranges::find(silences_, key_of(remote), &slots::Silence::key);
  if (known == silences_.end() ||
      ((slots::ticks(now) - known->last_seen) & ticks_mask) >= (settings_.silent_after.count() >> 20U)) {
    return;
  }
  remote.unanswered = known->unanswered;
  remote.is_asked = true;
  const auto left = static_cast<std::int32_t>(known->proof_due - slots::ticks(now));
  remote.proof_due = now + std::clamp(Duration{std::int64_t{left} * (1 << 20)}, Duration{0}, patience);
}

// To what else the host offers of the service, and has never answered for.
void ServiceDiscovery::spread(const slots::Remote& remote) noexcept {
  const IpAddress& address = peers_[remote.peer].endpoint.address;
  for (slots::Remote& other : remotes_) {
    if (other.service == remote.service && !other.has_answered &&
        peers_[other.peer].endpoint.address == address) {
      other.unanswered = remote.unanswered;
    }
  }
}

void ServiceDiscovery::not_answered(slots::Remote& remote) noexcept {
  if (remote.unanswered < slots::Remote::is_mute) {
    ++remote.unanswered;
  }
  if (guards && !remote.has_answered) {
    remember(remote);
    spread(remote);
  }
}

void ServiceDiscovery::answered(slots::Remote& remote) noexcept {
  if constexpr (guards) {
    remote.is_contested = false;
    if (remote.has_answered && remote.unanswered == 0 && !remote.is_asked) {
      return;
    }
    if (const auto known = std::ranges::find(silences_, key_of(remote), &slots::Silence::key);
        known != silences_.end()) {
      *known = {};
    }
    remote.is_asked = false;
    peers_[remote.peer].heard = 0xffff;  // it hears us: no passer-by
  }
  remote.unanswered = 0;
  if (guards && !remote.has_answered) {
    spread(remote);
    remote.has_answered = true;
  }
}

// A Subscribe goes there. The one before may be unanswered by now, unless `is_open` is false: then only its
// subscription was to be renewed.
void ServiceDiscovery::note_asked(slots::Remote& remote, bool is_open, TimePoint when) noexcept {
  if (remote.unanswered == slots::Remote::is_mute || !is_due(remote.proof_due, when)) {
    return;
  }
  if (remote.is_asked && is_open) {
    not_answered(remote);
  }
  remote.is_asked = true;
  if (remote.unanswered < slots::Remote::is_mute) {
    remote.proof_due = when + patience;
  }
}

// Asks again who holds a place that somebody else claims.
void ServiceDiscovery::prove(slots::Remote& remote, TimePoint now) noexcept {
  if (pending_.free_places() < 2) {  // it cannot be asked
    remote.proof_due = now + patience;
    return;
  }
  note_asked(remote, true, now);
  remote.is_contested =
      remote.unanswered < slots::Remote::is_mute && remote.subscribed_by != slots::Remote::none;
  for (std::uint16_t at = remote.subscribed_by; at != slots::Remote::none && remote.is_contested;) {
    slots::OwnSubscription& subscription = subscriptions_[at];
    at = subscription.next;
    request(subscription, now, Cause::rival);
  }
}

// Whether the place is free for somebody else, who offers the service, too. Where there is nothing to be
// answered, who has long been silent does not keep it from who speaks.
bool ServiceDiscovery::gives_way(slots::Remote& remote, TimePoint now) noexcept {
  if (remote.unanswered == slots::Remote::is_mute) {
    return is_due(remote.proof_due, now);
  }
  if (remote.subscribed_by == slots::Remote::none) {
    return !remote.has_answered && is_silent(peers_[remote.peer], now);
  }
  remote.is_contested = true;
  if (is_due(remote.proof_due, now)) {
    prove(remote, now);
  }
  return false;
}

}  // namespace trestle::sd
