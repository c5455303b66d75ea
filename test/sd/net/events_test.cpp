// Events over TCP and by multicast, and fields.
#include "someip/net/address_text.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::events_test {
namespace {

using someip::Header;
using someip::MessageType;
using someip::MethodId;
using someip::ReturnCode;
using test::calm;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr MethodId over_udp{0x8001};
constexpr MethodId over_tcp{0x8002};
constexpr MethodId notifier{0x8003};
constexpr MethodId getter{0x0001};
constexpr MethodId setter{0x0002};
constexpr EventgroupId group{1};
constexpr EventgroupId other_group{2};

class EventsTest : public test::TwoNodes {
 protected:
  static ServiceSpec mixed() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .tcp_port = 0,
            .eventgroups = {{.id = group, .events = {over_udp, over_tcp}},
                            {.id = other_group, .events = {over_tcp}}},
            .tcp_events = {over_tcp}};
  }
  static SubscribeSpec wanted(EventgroupId which, bool udp, bool tcp) {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .eventgroup = which,
            .events = {over_udp, over_tcp, notifier},
            .udp = udp,
            .tcp = tcp};
  }
  [[nodiscard]] std::vector<std::string> received() const {
    std::vector<std::string> result;
    for (const test::Received& one : events) {
      result.push_back(test::to_hex(one.payload));
    }
    return result;
  }
};

// --- TCP --------------------------------------------------------------------------------------------------

TEST_F(EventsTest, ArriveOverTheConnectionThatTheClientOpenedBefore) {
  covers({"feat_req_someipsd_767", "feat_req_someipsd_788", "feat_req_someipsd_762", "feat_req_someip_644",
          "feat_req_someipsd_752"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  const OfferHandle offer = server.offer(mixed());
  const SubscriptionId subscription = client.subscribe(wanted(group, true, true), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(server.tcp_server_counters().open, 1U);
  EXPECT_THAT(client_log, Contains(HasSubstr("at TCP " + someip::to_string(test::server_address))));

  const auto large = numbers(2 << 20);
  const ByteView slice{large};
  const auto notified = server.notify(offer, over_tcp, {&slice, 1});
  EXPECT_EQ(notified.subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].header, (Header{.service = ServiceId{0x1234},
                                      .method = over_tcp,
                                      .session = notified.session,
                                      .interface_version = 1,
                                      .type = MessageType::notification}));
  EXPECT_EQ(events[0].payload, large);
  EXPECT_EQ(client.reassembly_counters().segments, 0U) << "not by UDP";
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[1].header.method, over_udp);
  EXPECT_EQ(server.tcp_server_counters().streams.messages_sent, 1U);

  client.unsubscribe(subscription);
  EXPECT_TRUE(run_until([&] { return server.tcp_server_counters().open == 0; })) << "needed no more";
}

TEST_F(EventsTest, ComeOnceToWhoSubscribedTwice) {
  covers({"feat_req_someipsd_1168", "feat_req_someip_645"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer(mixed());
  const SubscriptionId one = client.subscribe(wanted(group, true, true), collect());
  const SubscriptionId two = client.subscribe(wanted(other_group, false, true), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one) && client.subscribed(two); }));
  EXPECT_EQ(server.tcp_server_counters().accepted, 1U) << "one connection for both";
  EXPECT_EQ(server.subscribers(offer, over_tcp), 1U);
}

TEST_F(EventsTest, AreRefusedToWhoLacksAnEndpointThatIsNeeded) {
  covers({"feat_req_someipsd_1137"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  server.offer(mixed());
  const SubscriptionId subscription = client.subscribe(wanted(group, true, false), collect());
  EXPECT_TRUE(run_until([&] {
    return std::ranges::any_of(client_log, [](const std::string& line) {
      return line.find("refused by the server; ") != std::string::npos &&
             line.ends_with("a TCP endpoint, too");
    });
  }));
  EXPECT_FALSE(client.subscribed(subscription));
}

TEST_F(EventsTest, AreSubscribedToAgainWhenTheConnectionWasLost) {
  covers({"feat_req_someip_647", "feat_req_someipsd_435", "feat_req_someipsd_767"});
  NodeConfig slow = quick(test::server_address);
  slow.max_tcp_clients = 1;
  auto server = std::make_unique<Node>(io, slow);
  Node client{io, quick(test::client_address), into(client_log)};
  ServiceSpec spec = mixed();
  spec.tcp_port = 40210;
  server->offer(spec);
  const SubscriptionId subscription = client.subscribe(wanted(other_group, false, true), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  // Killed: no StopOffer, but its connections break. It is back before its offer has run out.
  server.reset();
  ASSERT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
  server = std::make_unique<Node>(io, slow);
  const OfferHandle offer = server->offer(spec);
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  ASSERT_TRUE(run_until([&] { return server->subscribers(offer, over_tcp) == 1; }));
  server->notify(offer, over_tcp, {});
  EXPECT_TRUE(run_until([&] { return events.size() == 1; }));
}

TEST_F(EventsTest, AreSubscribedToAgainWhenTheServiceCameBack) {
  covers({"feat_req_someip_679"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  OfferHandle offer = server.offer(mixed());
  const SubscriptionId subscription = client.subscribe(wanted(group, true, true), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  server.withdraw(offer);
  ASSERT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
  offer = server.offer(mixed());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(server.notify(offer, over_tcp, {}).subscribers, 1U);
  EXPECT_TRUE(run_until([&] { return events.size() == 1; }));
}

TEST_F(EventsTest, ComeFromAllInstancesWhenAnyIsWanted) {
  Node server{io, quick(test::server_address)};
  Node other{io, quick(test::other_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  SubscribeSpec any = wanted(group, true, true);
  any.instance = someip::any_instance;
  const SubscriptionId subscription = client.subscribe(any, collect());
  const OfferHandle one = server.offer(mixed());
  ServiceSpec second = mixed();
  second.instance = InstanceId{2};
  const OfferHandle two = other.offer(second);
  ASSERT_TRUE(run_until(
      [&] { return server.subscribers(one, over_tcp) == 1 && other.subscribers(two, over_tcp) == 1; }));
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  server.notify(one, over_udp, {});
  other.notify(two, over_tcp, {});
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  server.withdraw(one);
  ASSERT_TRUE(run_until([&] { return client_log.back().find("is gone: stopped") != std::string::npos; }));
  other.notify(two, over_udp, {});
  ASSERT_TRUE(run_until([&] { return events.size() == 3; }));
  EXPECT_TRUE(client.subscribed(subscription));
}

// --- Multicast --------------------------------------------------------------------------------------------

class MulticastTest : public EventsTest {
 protected:
  static constexpr std::uint16_t port = 40211;
  static ServiceSpec spec(std::size_t threshold) {
    const IpAddress events_group =
        IpAddress::v4(239, 254, test::own_group().bytes[2], test::own_group().bytes[3]);
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .eventgroups = {{.id = group,
                             .events = {over_udp},
                             .multicast = Endpoint{events_group, port},
                             .multicast_threshold = threshold},
                            {.id = other_group, .events = {over_udp}}}};
  }
};

TEST_F(MulticastTest, ReachesAllSubscribersWithOneMessage) {
  covers({"feat_req_someip_811", "feat_req_someip_813", "feat_req_someip_814", "feat_req_someipsd_791"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  Node other{io, quick(test::other_address)};
  const OfferHandle offer = server.offer(spec(1));
  const SubscriptionId one = client.subscribe(wanted(group, true, false), collect());
  const SubscriptionId two = other.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one) && other.subscribed(two); }));
  EXPECT_THAT(client_log, Contains(HasSubstr("multicast events come at 239.254.")));
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U) << "the group";
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[0].from, events[1].from);
  EXPECT_EQ(events[0].from.address, test::server_address) << "from the offered endpoint";
  // In segments too.
  const auto large = numbers(100'000);
  const ByteView slice{large};
  server.notify(offer, over_udp, {&slice, 1});
  ASSERT_TRUE(run_until([&] { return events.size() == 4; }));
  EXPECT_EQ(events[2].payload, large);
  EXPECT_EQ(events[3].payload, large);
}

TEST_F(MulticastTest, IsUsedFromTheThresholdOn) {
  covers({"feat_req_someip_813", "feat_req_someipsd_823"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  Node other{io, quick(test::other_address)};
  const OfferHandle offer = server.offer(spec(2));
  const SubscriptionId one = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one); }));
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(server.sender_counters().datagrams, 1U);
  const SubscriptionId two = other.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return other.subscribed(two); }));
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U) << "the group";
  ASSERT_TRUE(run_until([&] { return events.size() == 3; }));
  EXPECT_EQ(server.sender_counters().datagrams, 2U);
  run_for(30ms);
  EXPECT_THAT(events, SizeIs(3)) << "somebody got it twice";
}

TEST_F(MulticastTest, IsNotUsedWithThresholdZero) {
  covers({"feat_req_someip_813"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log)};
  const OfferHandle offer = server.offer(spec(0));
  const SubscriptionId one = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one); }));
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  EXPECT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_THAT(client_log, Not(Contains(HasSubstr("multicast events"))));
}

TEST_F(MulticastTest, SparesWhoGetsTheEventByUnicastFromAnotherEventgroup) {
  covers({"feat_req_someipsd_1168"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer(spec(1));
  const SubscriptionId one = client.subscribe(wanted(group, true, false), collect());
  SubscribeSpec second = wanted(other_group, true, false);
  second.events = {};
  const SubscriptionId two = client.subscribe(second, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one) && client.subscribed(two); }));
  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  run_for(30ms);
  EXPECT_THAT(events, SizeIs(1));
}

// --- Fields -----------------------------------------------------------------------------------------------

class FieldsTest : public EventsTest {
 protected:
  static std::vector<std::byte> bytes(const std::string& digits) { return test::hex(digits); }
  ServiceSpec spec(std::optional<std::vector<std::byte>> value, bool tcp = false) {
    ServiceSpec result{
        .service = ServiceId{0x1234},
        .instance = InstanceId{1},
        .fields = {{.getter = getter,
                    .setter = setter,
                    .notifier = notifier,
                    .value = std::move(value),
                    .on_set = [](ByteView wanted) -> someip::Result<std::vector<std::byte>, ReturnCode> {
                      if (wanted.size() != 1) {
                        return tl::unexpected{ReturnCode::malformed_message};
                      }
                      // Limited to 0x64.
                      return std::vector<std::byte>{std::min(wanted[0], std::byte{0x64})};
                    }}},
        .eventgroups = {{.id = group, .events = {over_udp, notifier}},
                        {.id = other_group, .events = {notifier}}}};
    if (tcp) {
      result.tcp_port = 0;
      result.tcp_events = {over_udp, notifier};
    }
    return result;
  }
  test::Outcome call(Node& client, RequirementId service, MethodId method, const std::string& digits = "") {
    outcomes.clear();
    const auto payload = bytes(digits);
    const ByteView slice{payload};
    client.call(service, {.method = method}, {&slice, 1}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? test::Outcome{} : outcomes.front();
  }
};

TEST_F(FieldsTest, AreReadAndSet) {
  covers({"feat_req_someip_631", "feat_req_someip_633", "feat_req_someip_634", "feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, calm(test::client_address)};
  const OfferHandle offer = server.offer(spec(bytes("07")));
  run_for(30ms);
  const RequirementId service = client.require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  const SubscriptionId subscription = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(
      run_until([&] { return !client.available(service).empty() && client.subscribed(subscription); }));
  ASSERT_TRUE(run_until([&] { return events.size() == 1; })) << "the initial event";

  EXPECT_EQ(call(client, service, getter).payload, bytes("07"));
  EXPECT_EQ(call(client, service, getter, "00").payload, bytes("07"))
      << "what a newer client adds is ignored";
  EXPECT_EQ(call(client, service, setter, "20").payload, bytes("20"));
  EXPECT_EQ(call(client, service, setter, "ff").payload, bytes("64")) << "the value that was set";
  EXPECT_EQ(call(client, service, setter, "0102").code, ReturnCode::malformed_message);
  EXPECT_EQ(call(client, service, getter).payload, bytes("64"));
  EXPECT_EQ(*server.field(offer, notifier), bytes("64"));
  ASSERT_TRUE(run_until([&] { return events.size() >= 3; }));
  EXPECT_EQ(server.set_field(offer, getter, bytes("05")).subscribers, 1U);
  EXPECT_EQ(server.set_field(offer, getter, bytes("05")).subscribers, 0U) << "no change";
  ASSERT_TRUE(run_until([&] { return events.size() >= 4; }));
  EXPECT_THAT(received(), ElementsAre("07", "20", "64", "05"));
  for (const test::Received& one : events) {
    EXPECT_EQ(one.header.method, notifier);
    EXPECT_EQ(one.header.type, MessageType::notification);
  }
}

TEST_F(FieldsTest, SayWithoutAValueWhatTheyAreTold) {
  Node server{io, calm(test::server_address)};
  Node client{io, calm(test::client_address)};
  ServiceSpec not_ready = spec({});
  not_ready.fields[0].without_value = ReturnCode::not_ready;
  const OfferHandle offer = server.offer(not_ready);
  run_for(30ms);
  const RequirementId service = client.require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  ASSERT_TRUE(run_until([&] { return !client.available(service).empty(); }));
  EXPECT_EQ(call(client, service, getter).code, ReturnCode::not_ready);
  server.set_field(offer, getter, bytes("07"));
  EXPECT_EQ(call(client, service, getter).payload, bytes("07"));
}

TEST_F(FieldsTest, HaveNoValueUntilTheyAreGivenOne) {
  Node server{io, calm(test::server_address)};
  Node client{io, calm(test::client_address)};
  const OfferHandle offer = server.offer(spec({}));
  run_for(30ms);
  const RequirementId service = client.require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  const SubscriptionId subscription = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(
      run_until([&] { return !client.available(service).empty() && client.subscribed(subscription); }));
  EXPECT_EQ(call(client, service, getter).code, ReturnCode::not_ok);
  EXPECT_EQ(server.field(offer, getter), nullptr);
  run_for(30ms);
  EXPECT_THAT(events, IsEmpty());
  server.set_field(offer, notifier, ByteView{});
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_THAT(received(), ElementsAre(""));
  EXPECT_EQ(call(client, service, getter).fault, std::nullopt);
}

TEST_F(FieldsTest, TellEachNewSubscriptionTheirValueOnce) {
  covers({"feat_req_someipsd_833", "feat_req_someipsd_107", "feat_req_someipsd_1167"});
  NodeConfig repeating = calm(test::server_address);
  repeating.timing.cyclic_offer_delay = 500ms;  // each is a reason to renew the subscription
  Node server{io, repeating};
  Node client{io, calm(test::client_address)};
  server.offer(spec(bytes("2a")));
  run_for(30ms);
  SubscriptionId subscription = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_TRUE(client.subscribed(subscription)) << "the Ack comes first";
  run_for(600ms);
  EXPECT_THAT(received(), ElementsAre("2a")) << "renewals bring none, and other events never";
  SubscribeSpec second = wanted(other_group, true, false);
  second.events = {};
  client.subscribe(second, collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 2; })) << "another eventgroup with the field";
  client.unsubscribe(subscription);
  subscription = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 3; })) << "a new subscription";
}

TEST_F(FieldsTest, SendInitialEventsOverTheTransportOfTheNotifier) {
  Node server{io, calm(test::server_address)};
  Node client{io, calm(test::client_address)};
  server.offer(spec(bytes("2a"), true));
  run_for(30ms);
  client.subscribe(wanted(group, false, true), collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(server.tcp_server_counters().streams.messages_sent, 1U);
  EXPECT_EQ(server.sender_counters().messages, 0U);
}

TEST_F(FieldsTest, SendInitialEventsByUnicastWhereOthersAreMulticast) {
  covers({"feat_req_someipsd_793", "feat_req_someip_812"});
  Node server{io, calm(test::server_address)};
  Node client{io, calm(test::client_address)};
  Node other{io, calm(test::other_address)};
  ServiceSpec with_multicast = spec(bytes("2a"));
  const IpAddress events_group =
      IpAddress::v4(239, 253, test::own_group().bytes[2], test::own_group().bytes[3]);
  with_multicast.eventgroups[0].multicast = Endpoint{events_group, 40212};
  const OfferHandle offer = server.offer(with_multicast);
  run_for(30ms);
  const SubscriptionId first = client.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 1 && client.subscribed(first); }));
  other.subscribe(wanted(group, true, false), collect());
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  run_for(30ms);
  EXPECT_THAT(received(), ElementsAre("2a", "2a")) << "the first got the second's initial event too";
  EXPECT_EQ(server.set_field(offer, notifier, bytes("2b")).subscribers, 1U) << "the group";
  ASSERT_TRUE(run_until([&] { return events.size() == 4; }));
}

}  // namespace
}  // namespace trestle::sd::events_test
