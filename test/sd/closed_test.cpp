// The core without guards, for a closed network: a full table refuses who comes next, and counts that.
#include <gmock/gmock.h>

#include <algorithm>

#include "someip/core/guards.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"
#include "test/someip/tp_slots.hpp"

namespace trestle::sd::closed_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

static_assert(!guards, "this program is to be built without");

constexpr Limits small{.max_offers = 1,
                       .max_eventgroups = 1,
                       .max_subscribers = 2,
                       .max_requirements = 1,
                       .max_subscriptions = 1,
                       .max_remote_services = 1,
                       .max_peers = 2,
                       .max_tcp_connections = 1,
                       .max_pending_entries = 32,
                       .max_pending_events = 16};
constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}};
constexpr OfferedService service{.service = ServiceId{0x1234},
                                 .instance = InstanceId{0x5678},
                                 .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                 .eventgroups = groups};

class Closed : public testing::Test {
 protected:
  void offer() { ASSERT_TRUE(machine.discovery.offer(service, machine.now)); }
  [[nodiscard]] std::uint64_t reached(Limit limit) const {
    return machine.discovery.counters().limits_reached[static_cast<std::size_t>(limit)];
  }
  Machine<small> machine;
};

TEST_F(Closed, RefusesTheSubscriberTooMany) {
  covers({"feat_req_someipsd_1137"});
  offer();
  FakePeer first{host(2)};
  FakePeer second{host(3)};
  machine.unicast(first, {subscribe(1, {udp(host(2, 1))}, infinite_ttl_s)});
  machine.unicast(first, {subscribe(1, {udp(host(2, 2))}, infinite_ttl_s)});
  EXPECT_THAT(machine.events(), SizeIs(2));
  machine.run_to(60s);  // who is silent keeps its places
  machine.sent();
  machine.unicast(second, {subscribe(1, {udp(host(3, 1))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack")));
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(Limit::subscribers), 1U);
  EXPECT_EQ(machine.discovery.counters().displaced, 0U);
  machine.unicast(first, {subscribe(1, {udp(host(2, 1))}, 0)});
  machine.unicast(second, {subscribe(1, {udp(host(3, 1))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
}

// max_peers and one more place, which with guards is that of guests.
TEST_F(Closed, CountsThePeerTooManyAndForgetsThoseThatHaveNothingHere) {
  offer();
  machine.run_to(200ms);
  std::vector<FakePeer> peers;
  for (std::uint8_t number = 2; number <= 5; ++number) {
    peers.emplace_back(host(number));
  }
  machine.unicast(peers[0], {subscribe(1, {udp(host(2, 1))})});
  machine.unicast(peers[1], {subscribe(1, {udp(host(3, 1))})});
  machine.unicast(peers[2], {find(0x1234)});
  machine.sent();
  machine.unicast(peers[3], {find(0x1234)});  // in the place of the one before
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("offer")));
  EXPECT_EQ(reached(Limit::peers), 0U);
}

TEST_F(Closed, RefusesTheServiceTooMany) {
  FakePeer first{host(2)};
  FakePeer second{host(3)};
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  const auto offered = [](std::uint8_t number) { return test::offer({udp(host(number, 30509))}); };
  machine.unicast(first, {offered(2)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
  auto other = offered(3);
  other.entry.instance = InstanceId{0x5679};
  machine.unicast(second, {other});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(Limit::remote_services), 1U);
}

TEST_F(Closed, LetsARebootWaitUntilThereIsRoomToTellWhatItEnds) {
  offer();
  machine.run_to(200ms);
  FakePeer peer{host(2)};
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  machine.unicast(peer, {subscribe(1, {udp(host(2, 2))})});  // whose events are not fetched yet
  peer.reboot();
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  EXPECT_EQ(reached(Limit::pending_events), 1U);
  EXPECT_THAT(machine.events(), SizeIs(2));
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  EXPECT_THAT(machine.events(),
              ElementsAre(HasSubstr("rebooted"), HasSubstr("rebooted"), HasSubstr("added")));
  EXPECT_EQ(machine.discovery.counters().lost_events, 0U);
}

TEST_F(Closed, TakesEntriesAndRebootsAtAnyRate) {
  offer();
  machine.run_to(200ms);
  machine.sent();
  FakePeer peer{host(2)};
  for (int i = 0; i < 100; ++i) {
    peer.reboot();
    machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
    machine.events();
    machine.sent();
  }
  EXPECT_EQ(machine.discovery.counters().reboots_detected, 99U);
  EXPECT_EQ(machine.discovery.counters().dropped_reboots, 0U);
}

// A segment of 16 bytes that all have the number of the segment.
std::array<std::byte, 4 + 16> segment_bytes(std::uint8_t number, bool more) {
  std::array<std::byte, 4 + 16> bytes{};
  bytes.fill(std::byte{number});
  const std::array offset{std::byte{}, std::byte{}, std::byte{},
                          static_cast<std::byte>(16 * number + (more ? 1 : 0))};
  std::ranges::copy(offset, bytes.begin());
  return bytes;
}

class ClosedTp : public testing::Test {
 protected:
  auto offer(const Endpoint& from, std::uint16_t event, std::uint8_t number, bool more, TimePoint now) {
    const auto bytes = segment_bytes(number, more);
    return tp.on_segment(from,
                         someip::Message{.header = {.service = ServiceId{1},
                                                    .method = someip::MethodId{event},
                                                    .session = someip::SessionId{1},
                                                    .type = someip::MessageType::tp_notification},
                                         .payload = bytes},
                         now);
  }
  TpSlots slots{1, 64};
  someip::TpReassembler tp{slots.slots(), {.max_message_bytes = 64, .max_per_sender = 1, .max_age = 5s}};
};

TEST_F(ClosedTp, PutsSegmentsTogetherThatComeInAnyOrder) {
  covers({"feat_req_someiptp_789", "feat_req_someiptp_820", "feat_req_someiptp_790"});
  for (const std::uint8_t number : std::array<std::uint8_t, 3>{2, 0, 3}) {
    const auto part = offer(host(2), 0x8001, number, number != 3, TimePoint{1s});
    ASSERT_TRUE(part);
    EXPECT_FALSE(*part);
  }
  const auto whole = offer(host(2), 0x8001, 1, true, TimePoint{1s});
  ASSERT_TRUE(whole);
  ASSERT_TRUE(*whole);
  ASSERT_THAT((*whole)->payload, SizeIs(64));
  for (std::size_t at = 0; at < 64; ++at) {
    EXPECT_EQ((*whole)->payload[at], static_cast<std::byte>(at / 16)) << at;
  }
}

TEST_F(ClosedTp, RefusesTheMessageTooManyHoweverSlowTheOthersAre) {
  ASSERT_TRUE(offer(host(2), 0x8001, 0, true, TimePoint{1s}));
  const auto other = offer(host(3), 0x8002, 0, true, TimePoint{4s});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error(), someip::TpDrop::no_slot);
  const auto own = offer(host(2), 0x8003, 0, true, TimePoint{4s});
  ASSERT_FALSE(own);
  EXPECT_EQ(own.error(), someip::TpDrop::too_many_from_sender);
}

}  // namespace
}  // namespace trestle::sd::closed_test
