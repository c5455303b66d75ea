#include "bridge/carry/config/id_allocator.hpp"

#include <gtest/gtest.h>

#include <set>

namespace trestle::test::id_allocator_test {
namespace {

using carry::choose_service;
using carry::fnv1a;
using carry::ServiceRange;
using someip::ServiceId;

constexpr ServiceRange wide{ServiceId{0x6000}, ServiceId{0x6fff}};

// From draft-eastlake-fnv.
TEST(Fnv1a, HasTheValuesOfItsAuthors) {
  EXPECT_EQ(fnv1a(""), 0x811c9dc5U);
  EXPECT_EQ(fnv1a("a"), 0xe40c292cU);
  EXPECT_EQ(fnv1a("foobar"), 0xbf9cf968U);
}

// Computed by another program. These must stay as they are for ever: clients are configured with them.
TEST(ChooseService, GivesTheSameIdsForEver) {
  const auto free = [](ServiceId) { return false; };
  EXPECT_EQ(choose_service(wide, "/sensing/imu", "sensor_msgs/msg/Imu", free), ServiceId{0x61ac});
  EXPECT_EQ(choose_service(wide, "/sensing/lidar/points", "sensor_msgs/msg/PointCloud2", free),
            ServiceId{0x6957});
  EXPECT_EQ(choose_service(wide, "/a", "std_msgs/msg/String", free), ServiceId{0x63a3});
  EXPECT_EQ(choose_service({ServiceId{0x6000}, ServiceId{0x6003}}, "/a", "std_msgs/msg/String", free),
            ServiceId{0x6003});
  EXPECT_EQ(choose_service({ServiceId{7}, ServiceId{7}}, "/a", "std_msgs/msg/String", free), ServiceId{7});
}

TEST(ChooseService, TakesTheNextFreeIdAndTheFirstAfterTheLast) {
  constexpr ServiceRange four{ServiceId{0x6000}, ServiceId{0x6003}};
  std::set<ServiceId> taken;
  std::vector<int> chosen;
  while (const auto id = choose_service(four, "/s/a", "std_msgs/msg/String",
                                        [&](ServiceId one) { return taken.contains(one); })) {
    taken.insert(*id);
    chosen.push_back(someip::value(*id));
  }
  // The hash is 0x590d3cc5; 5 mod 4 is 1.
  EXPECT_EQ(chosen, (std::vector{0x6001, 0x6002, 0x6003, 0x6000}));
}

TEST(ChooseService, UsesTheWholeRange) {
  constexpr ServiceRange all{ServiceId{1}, ServiceId{0xfffd}};
  const auto only = [](std::uint16_t free) {
    return [free](ServiceId one) { return one != ServiceId{free}; };
  };
  EXPECT_EQ(choose_service(all, "/a", "x", only(1)), ServiceId{1});
  EXPECT_EQ(choose_service(all, "/a", "x", only(0xfffd)), ServiceId{0xfffd});
  EXPECT_EQ(choose_service(all, "/a", "x", only(0xfffe)), std::nullopt);
}

}  // namespace
}  // namespace trestle::test::id_allocator_test
