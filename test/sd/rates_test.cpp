// How often a peer may ask, and be started anew.
#include <gmock/gmock.h>

#include <functional>

#include "sd/core/rate_limit.hpp"
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::rates_test {
namespace {
using namespace test;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(RateLimit, LetsSoManyThroughAtOnceAndThenOneInEachPause) {
  RateLimit limit;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(limit.take(start, 1s, 3));
  }
  EXPECT_FALSE(limit.take(start, 1s, 3));
  EXPECT_FALSE(limit.take(start + 999ms, 1s, 3));
  EXPECT_TRUE(limit.take(start + 1s, 1s, 3));
  EXPECT_FALSE(limit.take(start + 1s, 1s, 3));
  EXPECT_FALSE(limit.take(start + 3s, 1s, 3, 3));  // two pauses for three
  EXPECT_TRUE(limit.take(start + 4s, 1s, 3, 3));
  EXPECT_TRUE(limit.take(start + 1000s, 1s, 3, 3));  // what was not used is not saved up
  EXPECT_FALSE(limit.take(start + 1000s, 1s, 3));
}

class Rates : public testing::Test {
 protected:
  static Settings few() {
    Settings settings = fixed_settings();
    settings.max_entries_per_second = 10;
    settings.max_entries_at_once = 20;
    settings.reboot_pause = 5s;
    settings.max_reboots_at_once = 2;
    return settings;
  }
  void SetUp() override {
    ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
    machine.run_to(200ms);
  }
  Machine<> machine{few()};
  FakePeer client{client_sd};
  FakePeer other{Endpoint{IpAddress::v4(10, 0, 0, 3), 30490}};
};

TEST_F(Rates, LimitFindsAndSubscribesOfEachPeer) {
  std::size_t answers = 0;
  for (int i = 0; i < 50; ++i) {
    machine.unicast(client, {i % 2 == 0 ? find(0x1234) : subscribe(1, {udp(client_udp)})});
    answers += machine.sent().size();
  }
  EXPECT_EQ(answers, 20U);
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 30U);
  EXPECT_EQ(machine.discovery.counters().limits_reached[static_cast<std::size_t>(Limit::entries_per_second)],
            30U);
  machine.unicast(other, {find(0x1234)});  // has a measure of its own
  EXPECT_THAT(machine.sent(), SizeIs(1));
  machine.run_to(300ms);
  machine.unicast(client, {find(0x1234), find(0x1234)});
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 31U);
}

TEST_F(Rates, LimitWhatAPeerWithdrawsAndChanges) {
  const auto changes = [&](int times, const std::function<FakePeer::Said(int)>& said) {
    machine.now += 10s;
    machine.multicast(client, {offer({udp(client_udp)}, 300)});
    const std::uint32_t before = machine.discovery.remote_changes();
    for (int i = 0; i < times; ++i) {
      machine.multicast(client, {said(i)});
    }
    return machine.discovery.remote_changes() - before;
  };
  // Each end counts twice: when the service is lost, and when nobody needs to be told of it any more.
  EXPECT_EQ(changes(100, [](int i) { return offer({udp(client_udp)}, i % 2 == 0 ? 0 : 300); }), 3U * 20);
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 30U);
  EXPECT_EQ(changes(100,
                    [](int i) {
                      return offer({udp({client_udp.address, static_cast<std::uint16_t>(1 + i)})}, 300);
                    }),
            3U * 20);
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 30U + 80);
  EXPECT_EQ(changes(100, [](int /*i*/) { return offer({udp(client_udp)}, 300); }), 0U) << "as before";
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 30U + 80);
}

TEST_F(Rates, CountARefusedSubscriptionAsFour) {
  covers({"feat_req_someipsd_1137"});
  std::size_t nacks = 0;
  for (int i = 0; i < 50; ++i) {
    machine.unicast(client, {subscribe(0x99, {udp(client_udp)})});
    nacks += machine.sent().size();
  }
  EXPECT_EQ(nacks, 5U);
}

// By its ports: all of an address have one, and a peer that is forgotten leaves no new allowance behind.
TEST_F(Rates, AreNotEscapedByChangingThePort) {
  std::size_t answers = 0;
  for (std::uint16_t port = 1; port <= 2000; ++port) {
    FakePeer one{Endpoint{client_sd.address, port}};
    machine.unicast(one, {find(0x1234)});
    answers += machine.sent().size();
    machine.now += 1us;
  }
  EXPECT_EQ(answers, optimised_for_many ? 20U : 16U * 20U);
}

TEST_F(Rates, LimitRebootsOfEachPeer) {
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  machine.events();
  std::size_t reboots = 0;
  for (int i = 0; i < 20; ++i) {
    machine.unicast(client, {find(0x9999)});  // else its first message would come twice
    client.reboot();
    machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
    reboots += machine.events().empty() ? 0 : 1;
  }
  EXPECT_EQ(reboots, 2U);
  EXPECT_EQ(machine.discovery.counters().reboots_detected, 2U);
  EXPECT_EQ(machine.discovery.counters().dropped_reboots, 18U);
  machine.run_to(6s);
  client.reboot();
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("rebooted"), HasSubstr("added")));
}

// Somebody who sends in a peer's name cannot end what that has with us again and again: its own messages are
// none of a reboot.
TEST_F(Rates, KeepWhatAPeerHasFromForgedReboots) {
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  for (int i = 0; i < 10; ++i) {
    machine.unicast(client, {find(0x9999)});
  }
  machine.events();
  FakePeer forger{client_sd};
  for (int i = 0; i < 100; ++i) {
    forger.reboot();
    machine.unicast(forger, {find(0x9999)});
    machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
    machine.now += 10ms;
  }
  EXPECT_EQ(machine.discovery.counters().reboots_detected, 2U);
}

// A server that refuses and takes us in turn, unasked.
TEST(AnswersToUs, ChangeASubscriptionOnlySoOften) {
  Settings settings = fixed_settings();
  settings.max_entries_per_second = 10;
  settings.max_entries_at_once = 20;
  Machine<> machine{settings};
  FakePeer server{server_sd};
  const auto requirement = machine.discovery.require(required, machine.now).value();
  ASSERT_TRUE(
      machine.discovery.subscribe(requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp}, machine.now));
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.sent();
  machine.events();
  std::size_t told = 0;
  for (int i = 0; i < 50; ++i) {
    machine.unicast(server, {ack(1), ack(1, {}, 0)});
    machine.sent();
    told += machine.events().size();
  }
  EXPECT_EQ(told, 21U) << "the first one is the answer to a question";
  EXPECT_GT(machine.discovery.counters().ignored_too_many, 30U);
  machine.run_to(2500ms);
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

// Answers that change nothing, and the first one to a question, cost nothing.
TEST(AnswersToUs, AreTakenFromWhoHasUsedUpItsAllowance) {
  Settings settings = fixed_settings();
  settings.max_entries_per_second = 1;
  settings.max_entries_at_once = 1;
  Machine<> machine{settings};
  FakePeer server{server_sd};
  machine.unicast(server, {find(0x9999), find(0x9999)});
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 1U);
  const auto requirement = machine.discovery.require(required, machine.now).value();
  for (std::uint16_t i = 1; i <= 16; ++i) {
    ASSERT_TRUE(machine.discovery.subscribe(requirement, {.eventgroup = EventgroupId{i}, .udp = own_udp},
                                            machine.now));
  }
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.sent();
  machine.events();
  for (int repetition = 0; repetition < 3; ++repetition) {
    for (std::uint16_t i = 1; i <= 16; ++i) {
      machine.unicast(server, {ack(i)});
    }
    EXPECT_THAT(machine.events(), SizeIs(repetition == 0 ? 16 : 0));
  }
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 1U);
}

TEST_F(Rates, LimitStopSubscribes) {
  covers({"feat_req_someipsd_1297"});
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  machine.events();
  for (std::uint16_t i = 0; i < 19; ++i) {
    machine.unicast(client, {subscribe(0x99, {udp(client_udp)}, 0)});
  }
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 0U);
  machine.unicast(client,
                  {subscribe(1, {udp(client_udp)}, 0)});  // one more: the first Subscribe counted, too
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 1U);
  machine.now += 1s;
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 0)});
  EXPECT_THAT(machine.events(), SizeIs(1)) << "it stops";
}

TEST(AnswersToUs, AreCountedFromWhoOffersNothing) {
  Machine<> machine;
  FakePeer stranger{Endpoint{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.unicast(stranger, {ack(1), ack(1, {}, 0)});
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 2U);
}

TEST(UsualTraffic, StaysBelowTheRates) {
  Machine<Limits{.max_offers = 1000,
                 .max_eventgroups = 1000,
                 .max_subscribers = 2000,
                 .max_pending_entries = 4000,
                 .max_pending_events = 4000}>
      machine;
  std::vector<OfferHandle> offers;
  const std::array group{Eventgroup{.id = EventgroupId{1}}};
  for (std::uint16_t i = 1; i <= 1000; ++i) {
    OfferedService service = udp_service;
    service.service = ServiceId{i};
    service.eventgroups = group;
    ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  }
  machine.run_to(200ms);
  // A client of all services: it looks for them as often as the specification lets it, subscribes with each
  // offer, of the repetition phase too, and is started anew some times.
  FakePeer client{client_sd};
  for (int life = 0; life < 3; ++life) {
    client.reboot();
    for (int repetition = 0; repetition < 4; ++repetition) {
      for (std::uint16_t i = 1; i <= 1000; ++i) {
        machine.multicast(client, {find(i)});
        FakePeer::Said said = subscribe(1, {udp(client_udp)});
        said.entry.service = ServiceId{i};
        machine.unicast(client, {said});
        machine.sent();
        machine.events();
      }
      machine.now += 60ms;
    }
    machine.now += 4s;
  }
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 0U);
  EXPECT_EQ(machine.discovery.counters().dropped_reboots, 0U);
}

// One host offers 1,000 services at once, repeats that as the specification has it, withdraws them and is
// started anew some times: all are taken.
TEST(UsualTraffic, MayOfferAThousandServicesAtOnce) {
  Machine<Limits{.max_remote_services = 1000}> machine;
  FakePeer server{client_sd};
  const auto known = [&] {
    std::size_t count = 0;
    machine.discovery.for_each_remote([&](const slots::Remote&) { ++count; });
    return count;
  };
  for (int life = 0; life < 3; ++life) {
    server.reboot();
    for (int time = 0; time < 5; ++time) {
      for (std::uint16_t i = 1; i <= 1000; ++i) {
        machine.multicast(server, {offer({udp(client_udp)}, 3, i)});
      }
      EXPECT_EQ(known(), 1000U);
      machine.now += 30ms;
    }
    for (std::uint16_t i = 1; i <= 1000; ++i) {
      machine.multicast(server, {offer({udp(client_udp)}, 0, i)});
    }
    EXPECT_EQ(known(), 0U);
  }
  EXPECT_EQ(machine.discovery.counters().ignored_too_many, 0U);
}

}  // namespace
}  // namespace trestle::sd::rates_test
