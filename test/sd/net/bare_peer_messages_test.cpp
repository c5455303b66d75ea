// What a Node takes and what it drops of messages that a peer of bare sockets writes out.
#include <boost/asio/write.hpp>

#include "test/covers.hpp"
#include "test/sd/net/bare_peer.hpp"

namespace trestle::sd::bare_peer_messages_test {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

/// A subscriber of the bare peer, with a UDP port that the peer knows.
class BarePeerMessages : public test::BarePeer {
 protected:
  static constexpr std::uint16_t client_port = 40124;

  SubscriptionId subscribe(bool with_tcp) {
    SubscribeSpec spec = wanted;
    spec.udp = true;
    spec.tcp = with_tcp;
    spec.port = client_port;
    return client.subscribe(spec, collect());
  }
  /// Offers until the client has subscribed, at the UDP or TCP endpoint.
  void offer_until_subscribed(const std::string& protocol) {
    ASSERT_TRUE(run_until([&] {
      send(offer, protocol);
      return run_until([&] { return count("0600001012340001") + count("0600002012340001") > 0; }, 20ms);
    }));
  }
  void send_datagram(someip::UdpSocket& from, const Endpoint& to, const std::string& digits) {
    const auto bytes = test::hex(digits);
    const ByteView view{bytes};
    ASSERT_EQ(from.send(to, {&view, 1}), someip::SendStatus::sent);
  }
  void send_datagram(const std::string& digits) {
    send_datagram(service, {test::client_address, client_port}, digits);
  }
  void send_over_tcp(const std::string& digits) {
    const auto bytes = test::hex(digits);
    boost::asio::write(connections.front(), boost::asio::buffer(bytes));
  }
  [[nodiscard]] std::vector<std::string> payloads() const {
    std::vector<std::string> result;
    for (const test::Received& one : events) {
      result.push_back(test::to_hex(one.payload));
    }
    return result;
  }

  // Event 0x8001 of service 0x1234: payload of one byte, session 1; protocol and interface version, type.
  static constexpr const char* event = "1234 8001 00000009 0000 0001 01 01 02 00 ";
  static constexpr const char* newer_protocol = "1234 8001 00000009 0000 0001 02 01 02 00 ";
  static constexpr const char* newer_interface = "1234 8001 00000009 0000 0001 01 02 02 00 ";
  static constexpr const char* unknown_event = "1234 8077 00000009 0000 0001 01 01 02 00 ";
  static constexpr const char* unknown_service = "4321 8001 00000009 0000 0001 01 01 02 00 ";

  Node client{io, quick(test::client_address), into(client_log)};
  someip::UdpSocket service{io,
                            {.local = {test::other_address, tcp_port}, .interface = {{test::other_address}}}};
};

TEST_F(BarePeerMessages, TakeEventsOfTheRightVersionsAlone) {
  covers({"feat_req_someip_90", "feat_req_someip_92"});
  subscribe(false);
  offer_until_subscribed("11");
  send_datagram(std::string{newer_protocol} + "0a");
  ASSERT_TRUE(run_until([&] { return client.counters().wrong_version == 1; }));
  send_datagram(std::string{newer_interface} + "0b");
  ASSERT_TRUE(run_until([&] { return client.counters().wrong_version == 2; }));
  send_datagram(std::string{event} + "0c");
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  EXPECT_THAT(payloads(), ElementsAre("0c"));
  EXPECT_EQ(client.counters().events, 1U);
}

TEST_F(BarePeerMessages, TakeEventsFromTheEndpointOfTheirTransportAlone) {
  covers({"feat_req_someipsd_797"});
  subscribe(true);
  offer_until_subscribed("06");
  ASSERT_TRUE(run_until([&] { return accepted == 1; }));
  send_datagram(std::string{event} + "0a");  // from UDP port 40230, but TCP port 40230 is offered
  ASSERT_TRUE(run_until([&] { return client.counters().unknown_sender == 1; }));
  send_over_tcp(std::string{event} + "0b");
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  EXPECT_THAT(payloads(), ElementsAre("0b"));
}

// The sender of a datagram can be forged, so what is asked for over TCP alone must not come in one.
TEST_F(BarePeerMessages, TakeOverTcpAloneWhatIsWantedSo) {
  client.subscribe(wanted, collect());
  SubscribeSpec of_other_event = wanted;
  of_other_event.eventgroup = EventgroupId{2};
  of_other_event.events = {MethodId{0x8002}};
  of_other_event.udp = true;
  of_other_event.tcp = false;
  of_other_event.port = client_port;
  client.subscribe(of_other_event, collect());
  const std::string address = test::to_hex(std::as_bytes(std::span{test::other_address.bytes})).substr(0, 8);
  ASSERT_TRUE(run_until([&] {
    send({test::own_group(), sd_port}, session++, "01 00 00 20 1234 0001 01 000258 00000000",
         "0009 04 00" + address + "00069d26 0009 04 00" + address + "00119d26");
    return run_until([&] { return accepted == 1 && count("0600001012340001") >= 2; }, 20ms);
  }));
  send_datagram(std::string{event} + "0a");
  ASSERT_TRUE(run_until([&] { return client.counters().unknown_sender == 1; }));
  send_datagram("1234 8002 00000009 0000 0001 01 01 02 00 0b");
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  send_over_tcp(std::string{event} + "0c");
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; }));
  EXPECT_THAT(payloads(), ElementsAre("0b", "0c"));
}

TEST_F(BarePeerMessages, DropUnknownEventsAmongKnownOnesInOneDatagram) {
  covers({"feat_req_someipcompat_1201", "feat_req_someip_741"});
  subscribe(false);
  offer_until_subscribed("11");
  send_datagram(std::string{unknown_event} + "0a" + event + "0b" + unknown_service + "0c" + newer_interface +
                "0d" + event + "0e" + unknown_event + "0f");
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; }));
  EXPECT_THAT(payloads(), ElementsAre("0b", "0e"));
  EXPECT_EQ(client.counters().unexpected, 3U);
  EXPECT_EQ(client.counters().wrong_version, 1U);
  EXPECT_EQ(client.counters().malformed, 0U);
}

TEST_F(BarePeerMessages, DropUnknownEventsAmongKnownOnesOfAConnection) {
  covers({"feat_req_someipcompat_1201"});
  subscribe(true);
  offer_until_subscribed("06");
  ASSERT_TRUE(run_until([&] { return accepted == 1; }));
  send_over_tcp(std::string{unknown_event} + "0a" + event + "0b" + unknown_service + "0c" + event + "0d");
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; }));
  EXPECT_THAT(payloads(), ElementsAre("0b", "0d"));
  EXPECT_EQ(client.counters().unexpected, 2U);
}

// --- Multicast --------------------------------------------------------------------------------------------

class BarePeerGroup : public BarePeerMessages {
 protected:
  static constexpr const char* subscribed_entry = "07 00 00 10 1234 0001 01 000258 00000001";
  static constexpr const char* refused_entry = "07 00 00 00 1234 0001 01 000000 00000001";

  /// Subscribed, and its multicast events arrive.
  void join(SubscriptionId subscription) {
    offer_until_subscribed("11");
    const auto address = test::to_hex(std::as_bytes(std::span{group.address.bytes})).substr(0, 8);
    answer(subscribed_entry, "0009 14 00" + address + "00 11 9d44");
    ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
    send_datagram(service, group, std::string{event} + "0a");
    ASSERT_TRUE(run_until([&] { return !events.empty() && at_witness == 1; }));
    EXPECT_THAT(payloads(), ElementsAre("0a"));
  }
  /// Sends to the group again. It arrives, but not at the client.
  void expect_left() {
    const std::uint64_t before = client.counters().datagrams;
    send_datagram(service, group, std::string{event} + "0b");
    ASSERT_TRUE(run_until([&] { return at_witness == 2; }));
    run_for(20ms);
    EXPECT_EQ(client.counters().datagrams, before);
    EXPECT_THAT(payloads(), ElementsAre("0a"));
  }
  void SetUp() override {
    BarePeerMessages::SetUp();
    witness.receive([this](ByteView, const Endpoint&) { ++at_witness; });
  }

  const Endpoint group{IpAddress::v4(239, 252, test::own_group().bytes[2], test::own_group().bytes[3]),
                       40260};
  someip::UdpSocket witness{io,
                            {.local = group,
                             .join = group.address,
                             .interface = {{test::other_address}},
                             .sharing = someip::PortSharing::shared}};
  std::size_t at_witness = 0;
};

TEST_F(BarePeerGroup, IsLeftWhenTheOfferEnds) {
  covers({"feat_req_someipsd_791"});
  const SubscriptionId subscription = subscribe(false);
  join(subscription);
  send(stop, "11");
  ASSERT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
  expect_left();
}

TEST_F(BarePeerGroup, IsLeftWhenARenewalIsRefused) {
  const SubscriptionId subscription = subscribe(false);
  join(subscription);
  answer(refused_entry);
  ASSERT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
  expect_left();
}

// A request by multicast has no endpoint of ours that it could be answered from.
TEST_F(BarePeerGroup, BringsNoRequests) {
  int handled = 0;
  for (const bool over_udp : {true, false}) {
    client.offer({.service = ServiceId{0x4321},
                  .instance = InstanceId{static_cast<std::uint16_t>(over_udp ? 1 : 2)},
                  .udp_port = over_udp ? std::optional{std::uint16_t{0}} : std::nullopt,
                  .tcp_port = over_udp ? std::nullopt : std::optional{std::uint16_t{0}},
                  .methods = {{MethodId{1}, [&](const someip::Message&, Responder responder) {
                                 ++handled;
                                 responder.respond();
                               }}}});
  }
  join(subscribe(false));
  const std::uint64_t before = client.counters().unexpected;
  send_datagram(service, group, "4321 0001 00000008 00aa 0001 01 01 00 00");
  ASSERT_TRUE(run_until([&] { return client.counters().unexpected == before + 1; }));
  send_datagram(service, group, "4321 0001 00000008 00aa 0001 01 01 01 00");  // fire and forget
  ASSERT_TRUE(run_until([&] { return client.counters().unexpected == before + 2; }));
  EXPECT_EQ(handled, 0);
  EXPECT_EQ(client.counters().requests, 0U);
  EXPECT_EQ(client.counters().requests_answered, 0U);
}

// Nor has one that comes over a connection which is ours to call through.
TEST_F(BarePeerMessages, BringNoRequestsOverAConnectionOfOurs) {
  int handled = 0;
  client.offer({.service = ServiceId{0x4321},
                .instance = InstanceId{1},
                .methods = {{MethodId{1}, [&](const someip::Message&, Responder responder) {
                               ++handled;
                               responder.respond();
                             }}}});
  subscribe(true);
  offer_until_subscribed("06");
  ASSERT_TRUE(run_until([&] { return accepted == 1; }));
  send_over_tcp("4321 0001 00000008 00aa 0001 01 01 00 00");
  ASSERT_TRUE(run_until([&] { return client.counters().unexpected == 1; }));
  EXPECT_EQ(handled, 0);
  EXPECT_EQ(client.counters().requests_answered, 0U);
}

}  // namespace
}  // namespace trestle::sd::bare_peer_messages_test
