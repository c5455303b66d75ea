// What Trestle takes from the heap for each message on its way through two bridges, apart from Fast DDS: all
// of this program and of the libraries that it uses is counted, library by library. docs/performance.md
// tells.
#include <atomic>
#include <chrono>

#include "dds_adapter/ros_names.hpp"
#include "test/allocations_by.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"

namespace trestle::test::allocations_test {
namespace {

constexpr std::size_t warm_up = 100;
constexpr std::size_t messages = 400;
// Memory for more that is under way at a time than ever before is kept for later: that is not of each
// message, and not of one in twenty either.
constexpr std::size_t now_and_then = messages / 20;

class DdsAllocations : public TwoBridges {
 protected:
  // What happens while samples go from a writer at A through both bridges to a reader at B, one at a time.
  // They differ: what says the same again and again is put on trial, as all are on one host (LoopSuspects).
  AllocationsBy carry(const std::string& topic, const std::string& type, Sample sample) {
    start({{.topic = topic, .type = type}});
    const dds::Qos qos{.reliable = true, .depth = 10};
    dds::Writer writer = at_a_.create_writer(dds::ros_topic_name(topic), dds::ros_type_name(type), qos);
    std::atomic<std::size_t> arrived = 0;
    const dds::Reader reader = at_b_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(type), qos,
                                                   [&](const dds::Sample&) { ++arrived; });
    auto write = [&, number = 0U]() mutable {
      ++number;
      for (std::size_t place = 8; place < 12; ++place) {  // of a text, or of a stamp
        sample[place] = static_cast<std::byte>('a' + (number >> 4 * (place - 8) & 15U));
      }
      return writer.write(sample).has_value();
    };
    EXPECT_TRUE(eventually([&] {
      static_cast<void>(write());
      usleep(50'000);
      return arrived > 0;
    }));
    usleep(200'000);  // what was written before is there, too
    const auto carry_some = [&](std::size_t number) {
      for (std::size_t i = 0; i < number; ++i) {
        const std::size_t before = arrived;
        EXPECT_TRUE(write());
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{30};
        while (arrived == before && std::chrono::steady_clock::now() < end) {
          usleep(20);  // takes no memory
        }
        ASSERT_GT(arrived, before);
      }
    };
    carry_some(warm_up);
    const AllocationsBy before = allocations_by();
    carry_some(messages);
    const AllocationsBy after = allocations_by();
    RecordProperty("by_fast_dds", std::to_string(after.others - before.others));
    return {after.ours - before.ours, after.others - before.others};
  }
};

TEST(AllocationsBy, AreOfWhoeverCallsTheStandardLibrary) {
  const AllocationsBy before = allocations_by();
  std::string text(100, 'x');
  text += std::string(1'000, 'y');
  const auto number = std::make_unique<int>(7);
  const AllocationsBy after = allocations_by();
  EXPECT_EQ(after.ours - before.ours, 4U) << text.size() << *number;
  EXPECT_EQ(after.others, before.others);
}

TEST_F(DdsAllocations, OfAString) {
  const AllocationsBy seen = carry("/string", "std_msgs/msg/String", string(1));
  EXPECT_LT(seen.ours, now_and_then);
  EXPECT_GT(seen.others, messages);
}

TEST_F(DdsAllocations, OfAPointCloud) {
  const AllocationsBy seen = carry("/cloud", "sensor_msgs/msg/PointCloud2", point_cloud(1, 3'000));
  EXPECT_LT(seen.ours, now_and_then);
  EXPECT_GT(seen.others, messages);
}

TEST_F(DdsAllocations, OfALargePointCloud) {
  const AllocationsBy seen = carry("/large", "sensor_msgs/msg/PointCloud2", point_cloud(1, 60'000));
  EXPECT_LT(seen.ours, now_and_then);
  EXPECT_GT(seen.others, messages);
}

}  // namespace
}  // namespace trestle::test::allocations_test
