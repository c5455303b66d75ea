// A Node against a peer of bare sockets, whose messages are written out.
#include "test/sd/net/bare_peer.hpp"
#include "test/covers.hpp"

namespace trestle::sd::bare_peer_test {
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
               "01000258") >= 1;
  })) << "connected, subscribed";
  EXPECT_EQ(accepted, 1U);
  const std::size_t before = count(
      "06000010"
      "12340001"
      "01000258");
  send(std::string{stop} + offer);
  ASSERT_TRUE(run_until([&] {
    return count(
               "06000010"
               "12340001"
               "01000258") > before;
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

TEST_F(BarePeerTest, SeesTheTimesToLiveOfOffersAndSubscriptions) {
  covers({"feat_req_someipsd_253", "feat_req_someipsd_322"});
  Node node{io, quick(test::client_address)};  // whose own TTL is 600 s
  const auto give = [&](std::uint16_t service, std::optional<std::uint32_t> ttl_s) {
    node.offer({.service = ServiceId{service}, .instance = InstanceId{1}, .ttl_s = ttl_s});
  };
  give(0x2001, {});
  give(0x2002, 0x012345);
  give(0x2003, infinite_ttl_s);
  const auto take = [&](std::uint16_t eventgroup, std::optional<std::uint32_t> ttl_s) {
    SubscribeSpec spec = wanted;
    spec.eventgroup = EventgroupId{eventgroup};
    spec.ttl_s = ttl_s;
    node.subscribe(spec, collect());
  };
  take(0x0001, {});
  take(0x0002, 0x012345);
  take(0x0003, infinite_ttl_s);
  // Type, no options twice, one option; service, instance, major, TTL; minor, or counter and eventgroup.
  const std::vector<std::string> entries{
      "01000010200100010100025800000000", "01000010200200010101234500000000",
      "010000102003000101ffffff00000000", "06000010123400010100025800800001",
      "06000010123400010101234500800002", "060000101234000101ffffff00800003"};
  // We do not hear their group, but they answer who asks.
  const std::string finds =
      "00000000 2001 ffff ff000003 ffffffff 00000000 2002 ffff ff000003 ffffffff"
      "00000000 2003 ffff ff000003 ffffffff";
  for (const std::string& entry : entries) {
    for (int tries = 0; tries < 100 && count(entry) == 0; ++tries) {
      send(finds + offer);
      run_for(20ms);
    }
    EXPECT_GE(count(entry), 1U) << entry;
  }
  // One eventgroup with two times to live is subscribed to twice, told apart by the counter.
  take(0x0001, 0x000777);
  send(offer);
  EXPECT_TRUE(run_until([&] { return count("06000010123400010100077700810001") >= 1; }));
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
                                                    "060000101234000101000258"))
      << "StopSubscribeEventgroup and SubscribeEventgroup in one message";
  run_for(50ms);
  EXPECT_EQ(accepted, 1U);
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
}

}  // namespace
}  // namespace trestle::sd::bare_peer_test
