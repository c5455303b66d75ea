// Losses and new services are always reported: what ended keeps its slot, hidden from everything else, until
// there is room for the event. So a reboot or a link that goes down may end more than there are places for
// events. Without guards the queue has to be large enough, and events that it has no room for are counted.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

void ServiceDiscovery::lose(slots::TcpConnection& connection) noexcept {
  Table<slots::TcpConnection>::lose(connection, LossReason::rebooted);
  tell_loss(connection);
}

bool ServiceDiscovery::has_place_or_waits() noexcept {
  const bool has_place = events_.free_places() > 0;
  is_some_untold_ = is_some_untold_ || !has_place;
  return has_place;
}

void ServiceDiscovery::tell_loss(slots::TcpConnection& connection) noexcept {
  if (has_place_to_tell()) {
    tell([&] { return ConnectionOutdated{connection.own, connection.remote}; });  // [feat_req_someipsd_872]
    tcp_connections_.remove(connection);
  }
}

void ServiceDiscovery::lose(slots::Subscriber& subscription, LossReason reason) noexcept {
  Table<slots::Subscriber>::lose(subscription, reason);
  tell_loss(subscription);
}

void ServiceDiscovery::tell_loss(slots::Subscriber& subscription) noexcept {
  if (has_place_to_tell()) {
    tell([&] {
      return SubscriberRemoved{offers_.handle_of<OfferHandle>(offers_[subscription.offer]),
                               subscription.eventgroup, subscriber_of(subscription),
                               subscription.loss_reason()};
    });
    remove(subscription);
  }
}

// The subscription itself stays: the application still wants it.
void ServiceDiscovery::lose(slots::Subscription& subscription, LossReason reason) noexcept {
  subscription.set_loss(reason);
  tell_loss(subscription);
}

void ServiceDiscovery::tell_loss(slots::Subscription& subscription) noexcept {
  if (has_place_to_tell()) {
    tell([&] {
      return SubscriptionLost{subscriptions_.handle_of<SubscriptionHandle>(subscription),
                              subscription.loss_reason()};
    });
    subscription.loss = SlotBase::no_loss;
  }
}

// Of a service: reports to each requirement that it matched, except those that have not been told of it yet.
void ServiceDiscovery::tell_loss(slots::Remote& remote) noexcept {
  for (const slots::Requirement& requirement : requirements_) {
    if (!remote.is_wanted) {
      break;
    }
    const bool is_told =
        guards && (requirement.index < remote.told() || remote.announced <= requirement.index ||
                   requirement.told <= remote.index);
    if (is_told || !fits(requirement, remote)) {
      continue;
    }
    if (!has_place_to_tell()) {
      remote.told() = requirement.index;
      return;
    }
    tell([&] {
      return ServiceLost{requirements_.handle_of<RequirementHandle>(requirement), service_of(remote),
                         remote.loss_reason()};
    });
  }
  remove(remote);
}

// Reports to each requirement that the service matches, except those that are told of all services later.
void ServiceDiscovery::tell_new(slots::Remote& remote) noexcept {
  for (slots::Requirement& requirement : requirements_) {
    const bool is_told = guards && (requirement.index < remote.announced || requirement.told <= remote.index);
    if (is_told || !fits(requirement, remote)) {
      continue;
    }
    if (!has_place_to_tell()) {
      remote.announced = requirement.index;
      return;
    }
    tell_available(requirement, remote);
  }
  remote.announced = slots::Requirement::all;
}

// Reports the services that were known before the requirement.
void ServiceDiscovery::tell_known(slots::Requirement& requirement) noexcept {
  for (const slots::Remote& remote : remotes_) {
    if ((guards && remote.index < requirement.told) || !fits(requirement, remote)) {
      continue;
    }
    if (!has_place_to_tell()) {
      requirement.told = remote.index;
      return;
    }
    tell_available(requirement, remote);
  }
  requirement.told = slots::Requirement::all;
}

// Ends of subscriptions come before losses of services; new services last, as they may have been lost before.
void ServiceDiscovery::tell_what_is_untold() noexcept {
  is_some_untold_ = false;  // until it turns out that there is more
  const auto tell_losses = [this](auto&& slots) {
    for (auto& slot : slots) {
      if (slot.loss != SlotBase::no_loss) {
        tell_loss(slot);
      }
    }
  };
  tell_losses(tcp_connections_.all());
  tell_losses(subscribers_.all());
  tell_losses(subscriptions_);
  tell_losses(remotes_.all());
  for (slots::Remote& remote : remotes_) {
    if (remote.announced != slots::Requirement::all) {
      tell_new(remote);
    }
  }
  for (slots::Requirement& requirement : requirements_) {
    if (requirement.told != slots::Requirement::all) {
      tell_known(requirement);
    }
  }
}

}  // namespace trestle::sd
