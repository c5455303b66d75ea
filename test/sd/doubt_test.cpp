// Whether a subscription is that of the host in whose name it comes.
#include <gmock/gmock.h>

#include <random>

#include "test/sd/server_fixture.hpp"

namespace trestle::sd::doubt_test {
namespace {
using namespace test;
using testing::Contains;
using testing::HasSubstr;

class Doubt : public Server {
 protected:
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device takes each subscription for a proof";
    }
    offer(udp_service);
  }
  /// To two eventgroups, in two messages, as some stacks do.
  void subscribe_both() {
    machine.unicast(client, {subscribe(1, {udp(client_udp)})});
    machine.unicast(client, {subscribe(2, {udp(client_udp)})});
    machine.events();
  }
  [[nodiscard]] bool is_proven() const { return machine.discovery.is_proven(client_udp.address); }
  /// A client that subscribes 3 ms after each offer that it hears.
  /// @return how many offers it was sent by unicast
  int listen(Duration time) {
    int alone = 0;
    for (const TimePoint end = machine.now + time; machine.now < end;) {
      for (const std::string& sent : machine.run_to(machine.now - start + 1ms)) {
        if (sent.find(": offer") == std::string::npos) {
          continue;
        }
        alone += sent.find("-> 10.0.0.2") != std::string::npos ? 1 : 0;
        machine.run_to(machine.now - start + 3ms);
        subscribe_both();
      }
    }
    return alone;
  }
};

TEST_F(Doubt, IsOverSoonForWhoHearsTheOffers) {
  EXPECT_EQ(listen(3s), 0);
  EXPECT_FALSE(is_proven());
  machine.discovery.doubt(client_udp.address);
  EXPECT_LE(listen(6s), 10);
  EXPECT_TRUE(is_proven());
  EXPECT_EQ(listen(10s), 0) << "it is asked no more";
  machine.discovery.doubt(client_udp.address);
  EXPECT_EQ(listen(10s), 0);
  EXPECT_TRUE(is_proven());
}

TEST_F(Doubt, MeansNobodyElse) {
  machine.discovery.doubt(IpAddress::v4(10, 0, 0, 9));
  EXPECT_EQ(listen(5s), 0);
}

TEST_F(Doubt, EndsWithTheSubscription) {
  subscribe_both();
  machine.discovery.doubt(client_udp.address);
  listen(6s);
  EXPECT_TRUE(is_proven());
  machine.run_to(machine.now - start + 10s);
  machine.events();
  EXPECT_FALSE(is_proven()) << "nobody has it any more";
}

TEST_F(Doubt, NeedsNoAnswerFromWhoHasAConnection) {
  machine.discovery.tcp_connected(service_tcp, client_tcp);
  EXPECT_TRUE(is_proven());
}

TEST_F(Doubt, CountsWhoIsConfiguredAsProven) {
  ASSERT_TRUE(machine.discovery.add_subscriber(offered, EventgroupId{1}, client_udp));
  EXPECT_TRUE(is_proven());
}

// Somebody speaks in the client's name and hears only what all hear. It does not matter how often it speaks.
class ForgerInDoubt : public Doubt, public testing::WithParamInterface<int> {};

TEST_P(ForgerInDoubt, ProvesNothing) {
  std::minstd_rand dice{1};
  machine.discovery.doubt(client_udp.address);
  subscribe_both();
  machine.discovery.doubt(client_udp.address);
  int asked = 0;
  for (const TimePoint end = machine.now + 60s; machine.now < end;) {
    const int pause = GetParam() > 0 ? GetParam() : 20 + static_cast<int>(dice() % 1500);
    for (const std::string& sent : machine.run_to(machine.now - start + 1ms * pause)) {
      asked +=
          sent.find("-> 10.0.0.2") != std::string::npos && sent.find(": offer") != std::string::npos ? 1 : 0;
    }
    subscribe_both();
    ASSERT_FALSE(is_proven()) << (machine.now - start) / 1s;
  }
  EXPECT_GE(asked, 5);
  EXPECT_LE(asked, 70);
}

INSTANTIATE_TEST_SUITE_P(WithPausesOfMilliseconds, ForgerInDoubt,
                         testing::Values(5, 10, 40, 70, 330, 999, 0));

}  // namespace
}  // namespace trestle::sd::doubt_test
