#include <gmock/gmock.h>

#include <filesystem>

#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"

namespace trestle::test {
namespace {

using testing::ElementsAre;
using testing::Truly;

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
  dds::Participant at_a = participant_at_a();
  dds::Participant at_b = participant_at_b();
  for (const TestRoute& route : routes) {
    SCOPED_TRACE(route.topic);
    const Make& make = cases()[static_cast<std::size_t>(&route - routes.data()) % cases().size()].make;
    Ends ends = route.from_a_to_b ? Ends{at_a, at_b, route.topic, route.type}
                                  : Ends{at_b, at_a, route.topic, route.type};
    ASSERT_TRUE(ends.matched());
    ASSERT_TRUE(subscribed(route.from_a_to_b ? *a_ : *b_, route.topic, ends, make(0)));
    std::vector<Sample> sent;
    for (std::uint32_t number = 1; number <= 3; ++number) {
      sent.push_back(make(number));
      ASSERT_TRUE(ends.writer.write(sent.back()));
    }
    // First come the probes, as many as found the way open.
    const auto arrived_is = [&](const Sample& wanted) {
      return [&](const Sample& arrived) { return same(arrived, wanted); };
    };
    ASSERT_TRUE(
        ends.inbox.wait([&](const auto& all) { return !all.empty() && same(all.back(), sent.back()); }));
    auto arrived = ends.inbox.take();
    std::erase_if(arrived, arrived_is(make(0)));
    EXPECT_THAT(arrived, ElementsAre(Truly(arrived_is(sent[0])), Truly(arrived_is(sent[1])),
                                     Truly(arrived_is(sent[2]))));
  }
}

}  // namespace
}  // namespace trestle::test
