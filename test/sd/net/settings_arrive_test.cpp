// What a NodeConfig says arrives where it works: at the sockets, as the system tells, and in what a Node
// does.
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <list>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::settings_arrive_test {
namespace {

using boost::asio::ip::tcp;
using someip::Message;
using someip::MessageType;
using someip::MethodId;
using someip::ReturnCode;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr MethodId echo{0x0001};
constexpr MethodId getter{0x0002};
constexpr MethodId later{0x0003};
constexpr MethodId event{0x8001};
constexpr EventgroupId group{1};

class SettingsTest : public test::TwoNodes {
 protected:
  static constexpr std::uint16_t udp_port = 40240;
  static constexpr std::uint16_t tcp_port = 40241;
  static constexpr Endpoint udp_at(const IpAddress& address) { return {address, udp_port}; }

  ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .udp_port = udp_port,
            .tcp_port = tcp_port,
            .methods = {{echo, [](const Message& request,
                                  Responder responder) { responder.respond(request.payload); }},
                        {later, [this](const Message&,
                                       Responder responder) { waiting.push_back(std::move(responder)); }}},
            .fields = {{.getter = getter, .value = test::hex("07")}},
            .eventgroups = {{.id = group, .events = {event}}}};
  }
  /// A connection to the service, as a client would make it.
  tcp::socket& connect(const IpAddress& from = test::other_address, std::uint16_t port = tcp_port) {
    tcp::socket& socket = sockets.emplace_back(io);
    socket.open(tcp::v4());
    socket.bind({boost::asio::ip::make_address(someip::to_string(from)), 0});
    socket.connect({boost::asio::ip::make_address(someip::to_string(test::server_address)), port});
    return socket;
  }
  /// Asks for what is not answered. Who waits for an answer is not silent, however slow the machine is, and
  /// need not go for others.
  void ask_and_wait(tcp::socket& socket) {
    const std::size_t before = waiting.size();
    boost::asio::write(socket, boost::asio::buffer(test::hex("1234 0003 00000008 0001 0001 01 01 00 00")));
    ASSERT_TRUE(run_until([&] { return waiting.size() > before; }));
  }
  /// Whether the other end closes this connection.
  bool is_closed(tcp::socket& socket, std::chrono::milliseconds limit = 60s) {
    bool closed = false;
    std::array<char, 64> room{};
    socket.async_read_some(boost::asio::buffer(room),
                           [&](const boost::system::error_code& error, std::size_t) {
                             closed = closed || (error && error != boost::asio::error::operation_aborted);
                           });
    const bool result = run_until([&] { return closed; }, limit);
    socket.cancel();
    run_for(1ms);
    return result;
  }
  /// A request of a bare UDP socket, and all datagrams that come back.
  std::vector<std::string> ask(const std::string& request, std::size_t answers = 1,
                               std::chrono::milliseconds limit = 60s) {
    someip::UdpSocket socket{io, {.local = {test::other_address, 0}}};
    std::vector<std::string> received;
    socket.receive([&](ByteView datagram, const Endpoint&) { received.push_back(test::to_hex(datagram)); });
    const auto bytes = test::hex(request);
    const ByteView view{bytes};
    EXPECT_EQ(socket.send(udp_at(test::server_address), {&view, 1}), someip::SendStatus::sent);
    static_cast<void>(run_until([&] { return received.size() >= answers; }, limit));
    return received;
  }

  std::list<tcp::socket> sockets;
  std::vector<Responder> waiting;
};

// --- Sockets ----------------------------------------------------------------------------------------------

/// The sockets of this process that are bound there, by what they are: listening, connected or neither.
std::vector<int> descriptors_of(const Endpoint& local, int type) {
  std::vector<int> found;
  for (int fd = 3; fd < 256; ++fd) {
    someip::SocketAddress own;
    int kind = 0;
    socklen_t size = sizeof kind;
    if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &kind, &size) == 0 && kind == type &&
        getsockname(fd, own.data(), &own.size()) == 0 && own.endpoint() == local) {
      found.push_back(fd);
    }
  }
  return found;
}

int option(int fd, int level, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  EXPECT_EQ(getsockopt(fd, level, name, &value, &size), 0);
  return value;
}

TEST_F(SettingsTest, ReachTheUdpSockets) {
  NodeConfig config = quick(test::server_address);
  config.dscp = 46;
  config.multicast_ttl = 7;
  config.unicast_ttl = 33;
  config.receive_buffer_bytes = 40'000;
  config.send_buffer_bytes = 30'000;
  Node node{io, config};
  node.offer(spec());
  for (const Endpoint& at : {udp_at(config.address), Endpoint{config.address, config.port}}) {
    const auto found = descriptors_of(at, SOCK_DGRAM);
    ASSERT_THAT(found, SizeIs(1)) << someip::to_string(at);
    EXPECT_EQ(option(found[0], IPPROTO_IP, IP_TOS), 46 << 2);
    EXPECT_EQ(option(found[0], IPPROTO_IP, IP_MULTICAST_TTL), 7);
    EXPECT_EQ(option(found[0], IPPROTO_IP, IP_TTL), 33);
    EXPECT_EQ(option(found[0], SOL_SOCKET, SO_RCVBUF), 80'000) << "the system doubles it";
    EXPECT_EQ(option(found[0], SOL_SOCKET, SO_SNDBUF), 60'000);
  }
}

TEST_F(SettingsTest, ReachBothEndsOfTcpConnections) {
  const auto configured = [](const IpAddress& address) {
    NodeConfig config = quick(address);
    config.dscp = 46;
    config.unicast_ttl = 33;
    config.tcp_dead_after = 24s;
    config.tcp_receive_buffer_bytes = 50'000;
    config.tcp_send_buffer_bytes = 60'000;
    return config;
  };
  Node server{io, configured(test::server_address)};
  Node client{io, configured(test::client_address)};
  server.offer(spec());
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(service).empty(); }));
  client.call(service, {.method = echo, .transport = Transport::tcp}, {}, note());
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
  std::vector<int> ends;
  for (int fd = 3; fd < 256; ++fd) {
    someip::SocketAddress own;
    someip::SocketAddress peer;
    if (getsockname(fd, own.data(), &own.size()) == 0 && getpeername(fd, peer.data(), &peer.size()) == 0 &&
        (own.endpoint().port == tcp_port || peer.endpoint().port == tcp_port)) {
      ends.push_back(fd);
    }
  }
  ASSERT_THAT(ends, SizeIs(2));
  for (const int fd : ends) {
    EXPECT_EQ(option(fd, IPPROTO_IP, IP_TOS), 46 << 2);
    EXPECT_EQ(option(fd, IPPROTO_IP, IP_TTL), 33);
    EXPECT_EQ(option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT), 24'000);
    EXPECT_EQ(option(fd, SOL_SOCKET, SO_RCVBUF), 100'000);
    EXPECT_EQ(option(fd, SOL_SOCKET, SO_SNDBUF), 120'000);
  }
}

// --- TCP clients ------------------------------------------------------------------------------------------

TEST_F(SettingsTest, LimitTheTcpClients) {
  NodeConfig config = quick(test::server_address);
  config.max_tcp_clients = 2;
  Node node{io, config};
  node.offer(spec());
  tcp::socket& first = connect();
  tcp::socket& second = connect(test::client_address);
  ask_and_wait(first);
  ask_and_wait(second);
  ASSERT_EQ(node.tcp_server_counters().open, 2U);
  EXPECT_TRUE(is_closed(connect(test::own_address(4))));
  EXPECT_EQ(node.tcp_server_counters().refused, 1U);
  EXPECT_FALSE(is_closed(first, 10ms));
  EXPECT_FALSE(is_closed(second, 10ms));
}

TEST_F(SettingsTest, LimitTheTcpClientsOfAllPortsTogether) {
  NodeConfig config = quick(test::server_address);
  config.limits.max_tcp_connections = 2;
  Node node{io, config};
  node.offer(spec());
  tcp::socket& greedy = connect();
  tcp::socket& second = connect();
  ask_and_wait(greedy);
  ask_and_wait(second);
  ASSERT_EQ(node.tcp_server_counters().open, 2U);
  tcp::socket& other = connect(test::client_address);
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().gave_way == 1; }));
  ask_and_wait(other);
  EXPECT_EQ(node.tcp_server_counters().open, 2U);
  EXPECT_NE(is_closed(greedy, 10ms), is_closed(second, 10ms)) << "one of the address that has the most";
  EXPECT_TRUE(is_closed(connect(test::own_address(4)))) << "nobody has more than this one";
  EXPECT_FALSE(is_closed(other, 10ms));
  EXPECT_EQ(node.tcp_server_counters().gave_way, 1U);
  EXPECT_GE(node.discovery_counters().limits_reached[static_cast<std::size_t>(Limit::tcp_connections)], 1U);
}

TEST_F(SettingsTest, GiveAPlaceAtOnePortToWhoComesToAnother) {
  NodeConfig config = quick(test::server_address);
  config.limits.max_tcp_connections = 2;
  Node node{io, config};
  node.offer(spec());
  ServiceSpec other = spec();
  other.service = ServiceId{0x1235};
  other.udp_port = udp_port + 2;
  other.tcp_port = tcp_port + 2;
  node.offer(other);
  tcp::socket& first = connect(test::own_address(4));
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 1; }));
  connect(test::own_address(5), tcp_port + 2);
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 2; }));
  // Until one has been silent for a second, nobody has to go.
  ASSERT_TRUE(run_until([&] {
    connect(test::client_address, tcp_port + 2);
    io.run_for(50ms);
    return node.tcp_server_counters().gave_way >= 1;
  }));
  EXPECT_TRUE(is_closed(first)) << "it never spoke, and was silent for longest";
}

TEST_F(SettingsTest, LimitTheTcpClientsOfOneAddress) {
  NodeConfig config = quick(test::server_address);
  config.max_tcp_clients_per_address = 2;
  Node node{io, config};
  node.offer(spec());
  tcp::socket& first = connect();
  connect();
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 2; }));
  EXPECT_TRUE(is_closed(connect())) << "the third of this address";
  EXPECT_EQ(node.tcp_server_counters().refused, 1U);
  connect(test::client_address);
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 3; })) << "others have their places";
  first.close();
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 2; }));
  connect();
  EXPECT_TRUE(run_until([&] { return node.tcp_server_counters().open == 3; })) << "there is room again";
}

TEST_F(SettingsTest, EndIdleConnections) {
  NodeConfig config = quick(test::server_address);
  config.tcp_idle_timeout = 200ms;
  Node node{io, config};
  ServiceSpec reliable = spec();
  reliable.tcp_events = {event};
  const OfferHandle offer = node.offer(std::move(reliable));
  Node client{io, quick(test::client_address)};
  client.subscribe(
      {.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}, .udp = false, .tcp = true},
      collect());
  ASSERT_TRUE(run_until([&] { return node.subscribers(offer, event) == 1; }));
  const std::uint64_t before = node.tcp_server_counters().idle;  // none, unless the machine has stalled
  EXPECT_TRUE(is_closed(connect()));
  run_for(600ms);
  EXPECT_EQ(node.tcp_server_counters().idle, before + 1);
  EXPECT_EQ(node.tcp_server_counters().open, 1U) << "that of the subscription";
}

TEST_F(SettingsTest, KeepConnectionsWhileAMethodHasNotAnswered) {
  NodeConfig config = quick(test::server_address);
  config.tcp_idle_timeout = 40ms;
  ServiceSpec slow = spec();
  slow.udp_port.reset();
  slow.methods = {
      {echo, [&](const Message&, Responder responder) { waiting.push_back(std::move(responder)); }}};
  slow.eventgroups = {};
  Node node{io, config};
  node.offer(std::move(slow));
  Node client{io, quick(test::client_address)};
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(service).empty(); }));
  const auto ask = [&] { client.call(service, {.method = echo, .timeout = 1h}, {}, note()); };
  ask();
  ask();
  ASSERT_TRUE(run_until([&] { return waiting.size() == 2; }));
  for (std::uint64_t i = 1; i <= 2; ++i) {  // it looks at all again and again
    EXPECT_TRUE(is_closed(connect()));
    EXPECT_EQ(node.tcp_server_counters().idle, i);
  }
  EXPECT_TRUE(waiting[0].respond());
  EXPECT_TRUE(waiting[1].error(ReturnCode::not_ok));
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 2; }));
  EXPECT_EQ(outcomes[0].fault, std::nullopt);
  EXPECT_TRUE(run_until([&] { return node.tcp_server_counters().idle == 3; })) << "now nobody needs it";
}

TEST_F(SettingsTest, EndConnectionsWithoutMemoryForTheirMessages) {
  NodeConfig config = quick(test::server_address);
  config.max_message_bytes = 300'000;
  config.max_tcp_receive_bytes = 300'000;
  std::vector<std::string> warned;
  Node node{io, config, {}, [&](const std::string& line) { warned.push_back(line); }};
  node.offer(spec());
  std::vector<std::byte> half = test::hex("1234 0001 00040000 0001 0001 01 01 00 00");
  half.resize(200'000);
  tcp::socket& first = connect();
  boost::asio::write(first, boost::asio::buffer(half));
  run_for(50ms);
  tcp::socket& second = connect();
  boost::asio::write(second, boost::asio::buffer(half));
  EXPECT_TRUE(is_closed(first));
  EXPECT_FALSE(is_closed(second, 10ms));
  EXPECT_EQ(node.tcp_server_counters().streams.no_memory, 1U);
  EXPECT_THAT(warned, testing::Contains(testing::HasSubstr("max_tcp_receive_bytes")));
}

TEST_F(SettingsTest, EndConnectionsWithHalfMessages) {
  NodeConfig config = quick(test::server_address);
  config.tcp_message_timeout = 150ms;
  const auto header = test::hex("1234 0001 00ffffff 0001 0001 01 01 00 00 00");
  const auto front = test::hex("1234 0001 00000008");
  const auto back = test::hex("0001 0001 01 01 01 00");
  bool quick_enough = false;
  for (int tries = 0; tries < 20 && !quick_enough; ++tries) {  // until the machine lets us be
    Node node{io, config};
    node.offer(spec());
    tcp::socket& idle = connect();
    tcp::socket& half = connect();
    tcp::socket& slow = connect();
    boost::asio::write(half, boost::asio::buffer(header));
    // One whole message after the other, each in two parts, and never at rest between them.
    auto begin = std::chrono::steady_clock::now();
    Duration longest{};
    const auto finish_message = [&] {
      longest = std::max(longest, std::chrono::steady_clock::now() - begin);
      boost::system::error_code closed;
      boost::asio::write(slow, boost::asio::buffer(back), closed);
    };
    boost::asio::write(slow, boost::asio::buffer(front));
    for (int i = 0; i < 10; ++i) {
      run_for(30ms);
      finish_message();
      begin = std::chrono::steady_clock::now();
      boost::system::error_code closed;
      boost::asio::write(slow, boost::asio::buffer(front), closed);
    }
    EXPECT_TRUE(is_closed(half));
    const auto counted = node.tcp_server_counters();
    finish_message();
    quick_enough = longest < 120ms;
    if (quick_enough) {
      EXPECT_EQ(counted.streams.timed_out, 1U);
      EXPECT_EQ(counted.open, 2U);
    }
    EXPECT_FALSE(is_closed(idle, 200ms)) << "that nothing comes is no fault";
    sockets.clear();
  }
  if (!quick_enough) {
    GTEST_SKIP() << "the machine stalls all the time";
  }
}

TEST_F(SettingsTest, EndConnectionsWithAMessageThatDrips) {
  NodeConfig config = quick(test::server_address);
  config.tcp_message_timeout = 500ms;
  Node node{io, config};
  node.offer(spec());
  tcp::socket& drip = connect();
  ASSERT_TRUE(run_until([&] { return node.tcp_server_counters().open == 1; }));
  // There is always something new of it, long before the time is up: it counts from its first byte.
  const auto header = test::hex("1234 0001 00ffffff 0001 0001 01 01 00 00 00");
  std::size_t sent = 0;
  const auto drop = [&] {
    boost::system::error_code closed;
    boost::asio::write(drip, boost::asio::buffer(&header[std::min(sent, header.size() - 1)], 1), closed);
    ++sent;
    return node.tcp_server_counters().streams.timed_out == 1;
  };
  const auto limit = std::chrono::steady_clock::now() + 60s;
  while (!drop() && std::chrono::steady_clock::now() < limit) {
    run_for(30ms);
  }
  EXPECT_EQ(node.tcp_server_counters().streams.timed_out, 1U);
  EXPECT_EQ(node.tcp_server_counters().open, 0U);
  EXPECT_TRUE(is_closed(drip));
}

TEST_F(SettingsTest, SendMagicCookies) {
  covers({"feat_req_someip_586"});
  NodeConfig config = quick(test::server_address);
  config.magic_cookies = true;
  Node node{io, config};
  node.offer(spec());
  tcp::socket& client = connect();
  boost::asio::write(client, boost::asio::buffer(test::hex("1234 0001 00000008 0001 0001 01 01 00 00")));
  std::vector<std::byte> received(32);
  std::size_t count = 0;
  client.async_read_some(boost::asio::buffer(received),
                         [&](const boost::system::error_code&, std::size_t bytes) { count = bytes; });
  ASSERT_TRUE(run_until([&] { return count != 0; }));
  EXPECT_EQ(test::to_hex(ByteView{received}.first(16)), "ffff800000000008deadbeef01010200");
}

TEST_F(SettingsTest, SetThePaceOfConnecting) {
  NodeConfig config = quick(test::client_address);
  config.tcp_retry_min = 20ms;
  config.tcp_retry_max = 20ms;
  Node client{io, config};
  Node server{io, quick(test::server_address)};
  // Refuses every client: it has its only one already.
  NodeConfig full = quick(test::other_address);
  full.max_tcp_clients = 1;
  Node busy{io, full};
  ServiceSpec one = spec();
  busy.offer(one);
  tcp::socket place{io};
  place.connect({boost::asio::ip::make_address(someip::to_string(test::other_address)), tcp_port});
  ask_and_wait(place);
  ASSERT_EQ(busy.tcp_server_counters().open, 1U);
  client.subscribe(
      {.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}, .udp = false, .tcp = true},
      collect());
  EXPECT_TRUE(run_until([&] { return busy.tcp_server_counters().refused >= 10; }, 3s))
      << "the default would have tried 5 times, after 100, 200, 400 and 800 ms";
}

// --- Answers ----------------------------------------------------------------------------------------------

struct Answer {
  std::string name;
  someip::AnswerRules rules;
  std::string request;
  std::string by_default;
  std::string as_configured;  ///< empty: none
};

void PrintTo(const Answer& answer, std::ostream* out) {
  *out << answer.name;
}

class AnswerSettings : public SettingsTest, public testing::WithParamInterface<Answer> {};

TEST_P(AnswerSettings, AreFollowed) {
  covers({"feat_req_someip_598", "feat_req_someip_726", "feat_req_someip_106", "feat_req_someip_816"});
  const auto expected = [](const std::string& answer) {
    return answer.empty() ? std::vector<std::string>{}
                          : std::vector<std::string>{test::to_hex(test::hex(answer))};
  };
  {
    Node node{io, quick(test::server_address)};
    node.offer(spec());
    EXPECT_EQ(ask(GetParam().request), expected(GetParam().by_default));
  }
  NodeConfig config = quick(test::server_address);
  config.answers = GetParam().rules;
  Node node{io, config};
  node.offer(spec());
  EXPECT_EQ(ask(GetParam().request, 1, GetParam().as_configured.empty() ? 50ms : 60s),
            expected(GetParam().as_configured));
}

INSTANTIATE_TEST_SUITE_P(All, AnswerSettings,
                         testing::Values(Answer{"ErrorType",
                                                {.error_type = MessageType::error},
                                                "1234 0001 00000008 0005 0009 01 02 00 00",
                                                "1234 0001 00000008 0005 0009 01 02 80 08",
                                                "1234 0001 00000008 0005 0009 01 02 81 08"},
                                         Answer{"UnknownService",
                                                {.answer_unknown_service = false},
                                                "4321 0001 00000008 0005 0009 01 01 00 00",
                                                "4321 0001 00000008 0005 0009 01 01 80 02",
                                                ""},
                                         Answer{"UnknownMethod",
                                                {.answer_unknown_method = false},
                                                "1234 0009 00000008 0005 0009 01 01 00 00",
                                                "1234 0009 00000008 0005 0009 01 01 80 03",
                                                ""},
                                         Answer{"InterfaceVersion",
                                                {.answer_wrong_interface_version = false},
                                                "1234 0001 00000008 0005 0009 01 02 00 00",
                                                "1234 0001 00000008 0005 0009 01 02 80 08",
                                                ""},
                                         Answer{"ProtocolVersion",
                                                {.answer_wrong_protocol_version = false},
                                                "1234 0001 00000008 0005 0009 02 01 00 00",
                                                "1234 0001 00000008 0005 0009 01 01 80 07",
                                                ""},
                                         Answer{"ReturnCode",
                                                {.process_request_with_return_code = false},
                                                "1234 0001 00000008 0005 0009 01 01 00 01",
                                                "1234 0001 00000008 0005 0009 01 01 80 00",
                                                ""}),
                         [](const auto& one) { return one.param.name; });

TEST_F(SettingsTest, OfAServiceWinOverThoseOfTheNode) {
  covers({"feat_req_someip_726", "feat_req_someip_106", "feat_req_someip_101"});
  NodeConfig config = quick(test::server_address);
  config.answers.answer_unknown_method = false;
  Node node{io, config};
  ServiceSpec with_errors = spec();
  with_errors.answers = someip::AnswerRules{.error_type = MessageType::error};
  with_errors.methods = {
      {echo, [](const Message&, Responder responder) { responder.error(ReturnCode::not_ready); }}};
  node.offer(with_errors);
  ServiceSpec other = spec();
  other.service = ServiceId{0x1235};
  node.offer(other);
  EXPECT_THAT(ask("1234 0009 00000008 0005 0009 01 01 00 00"),
              testing::ElementsAre("12340009000000080005000901018103"));
  EXPECT_THAT(ask("1234 0001 00000008 0005 0009 01 01 00 00"),
              testing::ElementsAre("12340001000000080005000901018104"));
  EXPECT_THAT(ask("1235 0009 00000008 0005 0009 01 01 00 00", 1, 50ms), IsEmpty());
}

TEST_F(SettingsTest, LetAGetterIgnoreWhatANewerClientAdds) {
  covers({"feat_req_someip_168"});
  Node node{io, quick(test::server_address)};
  node.offer(spec());
  EXPECT_THAT(ask("1234 0002 0000000b 0005 0009 01 01 00 00 aabbcc"),
              testing::ElementsAre("123400020000000900050009010180"
                                   "0007"));
}

// --- Segments ---------------------------------------------------------------------------------------------

TEST_F(SettingsTest, PaceRequestsAndResponses) {
  NodeConfig server_config = quick(test::server_address);
  server_config.pacing = {.segment_bytes = 160};
  Node server{io, server_config};
  NodeConfig client_config = quick(test::client_address);
  client_config.pacing = {.segment_bytes = 320};
  Node client{io, client_config};
  server.offer(spec());
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(service).empty(); }));
  const auto payload = numbers(3200);
  const ByteView slice{payload};
  client.call(service, {.method = echo, .transport = Transport::udp}, {&slice, 1}, note());
  ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
  EXPECT_EQ(outcomes[0].payload, payload);
  EXPECT_EQ(client.sender_counters().datagrams, 10U) << "320 bytes each";
  EXPECT_EQ(server.sender_counters().datagrams, 20U) << "160 bytes each";
}

TEST_F(SettingsTest, LimitTheReassembliesOfASenderAndTheirTime) {
  NodeConfig config = quick(test::server_address);
  config.max_reassemblies_per_sender = 1;
  config.reassembly_timeout = 60ms;
  config.reassembly_protected_rate = 0;  // none gives way
  Node node{io, config};
  node.offer(spec());
  someip::UdpSocket socket{io, {.local = {test::other_address, 0}}};
  const auto begin = [&](const std::string& client) {
    const auto first = test::hex("1234 0001 0000001c" + client + "0009 01 01 20 00 00000001" +
                                 "00112233445566778899aabbccddeeff");
    const ByteView view{first};
    EXPECT_EQ(socket.send(udp_at(test::server_address), {&view, 1}), someip::SendStatus::sent);
  };
  begin("0001");
  begin("0002");
  ASSERT_TRUE(run_until([&] { return node.counters().datagrams == 2; }));
  EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::too_many_from_sender], 1U)
      << "the second, while the first is under way";
  EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::aged_out], 0U);
  EXPECT_TRUE(run_until([&] { return node.reassembly_counters()[someip::TpDrop::aged_out] == 1; }));
}

// --- The server that is called ----------------------------------------------------------------------------

TEST_F(SettingsTest, ChooseTheServerInWhateverOrderTheyAreFound) {
  covers({"feat_req_someipsd_770"});
  for (const int better : {1, 2}) {
    Node first{io, quick(test::server_address)};
    Node second{io, quick(test::other_address)};
    Node client{io, quick(test::client_address)};
    const auto ranked = [&](int instance) {
      ServiceSpec result = spec();
      result.instance = InstanceId{static_cast<std::uint16_t>(instance)};
      const auto priority = static_cast<std::uint16_t>(instance == better ? 1 : 2);
      result.options.load_balancing = LoadBalancingOption{.priority = priority, .weight = 1};
      result.methods = {{echo, [instance](const Message&, Responder responder) {
                           const std::array answer{static_cast<std::byte>(instance)};
                           responder.respond(ByteView{answer});
                         }}};
      return result;
    };
    const RequirementId service = client.require({.service = ServiceId{0x1234}});
    first.offer(ranked(1));
    ASSERT_TRUE(run_until([&] { return client.available(service).size() == 1; }));
    second.offer(ranked(2));
    ASSERT_TRUE(run_until([&] { return client.available(service).size() == 2; }));
    outcomes.clear();
    client.call(service, {.method = echo}, {}, note());
    ASSERT_TRUE(run_until([&] { return outcomes.size() == 1; }));
    EXPECT_EQ(test::to_hex(outcomes[0].payload), better == 1 ? "01" : "02");
  }
}

// --- The subnet -------------------------------------------------------------------------------------------

TEST_F(SettingsTest, KnowTheSubnet) {
  covers({"feat_req_someipsd_1135", "feat_req_someipsd_1149"});
  EXPECT_EQ(someip::subnet_prefix_bits(test::server_address), 8) << "127.0.0.0/8";
  EXPECT_EQ(someip::subnet_prefix_bits(IpAddress::v4(192, 0, 2, 1)), std::nullopt) << "nobody's";
  IpAddress loopback{.v6 = true};
  loopback.bytes[15] = 1;
  EXPECT_EQ(someip::subnet_prefix_bits(loopback), std::nullopt) << "::1/128 has no subnet";
}

// --- Events -----------------------------------------------------------------------------------------------

TEST_F(SettingsTest, DropEventsThatBringAnError) {
  covers({"feat_req_someip_683", "feat_req_someip_367"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec from_udp = spec();
  const OfferHandle offer = server.offer(from_udp);
  const SubscriptionId subscription = client.subscribe(
      {.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}, .port = 40242}, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  // From the very endpoint of the service, in place of the server.
  const int fd = descriptors_of(udp_at(test::server_address), SOCK_DGRAM).at(0);
  someip::SocketAddress to{Endpoint{test::client_address, 40242}};
  for (const std::string code : {"05", "00"}) {
    const auto message = test::hex("1234 8001 00000009 0000 0001 01 01 02" + code + "2a");
    ASSERT_EQ(sendto(fd, message.data(), message.size(), 0, to.data(), to.size()), 17);
  }
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  run_for(20ms);
  ASSERT_THAT(events, SizeIs(1));
  EXPECT_EQ(events[0].header.return_code, ReturnCode::ok);
  EXPECT_EQ(client.counters().bad_return_code, 1U);
  EXPECT_EQ(client.counters().events, 1U);
  EXPECT_EQ(server.notify(offer, event, {}).subscribers, 1U);
}

}  // namespace
}  // namespace trestle::sd::settings_arrive_test
