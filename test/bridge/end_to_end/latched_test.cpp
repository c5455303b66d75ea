// Topics whose last value late joiners get: from the publisher to DDS readers, SOME/IP subscribers and again
// DDS readers that come after it was published.
#include <gmock/gmock.h>

#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"

namespace trestle::test::latched_test {
namespace {

constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};

class Latched : public TwoBridges {
 protected:
  [[nodiscard]] static std::string setting(const std::string& more = "") {
    return "    qos: {durability: transient_local, depth: 1" + more + "}\n";
  }
  dds::Writer publisher(dds::Participant& at) const {
    return at.create_writer(dds::ros_topic_name("/text"), dds::ros_type_name("std_msgs/msg/String"), latched);
  }
  dds::Reader subscriber(dds::Participant& at) {
    return at.create_reader(dds::ros_topic_name("/text"), dds::ros_type_name("std_msgs/msg/String"), latched,
                            [this](const dds::Sample& sample) { inbox_.put(copy(sample.cdr())); });
  }
  static bool same(const std::vector<std::byte>& arrived, const Sample& sent) {
    return arrived.size() >= sent.size() && std::equal(sent.begin(), sent.end(), arrived.begin());
  }
  Inbox<std::vector<std::byte>> inbox_;
};

TEST_F(Latched, ValuesReachWhoComesLaterAtEveryStep) {
  const std::vector<TestRoute> routes{{"/text", "std_msgs/msg/String", true, setting()}};
  dds::Writer writer = publisher(at_a_);
  ASSERT_TRUE(writer.write(string(1)));  // before there is a bridge
  a_ = std::make_unique<RunningBridge>(yaml(true, routes, ""));
  ASSERT_TRUE(eventually([&] { return a_->counter("route /text", "kept") == 1; }));  // nobody subscribes
  b_ = std::make_unique<RunningBridge>(yaml(false, routes, ""));
  ASSERT_TRUE(eventually([&] { return b_->counter("route /text", "carried") == 1; }));  // nobody reads
  const dds::Reader reader = subscriber(at_b_);
  ASSERT_TRUE(inbox_.wait_for_count(1));
  EXPECT_TRUE(same(inbox_.take().back(), string(1)));

  // What is published again is told again, also when it is the same.
  for (const std::uint32_t value : {1U, 2U}) {
    ASSERT_TRUE(writer.write(string(value)));
    ASSERT_TRUE(inbox_.wait_for_count(1));
    EXPECT_TRUE(same(inbox_.take().back(), string(value)));
  }
  EXPECT_EQ(a_->counter("route /text", "kept"), 1U);
  EXPECT_EQ(a_->counter("route /text", "carried"), 2U);
}

TEST_F(Latched, ValuesAreOfferedWithTheServiceThatFollowsItsPublisher) {
  const std::vector<TestRoute> routes{
      {"/text", "std_msgs/msg/String", true, setting(), "    offer: while_published\n"}};
  start(routes);
  const dds::Reader reader = subscriber(at_b_);
  for (const std::uint32_t value : {1U, 2U}) {
    dds::Writer writer = publisher(at_a_);
    ASSERT_TRUE(writer.write(string(value)));
    ASSERT_TRUE(inbox_.wait_for_count(1));
    EXPECT_TRUE(same(inbox_.take().back(), string(value)));  // not that of the one before
  }
}

TEST_F(Latched, EventsOfARouteThatIsToBeVolatileHaveNoInitialValue) {
  const std::vector<TestRoute> routes{
      {"/text", "std_msgs/msg/String", true, "    qos: {durability: volatile}\n"}};
  a_ = std::make_unique<RunningBridge>(yaml(true, routes, ""));
  dds::Writer writer = publisher(at_a_);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(string(1)));
  ASSERT_TRUE(eventually([&] { return a_->counter("route /text", "no_subscriber") == 1; }));
  EXPECT_EQ(a_->counter("route /text", "kept"), 0U);
  b_ = std::make_unique<RunningBridge>(yaml(false, routes, ""));
  ASSERT_TRUE(eventually([&] { return b_->counter("route /text", "subscribed") == 1; }));
  EXPECT_EQ(b_->counter("route /text", "received"), 0U);
}

TEST_F(Latched, ValuesThatHaveExpiredAreNotCarried) {
  dds::Writer writer = publisher(at_a_);
  ASSERT_TRUE(writer.write(string(1)));
  usleep(1100'000);  // the time itself is what is tested
  const std::vector<TestRoute> expiring{{"/text", "std_msgs/msg/String", true, setting(", lifespan: 1 s")}};
  a_ = std::make_unique<RunningBridge>(yaml(true, expiring, ""));
  ASSERT_TRUE(eventually([&] { return a_->counter("route /text", "expired") == 1; }));
  ASSERT_TRUE(eventually([&] {  // again and again, as it may be late, too
    static_cast<void>(writer.write(string(2)));
    usleep(10'000);
    return a_->counter("route /text", "kept") == 1;
  }));
}

}  // namespace
}  // namespace trestle::test::latched_test
