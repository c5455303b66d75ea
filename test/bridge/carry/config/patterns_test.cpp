// Patterns of topics, and what the lock file has to do with them.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::patterns_test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using carry::BridgeConfig;
using carry::Direction;
using carry::TopicPattern;
using someip::ServiceId;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// Line 5 is the first that is the pattern's own.
std::string with(const std::string& keys, const std::string& more = "") {
  return "someip: {address: 127.0.0.1}\nlock_file: none.lock\npatterns:\n  - topics: /s/**\n    " + keys +
         "\n" + more;
}
std::string outbound_with(const std::string& keys, const std::string& more = "") {
  return with("direction: dds_to_someip\n    services: 0x6000-0x6fff\n    port: 40001\n    " + keys, more);
}

TEST(PatternKeys, HaveDefaults) {
  const BridgeConfig config = config_of(outbound_with(""));
  ASSERT_EQ(config.patterns.size(), 1U);
  const TopicPattern& pattern = config.patterns[0];
  EXPECT_EQ(pattern.topics, "/s/**");
  EXPECT_THAT(pattern.exclude, testing::IsEmpty());
  EXPECT_EQ(pattern.services, (carry::ServiceRange{ServiceId{0x6000}, ServiceId{0x6fff}}));
  EXPECT_EQ(pattern.max_routes, 200U);
  EXPECT_TRUE(pattern.follow_reliability);
  EXPECT_TRUE(pattern.follow_durability);
  EXPECT_EQ(pattern.route.direction, Direction::dds_to_someip);
  EXPECT_EQ(pattern.route.instance, someip::InstanceId{1});
  EXPECT_EQ(pattern.route.eventgroup, someip::EventgroupId{1});
  EXPECT_EQ(pattern.route.event, someip::MethodId{0x8001});
  EXPECT_EQ(pattern.route.port, 40001);
  EXPECT_EQ(pattern.route.major, 1);
  EXPECT_TRUE(pattern.route.presence.offer_while_published);
  EXPECT_EQ(config.lock_file, "none.lock");
  EXPECT_THAT(config.locked, testing::IsEmpty());
  EXPECT_THAT(config.routes, testing::IsEmpty());
}

TEST(PatternKeys, AllArrive) {
  const BridgeConfig config = config_of(
      "someip: {address: 127.0.0.1}\nlock_file: /tmp/none.lock\npatterns:\n"
      "  - {topics: rt/s/*/x*, exclude: [/s/a/**, rt/s/b/x], direction: dds_to_someip, services: 24576 - "
      "0x6001,\n"
      "     max_routes: 7, instance: 2, eventgroup: 3, event: 0x8004, port: 40005, major: 6, minor: 7,\n"
      "     transport: tcp, wire: {byte_order: little}, tp: {max_message: 1 MiB}, qos: {depth: 3}}\n"
      "  - {topics: /t, direction: someip_to_dds, port: 40006, write: always, subscribe: while_read}\n");
  ASSERT_EQ(config.patterns.size(), 2U);
  const TopicPattern& pattern = config.patterns[0];
  EXPECT_EQ(pattern.topics, "/s/*/x*");
  EXPECT_THAT(pattern.exclude, ElementsAre("/s/a/**", "/s/b/x"));
  EXPECT_EQ(pattern.services, (carry::ServiceRange{ServiceId{0x6000}, ServiceId{0x6001}}));
  EXPECT_EQ(pattern.max_routes, 7U);
  EXPECT_EQ(pattern.route.instance, someip::InstanceId{2});
  EXPECT_EQ(pattern.route.eventgroup, someip::EventgroupId{3});
  EXPECT_EQ(pattern.route.event, someip::MethodId{0x8004});
  EXPECT_EQ(pattern.route.port, 40005);
  EXPECT_EQ(pattern.route.major, 6);
  EXPECT_EQ(pattern.route.minor, 7U);
  EXPECT_EQ(pattern.route.transport, Transport::tcp);
  EXPECT_EQ(pattern.route.rules.payload.byte_order, std::endian::little);
  EXPECT_EQ(pattern.route.tp.max_message, std::size_t{1} << 20U);
  EXPECT_EQ(pattern.route.qos.depth, 3U);
  EXPECT_TRUE(pattern.follow_reliability);
  EXPECT_EQ(config.patterns[1].route.presence, (carry::Presence{.subscribe_while_read = true}));
  EXPECT_EQ(config.patterns[1].route.port, 40006);
  EXPECT_EQ(config.patterns[1].route.minor, sd::any_minor);
  EXPECT_EQ(config_of(with("direction: someip_to_dds")).patterns[0].route.presence,
            (carry::Presence{.write_while_offered = true}));
}

TEST(PatternKeys, FollowThePublishersInWhatIsNotGiven) {
  const auto follows = [](const std::string& qos) {
    const TopicPattern pattern = config_of(outbound_with("qos: {" + qos + "}")).patterns.at(0);
    return std::pair{pattern.follow_reliability, pattern.follow_durability};
  };
  EXPECT_EQ(follows("depth: 1"), (std::pair{true, true}));
  EXPECT_EQ(follows("reliability: best_effort"), (std::pair{false, false})) << "is volatile";
  EXPECT_EQ(follows("reliability: reliable"), (std::pair{false, true}));
  EXPECT_EQ(follows("reliability: as_published, durability: as_published"), (std::pair{true, true}));
  EXPECT_EQ(follows("durability: volatile"), (std::pair{true, false}));
  EXPECT_EQ(follows("durability: transient_local"), (std::pair{false, false}));
}

TEST(PatternKeys, SayWhatIsExpected) {
  EXPECT_THAT(
      problems_of(with("direction: dds_to_someip")),
      ElementsAre("b.yaml:4:5: error: pattern: 'services' is missing: expected a range of ids such as "
                  "0x6000-0x6fff, within 0x0001 to 0xfffd",
                  HasSubstr("b.yaml:4:5: error: pattern: 'port' is missing")));
  for (const char* const range : {"0x6000", "0x6fff-0x6000", "0-5", "1-0xfffe", "1-2-3", "a-b", "6000-"}) {
    EXPECT_THAT(
        problems_of(with("direction: dds_to_someip\n    port: 40001\n    services: " + std::string{range})),
        ElementsAre(HasSubstr("b.yaml:7:15: error: services: expected a range of ids")))
        << range;
  }
  EXPECT_THAT(problems_of(outbound_with("max_routes: 1001\n    exclude: [/a, b]\n    event: 0x8000")),
              ElementsAre(HasSubstr("b.yaml:8:17: error: max_routes: expected a whole number from 1 to 1000"),
                          HasSubstr("b.yaml:9:19: error: exclude: expected a pattern of topics"),
                          HasSubstr("b.yaml:10:12: error: event: expected an id from 0x8001 to 0xfffe")));
  EXPECT_THAT(problems_of(outbound_with("write: always")), ElementsAre(HasSubstr("unknown key 'write'")));
  EXPECT_THAT(problems_of(outbound_with("service: 0x6000")),
              ElementsAre(HasSubstr("unknown key 'service' in pattern; did you mean 'services'?")));
  EXPECT_THAT(problems_of(with("direction: someip_to_dds\n    services: 1-2")),
              ElementsAre(HasSubstr("b.yaml:6:5: error: unknown key 'services' in pattern")));
  EXPECT_THAT(
      problems_of(with("direction: someip_to_dds\n    offer: always")),
      ElementsAre(HasSubstr("b.yaml:6:12: error: offer: is for routes with direction: dds_to_someip")));
  EXPECT_THAT(
      problems_of("someip: {address: 127.0.0.1}\npatterns: [{topics: /a, direction: someip_to_dds}]\n"),
      ElementsAre(HasSubstr("b.yaml:1:1: error: 'lock_file' is missing: expected the file that keeps")));
  EXPECT_THAT(problems_of(replaced(with("direction: someip_to_dds"), "none.lock", "/not/there/x.lock")),
              ElementsAre("b.yaml:2:12: error: lock_file: there is no folder '/not/there'"));
}

TEST(PatternKeys, ShareNoPortWithTheOtherDirection) {
  const std::string route =
      "routes:\n  - {topic: /r, type: std_msgs/msg/String, direction: someip_to_dds, service: 1, instance: "
      "1,\n"
      "     eventgroup: 1, event: 0x8001, port: 40001}\n";
  EXPECT_THAT(
      problems_of(outbound_with("", route)),
      ElementsAre("b.yaml:7:11: error: port: 40001 is used the other way (someip_to_dds) by the route in "
                  "line 10; take two ports"));
  EXPECT_THAT(
      problems_of(outbound_with("", "  - {topics: /t, direction: someip_to_dds, port: 40001}\n")),
      ElementsAre("b.yaml:9:50: error: port: 40001 is used the other way (dds_to_someip) by the pattern "
                  "in line 4; take two ports"));
  EXPECT_THAT(problems_of(replaced(outbound_with(""), "40001", "30490")),
              ElementsAre("b.yaml:7:11: error: port: 30490 is service discovery's own port"));
}

/// A configuration and its lock file in a folder.
class LockedPatterns : public testing::Test {
 protected:
  LockedPatterns() { fs::create_directories(folder_); }
  ~LockedPatterns() override { fs::remove_all(folder_); }

  auto load(const std::string& config, const std::string& topics, const carry::TypeCheck& check = {}) const {
    std::ofstream{folder_ + "none.lock"} << "version: 1\ntopics:\n" << topics;
    return carry::parse_config(config, folder_ + "b.yaml", check);
  }
  std::vector<std::string> problems(const std::string& config, const std::string& topics) const {
    const auto loaded = load(config, topics);
    std::vector<std::string> result = lines(loaded ? loaded->warnings : loaded.error());
    for (std::string& line : result) {
      for (std::size_t at = 0; (at = line.find(folder_)) != std::string::npos;) {
        line.erase(at, folder_.size());
      }
    }
    return result;
  }

  const std::string folder_ = testing::TempDir() + "trestle-patterns-" + std::to_string(getpid()) + "/";
};

const std::string locked_a = "  - {service: 0x6001, topic: /s/a, type: std_msgs/msg/String}\n";
const std::string locked_b = "  - {service: 0x6002, topic: /s/b, type: a_msgs/msg/B}\n";
const std::string locked_other = "  - {service: 0x7000, topic: /other, type: a_msgs/msg/B}\n";

TEST_F(LockedPatterns, MakeRoutesFromSomeipOfWhatIsLocked) {
  const auto loaded =
      load(with("direction: someip_to_dds\n    exclude: [/s/x]\n    instance: 5",
                "  - {topics: /s/c, direction: someip_to_dds, wire: {byte_order: little}}\n"
                "routes:\n  - {topic: /s/b, type: a_msgs/msg/B, direction: someip_to_dds, service: "
                "1, instance: 1, eventgroup: 1, event: 0x8001}\n"),
           locked_a + locked_b + locked_other +
               "  - {service: 0x6003, topic: /s/c, type: a_msgs/msg/B}\n"
               "  - {service: 0x6004, topic: /s/x, type: a_msgs/msg/B}\n");
  ASSERT_TRUE(loaded.has_value()) << to_string(loaded.error().front());
  const std::vector<carry::Route>& routes = loaded->config.routes;
  ASSERT_EQ(routes.size(), 3U);
  EXPECT_EQ(routes[0].topic, "/s/b") << "which has a route of its own";
  EXPECT_EQ(routes[0].service, ServiceId{1});
  EXPECT_EQ(routes[1].topic, "/s/a");
  EXPECT_EQ(routes[1].type, "std_msgs/msg/String");
  EXPECT_EQ(routes[1].service, ServiceId{0x6001});
  EXPECT_EQ(routes[1].instance, someip::InstanceId{5});
  EXPECT_TRUE(routes[1].presence.write_while_offered);
  EXPECT_EQ(routes[2].topic, "/s/c");
  EXPECT_EQ(routes[2].instance, someip::InstanceId{5}) << "the first pattern that matches counts";
  EXPECT_EQ(loaded->config.locked.size(), 5U);
}

TEST_F(LockedPatterns, MakeLatchedTopicsLatchedAgain) {
  const std::string latched =
      replaced(locked_a, "String}", "String, durability: transient_local}") + locked_b;
  const auto of = [&](const std::string& qos) {
    const auto loaded = load(with("direction: someip_to_dds\n    qos: {" + qos + "}"), latched);
    std::vector<bool> result;
    for (const carry::Route& route : loaded->config.routes) {
      result.push_back(route.qos.transient_local);
    }
    return result;
  };
  EXPECT_THAT(of("depth: 1"), ElementsAre(true, false));
  EXPECT_THAT(of("durability: volatile"), ElementsAre(false, false)) << "what is given counts";
  EXPECT_THAT(of("durability: transient_local"), ElementsAre(true, true));
  EXPECT_THAT(of("reliability: best_effort"), ElementsAre(false, false)) << "the two do not go together";
  const auto loaded = load(with("direction: someip_to_dds"), latched);
  EXPECT_THAT(carry::summary(loaded->config, {}), HasSubstr("reliable, durability as locked, keep last 10"));
  EXPECT_THAT(carry::summary(loaded->config, {}), HasSubstr("reliable, transient local, keep last 10"));
}

TEST_F(LockedPatterns, LeaveOutTypesThatAreNotKnownHere) {
  const auto loaded =
      load(with("direction: someip_to_dds"), locked_a + locked_b,
           [](const carry::TypeUse& use, const messages::MessageRules&, const messages::TypePlaces&) {
             return carry::TypeVerdict{.fault = use.type == "a_msgs/msg/B" ? "there is no a_msgs/msg/B" : ""};
           });
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->config.routes.size(), 1U);
  EXPECT_THAT(lines(loaded->warnings),
              ElementsAre(folder_ + "none.lock:4:5: warning: type: /s/b gets no route: "
                                    "there is no a_msgs/msg/B"));
}

TEST_F(LockedPatterns, ClashWithIdsThatOthersHave) {
  const std::string route =
      "routes:\n  - {topic: /r, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x6001, "
      "instance: 9,\n     eventgroup: 1, event: 0x8001}\n";
  EXPECT_THAT(
      problems(outbound_with("", route), locked_a),
      ElementsAre("b.yaml:2:12: error: lock_file: 'none.lock' does not match this configuration",
                  "none.lock:3:5: error: service: 0x6001 of /s/a also belongs to the route /r in line 10 "
                  "of b.yaml: give that one another id, or remove this line, so that /s/a gets a new id"));
  const std::string method =
      "methods:\n  - {ros_service: /m, type: std_srvs/srv/SetBool, server: someip, service: 0x6001, "
      "instance: 9,\n"
      "     method: 1}\n";
  EXPECT_THAT(problems(outbound_with("", method), locked_a),
              ElementsAre(testing::_, HasSubstr("also belongs to the method /m in line 10 of b.yaml")));
  // A topic that has got a route of its own since may keep its id.
  EXPECT_THAT(problems(outbound_with("", replaced(route, "/r", "/s/a")), locked_a), testing::IsEmpty());
}

TEST_F(LockedPatterns, ClashWithARangeThatIdsAreOutsideOf) {
  EXPECT_THAT(problems(replaced(outbound_with(""), "0x6000-0x6fff", "0x6002-0x6fff"),
                       locked_a + locked_b + locked_other),
              ElementsAre(testing::_,
                          "none.lock:3:5: error: service: 0x6001 of /s/a is outside of 0x6002-0x6fff, "
                          "the ids of the pattern in line 4 of b.yaml: widen that range, or remove this "
                          "line, so that the topic gets a new id"));
  EXPECT_THAT(problems(outbound_with(""), locked_a + locked_b + locked_other), testing::IsEmpty());
}

TEST_F(LockedPatterns, AreRefusedWithADamagedLockFile) {
  EXPECT_THAT(problems(outbound_with(""), locked_a + locked_a),
              ElementsAre("b.yaml:2:12: error: lock_file: 'none.lock' is not good",
                          HasSubstr("none.lock:4:5: error: topic: /s/a stands here twice"),
                          HasSubstr("none.lock:4:5: error: service: 0x6001 is that of /s/a")));
}

TEST_F(LockedPatterns, AreShownByCheck) {
  const auto loaded =
      load(outbound_with("exclude: [/s/x/**]", "  - {topics: /t/*, direction: someip_to_dds}\n"),
           locked_a + locked_other + "  - {service: 0x1234, topic: /t/q, type: a_msgs/msg/B}\n");
  ASSERT_TRUE(loaded.has_value()) << to_string(loaded.error().front());
  const std::string summary = carry::summary(loaded->config, {});
  EXPECT_THAT(summary, HasSubstr("b.yaml: good, 1 route, 2 patterns\n"));
  EXPECT_THAT(summary,
              HasSubstr("  /t/q   <-  0x1234.0x0001     0x8001  0x0001  1.any    udp any  a_msgs/msg/B\n"));
  EXPECT_THAT(
      summary,
      HasSubstr("  PATTERN      SERVICES       INSTANCE  EVENT   GROUP   VERSION  PORT       LOCKED\n"
                "  /s/**    ->  0x6000-0x6fff  0x0001    0x8001  0x0001  1.0      udp 40001  1 of 200\n"
                "  /t/*     <-  as locked      0x0001    0x8001  0x0001  1.any    udp any    1\n"
                "\n"
                "  /s/** without /s/x/**\n"
                "\n"
                "  ids are kept in " +
                folder_ +
                "none.lock\n"
                "  LOCKED  SERVICE  PATTERN         TYPE\n"
                "  /other  0x7000   none: reserved  a_msgs/msg/B\n"
                "  /s/a    0x6001   /s/**           std_msgs/msg/String\n"
                "\n"));
  EXPECT_THAT(summary, HasSubstr("  QoS   reliability as published, durability as published, keep last 10\n"
                                 "          for /s/**\n"));
  EXPECT_THAT(summary, HasSubstr("  there offered while published\n          for /s/**\n"));
  EXPECT_THAT(carry::summary(config_of(with("direction: someip_to_dds")), {}),
              Not(HasSubstr("LOCKED  SERVICE")));
}

}  // namespace
}  // namespace trestle::test::patterns_test
