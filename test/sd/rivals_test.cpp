// Two servers that offer the same instance: whoever answers is kept, which is a guard.
#include <gmock/gmock.h>

#include <algorithm>
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
  both_offer(3);
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

}  // namespace
}  // namespace trestle::sd::rivals_test
