// test/sim: several nodes in virtual time, with delay, loss, reordering, duplication and partition.
//
//   network.hpp           the network and its nodes; all that is random comes from one seed
//   sd_network_test.cpp   service discovery in it
//
// An hour takes milliseconds, and a seed that failed gives the same run again.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "sd/core/service_discovery.hpp"

namespace trestle::test {

/// What happens to a datagram on its way. Different delays reorder datagrams.
struct Conditions {
  Duration delay_min = std::chrono::microseconds{100};
  Duration delay_max = std::chrono::microseconds{100};
  unsigned loss_percent = 0;
  unsigned duplication_percent = 0;
};

/// A node of the simulated network: a ServiceDiscovery, and what its application knows from its events.
class SimNode {
 public:
  /// What the application does when it starts: offers, requirements, subscriptions.
  using Application = std::function<void(SimNode&, TimePoint)>;

  SimNode(const sd::Settings& settings, Application application)
      : settings_{settings}, application_{std::move(application)} {}

  /// Starts the node anew, as after a crash: nothing is said to the others.
  void start(TimePoint now);
  /// Stops it without a word.
  void crash() { discovery_.reset(); }
  [[nodiscard]] bool running() const { return discovery_ != nullptr; }
  [[nodiscard]] sd::ServiceDiscovery& discovery() { return *discovery_; }
  [[nodiscard]] const Endpoint& endpoint() const { return settings_.unicast; }

  /// Drains the events into `log` and the sets below.
  void take_events(TimePoint now);

  std::vector<std::string> log;  ///< every event, with its time
  /// Endpoints at which a service is available, by (service, instance).
  std::map<std::pair<sd::ServiceId, sd::InstanceId>, Endpoint> available;
  std::set<std::uint16_t> subscribed;  ///< handle indices of accepted subscriptions
  std::size_t added = 0;               ///< SubscriberAdded minus SubscriberRemoved

 private:
  sd::Settings settings_;
  Application application_;
  std::unique_ptr<sd::Storage<>> storage_;
  std::unique_ptr<sd::ServiceDiscovery> discovery_;
};

/// Nodes joined by a network in virtual time. All that is random comes from one seed.
class SimNetwork {
 public:
  explicit SimNetwork(std::uint64_t seed) : random_{seed} {}

  /// Adds a node and starts it. It lives as long as the network.
  SimNode& add(sd::Settings settings, SimNode::Application application);
  void run_for(Duration duration);

  /// Cuts the node off from all others, or joins it again.
  void cut(const SimNode& node, bool off) {
    if (off) {
      cut_.insert(&node);
    } else {
      cut_.erase(&node);
    }
  }

  Conditions conditions;
  TimePoint now{std::chrono::seconds{1000}};
  std::size_t malformed = 0;  ///< datagrams sent that are not flawless SD messages
  std::size_t sent = 0;
  [[nodiscard]] sd::Random& random() { return random_; }

 private:
  struct Delivery {
    TimePoint at;
    std::uint64_t order;
    std::size_t to;
    Endpoint from;
    bool via_multicast;
    std::vector<std::byte> bytes;
    friend bool operator>(const Delivery& a, const Delivery& b) {
      return std::tie(a.at, a.order) > std::tie(b.at, b.order);
    }
  };

  void serve(SimNode& node);
  void transmit(const SimNode& from, const sd::Transmit& datagram);
  void deliver();
  bool percent(unsigned chance) { return random_.next() % 100 < chance; }

  sd::Random random_;
  std::vector<std::unique_ptr<SimNode>> nodes_;
  std::set<const SimNode*> cut_;
  std::priority_queue<Delivery, std::vector<Delivery>, std::greater<>> in_flight_;
  std::uint64_t order_ = 0;
};

}  // namespace trestle::test
