// A service that many hosts offer, none of which has answered yet: whoever answers first gets the place,
// however many others there are. Most of these are addresses that nobody has.
#include <gmock/gmock.h>

#include <algorithm>

#include "test/sd/client_fixture.hpp"

namespace trestle::sd::first_answer_test {
namespace {
using namespace test;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr EventgroupRequest request{.eventgroup = EventgroupId{1}, .udp = own_udp};

class ClientOfTheFirstAnswer : public Client {
 protected:
  /// An offer from an address that was not heard before, and that nobody has.
  void forge() {
    ++forged;
    FakePeer stranger{{IpAddress::v4(10, static_cast<std::uint8_t>(1 + forged / 62'500),
                                     static_cast<std::uint8_t>(forged / 250 % 250),
                                     static_cast<std::uint8_t>(forged % 250)),
                       30490}};
    const FakePeer::Said said = offer({udp({stranger.endpoint().address, 30509})});
    forged % 2 == 0 ? machine.multicast(stranger, {said}) : machine.unicast(stranger, {said});
  }
  /// What a server does with one datagram of ours, some time after it was sent.
  void serve(FakePeer& peer, const Endpoint& at, const std::string& datagram) {
    const std::string to = "-> " + describe(peer.endpoint());
    if (datagram.find(to) == std::string::npos) {
      return;
    }
    if (datagram.find(" subscribe") != std::string::npos) {
      machine.unicast(peer, {ack(1)});
    }
    if (datagram.find("find") != std::string::npos && answers_finds) {
      machine.unicast(peer, {offer({udp(at)})});
    }
  }
  void note_events() {
    for (const std::string& event : machine.events()) {
      const bool is_there = event == "subscribed" && holder() == server_sd;
      taken = taken || !is_there ? taken : std::optional{time()};
      changes += event.starts_with("available") ? 1 : 0;
    }
  }
  /// Lets the flood go on for a time; the honest server offers at its beginning and each second from then on,
  /// and answers within a millisecond.
  void attack(Duration for_so_long, int per_second, bool with_server) {
    const Duration begin = time();
    std::vector<std::string> before;
    for (Duration passed{}; passed < for_so_long; passed += 1ms) {
      for (const std::string& datagram : before) {
        serve(server, server_udp, datagram);
      }
      if (with_server && passed % 1s == 0s) {
        machine.multicast(server, {offer({udp(server_udp)})});
      }
      if (passed % (1000ms / per_second) == 0s) {
        forge();
      }
      note_events();
      before = machine.run_to(begin + passed + 1ms);
      sent += before.size();
      note_events();
    }
  }
  [[nodiscard]] Duration time() const { return machine.now - start; }
  [[nodiscard]] Endpoint holder() const {
    return machine.discovery.server_of(subscription).value_or(RemoteService{}).peer;
  }

  SubscriptionHandle subscription;
  std::optional<Duration> taken;  // when we were subscribed at the honest server
  std::size_t sent = 0;
  int forged = 0;
  int changes = 0;
  bool answers_finds = true;
};

class ClientInAFlood : public ClientOfTheFirstAnswer, public testing::WithParamInterface<int> {
 protected:
  void SetUp() override {
    require(required);
    subscription = subscribe_to(request);
    attack(2s, GetParam(), false);
    ASSERT_NE(holder(), server_sd);
  }
};

TEST_P(ClientInAFlood, FindsTheServerByItsFirstOffer) {
  if (!optimised_for_many && GetParam() > 100) {
    GTEST_SKIP() << "it remembers too few of those that it has asked";
  }
  const Duration begin = time();
  attack(1s, GetParam(), true);
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken - begin, 100ms);
  changes = 0;
  taken.reset();
  attack(3s, GetParam(), true);
  EXPECT_EQ(holder(), server_sd);
  EXPECT_EQ(changes, 0) << "it stays";
}

// There are servers that hear no Finds by unicast.
TEST_P(ClientInAFlood, FindsTheServerByItsSecondOfferWhenItAnswersNoFinds) {
  if (!optimised_for_many && GetParam() > 100) {
    GTEST_SKIP() << "it remembers too few of those that it has asked";
  }
  answers_finds = false;
  const Duration begin = time();
  attack(2s, GetParam(), true);
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken - begin, 1100ms);
}

// But for some more to the one that has the place: 20 a second at most.
TEST_P(ClientInAFlood, SendsNoMoreThanItHears) {
  sent = 0;
  attack(2s, GetParam(), false);
  EXPECT_LE(sent, 2U * static_cast<std::size_t>(GetParam()) + 40U);
}

// One after another, as long as there is nobody who answers.
TEST_P(ClientInAFlood, TellsTheApplicationOfFewOfThem) {
  changes = 0;
  attack(4s, GetParam(), false);
  EXPECT_LE(changes, 4);
}

INSTANTIATE_TEST_SUITE_P(OffersPerSecond, ClientInAFlood, testing::Values(10, 100, 1000),
                         [](const auto& one) { return std::to_string(one.param); });

class ClientBesideSome : public ClientOfTheFirstAnswer {
 protected:
  void SetUp() override {
    require(required);
    subscription = subscribe_to(request);
    forge();
    machine.run_to(50ms);
    machine.events();
  }
  void offer_by(FakePeer& peer) { machine.multicast(peer, {offer({udp({peer.endpoint().address, 30509})})}); }
  /// @return what is sent to it until then
  std::vector<std::string> to(const FakePeer& peer, Duration until) {
    std::vector<std::string> all = machine.run_to(until);
    std::erase_if(all, [&](const std::string& one) {
      return one.find("-> " + describe(peer.endpoint())) == std::string::npos;
    });
    return all;
  }
};

TEST_F(ClientBesideSome, AsksTheOtherAndTakesItByItsAnswer) {
  offer_by(server);
  EXPECT_THAT(
      to(server, 100ms),
      ElementsAre("55ms -> 10.0.0.2:30490 s1 reboot: subscribe 1234.5678 v1 group 0001 ttl 1 counter 0 "
                  "udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1, {}, 1)});
  // So that the next Subscribe is no renewal, and brings the initial events.
  EXPECT_THAT(to(server, 100ms),
              ElementsAre("100ms -> 10.0.0.2:30490 s2 reboot: stop_subscribe 1234.5678 v1 group 0001 ttl 0 "
                          "counter 0 udp 10.0.0.1:40000; find 1234.5678 v1.* ttl 3"));
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost 1234.5678 v1 replaced"),
                                            HasSubstr("available 1234.5678 v1.0 udp 10.0.0.2:30509")));
  EXPECT_EQ(machine.discovery.take_takeover().value().service.peer, server_sd);
  EXPECT_THAT(
      to(server, 100ms),
      ElementsAre("100ms -> 10.0.0.2:30490 s3 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "initial udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 0U);
}

TEST_F(ClientBesideSome, AsksWhoOffersAgainOnlyAfterATimeToAnswer) {
  std::vector<std::string> asked;
  while (time() < 950ms) {
    offer_by(server);
    const auto more = to(server, time() + 10ms);
    asked.insert(asked.end(), more.begin(), more.end());
  }
  EXPECT_THAT(asked, SizeIs(3));  // 400 ms each
}

TEST_F(ClientBesideSome, AsksNobodyWhenTheFirstHasAnswered) {
  FakePeer second{host(3)};
  offer_by(second);
  machine.run_to(100ms);
  machine.unicast(second, {ack(1)});
  machine.unicast(second, {offer({udp({second.endpoint().address, 30509})})});
  machine.run_to(150ms);
  machine.unicast(second, {ack(1)});
  machine.events();
  ASSERT_EQ(holder(), second.endpoint());
  for (int i = 0; i < 5; ++i) {
    offer_by(server);
    EXPECT_THAT(to(server, time() + 100ms), IsEmpty());
    machine.unicast(second, {ack(1)});
  }
  EXPECT_EQ(holder(), second.endpoint());
  EXPECT_THAT(machine.events(), IsEmpty());
}

// The answer may come late: while there is nobody else, it still counts.
TEST_F(ClientBesideSome, TakesWhoAnswersLate) {
  offer_by(server);
  machine.run_to(900ms);
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(to(server, 900ms), ElementsAre(HasSubstr("find")));
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_EQ(holder(), server_sd);
}

TEST_F(ClientBesideSome, TakesARefusalForNoAnswer) {
  offer_by(server);
  machine.run_to(100ms);
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(to(server, 100ms), IsEmpty());
  offer_by(server);
  EXPECT_NE(holder(), server_sd);
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 0U);
}

TEST_F(ClientBesideSome, TakesNoAnswerToWhatWasNotAsked) {
  machine.unicast(server, {ack(1)});
  offer_by(server);
  machine.run_to(100ms);
  for (const FakePeer::Said& wrong : {ack(2), ack(1, {}, 3, 1)}) {
    machine.unicast(server, {wrong});
  }
  FakePeer::Said other = ack(1);
  other.entry.instance = InstanceId{1};
  machine.unicast(server, {other});
  machine.multicast(server, {ack(1)});
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 4U);
  offer_by(server);
  EXPECT_NE(holder(), server_sd);
}

// Who has answered is not forgotten for others who have not.
TEST_F(ClientBesideSome, RemembersTheLastOfThemAndWhoHasAnswered) {
  constexpr int remembered = optimised_for_many ? 256 : 2;
  FakePeer second{host(3)};
  offer_by(second);
  machine.run_to(100ms);
  machine.unicast(second, {ack(1)});
  offer_by(server);
  for (int i = 0; i < remembered - 2; ++i) {
    forge();
    machine.run_to(time() + 1ms);
  }
  machine.unicast(server, {ack(1)});
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 0U);
  forge();  // in the place of one that has not answered, if there is one
  offer_by(second);
  if (remembered > 2) {
    EXPECT_EQ(holder(), second.endpoint());
  }
}

TEST_F(ClientBesideSome, ForgetsTheFirstOfMoreThanItRemembers) {
  constexpr int remembered = optimised_for_many ? 256 : 2;
  offer_by(server);
  for (int i = 0; i < remembered; ++i) {
    forge();
    machine.run_to(time() + 1ms);
  }
  machine.unicast(server, {ack(1)});
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 1U);
}

// A connection is one to the server that has the place.
TEST_F(ClientOfTheFirstAnswer, AsksNobodyElseByTcp) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .tcp = own_tcp});
  forge();
  machine.run_to(50ms);
  machine.multicast(server, {offer({tcp(server_tcp)})});
  EXPECT_THAT(machine.run_to(300ms), Each(Not(HasSubstr("-> 10.0.0.2"))));
}

TEST_F(ClientOfTheFirstAnswer, AsksNobodyWhoDoesNotFit) {
  RequiredService newer = required;
  newer.minor = 0;
  require(newer);
  subscribe_to(request);
  forge();
  machine.run_to(50ms);
  FakePeer::Said other = offer({udp(server_udp)});
  other.entry.tail = 7;
  machine.multicast(server, {other});
  EXPECT_THAT(machine.run_to(300ms), Each(Not(HasSubstr("-> 10.0.0.2"))));
}

// Any version will do. All subscriptions go to the server that has answered.
TEST_F(ClientOfTheFirstAnswer, TakesAnotherVersion) {
  RequiredService any_version = required;
  any_version.major = any_major;
  require(any_version);
  const SubscriptionHandle one = subscribe_to(request);
  const SubscriptionHandle two = subscribe_to({.eventgroup = EventgroupId{2}, .udp = own_udp});
  forge();
  machine.run_to(50ms);
  FakePeer::Said second = offer({udp(server_udp)});
  second.entry.major = 2;
  machine.multicast(server, {second});
  machine.run_to(100ms);
  FakePeer::Said answer = ack(1);
  answer.entry.major = 2;
  machine.unicast(server, {answer});
  EXPECT_THAT(machine.run_to(100ms), Contains(HasSubstr("find")));
  machine.unicast(server, {second});
  for (const SubscriptionHandle handle : {one, two}) {
    EXPECT_EQ(machine.discovery.server_of(handle).value().peer, server_sd);
  }
}

TEST_F(ClientOfTheFirstAnswer, AsksOnlySoOftenASecond) {
  Settings settings = fixed_settings();
  settings.max_entries_per_second = 10;
  Machine<> slow{settings};
  const auto need = slow.discovery.require(required, slow.now).value();
  ASSERT_TRUE(slow.discovery.subscribe(need, request, slow.now));
  std::size_t sent = 0;
  for (int i = 0; i < 1000; ++i) {
    FakePeer stranger{
        {IpAddress::v4(10, 1, static_cast<std::uint8_t>(i / 250), static_cast<std::uint8_t>(i % 250)),
         30490}};
    slow.multicast(stranger, {offer({udp({stranger.endpoint().address, 30509})})});
    sent += slow.run_to(slow.now - start + 1ms).size();
  }
  sent += slow.run_to(slow.now - start + 10ms).size();
  EXPECT_LE(sent, 100U + 10U + 20U) << "100 in a row, 10 a second, and some to the one that has the place";
  EXPECT_GE(sent, 100U);
  EXPECT_GT(slow.discovery.counters().ignored_too_many, 800U);
}

}  // namespace
}  // namespace trestle::sd::first_answer_test
