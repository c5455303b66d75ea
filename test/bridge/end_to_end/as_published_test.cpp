// Routes whose quality of service is that of their publishers, as it is unless something else is written.
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include <fstream>

#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::as_published_test {
namespace {

using testing::HasSubstr;
using testing::Not;

const dds::Qos best_effort{.reliable = false};
const dds::Qos latched{.reliable = true, .transient_local = true, .depth = 10};

class AsPublished : public BridgeTest {
 protected:
  AsPublished() { spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_)); }
  ~AsPublished() override {
    bridge_.reset();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("after"));
  }

  void start(const std::string& keys = "") {
    start_calm_bridge(
        "routes:\n  - {topic: /text, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1234, "
        "instance: 1, eventgroup: 1, event: 0x8001, port: 40001" +
        keys + "}\n");
  }
  [[nodiscard]] std::uint64_t count(const std::string& name) { return bridge_->counter("route /", name); }
  /// Who subscribes to an event.
  struct Subscriber {
    Subscriber(boost::asio::io_context& io, std::uint16_t service)
        : node{io, peer_config()},
          subscription{node,
                       {.service = someip::ServiceId{service},
                        .instance = someip::InstanceId{1},
                        .eventgroup = someip::EventgroupId{1},
                        .events = {someip::MethodId{0x8001}}},
                       [this](const someip::Message& event, const Endpoint&) {
                         received.emplace_back(event.payload.begin(), event.payload.end());
                       }} {}
    std::vector<Bytes> received;
    sd::Node node;
    sd::Subscription subscription;
  };
  /// Writes until something has arrived.
  bool arrives(dds::Writer& from, const Bytes& sample, const Subscriber& at) {
    return until([&] {
      static_cast<void>(from.write(sample));
      return !at.received.empty();
    });
  }
  std::string log() {
    bridge_.reset();
    return log_->str();
  }
  const std::shared_ptr<LogSink> log_ = std::make_shared<LogSink>();
};

/// The routes of the first configuration in README.md.
std::string routes_of_readme() {
  std::ifstream in{test::source_dir() + "/README.md"};
  std::stringstream all;
  all << in.rdbuf();
  const std::string text = all.str();
  const std::size_t block = text.find("```yaml\n");
  const std::size_t begin = text.find("routes:", block);
  return text.substr(begin, text.find("```", begin) - begin);
}

TEST_F(AsPublished, TheReadmesExampleCarriesTheCloudsOfASensor) {
  start_bridge(routes_of_readme());
  Subscriber subscriber{io_, 0x1111};
  dds::Writer lidar = writer("/points", "sensor_msgs/msg/PointCloud2", best_effort);
  EXPECT_TRUE(arrives(lidar, point_cloud(1, 100), subscriber));
  EXPECT_EQ(count("dds_incompatible_qos"), 0U);
  EXPECT_THAT(log(), Not(HasSubstr("does not go with")));
}

TEST_F(AsPublished, ALatchedTopicIsTheFieldThatItIsByHand) {
  start();
  dds::Writer map = writer("/text", string_type, latched);
  ASSERT_TRUE(until([&] { return map.matched() > 0; }));  // not all may come of what was written before
  constexpr std::uint64_t samples = 5;
  for (std::uint32_t number = 0; number < samples; ++number) {
    ASSERT_TRUE(map.write(string(number)));
  }
  ASSERT_TRUE(until([&] { return count("kept") == samples; }));
  Subscriber late{io_, 0x1234};
  ASSERT_TRUE(until([&] { return !late.received.empty(); }));
  for (std::uint32_t number = 0; number < samples; ++number) {
    ASSERT_TRUE(map.write(string(number)));
  }
  ASSERT_TRUE(until([&] { return late.received.size() == 1 + samples; }));
  run_for(100ms);
  EXPECT_EQ(late.received.size(), 1 + samples) << "none comes twice";
  EXPECT_EQ(count("received"), 2 * samples) << "none comes twice";
}

TEST_F(AsPublished, SamplesThatCameBeforeTheTopicWasKnownToBeLatchedComeOnce) {
  start();
  for (int round = 0; round < 5; ++round) {
    const std::uint64_t before = count("received");
    dds::Writer map = writer("/text", string_type, latched);
    ASSERT_TRUE(until([&] { return map.matched() > 0; }));
    for (std::uint32_t number = 0; number < 3; ++number) {
      ASSERT_TRUE(map.write(string(number)));
    }
    ASSERT_TRUE(until([&] { return count("received") >= before + 3; }));
    run_for(100ms);
    EXPECT_EQ(count("received"), before + 3);
  }
}

TEST_F(AsPublished, AVolatileTopicHasNoInitialValue) {
  start();
  dds::Writer writer = this->writer("/text");
  ASSERT_TRUE(until([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(until([&] { return count("no_subscriber") == 1; }));
  EXPECT_EQ(count("kept"), 0U);
  Subscriber late{io_, 0x1234};
  ASSERT_TRUE(until([&] { return late.subscription.active(); }));
  run_for(100ms);
  EXPECT_TRUE(late.received.empty());
}

TEST_F(AsPublished, APublisherThatOffersLessIsHeardToo) {
  start();
  dds::Writer map = writer("/text", string_type, latched);
  ASSERT_TRUE(map.write(hello_cdr));
  ASSERT_TRUE(until([&] { return count("kept") == 1; }));
  dds::Writer sensor = writer("/text", string_type, best_effort);
  ASSERT_TRUE(until([&] { return count("publishers") == 2; }));
  // What was latched is not told any more: whether it is the last one nobody knows.
  Subscriber late{io_, 0x1234};
  ASSERT_TRUE(until([&] { return late.subscription.active(); }));
  run_for(100ms);
  EXPECT_TRUE(late.received.empty());
  EXPECT_TRUE(arrives(sensor, hello_cdr, late));
  late.received.clear();
  EXPECT_TRUE(arrives(map, hello_cdr, late));
  EXPECT_EQ(count("dds_incompatible_qos"), 0U);
}

TEST_F(AsPublished, AServiceStaysOfferedWhileTheReaderIsExchanged) {
  start(", offer: while_published");
  Subscriber subscriber{io_, 0x1234};
  for (int round = 0; round < 3; ++round) {
    dds::Writer map = writer("/text", string_type, latched);
    ASSERT_TRUE(map.write(hello_cdr));
    ASSERT_TRUE(until([&] { return !subscriber.received.empty(); }));
    dds::Writer sensor = writer("/text", string_type, best_effort);
    ASSERT_TRUE(until([&] { return count("publishers") == 2; }));
    subscriber.received.clear();
    ASSERT_TRUE(arrives(sensor, hello_cdr, subscriber));
  }
}

TEST_F(AsPublished, IsNotWhatStandsInTheConfiguration) {
  start(", qos: {reliability: reliable}");
  const dds::Writer sensor = writer("/text", string_type, best_effort);
  ASSERT_TRUE(until([&] { return count("dds_incompatible_qos") == 1; }));
  EXPECT_EQ(sensor.matched(), 0U);
  EXPECT_THAT(log(), HasSubstr("write `qos: {reliability: best_effort}`"));
}

}  // namespace
}  // namespace trestle::test::as_published_test
