// The peers that we hear or send to: their sessions, and what follows from a reboot of one.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

slots::Peer* ServiceDiscovery::peer_at(const Endpoint& endpoint, TimePoint now) noexcept {
  slots::Peer* const known =
      peers_.find_if([&](const slots::Peer& peer) { return peer.endpoint == endpoint; });
  if (known != nullptr && !is_guest(known->index)) {
    return known;
  }
  slots::Peer* place = place_for(endpoint, now);
  if constexpr (guards) {
    if (known != nullptr) {
      return place == nullptr ? known : &move_guest(*known, *place);
    }
    if (place == nullptr) {
      place = guest();
    }
    // This may be a forgotten peer. If we repeated a session, that would look like a reboot of ours. So its
    // sessions continue after all that were forgotten; the flag says on which side of 0xffff.
    // [feat_req_someipsd_41] [feat_req_someipsd_765] [feat_req_someipsd_764]
    place->sessions = forgotten_sessions_;
  }
  if (place != nullptr) {
    place->endpoint = endpoint;
    place->last_seen = now;
    if (guards &&
        std::ranges::find(displaced_, mark_of(endpoint.address, endpoint.port)) != displaced_.end()) {
      place->heard = 954;  // a second
    }
    for (const KnownFailures& failures : known_failures_) {  // the one
      for (slots::Probe& probe : place->probe) {
        if (failures.has(hash_with_seed(endpoint.address, endpoint.port))) {
          suspect(*place);
          probe.has_failed = true;
        }
      }
    }
  }
  return place;
}

// There is a place now, so the peer is no guest any more.
slots::Peer& ServiceDiscovery::move_guest(slots::Peer& guest, slots::Peer& place) noexcept {
  const SlotBase base = static_cast<const SlotBase&>(place);
  place = guest;
  static_cast<SlotBase&>(place) = base;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    std::uint16_t& to = pending_[i].peer;
    to = to == guest.index ? place.index : to;
  }
  peers_.remove(guest);
  return place;
}

// A lasting place for a peer; if necessary that of another peer, which is then forgotten.
slots::Peer* ServiceDiscovery::place_for(const Endpoint& endpoint, TimePoint now) noexcept {
  if constexpr (!guards) {
    if (slots::Peer* const place = peers_.add()) {
      return place;
    }
    slots::Peer* const oldest = who_is_forgotten(nullptr, now);
    if (oldest == nullptr) {
      return nullptr;
    }
    peers_.remove(*oldest);
    return peers_.add();
  }
  std::size_t all = 0;
  std::size_t there = 0;
  for (const slots::Peer& peer : peers_) {
    all += is_guest(peer.index) ? 0 : 1;
    there += peer.endpoint.address == endpoint.address ? 1 : 0;
  }
  const bool too_many_there = there >= settings_.max_peers_per_address;
  if (all + 1 < peers_.size() && !too_many_there) {
    return peers_.add();
  }
  slots::Peer* const oldest = who_is_forgotten(too_many_there ? &endpoint.address : nullptr, now);
  if (oldest == nullptr) {
    if constexpr (optimised_for_many) {
      for (slots::Peer& peer : peers_) {
        if (peer.subscribers > 0) {
          suspect(peer);
        }
      }
    }
    return nullptr;
  }
  // A sender that changes its address with each message must not get a new allowance each time.
  const RateLimit entries = oldest->entries;
  if (oldest->is_used) {
    displaced_[next_displaced_++ % std::max<std::size_t>(displaced_.size(), 1)] =
        mark_of(oldest->endpoint.address, oldest->endpoint.port);
  }
  for (KnownFailures& failures : known_failures_) {  // the one
    for (const slots::Probe& probe : oldest->probe) {
      // Where peers are forgotten this fast, nobody has much time.
      const auto since = static_cast<std::uint16_t>(slots::ticks(now) - probe.due);
      const bool is_slow =
          oldest->is_probed && oldest->proofs == 0 && since >= 10 && since < slots::Probe::not_due;
      if (is_slow || has_failed(*oldest, now)) {
        failures.add(hash_with_seed(oldest->endpoint.address, oldest->endpoint.port));
      }
    }
  }
  forget(*oldest);
  if (oldest->slot_state == SlotBase::State::in_use) {
    return nullptr;  // there is no room yet to report what ended with it
  }
  slots::Peer* const place = peers_.add();
  place->entries = entries;
  if constexpr (optimised_for_many) {
    suspect(*place);
  }
  return place;
}

// Among all peers, or those at one address: the one silent the longest of those without subscription or
// service, else of those whose services nobody requires. A peer in use is forgotten only if fleeting, or if
// it has failed to answer.
slots::Peer* ServiceDiscovery::who_is_forgotten(const IpAddress* among, TimePoint now) noexcept {
  const auto oldest = [&](auto may_be) {
    slots::Peer* best = nullptr;
    for (slots::Peer& peer : peers_) {
      const bool is_meant =
          !is_guest(peer.index) && (!guards || among == nullptr || peer.endpoint.address == *among);
      if (is_meant && may_be(peer) && (best == nullptr || !is_due(best->last_seen, peer.last_seen))) {
        best = &peer;
      }
    }
    return best;
  };
  for (slots::Peer& peer : peers_) {
    peer.is_used = peer.subscribers > 0 || peer.remotes > 0;
  }
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    if (const std::uint16_t to = pending_[i].peer; to != slots::PendingEntry::to_multicast) {
      peers_[to].is_used = true;  // an answer is still to be sent there
    }
  }
  slots::Peer* found = oldest([](const slots::Peer& peer) { return !peer.is_used; });
  if (!guards || found != nullptr) {
    return found;
  }
  for (slots::Peer& peer : peers_) {
    peer.is_used = peer.subscribers > 0;
  }
  for (const slots::Remote& remote : remotes_) {
    slots::Peer& peer = peers_[remote.peer];
    peer.is_used = peer.is_used || remote.is_wanted;
  }
  found = oldest([](const slots::Peer& peer) { return !peer.is_used; });
  if constexpr (optimised_for_many) {
    for (const Standing standing : {Standing::fading, Standing::failed}) {
      found = found != nullptr
                  ? found
                  : oldest([&](const slots::Peer& peer) { return standing_of(peer, now) == standing; });
    }
  }
  return found != nullptr ? found : oldest([&](const slots::Peer& peer) { return is_fleeting(peer, now); });
}

// Forgets the peer with its subscriptions and services, and what waits to be sent to it. The peer stays if
// there is no room yet to report some of these ends.
void ServiceDiscovery::forget(slots::Peer& peer) noexcept {
  for (slots::Subscriber& subscription : subscribers_) {
    if (peer.subscribers > 0 && subscription.peer == peer.index) {
      count(counters_.displaced);
      lose(subscription, LossReason::displaced);
    }
  }
  for (slots::Remote& remote : remotes_) {
    if (peer.remotes > 0 && remote.peer == peer.index) {
      lose(remote, LossReason::displaced, {});
    }
  }
  pending_.remove_if([&](const slots::PendingEntry& pending) { return pending.peer == peer.index; });
  note_sessions(peer);
  if (peer.subscribers == 0 && peer.remotes == 0) {
    peers_.remove(peer);
  }
}

// The last place. Its peer never has subscriptions or services.
slots::Peer* ServiceDiscovery::guest() noexcept {
  slots::Peer& last = peers_[static_cast<std::uint16_t>(peers_.size() - 1)];
  if (last.slot_state == SlotBase::State::in_use) {
    const RateLimit entries = last.entries;
    forget(last);
    last.entries = entries;
  }
  return peers_.add_at(last);
}

// Whether the rate limit of the peer allows another entry. The first at an address counts for all of its
// ports; where there are few places, a host cannot have many.
bool ServiceDiscovery::within_rate(std::uint16_t peer, std::uint32_t cost, TimePoint now) noexcept {
  const Duration pause{1'000'000'000U / settings_.max_entries_per_second};
  if constexpr (optimised_for_many) {
    for (const slots::Peer& first : peers_) {
      if (first.endpoint.address == peers_[peer].endpoint.address) {
        peer = first.index;
        break;
      }
    }
  }
  if (peers_[peer].entries.take(now, pause, settings_.max_entries_at_once, cost)) {
    return true;
  }
  note(Limit::entries_per_second);
  count(counters_.ignored_too_many);
  return false;
}

namespace {

void note_outcome(slots::Peer& peer, slots::Probe& probe, bool is_answer) {
  probe.has_failed = !is_answer;
  if (!peer.is_to_prove) {
    peer.proofs = static_cast<std::uint8_t>(is_answer ? peer.proofs + 1 : peer.proofs - (peer.proofs != 0));
  }
  if (is_answer) {
    peer.is_to_prove = false;
    peer.heard = 0xffff;
  }
}

}  // namespace

// Where there is no room for all, a client is sent an Offer after a time that nobody can foresee. Clients
// answer an Offer with a Subscribe at once; who does so receives what is sent to its address, and is no
// passer-by: a flood from other addresses does not displace it any more. Who does not gives way to others.
//
// Who is in doubt is asked until it has answered several times: a forger who speaks in its name hits one of
// eleven, and each miss takes one back and costs a second.
void ServiceDiscovery::probe(const slots::Offer& offer, const Arrival& arrival) noexcept {
  using std::chrono::milliseconds;
  slots::Peer& peer = peers_[arrival.peer];
  const auto is_in_doubt = [&] { return peer.is_in_doubt && peer.proofs < slots::Peer::is_proven; };
  if (!peer.is_to_prove && !is_in_doubt()) {
    return;
  }
  for (slots::Probe& probe : peer.probe) {  // the one
    const auto at = static_cast<std::uint16_t>(slots::ticks(arrival.now));
    const auto since = static_cast<std::uint16_t>(at - probe.due);
    const bool is_answer = peer.is_probed && since < slots::Probe::time_to_answer;
    const bool is_over = !probe.was_sent() || (since >= 1000 && since < slots::Probe::not_due);
    // Those by multicast can be foreseen, and are answered, too.
    const TimePoint unforeseen = offer.last_multicast + milliseconds{100};
    const bool may_be_foreseen = !peer.is_to_prove && !is_due(unforeseen, arrival.now);
    if (peer.is_probed && !is_over && !is_answer) {
      // Who subscribes to much says it in several messages.
      const bool is_same = static_cast<std::uint16_t>(at - probe.asked) < 20;
      if (peer.is_to_prove || may_be_foreseen || is_same) {
        return;
      }
    }
    const bool proves_nothing = may_be_foreseen || since >= slots::Probe::time_to_prove;
    if (peer.is_probed && !(is_answer && proves_nothing)) {
      note_outcome(peer, probe, is_answer);
    }
    peer.is_probed = false;
    if (((is_answer && is_in_doubt()) || is_over) && has_room_for_answer(arrival.peer) &&
        may_be_sent(peer, arrival.now)) {
      const bool is_soon = peer.is_to_prove && !probe.has_failed;
      const Duration wait = is_soon ? random_.between(milliseconds{20}, milliseconds{100})
                                    : std::max<Duration>(milliseconds{20}, unforeseen - arrival.now) +
                                          random_.between(milliseconds{0}, milliseconds{600});
      probe.asked = at;
      probe.due = static_cast<std::uint16_t>(slots::ticks(arrival.now + wait));
      peer.is_probed = true;
      send_offer(offer, arrival.peer, arrival.now + wait, offer.ttl_s);
    }
  }
}

void ServiceDiscovery::doubt(const IpAddress& client) noexcept {
  for (slots::Peer& peer : peers_) {
    peer.is_in_doubt = peer.is_in_doubt || peer.endpoint.address == client;
  }
}

// --- Who makes room in a full table -----------------------------------------------------------------------

// Begun with what nobody else knows: else somebody could choose an address of the same mark as another's.
inline std::uint32_t ServiceDiscovery::hash_with_seed(const IpAddress& peer,
                                                      std::uint16_t more) const noexcept {
  const auto seed = static_cast<std::uint32_t>(settings_.seed ^ (settings_.seed >> 32U));
  return hash_of(seed ^ more, std::as_bytes(std::span{peer.bytes}));
}

std::uint16_t ServiceDiscovery::mark_of(const IpAddress& peer, std::uint16_t more) const noexcept {
  return static_cast<std::uint16_t>(
      std::max<std::uint32_t>(hash_with_seed(peer, more) >> 16U, 1));  // 0: none
}

void ServiceDiscovery::note_heard(slots::Peer& peer, TimePoint now) noexcept {
  if constexpr (guards) {
    const std::int64_t more = (now - peer.last_seen).count() >> 20U;
    peer.heard = static_cast<std::uint16_t>(std::min<std::int64_t>(peer.heard + more, 0xffff));
  }
  peer.last_seen = now;
}

// The peer with the highest Peer::held, after the counts of each address have been added up.
const slots::Peer* ServiceDiscovery::who_holds_most() noexcept {
  const slots::Peer* most = nullptr;
  for (slots::Peer& peer : peers_) {
    if (optimised_for_many && peer.held == 0) {
      continue;  // of many peers few have something that is looked for
    }
    for (slots::Peer& later : peers_) {
      if (later.index > peer.index && (!optimised_for_many || later.held != 0) &&
          later.endpoint.address == peer.endpoint.address) {
        peer.held = static_cast<std::uint16_t>(peer.held + std::exchange(later.held, std::uint16_t{0}));
      }
    }
    if (most == nullptr || most->held < peer.held) {
      most = &peer;
    }
  }
  return most;
}

inline ServiceDiscovery::Standing ServiceDiscovery::standing_of(const slots::Peer& peer,
                                                                TimePoint now) const noexcept {
  const bool failed = has_failed(peer, now);
  if (!is_fleeting(peer, now)) {
    return failed ? Standing::failed : Standing::stays;
  }
  return peer.is_probed && !failed && !is_silent(peer, now) ? Standing::asked : Standing::fading;
}

namespace {

// Of subscribers, where nobody is silent or fading: the oldest one who failed to answer whether it hears us;
// or, if more are asked than failed, as in a flood from ever new addresses, of those who are.
template <typename Standing, typename Slot, typename Of>
Slot* oldest_asked(const Table<Slot>& table, const Table<slots::Peer>& peers, Of standing_of) {
  struct Found {
    Slot* oldest = nullptr;
    std::size_t count = 0;
  };
  Found asked;
  Found failed;
  for (Slot& slot : table) {
    const Standing standing = standing_of(slot);
    if (standing == Standing::asked || standing == Standing::failed) {
      Found& found = standing == Standing::asked ? asked : failed;
      ++found.count;
      if (found.oldest == nullptr ||
          !is_due(peers[found.oldest->peer].last_seen, peers[slot.peer].last_seen)) {
        found.oldest = &slot;
      }
    }
  }
  return asked.count > failed.count ? asked.oldest : failed.oldest;
}

}  // namespace

// First choice: one of a peer that is silent, or fleeting, if the newcomer has nothing yet or has itself been
// heard for some time. So a flood from ever new addresses displaces itself, and an honest peer stays after it
// has come back. Of subscribers that is not one who was just asked whether it hears us, but rather one who
// failed to answer: oldest_asked(). Otherwise: one of the address that has clearly more than the newcomer's.
// If there are fleeting peers, only their addresses count: each of a flood could take two from a host that
// has many.
template <typename Slot, typename Candidate>
Slot* ServiceDiscovery::who_gives_way(const Table<Slot>& table, std::uint16_t newcomer, TimePoint now,
                                      Candidate is_candidate) noexcept {
  constexpr std::uint16_t some_time = 477;  // half a second
  // Only clients are asked whether they hear us.
  constexpr bool are_asked = optimised_for_many && std::is_same_v<Slot, slots::Subscriber>;
  const auto is_fading = [&](const slots::Peer& peer) {
    return is_fleeting(peer, now) && !(are_asked && standing_of(peer, now) == Standing::asked);
  };
  const IpAddress& its = peers_[newcomer].endpoint.address;
  for (slots::Peer& peer : peers_) {
    peer.held = 0;
  }
  std::size_t own = 0;
  Slot* oldest = nullptr;
  for (Slot& slot : table) {
    if (is_candidate(slot)) {
      slots::Peer& peer = peers_[slot.peer];
      const bool is_own = peer.endpoint.address == its;
      ++peer.held;
      own += static_cast<std::size_t>(is_own);
      if ((is_own ? is_silent(peer, now) : is_fading(peer)) &&
          (oldest == nullptr || !is_due(peers_[oldest->peer].last_seen, peer.last_seen))) {
        oldest = &slot;
      }
    }
  }
  if (are_asked && oldest == nullptr) {
    oldest = oldest_asked<Standing>(table, peers_, [&](const Slot& slot) {
      const bool may_go = is_candidate(slot) && peers_[slot.peer].endpoint.address != its;
      return may_go ? standing_of(peers_[slot.peer], now) : Standing::stays;
    });
  }
  if (oldest != nullptr) {
    if (own == 0 || peers_[newcomer].heard >= some_time || is_silent(peers_[oldest->peer], now)) {
      return oldest;
    }
    for (slots::Peer& peer : peers_) {
      const bool may_go = is_fleeting(peer, now) || (are_asked && standing_of(peer, now) == Standing::failed);
      peer.held = may_go ? peer.held : std::uint16_t{0};
    }
  }
  const slots::Peer* const most = who_holds_most();
  Slot* last = nullptr;
  for (Slot& slot : table) {
    if (most != nullptr && most->held >= own + 2 && is_candidate(slot) &&
        peers_[slot.peer].endpoint.address == most->endpoint.address) {
      last = &slot;
    }
  }
  return last;
}

// The limit that keeps another subscription out, if no other one gives way either.
std::optional<Limit> ServiceDiscovery::make_room(const slots::Offer& offer, EventgroupId eventgroup,
                                                 const Arrival& arrival) noexcept {
  if (is_guest(arrival.peer)) {
    return Limit::peers;
  }
  const IpAddress& address = peers_[arrival.peer].endpoint.address;
  if (subscribers_of(offer.index, eventgroup, &address) >=
      settings_.max_subscribers_per_eventgroup_and_address) {
    return Limit::subscribers_per_eventgroup_and_address;
  }
  const std::size_t count_here = subscribers_of(offer.index, eventgroup, nullptr);
  const bool group_is_full = count_here >= settings_.max_subscribers_per_eventgroup;
  const auto is_candidate = [&](const slots::Subscriber& one) {
    const bool is_here = one.offer == offer.index && one.eventgroup == eventgroup;
    return one.peer != slots::Subscriber::nobody && (is_here || !group_is_full);
  };
  if constexpr (optimised_for_many) {
    const bool is_last_here = count_here + 1 >= settings_.max_subscribers_per_eventgroup;
    if (is_last_here || subscribers_.free_slots() < 2) {
      suspect(peers_[arrival.peer]);
      for (const slots::Subscriber& one : subscribers_) {
        const bool is_here = one.offer == offer.index && one.eventgroup == eventgroup;
        if (one.peer == slots::Subscriber::nobody || (!is_here && is_last_here)) {
          continue;
        }
        const bool is_new = !peers_[one.peer].is_in_doubt;
        suspect(peers_[one.peer]);
        if (is_new) {  // now, not when it subscribes next: it might have made room by then
          probe(offers_[one.offer], {arrival.message, arrival.source, one.peer, arrival.via_multicast,
                                     arrival.answer_due, arrival.now});
        }
      }
    }
  }
  if (!group_is_full && subscribers_.free_slots() > 0) {
    return std::nullopt;
  }
  slots::Subscriber* const other = may_displace(peers_[arrival.peer], arrival.now)
                                       ? who_gives_way(subscribers_, arrival.peer, arrival.now, is_candidate)
                                       : nullptr;
  if (other == nullptr) {
    return group_is_full ? Limit::subscribers_per_eventgroup : Limit::subscribers;
  }
  count(counters_.displaced);
  lose(*other, LossReason::displaced);
  return event_places() > 0 ? std::nullopt : std::optional{Limit::pending_events};
}

// Services that nobody requires are remembered too, as long as there is room: a later requirement then needs
// no Find. They give way to required ones.  [feat_req_someipsd_17]
slots::Remote* ServiceDiscovery::new_remote(std::size_t wanting, const Arrival& arrival) noexcept {
  if (is_guest(arrival.peer)) {
    return nullptr;
  }
  slots::Remote* const slot = remotes_.add();
  if (slot != nullptr || wanting == 0) {
    return slot;
  }
  if (slots::Remote* const unneeded =
          remotes_.find_if([](const slots::Remote& remote) { return !remote.is_wanted; })) {
    remove(*unneeded);
  } else if constexpr (guards) {
    make_room_for_remote(arrival);
  }
  return remotes_.add();
}

void ServiceDiscovery::make_room_for_remote(const Arrival& arrival) noexcept {
  if (slots::Remote* const other = who_gives_way(remotes_, arrival.peer, arrival.now,
                                                 [](const slots::Remote& /*any*/) { return true; })) {
    count(counters_.displaced);
    lose(*other, LossReason::displaced, arrival.now);
  }
}

// Whether a connection is from before the restart of a peer: an old subscription uses it, or it existed at
// the last SD message of the peer. A later connection may be from after the restart, because clients connect
// before they send SD messages. If it is not, the probes of the connection find out.
bool ServiceDiscovery::is_outdated(const slots::TcpConnection& connection,
                                   std::uint16_t peer) const noexcept {
  return (connection.peer_spoke && connection.remote.address == peers_[peer].endpoint.address) ||
         subscribers_.find_if([&](const slots::Subscriber& one) {
           return one.peer == peer && one.tcp == connection.remote &&
                  offers_[one.offer].tcp == connection.own;
         }) != nullptr;
}

// What the peer had is gone; this message may already bring new entries.  [feat_req_someipsd_871]
void ServiceDiscovery::on_reboot(std::uint16_t peer, TimePoint now) noexcept {
  count(counters_.reboots_detected);
  for (slots::TcpConnection& connection : tcp_connections_) {
    if (is_outdated(connection, peer)) {
      lose(connection);
    }
  }
  for (slots::Subscriber& subscription : subscribers_) {
    if (subscription.peer == peer) {
      lose(subscription, LossReason::rebooted);
    }
  }
  for (slots::Remote& remote : remotes_) {
    if (remote.peer == peer) {
      lose(remote, LossReason::rebooted, now);
    }
  }
}

}  // namespace trestle::sd
