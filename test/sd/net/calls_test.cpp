#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <deque>

#include "someip/net/address_text.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::calls_test {
namespace {

using someip::AnswerDrop;
using someip::Header;
using someip::Message;
using someip::MessageType;
using someip::MethodId;
using someip::MethodKind;
using someip::ReturnCode;
using test::covers;
using test::numbers;
using test::Outcome;
using test::quick;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr MethodId echo{0x0001};
constexpr MethodId later{0x0002};
constexpr MethodId refuse{0x0003};
constexpr MethodId tell{0x0004};
constexpr MethodId forget{0x0005};

class CallsTest : public test::TwoNodes {
 protected:
  ServiceSpec spec(std::optional<std::uint16_t> udp, std::optional<std::uint16_t> tcp) {
    return {
        .service = ServiceId{0x1234},
        .instance = InstanceId{1},
        .major = 2,
        .udp_port = udp,
        .tcp_port = tcp,
        .methods = {
            {echo,
             [this](const Message& request, Responder responder) {
               requests.push_back(request.header);
               callers.push_back(responder.caller());
               EXPECT_TRUE(responder.respond(request.payload));
               EXPECT_FALSE(responder.respond(request.payload)) << "answered twice";
             }},
            {later, [this](const Message&, Responder responder) { waiting.push_back(std::move(responder)); }},
            {refuse, [](const Message& request,
                        Responder responder) { responder.error(ReturnCode{0x21}, request.payload); }},
            {tell,
             [this](const Message& request, Responder responder) {
               EXPECT_FALSE(responder.pending());
               EXPECT_FALSE(responder.respond());
               requests.push_back(request.header);
             },
             MethodKind::fire_and_forget},
            {forget, [](const Message&, const Responder&) {}}}};
  }
  /// Calls, and waits for the outcome.
  Outcome call(Node& client, RequirementId service, CallSpec call, ByteView payload = {}) {
    outcomes.clear();
    client.call(service, call, {&payload, 1}, note());
    EXPECT_THAT(outcomes, IsEmpty()) << "called back from within the call";
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? Outcome{} : outcomes.front();
  }
  [[nodiscard]] bool found(Node& client, RequirementId service) {
    return run_until([&] { return !client.available(service).empty(); });
  }

  const RequireSpec wanted{.service = ServiceId{0x1234}, .instance = InstanceId{1}, .major = 2};
  std::vector<Header> requests;
  std::vector<Endpoint> callers;
  std::deque<Responder> waiting;
};

TEST_F(CallsTest, AreAnsweredOverUdp) {
  covers({"feat_req_someip_329", "feat_req_someip_338", "feat_req_someip_49", "feat_req_someip_345",
          "feat_req_someip_660", "feat_req_someip_699", "feat_req_someip_701", "feat_req_someip_141"});
  Node server{io, quick(test::server_address)};
  NodeConfig config = quick(test::client_address);
  config.client = someip::ClientId{0x4711};
  Node client{io, config};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  const auto payload = numbers(100);
  const Outcome outcome = call(client, service, {.method = echo}, payload);
  EXPECT_EQ(outcome.fault, std::nullopt);
  EXPECT_EQ(outcome.payload, payload);
  ASSERT_THAT(requests, SizeIs(1));
  EXPECT_EQ(requests[0], (Header{.service = ServiceId{0x1234},
                                 .method = echo,
                                 .client = someip::ClientId{0x4711},
                                 .session = someip::SessionId{1},
                                 .interface_version = 2}));
  EXPECT_EQ(callers[0].address, test::client_address);

  EXPECT_TRUE(client.send(service, {.method = tell}, {}));
  ASSERT_TRUE(run_until([&] { return requests.size() == 2; }));
  EXPECT_EQ(requests[1].type, MessageType::request_no_return);
  EXPECT_EQ(server.counters().requests, 2U);
  EXPECT_EQ(client.call_counters(), (someip::CallCounters{.started = 1, .answered = 1}));
}

TEST_F(CallsTest, AreAnsweredOverTcpByTheSameConnection) {
  covers({"feat_req_someip_49", "feat_req_someip_646", "feat_req_someip_644", "feat_req_someip_645"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({}, 0));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  EXPECT_EQ(client.tcp_client_counters().connections, 0U) << "not before the first call";
  const auto large = numbers(3 << 20);
  EXPECT_EQ(call(client, service, {.method = echo}, large).payload, large);
  const auto little = numbers(5);
  EXPECT_EQ(call(client, service, {.method = echo}, little).payload, little);
  EXPECT_TRUE(client.send(service, {.method = tell}, {}));
  ASSERT_TRUE(run_until([&] { return requests.size() == 3; }));
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
  EXPECT_EQ(server.tcp_server_counters().accepted, 1U);
  EXPECT_EQ(client.reassembly_counters().segments, 0U);
}

TEST_F(CallsTest, TakeTheTransportThatFitsOrIsAskedFor) {
  covers({"feat_req_someip_32", "feat_req_someip_318"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, 0));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  const auto little = numbers(1400);
  const auto large = numbers(1401);
  EXPECT_EQ(call(client, service, {.method = echo}, little).payload, little);
  EXPECT_EQ(server.tcp_server_counters().accepted, 0U);
  EXPECT_EQ(call(client, service, {.method = echo}, large).payload, large);
  EXPECT_EQ(server.tcp_server_counters().streams.received.messages, 1U);
  EXPECT_EQ(call(client, service, {.method = echo, .transport = Transport::tcp}, little).payload, little);
  EXPECT_EQ(server.tcp_server_counters().streams.received.messages, 2U);
  EXPECT_EQ(call(client, service, {.method = echo, .transport = Transport::udp}, large).payload, large);
  EXPECT_EQ(server.tcp_server_counters().streams.received.messages, 2U);
  EXPECT_EQ(server.reassembly_counters().messages, 1U);
}

TEST_F(CallsTest, CarryMegabytesInSegmentsBothWays) {
  covers({"feat_req_someiptp_760"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  const auto payload = numbers(1 << 20);
  EXPECT_EQ(call(client, service, {.method = echo}, payload).payload, payload);
  EXPECT_EQ(client.reassembly_counters().messages, 1U);
}

TEST_F(CallsTest, HaveTheClientIdThatIsConfiguredAndNoOther) {
  covers({"feat_req_someiptp_786"});
  Node server{io, quick(test::server_address)};
  NodeConfig config = quick(test::client_address);
  config.client = someip::ClientId{0x4711};
  Node client{io, config};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  // Several segmented requests under way at once, which Session IDs tell apart.
  const auto payload = numbers(20'000);
  const ByteView slice{payload};
  for (int i = 0; i < 4; ++i) {
    client.call(service, {.method = echo}, {&slice, 1}, note());
  }
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 4; }));
  EXPECT_EQ(server.reassembly_counters().messages, 4U);
  EXPECT_THAT(requests, AllOf(SizeIs(4), Each(Field(&Header::client, someip::ClientId{0x4711}))));
  EXPECT_THAT(outcomes, Each(Field(&Outcome::payload, payload)));
}

TEST_F(CallsTest, FindTheirPayloadsAlignedInMemory) {
  covers({"feat_req_someip_169"});
  std::vector<std::uintptr_t> places;
  const auto where = [&](ByteView payload) {
    places.push_back(reinterpret_cast<std::uintptr_t>(payload.data()) % 8);
  };
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec service = spec(0, 0);
  service.methods = {{echo, [&](const Message& request, Responder responder) {
                        where(request.payload);
                        responder.respond(request.payload);
                      }}};
  server.offer(service);
  const RequirementId id = client.require(wanted);
  ASSERT_TRUE(found(client, id));
  const auto payload = numbers(100'000);
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    for (const std::size_t bytes : {std::size_t{16}, std::size_t{1000}, payload.size()}) {
      const ByteView slice = ByteView{payload}.first(bytes);
      const std::size_t before = places.size();
      client.call(id, {.method = echo, .transport = transport}, {&slice, 1}, [&](const CallResult& result) {
        ASSERT_TRUE(result);
        where(result->payload);
      });
      ASSERT_TRUE(run_until([&] { return places.size() == before + 2; }));
    }
  }
  EXPECT_THAT(places, Each(0U));
}

TEST_F(CallsTest, MayBeAnsweredLaterAndInAnyOrder) {
  covers({"feat_req_someip_79", "feat_req_someip_88"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  std::string order;
  for (const char name : {'a', 'b', 'c'}) {
    client.call(service, {.method = later}, {},
                [&order, name](const CallResult& result) { order += result ? name : '!'; });
  }
  ASSERT_TRUE(run_until([&] { return waiting.size() == 3; }));
  EXPECT_EQ(order, "");
  std::vector<Responder> shuffled;
  for (const std::size_t i : {2U, 0U, 1U}) {
    shuffled.push_back(std::move(waiting[i]));
  }
  EXPECT_FALSE(waiting[0].pending()) << "moved from";
  for (Responder& one : shuffled) {
    EXPECT_TRUE(one.pending());
    EXPECT_TRUE(one.respond());
    EXPECT_FALSE(one.pending());
  }
  ASSERT_TRUE(run_until([&] { return order.size() == 3; }));
  EXPECT_EQ(order, "cab");
}

TEST_F(CallsTest, BringTheErrorsOfTheServer) {
  covers({"feat_req_someip_107", "feat_req_someip_371", "feat_req_someip_106", "feat_req_someip_101"});
  for (const MessageType type : {MessageType::response, MessageType::error}) {
    NodeConfig config = quick(test::server_address);
    config.answers.error_type = type;
    Node server{io, config};
    Node client{io, quick(test::client_address)};
    server.offer(spec(0, 0));
    const RequirementId service = client.require(wanted);
    ASSERT_TRUE(found(client, service));
    const auto detail = numbers(4);
    for (const Transport transport : {Transport::udp, Transport::tcp}) {
      const Outcome own = call(client, service, {.method = refuse, .transport = transport}, detail);
      EXPECT_EQ(own.fault, CallFault::error);
      EXPECT_EQ(own.code, ReturnCode{0x21});
      EXPECT_EQ(own.payload, detail);
      const Outcome unknown = call(client, service, {.method = MethodId{0x99}, .transport = transport});
      EXPECT_EQ(unknown.fault, CallFault::error);
      EXPECT_EQ(unknown.code, ReturnCode::unknown_method);
      EXPECT_EQ(call(client, service, {.method = tell, .transport = transport}).code,
                ReturnCode::wrong_message_type);
      EXPECT_EQ(call(client, service, {.method = forget, .transport = transport}).code, ReturnCode::not_ok)
          << "the handler threw the responder away";
    }
  }
}

TEST_F(CallsTest, EndWhenTheirTimeIsOver) {
  covers({"feat_req_someip_436"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome = call(client, service, {.method = later, .timeout = 50ms});
  EXPECT_EQ(outcome.fault, CallFault::timed_out);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 50ms);
  ASSERT_THAT(waiting, SizeIs(1));
  EXPECT_TRUE(waiting[0].respond());
  EXPECT_TRUE(run_until([&] { return client.call_counters()[AnswerDrop::late] == 1; }));
  EXPECT_THAT(outcomes, SizeIs(1)) << "told twice";
}

TEST_F(CallsTest, CanBeCancelled) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  // Until the machine lets us cancel one before its time is over.
  Duration timeout = 50ms;
  CallId one{};
  for (bool cancelled = false; !cancelled; timeout *= 2) {
    ASSERT_LT(timeout, 60s);
    const std::size_t before = waiting.size();
    outcomes.clear();
    one = client.call(service, {.method = later, .timeout = timeout}, {}, note());
    ASSERT_TRUE(run_until([&] { return waiting.size() > before; }));
    cancelled = client.cancel(one);
  }
  EXPECT_FALSE(client.cancel(one));
  EXPECT_TRUE(waiting.back().respond());
  EXPECT_TRUE(run_until([&] { return client.call_counters()[AnswerDrop::after_cancel] == 1; }));
  run_for(std::chrono::ceil<std::chrono::milliseconds>(timeout));
  EXPECT_THAT(outcomes, IsEmpty());
}

TEST_F(CallsTest, FailAtOnceWhenNobodyOffersTheService) {
  Node client{io, quick(test::client_address)};
  const RequirementId service = client.require(wanted);
  EXPECT_EQ(call(client, service, {.method = echo}).fault, CallFault::unavailable);
  EXPECT_FALSE(client.send(service, {.method = tell}, {}));
  Node server{io, quick(test::server_address)};
  server.offer(spec(0, {}));
  ASSERT_TRUE(found(client, service));
  EXPECT_EQ(call(client, service, {.method = echo, .transport = Transport::tcp}).fault,
            CallFault::unavailable)
      << "not over TCP";
  EXPECT_EQ(call(client, service, {.method = echo, .instance = InstanceId{2}}).fault, CallFault::unavailable);
  EXPECT_EQ(call(client, service, {.method = echo, .instance = InstanceId{1}}).fault, std::nullopt);
  client.release(service);
  EXPECT_EQ(call(client, service, {.method = echo}).fault, CallFault::unavailable);
}

TEST_F(CallsTest, FailWhenTooManyAreOutstanding) {
  NodeConfig config = quick(test::client_address);
  config.max_calls = 2;
  Node server{io, quick(test::server_address)};
  Node client{io, config};
  server.offer(spec(0, {}));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  client.call(service, {.method = later}, {}, note());
  client.call(service, {.method = later}, {}, note());
  EXPECT_EQ(call(client, service, {.method = echo}).fault, CallFault::too_many_calls);
}

TEST_F(CallsTest, EndAsTimedOutWhenTheConnectionIsLost) {
  covers({"feat_req_someip_326", "feat_req_someip_647"});
  auto server = std::make_unique<Node>(io, quick(test::server_address));
  Node client{io, quick(test::client_address), into(client_log)};
  server->offer(spec({}, 40200));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  client.call(service, {.method = later, .timeout = 10s}, {}, note());
  ASSERT_TRUE(run_until([&] { return waiting.size() == 1; }));
  server.reset();  // without a word to SD
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
  EXPECT_EQ(outcomes[0].fault, CallFault::timed_out);
  EXPECT_FALSE(waiting[0].respond()) << "after the end of its node";
  EXPECT_EQ(call(client, service, {.method = echo}).fault, CallFault::not_connected);
  // The next connection is made by itself.
  server = std::make_unique<Node>(io, quick(test::server_address));
  server->offer(spec({}, 40200));
  // Once: by its offer the server is known to have restarted, and that connection ends too.
  bool answered = false;
  EXPECT_TRUE(run_until([&] {
    answered = answered || call(client, service, {.method = echo}).fault == std::nullopt;
    return answered;
  }));
}

TEST_F(CallsTest, CloseTheConnectionWhenTheServiceIsGone) {
  covers({"feat_req_someip_679", "feat_req_someip_680", "feat_req_someip_678"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  OfferHandle offer = server.offer(spec({}, 40201));
  const RequirementId service = client.require(wanted);
  ASSERT_TRUE(found(client, service));
  EXPECT_EQ(call(client, service, {.method = echo}).fault, std::nullopt);
  // Watch from outside: who closes first? A connection of our own stays open for as long as the server likes.
  boost::asio::ip::tcp::socket watcher{io};
  watcher.connect({boost::asio::ip::make_address(someip::to_string(test::server_address)), 40201});
  server.withdraw(offer);
  ASSERT_TRUE(run_until([&] { return client.available(service).empty(); }));
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
  run_for(100ms);
  watcher.non_blocking(true);
  std::array<char, 1> byte{};
  boost::system::error_code error;
  watcher.read_some(boost::asio::buffer(byte), error);
  EXPECT_EQ(error, boost::asio::error::would_block) << "the server closes no connection that soon";
  // Offered again at the same port, it is found and connected again.
  offer = server.offer(spec({}, 40201));
  ASSERT_TRUE(found(client, service));
  EXPECT_EQ(call(client, service, {.method = echo}).fault, std::nullopt);
  EXPECT_EQ(client.tcp_client_counters().connections, 2U);
  client.release(service);
  EXPECT_TRUE(run_until([&] { return server.tcp_server_counters().open == 1; })) << "the watcher's is left";
}

TEST_F(CallsTest, MayBeMadeFromHandlers) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec(0, {}));
  int answers = 0;
  RequirementId service{};
  const std::function<void(const CallResult&)> again = [&](const CallResult& result) {
    ASSERT_TRUE(result);
    if (++answers < 100) {
      client.call(service, {.method = echo}, {}, again);
    }
  };
  service = client.require(wanted, [&](const RemoteService&, bool available) {
    if (available) {
      client.call(service, {.method = echo}, {}, again);
    }
  });
  EXPECT_TRUE(run_until([&] { return answers == 100; }));
}

TEST_F(CallsTest, TellOfServersThatComeAndGo) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<std::string> told;
  const RequirementId service = client.require(
      {.service = ServiceId{0x1234}, .major = 2}, [&](const RemoteService& one, bool available) {
        told.push_back((available ? "+" : "-") + std::to_string(value(one.instance)));
      });
  const OfferHandle offer = server.offer(spec(0, {}));
  ASSERT_TRUE(run_until([&] { return told.size() == 1; }));
  ServiceSpec second = spec(0, {});
  second.instance = InstanceId{2};
  server.offer(second);
  ASSERT_TRUE(run_until([&] { return told.size() == 2; }));
  EXPECT_THAT(client.available(service), SizeIs(2));
  server.withdraw(offer);
  ASSERT_TRUE(run_until([&] { return told.size() == 3; }));
  EXPECT_THAT(told, ElementsAre("+1", "+2", "-1"));
  EXPECT_EQ(call(client, service, {.method = echo}).fault, std::nullopt) << "by the other";
}

TEST_F(CallsTest, KeepInstancesOfOneServiceOnPortsOfTheirOwn) {
  covers({"feat_req_someip_967", "feat_req_someip_445", "feat_req_someip_648", "feat_req_someip_636",
          "feat_req_someip_1079"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec second = spec(0, {});
  second.instance = InstanceId{2};
  ServiceSpec third = spec(0, {});
  third.service = ServiceId{0x4321};
  server.offer(spec(0, {}));
  server.offer(second);
  server.offer(third);
  const RequirementId both = client.require({.service = ServiceId{0x1234}, .major = 2});
  const RequirementId other = client.require({.service = ServiceId{0x4321}, .major = 2});
  ASSERT_TRUE(run_until([&] { return client.available(both).size() == 2 && found(client, other); }));
  const auto servers = client.available(both);
  EXPECT_NE(servers[0].udp, servers[1].udp);
  const auto shared = client.available(other)[0].udp;
  EXPECT_TRUE(shared == servers[0].udp || shared == servers[1].udp) << "services share ports";
  second.instance = InstanceId{3};
  second.udp_port = 40202;
  server.offer(second);
  second.instance = InstanceId{4};
  EXPECT_THROW(server.offer(second), std::exception);
}

TEST_F(CallsTest, SayWhatIsWrongWithADescription) {
  Node server{io, quick(test::server_address)};
  const auto refusal = [&](auto change) -> std::string {
    ServiceSpec wrong = spec(0, {});
    change(wrong);
    try {
      server.offer(wrong);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal([](ServiceSpec& s) { s.methods.push_back(s.methods[0]); }),
              HasSubstr("0x1234.0x0001: id 0x0001 is used twice"));
  EXPECT_THAT(refusal([](ServiceSpec& s) { s.methods[0].handler = nullptr; }),
              HasSubstr("0x0001 has no handler"));
  EXPECT_THAT(refusal([](ServiceSpec& s) { s.fields.emplace_back(); }), HasSubstr("neither getter nor"));
  EXPECT_THAT(refusal([](ServiceSpec& s) {
                s.fields = {{.getter = MethodId{0x99}, .without_value = ReturnCode::ok}};
              }),
              HasSubstr("without_value must not answer ok"));
  EXPECT_THAT(refusal([](ServiceSpec& s) { s.tcp_events = {MethodId{0x8001}}; }), HasSubstr("no TCP port"));
  EXPECT_THAT(refusal([](ServiceSpec& s) { s.udp_port.reset(); }),
              HasSubstr("neither udp_port nor tcp_port"));
  EXPECT_EQ(refusal([](ServiceSpec&) {}), "");
}

// The bytes on the wire, against a peer of bare sockets that knows nothing of our codec.
TEST_F(CallsTest, SpeakSomeIpOverTcp) {
  covers({"feat_req_someip_655", "feat_req_someip_702"});
  Node server{io, quick(test::server_address)};
  server.offer(spec({}, 40203));
  boost::asio::ip::tcp::socket peer{io};
  peer.connect({boost::asio::ip::make_address(someip::to_string(test::server_address)), 40203});
  const auto requests_bytes = test::hex(
      "1234 0001 0000000a 00aa 0001 01 02 00 00 cafe"
      "1234 0001 00000008 00aa 0002 01 03 00 00"  // wrong interface version
      "4321 0001 00000008 00aa 0003 01 02 00 00"  // unknown service
      "1234 0077 00000008 00aa 0004 01 02 01 00"  // unknown method, fire and forget
      "1234 0001 00000009 00aa 0005 01 02 00 00 55");
  boost::asio::write(peer, boost::asio::buffer(requests_bytes));
  std::vector<std::byte> answers(18 + 16 + 16 + 17);
  bool read = false;
  boost::asio::async_read(peer, boost::asio::buffer(answers),
                          [&](auto error, std::size_t) { read = !error; });
  ASSERT_TRUE(run_until([&] { return read; }));
  EXPECT_EQ(test::to_hex(answers),
            "123400010000000a00aa000101028000cafe"
            "123400010000000800aa000201038008"
            "432100010000000800aa000301028002"
            "123400010000000900aa00050102800055");
}

}  // namespace
}  // namespace trestle::sd::calls_test
