// Many subscriptions of one Node, and those to what is not SOME/IP.
#include <algorithm>

#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::subscriptions_test {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using namespace std::chrono_literals;

constexpr MethodId event{0x8001};

class SubscriptionsTest : public test::TwoNodes {
 protected:
  static std::ptrdiff_t count(const std::vector<std::string>& log, const std::string& text) {
    return std::ranges::count_if(
        log, [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
};

TEST_F(SubscriptionsTest, OfOneServiceLookForItOnce) {
  covers({"feat_req_someipsd_18"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  std::vector<SubscriptionId> subscriptions;
  ServiceSpec spec{.service = ServiceId{0x1234}, .instance = InstanceId{1}};
  for (const EventgroupId group : {EventgroupId{1}, EventgroupId{2}, EventgroupId{3}}) {
    spec.eventgroups.push_back({.id = group, .events = {event}});
    subscriptions.push_back(client.subscribe(
        {.service = ServiceId{0x1234}, .instance = InstanceId{1}, .eventgroup = group, .events = {event}},
        collect()));
  }
  client.require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  ASSERT_TRUE(run_until([&] { return client.discovery_counters().entries_sent == 4; })) << "Finds";
  EXPECT_EQ(client.discovery_counters().datagrams_sent, 4U);
  const OfferHandle offer = server.offer(spec);
  ASSERT_TRUE(run_until([&] {
    return std::ranges::all_of(subscriptions, [&](SubscriptionId one) { return client.subscribed(one); });
  }));
  server.withdraw(offer);
  ASSERT_TRUE(run_until([&] { return !client.subscribed(subscriptions.back()); }));
  EXPECT_EQ(count(client_log, "looking for 0x1234.0x0001"), 1);
  EXPECT_EQ(count(client_log, "0x1234.0x0001 version 1.0 is offered"), 1);
  EXPECT_EQ(count(client_log, "service 0x1234.0x0001 of "), 1) << "is gone";
  EXPECT_EQ(count(client_log, "subscribed to eventgroup"), 3) << "of each";
}

TEST_F(SubscriptionsTest, GetEachEventOnceUntilTheyEnd) {
  covers({"feat_req_someip_354"});
  constexpr MethodId other_event{0x8002};
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer =
      server.offer({.service = ServiceId{0x1234},
                    .instance = InstanceId{1},
                    .eventgroups = {{.id = EventgroupId{1}, .events = {event, other_event}},
                                    {.id = EventgroupId{2}, .events = {event, other_event}}}});
  std::vector<std::string> calls;
  const auto subscribe = [&](EventgroupId group, std::vector<MethodId> wanted, const std::string& name) {
    const SubscriptionId id = client.subscribe(
        {.service = ServiceId{0x1234}, .instance = InstanceId{1}, .eventgroup = group, .events = wanted},
        [&calls, name](const someip::Message&, const Endpoint&) { calls.push_back(name); });
    EXPECT_TRUE(run_until([&] { return client.subscribed(id); }));
    return id;
  };
  const SubscriptionId twice = subscribe(EventgroupId{1}, {event, event}, "twice");
  const SubscriptionId both = subscribe(EventgroupId{2}, {other_event, event}, "both");
  const auto notify_each = [&] {
    calls.clear();
    const std::uint64_t before = client.counters().datagrams;
    server.notify(offer, event, {});
    server.notify(offer, other_event, {});
    EXPECT_TRUE(run_until([&] { return client.counters().datagrams == before + 2; }));
  };
  notify_each();
  EXPECT_THAT(calls, ::testing::ElementsAre("twice", "both", "both"));
  client.unsubscribe(twice);
  run_for(20ms);
  notify_each();
  EXPECT_THAT(calls, ::testing::ElementsAre("both", "both"));
  EXPECT_EQ(client.counters().unexpected, 0U);
  subscribe(EventgroupId{1}, {event}, "again");
  client.unsubscribe(both);
  run_for(20ms);
  notify_each();
  EXPECT_THAT(calls, ::testing::ElementsAre("again"));
  EXPECT_EQ(client.counters().unexpected, 1U) << "the other event, which nobody here wants any more";
}

TEST_F(SubscriptionsTest, MayBeToWhatIsNotSomeip) {
  covers({"feat_req_someipsd_500", "feat_req_someipsd_503", "feat_req_someipsd_1228"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<OfferHandle> offers;
  for (const std::string name : {"diag", "log"}) {
    offers.push_back(server.offer({.service = other_protocols,
                                   .instance = InstanceId{1},
                                   .eventgroups = {{.id = EventgroupId{1}, .events = {event}}},
                                   .configuration = {{"otherserv", name}}}));
  }
  SubscribeSpec wanted{.service = other_protocols,
                       .instance = InstanceId{1},
                       .eventgroup = EventgroupId{1},
                       .events = {event},
                       .otherserv = "log"};
  const SubscriptionId log = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(log); }));
  EXPECT_EQ(server.subscribers(offers[0], event), 0U);
  EXPECT_EQ(server.subscribers(offers[1], event), 1U);
  wanted.otherserv = "diag";
  const SubscriptionId diag = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(diag); }));
  EXPECT_EQ(server.subscribers(offers[0], event), 1U);
  client.unsubscribe(log);
  EXPECT_TRUE(run_until([&] { return server.subscribers(offers[1], event) == 0; }));
  EXPECT_EQ(server.subscribers(offers[0], event), 1U);
  wanted.otherserv = "";
  EXPECT_THROW(client.subscribe(wanted, collect()), std::invalid_argument) << "it needs a name";
  wanted.service = ServiceId{0x1234};
  wanted.otherserv = "log";
  EXPECT_THROW(client.subscribe(wanted, collect()), std::invalid_argument) << "it must not have one";
}

}  // namespace
}  // namespace trestle::sd::subscriptions_test
