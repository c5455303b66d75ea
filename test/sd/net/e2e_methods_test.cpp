// End-to-end protection of methods: requests, responses and errors, also of a field's getter and setter. The
// messages were computed by a program of its own, as those of e2e_test.cpp; the bare peers send them as they
// stand here.
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

#include "sd/net/proxy.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::e2e_methods_test {
namespace {

namespace e2e = someip::e2e;
using boost::asio::ip::tcp;
using someip::Message;
using someip::MethodId;
using someip::ReturnCode;
using test::covers;
using test::hex;
using test::numbers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr MethodId reverse{0x0001};
constexpr MethodId tell{0x0002};
constexpr MethodId getter{0x0003};
constexpr MethodId setter{0x0004};
const e2e::Profile4m profile{{.data_id = 0x0a0b0c0d}};

class E2eMethods : public test::TwoNodes {
 protected:
  ServiceSpec spec(std::vector<E2eSpec> protection) {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .tcp_port = 0,
            .methods = {{reverse,
                         [this](const Message& request, Responder responder) {
                           note_request(request);
                           std::vector<std::byte> payload{request.payload.rbegin(), request.payload.rend()};
                           responder.respond(payload);
                         }},
                        {tell, [this](const Message& request, const Responder&) { note_request(request); },
                         someip::MethodKind::fire_and_forget}},
            .e2e = std::move(protection)};
  }
  void note_request(const Message& request) {
    requests.push_back(test::to_hex(request.payload) +
                       (request.check == nullptr ? "" : std::string{" "} + to_string(request.check->status)));
  }
  RequirementId found(Node& client, std::vector<E2eSpec> protection) {
    const RequirementId service =
        client.require({.service = ServiceId{0x1234}, .e2e = std::move(protection)});
    EXPECT_TRUE(run_until([&] { return !client.available(service).empty(); }));
    return service;
  }
  void call(Node& client, RequirementId service, const CallSpec& what, const std::string& payload) {
    const auto bytes = hex(payload);
    const ByteView slice{bytes};
    results.clear();
    client.call(service, what, {&slice, 1}, [this](const CallResult& result) {
      const e2e::CheckResult* const check = result ? result->check : result.error().check;
      const ByteView got = result ? result->payload : result.error().payload;
      results.push_back((result ? "ok"
                                : std::string{to_string(result.error().fault)} + " " +
                                      std::to_string(static_cast<int>(result.error().code))) +
                        " " + test::to_hex(got) +
                        (check == nullptr ? "" : std::string{" "} + to_string(check->status)));
    });
    EXPECT_TRUE(run_until([&] { return !results.empty(); }));
  }

  std::vector<std::string> requests;
  std::vector<std::string> results;
};

// --- Servers ----------------------------------------------------------------------------------------------

/// Sends a message as it stands there, and waits for the answer.
class BareClient {
 public:
  BareClient(boost::asio::io_context& io, const Endpoint& server, Transport transport) : io_{io} {
    if (transport == Transport::tcp) {
      stream_.emplace(io);
      stream_->connect({boost::asio::ip::make_address(someip::to_string(server.address)), server.port});
    } else {
      socket_.emplace(io, someip::UdpOptions{.local = {test::client_address, 0}});
      socket_->receive([this](ByteView bytes, const Endpoint&) { answer_ = test::to_hex(bytes); });
      server_ = server;
    }
  }
  std::string ask(const std::string& message) {
    const auto bytes = hex(message);
    const ByteView slice{bytes};
    answer_.clear();
    if (stream_) {
      boost::asio::write(*stream_, boost::asio::buffer(bytes));
      stream_->async_read_some(boost::asio::buffer(room_), [this](const auto& error, std::size_t read) {
        answer_ = error ? error.message() : test::to_hex(ByteView{room_}.first(read));
      });
    } else {
      EXPECT_EQ(socket_->send(server_, {&slice, 1}), someip::SendStatus::sent);
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{60};
    while (answer_.empty() && std::chrono::steady_clock::now() < end) {
      io_.run_one_for(std::chrono::milliseconds{20});
    }
    return answer_;
  }

 private:
  boost::asio::io_context& io_;
  std::optional<tcp::socket> stream_;
  std::optional<someip::UdpSocket> socket_;
  Endpoint server_;
  std::array<std::byte, 2000> room_{};
  std::string answer_;
};

class E2eServer : public E2eMethods, public testing::WithParamInterface<Transport> {
 protected:
  BareClient connect(const Node& client, RequirementId service) {
    const RemoteService server = client.available(service).at(0);
    return {io, GetParam() == Transport::udp ? *server.udp : *server.tcp, GetParam()};
  }
};
INSTANTIATE_TEST_SUITE_P(Transports, E2eServer, testing::Values(Transport::udp, Transport::tcp),
                         [](const auto& one) { return one.param == Transport::udp ? "Udp" : "Tcp"; });

// Request ID, versions, type and return code, 16 bytes of E2E header, payload. Client 7.
constexpr const char* first = "12340001 0000001b 00070001 01010000 001b00000a0b0c0da8c1817900123456 cafe01";
constexpr const char* again = "12340001 0000001b 00070002 01010000 001b00000a0b0c0def2a9cf700123456 cafe01";
constexpr const char* second = "12340001 0000001b 00070003 01010000 001b00010a0b0c0d0365149200123456 cafe01";
constexpr const char* sixth = "12340001 0000001b 00070004 01010000 001b00050a0b0c0dd6ccfc3600123456 cafe01";
constexpr const char* seventh = "12340001 0000001b 00070005 01010000 001b00060a0b0c0d0910183200123456 cafe01";

TEST_P(E2eServer, AnswersAGoodRequestAndRefusesABadOne) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({{.id = reverse, .protect = profile, .check = profile}}));
  BareClient peer = connect(client, found(client, {}));

  EXPECT_EQ(peer.ask(first), "123400010000001b0007000101018000001b00000a0b0c0dbd9ba8194012345601feca");
  EXPECT_EQ(peer.ask(again), "1234000100000018000700020101800b001800000a0b0c0d0dd9da7450123456")
      << "E_E2E_REPEATED";
  EXPECT_EQ(peer.ask(second), "123400010000001b0007000301018000001b00010a0b0c0d163f3df24012345601feca");
  EXPECT_EQ(peer.ask(sixth), "1234000100000018000700040101800c001800050a0b0c0d7a82f71850123456")
      << "E_E2E_WRONG_SEQUENCE";
  std::string spoilt{seventh};
  spoilt.back() = '2';
  EXPECT_EQ(peer.ask(spoilt), "1234000100000008000700050101800d") << "E_E2E, without protection";
  EXPECT_EQ(peer.ask("12340001 00000008 00070006 01010000"), "1234000100000008000700060101800d");
  EXPECT_EQ(peer.ask(seventh), "123400010000001b0007000501018000001b00060a0b0c0d1c4a31524012345601feca");
  EXPECT_THAT(requests, ElementsAre("cafe01 ok", "cafe01 ok", "cafe01 ok"));
  EXPECT_EQ(server.counters().e2e_failed, 4U);
  EXPECT_EQ(server.counters().requests, 3U);
}

TEST_P(E2eServer, HandsOverEverythingIfToldSo) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({{.id = reverse, .protect = profile, .check = profile, .pass_failed = true}}));
  BareClient peer = connect(client, found(client, {}));
  peer.ask(first);
  EXPECT_EQ(peer.ask(again), "123400010000001b0007000201018000001b00000a0b0c0dfa70b5974012345601feca");
  peer.ask(sixth);
  peer.ask("12340001 00000008 00070006 01010000");
  EXPECT_THAT(requests, ElementsAre("cafe01 ok", "cafe01 repeated", "cafe01 wrong_sequence", " error"));
  EXPECT_EQ(server.counters().e2e_failed, 0U);
}

// Client 7, 8 and 9, who begin with counter 0.
TEST_P(E2eServer, KnowsSoManyClients) {
  const std::string eighth = "12340001 0000001b 00080001 01010000 001b00000a0b0c0d11f0d61800123456 cafe01";
  const std::string ninth = "12340001 0000001b 00090001 01010000 001b00000a0b0c0d2524877a00123456 cafe01";
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({{.id = reverse, .protect = profile, .check = profile, .max_peers = 2}}));
  BareClient peer = connect(client, found(client, {}));
  const auto code = [](const std::string& answer) { return answer.substr(30, 2); };
  EXPECT_EQ(code(peer.ask(first)), "00");
  EXPECT_EQ(code(peer.ask(eighth)), "00") << "a counter of its own, at the same endpoint";
  EXPECT_EQ(code(peer.ask(first)), "0b");
  std::string spoilt = ninth;
  spoilt.back() = '2';
  EXPECT_EQ(code(peer.ask(spoilt)), "0d");
  EXPECT_EQ(code(peer.ask(eighth)), "0b") << "who sends nonsense takes nobody's place";
  EXPECT_EQ(code(peer.ask(ninth)), "00") << "takes the place of the first";
  EXPECT_EQ(code(peer.ask(eighth)), "0b");
  EXPECT_EQ(code(peer.ask(first)), "00") << "forgotten";
}

// --- Clients ----------------------------------------------------------------------------------------------

// The requests as a server without protection sees them, whose answers are made here.
TEST_F(E2eMethods, ProtectsRequestsAndChecksAnswers) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<std::pair<ReturnCode, std::string>> answers;
  ServiceSpec bare = spec({});
  bare.methods[0].handler = [&](const Message& request, Responder responder) {
    note_request(request);
    const auto [code, payload] = answers.at(requests.size() - 1);
    if (code == ReturnCode::ok) {
      responder.respond(hex(payload));
    } else {
      responder.error(code, hex(payload));
    }
  };
  server.offer(bare);
  const E2eSpec protection{.id = reverse, .protect = profile, .check = profile, .source_id = 0x123456};
  const RequirementId service = found(client, {protection});
  answers = {{ReturnCode::ok, "001a00000a0b0c0de8c252a440123456beef"},
             {ReturnCode{0x21}, "001900010a0b0c0dbd78e9525012345677"},
             {ReturnCode::ok, "001a00020a0b0c0dccf0170840123456bee0"},
             {ReturnCode::not_ready, ""},
             {ReturnCode::ok, ""}};
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("ok beef ok"));
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("error 33 77 ok")) << "protected";
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("error 13  error")) << "E_E2E: a bit of the payload";
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("error 4 ")) << "not protected";
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("error 13  error")) << "whereas a response must be";
  EXPECT_EQ(client.counters().e2e_failed, 2U);
  requests.resize(4);
  EXPECT_THAT(
      requests,
      ElementsAre("001b00000a0b0c0d1238663500123456cafe01", "001b00010a0b0c0d84c5f8a400123456cafe01",
                  "001b00020a0b0c0d5b191ca000123456cafe01", "001b00030a0b0c0d3880afd900123456cafe01"));
}

// --- Both -------------------------------------------------------------------------------------------------

TEST_F(E2eMethods, WorkOverAllTransportsInAnySize) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile7m large{{.data_id = 0x0a0b0c0d}};
  server.offer(spec({{.id = reverse, .protect = large, .check = large}}));
  Proxy proxy{client,
              {.service = ServiceId{0x1234},
               .e2e = {{.id = reverse, .protect = large, .check = large, .source_id = 1}}}};
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    for (const std::size_t size : {0U, 1376U, 1377U, 200'000U}) {
      auto payload = numbers(size);
      std::optional<Response> answer;
      proxy.call({.method = reverse, .transport = transport}, payload,
                 [&](boost::system::error_code error, Response response) {
                   EXPECT_FALSE(error) << error.message();
                   answer = std::move(response);
                 });
      ASSERT_TRUE(run_until([&] { return answer.has_value(); }));
      std::ranges::reverse(payload);
      EXPECT_EQ(answer->payload, payload);
      ASSERT_TRUE(answer->check);
      EXPECT_EQ(answer->check->status, e2e::CheckStatus::ok);
    }
  }
}

// Calls that wait for the connection are tried again: the server must not miss their counters.
TEST_F(E2eMethods, ProtectAgainWhatCouldNotBeSent) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({{.id = reverse, .protect = profile, .check = profile}}));
  Proxy proxy{client,
              {.service = ServiceId{0x1234}, .e2e = {{.id = reverse, .protect = profile, .check = profile}}}};
  // A second one is the same client to the server.
  Proxy other{client,
              {.service = ServiceId{0x1234}, .e2e = {{.id = reverse, .protect = profile, .check = profile}}}};
  std::vector<std::string> statuses;
  const auto call = [&](Proxy& by) {
    by.call(
        {.method = reverse, .transport = Transport::tcp}, hex("cafe01"),
        [&](boost::system::error_code error, const Response& response) {
          statuses.push_back(error.message() +
                             (response.check ? std::string{", "} + to_string(response.check->status) : ""));
        });
  };
  call(proxy);
  ASSERT_TRUE(run_until([&] { return statuses.size() == 1; }));
  call(other);
  ASSERT_TRUE(run_until([&] { return statuses.size() == 2; }));
  call(proxy);
  ASSERT_TRUE(run_until([&] { return statuses.size() == 3; }));
  EXPECT_THAT(statuses, testing::Each("Success, ok"));
  EXPECT_THAT(requests, testing::Each("cafe01 ok"));
}

TEST_F(E2eMethods, ProtectFireAndForget) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  server.offer(spec({{.id = tell, .check = profile}}));
  const RequirementId good = found(client, {{.id = tell, .protect = profile}});
  const auto bytes = hex("cafe01");
  const ByteView slice{bytes};
  EXPECT_TRUE(client.send(good, {.method = tell}, {&slice, 1}));
  EXPECT_TRUE(client.send(good, {.method = tell}, {&slice, 1}));
  ASSERT_TRUE(run_until([&] { return requests.size() == 2; }));
  client.release(good);
  const RequirementId bare = found(client, {});
  EXPECT_TRUE(client.send(bare, {.method = tell}, {&slice, 1}));
  ASSERT_TRUE(run_until([&] { return server.counters().e2e_failed == 1; }));
  EXPECT_THAT(requests, ElementsAre("cafe01 ok", "cafe01 ok"));
}

TEST_F(E2eMethods, AreSentOnlyInTheLengthOfTheProfile) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile5 three{.data_id = 0x1234, .data_bits = 112};
  const e2e::Profile5 two{.data_id = 0x1234, .data_bits = 104};
  server.offer(spec({{.id = reverse, .protect = two, .check = three}}));
  const RequirementId service = found(client, {{.id = reverse, .protect = three, .check = two}});
  call(client, service, {.method = reverse}, "cafe");
  EXPECT_THAT(results, ElementsAre(HasSubstr("not_sent")));
  EXPECT_EQ(client.counters().e2e_not_protected, 1U);
  call(client, service, {.method = reverse}, "cafe01");
  EXPECT_THAT(results, ElementsAre("error 1 ")) << "three bytes come back, which cannot be: E_NOT_OK";
  EXPECT_EQ(server.counters().e2e_not_protected, 1U);
  EXPECT_THAT(requests, ElementsAre("cafe01 ok"));
}

TEST_F(E2eMethods, MayBeProtectedOtherwiseInEachInstance) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<RequirementId> instances;
  for (const std::uint16_t number : {std::uint16_t{1}, std::uint16_t{2}}) {
    const e2e::Profile4m its{{.data_id = number}};
    ServiceSpec offered = spec({{.id = reverse, .protect = its, .check = its}});
    offered.instance = InstanceId{number};
    server.offer(offered);
    instances.push_back(client.require({.service = ServiceId{0x1234},
                                        .instance = InstanceId{number},
                                        .e2e = {{.id = reverse, .protect = its, .check = its}}}));
    ASSERT_TRUE(run_until([&] { return !client.available(instances.back()).empty(); }));
  }
  for (const RequirementId instance : {instances[0], instances[1], instances[0]}) {
    call(client, instance, {.method = reverse}, "cafe01");
    EXPECT_THAT(results, ElementsAre("ok 01feca ok"));
  }
}

TEST_F(E2eMethods, ReadAndSetAField) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec with_field = spec({{.id = getter, .protect = profile, .check = profile},
                                 {.id = setter, .protect = profile, .check = profile}});
  with_field.fields = {{.getter = getter, .setter = setter, .value = hex("01")}};
  const OfferHandle offer = server.offer(with_field);
  const RequirementId service = found(client, {{.id = getter, .protect = profile, .check = profile},
                                               {.id = setter, .protect = profile, .check = profile}});
  call(client, service, {.method = getter}, "");
  EXPECT_THAT(results, ElementsAre("ok 01 ok"));
  call(client, service, {.method = setter}, "02");
  EXPECT_THAT(results, ElementsAre("ok 02 ok"));
  EXPECT_EQ(test::to_hex(*server.field(offer, getter)), "02");
  const RequirementId bare = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(bare).empty(); }));
  call(client, bare, {.method = setter}, "03");
  EXPECT_THAT(results, ElementsAre("error 13 "));
  EXPECT_EQ(test::to_hex(*server.field(offer, getter)), "02");
}

}  // namespace
}  // namespace trestle::sd::e2e_methods_test
