// Which threads a sample passes on its way through two bridges: of each system call that sends or receives a
// mark within it the thread is noted.
#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>

#include "bridge/carry/runtime/dds_receiver.hpp"
#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/system_calls.hpp"

namespace trestle::test::thread_hops_test {
namespace {

struct Step {
  std::string what;
  std::thread::id thread;
  bool operator==(const Step&) const = default;
};

// Of the sample that has the mark.
struct Notes {
  std::atomic<std::uint64_t> mark = 0;
  std::mutex mutex;
  std::vector<Step> steps;

  // Quickly, and at the same time on all threads: a reader that lags has DDS send again.
  void look_at(const char* what, ByteView bytes) {
    const std::uint64_t sought = mark;
    if (sought != 0 && memmem(bytes.data(), bytes.size(), &sought, sizeof sought) != nullptr) {
      const std::lock_guard lock{mutex};
      const Step step{what, std::this_thread::get_id()};
      if (steps.empty() || steps.back() != step) {
        steps.push_back(step);
      }
    }
  }
  std::vector<Step> take() {
    mark = 0;
    const std::lock_guard lock{mutex};
    return std::exchange(steps, {});
  }
};

Notes& notes() {
  static Notes one;
  return one;
}

class ThreadHops : public TwoBridges {
 protected:
  void SetUp() override {
    if (!carry::receives_samples()) {
      GTEST_SKIP() << "the system grants less than 2 MB for what waits: raise net.core.rmem_max";
    }
    TwoBridges::SetUp();
    watch_system_calls([](const char* what, ByteView bytes) { notes().look_at(what, bytes); });
  }
  void TearDown() override {
    watch_system_calls(nullptr);
    TwoBridges::TearDown();
  }

  // What most samples of so many points take, as DDS sends again what is not confirmed in time: the threads
  // are numbered in the order in which they come.
  std::vector<std::string> carry(std::uint32_t points) {
    start({{.topic = "/cloud", .type = "sensor_msgs/msg/PointCloud2"}});
    const dds::Qos qos{.reliable = true, .depth = 10};
    const std::string topic = dds::ros_topic_name("/cloud");
    const std::string type = dds::ros_type_name("sensor_msgs/msg/PointCloud2");
    dds::Writer writer = at_a_.create_writer(topic, type, qos);
    std::atomic<std::size_t> arrived = 0;
    const dds::Reader reader = at_b_.create_reader(topic, type, qos, [&](const dds::Sample&) { ++arrived; });
    Sample sample = point_cloud(1, points);
    EXPECT_TRUE(eventually([&] {
      static_cast<void>(writer.write(sample));
      usleep(50'000);
      return arrived > 0;
    }));
    usleep(200'000);  // what was written before is there, too

    std::vector<std::vector<std::string>> ways;
    for (int i = 0; i < 9; ++i) {
      const std::uint64_t mark = 0x5d0e'71f0'963c'a500 + static_cast<std::uint64_t>(i);
      std::memcpy(sample.data() + sample.size() / 2, &mark, sizeof mark);
      notes().mark = mark;
      const std::size_t before = arrived;
      EXPECT_TRUE(writer.write(sample));
      EXPECT_TRUE(eventually([&] { return arrived > before; }));
      ways.push_back(named(notes().take()));
    }
    std::ranges::sort(ways);
    const auto most = [&](const auto& way) { return std::ranges::count(ways, way); };
    return *std::ranges::max_element(ways, {}, most);
  }

  std::vector<std::string> named(const std::vector<Step>& steps) {
    std::vector<std::thread::id> seen;
    std::vector<std::string> result;
    for (const Step& step : steps) {
      const auto place = std::ranges::find(seen, step.thread);
      const std::string number = std::to_string(place - seen.begin() + 1);
      if (place == seen.end()) {
        seen.push_back(step.thread);
      }
      result.push_back(step.what + " " +
                       (step.thread == a_->thread()   ? "bridge A"
                        : step.thread == b_->thread() ? "bridge B"
                                                      : number));
    }
    return result;
  }
};

// The bridge's own thread does all. The others are the writer's and, of DDS, the one that receives for the
// reader.
TEST_F(ThreadHops, AreNoneInABridge) {
  EXPECT_EQ(carry(2'500), (std::vector<std::string>{"send 1", "receive bridge A", "send bridge A",
                                                    "receive bridge B", "send bridge B", "receive 4"}));
}

// What takes long to send has a thread of its writer.
TEST_F(ThreadHops, AreOneToDdsWithLargeSamples) {
  EXPECT_EQ(carry(60'000), (std::vector<std::string>{"send 1", "receive bridge A", "send bridge A",
                                                     "receive bridge B", "send 4", "receive 5"}));
}

}  // namespace
}  // namespace trestle::test::thread_hops_test
