// A Node against a peer of bare sockets, whose messages are written out.
#include "test/sd/net/bare_peer.hpp"
#include "test/covers.hpp"

namespace trestle::sd {
namespace {

using test::covers;
using test::quick;
using namespace std::chrono_literals;

class BarePeerTest : public test::BarePeer {};

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
