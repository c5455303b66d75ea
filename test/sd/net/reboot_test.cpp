// TCP connections when one end was started anew without closing them: as after a crash of the whole machine.
#include <boost/asio/connect.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "test/covers.hpp"
#include "test/sd/net/bare_peer.hpp"

namespace trestle::sd::reboot_test {
namespace {

using someip::Message;
using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::Contains;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

class RebootTest : public test::BarePeer {
 protected:
  /// A connection of ours to the Node.
  struct Client {
    boost::asio::ip::tcp::socket socket;
    std::array<char, 64> room{};
    std::size_t received = 0;
    bool closed = false;
    void read() {
      socket.async_read_some(boost::asio::buffer(room),
                             [this](const boost::system::error_code& error, std::size_t bytes) {
                               received += bytes;
                               closed = bool{error};
                               if (!closed) {
                                 read();
                               }
                             });
    }
  };
  std::unique_ptr<Client> connect(const IpAddress& to, std::uint16_t port) {
    namespace ip = boost::asio::ip;
    auto client = std::make_unique<Client>(Client{ip::tcp::socket{io}});
    client->socket.open(ip::tcp::v4());
    client->socket.bind({ip::make_address(someip::to_string(test::other_address)), 0});
    client->socket.connect({ip::make_address(someip::to_string(to)), port});
    client->read();
    return client;
  }

  static constexpr const char* find = "00 00 00 00 9999 ffff ff 000003 ffffffff";
};

TEST_F(RebootTest, OfAClientEndsItsConnectionsToUs) {
  covers({"feat_req_someipsd_872"});
  Node server{io, quick(test::server_address), into(server_log)};
  constexpr std::uint16_t port = 40231;
  server.offer(
      {.service = ServiceId{0x1234},
       .instance = InstanceId{1},
       .udp_port = {},
       .tcp_port = port,
       .methods = {{MethodId{1}, [](const Message&, Responder responder) { responder.respond(); }}}});
  const auto first = connect(test::server_address, port);
  const auto second = connect(test::server_address, port);
  ASSERT_TRUE(run_until([&] { return server.tcp_server_counters().open == 2; }));
  send(find);
  send(find);
  ASSERT_TRUE(run_until([&] { return server.discovery_counters().messages_received == 2; }));
  // Its new life connects before it says anything.
  const auto third = connect(test::server_address, port);
  ASSERT_TRUE(run_until([&] { return server.tcp_server_counters().open == 3; }));
  session = 1;
  send(find);
  EXPECT_TRUE(run_until([&] { return first->closed && second->closed; }));
  EXPECT_EQ(server.tcp_server_counters().open, 1U);
  EXPECT_THAT(server_log, Contains(HasSubstr("has restarted")));
  const auto request = test::hex("1234 0001 00000008 0001 0001 01 01 00 00");
  boost::asio::write(third->socket, boost::asio::buffer(request));
  EXPECT_TRUE(run_until([&] { return third->received == 16; }));
  EXPECT_FALSE(third->closed);
}

TEST_F(RebootTest, OfTheServerMakesUsConnectAndSubscribeAnew) {
  covers({"feat_req_someipsd_872", "feat_req_someipsd_871", "feat_req_someip_326"});
  Node client{io, quick(test::client_address)};
  client.subscribe(wanted, collect());
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  send(offer);
  ASSERT_TRUE(run_until([&] { return count("06000010123400010100") == 1; }));
  EXPECT_EQ(accepted, 1U);
  client.call(service, {.method = MethodId{1}, .timeout = 1h}, {}, note());
  send(find);  // else its first message would come twice
  session = 1;
  send(offer);
  ASSERT_TRUE(run_until([&] { return count("06000010123400010100") == 2; }));
  EXPECT_EQ(accepted, 2U);
  EXPECT_EQ(client.tcp_client_counters().connections, 2U);
  EXPECT_EQ(connections.front().available(), 16U) << "the request, and nothing more";
  std::array<char, 32> room{};
  boost::system::error_code end;
  boost::asio::read(connections.front(), boost::asio::buffer(room), end);
  EXPECT_EQ(end, boost::asio::error::eof);
  ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
  EXPECT_EQ(outcomes[0].fault, CallFault::timed_out) << "nobody answers it any more";
}

}  // namespace
}  // namespace trestle::sd::reboot_test
