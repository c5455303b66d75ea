// Several nodes discover each other over a simulated network.
#include <gmock/gmock.h>

#include "test/covers.hpp"
#include "test/sd/describe.hpp"
#include "test/sim/network.hpp"

namespace trestle::sd::sd_network_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using test::SimNetwork;
using test::SimNode;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

IpAddress host(unsigned number) {
  return IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(number));
}

Settings settings_of(unsigned number) {
  Settings settings;
  settings.unicast = {host(number), 30490};
  settings.subnet_prefix_bits = 24;
  return settings;
}

constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}};

// Offers instance `number` of service 0x1234, with eventgroup 1.
SimNode::Application server(unsigned number) {
  return [number](SimNode& node, TimePoint now) {
    const std::string name = std::to_string(number);
    const std::array<ConfigurationItem, 3> said{
        {{"number", name}, {"flag", std::nullopt}, {"number", "again"}}};
    const auto offer = node.discovery().offer(
        {.service = ServiceId{0x1234},
         .instance = InstanceId{static_cast<std::uint16_t>(number)},
         .udp = Endpoint{host(number), 30509},
         .eventgroups = groups,
         .configuration = said,
         .options = {.load_balancing = LoadBalancingOption{.priority = 1, .weight = 1}}},
        now);
    ASSERT_TRUE(offer);
  };
}

// Requires that service and subscribes to eventgroup 1 of the given instances.
SimNode::Application client(unsigned number, const std::vector<std::uint16_t>& instances) {
  return [number, instances](SimNode& node, TimePoint now) {
    for (const std::uint16_t instance : instances) {
      const auto requirement =
          node.discovery().require({.service = ServiceId{0x1234}, .instance = InstanceId{instance}}, now);
      ASSERT_TRUE(requirement);
      ASSERT_TRUE(node.discovery().subscribe(
          *requirement, {.eventgroup = EventgroupId{1}, .udp = Endpoint{host(number), 40000}}, now));
    }
  };
}

std::size_t subscribers_at(SimNode& node) {
  std::size_t count = 0;
  node.discovery().for_each_subscriber(OfferHandle{0, 1}, EventgroupId{1},
                                       [&](const Subscriber&) { ++count; });
  return count;
}

// What a client knows about an instance of the service.
std::vector<std::string> configuration_of(SimNode& node, std::uint16_t instance, TimePoint now) {
  const auto requirement =
      node.discovery().require({.service = ServiceId{0x1234}, .instance = InstanceId{instance}}, now);
  const auto service = requirement ? node.discovery().choose(*requirement) : std::nullopt;
  std::vector<std::string> items;
  if (service) {
    ConfigurationCursor cursor = node.discovery().configuration(service->handle);
    while (const auto item = cursor.next()) {
      items.push_back(std::string{item->key} + (item->value ? "=" + std::string{*item->value} : ""));
    }
    node.discovery().release(*requirement, now);
  }
  return items;
}

class SdNetwork : public testing::Test {
 protected:
  SimNetwork network{1};
};

TEST_F(SdNetwork, JoinsServerAndClient) {
  covers(
      {"feat_req_someipsd_442", "feat_req_someipsd_634", "feat_req_someipsd_811", "feat_req_someipsd_812"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(250ms);
  EXPECT_THAT(b.log, ElementsAre(HasSubstr("available 1234.0001"), EndsWith("subscribed")));
  EXPECT_THAT(a.log, ElementsAre(HasSubstr("added 0001 udp 10.0.0.2:40000")));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, ServesALateClientWithoutWaitingForTheCycle) {
  covers({"feat_req_someipsd_824"});
  SimNode& a = network.add(settings_of(1), server(1));
  network.run_for(10s + 300ms);
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(150ms);  // 100 ms initial delay and 10 ms response delay at most; offers come each second
  EXPECT_THAT(b.subscribed, SizeIs(1));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, ServesAClientThatWaitsForTheServer) {
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(1h);
  EXPECT_EQ(network.sent, 4U);  // its Finds
  network.add(settings_of(1), server(1));
  network.run_for(150ms);
  EXPECT_THAT(b.subscribed, SizeIs(1));
}

TEST_F(SdNetwork, IsQuietAndSteadyForAnHour) {
  covers({"feat_req_someipsd_842", "feat_req_someipsd_631"});
  network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  SimNode& c = network.add(settings_of(3), client(3, {1}));
  network.run_for(1h);
  EXPECT_THAT(b.log, SizeIs(2));
  EXPECT_THAT(c.log, SizeIs(2));
  // Each second an Offer, two Subscribes and two Acks.
  EXPECT_GT(network.sent, 5U * 3590U);
  EXPECT_LT(network.sent, 5U * 3600U + 50U);
  EXPECT_EQ(network.malformed, 0U);
}

TEST_F(SdNetwork, GetsThroughHeavyLoss) {
  covers({"feat_req_someipsd_842"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.conditions.loss_percent = 30;
  network.run_for(1min);
  network.conditions.loss_percent = 0;
  network.run_for(5s);
  EXPECT_THAT(b.subscribed, SizeIs(1));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, LosesAndRegainsAServerThatIsCutOff) {
  covers({"feat_req_someipsd_842", "feat_req_someipsd_632"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(5s);
  b.log.clear();
  network.cut(a, true);
  network.run_for(5s);
  EXPECT_THAT(b.log,
              ElementsAre(EndsWith("subscription lost expired"), HasSubstr("lost 1234.0001 v1 expired")));
  EXPECT_EQ(subscribers_at(a), 0U);
  network.cut(a, false);
  network.run_for(1100ms);
  EXPECT_THAT(b.subscribed, SizeIs(1));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, SeesAServerReboot) {
  covers({"feat_req_someipsd_863", "feat_req_someipsd_871"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(5s);
  b.log.clear();
  a.start(network.now);
  network.run_for(500ms);
  EXPECT_THAT(b.log,
              ElementsAre(EndsWith("subscription lost rebooted"), HasSubstr("lost 1234.0001 v1 rebooted"),
                          HasSubstr("available"), EndsWith("subscribed")));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, SeesAClientReboot) {
  covers({"feat_req_someipsd_863", "feat_req_someipsd_871"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(5s);
  a.log.clear();
  b.start(network.now);
  network.run_for(500ms);
  EXPECT_THAT(a.log, ElementsAre(HasSubstr("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 rebooted"),
                                 HasSubstr("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial")));
  EXPECT_EQ(subscribers_at(a), 1U);
}

TEST_F(SdNetwork, CleansUpAfterAClientThatCrashed) {
  covers({"feat_req_someipsd_445"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  network.run_for(5s);
  b.crash();
  network.run_for(4s);
  EXPECT_EQ(subscribers_at(a), 0U);
  EXPECT_THAT(a.log.back(), EndsWith("expired"));
}

TEST_F(SdNetwork, SharesTheLoadByPriorityAndWeight) {
  covers({"feat_req_someipsd_146", "feat_req_someipsd_175"});
  const auto ranked_server = [](unsigned number, std::uint16_t priority, std::uint16_t weight) {
    return [=](SimNode& node, TimePoint now) {
      ASSERT_TRUE(node.discovery().offer(
          {.service = ServiceId{0x1234},
           .instance = InstanceId{static_cast<std::uint16_t>(number)},
           .udp = Endpoint{host(number), 30509},
           .options = {.load_balancing = LoadBalancingOption{.priority = priority, .weight = weight}}},
          now));
    };
  };
  network.conditions = {.delay_min = 100us, .delay_max = 50ms, .loss_percent = 20, .duplication_percent = 5};
  SimNode& one = network.add(settings_of(1), ranked_server(1, 1, 1));
  SimNode& two = network.add(settings_of(2), ranked_server(2, 1, 4));
  network.add(settings_of(3), ranked_server(3, 2, 100));
  std::vector<SimNode*> clients;
  std::vector<RequirementHandle> requirements(50);
  for (unsigned i = 0; i < requirements.size(); ++i) {
    clients.push_back(&network.add(settings_of(10 + i), [&requirements, i](SimNode& node, TimePoint now) {
      const auto requirement = node.discovery().require({.service = ServiceId{0x1234}}, now);
      ASSERT_TRUE(requirement);
      requirements[i] = *requirement;
    }));
  }
  // How many clients choose each server.
  const auto shares = [&] {
    std::map<unsigned, unsigned> counts;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      const auto chosen = clients[i]->discovery().choose(requirements[i]);
      ++counts[chosen ? value(chosen->instance) : 0U];
    }
    return counts;
  };
  network.run_for(5s);
  std::map<unsigned, unsigned> counts = shares();
  EXPECT_EQ(counts[1] + counts[2], 50U);
  EXPECT_GT(counts[2], counts[1]);
  EXPECT_GT(counts[1], 0U);
  network.conditions = {};
  network.run_for(5s);
  two.crash();
  network.run_for(10s);
  EXPECT_EQ(shares(), (std::map<unsigned, unsigned>{{1, 50}}));
  one.discovery().shutdown(network.now);
  network.run_for(10s);
  EXPECT_EQ(shares(), (std::map<unsigned, unsigned>{{3, 50}}));
}

TEST_F(SdNetwork, PartsInPeace) {
  covers({"feat_req_someipsd_821", "feat_req_someipsd_831", "feat_req_someipsd_834"});
  SimNode& a = network.add(settings_of(1), server(1));
  SimNode& b = network.add(settings_of(2), client(2, {1}));
  SimNode& c = network.add(settings_of(3), client(3, {1}));
  network.run_for(5s);
  c.discovery().shutdown(network.now);
  network.run_for(10ms);
  EXPECT_EQ(subscribers_at(a), 1U);
  a.discovery().shutdown(network.now);
  network.run_for(10ms);
  EXPECT_THAT(b.available, IsEmpty());
  EXPECT_THAT(b.subscribed, IsEmpty());
  const std::size_t sent = network.sent;
  network.run_for(1h);
  EXPECT_EQ(network.sent, sent);
}

// Three servers and three clients through a minute of loss, duplication, reordering, cuts and crashes.
// Whatever happened, ten calm seconds later everybody must know everybody.
void run_chaos(std::uint64_t seed) {
  SimNetwork network{seed};
  std::vector<SimNode*> servers;
  std::vector<SimNode*> clients;
  for (unsigned number = 1; number <= 3; ++number) {
    servers.push_back(&network.add(settings_of(number), server(number)));
    clients.push_back(&network.add(settings_of(number + 10), client(number + 10, {1, 2, 3})));
  }
  std::vector<SimNode*> all{servers};
  all.insert(all.end(), clients.begin(), clients.end());
  network.conditions = {.delay_min = 100us, .delay_max = 300ms, .loss_percent = 20, .duplication_percent = 5};
  for (int i = 0; i < 60; ++i) {
    SimNode& victim = *all[static_cast<std::size_t>(network.random().next() % all.size())];
    switch (network.random().next() % 6) {
      case 0:
        victim.start(network.now);
        break;
      case 1:
        victim.crash();
        break;
      case 2:
        network.cut(victim, true);
        break;
      case 3:
        network.cut(victim, false);
        break;
      case 4:
        if (victim.running()) {
          victim.discovery().link_down();
          network.run_for(200ms);
          victim.discovery().link_up(network.now);
        }
        break;
      default:
        break;
    }
    network.run_for(1s);
  }
  network.conditions = {};
  for (SimNode* node : all) {
    network.cut(*node, false);
    if (!node->running()) {
      node->start(network.now);
    }
  }
  network.run_for(10s);
  EXPECT_EQ(network.malformed, 0U);
  for (SimNode* node : servers) {
    EXPECT_EQ(subscribers_at(*node), 3U);
    EXPECT_EQ(node->added, 3U);
  }
  for (SimNode* node : clients) {
    EXPECT_THAT(node->available, SizeIs(3));
    EXPECT_THAT(node->subscribed, SizeIs(3));
    for (std::uint16_t instance = 1; instance <= 3; ++instance) {
      EXPECT_THAT(configuration_of(*node, instance, network.now),
                  ElementsAre("number=" + std::to_string(instance), "flag", "number=again"));
    }
  }
}

TEST(SdNetworkInChaos, ComesToRest) {
  covers({"feat_req_someipsd_842", "feat_req_someipsd_764", "feat_req_someipsd_844"});
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    run_chaos(seed);
    if (testing::Test::HasFailure()) {
      return;
    }
  }
}

TEST(SdNetworkInChaos, IsTheSameForTheSameSeed) {
  const auto log_of = [](std::uint64_t seed) {
    SimNetwork network{seed};
    network.add(settings_of(1), server(1));
    SimNode& b = network.add(settings_of(2), client(2, {1}));
    network.conditions = {.delay_min = 1ms, .delay_max = 50ms, .loss_percent = 30, .duplication_percent = 10};
    network.run_for(30s);
    return b.log;
  };
  EXPECT_EQ(log_of(3), log_of(3));
  EXPECT_NE(log_of(3), log_of(4));
}

}  // namespace
}  // namespace trestle::sd::sd_network_test
