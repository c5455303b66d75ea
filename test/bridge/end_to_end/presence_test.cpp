// Ends of routes that come and go with those at the other side.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include "someip/net/tcp_server.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/covers.hpp"

namespace trestle::test::presence_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;

class Presence : public BridgeTest {
 protected:
  Presence() { spdlog::set_level(spdlog::level::warn); }

  void start(const std::string& routes) { start_bridge("routes:\n" + routes); }

  /// One route, of a service of its own unless that is given too.
  static std::string route(const std::string& topic, const char* direction, int event,
                           const std::string& keys, int service = 0x1000) {
    return fmt::format(
        "  - {{topic: {}, type: {}, direction: {}, service: {}, instance: 1, eventgroup: 1, event: {}, "
        "{}}}\n",
        topic, string_type, direction, service, 0x8000 + event, keys);
  }

  [[nodiscard]] dds::Reader reader(const std::string& topic) {
    return ros_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(string_type), {},
                              [this, topic](const dds::Sample& sample) {
                                inbox_.put({topic, copy(sample.cdr())});
                              });
  }

  /// What the peer offers to the bridge: events 0x8001 and 0x8002 of service 0x1000.
  static sd::ServiceSpec offered() {
    return {.service = ServiceId{0x1000},
            .instance = InstanceId{1},
            .eventgroups = {{.id = EventgroupId{1}, .events = {MethodId{0x8001}, MethodId{0x8002}}}}};
  }

  std::unique_ptr<sd::Node> peer_ = std::make_unique<sd::Node>(io_, peer_config());
  Inbox<std::pair<std::string, Bytes>> inbox_;
};

TEST_F(Presence, OffersAServiceWhileEachTopicOfItHasAPublisher) {
  start(route("/a", "dds_to_someip", 1, "port: 40001, offer: while_published") +
        route("/b", "dds_to_someip", 2, "port: 40001, offer: while_published") +
        route("/c", "dds_to_someip", 3, "port: 40001") +
        route("/d", "dds_to_someip", 1, "port: 40002", 0x2000));
  std::vector<bool> seen;
  const auto wanted =
      peer_->require({.service = ServiceId{0x1000}},
                     [&](const sd::RemoteService&, bool available) { seen.push_back(available); });
  const auto other = peer_->require({.service = ServiceId{0x2000}});
  const auto offered_now = [&] { return !peer_->available(wanted).empty(); };
  // The other one shows that offers would have come.
  ASSERT_TRUE(until([&] { return !peer_->available(other).empty(); }));
  auto a = std::make_optional(writer("/a"));
  auto c = writer("/c");
  ASSERT_TRUE(until([&] { return bridge_->counter("route /a", "publishers") == 1 && c.matched() == 1; }));
  run_for(300ms);
  EXPECT_FALSE(offered_now()) << "/b has no publisher";
  EXPECT_EQ(bridge_->counter("route /a", "offered"), 0U);

  auto b = std::make_optional(writer("/b"));
  ASSERT_TRUE(until(offered_now));
  EXPECT_EQ(bridge_->counter("route /a", "offered"), 1U);
  auto second = std::make_optional(writer("/b"));
  ASSERT_TRUE(until([&] { return bridge_->counter("route /b", "publishers") == 2; }));
  b.reset();
  ASSERT_TRUE(until([&] { return bridge_->counter("route /b", "publishers") == 1; }));
  run_for(300ms);
  EXPECT_TRUE(offered_now()) << "the second one is still there";

  second.reset();
  ASSERT_TRUE(until([&] { return !offered_now(); }));
  second = writer("/b");
  ASSERT_TRUE(until(offered_now));
  a.reset();
  ASSERT_TRUE(until([&] { return !offered_now(); }));
  EXPECT_EQ(seen, (std::vector{true, false, true, false}));
}

TEST_F(Presence, CarriesWhatIsPublishedAfterTheServiceHasComeBack) {
  start(route("/a", "dds_to_someip", 1, "port: 40001, offer: while_published"));
  std::vector<std::vector<std::byte>> received;
  const sd::Subscription subscription{
      *peer_,
      {.service = ServiceId{0x1000}, .eventgroup = EventgroupId{1}, .events = {MethodId{0x8001}}},
      [&](const someip::Message& event, const Endpoint&) {
        received.emplace_back(event.payload.begin(), event.payload.end());
      }};
  for (int life = 0; life < 3; ++life) {
    SCOPED_TRACE(life);
    received.clear();
    auto a = writer("/a");
    // What is written before the writer knows of its reader, that one does not get.
    ASSERT_TRUE(until([&] { return subscription.active() && a.matched() == 1; }));
    ASSERT_TRUE(a.write(hello_cdr));
    ASSERT_TRUE(until([&] { return !received.empty(); }));
    EXPECT_EQ(received.front(), hello);
    a = writer("/x");  // which ends that of /a
    ASSERT_TRUE(until([&] { return !subscription.active(); }));
  }
}

TEST_F(Presence, HoldsThePortOfAServiceThatIsNotOffered) {
  start(route("/a", "dds_to_someip", 1, "port: 40001, offer: while_published") +
        route("/b", "dds_to_someip", 2, "port: 40001, transport: tcp"));
  boost::asio::io_context io;  // another program's
  EXPECT_THROW((someip::UdpSocket{io, {.local = {own_address(1), 40001}}}), someip::NetError);
  EXPECT_THROW((someip::TcpServer{io, {.local = {own_address(1), 40001}}}), someip::NetError);
  bridge_.reset();
  EXPECT_NO_THROW((someip::UdpSocket{io, {.local = {own_address(1), 40001}}}));
}

TEST_F(Presence, WritesATopicWhileTheServiceIsOffered) {
  start(route("/a", "someip_to_dds", 1, "write: while_offered"));
  auto a = reader("/a");
  auto marker = ros_.create_reader("rt/x", "x", {}, [](const dds::Sample&) {});
  run_for(300ms);
  EXPECT_EQ(a.matched(), 0U);
  EXPECT_EQ(bridge_->counter("route /a", "written"), 0U);
  for (int life = 0; life < 3; ++life) {
    SCOPED_TRACE(life);
    const sd::Offer offer{*peer_, offered()};
    ASSERT_TRUE(until([&] { return a.matched() == 1; }));
    ASSERT_TRUE(until([&] { return peer_->subscribers(offer.handle(), MethodId{0x8001}) == 1; }));
    ASSERT_TRUE(until_counter("route /a", "readers", 1));  // the writer may know of the reader later
    offer.notify(MethodId{0x8001}, hello);
    ASSERT_TRUE(until([&] { return inbox_.size() > 0; }));
    const auto arrived = inbox_.take();
    EXPECT_EQ(Bytes(arrived[0].second.begin(), arrived[0].second.begin() + 14), hello_cdr);
    peer_->withdraw(offer.handle());
    ASSERT_TRUE(until([&] { return a.matched() == 0; }));
  }
}

TEST_F(Presence, KeepsTheWriterWhenTheServerHasOnlyRestarted) {
  std::atomic<int> lost = 0;
  dds::ParticipantConfig watching = config();
  watching.on_event = [&](const dds::Happening& event) {
    lost += event.kind == dds::Happening::Kind::unmatched;
  };
  dds::Participant watcher{watching};
  start(route("/a", "someip_to_dds", 1, "write: while_offered"));
  const auto a =
      watcher.create_reader("rt/a", dds::ros_type_name(string_type), {}, [](const dds::Sample&) {});
  // A server of bare datagrams. A stack that starts anew would say that it has no such service to a
  // subscription that it finds before its own offer, and by that it would be gone.
  peer_.reset();
  const IpAddress own = own_address(2);
  std::size_t subscriptions = 0;
  someip::UdpSocket server{io_, {.local = {own, 30490}, .interface = someip::MulticastInterface{own}}};
  server.receive([&](ByteView datagram, const Endpoint&) {
    subscriptions += datagram.size() > 24 && datagram[24] == std::byte{6};
  });
  const auto address = to_hex(std::as_bytes(std::span{own.bytes})).substr(0, 8);
  const auto offer_for_the_first_time = [&] {
    const auto offer =
        hex("ffff 8100 00000030 0000 0001 01 01 02 00 c0000000 00000010 01000010 1000 0001 01 000258 00000000"
            "0000000c 0009 04 00" +
            address + "00 11 9d26");
    const ByteView bytes{offer};
    EXPECT_EQ(server.send({own_group(), 30490}, {&bytes, 1}), someip::SendStatus::sent);
  };
  const auto reboots = [&] { return bridge_->counter("SOME/IP-SD", "reboots_detected"); };
  offer_for_the_first_time();
  ASSERT_TRUE(until([&] { return a.matched() == 1 && subscriptions == 1; }));
  EXPECT_EQ(reboots(), 0U);
  run_for(600ms);  // the same within 500 ms is one that the network has brought twice
  offer_for_the_first_time();
  ASSERT_TRUE(until([&] { return reboots() == 1 && subscriptions == 2; }));
  run_for(300ms);
  EXPECT_EQ(lost, 0);
}

TEST_F(Presence, SubscribesWhileTheTopicIsRead) {
  covers({"feat_req_someipsd_332", "feat_req_someipsd_822"});
  start(route("/a", "someip_to_dds", 1, "subscribe: while_read") +
        route("/b", "someip_to_dds", 2, "subscribe: while_read"));
  const sd::Offer offer{*peer_, offered()};
  const auto subscribers = [&] { return peer_->subscribers(offer.handle(), MethodId{0x8001}); };
  auto other = reader("/c");
  run_for(300ms);
  EXPECT_EQ(subscribers(), 0U);
  EXPECT_EQ(bridge_->counter("route /a", "subscribed"), 0U);
  for (int life = 0; life < 3; ++life) {
    SCOPED_TRACE(life);
    auto a = std::make_optional(reader("/a"));
    ASSERT_TRUE(until([&] { return subscribers() == 1; }));
    auto b = std::make_optional(reader("/b"));
    ASSERT_TRUE(until([&] { return bridge_->counter("route /b", "subscribed") == 1; }));
    a.reset();
    ASSERT_TRUE(until([&] { return bridge_->counter("route /a", "readers") == 0; }));
    // The routes are of one eventgroup, and share its subscription.
    run_for(100ms);
    ASSERT_EQ(subscribers(), 1U);
    offer.notify(MethodId{0x8001}, hello);
    offer.notify(MethodId{0x8002}, hello);
    ASSERT_TRUE(until([&] { return inbox_.size() > 0; }));
    EXPECT_EQ(inbox_.take()[0].first, "/b");
    b.reset();
    ASSERT_TRUE(until([&] { return subscribers() == 0; }));
    EXPECT_EQ(bridge_->counter("route /b", "subscribed"), 0U);
  }
}

TEST_F(Presence, WritesWhileOfferedAndSubscribesWhileReadTogether) {
  start(route("/a", "someip_to_dds", 1, "write: while_offered, subscribe: while_read"));
  auto offer = std::make_optional<sd::Offer>(*peer_, offered());
  const auto subscribers = [&] { return peer_->subscribers(offer->handle(), MethodId{0x8001}); };
  ASSERT_TRUE(until([&] { return bridge_->counter("route /a", "written") == 1; }));
  run_for(300ms);
  EXPECT_EQ(subscribers(), 0U) << "nobody reads";
  auto a = std::make_optional(reader("/a"));
  ASSERT_TRUE(until([&] { return subscribers() == 1; }));
  // The server goes and comes back.
  offer.reset();
  ASSERT_TRUE(until([&] { return a->matched() == 0; }));
  offer.emplace(*peer_, offered());
  ASSERT_TRUE(until([&] { return subscribers() == 1 && a->matched() == 1; }));
  offer->notify(MethodId{0x8001}, hello);
  ASSERT_TRUE(until([&] { return inbox_.size() == 1; }));
  // The last reader goes, and one comes back.
  a.reset();
  ASSERT_TRUE(until([&] { return subscribers() == 0; }));
  a = reader("/a");
  ASSERT_TRUE(until([&] { return subscribers() == 1; }));
  // The bridge goes and comes back.
  bridge_.reset();
  ASSERT_TRUE(until([&] { return subscribers() == 0; }));
  start(route("/a", "someip_to_dds", 1, "write: while_offered, subscribe: while_read"));
  ASSERT_TRUE(until([&] { return subscribers() == 1; }));
}

}  // namespace
}  // namespace trestle::test::presence_test
