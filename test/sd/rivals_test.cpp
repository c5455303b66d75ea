// Two servers that offer the same instance: whoever answers is kept, which is a guard.
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <set>

#include "test/sd/client_fixture.hpp"
#include "test/sd/configured_fixture.hpp"

namespace trestle::sd::rivals_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ClientBesideARival : public Client {
 protected:
  /// Offers that both make each second from now on.
  void both_offer(int times) {
    for (int i = 0; i < times; ++i) {
      machine.multicast(server, {offer({udp(server_udp)})});
      machine.multicast(rival, {offer({udp(rival_udp)})});
      machine.run_to(machine.now - start + 1s);
    }
  }

  Endpoint rival_udp{IpAddress::v4(10, 0, 0, 3), 30509};
  FakePeer rival{{IpAddress::v4(10, 0, 0, 3), 30490}};
};

TEST_F(ClientBesideARival, KeepsWhoAnswers) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.run_to(100ms);
  machine.unicast(server, {ack(1)});
  machine.events();
  for (int i = 0; i < 10; ++i) {
    machine.unicast(server, {ack(1)});
    both_offer(1);
  }
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_conflicting_offer, 10U);
  EXPECT_EQ(machine.discovery.contested().value().peer, server_sd);
}

TEST_F(ClientBesideARival, LetsWhoDoesNotAnswerGiveWay) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  both_offer(2);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678 v1.0 udp 10.0.0.2:30509")));
  both_offer(1);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost 1234.5678"),
                                            HasSubstr("available 1234.5678 v1.0 udp 10.0.0.3:30509")));
  EXPECT_FALSE(machine.discovery.contested());
  const auto takeover = machine.discovery.take_takeover();
  ASSERT_TRUE(takeover);
  EXPECT_EQ(takeover->service.instance, InstanceId{0x5678});
  EXPECT_EQ(takeover->service.peer, rival.endpoint());
  EXPECT_EQ(takeover->from, server_sd);
  EXPECT_FALSE(machine.discovery.take_takeover()) << "told once";
  machine.unicast(rival, {ack(1)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("subscribed")));
  for (int i = 0; i < 10; ++i) {
    machine.unicast(rival, {ack(1)});
    both_offer(1);
  }
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(ClientBesideARival, LetsWhoseCallsTimeOutGiveWay) {
  require(required);
  both_offer(1);
  machine.events();
  const RemoteHandle known = machine.discovery.contested().value().handle;
  machine.discovery.not_answered(known);
  machine.discovery.not_answered(known);
  machine.discovery.answered(known);
  machine.discovery.not_answered(known);
  machine.discovery.not_answered(known);
  both_offer(1);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.discovery.not_answered(known);
  both_offer(1);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost 1234.5678"),
                                            HasSubstr("available 1234.5678 v1.0 udp 10.0.0.3:30509")));
}

// The honest one is called server here; the rival answers, too, but comes while the server is away.
class ClientOfARestartedServer : public ClientBesideARival {
 protected:
  void SetUp() override {
    require(required);
    subscription = subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  }
  /// Each of them offers once a second, if it is said to, and answers what it is asked.
  void run(int seconds, bool server_offers, bool rival_offers) {
    for (int i = 0; i < seconds; ++i) {
      if (server_offers) {
        machine.multicast(server, {offer({udp(server_udp)}, 5)});
      }
      if (rival_offers) {
        machine.multicast(rival, {offer({udp(rival_udp)})});
      }
      const Duration end = machine.now - start + 1s;
      for (int part = 0; part < 20; ++part) {
        for (const std::string& sent : machine.run_to(machine.now - start + 50ms)) {
          if (sent.find("-> 10.0.0.3") != std::string::npos && rival_answers) {
            machine.unicast(rival, {ack(1)});
          } else if (sent.find("-> 10.0.0.2") != std::string::npos && server_answers) {
            machine.unicast(server, {ack(1)});
          }
        }
      }
      ASSERT_EQ(machine.now - start, end);
    }
  }
  [[nodiscard]] IpAddress holder() const {
    return machine.discovery.server_of(subscription).value_or(RemoteService{}).peer.address;
  }
  void stop_server() { machine.multicast(server, {offer({udp(server_udp)}, 0)}); }

  SubscriptionHandle subscription;
  bool server_answers = true;
  bool rival_answers = true;
};

TEST_F(ClientOfARestartedServer, GivesThePlaceBackToWhoHeldItForLonger) {
  run(10, true, false);
  stop_server();
  run(5, false, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
  machine.events();
  server.reboot();
  run(1, true, true);
  EXPECT_EQ(holder(), server_sd.address);
  EXPECT_THAT(machine.events(),
              ElementsAre("subscription lost replaced", HasSubstr("lost 1234.5678"),
                          HasSubstr("available 1234.5678 v1.0 udp 10.0.0.2:30509"), "subscribed"));
  const Takeover told = machine.discovery.take_takeover().value();
  EXPECT_TRUE(told.is_back);
  EXPECT_EQ(told.service.peer, server_sd);
  EXPECT_EQ(told.from, rival.endpoint());
  run(10, true, true);
  EXPECT_THAT(machine.events(), IsEmpty()) << "the rival has lost its place";
}

TEST_F(ClientOfARestartedServer, GivesItBackHoweverOftenTheServerRestarts) {
  run(10, true, false);
  for (int i = 0; i < 5; ++i) {
    stop_server();
    run(5, false, true);
    EXPECT_EQ(holder(), rival.endpoint().address);
    server.reboot();
    run(1, true, true);
    EXPECT_EQ(holder(), server_sd.address) << i;
  }
}

// It is not known yet that it has gone when the rival takes its place.
TEST_F(ClientOfARestartedServer, GivesItBackAfterACrash) {
  run(10, true, true);
  EXPECT_EQ(holder(), server_sd.address);
  server_answers = false;
  run(4, false, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
  EXPECT_FALSE(machine.discovery.take_takeover().value().is_back);
  server_answers = true;
  server.reboot();
  run(1, true, true);
  EXPECT_EQ(holder(), server_sd.address);
}

TEST_F(ClientOfARestartedServer, LeavesThePlaceToWhoHasHeldItForLonger) {
  run(10, true, false);
  stop_server();
  run(15, false, true);
  server.reboot();
  run(10, true, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
  EXPECT_FALSE(machine.discovery.take_takeover());
}

TEST_F(ClientOfARestartedServer, GivesNothingToWhoOnlyOfferedIt) {
  server_answers = false;
  run(10, true, false);
  stop_server();
  run(2, false, true);
  server_answers = true;
  run(5, true, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
}

TEST_F(ClientOfARestartedServer, GivesItToAnybodyElseIfItDoesNotAnswerThen) {
  run(20, true, false);
  stop_server();
  run(3, false, true);
  server_answers = false;
  run(4, true, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
  machine.events();
  run(20, true, true);
  EXPECT_THAT(machine.events(), IsEmpty()) << "it has had its chance";
  EXPECT_EQ(holder(), rival.endpoint().address);
}

// A server whose discovery goes on, but which serves no more: calls are not answered.
TEST_F(ClientOfARestartedServer, IsNotTornBetweenTwoWhenOneServesNoMore) {
  run(1000, true, true);
  int changes = 0;
  for (int i = 0; i < 100; ++i) {
    const auto served_by = machine.discovery.server_of(subscription);
    if (served_by && served_by->peer == server_sd) {
      for (int call = 0; call < 3; ++call) {
        machine.discovery.not_answered(served_by->handle);
      }
    }
    run(1, true, true);
    changes += machine.discovery.take_takeover() ? 1 : 0;
  }
  EXPECT_LE(changes, 8);
  EXPECT_EQ(holder(), rival.endpoint().address);
}

// Who held the place for long comes and goes, to displace the one that answers and is always there.
TEST_F(ClientOfARestartedServer, IsNotTornByWhoHeldItOnceAndComesAgainAndAgain) {
  run(1000, true, false);
  stop_server();
  const auto changes = [&](int cycles) {
    int changes = 0;
    for (int i = 0; i < cycles; ++i) {
      run(5, false, true);
      server.reboot();
      run(1, true, true);
      changes += machine.discovery.take_takeover() ? 1 : 0;
      stop_server();
    }
    return changes;
  };
  EXPECT_GT(changes(40), 5);
  EXPECT_EQ(changes(60), 0) << "what it had is used up";
}

// It offers every two seconds, and its rival more seldom: however long ago its last offer was, it was none of
// a server that has crashed.
TEST_F(ClientOfARestartedServer, GivesLittleBackToWhoWentOnOfferingWithoutServing) {
  run(1000, true, true);
  server_answers = false;
  run(1, true, true);
  run(1, false, false);
  run(1, true, false);
  run(1, false, false);
  EXPECT_EQ(holder(), server_sd.address);
  run(1, false, true);
  EXPECT_EQ(holder(), rival.endpoint().address);
  server_answers = true;
  run(100, false, true);
  server.reboot();
  run(5, true, true);
  EXPECT_EQ(holder(), rival.endpoint().address) << "1/16 of 1000 s are less than 100 s";
}

// With the seed 0, the address of this rival has the same mark as the server's.
TEST_F(ClientOfARestartedServer, IsNotFooledByAnAddressThatWasChosen) {
  constexpr IpAddress chosen = IpAddress::v4(10, 0, 90, 129);
  Settings settings = fixed_settings();
  settings.seed = 0x1234'5678'9abc'def0;
  Machine<> seeded{settings};
  const auto requirement = seeded.discovery.require(required, seeded.now).value();
  const auto subscription =
      seeded.discovery.subscribe(requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp}, seeded.now)
          .value();
  FakePeer impostor{{chosen, 30490}};
  const auto serve = [&](FakePeer& peer, int seconds) {
    for (int i = 0; i < seconds; ++i) {
      seeded.multicast(peer, {offer({udp({peer.endpoint().address, 30509})})});
      seeded.run_to(seeded.now - start + 50ms);
      seeded.unicast(peer, {ack(1)});
      seeded.run_to(seeded.now - start + 950ms);
    }
  };
  serve(server, 10);
  seeded.multicast(server, {offer({udp(server_udp)}, 0)});
  serve(impostor, 5);
  EXPECT_EQ(seeded.discovery.server_of(subscription).value().peer.address, chosen);
  server.reboot();
  serve(server, 1);
  EXPECT_EQ(seeded.discovery.server_of(subscription).value().peer, server_sd);
}

TEST_F(ClientOfARestartedServer, HasAPlaceForEachServiceThatItNeeds) {
  std::vector<SubscriptionHandle> all;
  for (std::uint16_t i = 1; i <= 60; ++i) {
    const auto need = machine.discovery.require(
        {.service = ServiceId{i}, .instance = InstanceId{1}, .major = 1}, machine.now);
    ASSERT_TRUE(need);
    all.push_back(
        machine.discovery.subscribe(*need, {.eventgroup = EventgroupId{1}, .udp = own_udp}, machine.now)
            .value());
  }
  const auto offer_all = [&](FakePeer& peer, const Endpoint& at, std::uint32_t ttl_s) {
    for (std::uint16_t i = 1; i <= 60; ++i) {
      machine.multicast(peer, {offer({udp(at)}, ttl_s, i, 1)});
    }
    machine.run_to(machine.now - start + 50ms);
    for (std::uint16_t i = 1; i <= 60; ++i) {
      FakePeer::Said answer = ack(1);
      answer.entry.service = ServiceId{i};
      answer.entry.instance = InstanceId{1};
      machine.unicast(peer, {answer});
    }
    machine.run_to(machine.now - start + 950ms);
  };
  for (int i = 0; i < 5; ++i) {
    offer_all(server, server_udp, 3);
  }
  offer_all(server, server_udp, 0);
  offer_all(rival, rival_udp, 3);
  offer_all(server, server_udp, 3);
  for (const SubscriptionHandle one : all) {
    EXPECT_EQ(machine.discovery.server_of(one).value().peer, server_sd);
  }
}

// The impostor is the one that is called server here, and never answers; the honest one is the rival.
class ClientOfAnImpostor : public ClientBesideARival {
 protected:
  void SetUp() override {
    require(required);
    subscription = subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  }
  [[nodiscard]] Duration time() const { return machine.now - start; }
  void pass(Duration time_to_pass) {
    machine.run_to(time() + time_to_pass);
    machine.events();
  }
  /// Each second, as long as it is not known, and answers what it is asked.
  /// @return when its service was taken; nothing within ten seconds
  std::optional<Duration> taken_after(Duration pause, const std::function<void()>& impostor) {
    const Duration begin = time();
    for (Duration passed{}; passed < 10s; passed += pause) {
      impostor();
      if (passed % 1s == 0s) {
        machine.multicast(rival, {offer({udp(rival_udp)})});
      }
      for (const std::string& sent : machine.run_to(begin + passed + pause)) {
        if (sent.find("-> 10.0.0.3") != std::string::npos) {
          machine.unicast(rival, {ack(1)});
        } else if (nacks && sent.find("-> 10.0.0.2") != std::string::npos) {
          machine.unicast(server, {ack(1, {}, 0)});
        }
      }
      for (const std::string& event : machine.events()) {
        if (event == "subscribed") {
          return passed;
        }
      }
    }
    return {};
  }
  SubscriptionHandle subscription;
  std::uint16_t port = 1;
  bool nacks = false;
};

TEST_F(ClientOfAnImpostor, TakesTheHonestOneAfterOneForgedOfferWithoutEnd) {
  machine.unicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  pass(2s);
  const auto taken = taken_after(1s, [] {});
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 2s);
  EXPECT_EQ(machine.discovery.take_takeover().value().from, server_sd);
}

TEST_F(ClientOfAnImpostor, TakesTheServiceThatMovedFromADeadHost) {
  machine.discovery.unsubscribe(subscription, machine.now);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .ttl_s = infinite_ttl_s});
  machine.unicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.unicast(server, {ack(1)});
  pass(100s);
  const auto taken = taken_after(1s, [] {});
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 3s);
}

TEST_F(ClientOfAnImpostor, AsksByTimeNotByTheNumberOfOffers) {
  machine.unicast(server, {offer({udp(server_udp)})});
  for (int i = 0; i < 1000; ++i) {
    machine.multicast(rival, {offer({udp(rival_udp)})});
  }
  const auto sent = machine.run_to(300ms);
  const auto sent_to = [&](const char* host) {
    return std::ranges::count_if(sent, [&](const std::string& one) { return one.find(host) != one.npos; });
  };
  EXPECT_LE(sent_to("-> 10.0.0.2"), 2);
  EXPECT_EQ(sent_to("-> 10.0.0.3"), 1);
  EXPECT_THAT(sent, testing::SizeIs(testing::Le(3)));
  machine.unicast(server, {ack(1)});
  machine.events();
  EXPECT_THAT(machine.run_to(2s), IsEmpty()) << "it has answered";
  EXPECT_FALSE(machine.discovery.take_takeover());
}

TEST_F(ClientOfAnImpostor, HasNothingMoreToAskWhenTheLinkIsDown) {
  machine.unicast(server, {offer({udp(server_udp)})});
  pass(100ms);
  machine.multicast(rival, {offer({udp(rival_udp)})});
  pass(50ms);
  ASSERT_TRUE(machine.discovery.deadline());
  machine.discovery.link_down();
  machine.events();
  EXPECT_FALSE(machine.discovery.deadline());
  machine.discovery.link_up(machine.now);
  pass(5s);
  machine.discovery.shutdown(machine.now);
  machine.events();
  pass(1s);
  EXPECT_FALSE(machine.discovery.deadline());
}

TEST_F(ClientOfAnImpostor, IsNotMisledByOffersThatNameEverOtherPorts) {
  const auto taken = taken_after(20ms, [&] {
    machine.multicast(server, {offer({udp({server_sd.address, port++})})});
  });
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 3s);
}

TEST_F(ClientOfAnImpostor, IsNotMisledByWhoWithdrawsItsOfferEachTime) {
  const auto taken = taken_after(250ms, [&] {
    machine.multicast(server, {offer({udp(server_udp)}, 0), offer({udp(server_udp)})});
  });
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 3s);
}

TEST_F(ClientOfAnImpostor, TakesARefusalForNoAnswer) {
  nacks = true;
  const auto taken = taken_after(250ms, [&] { machine.multicast(server, {offer({udp(server_udp)})}); });
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 3s);
}

TEST_F(ClientOfAnImpostor, IsKeptBusyByNoPairOfThem) {
  FakePeer second{{IpAddress::v4(10, 0, 0, 4), 30490}};
  const auto taken = taken_after(20ms, [&] {
    machine.multicast(server, {offer({udp(server_udp)})});
    machine.multicast(second, {offer({udp({second.endpoint().address, 30509})})});
  });
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 5s);
}

// Each gets its turn to answer, but only once, although it takes longer than silent_after until all had
// theirs.
TEST_F(ClientOfAnImpostor, IsNotKeptBusyForEverByManyWhoTakeTurns) {
  if constexpr (!optimised_for_many) {
    GTEST_SKIP() << "a small device remembers few";
  }
  std::vector<FakePeer> crowd;
  for (std::uint8_t i = 0; i < 40; ++i) {
    crowd.emplace_back(host(static_cast<std::uint8_t>(100 + i)));
  }
  std::size_t next = 0;
  const auto impostors = [&] {
    FakePeer& one = crowd[next++ % crowd.size()];
    machine.multicast(one, {offer({udp({one.endpoint().address, 30509})})});
  };
  for (int i = 0; i < 60 * 40; ++i) {  // a minute without the honest one, until all had their turns
    impostors();
    machine.run_to(time() + 25ms);
    machine.events();
  }
  const auto taken = taken_after(25ms, impostors);
  ASSERT_TRUE(taken);
  EXPECT_LE(*taken, 2s);
}

TEST_F(ClientBesideARival, HoldsNoPlaceForWhoIsSilentAndWasNeverOfUse) {
  require(required);
  machine.unicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.run_to(9s);
  machine.multicast(rival, {offer({udp(rival_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("10.0.0.2:30509")));
  machine.run_to(10s);
  machine.multicast(rival, {offer({udp(rival_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost"), HasSubstr("10.0.0.3:30509")));
}

TEST_F(ClientBesideARival, KeepsNoPlaceForWhatNobodyNeeds) {
  RequiredService old = required;
  old.minor = 0;
  require(old);
  FakePeer::Said newer = offer({udp(server_udp)});
  newer.entry.tail = 7;
  machine.multicast(server, {newer});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.multicast(rival, {offer({udp(rival_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("10.0.0.3:30509")));
  machine.multicast(server, {newer});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.contested().value().peer, rival.endpoint());
}

// Any version will do, and the one that came first does not answer.
TEST_F(ClientBesideARival, TakesItsSubscriptionsToAnotherVersion) {
  RequiredService any_version = required;
  any_version.major = any_major;
  require(any_version);
  const SubscriptionHandle one = subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  const SubscriptionHandle two = subscribe_to({.eventgroup = EventgroupId{2}, .udp = own_udp});
  FakePeer::Said second = offer({udp(rival_udp)});
  second.entry.major = 2;
  const auto holders = [&] {
    return std::array{machine.discovery.server_of(one).value().peer,
                      machine.discovery.server_of(two).value().peer};
  };
  for (int i = 0; i < 4; ++i) {
    machine.multicast(server, {offer({udp(server_udp)})});
    machine.multicast(rival, {second});
    EXPECT_THAT(holders(), testing::Each(i < 2 ? server_sd : rival.endpoint())) << i;
    const auto sent = machine.run_to(machine.now - start + 1s);
    // Before, it is only asked.
    const auto subscribes = testing::AllOf(HasSubstr("-> 10.0.0.3"), HasSubstr("ttl 3"));
    EXPECT_EQ(testing::Matches(testing::Contains(subscribes))(sent), i >= 2);
  }
  FakePeer::Said answer = ack(1);
  answer.entry.major = 2;
  machine.unicast(rival, {answer});
  machine.events();
  for (int i = 0; i < 10; ++i) {
    machine.multicast(rival, {second});
    machine.multicast(server, {offer({udp(server_udp)})});
    machine.unicast(rival, {answer});
    machine.run_to(machine.now - start + 1s);
  }
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_THAT(holders(), testing::Each(rival.endpoint()));
}

TEST_F(ClientBesideARival, KeepsNoPlaceForWhatCannotBeAsked) {
  require(required);
  both_offer(1);
  machine.events();
  const RemoteHandle known = machine.discovery.contested().value().handle;
  machine.discovery.answered(known);
  machine.discovery.is_of_no_use(known);
  both_offer(1);
  EXPECT_THAT(machine.events(), IsEmpty()) << "it has answered, to something else";
  machine.multicast(server, {offer({udp(server_udp)}, 0), offer({udp(server_udp)})});
  machine.events();
  machine.discovery.is_of_no_use(machine.discovery.choose(requirement).value().handle);
  machine.multicast(rival, {offer({udp(rival_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost"), HasSubstr("10.0.0.3:30509")));
}

// Of two instances, of which the rival's has the better priority.
class ClientBesideAnotherInstance : public ClientBesideARival {
 protected:
  void SetUp() override { require(any_required); }
  void server_offers(std::uint32_t ttl_s = 3) {
    machine.multicast(server, {offer({udp(server_udp)}, ttl_s, 0x1234, 1)});
  }
  void rival_offers() {
    machine.multicast(rival, {with(offer({udp(rival_udp)}, 3, 0x1234, 0x77), {rank("00 0000 ffff")})});
  }
  RemoteService chosen() { return machine.discovery.choose(requirement).value_or(RemoteService{}); }
  void miss(RemoteHandle service, int times) {
    for (int i = 0; i < times; ++i) {
      machine.discovery.not_answered(service);
    }
  }
};

TEST_F(ClientBesideAnotherInstance, GoesByPriorityOnlyUntilOneHasAnswered) {
  server_offers();
  const RemoteHandle honest = chosen().handle;
  rival_offers();
  EXPECT_EQ(chosen().peer, rival.endpoint());
  machine.discovery.answered(honest);
  EXPECT_EQ(chosen().peer, server_sd);
  miss(honest, 2);
  EXPECT_EQ(chosen().peer, server_sd);
  miss(honest, 1);
  EXPECT_TRUE(machine.discovery.is_mute(honest));
  EXPECT_EQ(chosen().peer, rival.endpoint()) << "which may answer";
  miss(chosen().handle, 3);
  EXPECT_EQ(chosen().peer, server_sd) << "which has answered once";
}

TEST_F(ClientBesideAnotherInstance, LikesWhoseSubscriptionIsAnswered) {
  server_offers();
  const EventgroupRequest request{.eventgroup = EventgroupId{1}, .instance = InstanceId{1}, .udp = own_udp};
  subscribe_to(request);
  machine.run_to(100ms);
  FakePeer::Said said = ack(1);
  said.entry.instance = InstanceId{1};
  machine.unicast(server, {said});
  rival_offers();
  EXPECT_EQ(chosen().peer, server_sd);
}

TEST_F(ClientBesideAnotherInstance, LeavesTheRivalThatDoesNotAnswerWhenTheServerIsBack) {
  server_offers();
  machine.discovery.answered(chosen().handle);
  rival_offers();
  server_offers(0);  // for a while
  EXPECT_EQ(chosen().peer, rival.endpoint());
  miss(chosen().handle, 3);
  EXPECT_EQ(chosen().peer, rival.endpoint()) << "there is nobody else";
  server_offers();
  EXPECT_EQ(chosen().peer, server_sd);
}

TEST_F(ClientBesideAnotherInstance, TriesAllWhenNoneAnswers) {
  server_offers();
  miss(chosen().handle, 3);
  rival_offers();
  miss(chosen().handle, 3);
  std::set<unsigned> instances;
  for (int i = 0; i < 100; ++i) {
    instances.insert(value(chosen().instance));
  }
  EXPECT_THAT(instances, ElementsAre(1, 0x77));
}

TEST_F(ClientBesideAnotherInstance, CountsSilenceByHostHoweverManyInstancesItOffers) {
  server_offers();
  const auto offers = [&](std::uint16_t instance) {
    machine.multicast(rival, {with(offer({udp(rival_udp)}, 3, 0x1234, instance), {rank("00 0000 ffff")})});
  };
  for (std::uint16_t instance = 0x100; instance < 0x110; ++instance) {
    offers(instance);
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(chosen().peer, rival.endpoint());
    miss(chosen().handle, 1);
    offers(static_cast<std::uint16_t>(0x200 + i));
  }
  EXPECT_EQ(chosen().peer, server_sd);
  machine.multicast(rival, {with(offer({udp(rival_udp)}, 0, 0x1234, 0x100), {})});
  offers(0x300);
  EXPECT_EQ(chosen().peer, server_sd) << "not even what is offered anew";
}

}  // namespace
}  // namespace trestle::sd::rivals_test
