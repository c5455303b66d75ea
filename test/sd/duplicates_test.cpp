// Networks that bring a message twice.
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::duplicates_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class DuplicatesAtAServer : public Server {
 protected:
  void SetUp() override { offer(udp_service); }
  [[nodiscard]] const SdCounters& counters() const { return machine.discovery.counters(); }
  void bring(const std::vector<std::byte>& datagram) { machine.receive(datagram, client_sd, false); }
};

TEST_F(DuplicatesAtAServer, AreNoReboots) {
  covers({"feat_req_someipsd_863", "feat_req_someipsd_764"});
  for (int i = 0; i < 12; ++i) {
    const auto datagram = client.unicast({subscribe(1, {udp(client_udp)})});
    bring(datagram);
    EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
    machine.now += 1ms;
    bring(datagram);
    EXPECT_THAT(machine.sent(), IsEmpty()) << "is answered once";
    machine.now += 1s;
  }
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added")));
  EXPECT_EQ(counters().reboots_detected, 0U);
  EXPECT_EQ(counters().dropped_duplicates, 12U);
}

// As from a second path through the network, which is slower than the first one.
TEST_F(DuplicatesAtAServer, MayComeBehindWhatWasSentAfterThem) {
  bring(client.unicast({find(0x1234)}));
  std::vector<std::vector<std::byte>> datagrams;
  for (std::uint16_t group = 1; group <= 2; ++group) {
    datagrams.push_back(client.unicast({subscribe(group, {udp(client_udp)})}));
    datagrams.push_back(client.unicast({find(0x1234)}));
  }
  for (int path = 0; path < 2; ++path) {
    for (const auto& datagram : datagrams) {
      bring(datagram);
    }
    machine.now += 3ms;
  }
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added"), HasSubstr("added")));
  EXPECT_EQ(counters().reboots_detected, 0U);
  EXPECT_EQ(counters().dropped_duplicates, 4U);
}

TEST_F(DuplicatesAtAServer, AreNoneWithAnotherContentOrOnAnotherWay) {
  covers({"feat_req_someipsd_765"});
  bring(client.unicast({find(0x9999)}));
  client.reboot();
  const auto find_it = client.unicast({find(0x1234)});
  bring(find_it);
  EXPECT_EQ(counters().reboots_detected, 1U) << "the same session with other content";
  machine.receive(find_it, client_sd, true);
  EXPECT_EQ(counters().dropped_duplicates, 0U) << "by multicast peers count apart";
  EXPECT_EQ(counters().reboots_detected, 1U);
}

TEST_F(DuplicatesAtAServer, AreNoneLongAfter) {
  covers({"feat_req_someipsd_871"});
  const auto datagram = client.unicast({subscribe(1, {udp(client_udp)})});
  bring(datagram);
  machine.events();
  machine.run_to(200ms + 499ms);
  bring(datagram);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.run_to(200ms + 500ms);
  bring(datagram);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("rebooted"), HasSubstr("added")));
}

// It is known by whatever differs, or comes after what went before.
TEST_F(DuplicatesAtAServer, DoNotHideARebootThatHasMoreToSay) {
  covers({"feat_req_someipsd_764"});
  for (int i = 0; i < 2; ++i) {
    bring(client.unicast({find(0x1234)}));
    machine.now += 10ms;
  }
  client.reboot();
  bring(client.unicast({find(0x1234)}));
  EXPECT_EQ(counters().reboots_detected, 1U) << "session 1 after 2";
}

TEST_F(DuplicatesAtAServer, AreNotLookedForWithoutAWindowOrASession) {
  Settings settings = fixed_settings();
  settings.duplicate_window = {};
  Machine<> other{settings};
  const auto datagram = client.unicast({find(0x1234)});
  other.receive(datagram, client_sd, false);
  other.receive(datagram, client_sd, false);
  EXPECT_EQ(other.discovery.counters().reboots_detected, 1U);
  auto uncounted = datagram;
  uncounted[10] = uncounted[11] = std::byte{0};
  bring(uncounted);
  bring(uncounted);
  EXPECT_EQ(counters().dropped_duplicates, 0U);
  EXPECT_EQ(counters().messages_received, 2U);
}

class DuplicatesAtAClient : public Client {};

TEST_F(DuplicatesAtAClient, CostNoSubscription) {
  covers({"feat_req_someipsd_863"});
  subscribed();
  for (int i = 0; i < 12; ++i) {
    for (const auto& datagram : {server.unicast({offer({udp(server_udp)})}), server.unicast({ack(1)})}) {
      machine.receive(datagram, server_sd, false);
      machine.receive(datagram, server_sd, false);
    }
    machine.sent();
    machine.now += 1s;
  }
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().reboots_detected, 0U);
  EXPECT_EQ(machine.discovery.counters().dropped_duplicates, 24U);
}

}  // namespace
}  // namespace trestle::sd::duplicates_test
