// The rules of a service's description: when fields are sent, what has a session, what may be segmented, who
// gets what.
#include <algorithm>
#include <array>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::rules_test {
namespace {

using someip::Message;
using someip::MethodId;
using someip::ReturnCode;
using someip::SessionId;
using test::calm;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr MethodId echo{0x0001};
constexpr MethodId tell{0x0002};
constexpr MethodId grow{0x0003};
constexpr MethodId event{0x8001};
constexpr MethodId notifier{0x8002};
constexpr EventgroupId group{1};

class RulesTest : public test::TwoNodes {
 protected:
  ServiceSpec spec() {
    return {
        .service = ServiceId{0x1234},
        .instance = InstanceId{1},
        .methods = {{echo, [this](const Message& request,
                                  Responder responder) { sent = responder.respond(request.payload); }},
                    {grow, [this](const auto& /*request*/,
                                  Responder responder) { sent = responder.respond(numbers(1401)); }},
                    {tell,
                     [this](const Message& request, const Responder&) { requests.push_back(request.header); },
                     someip::MethodKind::fire_and_forget}},
        .fields = {{.notifier = notifier, .value = test::hex("07")}},
        .eventgroups = {{.id = group, .events = {event, notifier}}}};
  }
  /// To a server that is calm(): nothing comes of discovery later.
  SubscriptionId subscribe(Node& client) {
    const SubscriptionId id = client.subscribe({.service = ServiceId{0x1234},
                                                .instance = InstanceId{1},
                                                .eventgroup = group,
                                                .events = {event, notifier}},
                                               collect());
    EXPECT_TRUE(run_until([&] { return client.subscribed(id) && !events.empty(); })) << "the initial event";
    run_for(20ms);
    events.clear();
    return id;
  }
  static Notified notify(Node& server, OfferHandle offer, const std::string& payload) {
    const auto bytes = test::hex(payload);
    const ByteView slice{bytes};
    return server.notify(offer, event, {&slice, 1});
  }
  RequirementId found(Node& client, const RequireSpec& wanted = {.service = ServiceId{0x1234}}) {
    const RequirementId id = client.require(wanted);
    EXPECT_TRUE(run_until([&] { return !client.available(id).empty(); }));
    return id;
  }
  test::Outcome call(Node& client, RequirementId service, const CallSpec& spec, ByteView payload = {}) {
    outcomes.clear();
    client.call(service, spec, {&payload, 1}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? test::Outcome{} : outcomes.front();
  }
  [[nodiscard]] std::vector<std::string> received() const {
    std::vector<std::string> result;
    for (const test::Received& one : events) {
      result.push_back(test::to_hex(one.payload));
    }
    return result;
  }

  std::vector<someip::Header> requests;
  std::optional<bool> sent;  ///< what respond() said
};

// --- Fields -----------------------------------------------------------------------------------------------

TEST_F(RulesTest, SendAFieldInACycle) {
  covers({"feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec cyclic = spec();
  cyclic.fields[0].update = {.on_change = false, .cycle = 60ms};
  const OfferHandle offer = server.offer(cyclic);
  subscribe(client);
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; })) << "though it has not changed";
  EXPECT_THAT(received(), Each("07"));
  events.clear();
  EXPECT_EQ(server.set_field(offer, notifier, test::hex("08")).subscribers, 0U) << "waits for its turn";
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; }));
  EXPECT_THAT(received(), Each("08"));
  server.withdraw(offer);
  events.clear();
  run_for(150ms);
  EXPECT_THAT(events, IsEmpty());
}

TEST_F(RulesTest, SendAFieldWhenItDiffersByMoreThanEpsilon) {
  covers({"feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec coarse = spec();
  coarse.fields[0].differs = [](ByteView before, ByteView value) {
    return std::abs(std::to_integer<int>(before[0]) - std::to_integer<int>(value[0])) > 5;
  };
  const OfferHandle offer = server.offer(coarse);
  subscribe(client);
  EXPECT_EQ(server.set_field(offer, notifier, test::hex("0a")).subscribers, 0U);
  EXPECT_EQ(test::to_hex(*server.field(offer, notifier)), "0a") << "it has the value all the same";
  EXPECT_EQ(server.set_field(offer, notifier, test::hex("0c")).subscribers, 0U)
      << "5 from the 7 that was sent";
  EXPECT_EQ(server.set_field(offer, notifier, test::hex("0d")).subscribers, 1U);
  EXPECT_EQ(server.set_field(offer, notifier, test::hex("0e")).subscribers, 0U);
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  run_for(20ms);
  EXPECT_THAT(received(), ElementsAre("0d"));
}

// --- Events with an update rule ---------------------------------------------------------------------------

TEST_F(RulesTest, RepeatAnEventInACycle) {
  covers({"feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec cyclic = spec();
  cyclic.events = {{.id = event, .update = {.on_change = false, .cycle = 60ms}}};
  const OfferHandle offer = server.offer(cyclic);
  subscribe(client);
  run_for(150ms);
  EXPECT_THAT(events, IsEmpty()) << "there is nothing to repeat yet";
  EXPECT_EQ(notify(server, offer, "2a").subscribers, 1U) << "the first of the cycle";
  ASSERT_TRUE(run_until([&] { return events.size() >= 3; }));
  EXPECT_THAT(received(), Each("2a"));
  EXPECT_EQ(events[0].header.method, event);
  EXPECT_EQ(events[2].header.session, SessionId{3});
  events.clear();
  EXPECT_EQ(notify(server, offer, "2b").subscribers, 0U) << "waits for its turn";
  ASSERT_TRUE(run_until([&] { return events.size() >= 2; }));
  EXPECT_THAT(received(), Each("2b"));
  server.withdraw(offer);
  events.clear();
  run_for(150ms);
  EXPECT_THAT(events, IsEmpty());
}

TEST_F(RulesTest, RepeatALargeEventAtItsPace) {
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec cyclic = spec();
  cyclic.events = {{.id = event, .update = {.on_change = false, .cycle = 60ms}}};
  const OfferHandle offer = server.offer(cyclic);
  subscribe(client);
  const auto before = server.sender_counters();
  const auto large = numbers(3200);
  const std::array<ByteView, 2> slices{ByteView{large}.first(1), ByteView{large}.subspan(1)};
  server.notify(offer, event, slices, nullptr, {.segment_bytes = 160});
  ASSERT_TRUE(run_until([&] { return events.size() >= 3; }));
  EXPECT_EQ(events[0].payload, large);
  EXPECT_EQ(events[2].payload, large);
  const auto after = server.sender_counters();
  EXPECT_EQ(after.datagrams - before.datagrams, 20 * (after.messages - before.messages));
}

TEST_F(RulesTest, SendAnEventWhenItIsAnother) {
  covers({"feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec on_change = spec();
  on_change.events = {{.id = event}};
  const OfferHandle offer = server.offer(on_change);
  subscribe(client);
  EXPECT_EQ(notify(server, offer, "2a").session, SessionId{1});
  const Notified same = notify(server, offer, "2a");
  EXPECT_EQ(same.subscribers, 0U);
  EXPECT_EQ(same.dropped, 0U);
  EXPECT_EQ(notify(server, offer, "2b").session, SessionId{2}) << "what is not sent takes none";
  EXPECT_EQ(notify(server, offer, "2a").session, SessionId{3});
  EXPECT_EQ(notify(server, offer, "").session, SessionId{4}) << "no payload is one, too";
  EXPECT_EQ(notify(server, offer, "").subscribers, 0U);
  ASSERT_TRUE(run_until([&] { return events.size() >= 4; }));
  run_for(80ms);
  EXPECT_THAT(received(), ElementsAre("2a", "2b", "2a", "")) << "and nothing by itself";
}

TEST_F(RulesTest, SendAnEventWhenItDiffersByMoreThanEpsilonAndInACycle) {
  covers({"feat_req_someip_635"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec coarse = spec();
  coarse.events = {{.id = event, .update = {.cycle = 400ms}, .differs = [](ByteView before, ByteView value) {
                      return std::abs(std::to_integer<int>(before[0]) - std::to_integer<int>(value[0])) > 5;
                    }}};
  const OfferHandle offer = server.offer(coarse);
  subscribe(client);
  EXPECT_EQ(notify(server, offer, "07").subscribers, 1U);
  EXPECT_EQ(notify(server, offer, "0a").subscribers, 0U);
  EXPECT_EQ(notify(server, offer, "0d").subscribers, 1U);
  EXPECT_EQ(notify(server, offer, "0e").subscribers, 0U) << "until its turn";
  ASSERT_TRUE(run_until([&] { return events.size() >= 3; }));
  EXPECT_THAT(received(), ElementsAre("07", "0d", "0e"));
}

TEST_F(RulesTest, HaveNoInitialValueOfAnEvent) {
  covers({"feat_req_someipsd_833"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec on_change = spec();
  on_change.events = {{.id = event}};
  const OfferHandle offer = server.offer(on_change);
  notify(server, offer, "2a");
  const SubscriptionId id = client.subscribe({.service = ServiceId{0x1234},
                                              .instance = InstanceId{1},
                                              .eventgroup = group,
                                              .events = {event, notifier}},
                                             collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(id) && !events.empty(); }));
  run_for(80ms);
  EXPECT_THAT(received(), ElementsAre("07")) << "of the field alone";
  events.clear();
  EXPECT_EQ(notify(server, offer, "2a").subscribers, 0U) << "is what was sent, if to nobody";
  EXPECT_EQ(notify(server, offer, "2b").subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  EXPECT_THAT(received(), ElementsAre("2b"));
  const auto nobody = [](const Subscriber&) { return false; };
  EXPECT_THROW(server.notify_some(offer, event, nobody, {}), std::invalid_argument);
}

// --- Sessions ---------------------------------------------------------------------------------------------

TEST_F(RulesTest, LeaveTheSessionOutWhereNoneIsWanted) {
  covers({"feat_req_someip_700", "feat_req_someip_667", "feat_req_someiptp_762"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec without = spec();
  without.events_without_session = {event};
  const OfferHandle offer = server.offer(without);
  subscribe(client);
  EXPECT_EQ(server.notify(offer, event, {}).session, SessionId{0});
  EXPECT_EQ(server.notify(offer, event, {}).session, SessionId{0});
  const auto large = numbers(1401);
  const ByteView slice{large};
  EXPECT_EQ(server.notify(offer, event, {&slice, 1}).session, SessionId{1}) << "segments need one";
  EXPECT_NE(server.set_field(offer, notifier, test::hex("08")).session, SessionId{0});
  ASSERT_TRUE(run_until([&] { return events.size() == 4; }));

  const RequirementId service = found(client);
  EXPECT_TRUE(client.send(service, {.method = tell, .session = false}, {}));
  EXPECT_TRUE(client.send(service, {.method = tell}, {}));
  EXPECT_TRUE(client.send(service, {.method = tell, .session = false}, {&slice, 1}));
  ASSERT_TRUE(run_until([&] { return requests.size() == 3; }));
  EXPECT_EQ(requests[0].session, SessionId{0});
  EXPECT_EQ(requests[1].session, SessionId{1});
  EXPECT_EQ(requests[2].session, SessionId{2});
}

// --- Receivers --------------------------------------------------------------------------------------------

TEST_F(RulesTest, SendAnEventToChosenSubscribers) {
  covers({"feat_req_someip_804"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  Node other{io, quick(test::other_address)};
  ServiceSpec by_multicast = spec();
  by_multicast.eventgroups[0].multicast =
      Endpoint{IpAddress::v4(239, 252, test::own_group().bytes[2], test::own_group().bytes[3]), 40220};
  const OfferHandle offer = server.offer(by_multicast);
  subscribe(client);
  const SubscriptionId second = other.subscribe(
      {.service = ServiceId{0x1234}, .instance = InstanceId{1}, .eventgroup = group, .events = {event}},
      [](const Message&, const Endpoint&) { FAIL() << "not chosen"; });
  ASSERT_TRUE(run_until([&] { return other.subscribed(second); }));
  const auto payload = test::hex("2a");
  const ByteView slice{payload};
  const auto chosen = [](const Subscriber& one) { return one.peer.address == test::client_address; };
  EXPECT_EQ(server.notify_some(offer, event, chosen, {&slice, 1}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  run_for(20ms);
  EXPECT_THAT(received(), ElementsAre("2a"));
  EXPECT_EQ(server.notify_some(offer, event, [](const Subscriber&) { return false; }, {}).subscribers, 0U);
  EXPECT_THROW(server.notify_some(offer, notifier, chosen, {&slice, 1}), std::invalid_argument);
}

TEST_F(RulesTest, TellVersionsOfAServiceApartAtOnePort) {
  covers({"feat_req_someipcompat_801"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  for (const std::uint8_t major : {std::uint8_t{1}, std::uint8_t{2}}) {
    ServiceSpec one{
        .service = ServiceId{0x1234}, .instance = InstanceId{1}, .major = major, .udp_port = 40221};
    one.methods = {{echo, [major](const Message&, Responder responder) {
                      const std::array<std::byte, 1> answer{std::byte{major}};
                      responder.respond(ByteView{answer});
                    }}};
    server.offer(one);
  }
  const RequirementId first = found(client, {.service = ServiceId{0x1234}, .major = 1});
  const RequirementId second = found(client, {.service = ServiceId{0x1234}, .major = 2});
  EXPECT_EQ(client.available(first)[0].udp, client.available(second)[0].udp);
  EXPECT_EQ(test::to_hex(call(client, first, {.method = echo}).payload), "01");
  EXPECT_EQ(test::to_hex(call(client, second, {.method = echo}).payload), "02");
}

// --- Segments ---------------------------------------------------------------------------------------------

TEST_F(RulesTest, SegmentOnlyWhatMayBeSegmented) {
  covers({"feat_req_someiptp_788"});
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec some = spec();
  some.segmented = {event};
  const OfferHandle offer = server.offer(some);
  subscribe(client);
  const auto large = numbers(1401);
  const ByteView slice{large};
  EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U);
  EXPECT_EQ(server.set_field(offer, notifier, large).dropped, 1U);
  EXPECT_EQ(server.counters().not_to_be_segmented, 1U);
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  run_for(20ms);
  EXPECT_THAT(events, SizeIs(1));

  // A response, a request that comes, and one that does not leave.
  const RequirementId all = found(client);
  const test::Outcome outcome = call(client, all, {.method = grow});
  EXPECT_EQ(sent, false);
  EXPECT_EQ(outcome.fault, CallFault::error) << "rather than no answer";
  EXPECT_EQ(outcome.code, ReturnCode::not_ok);
  sent.reset();
  EXPECT_EQ(call(client, all, {.method = echo}, large).code, ReturnCode::not_ok);
  EXPECT_EQ(sent, std::nullopt) << "nobody is asked";
  EXPECT_EQ(call(client, all, {.method = echo}, slice.first(1400)).payload, numbers(1400));
  const RequirementId none =
      found(client, {.service = ServiceId{0x1234}, .segmented = std::vector<MethodId>{}});
  EXPECT_EQ(call(client, none, {.method = echo}, large).fault, CallFault::not_sent);
  EXPECT_EQ(call(client, none, {.method = echo}, slice.first(1400)).payload, numbers(1400));
  EXPECT_FALSE(client.send(none, {.method = tell}, {&slice, 1}));
  EXPECT_EQ(client.counters().not_to_be_segmented, 2U);
}

// --- Datagrams --------------------------------------------------------------------------------------------

TEST_F(RulesTest, PutMessagesOfAllServicesOfAPortIntoOneDatagram) {
  covers({"feat_req_someip_732", "feat_req_someip_741"});
  NodeConfig collecting = quick(test::server_address);
  collecting.collect_for = 200ms;
  Node server{io, collecting};
  Node client{io, quick(test::client_address)};
  std::vector<OfferHandle> offers;
  for (const ServiceId id : {ServiceId{0x1234}, ServiceId{0x1235}}) {
    ServiceSpec one = spec();
    one.service = id;
    one.fields = {};
    one.eventgroups[0].events = {event};
    offers.push_back(server.offer(one));
    const SubscriptionId subscription = client.subscribe(
        {.service = id, .instance = InstanceId{1}, .eventgroup = group, .events = {event}}, collect());
    ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  }
  EXPECT_EQ(server.notify(offers[0], event, {}).subscribers, 1U);
  EXPECT_EQ(server.notify(offers[1], event, {}).subscribers, 1U);
  EXPECT_EQ(server.notify(offers[0], event, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 3; }));
  EXPECT_EQ(client.counters().datagrams, 1U);
  EXPECT_EQ(events[0].header.service, ServiceId{0x1234});
  EXPECT_EQ(events[1].header.service, ServiceId{0x1235});
  EXPECT_EQ(events[2].header.service, ServiceId{0x1234});
}

// --- Ids --------------------------------------------------------------------------------------------------

TEST_F(RulesTest, RefuseReservedIds) {
  covers({"feat_req_someipids_636"});
  Node node{io, quick(test::server_address)};
  for (const MethodId reserved : {MethodId{0}, MethodId{0x7fff}, MethodId{0x8000}, MethodId{0xffff}}) {
    const auto refusal = [&](auto change) -> std::string {
      ServiceSpec wrong = spec();
      change(wrong);
      try {
        node.offer(wrong);
      } catch (const std::invalid_argument& error) {
        return error.what();
      }
      return "";
    };
    EXPECT_THAT(refusal([&](ServiceSpec& s) { s.methods[0].id = reserved; }), HasSubstr("is reserved"));
    EXPECT_THAT(refusal([&](ServiceSpec& s) { s.fields[0].notifier = reserved; }), HasSubstr("is reserved"));
    EXPECT_THAT(refusal([&](ServiceSpec& s) { s.eventgroups[0].events[0] = reserved; }),
                HasSubstr("is reserved"));
    EXPECT_THROW(
        node.subscribe({.service = ServiceId{0x1234}, .eventgroup = group, .events = {reserved}}, collect()),
        std::invalid_argument);
  }
  EXPECT_NO_THROW(node.offer(spec()));
}

// --- Silence, and what stays ------------------------------------------------------------------------------

TEST_F(RulesTest, SubscribeAnewWhenNoEventComes) {
  covers({"feat_req_someipsd_439", "feat_req_someipsd_691"});
  Node server{io, calm(test::server_address)};  // so that no offer renews the subscription meanwhile
  Node client{io, quick(test::client_address)};
  ServiceSpec silent = spec();
  silent.fields = {};
  silent.eventgroups[0].events = {event};
  const OfferHandle offer = server.offer(silent);
  run_for(60ms);
  SubscribeSpec wanted{.service = ServiceId{0x1234}, .instance = InstanceId{1}, .eventgroup = group};
  wanted.events = {event};
  wanted.silence_timeout = 120ms;
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  // Until the machine lets us be so quick that it is never silent.
  bool quick_enough = false;
  for (int tries = 0; tries < 20 && !quick_enough; ++tries) {
    Duration longest{};
    server.notify(offer, event, {});
    run_for(10ms);
    const std::uint64_t before = client.discovery_counters().silences;
    for (int i = 0; i < 5; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      server.notify(offer, event, {});
      run_for(50ms);
      longest = std::max(longest, std::chrono::steady_clock::now() - begin);
    }
    quick_enough = longest < 70ms;
    EXPECT_TRUE(!quick_enough || client.discovery_counters().silences == before) << "events came";
  }
  if (!quick_enough) {
    GTEST_SKIP() << "the machine stalls all the time";
  }
  const std::uint64_t before = client.discovery_counters().silences;
  EXPECT_TRUE(run_until([&] { return client.discovery_counters().silences > before; }));
  EXPECT_TRUE(client.subscribed(subscription));
}

TEST_F(RulesTest, KeepTheCountersOfPortsThatAreClosed) {
  Node server{io, calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec both = spec();
  both.tcp_port = 0;
  const OfferHandle offer = server.offer(both);
  const RequirementId service = found(client);
  EXPECT_EQ(call(client, service, {.method = echo, .transport = Transport::tcp}).fault, std::nullopt);
  EXPECT_EQ(call(client, service, {.method = echo, .transport = Transport::udp}).fault, std::nullopt);
  subscribe(client);
  server.notify(offer, event, {});
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  const auto of_udp = server.sender_counters();
  EXPECT_GE(of_udp.messages, 3U) << "a response, an initial event, an event";
  client.shutdown();
  server.shutdown();
  EXPECT_EQ(server.sender_counters().messages, of_udp.messages);
  EXPECT_EQ(server.sender_counters().datagrams, of_udp.datagrams);
  EXPECT_EQ(server.tcp_server_counters().accepted, 1U);
  EXPECT_EQ(server.tcp_server_counters().streams.messages_sent, 1U);
  EXPECT_EQ(server.tcp_server_counters().open, 0U);
  EXPECT_GE(client.sender_counters().messages, 1U);
}

}  // namespace
}  // namespace trestle::sd::rules_test
