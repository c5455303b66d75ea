// Events that nobody has asked for are of the subscription whose server sent them.
#include <boost/asio/ip/udp.hpp>

#include "someip/net/address_text.hpp"
#include "test/bytes.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::net_other_events_test {
namespace {

using someip::MethodId;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr ServiceId service{0x1234};
constexpr EventgroupId group{1};
constexpr MethodId wanted{0x8001};
constexpr MethodId other{0x8002};
constexpr MethodId unknown{0x8003};
constexpr std::uint16_t port = 40260;

/// Two instances of a service at two hosts, and a subscription to each.
class OtherEventsTest : public test::TwoNodes {
 protected:
  static ServiceSpec offered(std::uint16_t instance) {
    return {.service = service,
            .instance = InstanceId{instance},
            .eventgroups = {{.id = group, .events = {wanted, other, unknown}}}};
  }
  SubscriptionId subscribe(std::uint16_t instance, MethodId event) {
    return client.subscribe({.service = service,
                             .instance = InstanceId{instance},
                             .eventgroup = group,
                             .events = {event},
                             .port = port},
                            collect());
  }
  static void notify(Node& node, OfferHandle offer, MethodId event) {
    node.notify(offer, event, std::span<const ByteView>{});
  }

  Node first{io, quick(test::server_address)};
  Node second{io, quick(test::other_address)};
  Node client{io, quick(test::client_address)};
  OfferHandle from_first = first.offer(offered(1));
  OfferHandle from_second = second.offer(offered(2));
  SubscriptionId to_first = subscribe(1, wanted);
  SubscriptionId to_second = subscribe(2, other);
};

TEST_F(OtherEventsTest, AreOfTheSubscriptionWhoseServerSentThem) {
  ASSERT_TRUE(run_until([&] { return client.subscribed(to_first) && client.subscribed(to_second); }));
  notify(first, from_first, unknown);
  notify(first, from_first, other);  // which is wanted, of the other instance
  notify(second, from_second, other);
  EXPECT_TRUE(run_until([&] { return client.other_events(to_first).count == 2 && events.size() == 1; }));
  EXPECT_THAT(client.other_events(to_first).ids, ElementsAre(unknown, other));
  EXPECT_EQ(client.subscription_faults(to_first).other_events, 2U);
  EXPECT_EQ(client.other_events(to_second).count, 0U);
  EXPECT_THAT(client.other_events(to_second).ids, IsEmpty());
  client.unsubscribe(to_first);
  EXPECT_EQ(client.other_events(to_first).count, 0U) << "unknown";
}

TEST_F(OtherEventsTest, AreNotWhatSomebodyElseSends) {
  ASSERT_TRUE(run_until([&] { return client.subscribed(to_first); }));
  namespace ip = boost::asio::ip;
  const auto at = [](const IpAddress& address, std::uint16_t number) {
    return ip::udp::endpoint{ip::make_address(someip::to_string(address)), number};
  };
  ip::udp::socket socket{io, at(test::own_address(4), 0)};
  const auto forged = test::hex("1234 8003 00000008 00000000 01 01 02 00");
  socket.send_to(boost::asio::buffer(forged), at(test::client_address, port));
  ASSERT_TRUE(run_until([&] { return client.counters().unexpected == 1; }));
  EXPECT_EQ(client.other_events(to_first).count, 0U);
}

}  // namespace
}  // namespace trestle::sd::net_other_events_test
