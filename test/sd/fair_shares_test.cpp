// Full tables: those who take much make room for those who have little, the silent for those who speak.
#include <gmock/gmock.h>

#include "sd/wire/message.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::fair_shares_test {
namespace {
using namespace test;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr Limits small{.max_offers = 2,
                       .max_eventgroups = 4,
                       .max_subscribers = 6,
                       .max_requirements = 2,
                       .max_subscriptions = 2,
                       .max_remote_services = 4,
                       .max_peers = 3,
                       .max_tcp_connections = 1,
                       .max_pending_entries = 32,
                       .max_pending_events = 32};
constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}, Eventgroup{.id = EventgroupId{2}}};
constexpr OfferedService service{.service = ServiceId{0x1234},
                                 .instance = InstanceId{0x5678},
                                 .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                 .eventgroups = groups};

template <Limits limits>
std::uint64_t reached(const Machine<limits>& machine, Limit limit) {
  return machine.discovery.counters().limits_reached[static_cast<std::size_t>(limit)];
}

// Clients that subscribe with each offer that they hear, as `renew` says.
template <typename AnyMachine, typename Renew>
void answer_offers(AnyMachine& machine, Duration time, const std::vector<FakePeer*>& clients, Renew renew) {
  for (const TimePoint end = machine.now + time; machine.now < end;) {
    for (const std::string& sent : machine.run_to(machine.now - start + 5ms)) {
      for (FakePeer* const client : clients) {
        const bool hears_it = sent.find("-> 224.244") != std::string::npos ||
                              sent.find("-> " + describe(client->endpoint()) + " ") != std::string::npos;
        if (hears_it && sent.find(": offer") != std::string::npos) {
          renew(*client);
        }
      }
    }
  }
  machine.events();
}

class FairShares : public testing::Test {
 protected:
  void SetUp() override {
    const auto handle = machine.discovery.offer(service, machine.now);
    ASSERT_TRUE(handle);
    machine.run_to(200ms);
  }
  // Subscribes from another port each time.
  void subscribe_often(FakePeer& peer, std::uint16_t eventgroup, std::uint16_t count,
                       std::uint32_t ttl_s = 3) {
    for (std::uint16_t port = 1; port <= count; ++port) {
      machine.unicast(peer, {subscribe(eventgroup, {udp({peer.endpoint().address, port})}, ttl_s)});
    }
  }
  // All of them have been heard for a second then, and are kept for two.
  void speak_again(std::vector<FakePeer>& peers) {
    machine.run_to(machine.now - start + 1s);
    for (FakePeer& peer : peers) {
      machine.unicast(peer, {find(0x9999)});
    }
    machine.sent();
    machine.events();
  }
  // As many as there is room for, each with a subscription, whose numbers begin with 2.
  std::vector<FakePeer> subscribed_peers(std::uint32_t ttl_s = 3) {
    std::vector<FakePeer> peers;
    for (std::uint8_t number = 2; number <= 4; ++number) {
      peers.emplace_back(host(number));
      machine.unicast(peers.back(), {subscribe(1, {udp(host(number, 1))}, ttl_s)});
    }
    return peers;
  }
  Machine<small> machine;
};

TEST_F(FairShares, LetANewcomerInWhereOneHostHasTakenAllPlaces) {
  covers({"feat_req_someipsd_1137"});
  FakePeer greedy{host(2)};
  subscribe_often(greedy, 1, 6, infinite_ttl_s);
  machine.events();
  machine.sent();
  FakePeer newcomer{host(3)};
  machine.unicast(newcomer, {subscribe(1, {udp(host(3, 1))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
  EXPECT_THAT(machine.events(),
              ElementsAre(AllOf(HasSubstr("removed"), HasSubstr("10.0.0.2"), HasSubstr("displaced")),
                          AllOf(HasSubstr("added"), HasSubstr("10.0.0.3"))));
  EXPECT_EQ(machine.discovery.counters().displaced, 1U);
  // The greedy one does not get the place back from one that has less.
  subscribe_often(greedy, 1, 6);
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(machine, Limit::subscribers), 1U);
  EXPECT_EQ(machine.discovery.counters().nacks_by_reason[static_cast<std::size_t>(NackReason::no_room)], 1U);
}

TEST_F(FairShares, CountByAddressNotByPort) {
  std::vector<FakePeer> greedy;
  for (std::uint16_t port = 1; port <= 3; ++port) {
    greedy.emplace_back(host(2, port));
    subscribe_often(greedy.back(), 1, 2);
  }
  answer_offers(machine, 4s, {&greedy[0], &greedy[1], &greedy[2]},
                [&](FakePeer& one) { subscribe_often(one, 1, 2); });
  FakePeer newcomer{host(3)};
  machine.unicast(newcomer, {subscribe(1, {udp(host(3, 1))})});  // a guest: all peers are in use
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(machine, Limit::peers), 1U);
}

TEST(FairSharesOfAnEventgroup, LeaveRoomForOtherAddresses) {
  Settings settings = fixed_settings();
  settings.max_subscribers_per_eventgroup = 4;
  settings.max_subscribers_per_eventgroup_and_address = 3;
  Machine<> machine{settings};
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer greedy{host(2)};
  for (std::uint16_t port = 1; port <= 4; ++port) {
    machine.unicast(greedy, {subscribe(1, {udp(host(2, port))})});
  }
  EXPECT_EQ(reached(machine, Limit::subscribers_per_eventgroup_and_address), 1U);
  FakePeer second{host(3)};
  FakePeer third{host(4)};
  FakePeer fourth{host(5)};
  FakePeer fifth{host(6)};
  machine.events();
  machine.unicast(second, {subscribe(1, {udp(host(3, 1))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added")));
  machine.now += 1ms;
  machine.unicast(third, {subscribe(1, {udp(host(4, 1))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("displaced"), HasSubstr("10.0.0.4")));
  machine.unicast(fourth, {subscribe(1, {udp(host(5, 1))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("displaced"), HasSubstr("10.0.0.5")));
  // Now all have one, and come again: who comes later is refused.
  answer_offers(machine, 4s, {&greedy, &second, &third, &fourth}, [&](FakePeer& one) {
    const std::uint16_t port = one.endpoint() == host(2) ? 3 : 1;
    machine.unicast(one, {subscribe(1, {udp({one.endpoint().address, port})})});
  });
  machine.unicast(fifth, {subscribe(1, {udp(host(6, 1))})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack")));
  EXPECT_EQ(reached(machine, Limit::subscribers_per_eventgroup), 1U);
}

TEST_F(FairShares, TakePlacesFromWhoIsSilent) {
  FakePeer silent{host(2)};
  FakePeer speaking{host(3)};
  subscribe_often(silent, 1, 3, infinite_ttl_s);  // "until my next reboot", and nothing more
  subscribe_often(speaking, 1, 3, infinite_ttl_s);
  machine.run_to(10s);
  machine.unicast(speaking, {find(0x9999)});
  machine.run_to(11s);
  machine.events();
  FakePeer newcomer{host(4)};
  for (std::uint16_t port = 1; port <= 3; ++port) {
    machine.unicast(newcomer, {subscribe(1, {udp(host(4, port))})});
  }
  EXPECT_EQ(machine.discovery.counters().displaced, 3U);
  EXPECT_THAT(machine.events(), AllOf(SizeIs(6), Each(Not(HasSubstr("10.0.0.3")))));
}

TEST_F(FairShares, ForgetSilentPeersForThoseThatSpeak) {
  std::vector<FakePeer> silent = subscribed_peers(infinite_ttl_s);
  machine.run_to(10s);
  speak_again(silent);
  FakePeer newcomer{host(9)};
  machine.run_to(20s);
  machine.unicast(newcomer, {subscribe(1, {udp(host(9, 1))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack")));
  machine.run_to(22s);
  machine.events();
  machine.unicast(newcomer, {subscribe(1, {udp(host(9, 1))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("displaced"), HasSubstr("added 0001 udp 10.0.0.9:1")));
}

TEST_F(FairShares, AnswerAlsoThePeerTooMany) {
  covers({"feat_req_someipsd_1137", "feat_req_someipsd_1164"});
  std::vector<FakePeer> peers = subscribed_peers();
  speak_again(peers);
  for (std::uint8_t number = 5; number <= 6; ++number) {
    FakePeer peer{host(number)};
    machine.unicast(peer, {subscribe(1, {udp(host(number, 1))}), find(0x1234)});
    EXPECT_THAT(machine.sent(), ElementsAre(AllOf(HasSubstr("10.0.0." + std::to_string(number)),
                                                  HasSubstr(": nack"), HasSubstr("; offer"))));
  }
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(machine, Limit::peers), 2U);
}

TEST_F(FairShares, GiveThePeerTooManyTheNextPlaceThatIsFree) {
  std::vector<FakePeer> peers = subscribed_peers();
  speak_again(peers);
  peers.emplace_back(host(5));
  machine.unicast(peers.back(), {subscribe(1, {udp(host(5, 1))})});
  machine.sent();
  machine.unicast(peers[0], {subscribe(1, {udp(host(2, 1))}, 0)});
  machine.events();
  machine.unicast(peers[3], {subscribe(1, {udp(host(5, 1))})});
  // Its sessions go on where they were.
  EXPECT_THAT(machine.sent(),
              ElementsAre(AllOf(HasSubstr("10.0.0.5"), HasSubstr(" s2 "), HasSubstr(": ack"))));
  peers[3].reboot();
  machine.unicast(peers[3], {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added"), HasSubstr("rebooted")));
}

TEST_F(FairShares, DoNotLookLikeAReboot) {
  covers({"feat_req_someipsd_764", "feat_req_someipsd_765"});
  // Ten clients, of which three are remembered at a time, each asking again and again.
  std::vector<FakePeer> clients;
  std::vector<RebootDetector> detectors(10);
  for (std::uint8_t number = 0; number < 10; ++number) {
    clients.emplace_back(host(static_cast<std::uint8_t>(10 + number)));
  }
  std::array<std::byte, 1400> room{};
  for (int round = 0; round < 20; ++round) {
    for (std::size_t i = 0; i < clients.size(); ++i) {
      machine.unicast(clients[i], {find(0x1234)});
      const auto answer = machine.discovery.poll_transmit(room, machine.now);
      ASSERT_TRUE(answer);
      ASSERT_EQ(answer->destination, clients[i].endpoint());
      const auto message = decode(*someip::MessageCursor{answer->bytes}.next());
      ASSERT_TRUE(message);
      const SessionId session = someip::MessageCursor{answer->bytes}.next()->header.session;
      EXPECT_FALSE(detectors[i].shows_reboot(RebootDetector::Channel::unicast, session, message->reboot()))
          << "client " << i << " round " << round;
      detectors[i].observe(RebootDetector::Channel::unicast, session, message->reboot());
    }
    machine.now += 1ms;
  }
}

TEST_F(FairShares, LimitPeersAtOneAddress) {
  Settings settings = fixed_settings();
  settings.max_peers_per_address = 2;
  Machine<small> one{settings};
  ASSERT_TRUE(one.discovery.offer(service, one.now));
  FakePeer other{host(3)};
  one.unicast(other, {subscribe(1, {udp(host(3, 1))})});
  EXPECT_THAT(one.events(), SizeIs(1));
  for (std::uint16_t port = 1; port <= 9; ++port) {
    FakePeer many{host(2, port)};
    one.unicast(many, {subscribe(1, {udp(host(2, port))})});
  }
  EXPECT_THAT(one.events(), Each(HasSubstr("10.0.0.2"))) << "they take places of each other";
  EXPECT_EQ(one.discovery.counters().displaced, 7U);
}

TEST_F(FairShares, ForgetWhoOffersWhatNobodyWantsBeforeWhoIsUsed) {
  FakePeer client{host(2)};
  machine.unicast(client, {subscribe(1, {udp(host(2, 1))})});
  for (std::uint8_t number = 3; number <= 4; ++number) {
    FakePeer useless{host(number)};
    machine.multicast(useless, {offer({udp(host(number, 1))}, infinite_ttl_s, 0x7777, number)});
  }
  machine.events();
  FakePeer newcomer{host(5)};
  machine.unicast(newcomer, {subscribe(1, {udp(host(5, 1))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added 0001 udp 10.0.0.5")));
}

TEST_F(FairShares, LetRequiredServicesOfOthersInWhereOneHostOffersAllInstances) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x4321}}, machine.now));
  FakePeer greedy{host(2)};
  for (std::uint16_t instance = 1; instance <= 9; ++instance) {
    machine.multicast(greedy, {offer({udp(host(2, 30509))}, infinite_ttl_s, 0x4321, instance)});
  }
  EXPECT_THAT(machine.events(), SizeIs(4));
  EXPECT_EQ(reached(machine, Limit::remote_services), 5U);
  FakePeer honest{host(3)};
  machine.multicast(honest, {offer({udp(host(3, 30509))}, 3, 0x4321, 99)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("displaced"), HasSubstr("available 4321.0063")));
}

TEST_F(FairShares, KeepNothingOfAGuestsOffers) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x4321}}, machine.now));
  std::vector<FakePeer> peers = subscribed_peers();
  speak_again(peers);
  FakePeer guest{host(5)};
  machine.multicast(guest, {offer({udp(host(5, 30509))}, 3, 0x4321, 1)});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(reached(machine, Limit::peers), 1U);
}

// Answers to what came by multicast wait for some milliseconds.
TEST(FairSharesOfAnswers, AreByAddressHoweverManyPortsAsk) {
  Machine<Limits{.max_offers = 32, .max_subscriptions = 32, .max_pending_entries = 64}> machine;
  for (std::uint16_t instance = 1; instance <= 32; ++instance) {
    OfferedService one = service;
    one.instance = InstanceId{instance};
    one.eventgroups = {};
    ASSERT_TRUE(machine.discovery.offer(one, machine.now));
  }
  machine.run_to(500ms);
  for (std::uint16_t port = 1; port <= 4; ++port) {
    FakePeer greedy{host(2, port)};
    machine.multicast(greedy, {find(0x1234)});
  }
  EXPECT_EQ(reached(machine, Limit::pending_entries), 3U * 32);
  for (std::uint8_t number = 3; number <= 5; ++number) {
    FakePeer newcomer{host(number)};
    machine.multicast(newcomer, {find(0x1234, number)});
  }
  EXPECT_EQ(reached(machine, Limit::pending_entries), 3U * 32) << "there was room for them";
  const auto sent = machine.run_to(510ms);
  EXPECT_THAT(sent, SizeIs(4)) << "32 offers for the first port, and one for each newcomer";
  for (const char* const to : {"10.0.0.3", "10.0.0.4", "10.0.0.5"}) {
    EXPECT_THAT(sent, Contains(AllOf(HasSubstr(to), HasSubstr("offer"))));
  }
}

TEST(FairSharesOfTcpConnections, AreCounted) {
  Machine<small> machine;
  EXPECT_TRUE(machine.discovery.tcp_connected(host(1, 1), host(2, 1)));
  EXPECT_FALSE(machine.discovery.tcp_connected(host(1, 1), host(3, 1)));
  EXPECT_EQ(reached(machine, Limit::tcp_connections), 1U);
}

}  // namespace
}  // namespace trestle::sd::fair_shares_test
