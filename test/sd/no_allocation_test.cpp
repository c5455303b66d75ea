// Service discovery allocates nothing, not even in its constructor: every use of operator new in this program
// is counted.
#include <gtest/gtest.h>

#include <array>

#include "sd/core/service_discovery.hpp"
#include "test/allocations.hpp"

namespace trestle::sd::no_allocation_test {
namespace {
using namespace std::chrono_literals;

constexpr Endpoint a_at{IpAddress::v4(10, 0, 0, 1), 30490};
constexpr Endpoint b_at{IpAddress::v4(10, 0, 0, 2), 30490};

Settings settings_at(const Endpoint& endpoint) {
  Settings settings;
  settings.unicast = endpoint;
  return settings;
}

// Carries what `from` sends to `to`, and counts the events there.
std::size_t carry(ServiceDiscovery& from, const Endpoint& from_at, ServiceDiscovery& to, TimePoint now) {
  std::array<std::byte, 1400> room{};
  while (const auto datagram = from.poll_transmit(room, now)) {
    to.on_datagram(datagram->bytes, from_at, datagram->destination.address.is_multicast(), now);
  }
  std::size_t events = 0;
  while (to.poll_event()) {
    ++events;
  }
  return events;
}

TEST(NoAllocation, HappensInServiceDiscovery) {
  static Storage<Limits{.max_offers = 4, .max_subscriptions = 4, .max_pending_entries = 32}> a_storage;
  static Storage<Limits{.max_offers = 4, .max_subscriptions = 4, .max_pending_entries = 32}> b_storage;
  const std::array<ConfigurationItem, 2> said{{{"a", "1"}, {"b", std::nullopt}}};
  const std::array<ConfigurationItem, 1> named{{{"otherserv", "diag"}}};
  const std::array groups{Eventgroup{.id = EventgroupId{1}}};
  std::size_t events = 0;
  std::size_t configured = 0;
  const std::size_t before = test::allocations();
  {
    TimePoint now{1000s};
    ServiceDiscovery a{settings_at(a_at), a_storage.view()};
    ServiceDiscovery b{settings_at(b_at), b_storage.view()};
    const auto offer = a.offer({.service = ServiceId{1},
                                .instance = InstanceId{1},
                                .udp = Endpoint{a_at.address, 1},
                                .eventgroups = groups,
                                .configuration = said,
                                .options = {.load_balancing = LoadBalancingOption{.priority = 1}}},
                               now);
    const auto other = a.offer({.service = other_protocols,
                                .instance = InstanceId{1},
                                .configuration = named,
                                .options = {.mac_groupcast = MacGroupcastOption{.protocol = 0x22f0}}},
                               now);
    const auto stream = b.require({.service = other_protocols, .otherserv = "diag"}, now);
    const auto requirement = b.require({.service = ServiceId{1}, .instance = InstanceId{1}}, now);
    const auto subscription =
        b.subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = Endpoint{b_at.address, 1}}, now);
    for (int i = 0; i < 5000; ++i) {
      now += 1ms;
      a.on_time(now);
      b.on_time(now);
      events += carry(a, a_at, b, now);
      events += carry(b, b_at, a, now);
      static_cast<void>(a.deadline());
    }
    for (const auto required : {*requirement, *stream}) {
      ConfigurationCursor items = b.configuration(b.choose(required).value_or(RemoteService{}).handle);
      while (items.next()) {
        ++configured;
      }
    }
    b.unsubscribe(*subscription, now);
    events += carry(b, b_at, a, now);
    a.stop_offer(*offer, now);
    a.stop_offer(*other, now);
    events += carry(a, a_at, b, now);
    a.shutdown(now);
    b.shutdown(now);
  }
  EXPECT_EQ(test::allocations() - before, 0U);
  EXPECT_EQ(events, 7U);  // available and lost of both, added, subscribed, removed
  EXPECT_EQ(configured, 3U);
}

}  // namespace
}  // namespace trestle::sd::no_allocation_test
