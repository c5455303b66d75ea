#include <gtest/gtest.h>

#include <fstream>

#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"

namespace trestle::test::many_routes_test {
namespace {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TRESTLE_SANITIZED
#endif
#endif
#ifdef TRESTLE_SANITIZED
constexpr bool sanitized = true;  // freed memory is kept for a while, and all memory has shadows
#else
constexpr bool sanitized = false;
#endif

/// A number from /proc/self/status: "Threads", or "VmRSS" in KiB.
std::size_t status(const std::string& name) {
  std::ifstream lines{"/proc/self/status"};
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + ":")) {
      return std::stoul(line.substr(name.size() + 1));
    }
  }
  return 0;
}

class ManyRoutes : public TwoBridges {};

TEST_F(ManyRoutes, CostNoThreadsAndLittleMemory) {
  constexpr std::size_t count = 200;
  std::vector<TestRoute> routes;
  for (std::size_t i = 0; i < count; ++i) {
    routes.push_back({"/topic_" + std::to_string(i), "std_msgs/msg/String", i % 2 == 0});
  }
  // One route in each of two bridges is what any number needs.
  start({routes.begin(), routes.begin() + 1});
  const std::size_t threads_of_one = status("Threads");
  a_.reset();
  b_.reset();

  const std::size_t memory_before = status("VmRSS");
  const auto begin = std::chrono::steady_clock::now();
  start(routes);
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(took, patience);  // seconds on a busy machine, and far less on others
  EXPECT_EQ(status("Threads"), threads_of_one);

  // The last ones of either direction work.
  for (const std::size_t i : {count - 2, count - 1}) {
    dds::Participant& from = i % 2 == 0 ? at_a_ : at_b_;
    dds::Participant& to = i % 2 == 0 ? at_b_ : at_a_;
    const std::string topic = dds::ros_topic_name(routes[i].topic);
    const std::string type = dds::ros_type_name(routes[i].type);
    Inbox<std::vector<std::byte>> inbox;
    dds::Writer writer = from.create_writer(topic, type, {});
    const dds::Reader reader =
        to.create_reader(topic, type, {}, [&](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); });
    ASSERT_TRUE(eventually([&] {
      static_cast<void>(writer.write(string(1)));
      usleep(20'000);
      return inbox.size() > 0;
    })) << topic;
  }
  // 400 ends of routes, with sockets' buffers, readers and writers: less than half a MiB for each.
  if (!sanitized) {
    EXPECT_LT(status("VmRSS") - memory_before, std::size_t{200} << 10U);
  }
}

}  // namespace
}  // namespace trestle::test::many_routes_test
