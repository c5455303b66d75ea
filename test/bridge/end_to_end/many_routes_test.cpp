#include <gtest/gtest.h>

#include <fstream>

#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/sanitized.hpp"

namespace trestle::test::many_routes_test {
namespace {

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

class ManyRoutes : public TwoBridges {
 protected:
  /// Each route carries its own samples, while the others do.
  void expect_all_to_work(const std::vector<TestRoute>& routes) {
    struct Ends {
      dds::Writer writer;
      dds::Reader reader;
    };
    std::vector<Inbox<std::vector<std::byte>>> inboxes(routes.size());
    std::vector<Ends> ends;
    for (std::size_t i = 0; i < routes.size(); ++i) {
      const std::string topic = dds::ros_topic_name(routes[i].topic);
      const std::string type = dds::ros_type_name(routes[i].type);
      dds::Participant& from = routes[i].from_a_to_b ? at_a_ : at_b_;
      dds::Participant& to = routes[i].from_a_to_b ? at_b_ : at_a_;
      ends.push_back({from.create_writer(topic, type, {}),
                      to.create_reader(topic, type, {}, [&inbox = inboxes[i]](const dds::Sample& sample) {
                        inbox.put(copy(sample.cdr()));
                      })});
    }
    for (std::size_t i = 0; i < routes.size(); ++i) {
      SCOPED_TRACE(routes[i].topic);
      const Sample sent = string(static_cast<std::uint32_t>(i));
      ASSERT_TRUE(eventually([&] {
        static_cast<void>(ends[i].writer.write(sent));
        usleep(2'000);
        return inboxes[i].size() > 0;
      }));
      const std::vector<std::byte> arrived = inboxes[i].take().front();
      ASSERT_GE(arrived.size(), sent.size());
      EXPECT_TRUE(std::equal(sent.begin(), sent.end(), arrived.begin()));
    }
  }
};

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
  EXPECT_TRUE(
      eventually([&] { return status("Threads") == threads_of_one; }))  // one that ends is there for a moment
      << status("Threads") << " instead of " << threads_of_one;

  expect_all_to_work({routes.end() - 2, routes.end()});
  // 400 ends of routes, with sockets' buffers, readers and writers: less than half a MiB for each.
  if (!sanitized) {
    EXPECT_LT(status("VmRSS") - memory_before, std::size_t{200} << 10U);
  }
  expect_all_to_work(routes);
}

}  // namespace
}  // namespace trestle::test::many_routes_test
