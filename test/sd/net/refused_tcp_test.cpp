// A subscription over TCP that the server refuses: is the connection still there? And one that it must not
// refuse.
#include "test/covers.hpp"
#include "test/sd/net/bare_peer.hpp"

namespace trestle::sd::refused_tcp_test {
namespace {

using test::covers;
using test::quick;
using namespace std::chrono_literals;

class RefusedTcpTest : public test::BarePeer {
 protected:
  static constexpr someip::MethodId event{0x8001};
};

TEST_F(RefusedTcpTest, ProbesTheConnectionAndMakesItAnew) {
  covers({"feat_req_someipsd_869", "feat_req_someip_647"});
  NodeConfig config = quick(test::client_address);
  config.tcp_retry_min = 10ms;
  Node client{io, config};
  client.subscribe(wanted, collect());
  send(offer);
  const auto subscribes = [this] { return count("060000101234000101000258"); };
  ASSERT_TRUE(run_until([&] { return subscribes() == 1; }));
  ASSERT_EQ(accepted, 1U);
  std::array<std::byte, 64> room{};
  std::size_t bytes = 0;
  connections.front().async_read_some(
      boost::asio::buffer(room),
      [&](const boost::system::error_code&, std::size_t received_bytes) { bytes = received_bytes; });
  run_for(30ms);
  EXPECT_EQ(bytes, 0U) << "an acknowledged or unanswered subscription asks for no probe";
  // SubscribeEventgroupNack, by unicast.
  const auto nack = test::hex(
      "ffff 8100 00000024 0000 0001 01 01 02 00 c0 000000"
      "00000010 07 00 00 00 1234 0001 01 000000 0000 0001 00000000");
  const ByteView view{nack};
  ASSERT_EQ(socket.send({test::client_address, sd_port}, {&view, 1}), someip::SendStatus::sent);
  ASSERT_TRUE(run_until([&] { return bytes != 0; }));
  EXPECT_EQ(test::to_hex(ByteView{room}.first(bytes)), "ffff000000000008deadbeef01010100");
  // Who knows nothing of the connection answers the probe with a reset.
  connections.front().set_option(boost::asio::socket_base::linger{true, 0});
  connections.front().close();
  ASSERT_TRUE(run_until([&] { return accepted == 2; })) << "connected anew";
  EXPECT_TRUE(run_until([&] { return subscribes() >= 2; })) << "and subscribed through it";
}

// A client connects and subscribes at once. Discovery is looked at first here, since something came there
// before.
TEST_F(RefusedTcpTest, IsNotOneWhoseConnectionWaitsToBeAccepted) {
  covers({"feat_req_someipsd_767", "feat_req_someipsd_1137"});
  Node server{io, quick(test::server_address)};
  const OfferHandle handle = server.offer({.service = ServiceId{0x1234},
                                           .instance = InstanceId{1},
                                           .tcp_port = 40231,
                                           .eventgroups = {{.id = EventgroupId{1}, .events = {event}}},
                                           .tcp_events = {event}});
  const Endpoint discovery{test::server_address, sd_port};
  const auto find = [&](const std::string& service) {
    send(discovery, answer_session++, "00 00 00 00" + service + "ffff ff 000258 ffffffff", "");
  };
  ASSERT_TRUE(run_until([&] {
    find("1234");
    return count("1234000101") != 0;
  })) << "it is offered";
  find("4321");
  boost::asio::ip::tcp::socket connection{io};
  connection.open(boost::asio::ip::tcp::v4());
  connection.bind({boost::asio::ip::make_address(someip::to_string(test::other_address)), 40232});
  connection.connect({boost::asio::ip::make_address(someip::to_string(test::server_address)), 40231});
  const auto address = test::to_hex(std::as_bytes(std::span{test::other_address.bytes})).substr(0, 8);
  send(discovery, answer_session++, "06 00 00 10 1234 0001 01 000258 0000 0001",
       "0009 04 00" + address + "00 06 9d28");
  ASSERT_TRUE(run_until([&] { return count("0700") != 0; }));
  EXPECT_EQ(count("07000000123400010100025800000001"), 1U) << "an Ack";
  EXPECT_EQ(server.subscribers(handle, event), 1U);
}

}  // namespace
}  // namespace trestle::sd::refused_tcp_test
