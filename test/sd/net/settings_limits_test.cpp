// The limits of a NodeConfig, and whom it listens to, arrive where they work: in what a Node refuses.
#include <sys/socket.h>

#include <boost/asio/ip/tcp.hpp>
#include <list>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/net_error.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::settings_limits_test {
namespace {

using boost::asio::ip::tcp;
using someip::Message;
using someip::MethodId;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

class LimitsArrive : public test::TwoNodes {
 protected:
  static constexpr std::uint16_t udp_port = 40242;
  static constexpr MethodId method{0x0001};

  static ServiceSpec service_with_both() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .udp_port = udp_port,
            .tcp_port = 0,
            .methods = {{method, [](const Message& request,
                                    Responder responder) { responder.respond(request.payload); }}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {MethodId{0x8001}}}}};
  }
  RequirementId found(Node& client) {
    const RequirementId id = client.require({.service = ServiceId{0x1234}});
    EXPECT_TRUE(run_until([&] { return !client.available(id).empty(); }));
    return id;
  }
  /// Whether the answer came; a fault otherwise.
  std::optional<CallFault> fault_of(Node& client, RequirementId service, Transport transport,
                                    std::size_t bytes, Duration timeout = 60s) {
    outcomes.clear();
    const auto payload = numbers(bytes);
    const ByteView slice{payload};
    client.call(service, {.method = method, .timeout = timeout, .transport = transport}, {&slice, 1}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? CallFault::timed_out : outcomes.front().fault;
  }
  /// What comes back to a message, sent from another address than the node's.
  std::vector<std::string> answers_to(const std::string& bytes, const Endpoint& to,
                                      std::chrono::milliseconds limit = 60s) {
    someip::UdpSocket socket{io, {.local = {test::other_address, 0}}};
    std::vector<std::string> received;
    socket.receive([&](ByteView datagram, const Endpoint&) { received.push_back(test::to_hex(datagram)); });
    const auto message = test::hex(bytes);
    const ByteView view{message};
    EXPECT_EQ(socket.send(to, {&view, 1}), someip::SendStatus::sent);
    static_cast<void>(run_until([&] { return !received.empty(); }, limit));
    return received;
  }
};

// --- Of discovery -----------------------------------------------------------------------------------------

TEST_F(LimitsArrive, AtDiscovery) {
  NodeConfig config = quick(test::server_address);
  config.limits.max_offers = 1;
  Node node{io, config};
  const OfferHandle first = node.offer(service_with_both());
  ServiceSpec second = service_with_both();
  second.service = ServiceId{0x1235};
  try {
    node.offer(second);
    FAIL() << "there is no place for it";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("refused by service discovery: table full"));
  }
  node.withdraw(first);
  EXPECT_NO_THROW(node.offer(second));
}

// The address that shows whether the subnet is known is its broadcast address, for others than those of
// 127.0.0.0/8 the loopback interface does not have.
TEST_F(LimitsArrive, AtTheSubnet) {
  covers({"feat_req_someipsd_1135", "feat_req_someipsd_1149"});
  const std::string subscribe =
      "ffff8100 00000030 00000000 01010200 c0000000"
      "00000010 06000010 12340001 01000003 00000001"
      "0000000c 000904007fffffff00119c40";  // 127.255.255.255:40000
  const auto answer = [&](bool check) {
    NodeConfig config = quick(test::server_address);
    config.check_subnet = check;
    config.discovery.own_endpoints_only = false;
    Node node{io, config};
    node.offer(service_with_both());
    const auto received = answers_to(subscribe, {config.address, config.port});
    return received.empty() ? "" : received.front().substr(48, 32);
  };
  EXPECT_EQ(answer(true), "07000000123400010100000000000001") << "a Nack";
  EXPECT_EQ(answer(false), "07000000123400010100000300000001") << "an Ack";
}

TEST_F(LimitsArrive, AtTheSubnetThatIsNamed) {
  covers({"feat_req_someipsd_1135"});
  const std::string find =
      "ffff8100 00000024 00000000 01010200 c0000000"
      "00000010 00000000 1234ffff ff000003 ffffffff 00000000";
  const auto answers = [&](std::optional<std::uint8_t> prefix_bits) {
    NodeConfig config = quick(test::server_address);
    config.discovery.subnet_prefix_bits = prefix_bits;
    Node node{io, config};
    node.offer(service_with_both());
    run_for(100ms);
    const bool answered =
        !answers_to(find, {config.address, config.port}, prefix_bits == 31 ? 100ms : 60s).empty();
    return std::pair{answered, node.discovery_counters().dropped_source};
  };
  EXPECT_EQ(answers(std::nullopt), (std::pair{true, std::uint64_t{0}})) << "127.0.0.0/8";
  EXPECT_EQ(answers(24), (std::pair{true, std::uint64_t{0}}));
  EXPECT_EQ(answers(31), (std::pair{false, std::uint64_t{1}})) << "127.x.y.0 and 127.x.y.1 alone";
}

TEST_F(LimitsArrive, AtTheInterface) {
  NodeConfig config = quick(test::server_address);
  config.multicast_interface = "lo";
  EXPECT_NO_THROW(Node(io, config));
  config.multicast_interface = "nowhere0";
  EXPECT_THROW(Node(io, config), someip::NetError);
}

// --- Of messages ------------------------------------------------------------------------------------------

TEST_F(LimitsArrive, AtReceivedMessages) {
  NodeConfig config = quick(test::server_address);
  config.max_message_bytes = 1600;
  Node server{io, config};
  Node client{io, quick(test::client_address)};
  server.offer(service_with_both());
  const RequirementId service = found(client);
  EXPECT_EQ(fault_of(client, service, Transport::udp, 1600), std::nullopt);
  EXPECT_EQ(server.reassembly_counters()[someip::TpDrop::too_large], 0U);
  EXPECT_EQ(fault_of(client, service, Transport::udp, 1601, 1s), CallFault::timed_out);
  EXPECT_TRUE(run_until([&] { return server.reassembly_counters()[someip::TpDrop::too_large] == 1; }));
  EXPECT_EQ(fault_of(client, service, Transport::tcp, 1600), std::nullopt);
  EXPECT_EQ(server.tcp_server_counters().bad_framing, 0U);
  EXPECT_EQ(fault_of(client, service, Transport::tcp, 1601), CallFault::timed_out);
  EXPECT_EQ(server.tcp_server_counters().bad_framing, 1U);
}

TEST_F(LimitsArrive, AtWhatWaitsToBeSent) {
  NodeConfig config = quick(test::client_address);
  config.max_queued_bytes = 3000;
  config.pacing = {.segment_bytes = 160, .burst = 1, .separation = 1ms};
  Node server{io, quick(test::server_address)};
  std::vector<std::string> warnings;
  Node client{io, config, {}, [&warnings](const std::string& line) { warnings.push_back(line); }};
  server.offer(service_with_both());
  const RequirementId service = found(client);
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    EXPECT_EQ(fault_of(client, service, transport, 2000), std::nullopt);
    EXPECT_EQ(fault_of(client, service, transport, 8000), CallFault::not_sent);
  }
  EXPECT_EQ(client.sender_counters().queue_full, 1U);
  EXPECT_EQ(client.tcp_client_counters().streams.queue_full, 1U);
  std::erase_if(warnings,
                [](const std::string& line) { return line.find("max_queued_bytes (3000)") == line.npos; });
  EXPECT_EQ(warnings.size(), 1U) << "which names the limit, once in ten seconds";
}

TEST_F(LimitsArrive, AtReassemblies) {
  for (const bool gives_way : {false, true}) {
    NodeConfig config = quick(test::server_address);
    config.max_reassemblies = 1;
    config.reassembly_protected_rate = gives_way ? 1'000'000'000 : 0;
    Node node{io, config};
    node.offer(service_with_both());
    const auto first_segment = test::hex(
        "1234 0001 0000001c 0005 0009 01 01 20 00 00000001"
        "00112233445566778899aabbccddeeff");
    const ByteView view{first_segment};
    std::list<someip::UdpSocket> senders;
    for (const IpAddress& from : {test::other_address, test::client_address}) {
      senders.emplace_back(io, someip::UdpOptions{.local = {from, 0}});
      EXPECT_EQ(senders.back().send({config.address, udp_port}, {&view, 1}), someip::SendStatus::sent);
    }
    ASSERT_TRUE(run_until([&] { return node.counters().datagrams == 2; }));
    EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::no_slot], gives_way ? 0U : 1U);
    EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::gave_way], gives_way ? 1U : 0U);
  }
}

// --- Of TCP connections -----------------------------------------------------------------------------------

TEST_F(LimitsArrive, AtAttemptsToConnect) {
  const Endpoint server{test::own_address(4), 40243};
  const auto number = [](std::span<const std::uint8_t> bytes) { return test::to_hex(std::as_bytes(bytes)); };
  // A port whose only place for a connection that nobody accepts is taken: the system lets others wait.
  someip::SocketAddress at{server};
  tcp::socket listener{io, tcp::v4()};
  ASSERT_EQ(bind(listener.native_handle(), at.data(), at.size()), 0);
  ASSERT_EQ(listen(listener.native_handle(), 0), 0);
  std::list<tcp::socket> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.emplace_back(io, tcp::v4());
    waiting.back().non_blocking(true);
    static_cast<void>(connect(waiting.back().native_handle(), at.data(), at.size()));
  }
  NodeConfig config = quick(test::client_address);
  config.discovery.own_endpoints_only = false;  // for an offer in the server's name
  config.tcp_connect_timeout = 50ms;
  config.tcp_retry_min = 10ms;
  config.tcp_retry_max = 10ms;
  Node client{io, config};
  client.subscribe({.service = ServiceId{0x1234},
                    .eventgroup = EventgroupId{1},
                    .events = {MethodId{0x8001}},
                    .udp = false,
                    .tcp = true},
                   collect());
  const std::string offer =
      "ffff8100 00000030 00000000 01010200 c0000000"
      "00000010 01000010 12340001 01000258 00000000"
      "0000000c 00090400" +
      number(std::span{server.address.bytes}.first(4)) + "00069d33";
  EXPECT_THAT(answers_to(offer, {config.address, config.port}, 20ms), IsEmpty()) << "no connection yet";
  EXPECT_TRUE(run_until([&] { return client.tcp_client_counters().failed_attempts >= 3; }, 1s))
      << "by default the first attempt would take 3 s";
  EXPECT_LT(client.tcp_client_counters().failed_attempts, 1000U);
  EXPECT_EQ(client.tcp_client_counters().connections, 0U);
}

TEST_F(LimitsArrive, AtCookies) {
  covers({"feat_req_someip_586"});
  const std::string cookie = "ffff800000000008deadbeef01010200";
  const std::string answer = "12340001000000080001000101018000";
  for (const bool in_each : {true, false}) {
    NodeConfig config = quick(test::server_address);
    config.magic_cookies = true;
    config.cookie_in_each_segment = in_each;
    Node node{io, config};
    ServiceSpec service = service_with_both();
    service.tcp_port = 40244;
    node.offer(service);
    tcp::socket client{io};
    client.connect({boost::asio::ip::make_address(someip::to_string(config.address)), 40244});
    std::vector<std::string> answers;
    for (int i = 0; i < 2; ++i) {
      client.send(boost::asio::buffer(test::hex("1234 0001 00000008 0001 0001 01 01 00 00")));
      std::vector<std::byte> room(64);
      std::size_t count = 0;
      client.async_read_some(boost::asio::buffer(room),
                             [&](const boost::system::error_code&, std::size_t bytes) { count = bytes; });
      ASSERT_TRUE(run_until([&] { return count != 0; }));
      answers.push_back(test::to_hex(ByteView{room}.first(count)));
    }
    EXPECT_THAT(answers, ElementsAre(cookie + answer, (in_each ? cookie : "") + answer));
  }
}

}  // namespace
}  // namespace trestle::sd::settings_limits_test
