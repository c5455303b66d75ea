// Trestle and vsomeip find, offer, subscribe, refuse and withdraw.
#include <map>

#include "someip/net/udp_socket.hpp"
#include "test/interop/vsomeip/vsomeip_test.hpp"

namespace trestle::interop {
namespace {

using ::testing::ElementsAre;

/// Notes when who offers a service by multicast.
class OfferTimes {
 public:
  explicit OfferTimes(boost::asio::io_context& io)
      : socket_{io,
                {.local = {IpAddress::v4(224, 244, 224, 245), 30490},
                 .join = IpAddress::v4(224, 244, 224, 245),
                 .interface = {{Namespaces::own, ""}},
                 .sharing = someip::PortSharing::shared}} {
    socket_.receive([this](ByteView datagram, const Endpoint& from) {
      constexpr std::size_t first_entry = 24;
      if (datagram.size() > first_entry && datagram[first_entry] == std::byte{1}) {
        of_[from.address].push_back(std::chrono::steady_clock::now());
      }
    });
  }
  [[nodiscard]] std::size_t count(const IpAddress& from) { return of_[from].size(); }
  [[nodiscard]] std::vector<std::int64_t> gaps_ms(const IpAddress& from) {
    std::vector<std::int64_t> result;
    const auto& times = of_[from];
    for (std::size_t i = 1; i < times.size(); ++i) {
      result.push_back(
          std::chrono::duration_cast<std::chrono::milliseconds>(times[i] - times[i - 1]).count());
    }
    return result;
  }

 private:
  someip::UdpSocket socket_;
  std::map<IpAddress, std::vector<std::chrono::steady_clock::time_point>> of_;
};

TEST_F(VsomeipTest, OffersInTheSameRhythm) {
  covers({"feat_req_someipsd_73", "feat_req_someipsd_76", "feat_req_someipsd_80"});
  sd::NodeConfig config = node_config();
  config.timing.initial_delay_min = 10ms;
  config.timing.initial_delay_max = 50ms;
  config.timing.repetitions_base_delay = 50ms;
  config.timing.repetitions_max = 3;
  config.timing.cyclic_offer_delay = 1s;
  const auto about = [](std::int64_t wanted) {  // a busy machine makes an offer late, never early
    return ::testing::AllOf(::testing::Ge(wanted - 45), ::testing::Le(wanted + 90));
  };
  const auto our_rhythm = ElementsAre(about(50), about(100), about(200), about(1000), about(1000));
  // vsomeip waits on, 400 ms and 1.2 s, before it comes to its cycle.  [docs/interop.md]
  const auto their_rhythm = ElementsAre(about(50), about(100), about(200));
  std::vector<std::int64_t> ours;
  std::vector<std::int64_t> theirs;
  const auto in_time = [&] {
    return ::testing::Matches(our_rhythm)(ours) && ::testing::Matches(their_rhythm)(theirs);
  };
  for (int tries = 0; tries < 10 && !in_time(); ++tries) {  // until the machine lets both be in time
    node.reset();
    peer.reset();
    OfferTimes times{io};
    start_node(config);
    node->offer({.service = ServiceId{0x4712}, .instance = InstanceId{1}});
    start_peer("service");
    ASSERT_TRUE(
        run_until([&] { return times.count(Namespaces::own) >= 6 && times.count(Namespaces::peer) >= 6; }));
    ours = times.gaps_ms(Namespaces::own);
    ours.resize(5);
    theirs = times.gaps_ms(Namespaces::peer);
    theirs.resize(3);
  }
  EXPECT_THAT(ours, our_rhythm);
  EXPECT_THAT(theirs, their_rhythm);
}

TEST_F(VsomeipTest, AnswersOurFindThoughItDoesNotOfferByItself) {
  covers({"feat_req_someipsd_824"});
  peer_cycle = 60s;
  OfferTimes times{io};
  start_peer("service");
  ASSERT_TRUE(run_until([&] { return times.count(Namespaces::peer) == 5; })) << "all repetitions";
  start_node();
  const auto required = node->require({ServiceId{service}, InstanceId{instance}, major_version});
  EXPECT_TRUE(run_until([&] { return !node->available(required).empty(); }, 30s)) << log;
  EXPECT_EQ(times.count(Namespaces::peer), 5U) << "by unicast alone";
}

class VsomeipFinds : public VsomeipUses {
 protected:
  VsomeipFinds() { our_cycle = 0s; }
};

TEST_F(VsomeipFinds, OurServiceThoughWeDoNotOfferByOurselves) {
  covers({"feat_req_someipsd_824", "feat_req_someipsd_79"});
  static_cast<void>(run_until([] { return false; }, 500ms));  // until all repetitions are over
  OfferTimes times{io};
  peer->kill();
  start_peer("client");
  EXPECT_TRUE(prints("available"));
  EXPECT_EQ(times.count(Namespaces::own), 0U) << "by unicast alone";
}

TEST_F(VsomeipServes, NoEventgroupThatItDoesNotHave) {
  const auto unknown = subscribe(0x0099, event_udp);
  const auto known = subscribe(group_udp, event_udp);
  ASSERT_TRUE(run_until([&] { return node->subscribed(known); }));
  EXPECT_TRUE(run_until([&] { return log.find("0x0099 of 0x4711.0x0001 refused") != log.npos; })) << log;
  EXPECT_FALSE(node->subscribed(unknown));
}

TEST_F(VsomeipUses, NoEventgroupThatWeDoNotHave) {
  covers({"feat_req_someipsd_1137"});
  tell_to_subscribe(0x0099, 0x8099, "udp event");
  EXPECT_TRUE(run_until([&] { return node->discovery_counters().nacks_sent > 0; }));
  subscribe(group_udp, event_udp, "udp event");
  EXPECT_EQ(peer->count("acknowledged 153 0 "), 0U);
}

TEST_F(VsomeipServes, UntilWeUnsubscribe) {
  for (const Events& one : {over_udp, over_tcp, by_multicast}) {
    const auto subscription = subscribe(one.group, one.event, one.group == group_tcp);
    ASSERT_TRUE(prints("subscribed " + std::to_string(one.group)));
    ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
    node->unsubscribe(subscription);
    EXPECT_TRUE(prints("unsubscribed " + std::to_string(one.group)));
  }
}

TEST_F(VsomeipUses, UntilItUnsubscribes) {
  for (const Events& one : {over_udp, over_tcp, by_multicast}) {
    subscribe(one.group, one.event, one.how);
    peer->tell("unsubscribe " + std::to_string(one.group));
    EXPECT_TRUE(run_until([&] { return node->subscribers(offer, MethodId{one.event}) == 0; }));
  }
}

TEST_F(VsomeipServes, AndIsFoundAgainAfterItWithdrewTheService) {
  const auto subscription = subscribe(group_udp, event_udp);
  ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
  peer->tell("withdraw");
  ASSERT_TRUE(run_until([&] { return node->available(required).empty(); }));
  EXPECT_FALSE(node->subscribed(subscription));
  EXPECT_EQ(call(echo, Transport::udp, {}).fault, CallFault::unavailable);
  peer->tell("offer");
  ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
  EXPECT_EQ(call(echo, Transport::tcp, {1}).payload, to_bytes({1}));
  emit_event(event_udp, 10);
  EXPECT_TRUE(run_until([&] { return !events.empty(); }));
}

TEST_F(VsomeipUses, ServicesUntilTheyAreWithdrawn) {
  subscribe(group_udp, event_udp, "udp event");
  node->withdraw(offer);
  EXPECT_TRUE(prints("gone"));
  serve();
  EXPECT_TRUE(prints("available", 2));
  EXPECT_TRUE(run_until([&] { return node->subscribers(offer, MethodId{event_udp}) == 1; }));
  peer->tell("call 1 tcp 7");
  EXPECT_TRUE(prints(answer(echo, 0, 7)));
  node->shutdown();
  EXPECT_TRUE(prints("gone", 2));
}

}  // namespace
}  // namespace trestle::interop
