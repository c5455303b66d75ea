// The peers we hear from or talk to: their sessions, and what a reboot of one entails.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

slots::Peer* ServiceDiscovery::peer_at(const Endpoint& endpoint, TimePoint now) noexcept {
  slots::Peer* found = peers_.find_if([&](const slots::Peer& peer) { return peer.endpoint == endpoint; });
  if (found == nullptr) {
    found = peers_.add();
  }
  if (found == nullptr) {
    found = forget_a_peer();
  }
  if (found != nullptr) {
    found->endpoint = endpoint;
    found->last_seen = now;
  }
  return found;
}

// When the table is full, the peer that was silent the longest and has nothing with us makes room. Should it
// come back, our session towards it starts again, which it takes for a reboot of ours: it then asks us anew,
// no more.
slots::Peer* ServiceDiscovery::forget_a_peer() noexcept {
  for (slots::Peer& peer : peers_) {
    peer.referenced = false;
  }
  const auto mark_all = [this](const auto& slots) {
    for (const auto& slot : slots) {
      if (slot.peer != slots::Subscription::nobody) {
        peers_[slot.peer].referenced = true;
      }
    }
  };
  mark_all(subscribers_);
  mark_all(subscribers_.lost());
  mark_all(remotes_);
  mark_all(remotes_.lost());
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    const std::uint16_t peer = pending_[i].peer;
    if (peer != slots::PendingEntry::to_multicast) {
      peers_[peer].referenced = true;
    }
  }
  slots::Peer* oldest = nullptr;
  for (slots::Peer& peer : peers_) {
    if (!peer.referenced && (oldest == nullptr || !is_due(oldest->last_seen, peer.last_seen))) {
      oldest = &peer;
    }
  }
  if (oldest == nullptr) {
    return nullptr;
  }
  peers_.remove(*oldest);
  return peers_.add();
}

// Whether a connection is of the former life of a peer that was started anew: a subscription of that life
// uses it, or it stood when the peer spoke last. What was opened since may be of the new life, whose clients
// connect before they say anything; if not, the probes of the connection find out.
bool ServiceDiscovery::is_outdated(const slots::TcpConnection& connection,
                                   std::uint16_t peer) const noexcept {
  return (connection.peer_spoke && connection.remote.address == peers_[peer].endpoint.address) ||
         subscribers_.find_if([&](const slots::Subscription& one) {
           return one.peer == peer && one.tcp == connection.remote &&
                  offers_[one.offer].tcp == connection.own;
         }) != nullptr;
}

// What the peer had with us is gone with its former life; the message that showed the reboot may already
// start anew.  [feat_req_someipsd_871]
void ServiceDiscovery::on_reboot(std::uint16_t peer, TimePoint now) noexcept {
  count(counters_.reboots_detected);
  for (slots::TcpConnection& connection : tcp_connections_) {
    if (is_outdated(connection, peer)) {
      lose(connection);
    }
  }
  for (slots::Subscription& subscription : subscribers_) {
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
