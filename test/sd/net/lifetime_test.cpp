// Handlers that end what they were given to, or what is next in line; and answers that come too late.
#include "sd/net/handles.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::lifetime_test {
namespace {

using someip::Message;
using someip::MethodId;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

constexpr MethodId later{0x0001};
constexpr MethodId setter{0x0002};
constexpr MethodId event{0x8001};
constexpr MethodId notifier{0x8002};

class LifetimeTest : public test::TwoNodes {
 protected:
  ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .tcp_port = 0,
            .methods = {{later,
                         [this](const Message&, Responder responder) {
                           waiting.push_back(std::move(responder));
                           if (on_request) {
                             on_request();
                           }
                         }}},
            .fields = {{.setter = setter, .notifier = notifier, .value = test::hex("01")}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {event, notifier}}}};
  }
  RequirementId found(Node& node) {
    const RequirementId id = node.require(needed);
    EXPECT_TRUE(run_until([&] { return !node.available(id).empty(); }));
    return id;
  }
  std::vector<std::byte> payload = test::hex("2a");
  const ByteView slice{payload};

  const RequireSpec needed{.service = ServiceId{0x1234}, .instance = InstanceId{1}};
  const SubscribeSpec wanted{.service = ServiceId{0x1234},
                             .instance = InstanceId{1},
                             .eventgroup = EventgroupId{1},
                             .events = {event}};
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<Responder> waiting;
  std::function<void()> on_request;
  std::vector<std::string> calls;
};

TEST_F(LifetimeTest, AnEventHandlerMayEndItsSubscriptionAndOthers) {
  const Offer offer{server, spec()};
  std::optional<Subscription> first;
  std::optional<Subscription> second;
  std::optional<Subscription> late;
  first.emplace(client, wanted, [&](const Message&, const Endpoint&) {
    calls.emplace_back("first");
    second.reset();
    first.reset();
    late.emplace(client, wanted, [&](const Message&, const Endpoint&) { calls.emplace_back("late"); });
  });
  second.emplace(client, wanted, [&](const Message&, const Endpoint&) { calls.emplace_back("second"); });
  ASSERT_TRUE(run_until([&] { return first->active(); }));
  offer.notify(event, payload);
  ASSERT_TRUE(run_until([&] { return late.has_value(); }));
  ASSERT_TRUE(run_until([&] { return late->active(); }));
  EXPECT_THAT(calls, ElementsAre("first")) << "the others were not there any more, or not yet";
  offer.notify(event, payload);
  ASSERT_TRUE(run_until([&] { return calls.size() == 2; }));
  EXPECT_THAT(calls, ElementsAre("first", "late"));
}

TEST_F(LifetimeTest, AnEventHandlerMayShutTheNodeDown) {
  const OfferHandle offer = server.offer(spec());
  const SubscriptionId subscription = client.subscribe(wanted, [&](const Message&, const Endpoint&) {
    const std::uint64_t before = client.discovery_counters().entries_sent;
    client.shutdown();
    EXPECT_EQ(client.discovery_counters().entries_sent, before + 1) << "StopSubscribeEventgroup";
    calls.emplace_back("down");
  });
  client.subscribe(wanted, [&](const Message&, const Endpoint&) { calls.emplace_back("after"); });
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  server.notify(offer, event, {&slice, 1});
  EXPECT_TRUE(run_until([&] { return server.subscribers(offer, event) == 0; }));
  EXPECT_THAT(calls, ElementsAre("down"));
  EXPECT_FALSE(client.subscribed(subscription));
}

// Which is called while discovery's events are gone through.
TEST_F(LifetimeTest, AnAvailabilityHandlerMayShutTheNodeDown) {
  const OfferHandle offer = server.offer(spec());
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  client.require(needed, [&](const RemoteService&, bool) {
    const std::uint64_t before = client.discovery_counters().entries_sent;
    client.shutdown();
    EXPECT_EQ(client.discovery_counters().entries_sent, before + 1) << "it has been sent when it returns";
    calls.emplace_back("down");
  });
  EXPECT_TRUE(run_until([&] { return server.subscribers(offer, event) == 0; }));
  run_for(20ms);
  EXPECT_THAT(calls, ElementsAre("down"));
}

TEST_F(LifetimeTest, AnAvailabilityHandlerMayReleaseItsServiceAndOthers) {
  RequirementId second{};
  const RequirementId first = client.require(needed, [&](const RemoteService&, bool) {
    calls.emplace_back("first");
    client.release(second);
    client.release(first);
  });
  second = client.require(needed, [&](const RemoteService&, bool) { calls.emplace_back("second"); });
  OfferHandle offer = server.offer(spec());
  ASSERT_TRUE(run_until([&] { return !calls.empty(); }));
  server.withdraw(offer);
  run_for(50ms);
  EXPECT_THAT(calls, ElementsAre("first"));
}

TEST_F(LifetimeTest, AMethodMayWithdrawItsService) {
  std::optional<Offer> offer{std::in_place, server, spec()};
  const RequirementId service = found(client);
  on_request = [&] {
    offer.reset();
    EXPECT_TRUE(waiting.back().respond(payload)) << "the port is there until the request is done with";
  };
  client.call(service, {.method = later, .transport = Transport::udp}, {}, note());
  ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
  EXPECT_EQ(outcomes[0].payload, payload);
}

TEST_F(LifetimeTest, AFieldMayWithdrawItsService) {
  std::optional<Offer> offer;
  ServiceSpec by_setter = spec();
  by_setter.fields[0].on_set =
      [&](ByteView value) -> someip::Result<std::vector<std::byte>, someip::ReturnCode> {
    offer.reset();
    return std::vector<std::byte>{value.begin(), value.end()};
  };
  offer.emplace(server, by_setter);
  const RequirementId service = found(client);
  client.call(service, {.method = setter}, {&slice, 1}, note());
  ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
  EXPECT_EQ(outcomes[0].payload, payload);
  EXPECT_FALSE(offer);

  ServiceSpec by_comparison = spec();
  by_comparison.fields[0].differs = [&](ByteView, ByteView) {
    offer.reset();
    return true;
  };
  offer.emplace(server, by_comparison);
  EXPECT_EQ(server.set_field(offer->handle(), notifier, payload).subscribers, 0U);
  EXPECT_FALSE(offer);
}

TEST_F(LifetimeTest, AnAnswerMayComeWhenTheServiceIsGone) {
  std::optional<Offer> offer{std::in_place, server, spec()};
  const RequirementId service = found(client);
  client.call(service, {.method = later, .timeout = 300ms, .transport = Transport::udp}, {}, note());
  client.call(service, {.method = later, .timeout = 1h, .transport = Transport::tcp}, {}, note());
  ASSERT_TRUE(run_until([&] { return waiting.size() == 2; }));
  offer.reset();
  for (Responder& responder : waiting) {
    responder.respond(payload);  // over UDP its port is closed
    EXPECT_FALSE(responder.pending());
  }
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 2; }));
  waiting.clear();
}

TEST_F(LifetimeTest, AnAnswerMayComeWhenTheNodeIsGone) {
  std::optional<Node> brief{std::in_place, io, quick(test::other_address)};
  brief->offer(spec());
  const RequirementId service = found(client);
  client.call(service, {.method = later, .timeout = 100ms, .transport = Transport::udp}, {}, note());
  client.call(service, {.method = later, .timeout = 1h, .transport = Transport::tcp}, {}, note());
  ASSERT_TRUE(run_until([&] { return waiting.size() == 2; }));
  brief.reset();  // by which the connection ends
  EXPECT_FALSE(waiting[0].respond(payload));
  EXPECT_FALSE(waiting[1].respond(payload));
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 2; }));
  EXPECT_EQ(outcomes[0].fault, CallFault::timed_out);
}

TEST_F(LifetimeTest, AResponseHandlerMayCancelACallThatEndsWithIt) {
  const OfferHandle offer = server.offer(spec());
  const RequirementId service = found(client);
  CallId second{};
  client.call(service, {.method = later, .timeout = 50ms}, {}, [&](const CallResult&) {
    calls.emplace_back("first");
    EXPECT_TRUE(client.cancel(second));
  });
  second = client.call(service, {.method = later, .timeout = 50ms}, {},
                       [&](const CallResult&) { calls.emplace_back("second"); });
  ASSERT_TRUE(run_until([&] { return waiting.size() == 2; }));
  const auto both_are_over = std::chrono::steady_clock::now() + 60ms;
  while (std::chrono::steady_clock::now() < both_are_over) {
  }
  ASSERT_TRUE(run_until([&] { return !calls.empty(); }));
  run_for(20ms);
  EXPECT_THAT(calls, ElementsAre("first"));
  server.withdraw(offer);
}

// The handler lets go the connection by whose end it is called.
TEST_F(LifetimeTest, AResponseHandlerMayReleaseTheServiceWhoseConnectionIsLost) {
  std::optional<Node> brief{std::in_place, io, quick(test::other_address)};
  brief->offer(spec());
  const RequirementId service = found(client);
  client.call(service, {.method = later, .transport = Transport::tcp}, {}, [&](const CallResult& result) {
    EXPECT_FALSE(result);
    client.release(service);
    calls.emplace_back("lost");
  });
  ASSERT_TRUE(run_until([&] { return waiting.size() == 1; }));
  brief.reset();
  ASSERT_TRUE(run_until([&] { return !calls.empty(); }));
  run_for(20ms);
  EXPECT_THAT(client.available(service), IsEmpty());
}

TEST_F(LifetimeTest, ANodeMayEndWithCallsOutstanding) {
  server.offer(spec());
  std::optional<Node> brief{std::in_place, io, quick(test::other_address)};
  const RequirementId service = found(*brief);
  bool gone = false;
  const ResponseHandler handler = [&](const CallResult&) {
    EXPECT_FALSE(gone) << "called by a Node that is gone";
  };
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    const std::size_t before = waiting.size();
    EXPECT_TRUE(run_until([&] {  // again, if the connection took longer than the call may
      brief->call(service, {.method = later, .timeout = 500ms, .transport = transport}, {}, handler);
      return run_until([&] { return waiting.size() > before; }, 500ms);
    }));
  }
  brief->call(RequirementId{4711}, {.method = later}, {}, handler);
  gone = true;
  brief.reset();
  run_for(600ms);
}

}  // namespace
}  // namespace trestle::sd::lifetime_test
