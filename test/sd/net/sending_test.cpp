// What a node does with what it is to send: together, in order, with buffers as large as they can be.
#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <limits>

#include "someip/net/udp_socket.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::sending_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using test::quick;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr ServiceId service{0x1234};
constexpr MethodId event{0x8001};

class SendingTest : public test::TwoNodes {};

TEST_F(SendingTest, LosesNoEventThatComesBeforeTheEndOfItsService) {
  // An offer that the client has not read yet would have it read the end of all, too, before it reads events.
  NodeConfig once = quick(test::server_address);
  once.timing.repetitions_max = 0;
  once.timing.cyclic_offer_delay = std::chrono::hours{1};
  Node server{io, once};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer({.service = service,
                                          .instance = InstanceId{1},
                                          .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}});
  static_cast<void>(
      client.subscribe({.service = service, .eventgroup = EventgroupId{1}, .events = {event}}, collect()));
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer, event) == 1; }));
  while (io.poll() > 0) {
  }
  boost::asio::post(io, [&] {
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(server.notify(offer, event, {}).subscribers, 1U);
    }
    EXPECT_EQ(server.sender_counters().messages, 1U);
    server.shutdown();
    EXPECT_EQ(server.sender_counters().messages, 5U);
    EXPECT_EQ(server.sender_counters().system_calls, 2U);
  });
  EXPECT_TRUE(run_until([&] { return events.size() == 5; }));
  EXPECT_EQ(client.counters().unknown_sender, 0U) << "they came before the offer's end";
}

TEST_F(SendingTest, SaysWhichBuffersTheSystemDoesNotGrant) {
  NodeConfig greedy = quick(test::server_address);
  greedy.receive_buffer_bytes = std::numeric_limits<int>::max();
  greedy.send_buffer_bytes = 64 << 10;
  std::vector<std::string> warnings;
  const Node node{io, greedy, into(server_log), into(warnings)};
  EXPECT_THAT(warnings,
              ElementsAre(AllOf(HasSubstr("UDP receive buffers"), HasSubstr("KB only, not 2097151:"),
                                HasSubstr("sysctl -w net.core.rmem_max=2147483647"))));
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("grants"))));
  NodeConfig modest = quick(test::client_address);
  modest.receive_buffer_bytes = 64 << 10;
  modest.send_buffer_bytes = 64 << 10;
  const Node other{io, modest, into(client_log)};
  EXPECT_THAT(client_log, Not(Contains(HasSubstr("grants"))));
}

TEST_F(SendingTest, SaysThatTheSendBufferIsSmallWithTheFirstLargeMessageAndOnce) {
  NodeConfig hasty = quick(test::server_address);
  hasty.receive_buffer_bytes = 64 << 10;
  hasty.send_buffer_bytes = std::numeric_limits<int>::max();
  std::vector<std::string> warnings;
  Node server{io, hasty, into(server_log), into(warnings)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer({.service = service,
                                          .instance = InstanceId{1},
                                          .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}});
  static_cast<void>(
      client.subscribe({.service = service, .eventgroup = EventgroupId{1}, .events = {event}}, collect()));
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer, event) == 1; }));
  const auto small = test::numbers(60'000);
  const auto large = test::numbers((1 << 20) + 1);
  server.notify(offer, event, std::array{ByteView{small}});
  EXPECT_THAT(warnings, IsEmpty()) << "it needs none";
  for (int i = 0; i < 3; ++i) {
    server.notify(offer, event, std::array{ByteView{large}});
  }
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr("UDP send buffers"), HasSubstr("KB only, not 2097151:"),
                                          HasSubstr("sysctl -w net.core.wmem_max=2147483647"))));
}

TEST_F(SendingTest, SaysWhichBuffersOfConnectionsTheSystemDoesNotGrant) {
  const auto warnings = [this](int receive, int send) {
    NodeConfig config = quick(test::server_address);
    config.receive_buffer_bytes = config.send_buffer_bytes = 64 << 10;
    config.tcp_receive_buffer_bytes = receive;
    config.tcp_send_buffer_bytes = send;
    std::vector<std::string> lines;
    const Node node{io, config, {}, into(lines)};
    return lines;
  };
  constexpr int modest = 64 << 10;
  constexpr int greedy = std::numeric_limits<int>::max();
  EXPECT_THAT(warnings(0, 0), IsEmpty());
  EXPECT_THAT(warnings(modest, modest), IsEmpty());
  EXPECT_THAT(warnings(greedy, modest),
              ElementsAre(AllOf(HasSubstr("TCP receive buffers"), HasSubstr("KB only, not 2097151:"),
                                HasSubstr("sysctl -w net.core.rmem_max=2147483647"))));
  EXPECT_THAT(warnings(0, greedy),
              ElementsAre(AllOf(HasSubstr("TCP send buffers"), HasSubstr("KB only, not 2097151:"),
                                HasSubstr("sysctl -w net.core.wmem_max=2147483647"))));
}

TEST_F(SendingTest, PollsTheDeviceWhenThatIsGrantedAndElseSaysSo) {
  NodeConfig config = quick(test::server_address);
  config.busy_poll = std::chrono::microseconds{50};
  const Node node{io, config, into(server_log)};
  const someip::UdpSocket socket{
      io, {.local = {test::server_address, 0}, .busy_poll = std::chrono::microseconds{50}}};
  const bool granted = socket.busy_poll() == std::chrono::microseconds{50};
  const auto told = static_cast<std::size_t>(
      std::ranges::count(server_log,
                         "the system does not poll the network device (SO_BUSY_POLL): it needs "
                         "CAP_NET_ADMIN"));
  EXPECT_EQ(told, granted ? 0U : 1U);
}

}  // namespace
}  // namespace trestle::sd::sending_test
