// Which instance is chosen among several.
#include <gmock/gmock.h>

#include <map>

#include "test/covers.hpp"
#include "test/sd/configured_fixture.hpp"

namespace trestle::sd::load_balancing_test {
namespace {
using namespace test;
using testing::SizeIs;

class Balanced : public Configured {
 protected:
  void offers(std::uint16_t instance, std::string_view rank_bytes) {
    FakePeer::Said said = offer({udp(peer_udp)}, 3, 0x1234, instance);
    if (!rank_bytes.empty()) {
      said.more.push_back(rank(rank_bytes));
    }
    machine.unicast(peer, {said});
  }
  // How often each instance is chosen in a thousand draws.
  std::map<unsigned, int> draw(RequirementHandle requirement) {
    std::map<unsigned, int> counts;
    for (int i = 0; i < 1000; ++i) {
      const auto chosen = machine.discovery.choose(requirement);
      EXPECT_TRUE(chosen);
      ++counts[chosen ? value(chosen->instance) : 0];
    }
    return counts;
  }
};

TEST_F(Balanced, ChoosesTheLowestPriorityAndThenByWeight) {
  covers({"feat_req_someipsd_146", "feat_req_someipsd_175"});
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  EXPECT_FALSE(machine.discovery.choose(*requirement));
  offers(1, "00 0002 ffff");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{1, 1000}}));
  offers(2, "00 0001 0001");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{2, 1000}}));
  offers(3, "00 0001 0003");
  offers(4, "00 0001 0000");  // not while others have a weight
  offers(5, "");              // without rank: after all others
  const auto counts = draw(*requirement);
  ASSERT_THAT(counts, SizeIs(2));
  EXPECT_NEAR(counts.at(2), 250, 60);
  EXPECT_NEAR(counts.at(3), 750, 60);
}

TEST_F(Balanced, ChoosesEvenlyWithoutWeights) {
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  for (std::uint16_t instance = 1; instance <= 4; ++instance) {
    offers(instance, instance == 4 ? "00 ffff 0000" : "");
  }
  const auto counts = draw(*requirement);
  ASSERT_THAT(counts, SizeIs(4));
  for (const auto& [instance, count] : counts) {
    EXPECT_NEAR(count, 250, 60) << instance;
  }
}

TEST_F(Balanced, ChoosesAmongWhatFitsAlone) {
  const auto requirement =
      machine.discovery.require({.service = ServiceId{0x1234}, .instance = InstanceId{2}}, machine.now);
  const auto other = machine.discovery.require({.service = ServiceId{0x4321}}, machine.now);
  ASSERT_TRUE(requirement && other);
  offers(1, "00 0000 0001");
  offers(2, "00 0009 0001");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{2, 1000}}));
  EXPECT_FALSE(machine.discovery.choose(*other));
  EXPECT_FALSE(machine.discovery.choose({}));
}

TEST(BalancedOtherwise, RanksTheUnrankedAsTold) {
  Settings settings = fixed_settings();
  settings.unranked = {.priority = 0, .weight = 1};
  Machine<> machine{settings};
  FakePeer peer{peer_sd};
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  machine.unicast(peer, {with(offer({udp(peer_udp)}, 3, 0x1234, 1), {rank("00 0001 0001")}),
                         offer({udp(peer_udp)}, 3, 0x1234, 2)});
  const auto chosen = machine.discovery.choose(*requirement);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->instance, InstanceId{2});
}

}  // namespace
}  // namespace trestle::sd::load_balancing_test
