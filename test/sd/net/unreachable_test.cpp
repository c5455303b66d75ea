// Subscribers over UDP that are gone without a word: the network says so.
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::unreachable_test {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

constexpr MethodId event{0x8001};

class UnreachableTest : public test::TwoNodes {
 protected:
  static NodeConfig patient(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.timing.ttl_s = 3600;
    return config;
  }
  OfferHandle offer() {
    return server.offer({.service = ServiceId{0x1234},
                         .instance = InstanceId{1},
                         .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}});
  }
  SubscriptionId subscribe(Node& node, EventHandler handler) {
    return node.subscribe({.service = ServiceId{0x1234},
                           .instance = InstanceId{1},
                           .eventgroup = EventgroupId{1},
                           .events = {event}},
                          std::move(handler));
  }
  [[nodiscard]] std::size_t subscribers() const { return server.subscribers(offered, event); }

  Node server{io, patient(test::server_address), into(server_log)};
  OfferHandle offered = offer();
};

TEST_F(UnreachableTest, SubscribersLoseTheirSubscriptionLongBeforeItEnds) {
  covers({"feat_req_someipsd_435"});
  Node client{io, patient(test::client_address)};
  auto killed = std::make_unique<Node>(io, patient(test::other_address));
  subscribe(client, collect());
  std::size_t to_killed = 0;
  subscribe(*killed, [&](const someip::Message&, const Endpoint&) { ++to_killed; });
  ASSERT_TRUE(run_until([&] { return subscribers() == 2; }));
  const ByteView none;
  EXPECT_EQ(server.notify(offered, event, {&none, 1}).subscribers, 2U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1 && to_killed == 1; }));

  killed.reset();
  run_for(50ms);
  EXPECT_EQ(subscribers(), 2U) << "it said nothing";
  // The one that is alive gets all, also what leaves together with what tells of the other one's end.
  constexpr std::size_t together = 100;
  for (std::size_t i = 0; i < together; ++i) {
    EXPECT_EQ(server.notify(offered, event, {&none, 1}).dropped, 0U);
  }
  ASSERT_TRUE(run_until([&] { return subscribers() == 1; }));
  EXPECT_EQ(server.notify(offered, event, {&none, 1}).subscribers, 1U);
  EXPECT_TRUE(run_until([&] { return events.size() == together + 2; }));
  run_for(50ms);
  EXPECT_EQ(events.size(), together + 2) << "each once";
  for (std::size_t i = 1; i < events.size(); ++i) {
    EXPECT_EQ(value(events[i].header.session), value(events[i - 1].header.session) + 1) << i;
  }
  EXPECT_EQ(subscribers(), 1U);
  EXPECT_GE(server.counters().unreachable, 1U);
  EXPECT_EQ(server.sender_counters().refused, 0U);
  EXPECT_THAT(server_log, Contains(HasSubstr("unreachable, no longer subscribed to eventgroup 0x0001")));
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("expired"))));
}

TEST_F(UnreachableTest, SubscribersMayComeBack) {
  covers({"feat_req_someipsd_435"});
  auto first = std::make_unique<Node>(io, patient(test::client_address));
  subscribe(*first, collect());
  ASSERT_TRUE(run_until([&] { return subscribers() == 1; }));
  first.reset();
  server.notify(offered, event, {});
  ASSERT_TRUE(run_until([&] { return subscribers() == 0; }));
  Node second{io, patient(test::client_address)};
  subscribe(second, collect());
  ASSERT_TRUE(run_until([&] { return subscribers() == 1; }));
  server.notify(offered, event, {});
  EXPECT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(subscribers(), 1U);
}

}  // namespace
}  // namespace trestle::sd::unreachable_test
