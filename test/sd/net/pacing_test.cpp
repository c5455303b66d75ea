// Large events leave in bursts of what each subscriber can take, as its subscription tells, and answers to a
// client that has subscribed likewise; large requests in those of what the server can, if its offer tells. On
// one host the system tells, too.
#include "someip/net/local_room.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::pacing_test {
namespace {

using someip::Message;
using someip::MethodId;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
using namespace std::chrono_literals;

constexpr MethodId event{0x8001};
constexpr EventgroupId group{1};
constexpr std::uint16_t port = 40246;

class Pacing : public test::TwoNodes {
 protected:
  static NodeConfig with_buffer(const IpAddress& address, int bytes) {
    NodeConfig config = quick(address);
    config.receive_buffer_bytes = bytes;
    return config;
  }
  /// That tells nothing of its buffer, and does not ask the system for those of others.
  static NodeConfig untold(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.discovery.tell_receive_buffer = false;
    return config;
  }
  static ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .udp_port = port,
            .eventgroups = {{.id = group, .events = {event}}}};
  }
  void subscribe(Node& client) {
    const SubscriptionId id =
        client.subscribe({.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}},
                         [this, &client](const Message& message, const Endpoint&) {
                           sizes.push_back(message.payload.size());
                           receivers.push_back(&client);
                         });
    ASSERT_TRUE(run_until([&] { return client.subscribed(id); }));
  }
  [[nodiscard]] bool system_tells() {
    const someip::UdpSocket socket{io, {.local = {test::own_address(4), 0}}};
    return someip::LocalRoom{}.of(socket.local(), socket.local()).has_value();
  }
  /// What the subscribers have told.
  static std::vector<std::uint32_t> told_to(Node& server, OfferHandle offer) {
    std::vector<std::uint32_t> told;
    static_cast<void>(server.notify_some(offer, event,
                                         [&](const Subscriber& subscriber) {
                                           told.push_back(subscriber.receive_buffer_bytes);
                                           return false;
                                         },
                                         {}));
    return told;
  }
  /// How many segments of a message of 200 leave at once; all arrive.
  std::uint64_t burst_of(Node& server, OfferHandle offer, const someip::TpPacing& pacing = {}) {
    run_for(2ms);  // from the burst before
    sizes.clear();
    const std::uint64_t before = server.sender_counters().datagrams;
    const auto payload = numbers(200 * 1392);
    const ByteView slice{payload};
    EXPECT_EQ(server.notify(offer, event, {&slice, 1}, nullptr, pacing).subscribers, 1U);
    const std::uint64_t burst = server.sender_counters().datagrams - before;
    EXPECT_TRUE(run_until([&] { return !sizes.empty(); }));
    EXPECT_EQ(server.sender_counters().datagrams - before, 200U);
    EXPECT_THAT(sizes, ElementsAre(200 * 1392));
    return burst;
  }

  std::vector<std::size_t> sizes;  ///< of the messages in the order of their arrival
  std::vector<const Node*> receivers;
};

TEST_F(Pacing, IsThatOfTheSubscribersBuffer) {
  covers({"feat_req_someiptp_801", "feat_req_someipsd_946"});
  Node server{io, quick(test::server_address)};
  Node client{io, with_buffer(test::client_address, 180'000)};
  const OfferHandle offer = server.offer(spec());
  subscribe(client);
  EXPECT_THAT(told_to(server, offer), ElementsAre(180'000));
  EXPECT_EQ(burst_of(server, offer), 39U);
}

TEST_F(Pacing, IsThatOfTheApplicationIfItHasOne) {
  Node server{io, quick(test::server_address)};
  Node client{io, with_buffer(test::client_address, 180'000)};
  const OfferHandle offer = server.offer(spec());
  subscribe(client);
  EXPECT_EQ(burst_of(server, offer, {.burst = 30}), 30U);
  EXPECT_EQ(burst_of(server, offer, {.burst = 7}), 7U);
}

TEST_F(Pacing, IsTheDefaultForASubscriberThatDoesNotTell) {
  covers({"feat_req_someiptp_801"});
  Node server{io, untold(test::server_address)};
  Node client{io, untold(test::client_address)};
  const OfferHandle offer = server.offer(spec());
  subscribe(client);
  EXPECT_THAT(told_to(server, offer), ElementsAre(0));
  EXPECT_EQ(burst_of(server, offer), 48U);
}

TEST_F(Pacing, HasNoPausesOnThisHostWhileTheSocketHasRoom) {
  if (!system_tells()) {
    GTEST_SKIP() << "the system does not tell of sockets (sock_diag)";
  }
  Node server{io, quick(test::server_address)};
  Node client{io, untold(test::client_address)};
  const OfferHandle offer = server.offer(spec());
  subscribe(client);
  EXPECT_THAT(told_to(server, offer), ElementsAre(0));
  EXPECT_EQ(burst_of(server, offer), 200U);
  EXPECT_EQ(burst_of(server, offer, {.burst = 7}), 7U) << "as the application wants";
}

// Each at its own pace, and no one's pauses are another one's.
TEST_F(Pacing, IsOfEachSubscriberByItself) {
  Node server{io, quick(test::server_address)};
  Node small{io, with_buffer(test::client_address, 150'000)};  // 32 segments
  Node large{io, with_buffer(test::other_address, 200'000)};   // 43
  const OfferHandle offer = server.offer(spec());
  subscribe(small);
  subscribe(large);
  EXPECT_THAT(told_to(server, offer), UnorderedElementsAre(150'000, 200'000));
  const auto payload = numbers(100 * 1392);
  const ByteView slice{payload};
  using Clock = std::chrono::steady_clock;
  // Who comes first is only known when the machine does not stand still for the time of a burst.
  bool stood_still = true;
  for (int tries = 0; tries < 100 && stood_still; ++tries) {
    run_for(100ms);  // from the bursts before
    sizes.clear();
    receivers.clear();
    const std::uint64_t before = server.sender_counters().datagrams;
    const auto begin = Clock::now();
    server.notify(offer, event, {&slice, 1}, nullptr, {.separation = 50ms});
    EXPECT_EQ(server.sender_counters().datagrams - before, 75U);
    // Another message has nothing left of the bursts.
    server.notify(offer, event, {&slice, 1}, nullptr, {.separation = 50ms});
    const std::uint64_t at_once = server.sender_counters().datagrams - before;
    auto last = Clock::now();
    stood_still = last - begin >= 40ms;
    if (!stood_still) {
      EXPECT_EQ(at_once, 75U);
    }
    const auto have_come = [&](std::size_t messages) {
      const auto now = Clock::now();
      stood_still = stood_still || now - last >= 40ms;
      last = now;
      return sizes.size() >= messages;
    };
    // The large one has the messages in three and five bursts, the small one in four and seven.
    ASSERT_TRUE(run_until([&] { return have_come(2); }));
    EXPECT_GE(Clock::now() - begin, 150ms);
    ASSERT_TRUE(run_until([&] { return have_come(4); }));
    EXPECT_GE(Clock::now() - begin, 300ms);
  }
  ASSERT_FALSE(stood_still);
  EXPECT_THAT(receivers, ElementsAre(&large, &small, &large, &small));
}

// Of those who get an event by multicast, the one that can take the least.
TEST_F(Pacing, IsThatOfTheLeastInAGroup) {
  Node server{io, quick(test::server_address)};
  NodeConfig silent = quick(test::client_address);
  silent.discovery.tell_receive_buffer = false;  // 48 segments
  Node client{io, silent};
  Node small{io, with_buffer(test::other_address, 150'000)};  // 32
  ServiceSpec service = spec();
  service.eventgroups[0].multicast = Endpoint{test::own_group(), port};
  service.eventgroups[0].multicast_threshold = 1;
  const OfferHandle offer = server.offer(std::move(service));
  const auto burst = [&] {
    run_for(2ms);
    const std::uint64_t before = server.sender_counters().datagrams;
    const auto payload = numbers(100 * 1392);
    const ByteView slice{payload};
    EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U) << "the group";
    const std::uint64_t sent = server.sender_counters().datagrams - before;
    EXPECT_TRUE(run_until([&] { return server.sender_counters().datagrams - before == 100; }));
    return sent;
  };
  subscribe(client);
  EXPECT_EQ(burst(), 48U);
  subscribe(small);
  EXPECT_EQ(burst(), 32U);
  // Who can take nothing at all, or says so, slows the others no further.
  Node tiny{io, with_buffer(test::own_address(4), 4096)};
  subscribe(tiny);
  EXPECT_EQ(burst(), 32U);
}

// 1600 bytes are two segments of the node's, and ten of 160 bytes.
TEST_F(Pacing, IsThatOfAFieldInAllThatItSends) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_801"});
  constexpr MethodId getter{0x0001};
  constexpr MethodId setter{0x0002};
  constexpr std::size_t in_field = 10;
  ServiceSpec service = spec();
  service.fields = {{.getter = getter,
                     .setter = setter,
                     .notifier = event,
                     .value = numbers(1600),
                     .pacing = someip::TpPacing{.segment_bytes = 160, .separation = 0ms}}};
  Node server{io, test::calm(test::server_address)};
  Node client{io, test::calm(test::client_address)};
  const OfferHandle offer = server.offer(std::move(service));
  run_for(30ms);  // its offer is over: the client asks for one, and gets an initial event for that one
  const auto sent = [&] { return server.sender_counters().datagrams; };
  subscribe(client);
  ASSERT_TRUE(run_until([&] { return sizes.size() == 1; }));
  EXPECT_EQ(sent(), in_field) << "the initial event";
  server.set_field(offer, event, numbers(1600, 1));
  ASSERT_TRUE(run_until([&] { return sizes.size() == 2; }));
  EXPECT_EQ(sent(), 2 * in_field) << "a notification";
  const RequirementId required = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  client.call(required, {.method = getter}, {}, note());
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
  EXPECT_EQ(outcomes[0].payload, numbers(1600, 1));
  EXPECT_EQ(sent(), 3 * in_field) << "the getter's answer";
  const std::vector<std::byte> wanted = numbers(1600, 2);
  const ByteView slice{wanted};
  client.call(required, {.method = setter}, {&slice, 1}, note());
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 2 && sizes.size() == 3; }));
  EXPECT_EQ(outcomes[1].payload, wanted);
  EXPECT_EQ(sent(), 5 * in_field) << "the setter's answer, and a notification";
}

TEST_F(Pacing, IsThatOfACallAndOfItsMethod) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_801"});
  constexpr MethodId paced{0x0001};
  constexpr MethodId plain{0x0002};
  const RequestHandler echo = [](const Message& request, Responder responder) {
    responder.respond(request.payload);
  };
  ServiceSpec service = spec();
  service.methods = {
      {.id = paced, .handler = echo, .pacing = someip::TpPacing{.segment_bytes = 160, .separation = 0ms}},
      {.id = plain, .handler = echo}};
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(std::move(service));
  const RequirementId required = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  const std::vector<std::byte> payload = numbers(1600);
  /// Datagrams of the request and of the answer.
  const auto datagrams = [&](const CallSpec& call) {
    const std::uint64_t requests = client.sender_counters().datagrams;
    const std::uint64_t answers = server.sender_counters().datagrams;
    const ByteView slice{payload};
    outcomes.clear();
    client.call(required, call, {&slice, 1}, note());
    EXPECT_TRUE(run_until([&] { return outcomes.size() == 1; }));
    EXPECT_EQ(outcomes.at(0).payload, payload);
    return std::pair{client.sender_counters().datagrams - requests,
                     server.sender_counters().datagrams - answers};
  };
  EXPECT_EQ(datagrams({.method = plain}), (std::pair{2UL, 2UL}));
  EXPECT_EQ(datagrams({.method = paced}), (std::pair{2UL, 10UL}));
  EXPECT_EQ(datagrams({.method = plain, .pacing = someip::TpPacing{.segment_bytes = 320, .separation = 0ms}}),
            (std::pair{5UL, 2UL}));
}

// Of a request of 200 segments.
class RequestPacing : public Pacing {
 protected:
  static constexpr MethodId take{0x0001};

  static ServiceSpec taking_large_requests() {
    ServiceSpec service = spec();
    service.methods = {
        {.id = take, .handler = [](const Message&, Responder responder) { responder.respond(ByteView{}); }}};
    service.segmented = {take};
    return service;
  }
  std::uint64_t burst_of_request(Node& client, const CallSpec& call = {.method = take}) {
    const RequirementId required = client.require({.service = ServiceId{0x1234}});
    EXPECT_TRUE(run_until([&] { return !client.available(required).empty(); }));
    configuration = client.configuration(client.available(required).at(0));
    run_for(2ms);  // from the burst before
    const std::uint64_t before = client.sender_counters().datagrams;
    const auto payload = numbers(200 * 1392);
    const ByteView slice{payload};
    outcomes.clear();
    client.call(required, call, {&slice, 1}, note());
    const std::uint64_t burst = client.sender_counters().datagrams - before;
    EXPECT_TRUE(run_until([&] { return outcomes.size() == 1; }));
    EXPECT_EQ(outcomes.at(0).fault, std::nullopt);
    return burst;
  }

  std::vector<ConfigurationText> configuration;
};

TEST_F(RequestPacing, IsThatOfTheServersBufferIfItsOfferTells) {
  covers({"feat_req_someiptp_801", "feat_req_someipsd_857"});
  Node server{io, with_buffer(test::server_address, 180'000)};
  Node client{io, quick(test::client_address)};
  server.offer(taking_large_requests());
  EXPECT_EQ(burst_of_request(client), 39U);
  EXPECT_THAT(configuration, ElementsAre(ConfigurationText{"trestle.rcvbuf", "180000"}));
  EXPECT_EQ(burst_of_request(client, {.method = take, .pacing = someip::TpPacing{.burst = 30}}), 30U)
      << "as the application wants";
}

TEST_F(RequestPacing, IsTheDefaultForAServerThatDoesNotTell) {
  Node server{io, untold(test::server_address)};
  Node client{io, untold(test::client_address)};
  server.offer(taking_large_requests());
  EXPECT_EQ(burst_of_request(client), 48U);
  EXPECT_THAT(configuration, IsEmpty());
}

// An offer goes to everybody: it has no more in it than it needs.
TEST_F(RequestPacing, IsOnlyToldWhereLargeRequestsAreExpected) {
  Node server{io, quick(test::server_address)};
  Node client{io, untold(test::client_address)};
  ServiceSpec open = taking_large_requests();
  open.segmented.reset();
  const OfferHandle first = server.offer(std::move(open));
  EXPECT_EQ(burst_of_request(client), 48U);
  EXPECT_THAT(configuration, IsEmpty());
  const RequirementId required = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  server.withdraw(first);
  ASSERT_TRUE(run_until([&] { return client.available(required).empty(); }));
  ServiceSpec own = taking_large_requests();
  own.configuration = {{"key", "value"}};
  server.offer(std::move(own));
  EXPECT_EQ(burst_of_request(client), 48U);
  EXPECT_THAT(configuration, ElementsAre(ConfigurationText{"key", "value"}));
}

// Of an answer of 200 segments.
class AnswerPacing : public Pacing {
 protected:
  static constexpr MethodId give{0x0002};
  static constexpr MethodId give_slowly{0x0003};

  static ServiceSpec giving_large_answers() {
    const RequestHandler handler = [](const Message&, Responder responder) {
      const auto answer = numbers(200 * 1392);
      responder.respond(answer);
    };
    ServiceSpec service = spec();
    service.methods = {{.id = give, .handler = handler},
                       {.id = give_slowly, .handler = handler, .pacing = someip::TpPacing{.burst = 7}}};
    return service;
  }
  std::uint64_t burst_of_answer(Node& server, Node& client, MethodId method = give) {
    const RequirementId required = client.require({.service = ServiceId{0x1234}});
    EXPECT_TRUE(run_until([&] { return !client.available(required).empty(); }));
    run_for(2ms);  // from the burst before
    const std::uint64_t before = server.sender_counters().datagrams;
    outcomes.clear();
    client.call(required, {.method = method}, {}, note());
    EXPECT_TRUE(run_until([&] { return server.sender_counters().datagrams > before; }));
    const std::uint64_t burst = server.sender_counters().datagrams - before;
    EXPECT_TRUE(run_until([&] { return outcomes.size() == 1; }));
    EXPECT_EQ(outcomes.at(0).payload, numbers(200 * 1392));
    return burst;
  }
};

TEST_F(AnswerPacing, IsThatOfTheClientsBufferIfItHasSubscribed) {
  covers({"feat_req_someiptp_801", "feat_req_someipsd_946"});
  Node server{io, untold(test::server_address)};
  Node client{io, with_buffer(test::client_address, 180'000)};
  server.offer(giving_large_answers());
  EXPECT_EQ(burst_of_answer(server, client), 48U) << "it has not told";
  subscribe(client);
  EXPECT_EQ(burst_of_answer(server, client), 39U);
  EXPECT_EQ(burst_of_answer(server, client, give_slowly), 7U) << "as the application wants";
}

TEST_F(AnswerPacing, IsNotThatOfAnotherClient) {
  Node server{io, untold(test::server_address)};
  Node client{io, quick(test::client_address)};
  Node other{io, with_buffer(test::other_address, 180'000)};
  server.offer(giving_large_answers());
  subscribe(other);
  EXPECT_EQ(burst_of_answer(server, client), 48U);
}

TEST_F(AnswerPacing, IsTheDefaultForAClientThatDoesNotTell) {
  Node server{io, untold(test::server_address)};
  Node client{io, untold(test::client_address)};
  server.offer(giving_large_answers());
  subscribe(client);
  EXPECT_EQ(burst_of_answer(server, client), 48U);
}

// As the guide shows it: nothing is said of segments, and nobody subscribes.
TEST_F(AnswerPacing, HasNoPausesOnThisHostNorHasThatOfTheRequest) {
  if (!system_tells()) {
    GTEST_SKIP() << "the system does not tell of sockets (sock_diag)";
  }
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec echo = spec();
  echo.methods = {{.id = give, .handler = [](const Message& request, Responder responder) {
                     responder.respond(request.payload);
                   }}};
  server.offer(std::move(echo));
  const RequirementId required = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  const auto payload = numbers(200 * 1392);
  const ByteView slice{payload};
  client.call(required, {.method = give}, {&slice, 1}, note());
  EXPECT_EQ(client.sender_counters().datagrams, 200U);
  ASSERT_TRUE(run_until([&] { return server.sender_counters().datagrams > 0; }));
  EXPECT_EQ(server.sender_counters().datagrams, 200U);
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
  EXPECT_EQ(outcomes[0].payload, payload);
}

}  // namespace
}  // namespace trestle::sd::pacing_test
