// Two servers that offer the same service: which of them is kept. Nobody can tell who is the honest one, but
// whoever holds the place has to answer: as soon as somebody else offers the service, our Subscribes are
// repeated by time until there is an answer, or too many are missing. Then the next one that offers it has
// its turn. As long as it has never answered, all others are asked, too, and the first one to answer gets the
// place: however many offer what they do not serve, they do not delay the one that does. One that has
// answered and comes back, after a restart for example, gets its place back from one that came meanwhile.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

namespace {

constexpr unsigned unit = 26;  // of what is remembered: 67 ms, so that 14 bits begin anew after 18 minutes
constexpr std::uint16_t mask = 0x3fff;
constexpr std::uint16_t patience = 381;  // ticks for one answer: 400 ms

std::uint16_t coarse(TimePoint at) noexcept {
  return static_cast<std::uint16_t>(at.time_since_epoch().count() >> unit);
}

// For how long a service was held: in units of 268 ms, so that 16 bits are five hours.
std::uint32_t held_time(TimePoint at) noexcept {
  return static_cast<std::uint32_t>(at.time_since_epoch().count() >> 28U);
}

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
  return Takeover{service_of(remotes_[index]), peers_[loser_].endpoint, remotes_[index].is_back};
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

void ServiceDiscovery::is_of_no_use(RemoteHandle service) noexcept {
  slots::Remote* const remote = remotes_.find(service);
  if (remote != nullptr && !remote->has_answered) {
    remote->unanswered = slots::Remote::is_mute;
  }
}

bool ServiceDiscovery::is_mute(RemoteHandle service) const noexcept {
  const slots::Remote* const remote = remotes_.find(service);
  return remote != nullptr && remote->unanswered == slots::Remote::is_mute;
}

// --- Whether they answer ----------------------------------------------------------------------------------

// What is remembered of its host and service; else a place for that, or null.
slots::Silence* ServiceDiscovery::silence_of(const slots::Remote& remote, bool is_new) noexcept {
  const std::uint16_t key = mark_of(peers_[remote.peer].endpoint.address, someip::value(remote.service));
  for (slots::Silence& known : silences_) {
    if (known.key == key) {
      return &known;
    }
  }
  if (!is_new || silences_.empty()) {
    return nullptr;
  }
  slots::Silence& place = silences_[next_silence_++ % silences_.size()];
  place.key = key;
  return &place;
}

// The same, unless it was not heard for so long that it may be another one now. It is heard now.
slots::Silence* ServiceDiscovery::silence_seen(const slots::Remote& remote, TimePoint now) noexcept {
  slots::Silence* const known = silence_of(remote, false);
  if (known == nullptr ||
      ((coarse(now) - known->last_seen) & mask) >= (settings_.silent_after.count() >> unit)) {
    return nullptr;
  }
  known->last_seen = coarse(now) & mask;
  return known;
}

// Else each offer with another port, or of another instance, would be a new beginning.
void ServiceDiscovery::remember(const slots::Remote& remote) noexcept {
  slots::Silence* const silence = remote.has_answered ? nullptr : silence_of(remote, true);
  if (silence != nullptr) {
    silence->last_seen = coarse(peers_[remote.peer].last_seen) & mask;
    silence->unanswered = remote.unanswered;
    silence->proof_due = remote.proof_due;
  }
}

void ServiceDiscovery::recall(slots::Remote& remote, TimePoint now) noexcept {
  remote.since = held_time(now);
  if (const slots::Silence* const known = silence_seen(remote, now)) {
    remote.unanswered = known->unanswered;
    remote.proof_due = known->proof_due;
    remote.is_asked = true;
  }
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
  remote.unanswered = 0;
  if constexpr (guards) {
    remote.is_contested = false;
    remote.is_asked = false;
    remote.goes_on = false;
    peers_[remote.peer].heard = 0xffff;  // it hears us: no passer-by
    if (!remote.has_answered) {
      spread(remote);
      remote.has_answered = true;
      if (slots::Silence* const known = silence_of(remote, false)) {
        known->key = 0;
      }
    }
  }
}

// A Subscribe goes there. The one before may be unanswered by now, unless `is_open` is false: then only its
// subscription was to be renewed.
// @return whether it matters: none is open, and there are none too many
bool ServiceDiscovery::note_asked(slots::Remote& remote, bool is_open, TimePoint when) noexcept {
  const auto at = static_cast<std::uint16_t>(slots::ticks(when));
  // Of an answer that was due more than two seconds ago, its ticks may look as if it were still to come.
  if (static_cast<std::uint16_t>(remote.proof_due - at - 1) < 2000) {
    return false;
  }
  if (remote.is_asked && is_open) {
    not_answered(remote);
  }
  remote.is_asked = true;
  remote.proof_due = static_cast<std::uint16_t>(at + patience);
  return remote.unanswered < slots::Remote::is_mute;
}

// Whether the place is free for somebody else who offers the service, too. If not, its holder is asked until
// it has answered. Where there is nothing to be answered, a holder that has long been silent gives way to one
// that speaks.
bool ServiceDiscovery::gives_way(slots::Remote& remote, TimePoint now) noexcept {
  if (remote.unanswered == slots::Remote::is_mute) {
    return true;
  }
  if (remote.subscribed_by == slots::Remote::none) {
    return !remote.has_answered && is_silent(peers_[remote.peer], now);
  }
  remote.is_contested = true;
  questions_due_ = earlier(questions_due_, now + std::chrono::milliseconds{100});
  if (pending_.free_places() >= 2 && note_asked(remote, true, now)) {
    for (std::uint16_t at = remote.subscribed_by; at != slots::Remote::none; at = subscriptions_[at].next) {
      request(subscriptions_[at], now, Cause::rival);
    }
  }
  return false;
}

// --- Others that offer the same, while nobody has answered ------------------------------------------------

// Whether there is still somebody in the place who has not answered.
bool ServiceDiscovery::is_open(const slots::Rival& rival) const noexcept {
  const slots::Subscription& by = subscriptions_[rival.subscription];
  return by.slot_state == SlotBase::State::in_use && by.remote != slots::Subscription::no_remote &&
         !remotes_[by.remote].has_answered;
}

// The place of the one that was asked before all others; preferably of one that has not answered.
slots::Rival& ServiceDiscovery::place_for_rival() noexcept {
  for (std::size_t i = 0; i < rivals_.size(); ++i) {
    slots::Rival& rival = rivals_[next_rival_++ % rivals_.size()];
    if (rival.has_answered == 0 || !is_open(rival)) {
      return rival;
    }
  }
  return rivals_[next_rival_++ % rivals_.size()];
}

// Whether the place of `known` goes to the host of `other`. If not, and nobody has answered yet, both are
// asked.
bool ServiceDiscovery::gives_way_to(slots::Remote& other, slots::Remote& known,
                                    const Arrival& arrival) noexcept {
  slots::Rival* rival = nullptr;
  const std::uint16_t host = mark_of(peers_[other.peer].endpoint.address, someip::value(other.service));
  for (slots::Rival& one : rivals_) {
    if (one.host == host && is_open(one) && subscriptions_[one.subscription].remote == known.index) {
      rival = &one;
    }
  }
  if (rival != nullptr && rival->has_answered != 0) {
    rival->host = 0;
    answered(other);
    return true;
  }
  if (gives_way(known, arrival.now)) {
    return true;
  }
  if (!known.has_answered) {
    ask_too(other, host, known, rival, arrival);
  }
  return false;
}

// By a Subscribe of a subscription to the same. Who offers again is asked again, but not before it had time
// to answer.
void ServiceDiscovery::ask_too(const slots::Remote& other, std::uint16_t host, const slots::Remote& known,
                               slots::Rival* rival, const Arrival& arrival) noexcept {
  constexpr std::uint16_t all = 0x7fff;
  // It ends by itself, should the answer be lost.
  constexpr std::uint32_t ttl_s = 1;
  std::uint16_t by = known.subscribed_by;
  // There is a connection only to the one that has the place.
  while (by != slots::Remote::none &&
         (subscriptions_[by].tcp || !fits(requirements_[subscriptions_[by].requirement], other))) {
    by = subscriptions_[by].next;
  }
  const auto at = static_cast<std::uint16_t>(slots::ticks(arrival.answer_due) & all);
  const bool was_just_asked = rival != nullptr && ((at - rival->asked) & all) < patience;
  if (by == slots::Remote::none || was_just_asked || rivals_.empty() || is_guest(other.peer)) {
    return;
  }
  if (pending_.free_places() < 2) {
    refuse(Limit::pending_entries);
    return;
  }
  const Duration pause{1'000'000'000U / settings_.max_entries_per_second};
  const bool may_ask = std::ranges::all_of(subscriptions_[by].questions, [&](RateLimit& limit) {  // the one
    return limit.take(arrival.now, pause, 100);
  });
  if (!may_ask) {
    note(Limit::entries_per_second);
    count(counters_.ignored_too_many);
    return;
  }
  slots::Rival& place = rival != nullptr ? *rival : place_for_rival();
  place.host = host;
  place.subscription = by;
  place.asked = at & all;
  place.has_answered = 0;
  // Which is not to be changed by what becomes of this.
  send_subscribe_to(other, subscriptions_[by], arrival.answer_due, ttl_s)->subscription = slots::Remote::none;
}

// Takes the answer of a rival: it was asked because it offers the same as somebody who has not answered. Its
// offer was not kept, so it is asked for that, and gets the place with it. Its subscription ends, so that the
// next one brings the initial events.
bool ServiceDiscovery::rival_answers(const Entry& entry, const Arrival& arrival) noexcept {
  const std::uint16_t host = mark_of(peers_[arrival.peer].endpoint.address, someip::value(entry.service));
  for (slots::Rival& rival : rivals_) {
    if (rival.host != host || rival.has_answered != 0 || !is_open(rival)) {
      continue;
    }
    const slots::Subscription& by = subscriptions_[rival.subscription];
    const slots::Requirement& requirement = requirements_[by.requirement];
    if (requirement.service != entry.service || by.instance != entry.instance ||
        by.eventgroup != entry.eventgroup() || by.counter != entry.counter()) {
      continue;
    }
    if (entry.ttl_s == 0) {
      return true;  // whoever refuses has not shown that it serves
    }
    rival.has_answered = 1;
    if (pending_.free_places() < 2) {
      refuse(Limit::pending_entries);  // it gets the place with the next offer
      return true;
    }
    slots::Remote there;
    there.service = entry.service;
    there.instance = entry.instance;
    there.major = entry.major;
    there.peer = arrival.peer;
    send_subscribe_to(there, by, arrival.now, 0)->subscription = slots::Remote::none;
    fill_find(*send(arrival.peer, arrival.now), requirement);
    return true;
  }
  return false;
}

// Two servers claim the same service. The known one stays until its TTL is over: changing with every offer
// would help nobody. It is replaced only if it does not answer, or the other one did first, or it came while
// the other was away, or is none that anybody needs.
bool ServiceDiscovery::takes_over(slots::Remote& offered, slots::Remote& known,
                                  const Arrival& arrival) noexcept {
  contested_ = known.index;
  count(counters_.ignored_conflicting_offer);
  if constexpr (!guards) {
    return false;
  }
  offered.is_back = is_back(offered, known);
  // The other may have another minor.
  const bool is_needed = !known.is_wanted && requirements_of(offered) > 0;
  if (!offered.is_back && !is_needed && !gives_way_to(offered, known, arrival)) {
    static_cast<void>(silence_seen(offered, arrival.now));
    return false;
  }
  contested_ = slots::Remote::none;
  loser_ = known.peer;
  lose(known, LossReason::replaced, arrival.now);
  if (offered.is_back) {
    note_back(offered);
  } else {
    note_mute(known);
  }
  return true;
}

// --- Who held a service before ----------------------------------------------------------------------------

std::uint16_t ServiceDiscovery::holder_of(const slots::Remote& remote) const noexcept {
  return mark_of(peers_[remote.peer].endpoint.address, someip::value(remote.instance));
}

// From its first offer to when its host was heard last.
std::uint32_t ServiceDiscovery::held_by(const slots::Remote& remote) const noexcept {
  return remote.has_answered ? held_time(peers_[remote.peer].last_seen) - remote.since : 0;
}

// Called when it is lost. Each requirement has a place of its own for this, so that others cannot fill it: it
// takes an answer to us, and a longer time.
void ServiceDiscovery::note_held(const slots::Remote& remote) noexcept {
  const std::uint16_t holder = holder_of(remote);
  const std::uint32_t held = held_by(remote);
  if (held == 0) {
    return;
  }
  for (slots::Requirement& requirement : requirements_) {
    if (!fits(requirement, remote)) {
      continue;
    }
    const std::uint32_t before = requirement.holder == holder ? requirement.held : 0U;
    if (before + held > requirement.held) {
      requirement.holder = holder;
      requirement.held = static_cast<std::uint16_t>(std::min<std::uint32_t>(before + held, 0xffff));
    }
  }
}

// Called when it has lost its place because it did not answer. If it has been away, it comes back; if it goes
// on offering what it does not serve, its place must not be given to and fro. No time can tell the two apart,
// as nobody knows how often it offers.
void ServiceDiscovery::note_mute(const slots::Remote& remote) noexcept {
  const std::uint16_t holder = holder_of(remote);
  for (slots::Requirement& requirement : requirements_) {
    if (requirement.holder == holder && requirement.service == remote.service) {
      requirement.held = static_cast<std::uint16_t>(!remote.has_answered ? 0U
                                                    : remote.goes_on     ? requirement.held >> 4U
                                                                         : requirement.held >> 1U);
    }
  }
}

// Called when it gets its place back, for a quarter of what it has: who held the place once cannot go and
// come again as it likes, and displace who answers each time.
void ServiceDiscovery::note_back(const slots::Remote& remote) noexcept {
  const std::uint16_t holder = holder_of(remote);
  for (slots::Requirement& requirement : requirements_) {
    if (requirement.holder == holder && fits(requirement, remote)) {
      requirement.held = static_cast<std::uint16_t>(requirement.held - (requirement.held + 3U) / 4U);
    }
  }
}

// Whether what is offered was held by the same host before, for longer than by the rival who came meanwhile.
bool ServiceDiscovery::is_back(const slots::Remote& offered, const slots::Remote& rival) const noexcept {
  const std::uint16_t holder = holder_of(offered);
  const std::uint32_t held = held_by(rival);
  return holder != holder_of(rival) && !is_guest(offered.peer) &&
         requirements_.find_if([&](const slots::Requirement& requirement) {
           return requirement.holder == holder && requirement.held > held && fits(requirement, offered);
         }) != nullptr;
}

}  // namespace trestle::sd
