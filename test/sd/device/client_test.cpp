#include "test/sd/device/fixture.hpp"

namespace trestle::test::client_test {
namespace {

using device::Error;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::uint16_t client_port = 30600;
constexpr Endpoint client_at{own.address, client_port};
constexpr Endpoint server_at{peer_at.address, 30509};

/// A device that needs service 1234.5678 of a peer, and its eventgroup 1.
class DeviceClient : public testing::Test {
 protected:
  static constexpr device::Limits limits{
      .services = 0, .needs = 1, .subscriptions = 1, .remote_services = 2, .calls = 2};

  DeviceClient() { EXPECT_TRUE(device().require(0, rig.now)); }

  static device::Settings settings() {
    static constexpr std::array events{MethodId{0x8001}};
    static constexpr std::array subscriptions{
        device::Subscription{.eventgroup = EventgroupId{1}, .events = events}};
    static constexpr std::array needs{device::Need{.service = ServiceId{0x1234},
                                                   .instance = InstanceId{0x5678},
                                                   .port = client_port,
                                                   .subscriptions = subscriptions}};
    device::Settings settings = device_settings();
    settings.needs = needs;
    settings.client = someip::ClientId{0x0102};
    return settings;
  }
  device::Device& device() { return rig.device(); }

  void find_server() {
    rig.run_for(10ms);
    rig.receive(peer.multicast({test::offer({udp(server_at)}, 100)}), peer_at, group);
    rig.run_for(10ms);
    rig.receive(peer.unicast({test::ack(1, {}, 100)}), peer_at, own);
    rig.discovery.clear();
    rig.happenings.clear();
  }
  void from_server(std::string_view digits, const std::function<void(const Happening&)>& happened = {}) {
    rig.receive(hex(digits), server_at, client_at, happened);
  }

  Rig<limits> rig{settings()};
  FakePeer peer{peer_at};
};

TEST_F(DeviceClient, FindsAServiceAndSubscribes) {
  covers({"feat_req_someipsd_18", "feat_req_someipsd_428"});
  rig.run_for(10ms);
  EXPECT_THAT(rig.take_discovery(),
              ElementsAre("224.244.224.245:30490 < s1 reboot: find 1234.5678 v1.* ttl 3"));
  EXPECT_FALSE(device().available(0));
  EXPECT_EQ(device().call(0, MethodId{1}, {}, 1s, rig.now).error(), Error::unavailable);
  rig.receive(peer.multicast({test::offer({udp(server_at)})}), peer_at, group);
  rig.run_for(10ms);
  EXPECT_TRUE(device().available(0));
  EXPECT_THAT(rig.happenings, ElementsAre(place_of<device::ServiceAvailable>()));
  EXPECT_THAT(rig.take_discovery(),
              ElementsAre("10.0.0.2:30490 < s1 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                          "initial udp 10.0.0.1:30600"));
  rig.receive(peer.unicast({test::ack(1)}), peer_at, own);
  EXPECT_EQ(rig.happenings.back(), place_of<device::Subscribed>());
  rig.run_for(10s);  // no more offers come
  EXPECT_THAT(rig.happenings,
              testing::IsSupersetOf({place_of<device::SubscriptionLost>(), place_of<device::ServiceLost>()}));
  EXPECT_FALSE(device().available(0));
}

TEST_F(DeviceClient, TellsOfEventsFromItsServerOnly) {
  covers({"feat_req_someip_683"});
  find_server();
  std::string got;
  const auto note = [&](const Happening& what) {
    const auto& event = std::get<device::EventReceived>(what);
    EXPECT_EQ(event.need, 0U);
    EXPECT_EQ(event.subscription, 0U);
    got += to_hex(event.payload);
  };
  from_server("1234 8001 0000000a 0000 0001 01 01 02 00 cafe", note);
  EXPECT_EQ(got, "cafe");
  rig.receive(hex("1234 8001 0000000a 0000 0001 01 01 02 00 bad0"), other_peer_udp, client_at, note);
  EXPECT_EQ(device().counters().unknown_sender, 1U);
  from_server("1234 8001 0000000a 0000 0001 01 02 02 00 bad1", note);
  EXPECT_EQ(device().counters().wrong_version, 1U);
  from_server("1234 8001 0000000a 0000 0001 01 01 02 01 bad2", note);
  EXPECT_EQ(device().counters().bad_return_code, 1U);
  from_server("1234 8002 0000000a 0000 0001 01 01 02 00 bad3", note);  // not among those wanted
  rig.receive(hex("1234 8001 0000000a 0000 0001 01 01 02 00 bad4"), server_at, {own.address, 1}, note);
  EXPECT_EQ(device().counters().unexpected, 2U);
  EXPECT_EQ(got, "cafe");
  EXPECT_EQ(device().counters().events, 1U);
}

TEST_F(DeviceClient, PutsALargeEventTogether) {
  covers({"feat_req_someiptp_784"});
  find_server();
  const auto payload = pattern(32);
  from_server("1234 8001 0000001c 0000 0001 01 01 22 00 00000001" + to_hex(ByteView{payload}.first(16)));
  EXPECT_THAT(rig.happenings, IsEmpty());
  std::string got;
  from_server("1234 8001 0000001c 0000 0001 01 01 22 00 00000010" + to_hex(ByteView{payload}.subspan(16)),
              [&](const Happening& what) { got = to_hex(std::get<device::EventReceived>(what).payload); });
  EXPECT_EQ(got, to_hex(payload));
}

TEST_F(DeviceClient, CallsAndTellsTheAnswer) {
  covers({"feat_req_someip_329", "feat_req_someip_79", "feat_req_someip_107"});
  find_server();
  const auto call = device().call(0, MethodId{0x0007}, hex("1122"), 1s, rig.now);
  ASSERT_TRUE(call);
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("30509 < 1234"
                                           "0007"
                                           "0000000a"
                                           "01020001"
                                           "01010000"
                                           "1122"));
  std::string got;
  from_server("1234 0007 00000009 0102 0001 01 01 80 00 5a", [&](const Happening& what) {
    const auto& end = std::get<device::CallEnded>(what);
    EXPECT_EQ(end.call, *call);
    EXPECT_TRUE(end.answered);
    EXPECT_EQ(end.code, someip::ReturnCode::ok);
    got = to_hex(end.payload);
  });
  EXPECT_EQ(got, "5a");
  from_server("1234 0007 00000009 0102 0001 01 01 80 00 5a",  // once more
              [](const Happening&) { ADD_FAILURE() << "the call ends twice"; });
  EXPECT_EQ(device().calls()[someip::AnswerDrop::duplicate], 1U);
  ASSERT_TRUE(device().call(0, MethodId{0x0007}, {}, 1s, rig.now));
  someip::ReturnCode code{};
  from_server("1234 0007 00000008 0102 0002 01 01 81 20",
              [&](const Happening& what) { code = std::get<device::CallEnded>(what).code; });
  EXPECT_EQ(code, someip::ReturnCode{0x20});
}

TEST_F(DeviceClient, EndsCallsThatAreNotAnswered) {
  covers({"feat_req_someip_436"});
  find_server();
  const auto first = device().call(0, MethodId{1}, {}, 50ms, rig.now);
  const auto second = device().call(0, MethodId{1}, {}, 50ms, rig.now);
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  EXPECT_EQ(device().call(0, MethodId{1}, {}, 50ms, rig.now).error(), Error::table_full);
  EXPECT_TRUE(device().cancel(*second));
  EXPECT_FALSE(device().cancel(*second));
  std::vector<TimePoint> ends;
  rig.run_for(1s, [&](const Happening& what) {
    const auto& end = std::get<device::CallEnded>(what);
    EXPECT_EQ(end.call, *first);
    EXPECT_FALSE(end.answered);
    ends.push_back(rig.now);
  });
  EXPECT_THAT(ends, SizeIs(1));
  from_server("1234 0001 00000008 0102 0001 01 01 80 00");
  EXPECT_EQ(device().calls()[someip::AnswerDrop::late], 1U);
}

TEST_F(DeviceClient, SendsFireAndForget) {
  find_server();
  ASSERT_TRUE(device().tell(0, MethodId{0x0009}, hex("77")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("30509 < 1234"
                                           "0009"
                                           "00000009"
                                           "01020001"
                                           "01010100"
                                           "77"));
}

TEST_F(DeviceClient, EndsItsSubscriptionsWhenItNeedsTheServiceNoMore) {
  covers({"feat_req_someipsd_433"});
  find_server();
  device().release(0, rig.now);
  rig.poll();
  EXPECT_THAT(
      rig.take_discovery(),
      ElementsAre("10.0.0.2:30490 < s2 reboot: stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 "
                  "udp 10.0.0.1:30600"));
  EXPECT_FALSE(device().available(0));
  from_server("1234 8001 0000000a 0000 0001 01 01 02 00 cafe",
              [](const Happening&) { ADD_FAILURE() << "an event without subscription"; });
  EXPECT_TRUE(device().require(0, rig.now));
  EXPECT_EQ(device().require(0, rig.now).error(), Error::duplicate);
  EXPECT_EQ(device().require(1, rig.now).error(), Error::bad_argument);
}

TEST_F(DeviceClient, LosesItAllWithTheLinkAndFindsItAgain) {
  covers({"feat_req_someipsd_437", "feat_req_someipsd_440"});
  find_server();
  device().link_down();
  rig.poll();
  EXPECT_THAT(rig.happenings, testing::UnorderedElementsAre(place_of<device::SubscriptionLost>(),
                                                            place_of<device::ServiceLost>()));
  rig.discovery.clear();
  device().link_up(rig.now);
  rig.run_for(10ms);
  EXPECT_THAT(rig.take_discovery(),
              ElementsAre("224.244.224.245:30490 < s2 reboot: find 1234.5678 v1.* ttl 3"));
}

TEST_F(DeviceClient, StopsEverythingAtShutdown) {
  covers({"feat_req_someipsd_821"});
  find_server();
  device().shutdown(rig.now);
  rig.poll();
  EXPECT_THAT(rig.take_discovery(), SizeIs(1));
  from_server("1234 8001 0000000a 0000 0001 01 01 02 00 cafe");
  EXPECT_EQ(device().counters().unexpected, 1U);
  EXPECT_FALSE(device().deadline());
}

}  // namespace
}  // namespace trestle::test::client_test
