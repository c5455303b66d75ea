// Routes that are made and ended as topics come and go.
#include "bridge/carry/runtime/discovered_routes.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::discovered_routes_test {
namespace {

using namespace std::chrono_literals;
using someip::ServiceId;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr const char* string_type = "std_msgs::msg::dds_::String_";

// FNV-1a of "/s/a std_msgs/msg/String" is 0x590d3cc5, of that of /s/b 0x0911d440.
constexpr ServiceId id_of_a{0x6cc5};
constexpr ServiceId id_of_b{0x6440};

class DiscoveredRoutesTest : public RouteTest {
 protected:
  DiscoveredRoutesTest() {
    std::filesystem::create_directories(folder_);
    config_.lock_file = folder_ + "/trestle.lock";
    carry::TopicPattern pattern;
    pattern.topics = "/s/**";
    pattern.services = {ServiceId{0x6000}, ServiceId{0x6fff}};
    pattern.route = route(carry::Direction::dds_to_someip);
    pattern.route.port = 40001;
    pattern.route.presence.offer_while_published = true;
    config_.patterns = {pattern};
  }
  ~DiscoveredRoutesTest() override {
    routes_.reset();
    std::filesystem::remove_all(folder_);
  }
  carry::TopicPattern& settings() { return config_.patterns.front(); }

  void start_discovery() {
    routes_.emplace(make_routes(context_, config_, types_), config_);
    routes_->join_someip(someip_);
    discovered_.emplace(context_, *routes_, config_, types_, disk_.get_executor());
    routes_->join_dds();
    discovered_->open();
    work();
  }
  /// Exactly these topics are published now.
  void published(std::vector<std::string> topics, const char* type = string_type) {
    dds_.found.clear();
    for (const std::string& topic : topics) {
      dds_.found.push_back({.topic = "rt" + topic, .type = type});
    }
    look();
  }
  void look() {
    discovered_->changed();
    pass(50ms);
    write();
  }
  /// What the disk has to do, and what follows from it.
  void write() {
    disk_.restart();
    disk_.poll();
    work();
  }
  [[nodiscard]] std::uint64_t of(const std::string& group, const std::string& name) const {
    std::vector<carry::CounterGroup> groups;
    discovered_->append_counters(groups);
    for (const carry::CounterGroup& one : groups) {
      for (const carry::Counter& counter : one.counters) {
        if (one.name == group && counter.name == name) {
          return counter.count;
        }
      }
    }
    return 0xdead;
  }
  [[nodiscard]] std::uint64_t of_pattern(const std::string& name) const { return of("pattern /s/**", name); }
  [[nodiscard]] std::vector<ServiceId> offers() const {
    std::vector<ServiceId> all;
    for (const auto& [index, service] : someip_.offers) {
      all.push_back(service);
    }
    return all;
  }
  [[nodiscard]] std::vector<ServiceId> locked() const {
    std::vector<ServiceId> all;
    const auto file = carry::LockFile::read(config_.lock_file);
    for (const carry::LockedTopic& one : file->topics()) {
      all.push_back(one.service);
    }
    return all;
  }

  const std::string folder_ = testing::TempDir() + "trestle-patterns-" + std::to_string(getpid());
  boost::asio::io_context disk_{1};
  // Ends after the routes, as in a bridge.
  std::optional<carry::DiscoveredRoutes> discovered_;
};

TEST_F(DiscoveredRoutesTest, AreThereWhileSomebodyPublishesTheTopic) {
  start_discovery();
  EXPECT_EQ(someip_.ports, 1) << "held also while there is no route";
  published({"/s/a", "/elsewhere"});
  EXPECT_THAT(offers(), ElementsAre(id_of_a));
  EXPECT_THAT(locked(), ElementsAre(id_of_a));
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  EXPECT_THAT(someip_.events, ElementsAre(hello));
  EXPECT_EQ(of_pattern("topics"), 1U);
  EXPECT_EQ(of_pattern("routes"), 1U);
  EXPECT_EQ(count("carried"), 1U);
  published({});
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(dds_.reads, 0);
  EXPECT_EQ(of_pattern("routes"), 0U);
  EXPECT_EQ(of("former routes of patterns", "carried"), 1U);
  published({"/s/a"});
  EXPECT_THAT(offers(), ElementsAre(id_of_a));
  EXPECT_EQ(of_pattern("routes_made"), 2U);
}

TEST_F(DiscoveredRoutesTest, HaveTheIdsOfTheLockFile) {
  std::ofstream{config_.lock_file} << "version: 1\ntopics:\n"
                                      "  - {service: 0x6123, topic: /s/a, type: std_msgs/msg/String}\n";
  start_discovery();
  EXPECT_EQ(of_pattern("locked"), 1U);
  published({"/s/a", "/s/b"});
  EXPECT_THAT(offers(), UnorderedElementsAre(ServiceId{0x6123}, id_of_b));
  EXPECT_THAT(locked(), UnorderedElementsAre(ServiceId{0x6123}, id_of_b));
}

TEST_F(DiscoveredRoutesTest, AreNotMadeOfWhatOtherBridgesBringIn) {
  start_discovery();
  carry::Route theirs = settings().route;
  theirs.direction = carry::Direction::someip_to_dds;
  const IpAddress other = IpAddress::v4(10, 0, 0, 9);
  dds_.found = {{.topic = "rt/s/a",
                 .type = string_type,
                 .bridge = true,
                 .bridge_text = to_text(mark_of(other, theirs))}};
  look();
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(of_pattern("topics"), 0U);
  dds_.found.push_back({.topic = "rt/s/a", .type = string_type});
  look();
  EXPECT_THAT(offers(), ElementsAre(id_of_a)) << "somebody else publishes it, too";
}

TEST_F(DiscoveredRoutesTest, AreMadeOfWhatABridgeBringsInFromWhichTheyAreToTakeIt) {
  const IpAddress other = IpAddress::v4(10, 0, 0, 9);
  settings().route.from_bridges = {other};
  start_discovery();
  carry::Route theirs = settings().route;
  theirs.direction = carry::Direction::someip_to_dds;
  dds_.found = {{.topic = "rt/s/a",
                 .type = string_type,
                 .bridge = true,
                 .bridge_text = to_text(mark_of(other, theirs))}};
  look();
  EXPECT_THAT(offers(), ElementsAre(id_of_a));
}

TEST_F(DiscoveredRoutesTest, LeaveTopicsToTheRoutesOfTheConfiguration) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  config_.routes.front().topic = "/s/a";
  start_discovery();
  published({"/s/a", "/s/b"});
  EXPECT_THAT(offers(), ElementsAre(ServiceId{0x1234}, id_of_b));
  EXPECT_EQ(of_pattern("topics"), 1U);
}

TEST_F(DiscoveredRoutesTest, AreAsManyAsAreAllowed) {
  settings().max_routes = 1;
  start_discovery();
  published({"/s/a", "/s/b"});
  EXPECT_THAT(offers(), ElementsAre(id_of_a));
  EXPECT_EQ(of_pattern("too_many"), 1U);
  published({"/s/b"});
  EXPECT_THAT(offers(), IsEmpty()) << "/s/a keeps its id";
  EXPECT_EQ(of_pattern("too_many"), 1U) << "counted once";
}

TEST_F(DiscoveredRoutesTest, TakeNoIdThatSomebodyElseHas) {
  settings().services = {ServiceId{0x6000}, ServiceId{0x6002}};
  config_.methods = {method(carry::Server::someip)};
  config_.methods.front().service = ServiceId{0x6000};
  someip_.of_others = {ServiceId{0x6001}};
  start_discovery();
  published({"/s/a", "/s/b"});
  EXPECT_THAT(offers(), ElementsAre(ServiceId{0x6002}));
  EXPECT_EQ(of_pattern("no_id"), 1U);
}

TEST_F(DiscoveredRoutesTest, AreNotMadeOfATypeThatIsNotKnown) {
  start_discovery();
  published({"/s/a"}, "no_msgs::msg::dds_::Such_");
  look();
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(of_pattern("unknown_type"), 1U);
  published({"/s/a"});
  EXPECT_THAT(offers(), ElementsAre(id_of_a)) << "another one publishes it";
}

TEST_F(DiscoveredRoutesTest, KeepTheTypeThatTheyHaveTheirIdFor) {
  start_discovery();
  published({"/s/a"});
  published({"/s/a"}, "std_msgs::msg::dds_::Bool_");
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(of_pattern("other_type"), 1U);
}

TEST_F(DiscoveredRoutesTest, AreNotOfferedUnlessTheirReaderCanBeMade) {
  start_discovery();
  dds_.no_reader = true;
  published({"/s/a"});
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(of_pattern("not_opened"), 1U);
}

TEST_F(DiscoveredRoutesTest, AskForNoMoreThanThePublishersOffer) {
  settings().follow_reliability = true;
  settings().route.qos.reliability_as_published = true;
  start_discovery();
  dds_.found = {{.topic = "rt/s/a", .type = string_type, .qos = {.reliable = true}}};
  look();
  EXPECT_TRUE(dds_.asked.reliable);
  dds_.found.push_back({.topic = "rt/s/a", .type = string_type, .qos = {.reliable = false}});
  look();
  EXPECT_FALSE(dds_.asked.reliable);
  EXPECT_EQ(dds_.reads, 1);
}

TEST_F(DiscoveredRoutesTest, LookEvery50MsWhenTopicsComeAndGoOften) {
  start_discovery();
  const int before = dds_.looks;
  for (int i = 0; i < 1000; ++i) {
    discovered_->changed();
    pass(1ms);
  }
  EXPECT_EQ(dds_.looks - before, 1000 / 50);
}

TEST_F(DiscoveredRoutesTest, TryAgainAfter10SWhenTheLockFileCannotBeWritten) {
  start_discovery();
  std::filesystem::create_directories(config_.lock_file + "/in the way");
  published({"/s/a"});
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_EQ(of_pattern("not_locked"), 1U);
  EXPECT_EQ(of_pattern("locked"), 0U);
  std::filesystem::remove_all(config_.lock_file);
  pass(9s);
  write();
  EXPECT_THAT(offers(), IsEmpty());
  pass(1s);
  write();
  EXPECT_THAT(offers(), ElementsAre(id_of_a));
  EXPECT_THAT(locked(), ElementsAre(id_of_a));
}

TEST_F(DiscoveredRoutesTest, OfWhatIsGoneBeforeItIsLockedEndAtOnce) {
  start_discovery();
  dds_.found = {{.topic = "rt/s/a", .type = string_type}};
  discovered_->changed();
  pass(50ms);
  EXPECT_THAT(offers(), IsEmpty()) << "its id is not safe yet";
  dds_.found.clear();
  discovered_->changed();
  pass(50ms);
  write();
  EXPECT_THAT(offers(), IsEmpty());
  EXPECT_THAT(locked(), ElementsAre(id_of_a));
  EXPECT_EQ(of_pattern("routes_made"), 1U);
}

TEST_F(DiscoveredRoutesTest, TellOfRoutesThatAreMadeAndEnd) {
  std::vector<std::string> told;
  start_discovery();
  discovered_->watched_by(
      {.made = [&](const carry::RunningRoute& one) { told.push_back("made " + *one.awaited()); },
       .ends = [&](const std::string& topic) { told.push_back("ends " + topic); },
       .looked = {}});
  published({"/s/a", "/s/b"});
  published({"/s/b"});
  EXPECT_THAT(told, ElementsAre("made /s/a", "made /s/b", "ends /s/a"));
}

TEST_F(DiscoveredRoutesTest, SayWhetherThePatternHasARoute) {
  start_discovery();
  const auto said = [&] {
    std::vector<carry::Diagnosis> all;
    discovered_->append_diagnoses(all);
    return all.front().message;
  };
  EXPECT_EQ(said(), "nobody publishes a topic that matches");
  published({"/s/a"}, "no_msgs::msg::dds_::Such_");
  EXPECT_EQ(said(), "no topic that matches gets a route");
  published({"/s/b"});
  EXPECT_EQ(said(), "ready");
}

TEST_F(DiscoveredRoutesTest, BeginNothingOnceTheyAreStopped) {
  start_discovery();
  published({"/s/a"});
  routes_->stop();
  discovered_->stop();
  published({"/s/a", "/s/b"});
  pass(1h);
  EXPECT_EQ(of_pattern("routes_made"), 1U);
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  EXPECT_THAT(someip_.events, IsEmpty());
}

}  // namespace
}  // namespace trestle::test::discovered_routes_test
