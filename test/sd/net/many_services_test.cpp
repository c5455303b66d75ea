// More services than the default limits have room for, and how few datagrams they take.
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::many_services_test {
namespace {

using someip::Message;
using namespace std::chrono_literals;

constexpr std::uint16_t many = 400;

NodeConfig sized(const IpAddress& address) {
  NodeConfig config = test::quick(address);
  config.timing.cyclic_offer_delay = 0s;  // only who asks is answered, by unicast
  config.limits = {.max_offers = many,
                   .max_eventgroups = many,
                   .max_subscribers = many,
                   .max_requirements = many,
                   .max_subscriptions = many,
                   .max_remote_services = 2 * many,  // lost ones keep their places until that is told
                   .max_pending_entries = 2 * many,
                   .max_pending_events = 128};
  return config;
}

class ManyServices : public test::TwoNodes {
 protected:
  void offer_all(Node& server) {
    for (std::uint16_t i = 0; i < many; ++i) {
      server.offer({.service = ServiceId{static_cast<std::uint16_t>(0x1000U + i)},
                    .instance = InstanceId{1},
                    .udp_port = 0,
                    .eventgroups = {{.id = EventgroupId{1}, .events = {someip::MethodId{0x8001}}}}});
    }
  }
  void subscribe_all(Node& client) {
    for (std::uint16_t i = 0; i < many; ++i) {
      subscriptions.push_back(client.subscribe({.service = ServiceId{static_cast<std::uint16_t>(0x1000U + i)},
                                                .instance = InstanceId{1},
                                                .eventgroup = EventgroupId{1},
                                                .events = {someip::MethodId{0x8001}}},
                                               [](const Message&, const Endpoint&) {}));
    }
  }
  [[nodiscard]] bool all_are_subscribed(const Node& client) const {
    return std::ranges::all_of(subscriptions, [&](SubscriptionId id) { return client.subscribed(id); });
  }

  std::vector<SubscriptionId> subscriptions;
};

TEST_F(ManyServices, ThatAppearAtOnceAreSubscribedToInFewDatagrams) {
  Node server{io, sized(test::server_address)};
  offer_all(server);
  run_for(200ms);  // their offers are over
  Node client{io, sized(test::client_address)};
  subscribe_all(client);
  ASSERT_TRUE(run_until([&] { return all_are_subscribed(client); }));
  EXPECT_LT(client.discovery_counters().datagrams_sent, many / 4);  // eighty entries fit into one
  EXPECT_LT(server.discovery_counters().datagrams_sent, many / 4);
  EXPECT_EQ(client.discovery_counters().ignored_no_room, 0U);
  EXPECT_EQ(server.discovery_counters().ignored_no_room, 0U);
}

// It ends far more than there is room for events.
TEST_F(ManyServices, AreAllSubscribedToAgainAfterARestartOfTheServer) {
  std::optional<Node> server{std::in_place, io, sized(test::server_address)};
  offer_all(*server);
  Node client{io, sized(test::client_address)};
  subscribe_all(client);
  ASSERT_TRUE(run_until([&] { return all_are_subscribed(client); }));
  server.reset();
  server.emplace(io, sized(test::server_address));
  offer_all(*server);
  ASSERT_TRUE(run_until([&] { return client.discovery_counters().reboots_detected == 1; }));
  ASSERT_TRUE(run_until([&] { return all_are_subscribed(client); }));
  EXPECT_EQ(client.discovery_counters().limits_reached[static_cast<std::size_t>(Limit::remote_services)], 0U);
  EXPECT_EQ(client.discovery_counters().lost_events, 0U);
}

}  // namespace
}  // namespace trestle::sd::many_services_test
