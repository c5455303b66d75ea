// Routes that come into being when somebody publishes, and go with the last one who does.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "bridge/carry/config/lock_file.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"

namespace trestle::test::discovered_routes_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using testing::HasSubstr;

/// A bridge with one pattern.
class DiscoveredRoutes : public BridgeTest {
 protected:
  DiscoveredRoutes() {
    std::filesystem::create_directories(folder_);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_));
    spdlog::set_level(spdlog::level::warn);
  }
  ~DiscoveredRoutes() override {
    bridge_.reset();
    std::filesystem::remove_all(folder_);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("after"));
  }

  void start(const std::string& keys, const std::string& others = "") {
    start_bridge(
        fmt::format("lock_file: {}\n"
                    "patterns:\n  - {{topics: /s/**, direction: dds_to_someip, port: 40001, {}}}\n{}",
                    lock_file_, keys, others));
  }

  /// The ids in the lock file, by topic.
  [[nodiscard]] std::map<std::string, int> locked() const {
    const auto lock = carry::LockFile::read(lock_file_);
    if (!lock) {
      ADD_FAILURE() << to_string(lock.error().front());
      return {};
    }
    std::map<std::string, int> ids;
    for (const carry::LockedTopic& one : lock->topics()) {
      ids[one.topic] = someip::value(one.service);
    }
    return ids;
  }
  [[nodiscard]] std::uint64_t of_pattern(const char* name) const {
    return bridge_->counter("pattern /s/**", name);
  }

  /// What was logged, but for the buffers that the machine does not grant.
  [[nodiscard]] std::string logged() const {
    std::istringstream all{log_->str()};
    std::string rest;
    for (std::string line; std::getline(all, line);) {
      rest += line.find("the system grants") == std::string::npos ? line + "\n" : "";
    }
    return rest;
  }

  const std::string folder_ = testing::TempDir() + "trestle-discovered-" + std::to_string(getpid());
  const std::string lock_file_ = folder_ + "/trestle.lock";
  const std::shared_ptr<LogSink> log_ = std::make_shared<LogSink>();
  std::unique_ptr<sd::Node> peer_ = std::make_unique<sd::Node>(io_, peer_config());
};

// FNV-1a of "/s/a std_msgs/msg/String" is 0x590d3cc5, of that of /s/b 0x0911d440, of /s/c 0x69d14c07.
constexpr const char* many_ids = "services: 0x6000-0x6fff";
constexpr int id_of_a = 0x6cc5;
constexpr int id_of_b = 0x6440;

TEST_F(DiscoveredRoutes, CarryATopicThatIsPublishedLater) {
  start(many_ids);
  EXPECT_FALSE(std::filesystem::exists(lock_file_)) << "nothing to lock yet";
  std::vector<std::vector<std::byte>> received;
  const sd::Subscription subscription{
      *peer_,
      {.service = ServiceId{id_of_a}, .eventgroup = EventgroupId{1}, .events = {MethodId{0x8001}}},
      [&](const someip::Message& event, const Endpoint&) {
        received.emplace_back(event.payload.begin(), event.payload.end());
      }};
  for (int life = 0; life < 3; ++life) {
    SCOPED_TRACE(life);
    auto a = std::make_optional(writer("/s/a"));
    const auto other = writer("/elsewhere/a");
    ASSERT_TRUE(until([&] { return subscription.active() && a->matched() == 1; }));
    EXPECT_EQ(other.matched(), 0U);
    received.clear();
    ASSERT_TRUE(a->write(hello_cdr));
    ASSERT_TRUE(until([&] { return !received.empty(); }));
    EXPECT_EQ(received.front(), hello);
    EXPECT_EQ(of_pattern("topics"), 1U);
    EXPECT_EQ(of_pattern("routes"), 1U);
    EXPECT_EQ(bridge_->counter("route /s/a to SOME/IP", "carried"), 1U);
    a.reset();
    ASSERT_TRUE(until([&] { return !subscription.active(); }));
    ASSERT_TRUE(until([&] { return of_pattern("routes") == 0; }));
    EXPECT_EQ(bridge_->counter("former routes", "carried"), static_cast<std::uint64_t>(life) + 1);
  }
  EXPECT_EQ(of_pattern("routes_made"), 3U);
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/a", id_of_a}}));
  bridge_.reset();
  EXPECT_EQ(logged(), "");
}

TEST_F(DiscoveredRoutes, FindWhoWasThereBefore) {
  const auto a = writer("/s/a");
  const auto deep = writer("/s/x/y/z");
  start(many_ids);
  EXPECT_TRUE(until([&] { return a.matched() == 1 && deep.matched() == 1; }));
}

TEST_F(DiscoveredRoutes, KeepTheirIdsWhateverComesFirst) {
  // Both topics want 0x6001.
  const char* const two_ids = "services: 0x6000-0x6001";
  const std::map<std::string, int> ids{{"/s/a", 0x6001}, {"/s/c", 0x6000}};
  start(two_ids);
  {
    const auto a = writer("/s/a");
    ASSERT_TRUE(until([&] { return a.matched() == 1; }));
    const auto c = writer("/s/c");
    ASSERT_TRUE(until([&] { return c.matched() == 1; }));
    EXPECT_EQ(locked(), ids);
  }
  bridge_.reset();
  std::ifstream before{lock_file_};
  const std::string text_before{std::istreambuf_iterator<char>{before}, {}};
  start(two_ids);
  const auto requirement = peer_->require({.service = ServiceId{0x6000}});
  const auto c = writer("/s/c");
  ASSERT_TRUE(until([&] { return c.matched() == 1 && !peer_->available(requirement).empty(); }));
  const auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return a.matched() == 1; }));
  EXPECT_EQ(locked(), ids);
  std::ifstream after{lock_file_};
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>{after}, {}}), text_before);

  // Without the file it would have been the other way round.
  bridge_.reset();
  std::filesystem::remove(lock_file_);
  const auto still_there = [&] { return a.matched() == 0 && c.matched() == 0; };
  ASSERT_TRUE(until(still_there));
  start(two_ids, "  - {topics: /none, direction: dds_to_someip, port: 40002, services: 0x6100-0x6100}\n");
  ASSERT_TRUE(until([&] { return a.matched() == 1 && c.matched() == 1; }));
  EXPECT_THAT(locked(), testing::SizeIs(2));
}

TEST_F(DiscoveredRoutes, LeaveAloneWhatIsNotTheirs) {
  const std::string route = fmt::format(
      "routes:\n"
      "  - {{topic: /s/out, type: {0}, direction: dds_to_someip, service: 0x6440, instance: 1, eventgroup: "
      "1, "
      "event: 0x8001, port: 40003}}\n"
      "  - {{topic: /s/in, type: {0}, direction: someip_to_dds, service: 0x5001, instance: 1, eventgroup: 1, "
      "event: 0x8001}}\n",
      string_type);
  start(std::string{many_ids} + ", exclude: [/s/private/**]", route);
  const auto out = writer("/s/out");
  const auto in = writer("/s/in");
  const auto excluded = writer("/s/private/x");
  const auto hidden = writer("/s/_hidden");
  const auto logs = writer("/rosout");
  const auto no_ros = ros_.create_writer("s/bare", dds::ros_type_name(string_type), {});
  const auto request = ros_.create_writer("rq/s/xRequest", dds::ros_type_name(string_type), {});
  // It wants the id that the route has.
  const auto b = writer("/s/b");
  ASSERT_TRUE(until([&] { return b.matched() == 1 && out.matched() == 1; }));
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/b", id_of_b + 1}}));
  EXPECT_EQ(of_pattern("topics"), 1U);
  for (const auto* one : {&in, &excluded, &hidden, &logs, &no_ros, &request}) {
    EXPECT_EQ(one->matched(), 0U);
  }
}

TEST_F(DiscoveredRoutes, TellOfAnUnknownTypeOnce) {
  start(many_ids);
  const auto first = writer("/s/first", "nowhere_msgs/msg/Unknown");
  const auto second = writer("/s/second", "nowhere_msgs/msg/Unknown");
  const auto bare = ros_.create_writer("rt/s/bare", "../../etc/passwd", {});
  ASSERT_TRUE(until([&] { return of_pattern("unknown_type") == 3; }));
  const auto third = writer("/s/third", "nowhere_msgs/msg/Unknown");
  ASSERT_TRUE(until([&] { return of_pattern("unknown_type") == 4; }));
  const auto known = writer("/s/a");
  ASSERT_TRUE(until([&] { return known.matched() == 1; }));
  EXPECT_EQ(of_pattern("routes"), 1U);
  bridge_.reset();
  const std::string log = log_->str();
  EXPECT_THAT(log, HasSubstr("route /s/first: nowhere_msgs/msg/Unknown cannot be carried"));
  EXPECT_THAT(log, testing::Not(HasSubstr("/s/second")));
  EXPECT_THAT(log, testing::Not(HasSubstr("/s/third")));
  EXPECT_THAT(log, HasSubstr("/s/bare gets no route: '../../etc/passwd' is no message type of ROS"));
}

TEST_F(DiscoveredRoutes, RefuseATopicWhoseTypeHasChanged) {
  start(many_ids);
  {
    const auto a = writer("/s/a");
    ASSERT_TRUE(until([&] { return a.matched() == 1; }));
  }
  ASSERT_TRUE(until([&] { return of_pattern("routes") == 0; }));
  const auto changed = writer("/s/a", "geometry_msgs/msg/Point");
  ASSERT_TRUE(until([&] { return of_pattern("other_type") == 1; }));
  EXPECT_EQ(of_pattern("routes"), 0U);
  EXPECT_EQ(changed.matched(), 0U);
  const auto b = writer("/s/b");
  ASSERT_TRUE(until([&] { return b.matched() == 1; }));
  bridge_.reset();
  EXPECT_THAT(log_->str(), HasSubstr("/s/a has its id in " + lock_file_ +
                                     " for the type std_msgs/msg/String, but a publisher has "
                                     "geometry_msgs/msg/Point"));
}

TEST_F(DiscoveredRoutes, HaveOneTypeWhenTwoAreThereFromTheStart) {
  const auto a = writer("/s/a");
  dds::Participant other{config()};
  const auto another = other.create_writer("rt/s/a", dds::ros_type_name("geometry_msgs/msg/Point"), {});
  start(many_ids);
  ASSERT_TRUE(until([&] { return of_pattern("other_type") == 1 && of_pattern("routes") == 1; }));
  EXPECT_EQ(of_pattern("locked"), 1U);
  ASSERT_TRUE(until([&] { return a.matched() + another.matched() == 1; }));
}

TEST_F(DiscoveredRoutes, AreBoundedAndSayWhenTheBoundIsReached) {
  start(std::string{many_ids} + ", max_routes: 20");
  std::vector<dds::Writer> flood;
  for (int i = 0; i < 1000; ++i) {
    flood.push_back(writer(fmt::format("/s/flood{}", i)));
  }
  ASSERT_TRUE(until([&] { return of_pattern("topics") == 1000 && of_pattern("routes") == 20; }));
  EXPECT_EQ(of_pattern("locked"), 20U);
  EXPECT_EQ(of_pattern("too_many"), 980U);
  EXPECT_THAT(locked(), testing::SizeIs(20));
  // Not even over time: others that come when they have gone get no ids.
  flood.clear();
  ASSERT_TRUE(until([&] { return of_pattern("topics") == 0 && of_pattern("routes") == 0; }));
  const auto late = writer("/s/late");
  ASSERT_TRUE(until([&] { return of_pattern("too_many") == 981; }));
  EXPECT_THAT(locked(), testing::SizeIs(20));
}

TEST_F(DiscoveredRoutes, SayWhenAllIdsAreTaken) {
  start("services: 0x6000-0x6001");
  const auto a = writer("/s/a");
  const auto b = writer("/s/b");
  ASSERT_TRUE(until([&] { return a.matched() == 1 && b.matched() == 1; }));
  const auto c = writer("/s/c");
  ASSERT_TRUE(until([&] { return of_pattern("no_id") == 1; }));
  bridge_.reset();
  EXPECT_THAT(log_->str(), HasSubstr("/s/c gets no route: all ids of 0x6000-0x6001 are taken"));
}

TEST_F(DiscoveredRoutes, LeaveIdsToOthersWhoOfferThem) {
  start(many_ids);
  const sd::Offer theirs{*peer_, {.service = ServiceId{id_of_a}, .instance = InstanceId{7}}};
  ASSERT_TRUE(until([&] { return bridge_->counter("SOME/IP-SD", "datagrams_received") > 0; }));
  const auto a = writer("/s/a");
  const auto b = writer("/s/b");
  ASSERT_TRUE(until([&] { return of_pattern("routes") == 2; }));
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/a", id_of_a + 1}, {"/s/b", id_of_b}}));
  bridge_.reset();
  EXPECT_EQ(logged(), "");
}

TEST_F(DiscoveredRoutes, SayWhenSomebodyElseOffersTheirs) {
  start(many_ids);
  const auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return of_pattern("routes") == 1; }));
  const sd::Offer theirs{*peer_, {.service = ServiceId{id_of_a}, .instance = InstanceId{1}}};
  ASSERT_TRUE(until_counter("SOME/IP-SD", "offered_twice", 1));
  // What has its id already keeps it, and that is said again.
  bridge_.reset();
  start(many_ids);
  ASSERT_TRUE(until_counter("SOME/IP-SD", "offered_twice", 1));
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/a", id_of_a}}));
  bridge_.reset();
  const std::string log = log_->str();
  const auto first = log.find("SD 0x6cc5.0x0001 version 1 is offered twice: by us, ");
  ASSERT_NE(first, std::string::npos) << log;
  EXPECT_NE(log.find("SD 0x6cc5.0x0001 version 1 is offered twice: by us, ", first + 1), std::string::npos)
      << log;
}

TEST_F(DiscoveredRoutes, AreNotMadeWhenTheirIdsCannotBeKept) {
  start(many_ids);
  std::filesystem::create_directories(lock_file_ + "/in the way");
  const auto requirement = peer_->require({.service = ServiceId{id_of_a}});
  const auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return of_pattern("not_locked") == 1; }));
  EXPECT_EQ(of_pattern("routes"), 0U);
  EXPECT_EQ(of_pattern("locked"), 0U);
  EXPECT_TRUE(peer_->available(requirement).empty());
  // When it can be written, the next look at what is there makes up for it.
  std::filesystem::remove_all(lock_file_);
  const auto b = writer("/s/b");
  ASSERT_TRUE(until([&] { return a.matched() == 1 && b.matched() == 1; }));
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/a", id_of_a}, {"/s/b", id_of_b}}));
  bridge_.reset();
  EXPECT_THAT(log_->str(), HasSubstr("discovered topics get no routes: " + lock_file_));
}

TEST_F(DiscoveredRoutes, KeepNothingWaitingWhileTheDiskDoes) {
  // A disk that takes its time: what is written first is a pipe that nobody reads.
  const std::string pipe = folder_ + "/.trestle.lock.new";
  start(many_ids);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return of_pattern("topics") == 1; }));
  // The bridge goes on meanwhile, and offers nothing whose id is not safe.
  const auto b = writer("/s/b");
  run_for(300ms);
  EXPECT_EQ(of_pattern("routes"), 0U);
  EXPECT_EQ(a.matched(), 0U);
  EXPECT_EQ(of_pattern("not_locked"), 0U);
  // It goes on, and fails as pipes do; then both topics get their ids.
  const std::string aside = folder_ + "/aside";
  std::filesystem::rename(pipe, aside);
  const int end = ::open(aside.c_str(), O_RDONLY | O_NONBLOCK);  // NOLINT(*-vararg)
  ASSERT_GE(end, 0);
  ASSERT_TRUE(until([&] { return a.matched() == 1 && b.matched() == 1; }));
  EXPECT_EQ(locked(), (std::map<std::string, int>{{"/s/a", id_of_a}, {"/s/b", id_of_b}}));
  EXPECT_EQ(of_pattern("not_locked"), 1U);
  ::close(end);
}

TEST_F(DiscoveredRoutes, AskForNoMoreThanThePublishersOffer) {
  const dds::Qos best_effort{.reliable = false};
  const dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
  start(many_ids);
  auto sensor = writer("/s/a", string_type, best_effort);
  auto map = writer("/s/b", string_type, latched);
  ASSERT_TRUE(until([&] { return sensor.matched() == 1 && map.matched() == 1; }));
  // What was latched before anybody subscribed is told to the one that subscribes.
  ASSERT_TRUE(map.write(hello_cdr));
  ASSERT_TRUE(until([&] { return bridge_->counter("route /s/b", "kept") == 1; }));
  std::vector<std::vector<std::byte>> received;
  const sd::Subscription subscription{
      *peer_,
      {.service = ServiceId{id_of_b}, .eventgroup = EventgroupId{1}, .events = {MethodId{0x8001}}},
      [&](const someip::Message& event, const Endpoint&) {
        received.emplace_back(event.payload.begin(), event.payload.end());
      }};
  ASSERT_TRUE(until([&] { return !received.empty(); }));
  EXPECT_EQ(received.front(), hello);
  // A second publisher, that offers less than the first.
  auto reliable = writer("/s/c");
  ASSERT_TRUE(until([&] { return reliable.matched() == 1; }));
  auto less = writer("/s/c", string_type, best_effort);
  ASSERT_TRUE(until([&] { return reliable.matched() == 1 && less.matched() == 1; }));
  // What is given in the configuration counts.
  bridge_.reset();
  start(std::string{many_ids} + ", qos: {reliability: reliable, durability: volatile}");
  ASSERT_TRUE(until([&] { return map.matched() == 1; }));
  ASSERT_TRUE(until([&] { return bridge_->counter("route /s/a", "dds_incompatible_qos") == 1; }));
  EXPECT_EQ(sensor.matched(), 0U);
}

TEST_F(DiscoveredRoutes, HoldTheirPort) {
  start(many_ids);
  boost::asio::io_context io;  // another program's
  EXPECT_THROW((someip::UdpSocket{io, {.local = {own_address(1), 40001}}}), someip::NetError);
  bridge_.reset();
  EXPECT_NO_THROW((someip::UdpSocket{io, {.local = {own_address(1), 40001}}}));
}

TEST_F(DiscoveredRoutes, GoOverTcpToo) {
  start(std::string{many_ids} + ", transport: tcp, instance: 2, eventgroup: 3, event: 0x8005, major: 4");
  std::vector<std::vector<std::byte>> received;
  const sd::Subscription subscription{*peer_,
                                      {.service = ServiceId{id_of_a},
                                       .instance = InstanceId{2},
                                       .major = 4,
                                       .eventgroup = EventgroupId{3},
                                       .events = {MethodId{0x8005}},
                                       .udp = false,
                                       .tcp = true},
                                      [&](const someip::Message& event, const Endpoint&) {
                                        received.emplace_back(event.payload.begin(), event.payload.end());
                                      }};
  auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return subscription.active() && a.matched() == 1; }));
  ASSERT_TRUE(a.write(hello_cdr));
  ASSERT_TRUE(until([&] { return !received.empty(); }));
  EXPECT_EQ(received.front(), hello);
}

// The lines are as those of configured routes, after 5 s; and after 10 s at most of routes that begin later.
TEST_F(DiscoveredRoutes, SayWhyNothingComes) {
  start(many_ids, "  - {topics: /t/**, direction: someip_to_dds}\n");
  ASSERT_TRUE(until([&] { return log_->has("pattern /t/**: nothing has come yet"); }));
  ASSERT_TRUE(until([&] { return log_->has("pattern /s/**: nothing has come yet"); }));
  const auto a = writer("/s/a");
  ASSERT_TRUE(until([&] { return a.matched() == 1; }));
  ASSERT_TRUE(until([&] { return log_->has("/s/a: nothing has come yet"); }));
  bridge_.reset();
  const std::string log = logged();
  EXPECT_THAT(log, HasSubstr("pattern /s/**: nothing has come yet: nobody publishes a topic that matches (1 "
                             "participant in DDS domain"));
  EXPECT_THAT(log, HasSubstr("pattern /t/**: nothing has come yet: " + lock_file_ +
                             " has no topic that matches: copy it"));
  EXPECT_THAT(log, HasSubstr("/s/a: nothing has come yet: a publisher is there, but has published nothing"));
}

/// The lock file copied to a bridge at the other end.
class DiscoveredAtBothEnds : public DiscoveredRoutes {
 protected:
  [[nodiscard]] std::unique_ptr<RunningBridge> start_far_bridge() {
    const std::string copied = folder_ + "/copied.lock";
    std::filesystem::copy_file(lock_file_, copied);
    peer_.reset();  // whose address the other bridge takes
    return std::make_unique<RunningBridge>(bridge_head(2, far_domain_.id()) + "lock_file: " + copied +
                                           "\npatterns:\n  - {topics: rt/s/**, direction: someip_to_dds}\n");
  }
  [[nodiscard]] dds::Participant far_participant() const {
    dds::ParticipantConfig settings = config();
    settings.domain = far_domain_.id();
    return dds::Participant{settings};
  }

  TestDomain far_domain_;
};

TEST_F(DiscoveredAtBothEnds, TopicsComeOutAsWhatTheyWentInAs) {
  start(many_ids);
  auto a = std::make_optional(writer("/s/a"));
  auto b = std::make_optional(writer("/s/b"));
  ASSERT_TRUE(until([&] { return a->matched() == 1 && b->matched() == 1; }));
  const auto far = start_far_bridge();
  dds::Participant listener = far_participant();
  Inbox<Bytes> inbox;
  const auto reader =
      listener.create_reader("rt/s/a", dds::ros_type_name(string_type), {},
                             [&](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(until([&] { return reader.matched() == 1; }));
  ASSERT_TRUE(until([&] { return far->counter("route /s/a from", "subscribed") == 1; }));
  ASSERT_TRUE(until([&] { return far->counter("route /s/a from", "readers") == 1; }));
  ASSERT_TRUE(a->write(hello_cdr));
  ASSERT_TRUE(inbox.wait_for_count(1));
  const Bytes arrived = inbox.take()[0];
  EXPECT_EQ(Bytes(arrived.begin(), arrived.begin() + 14), hello_cdr);
  // The topic is there only while it is published at the other end.
  a.reset();
  ASSERT_TRUE(until([&] { return reader.matched() == 0; }));
  EXPECT_EQ(far->counter("route /s/b from", "written"), 1U);
}

TEST_F(DiscoveredAtBothEnds, WhatIsLatchedIsTheSameThere) {
  const dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
  start(many_ids);
  auto map = writer("/s/map", string_type, latched);
  ASSERT_TRUE(map.write(hello_cdr));
  ASSERT_TRUE(until([&] { return of_pattern("routes") == 1; }));
  ASSERT_TRUE(until([&] { return bridge_->counter("route /s/map", "kept") == 1; }));
  const auto far = start_far_bridge();
  ASSERT_TRUE(until([&] { return far->counter("route /s/map from", "carried") == 1; }));
  dds::Participant listener = far_participant();
  Inbox<Bytes> inbox;
  const auto late = listener.create_reader("rt/s/map", dds::ros_type_name(string_type), latched,
                                           [&](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(inbox.wait_for_count(1));
  const Bytes arrived = inbox.take()[0];
  EXPECT_EQ(Bytes(arrived.begin(), arrived.begin() + 14), hello_cdr);
  EXPECT_EQ(far->counter("route /s/map from", "dds_incompatible_qos"), 0U);
}

}  // namespace
}  // namespace trestle::test::discovered_routes_test
