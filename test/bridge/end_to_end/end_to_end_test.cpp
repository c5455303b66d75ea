#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/multicast.hpp>
#include <boost/asio/ip/udp.hpp>
#include <filesystem>

#include "bridge/measure/demo/pcd.hpp"
#include "bridge/measure/point_cloud.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/loopback.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::end_to_end_test {
namespace {

using Make = std::function<Sample(std::uint32_t number)>;

struct Case {
  std::string topic;
  std::string type;
  Make make;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"/cloud", "sensor_msgs/msg/PointCloud2",
       [](std::uint32_t n) { return point_cloud(n, 1000 + 50'000 * n); }},
      {"/tf", "tf2_msgs/msg/TFMessage", tf_message},
      {"/fix", "sensor_msgs/msg/NavSatFix", nav_sat_fix},
      {"/point", "geometry_msgs/msg/Point", point},
      {"/image", "sensor_msgs/msg/Image", image},
      {"/text", "std_msgs/msg/String", string},
      {"/tracks", "test_msgs/msg/Tracks", tracks},
  };
  return all;
}

// What arrived is what was sent; DDS may pad it to a multiple of 4.
bool same(const Sample& arrived, const Sample& sent) {
  return arrived.size() >= sent.size() && arrived.size() < sent.size() + 4 &&
         std::equal(sent.begin(), sent.end(), arrived.begin());
}

// A topic's publisher on one side and its subscriber on the other.
struct Ends {
  Ends(dds::Participant& from, dds::Participant& to, const std::string& topic, const std::string& type)
      : writer{from.create_writer(dds::ros_topic_name(topic), dds::ros_type_name(type), qos)},
        reader{to.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(type), qos,
                                [this](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); })} {}
  static constexpr dds::Qos qos{.reliable = true, .transient_local = false, .depth = 10};
  Inbox<Sample> inbox;
  dds::Writer writer;
  dds::Reader reader;

  [[nodiscard]] bool matched() const {
    return eventually([&] { return writer.matched() == 1 && reader.matched() == 1; });
  }
};

class EndToEnd : public TwoBridges {
 protected:
  EndToEnd() {
    std::filesystem::create_directories(folder_);
    write_tracks_package(folder_.c_str());
  }
  ~EndToEnd() override { std::filesystem::remove_all(folder_); }

  // Until bridge `from` has a subscriber for the topic, what is published is rightly dropped.
  static bool subscribed(RunningBridge& from, const std::string& topic, Ends& ends, const Sample& probe) {
    return eventually([&] {
      static_cast<void>(ends.writer.write(probe));
      usleep(20'000);
      return from.counter("route " + topic, "carried") > 0 && ends.inbox.size() > 0;
    });
  }

  // Publishes samples on one side: they arrive on the other, in order, as they were.
  void expect_unchanged(const TestRoute& route, const Sample& probe, const std::vector<Sample>& sent) {
    SCOPED_TRACE(route.topic);
    Ends ends{route.from_a_to_b ? at_a_ : at_b_, route.from_a_to_b ? at_b_ : at_a_, route.topic, route.type};
    ASSERT_TRUE(ends.matched());
    ASSERT_TRUE(subscribed(route.from_a_to_b ? *a_ : *b_, route.topic, ends, probe));
    for (const Sample& sample : sent) {
      ASSERT_TRUE(ends.writer.write(sample));
    }
    ASSERT_TRUE(
        ends.inbox.wait([&](const auto& all) { return !all.empty() && same(all.back(), sent.back()); }));
    // First come the probes, as many as found the way open.
    auto arrived = ends.inbox.take();
    std::erase_if(arrived, [&](const Sample& one) { return same(one, probe); });
    ASSERT_EQ(arrived.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      EXPECT_TRUE(same(arrived[i], sent[i])) << "sample " << i;
    }
  }

  const std::string folder_ = testing::TempDir() + "trestle-types-" + std::to_string(getpid());
};

TEST_F(EndToEnd, CarriesAllKindsOfTypesBothWaysUnchanged) {
  std::vector<TestRoute> routes;
  for (const bool from_a_to_b : {true, false}) {
    for (const Case& one : cases()) {
      routes.push_back({one.topic + (from_a_to_b ? "_ab" : "_ba"), one.type, from_a_to_b});
    }
  }
  start(routes, folder_);
  for (std::size_t i = 0; i < routes.size(); ++i) {
    const Make& make = cases()[i % cases().size()].make;
    expect_unchanged(routes[i], make(0), {make(1), make(2), make(3)});
  }
}

// A subscriber that stands still: DDS goes on taking samples and forgets what it has not got.
TEST_F(EndToEnd, CountsWhatAStuckSubscriberMayLack) {
  start({{"/text", "std_msgs/msg/String", true, "    qos: {depth: 3}\n"}});
  Ends ends{at_a_, at_b_, "/text", "std_msgs/msg/String"};
  ASSERT_TRUE(ends.matched());
  ASSERT_TRUE(subscribed(*a_, "/text", ends, string(0)));
  // On a busy machine an acknowledgement may already have been late.
  const std::uint64_t before = b_->counter("route /text", "dds_overwritten");
  {
    Stuck stuck;
    dds::Participant another = participant(domain_b_.id());
    const dds::Reader reader =
        another.create_reader(dds::ros_topic_name("/text"), dds::ros_type_name("std_msgs/msg/String"),
                              Ends::qos, [&](const dds::Sample&) { stuck.wait_once(); });
    ASSERT_TRUE(eventually([&] {
      static_cast<void>(ends.writer.write(string(1)));
      return stuck.wait_until_stuck(20ms);
    }));
    // Each of these comes on top of those it has not acknowledged, of which 3 are kept.
    EXPECT_TRUE(eventually([&] {
      static_cast<void>(ends.writer.write(string(2)));
      usleep(5'000);
      return b_->counter("route /text", "dds_overwritten") >= before + 5;
    }));
    stuck.free();
  }
}

// More than DDS takes unless told otherwise, and than one port's queue holds otherwise.
TEST_F(EndToEnd, CarriesMessagesUpToMaxMessage) {
  start({{"/text", "std_msgs/msg/String", true,
          "    transport: tcp\n    tp: {max_message: 72 MiB}\n    qos: {depth: 1}\n"}});
  dds::Writer writer =
      at_a_.create_writer("rt/text", "std_msgs::msg::dds_::String_",
                          {.reliable = true, .transient_local = false, .depth = 1}, 100U << 20U);
  Inbox<Sample> inbox;
  const dds::Reader reader = at_b_.create_reader(
      "rt/text", "std_msgs::msg::dds_::String_", {.reliable = true, .transient_local = false, .depth = 1},
      [&](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); }, 100U << 20U);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(eventually([&] {
    static_cast<void>(writer.write(string(0)));
    usleep(20'000);
    return inbox.size() > 0;
  }));
  constexpr std::uint32_t characters = 70U << 20U;
  Sample large(4 + 4 + characters + 1, std::byte{'x'});
  constexpr std::uint32_t length = characters + 1;  // with the terminator
  const std::array<std::byte, 4> encapsulation{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  std::ranges::copy(encapsulation, large.begin());
  for (std::size_t i = 0; i < 4; ++i) {
    large[4 + i] = static_cast<std::byte>(length >> (8 * i));
  }
  large.back() = std::byte{0};
  ASSERT_TRUE(writer.write(large));
  EXPECT_TRUE(inbox.wait([&](const auto& all) { return same(all.back(), large); }));
}

// DDS announces who joins at once: others must not see a bridge that cannot start.
TEST_F(EndToEnd, JoinsDdsOnlyWhenItHasItsSockets) {
  Inbox<std::string> seen;
  dds::ParticipantConfig watching = config();
  watching.on_event = [&](const dds::Happening& event) { seen.put(event.detail); };
  const dds::Participant observer{watching};
  boost::asio::io_context io;
  const auto bytes = own_address(1).bytes;
  const boost::asio::ip::address_v4 address{{bytes[0], bytes[1], bytes[2], bytes[3]}};
  for (const std::uint16_t port : std::initializer_list<std::uint16_t>{30490, 40001, 40099}) {
    const boost::asio::ip::udp::socket other{io, {address, port}};
    // The first route is offered at 40001, the second receives at 40099.
    EXPECT_THROW(RunningBridge(yaml(true,
                                    {{"/text", "std_msgs/msg/String"},
                                     {"/point", "geometry_msgs/msg/Point", false, "    port: 40099\n"}},
                                    "")),
                 std::runtime_error)
        << port;
  }
  // Had they joined, they would have been seen before this one.
  dds::ParticipantConfig late = config();
  late.name = "late";
  const dds::Participant last{late};
  ASSERT_TRUE(seen.wait([](const auto& all) { return std::ranges::count(all, "late") > 0; }));
  std::vector<std::string> names = seen.take();
  std::erase(names, "late");
  EXPECT_LE(names.size(), 1U);  // the fixture's own
}

TEST_F(EndToEnd, CarriesRoutesOverTcpBesideThoseOverUdp) {
  std::vector<TestRoute> routes;
  for (const Case& one : cases()) {
    const bool tcp = routes.size() % 2 == 0;
    routes.push_back({one.topic, one.type, routes.size() % 3 != 0, tcp ? "    transport: tcp\n" : ""});
  }
  start(routes, folder_);
  for (std::size_t i = 0; i < routes.size(); ++i) {
    const Make& make = cases()[i].make;
    expect_unchanged(routes[i], make(0), {make(1), make(2), make(3)});
  }
  EXPECT_GE(a_->counter("SOME/IP over TCP", "messages_sent"), 3U);
  EXPECT_GE(b_->counter("SOME/IP over TCP", "messages_received"), 3U);
  EXPECT_GE(b_->counter("SOME/IP over TCP", "messages_sent"), 3U);
}

TEST_F(EndToEnd, SharesAnOfferAndAnEventgroupBetweenUdpAndTcp) {
  const std::vector<TestRoute> routes{{"/text", "std_msgs/msg/String"},
                                      {"/point", "geometry_msgs/msg/Point", true, "    transport: tcp\n"}};
  one_service_ = true;
  start(routes);
  expect_unchanged(routes[0], string(0), {string(1), string(2)});
  expect_unchanged(routes[1], point(0), {point(1), point(2)});
  EXPECT_GE(a_->counter("SOME/IP over TCP", "messages_sent"), 2U);
  EXPECT_GE(a_->counter("SOME/IP", "messages_sent"), 2U);
}

TEST_F(EndToEnd, CarriesManyLargeMessagesOfOneServerAtOnce) {
  one_service_ = true;
  std::vector<TestRoute> routes;
  routes.reserve(20);
  for (int i = 0; i < 20; ++i) {
    routes.push_back({"/cloud_" + std::to_string(i), "sensor_msgs/msg/PointCloud2", true,
                      "    tp: {burst: 1, separation: 1 ms}\n"});
  }
  start(routes);
  std::vector<std::unique_ptr<Ends>> ends;
  for (const TestRoute& route : routes) {
    ends.push_back(std::make_unique<Ends>(at_a_, at_b_, route.topic, route.type));
    ASSERT_TRUE(ends.back()->matched());
    ASSERT_TRUE(subscribed(*a_, route.topic, *ends.back(), point_cloud(0, 10)));
  }
  // Each takes some 30 ms, so that all are under way together.
  const Sample cloud = point_cloud(1, 2'000);
  for (const auto& one : ends) {
    ASSERT_TRUE(one->writer.write(cloud));
  }
  for (const auto& one : ends) {
    EXPECT_TRUE(one->inbox.wait([&](const auto& all) { return !all.empty() && same(all.back(), cloud); }));
  }
}

TEST_F(EndToEnd, CarriesAnEventgroupByMulticast) {
  covers({"feat_req_someip_813"});
  const auto group = boost::asio::ip::make_address("239.254.1.1");
  const auto port = static_cast<std::uint16_t>(42'000 + getpid() % 10'000);
  // Somebody else who listens to the group.
  boost::asio::io_context io;
  boost::asio::ip::udp::socket other{io, boost::asio::ip::udp::v4()};
  other.set_option(boost::asio::socket_base::reuse_address{true});
  other.bind({group, port});
  other.set_option(
      boost::asio::ip::multicast::join_group{group.to_v4(), boost::asio::ip::make_address_v4("127.0.0.1")});

  const TestRoute route{
      "/cloud", "sensor_msgs/msg/PointCloud2", true, "",
      fmt::format("    multicast: {{address: {}, port: {}, threshold: 1}}\n", group.to_string(), port)};
  start({route});
  expect_unchanged(route, point_cloud(0, 10), {point_cloud(1, 100), point_cloud(2, 20'000)});
  EXPECT_GT(other.available(), 0U);
}

TEST_F(EndToEnd, CarriesRealLidarScansUnchanged) {
  const std::filesystem::path folder = test::source_dir() + "/../shared/data/lidar/ouster-sdk";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no recorded scans in " << folder;
  }
  std::vector<Sample> scans;
  for (const char* const file : {"os1_128_0.pcd", "os1_128_1.pcd", "os1_128_2.pcd"}) {
    const auto cloud = measure::demo::load_pcd(folder / file);
    ASSERT_TRUE(cloud) << cloud.error();
    EXPECT_EQ(cloud->width * cloud->height, 131'072U);
    const auto encoded = measure::encode(*cloud, 1'700'000'000'000'000'000, "os_lidar");
    Sample scan = encoded.front;
    scan.insert(scan.end(), encoded.data.begin(), encoded.data.end());
    scan.push_back(encoded.tail);
    scans.push_back(std::move(scan));
  }
  const TestRoute route{"/ouster/points", "sensor_msgs/msg/PointCloud2"};
  start({route});
  expect_unchanged(route, point_cloud(0, 10), scans);
}

// Every sample that is received is carried or in one counter of losses.
class Losses : public EndToEnd {
 protected:
  // A publisher on side A; whoever else takes part is up to the test.
  dds::Writer publisher(const TestRoute& route) {
    dds::Writer writer = at_a_.create_writer(dds::ros_topic_name(route.topic), dds::ros_type_name(route.type),
                                             {.reliable = true, .transient_local = false, .depth = 50});
    EXPECT_TRUE(eventually([&] { return writer.matched() == 1; }));
    return writer;
  }
  [[nodiscard]] std::uint64_t out(const std::string& name) { return a_->counter("route ", name); }
  [[nodiscard]] std::uint64_t in(const std::string& name) { return b_->counter("route ", name); }

  static constexpr const char* text_type = "std_msgs/msg/String";
};

TEST_F(Losses, NamesSamplesThatNobodySubscribedTo) {
  const TestRoute route{"/text", text_type};
  a_ = std::make_unique<RunningBridge>(yaml(true, {route}, ""));
  dds::Writer writer = publisher(route);
  for (std::uint32_t number = 0; number < 3; ++number) {
    ASSERT_TRUE(writer.write(string(number)));
  }
  EXPECT_TRUE(eventually([&] { return out("no_subscriber") == 3; }));
  EXPECT_EQ(out("received"), 3U);
  EXPECT_EQ(out("carried"), 0U);
}

TEST_F(Losses, NamesEventsThatNobodyReads) {
  const TestRoute route{"/text", text_type};
  start({route});
  dds::Writer writer = publisher(route);
  ASSERT_TRUE(eventually([&] {
    static_cast<void>(writer.write(string(1)));
    usleep(10'000);
    return in("no_reader") > 0;
  }));
  // Some of what was written above may still be on its way.
  EXPECT_TRUE(eventually([&] {
    const std::uint64_t carried = out("carried");
    return in("no_reader") == carried && in("received") == carried &&
           a_->counter("SOME/IP", "messages_sent") == carried;
  }));
  EXPECT_EQ(in("carried"), 0U);
}

TEST_F(Losses, NamesMessagesThatAreTooLargeOrNone) {
  const TestRoute route{"/text", text_type, true, "    tp: {max_message: 1 KiB}\n"};
  start({route});
  dds::Writer writer = publisher(route);
  ASSERT_TRUE(eventually([&] {
    static_cast<void>(writer.write(string(1)));
    usleep(10'000);
    return out("carried") > 0;
  }));
  Sample large = string(1);
  large.resize(8);
  large.resize(2000, std::byte{'x'});
  large[4] = std::byte{0xc8};  // a string of 0x07c8 = 1992 bytes, its terminator included
  large[5] = std::byte{0x07};
  large.back() = std::byte{0};
  Sample broken = string(1);
  broken[6] = std::byte{0x7f};  // a length of gigabytes
  // What was written above may still be on its way, all of it before this.
  ASSERT_TRUE(writer.write(broken));
  ASSERT_TRUE(eventually([&] { return out("not_convertible") == 1; }));
  const std::uint64_t carried = out("carried");
  ASSERT_TRUE(writer.write(large));
  ASSERT_TRUE(writer.write(broken));
  EXPECT_TRUE(eventually([&] { return out("too_large") == 1 && out("not_convertible") == 2; }));
  EXPECT_EQ(out("carried"), carried);
}

TEST_F(Losses, NamesSamplesThatTheSystemWouldNotSend) {
  const TestRoute route{"/text", text_type};
  std::string description = yaml(true, {route}, "");
  description.insert(description.find("sd: {") + 5, "check_subnet: false, own_endpoints_only: false, ");
  a_ = std::make_unique<RunningBridge>(description);
  dds::Writer writer = publisher(route);
  // Somebody on loopback wants its events elsewhere, whereto nothing leads from there.
  boost::asio::io_context io;
  const auto sd_of = [](std::uint8_t host) {
    return boost::asio::ip::udp::endpoint{boost::asio::ip::make_address(someip::to_string(own_address(host))),
                                          30490};
  };
  boost::asio::ip::udp::socket peer{io, sd_of(3)};
  const auto subscribe =
      hex("ffff8100 00000030 00000001 01010200"
          "c0000000 00000010 06000010 10000001 01000e10 00000001"
          "0000000c 00090400 c0000201 00110009");
  peer.send_to(boost::asio::buffer(subscribe), sd_of(1));
  ASSERT_TRUE(eventually([&] {
    static_cast<void>(writer.write(string(1)));
    usleep(10'000);
    return out("not_sent") > 0;
  }));
  EXPECT_EQ(out("carried"), 0U);
  EXPECT_TRUE(eventually([&] { return a_->counter("SOME/IP", "refused_by_system") == out("not_sent"); }));
}

TEST_F(Losses, NamesSamplesThatNewerOnesOvertookAtASlowSubscriber) {
  // A megabyte takes longer to leave than the next one to come.
  const TestRoute route{"/cloud", "sensor_msgs/msg/PointCloud2", true,
                        "    tp: {burst: 8, separation: 500 us}\n    qos: {depth: 1}\n"};
  start({route});
  dds::Writer writer = publisher(route);
  const Sample cloud = point_cloud(1, 40'000);
  ASSERT_TRUE(eventually([&] {
    static_cast<void>(writer.write(cloud));
    usleep(10'000);
    return out("slow_subscriber") > 0;
  }));
  ASSERT_TRUE(eventually([&] {
    const std::uint64_t gone = out("no_subscriber") + out("overtaken") + out("carried");
    return out("received") == gone;
  }));
}

}  // namespace
}  // namespace trestle::test::end_to_end_test
