#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "sd/core/storage.hpp"

namespace trestle::sd {

/// The memory of one ServiceDiscovery, sized at run time and taken from the heap.
class HeapStorage {
 public:
  explicit HeapStorage(const Limits& limits)
      : offers_(limits.max_offers),
        eventgroups_(limits.max_eventgroups),
        subscribers_(limits.max_subscribers),
        requirements_(limits.max_requirements),
        subscriptions_(limits.max_subscriptions),
        remotes_(limits.max_remote_services),
        peers_(limits.max_peers + std::size_t{1}),
        tcp_connections_(limits.max_tcp_connections),
        pending_entries_(limits.max_pending_entries),
        pending_events_(limits.max_pending_events),
        configuration_bytes_((limits.max_configurations + std::size_t{1}) * limits.max_configuration_bytes),
        configurations_(limits.max_configurations),
        silences_(limits.max_silent_hosts),
        rivals_(limits.max_silent_hosts),
        remote_ids_(limits.max_remote_services),
        requirement_ids_(limits.max_requirements) {}

  [[nodiscard]] StorageView view() noexcept {
    return {offers_,
            eventgroups_,
            subscribers_,
            requirements_,
            subscriptions_,
            remotes_,
            peers_,
            tcp_connections_,
            pending_entries_,
            pending_events_,
            configuration_bytes_,
            configurations_,
            silences_,
            rivals_,
            {remote_ids_, requirement_ids_}};
  }
  /// Calls `visit(name, used, limit)` for each limit that peers or the application can reach.
  template <typename Visit>
  void for_each_limit(Visit visit) const {
    const auto one = [&](const char* name, const auto& slots) {
      const auto used = std::ranges::count(slots, SlotBase::State::in_use, &SlotBase::slot_state);
      visit(name, static_cast<std::size_t>(used), slots.size());
    };
    one("max_offers", offers_);
    one("max_subscribers", subscribers_);
    one("max_requirements", requirements_);
    one("max_subscriptions", subscriptions_);
    one("max_remote_services", remotes_);
    one("max_peers", peers_);
    one("max_tcp_connections", tcp_connections_);
  }

 private:
  std::vector<slots::Offer> offers_;
  std::vector<slots::OfferedEventgroup> eventgroups_;
  std::vector<slots::Subscriber> subscribers_;
  std::vector<slots::Requirement> requirements_;
  std::vector<slots::Subscription> subscriptions_;
  std::vector<slots::Remote> remotes_;
  std::vector<slots::Peer> peers_;
  std::vector<slots::TcpConnection> tcp_connections_;
  std::vector<slots::PendingEntry> pending_entries_;
  std::vector<Happening> pending_events_;
  std::vector<std::byte> configuration_bytes_;
  std::vector<slots::ConfigurationBlock> configurations_;
  std::vector<slots::Silence> silences_;
  std::vector<slots::Rival> rivals_;
  std::vector<ServiceId> remote_ids_;
  std::vector<ServiceId> requirement_ids_;
};

}  // namespace trestle::sd
