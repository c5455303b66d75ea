// A Node against a peer of bare sockets, whose messages are written out.
#include <boost/asio/ip/tcp.hpp>
#include <deque>

#include "someip/net/address_text.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd {
namespace {

using boost::asio::ip::tcp;
using test::covers;
using test::quick;
using namespace std::chrono_literals;

constexpr std::uint16_t sd_port = 30490;
constexpr std::uint16_t tcp_port = 40230;

/// A server that speaks SD as it is told and accepts TCP connections.
class BarePeerTest : public test::TwoNodes {
 protected:
  void SetUp() override {
    socket.receive([this](ByteView datagram, const Endpoint&) {
      if (datagram.size() > 24) {
        received.push_back(test::to_hex(datagram));
      }
    });
    accept();
  }
  void accept() {
    connections.emplace_back(io);
    acceptor.async_accept(connections.back(), [this](const boost::system::error_code& error) {
      if (!error) {
        ++accepted;
        accept();
      }
    });
  }
  /// Multicasts entries that all refer to our TCP endpoint. No "explicit initial data" flag.
  void send(const std::string& entries) {
    const auto address = test::to_hex(std::as_bytes(std::span{test::other_address.bytes})).substr(0, 8);
    const std::string options = "0009 04 00" + address + "00 06 9d26";  // port 40230
    const auto entry_bytes = test::hex(entries);
    const auto length = static_cast<unsigned>(8 + 4 + 4 + entry_bytes.size() + 4 + 12);
    const auto number = [](std::size_t value, std::size_t digits) {
      std::string text(digits, '0');
      for (std::size_t i = digits; i-- > 0; value /= 16) {
        text[i] = "0123456789abcdef"[value % 16];
      }
      return text;
    };
    const auto message =
        test::hex("ffff 8100" + number(length, 8) + "0000" + number(session++, 4) + "01 01 02 00 c0 000000" +
                  number(entry_bytes.size(), 8) + entries + "0000000c" + options);
    const ByteView bytes{message};
    ASSERT_EQ(socket.send({test::own_group(), sd_port}, {&bytes, 1}), someip::SendStatus::sent);
  }
  /// How many messages hold an entry that begins so.
  [[nodiscard]] std::size_t count(const std::string& entry) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        received, [&](const std::string& one) { return one.find(entry) != std::string::npos; }));
  }

  static constexpr const char* offer = "01 00 00 10 1234 0001 01 000003 00000000";
  static constexpr const char* stop = "01 00 00 10 1234 0001 01 000000 00000000";
  someip::UdpSocket socket{io,
                           {.local = {test::other_address, sd_port},
                            .interface = someip::MulticastInterface{test::other_address},
                            .sharing = someip::PortSharing::by_address}};
  tcp::acceptor acceptor{io,
                         {boost::asio::ip::make_address(someip::to_string(test::other_address)), tcp_port}};
  std::deque<tcp::socket> connections;
  std::size_t accepted = 0;
  std::vector<std::string> received;
  std::size_t session = 1;
  const SubscribeSpec wanted{.service = ServiceId{0x1234},
                             .instance = InstanceId{1},
                             .eventgroup = EventgroupId{1},
                             .events = {someip::MethodId{0x8001}},
                             .udp = false,
                             .tcp = true};
};

TEST_F(BarePeerTest, KeepsTheConnectionWhenOneMessageStopsAndOffers) {
  covers({"feat_req_someipsd_1170", "feat_req_someipsd_862"});
  Node client{io, quick(test::client_address)};
  client.subscribe(wanted, collect());
  send(offer);
  ASSERT_TRUE(run_until([&] {
    return count(
               "06000010"
               "12340001"
               "01000001") >= 1;
  })) << "connected, subscribed";
  EXPECT_EQ(accepted, 1U);
  const std::size_t before = count(
      "06000010"
      "12340001"
      "01000001");
  send(std::string{stop} + offer);
  ASSERT_TRUE(run_until([&] {
    return count(
               "06000010"
               "12340001"
               "01000001") > before;
  })) << "anew";
  run_for(50ms);
  EXPECT_EQ(accepted, 1U);
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
  // Whereas a service that is gone needs none.
  send(stop);
  std::array<char, 1> byte{};
  bool closed = false;
  connections.front().async_read_some(boost::asio::buffer(byte), [&](const boost::system::error_code& end,
                                                                     std::size_t) { closed = bool{end}; });
  EXPECT_TRUE(run_until([&] { return closed; }));
}

TEST_F(BarePeerTest, KeepsTheConnectionWhenItSubscribesAnewForLackOfAnAnswer) {
  covers({"feat_req_someipsd_1171", "feat_req_someipsd_844"});
  Node client{io, quick(test::client_address)};
  client.subscribe(wanted, collect());
  send(offer);
  for (std::size_t answers = 1; answers <= 2; ++answers) {
    ASSERT_TRUE(run_until([&] { return received.size() >= answers; }));
    send(offer);
  }
  ASSERT_TRUE(run_until([&] { return received.size() >= 3; }));
  EXPECT_THAT(received.back(), ::testing::HasSubstr("06000010123400010100000000000001"
                                                    "060000101234000101000001"))
      << "StopSubscribeEventgroup and SubscribeEventgroup in one message";
  run_for(50ms);
  EXPECT_EQ(accepted, 1U);
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
}

}  // namespace
}  // namespace trestle::sd
