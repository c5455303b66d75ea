// Losses are never untold: what ended keeps its slot, unseen by everybody else, until there is room for the
// event. Then a reboot, or a link that goes down, may end more than there are places for events.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

void ServiceDiscovery::lose(slots::TcpConnection& connection) noexcept {
  Table<slots::TcpConnection>::lose(connection, LossReason::rebooted);
  ++untold_;
  tell_loss(connection);
}

void ServiceDiscovery::tell_loss(slots::TcpConnection& connection) noexcept {
  if (events_.free_places() > 0) {
    tell(ConnectionOutdated{connection.own, connection.remote});  // [feat_req_someipsd_872]
    tcp_connections_.remove(connection);
    --untold_;
  }
}

void ServiceDiscovery::lose(slots::Subscription& subscription, LossReason reason) noexcept {
  Table<slots::Subscription>::lose(subscription, reason);
  ++untold_;
  tell_loss(subscription);
}

void ServiceDiscovery::tell_loss(slots::Subscription& subscription) noexcept {
  if (events_.free_places() > 0) {
    tell(SubscriberRemoved{offers_.handle_of<OfferHandle>(offers_[subscription.offer]),
                           subscription.eventgroup, subscriber_of(subscription), subscription.loss_reason()});
    remove(subscription);
    --untold_;
  }
}

// The subscription itself stays: the application still wishes for it.
void ServiceDiscovery::lose(slots::OwnSubscription& subscription, LossReason reason) noexcept {
  subscription.set_loss(reason);
  ++untold_;
  tell_loss(subscription);
}

void ServiceDiscovery::tell_loss(slots::OwnSubscription& subscription) noexcept {
  if (events_.free_places() > 0) {
    tell(SubscriptionLost{subscriptions_.handle_of<SubscriptionHandle>(subscription),
                          subscription.loss_reason()});
    subscription.loss = SlotBase::no_loss;
    --untold_;
  }
}

// Of a service: each requirement that it was for, but none that has not been told of it yet.
void ServiceDiscovery::tell_loss(slots::Remote& remote) noexcept {
  for (const slots::Requirement& requirement : requirements_) {
    if (requirement.index < remote.told || requirement.told <= remote.index || !fits(requirement, remote)) {
      continue;
    }
    if (events_.free_places() == 0) {
      remote.told = requirement.index;
      return;
    }
    tell(ServiceLost{requirements_.handle_of<RequirementHandle>(requirement), service_of(remote),
                     remote.loss_reason()});
  }
  remove(remote);
  --untold_;
}

// Of the services that were known before it.
void ServiceDiscovery::tell_known(slots::Requirement& requirement) noexcept {
  for (const slots::Remote& remote : remotes_) {
    if (remote.index < requirement.told || !fits(requirement, remote)) {
      continue;
    }
    if (events_.free_places() == 0) {
      requirement.told = remote.index;
      return;
    }
    tell_available(requirement, remote);
  }
  requirement.told = slots::Requirement::all;
  --untold_;
}

// Whose subscriptions end is told before the service is lost; what is new comes last, for it may be what was
// lost before.
void ServiceDiscovery::tell_what_is_untold() noexcept {
  for (slots::TcpConnection& connection : tcp_connections_.lost()) {
    tell_loss(connection);
  }
  for (slots::Subscription& subscription : subscribers_.lost()) {
    tell_loss(subscription);
  }
  for (slots::OwnSubscription& subscription : subscriptions_) {
    if (subscription.loss != SlotBase::no_loss) {
      tell_loss(subscription);
    }
  }
  for (slots::Remote& remote : remotes_.lost()) {
    tell_loss(remote);
  }
  for (slots::Requirement& requirement : requirements_) {
    if (requirement.told != slots::Requirement::all) {
      tell_known(requirement);
    }
  }
}

}  // namespace trestle::sd
