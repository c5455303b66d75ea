// Which large messages over UDP are put together, and that requests, which anybody can send, do not take the
// places of the events and answers that are awaited.
#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::large_messages_test {
namespace {

using someip::MethodId;
using test::covers;
using test::numbers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class LargeMessagesTest : public test::TwoNodes {
 protected:
  static constexpr std::uint16_t port = 40251;
  static constexpr MethodId take{0x0001};
  static constexpr MethodId small{0x0002};
  static constexpr MethodId event{0x8001};

  static ServiceSpec service(ServiceId id, std::uint16_t at) {
    return {.service = id,
            .instance = InstanceId{1},
            .udp_port = at,
            .methods = {{take, [](const auto& /*request*/, Responder responder) { responder.respond(); }},
                        {small, [](const auto& /*request*/, Responder responder) { responder.respond(); }}},
            .fields = {{.getter = MethodId{0x0010}, .setter = MethodId{0x0011}}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {event}}},
            .segmented = std::vector{take, MethodId{0x0010}, MethodId{0x0011}, event}};
  }
  /// The first of two segments of a request, or the second.
  static std::vector<std::byte> segment(const std::string& method, bool first = true,
                                        const std::string& version = "01") {
    return test::hex("1234" + method + (first ? "0000001c" : "0000000d") + "0005 0009 01" + version +
                     "20 00" + (first ? "00000001 00112233445566778899aabbccddeeff" : "00000010 00"));
  }
  /// Sends datagrams to the node one after the other, and what comes back.
  std::vector<std::string> answers_to(const Node& node, const std::vector<std::vector<std::byte>>& datagrams,
                                      std::size_t count) {
    someip::UdpSocket socket{io, {.local = {test::other_address, 0}}};
    std::vector<std::string> answers;
    socket.receive([&](ByteView datagram, const Endpoint&) { answers.push_back(test::to_hex(datagram)); });
    const std::uint64_t before = node.counters().datagrams;
    for (const auto& datagram : datagrams) {
      const ByteView view{datagram};
      EXPECT_EQ(socket.send({test::server_address, port}, {&view, 1}), someip::SendStatus::sent);
    }
    EXPECT_TRUE(run_until(
        [&] { return node.counters().datagrams == before + datagrams.size() && answers.size() >= count; }));
    return answers;
  }
};

// All at one port, and one place for each direction.
TEST_F(LargeMessagesTest, OfOthersThatNeverEndKeepNoEventFromComing) {
  NodeConfig config = quick(test::server_address);
  config.max_reassemblies = 1;
  Node node{io, config};
  Node other{io, quick(test::client_address)};
  node.offer(service(ServiceId{0x1234}, port));
  const OfferHandle offered = other.offer(service(ServiceId{0x2000}, 0));
  node.subscribe({.service = ServiceId{0x2000},
                  .instance = InstanceId{1},
                  .eventgroup = EventgroupId{1},
                  .events = {event},
                  .port = port},
                 collect());
  ASSERT_TRUE(run_until([&] { return other.subscribers(offered, event) == 1; }));
  EXPECT_THAT(answers_to(node, {segment("0001")}, 0), IsEmpty());
  EXPECT_EQ(node.reassembly_counters().segments, 1U);
  const auto payload = numbers(5000);
  const ByteView slice{payload};
  other.notify(offered, event, {&slice, 1});
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].payload, payload);
  EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::no_slot], 0U);
}

TEST_F(LargeMessagesTest, ToMethodsThatDoNotTakeThemGetOneAnswerAndNoPlace) {
  covers({"feat_req_someiptp_788", "feat_req_someip_721", "feat_req_someip_633"});
  Node node{io, quick(test::server_address)};
  node.offer(service(ServiceId{0x1234}, port));
  const auto both = [&](const std::string& method, const std::string& version = "01") {
    return answers_to(node, {segment(method, false, version), segment(method, true, version)}, 1);
  };
  EXPECT_THAT(both("0077"), ElementsAre("123400770000000800050009"
                                        "01018003"))
      << "no such method";
  EXPECT_THAT(both("0001", "02"), ElementsAre("123400010000000800050009"
                                              "01028008"))
      << "another interface version";
  EXPECT_THAT(both("0002"), ElementsAre("123400020000000800050009"
                                        "01018001"))
      << "may not be segmented";
  EXPECT_THAT(both("0010"), ElementsAre("123400100000000800050009"
                                        "01018001"))
      << "a getter is called with nothing";
  EXPECT_EQ(node.counters().requests_answered, 4U);
  EXPECT_EQ(node.counters().unexpected, 4U) << "each other segment";
  EXPECT_EQ(node.reassembly_counters().segments, 0U);
  EXPECT_THAT(both("0001"), ElementsAre("123400010000000800050009"
                                        "01018000"));
  EXPECT_THAT(both("0011"), ElementsAre(testing::StartsWith("12340011")));
  EXPECT_EQ(node.reassembly_counters().messages, 2U);
}

// The same of as many clients, each at the first of its segments.
TEST_F(LargeMessagesTest, ThatAreLostAtALimitAreToldOfWithItsName) {
  const auto half_requests = [this](NodeConfig config, std::uint8_t clients) {
    std::vector<std::string> warnings;
    Node node{io, config, {}, [&warnings](const std::string& line) { warnings.push_back(line); }};
    node.offer(service(ServiceId{0x1234}, port));
    std::vector<std::vector<std::byte>> datagrams;
    for (std::uint8_t client = 1; client <= clients; ++client) {
      datagrams.push_back(segment("0001"));
      datagrams.back()[9] = std::byte{client};
    }
    answers_to(node, datagrams, 0);
    std::erase_if(warnings, [](const std::string& line) { return line.find("large messages") == line.npos; });
    EXPECT_EQ(warnings.size(), 1U) << "at most one in ten seconds";
    return warnings.empty() ? "" : warnings.front();
  };
  using ::testing::HasSubstr;
  NodeConfig config = quick(test::server_address);
  config.max_message_bytes = 65536;
  config.max_udp_receive_bytes = 1;  // which is three pieces of 64 KiB
  EXPECT_THAT(half_requests(config, 6), HasSubstr("had no memory: raise max_udp_receive_bytes"));
  config = quick(test::server_address);
  config.max_reassemblies = 4;
  config.reassembly_protected_rate = 0;  // none gives way
  EXPECT_THAT(half_requests(config, 6), HasSubstr("raise max_reassemblies (4)"));
  config.max_reassemblies = 32;
  config.max_reassemblies_per_sender = 4;
  EXPECT_THAT(half_requests(config, 6), HasSubstr("raise max_reassemblies_per_sender (4)"));
  config.reassembly_protected_rate = 4'000'000'000;  // each does
  EXPECT_THAT(half_requests(config, 6), HasSubstr("gave way to others"));
}

// A method at each of two ports: what one has taken the other cannot have.
TEST_F(LargeMessagesTest, ShareTheirMemoryBetweenPorts) {
  NodeConfig config = quick(test::server_address);
  config.max_message_bytes = 65536;
  config.max_udp_receive_bytes = 1;
  Node node{io, config};
  node.offer(service(ServiceId{0x1234}, port));
  node.offer(service(ServiceId{0x1235}, port + 1));
  std::vector<std::vector<std::byte>> datagrams(3, segment("0001"));
  for (std::uint8_t i = 0; i < 3; ++i) {
    datagrams[i][9] = std::byte{i};
  }
  answers_to(node, datagrams, 0);
  EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::no_memory], 0U);
  someip::UdpSocket socket{io, {.local = {test::other_address, 0}}};
  auto other = segment("0001");
  other[1] = std::byte{0x35};
  const ByteView view{other};
  EXPECT_EQ(socket.send({test::server_address, port + 1}, {&view, 1}), someip::SendStatus::sent);
  EXPECT_TRUE(run_until([&] { return node.reassembly_counters()[someip::TpDrop::no_memory] == 1; }));
}

// One whose requests fit a datagram, and one whose largest has 20 bytes more.
TEST_F(LargeMessagesTest, LargerThanAMethodsRequestsGetNoPlace) {
  for (const std::size_t most : {std::size_t{17}, someip::max_plain_payload_bytes + 20}) {
    Node node{io, quick(test::server_address)};
    ServiceSpec spec = service(ServiceId{0x1234}, port);
    spec.methods[0].max_request_bytes = most;
    node.offer(spec);
    const bool fits = most > someip::max_plain_payload_bytes;
    const auto answers = answers_to(node, {segment("0001"), segment("0001", false)}, 1);
    EXPECT_EQ(answers.size(), 1U) << "one, whether it is the answer or an error";
    EXPECT_EQ(node.reassembly_counters().messages, fits ? 1U : 0U);
    EXPECT_EQ(node.reassembly_counters().segments, fits ? 2U : 0U);
    auto beyond = segment("0001");
    beyond[11] = std::byte{0x0a};  // another session
    beyond[18] = std::byte{0x40};  // from byte 16384 on
    answers_to(node, {beyond}, 0);
    EXPECT_EQ(node.reassembly_counters()[someip::TpDrop::too_large], fits ? 1U : 0U);
  }
}

TEST_F(LargeMessagesTest, LargerThanASubscriptionsEventsAreNotPutTogether) {
  Node client{io, quick(test::client_address)};
  Node server{io, quick(test::server_address)};
  const OfferHandle offered = server.offer(service(ServiceId{0x2000}, 0));
  SubscribeSpec wanted{.service = ServiceId{0x2000},
                       .instance = InstanceId{1},
                       .eventgroup = EventgroupId{1},
                       .events = {event},
                       .max_event_bytes = 3000};
  client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return server.subscribers(offered, event) == 1; }));
  for (const std::size_t size : {std::size_t{5000}, std::size_t{3000}}) {
    const auto payload = numbers(size);
    const ByteView slice{payload};
    server.notify(offered, event, {&slice, 1});
  }
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].payload, numbers(3000));
  EXPECT_GT(client.reassembly_counters()[someip::TpDrop::too_large], 0U);
  // Of several who want it, who takes the largest counts.
  wanted.max_event_bytes.reset();
  client.subscribe(wanted, collect());
  const auto payload = numbers(5000);
  const ByteView slice{payload};
  server.notify(offered, event, {&slice, 1});
  ASSERT_TRUE(run_until([&] { return events.size() == 3; }));
}

TEST_F(LargeMessagesTest, AreCountedAlsoOncePortsAreClosed) {
  Node node{io, quick(test::server_address)};
  const OfferHandle offered = node.offer(service(ServiceId{0x1234}, port));
  answers_to(node, {segment("0001"), segment("0001", false)}, 1);
  EXPECT_EQ(node.reassembly_counters().messages, 1U);
  node.withdraw(offered);
  EXPECT_EQ(node.reassembly_counters().messages, 1U);
  EXPECT_EQ(node.reassembly_counters().segments, 2U);
}

}  // namespace
}  // namespace trestle::sd::large_messages_test
