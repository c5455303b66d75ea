// What a route's `qos` asks for is what its reader and its writer have, seen from the other end of DDS.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bridge/carry/runtime/dds_receiver.hpp"
#include "sd/net/proxy.hpp"
#include "test/bridge/end_to_end/bridge_test.hpp"

namespace trestle::test::route_qos_test {
namespace {

class RouteQos : public BridgeTest {
 protected:
  void start(const char* direction, const std::string& qos) {
    start_bridge(
        "routes:\n  - {topic: /text, type: std_msgs/msg/String, service: 0x1234, instance: 1, "
        "eventgroup: 1, event: 0x8001, direction: " +
        std::string{direction} + ", qos: {" + qos + "}}\n");
  }
  bool comes(const char* counter) {
    return until([&] { return bridge_->counter("route /text", counter) > 0; });
  }
  /// Writes until the route has a sample: its reader may know the writer later than the writer knows it.
  bool arrives(dds::Writer& from) {
    return until([&] {
      static_cast<void>(from.write(hello_cdr));
      return bridge_->counter("route /text", "received") > 0;
    });
  }
};

TEST_F(RouteQos, NoticesAPublisherThatMissesItsDeadline) {
  start("dds_to_someip, port: 40001", "deadline: 200 ms");
  dds::Writer late = writer("/text", string_type, {.deadline = 100ms});
  ASSERT_TRUE(arrives(late));
  EXPECT_TRUE(comes("dds_deadlines_missed"));
  // One that promises less than the route asks for does not go with it.
  const dds::Writer slow = writer("/text", string_type, {.deadline = 300ms});
  EXPECT_TRUE(comes("dds_incompatible_qos"));
  EXPECT_EQ(slow.matched(), 0U);
}

TEST_F(RouteQos, NoticesAPublisherThatDoesNotShowItself) {
  start("dds_to_someip, port: 40001", "liveliness: manual_by_topic, liveliness_lease: 300 ms");
  dds::Writer silent = writer("/text", string_type, {.manual_liveliness = true, .liveliness_lease = 200ms});
  ASSERT_TRUE(arrives(silent));
  // Silent for long again and again: the first time, Fast DDS 2.9 may have begun to count before it knew the
  // reader.
  constexpr auto silence = 2s;
  auto speaks = std::chrono::steady_clock::now() + silence;
  EXPECT_TRUE(until([&] {
    if (std::chrono::steady_clock::now() > speaks) {
      static_cast<void>(silent.write(hello_cdr));
      speaks += silence;
    }
    return bridge_->counter("route /text", "dds_liveliness_lost") > 0;
  }));
  const dds::Writer automatic = writer("/text", string_type, {.liveliness_lease = 200ms});
  EXPECT_TRUE(comes("dds_incompatible_qos"));
  EXPECT_EQ(automatic.matched(), 0U);
}

TEST_F(RouteQos, IsPromisedToSubscribers) {
  start("someip_to_dds", "deadline: 200 ms, liveliness_lease: 300 ms");
  Inbox<Bytes> inbox;
  const dds::Reader content =
      reader("/text", string_type, inbox, {.deadline = 200ms, .liveliness_lease = 300ms});
  ASSERT_TRUE(until([&] { return content.matched() == 1; }));
  ASSERT_TRUE(until_counter("route /text", "readers", 1));
  std::uint64_t refused = 0;
  for (const dds::Qos& more : {dds::Qos{.deadline = 100ms}, dds::Qos{.liveliness_lease = 200ms}}) {
    const dds::Reader demanding = reader("/text", string_type, inbox, more);
    EXPECT_TRUE(until_counter("route /text", "dds_incompatible_qos", ++refused));
    EXPECT_EQ(demanding.matched(), 0U);
  }
  // The promise is not kept by a SOME/IP service that says something once.
  sd::Node node{io_, peer_config()};
  constexpr someip::MethodId event{0x8001};
  const sd::Offer offer{node,
                        {.service = someip::ServiceId{0x1234},
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = someip::EventgroupId{1}, .events = {event}}}}};
  ASSERT_TRUE(until([&] { return node.subscribers(offer.handle(), event) == 1; }));
  offer.notify(event, hello);
  ASSERT_TRUE(until([&] { return inbox.size() > 0; }));
  EXPECT_TRUE(comes("dds_deadlines_missed"));
  EXPECT_EQ(inbox.size(), 1U);
}

/// "hell1": as short as hello, and one of many.
Bytes numbered(Bytes hello_in_some_form, std::size_t place_of_o, int number) {
  hello_in_some_form[place_of_o] = static_cast<std::byte>('0' + number);
  return hello_in_some_form;
}
Bytes cdr(int number) {
  return numbered(hello_cdr, 12, number);
}
Bytes payload(int number) {
  return numbered(hello, 11, number);
}

TEST_F(RouteQos, SaysWhichSamplesMakeRoomWhenTheBridgeIsTooSlow) {
  for (const std::string history : {"keep_all", "keep_last"}) {
    SCOPED_TRACE(history);
    start("dds_to_someip, port: 40001", "depth: 3, history: " + history);
    sd::Node node{io_, peer_config()};
    std::vector<Bytes> received;
    const sd::Subscription subscription{node,
                                        {.service = someip::ServiceId{0x1234},
                                         .instance = someip::InstanceId{1},
                                         .eventgroup = someip::EventgroupId{1},
                                         .events = {someip::MethodId{0x8001}}},
                                        [&](const someip::Message& event, const Endpoint&) {
                                          received.emplace_back(event.payload.begin(), event.payload.end());
                                        }};
    dds::Writer from = writer("/text");
    ASSERT_TRUE(until([&] { return subscription.active() && from.matched() == 1; }));
    ASSERT_TRUE(until_counter("route /text", "publishers", 1));
    std::promise<void> busy = bridge_->busy();
    for (const int number : {1, 2, 3, 4, 5}) {
      ASSERT_TRUE(from.write(cdr(number)));
    }
    if (!carry::receives_samples()) {  // but a thread of DDS, which has them then
      ASSERT_TRUE(from.wait_until_received(patience));
    }
    busy.set_value();
    ASSERT_TRUE(until([&] { return received.size() == 3; }));
    EXPECT_EQ(received, history == "keep_all" ? (std::vector{payload(1), payload(2), payload(3)})
                                              : (std::vector{payload(3), payload(4), payload(5)}));
    EXPECT_EQ(bridge_->counter("route /text", "overtaken"), 2U);
    EXPECT_EQ(bridge_->counter("route /text", "carried"), 3U);
    bridge_.reset();
  }
}

// One subscriber reads nothing, with small buffers between: another one gets all, latched or not.
TEST_F(RouteQos, LetsNoSubscriberWaitForASlowOne) {
  for (const std::string durability : {"volatile", "transient_local"}) {
    SCOPED_TRACE(durability);
    start_bridge(
        "routes:\n  - {topic: /bytes, type: std_msgs/msg/UInt8MultiArray, service: 0x1234, instance: 1, "
        "eventgroup: 1, event: 0x8001, direction: dds_to_someip, transport: tcp, port: 40001, qos: {depth: "
        "3, "
        "durability: " +
        durability + "}}\n");
    boost::asio::io_context slow_io;
    sd::NodeConfig slow_config = peer_config();
    slow_config.address = own_address(4);
    slow_config.tcp_receive_buffer_bytes = 16 << 10;
    sd::Node slow{slow_io, slow_config};
    sd::Node node{io_, peer_config()};
    const sd::SubscribeSpec wanted{.service = someip::ServiceId{0x1234},
                                   .instance = someip::InstanceId{1},
                                   .eventgroup = someip::EventgroupId{1},
                                   .events = {someip::MethodId{0x8001}},
                                   .udp = false,
                                   .tcp = true};
    std::vector<someip::SessionId> at_slow;
    std::size_t received = 0;
    const sd::Subscription of_slow{slow, wanted, [&](const someip::Message& event, const Endpoint&) {
                                     at_slow.push_back(event.header.session);
                                   }};
    const sd::Subscription subscription{node, wanted,
                                        [&](const someip::Message&, const Endpoint&) { ++received; }};
    dds::Writer from = writer("/bytes", "std_msgs/msg/UInt8MultiArray",
                              {.transient_local = durability == "transient_local", .depth = 3});
    ASSERT_TRUE(until([&] {
      slow_io.poll();
      return subscription.active() && of_slow.active() && from.matched() == 1;
    }));
    ASSERT_TRUE(until_counter("route /bytes", "publishers", 1));
    constexpr std::size_t size = 4 << 20;  // more than the system has room for on the way
    Bytes cdr = hex("00010000 00000000 00000000 00004000");
    cdr.resize(cdr.size() + size);
    constexpr std::size_t messages = 20;
    for (std::size_t i = 1; i <= messages; ++i) {
      ASSERT_TRUE(from.write(cdr));
      ASSERT_TRUE(until([&] { return received == i; })) << i;
    }
    EXPECT_EQ(bridge_->counter("route /bytes", "carried"), messages);
    EXPECT_EQ(bridge_->counter("route /bytes", "overtaken"), 0U);
    EXPECT_EQ(bridge_->counter("route /bytes", "not_sent"), 0U);
    const std::uint64_t lost = bridge_->counter("route /bytes", "slow_subscriber");
    EXPECT_GE(lost, messages - 3 - 2) << "but for those that wait, and what is under way";
    EXPECT_LE(lost, messages - 3);
    EXPECT_EQ(bridge_->counter("SOME/IP over TCP", "slow_subscriber"), lost);
    ASSERT_TRUE(until([&] {
      slow_io.poll();
      return at_slow.size() + lost == messages;
    }));
    EXPECT_EQ(value(at_slow.back()), messages) << "the newest";
    bridge_.reset();
  }
}

TEST_F(RouteQos, KeepsFromLateReadersWhatHasExpired) {
  const auto route = [](const char* topic, const char* event, const char* more) {
    return fmt::format(
        "  - {{topic: {}, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x1234, instance: 1, "
        "eventgroup: 1, event: {}, qos: {{durability: transient_local{}}}}}\n",
        topic, event, more);
  };
  start_bridge("routes:\n" + route("/short", "0x8001", ", lifespan: 200 ms") + route("/long", "0x8002", ""));
  sd::Node node{io_, peer_config()};
  const std::vector<someip::MethodId> events{someip::MethodId{0x8001}, someip::MethodId{0x8002}};
  const sd::Offer offer{node,
                        {.service = someip::ServiceId{0x1234},
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = someip::EventgroupId{1}, .events = events}}}};
  ASSERT_TRUE(until([&] { return node.subscribers(offer.handle(), events[1]) == 1; }));
  const auto tell = [&](int number) {
    for (const someip::MethodId event : events) {
      offer.notify(event, payload(number));
    }
  };
  tell(1);
  ASSERT_TRUE(until_counter("route /short", "carried", 1));
  ASSERT_TRUE(until_counter("route /long", "carried", 1));
  run_for(300ms);  // the time itself is what is tested
  constexpr dds::Qos late{.transient_local = true};
  Inbox<Bytes> of_short;
  Inbox<Bytes> of_long;
  const dds::Reader short_reader = reader("/short", string_type, of_short, late);
  const dds::Reader long_reader = reader("/long", string_type, of_long, late);
  ASSERT_TRUE(of_long.wait_for_count(1));
  ASSERT_TRUE(until_counter("route /short", "readers", 1));
  ASSERT_TRUE(until([&] { return short_reader.matched() == 1; }));
  ASSERT_TRUE(until([&] {
    tell(2);  // again, as it may be late, too
    usleep(10'000);
    return of_short.size() > 0;
  }));
  ASSERT_TRUE(until([&] { return of_long.size() >= 2; }));
  const auto words = [](Inbox<Bytes>& inbox) {
    std::string text;
    for (const Bytes& one : inbox.take()) {
      text += static_cast<char>(one.at(12));
    }
    return text;
  };
  EXPECT_EQ(words(of_long).substr(0, 2), "12");
  EXPECT_EQ(words(of_short).find('1'), std::string::npos);
}

// --- transport: by_reliability -----------------------------------------------------------------------------

/// Routes /reliable, service 0x1001, and /best_effort, service 0x1002.
std::string routes_by_reliability(const std::string& keys) {
  const auto route = [&](const char* reliability, int service) {
    return fmt::format(
        "  - {{topic: /{0}, type: std_msgs/msg/String, service: {1}, instance: 1, eventgroup: 1, event: "
        "0x8001, "
        "transport: by_reliability, qos: {{reliability: {0}}}, {2}}}\n",
        reliability, service, keys);
  };
  return "routes:\n" + route("reliable", 0x1001) + route("best_effort", 0x1002);
}

TEST_F(RouteQos, ReliableTopicsAreOfferedOverTcpAndOthersOverUdp) {
  start_bridge(routes_by_reliability("direction: dds_to_someip, port: 40001"));
  const auto came = [&](std::uint16_t service, bool tcp, dds::Writer from) {
    sd::Node node{io_, peer_config()};
    std::vector<Bytes> events;
    const sd::Proxy proxy{node, {.service = someip::ServiceId{service}}};
    const sd::Subscription subscription{
        node,
        {.service = someip::ServiceId{service},
         .eventgroup = someip::EventgroupId{1},
         .events = {someip::MethodId{0x8001}},
         .udp = !tcp,
         .tcp = tcp},
        [&](const someip::Message& event, const Endpoint&) { events.push_back(copy(event.payload)); }};
    EXPECT_TRUE(until([&] { return subscription.active() && !proxy.available().empty(); }));
    EXPECT_EQ(proxy.available().at(0).tcp.has_value(), tcp);
    EXPECT_EQ(proxy.available().at(0).udp.has_value(), !tcp);
    EXPECT_TRUE(until([&] {
      static_cast<void>(from.write(hello_cdr));
      usleep(10'000);
      return !events.empty();
    }));
    EXPECT_EQ(events.at(0), hello);
    return came_by(node);
  };
  EXPECT_EQ(came(0x1001, true, writer("/reliable")), "tcp");
  EXPECT_EQ(came(0x1002, false, writer("/best_effort", string_type, {.reliable = false})), "udp");
}

TEST_F(RouteQos, EventsForReliableTopicsAreSubscribedToOverTcpAndOthersOverUdp) {
  start_bridge(routes_by_reliability("direction: someip_to_dds"));
  const auto connections = [&](std::uint16_t service, bool tcp, const char* topic) {
    sd::Node node{io_, peer_config()};
    constexpr someip::MethodId event{0x8001};
    sd::ServiceSpec spec{
        .service = someip::ServiceId{service}, .instance = someip::InstanceId{1}, .tcp_port = 0};  // both
    spec.eventgroups = {{.id = someip::EventgroupId{1}, .events = {event}}};
    if (tcp) {
      spec.tcp_events = {event};
    }
    const sd::Offer offer{node, spec};
    Inbox<Bytes> inbox;
    const dds::Reader content = reader(topic, string_type, inbox, {.reliable = tcp});
    EXPECT_TRUE(
        until([&] { return content.matched() == 1 && node.subscribers(offer.handle(), event) == 1; }));
    EXPECT_TRUE(until([&] {
      offer.notify(event, hello);
      usleep(10'000);
      return inbox.size() > 0;
    }));
    return node.tcp_server_counters().accepted;
  };
  EXPECT_EQ(connections(0x1001, true, "/reliable"), 1U);
  EXPECT_EQ(connections(0x1002, false, "/best_effort"), 0U);
}

}  // namespace
}  // namespace trestle::test::route_qos_test
