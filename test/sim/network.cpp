#include "test/sim/network.hpp"

#include <gtest/gtest.h>

#include <array>

#include "test/sd/describe.hpp"

namespace trestle::test {

void SimNode::start(TimePoint now) {
  discovery_.reset();
  storage_ = std::make_unique<sd::Storage<>>();
  discovery_ = std::make_unique<sd::ServiceDiscovery>(settings_, storage_->view());
  available.clear();
  subscribed.clear();
  added = 0;
  application_(*this, now);
}

void SimNode::take_events(TimePoint now) {
  while (const auto event = discovery_->poll_event()) {
    const auto at = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
    log.push_back(std::to_string(at) + "ms " + describe(*event));
    if (const auto* up = std::get_if<sd::ServiceAvailable>(&*event)) {
      available[{up->service.service, up->service.instance}] = up->service.peer;
    } else if (const auto* down = std::get_if<sd::ServiceLost>(&*event)) {
      available.erase({down->service.service, down->service.instance});
    } else if (const auto* yes = std::get_if<sd::Subscribed>(&*event)) {
      subscribed.insert(yes->subscription.index);
    } else if (const auto* over = std::get_if<sd::SubscriptionLost>(&*event)) {
      subscribed.erase(over->subscription.index);
    } else if (const auto* no = std::get_if<sd::SubscriptionRefused>(&*event)) {
      subscribed.erase(no->subscription.index);
    } else if (std::holds_alternative<sd::SubscriberAdded>(*event)) {
      ++added;
    } else if (std::holds_alternative<sd::SubscriberRemoved>(*event)) {
      --added;
    }
  }
}

SimNode& SimNetwork::add(sd::Settings settings, SimNode::Application application) {
  settings.seed = random_.next();
  nodes_.push_back(std::make_unique<SimNode>(settings, std::move(application)));
  nodes_.back()->start(now);
  return *nodes_.back();
}

void SimNetwork::transmit(const SimNode& from, const sd::Transmit& datagram) {
  ++sent;
  if (describe_datagram(datagram.bytes).starts_with("malformed")) {
    ++malformed;
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const SimNode& to = *nodes_[i];
    const bool multicast = datagram.destination.address.is_multicast();
    if (!multicast && datagram.destination != to.endpoint()) {
      continue;
    }
    const bool own = &to == &from;  // a host hears what it sends to a group
    if (!own && (cut_.contains(&from) || cut_.contains(&to) || percent(conditions.loss_percent))) {
      continue;
    }
    for (int copies = percent(conditions.duplication_percent) ? 2 : 1; copies > 0; --copies) {
      in_flight_.push({now + random_.between(conditions.delay_min, conditions.delay_max),
                       order_++,
                       i,
                       from.endpoint(),
                       multicast,
                       {datagram.bytes.begin(), datagram.bytes.end()}});
    }
  }
}

void SimNetwork::serve(SimNode& node) {
  if (!node.running()) {
    return;
  }
  std::array<std::byte, 1400> room{};
  node.discovery().on_time(now);
  for (bool busy = true; busy;) {
    busy = false;
    while (const auto datagram = node.discovery().poll_transmit(room, now)) {
      transmit(node, *datagram);
      busy = true;
    }
    node.take_events(now);
  }
}

void SimNetwork::deliver() {
  while (!in_flight_.empty() && in_flight_.top().at <= now) {
    const Delivery delivery = in_flight_.top();
    in_flight_.pop();
    SimNode& node = *nodes_[delivery.to];
    if (node.running()) {
      node.discovery().on_datagram(delivery.bytes, delivery.from, delivery.via_multicast, now);
      serve(node);
    }
  }
}

void SimNetwork::run_for(Duration duration) {
  const TimePoint end = now + duration;
  for (std::size_t steps = 0; steps < 10'000'000; ++steps) {
    for (const auto& node : nodes_) {
      serve(*node);
    }
    std::optional<TimePoint> next;
    const auto consider = [&next](std::optional<TimePoint> at) {
      if (at && (!next || *at < *next)) {
        next = at;
      }
    };
    for (const auto& node : nodes_) {
      if (node->running()) {
        consider(node->discovery().deadline());
      }
    }
    if (!in_flight_.empty()) {
      consider(in_flight_.top().at);
    }
    if (!next || *next > end) {
      now = end;
      return;
    }
    now = std::max(now, *next);
    deliver();
  }
  ADD_FAILURE() << "the simulation does not move on";
}

}  // namespace trestle::test
