// Two servers that offer the same instance: whoever answers is kept, which is a guard.
#include <gmock/gmock.h>

#include "test/sd/client_fixture.hpp"

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

}  // namespace
}  // namespace trestle::sd::rivals_test
