#include "bridge/measure/demo/lidar_scene.hpp"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <set>

#include "someip/wire/bytes.hpp"

namespace trestle::measure::demo::lidar_scene_test {
namespace {

Cloud rendered(std::uint64_t seed, std::uint64_t frame) {
  Cloud cloud;
  LidarScene{seed}.render(frame, cloud);
  return cloud;
}

struct Point {
  float x = 0;
  float y = 0;
  float z = 0;
  float intensity = 0;
  std::uint16_t ring = 0;
  float time = 0;
};

Point point_at(const Cloud& cloud, std::size_t index) {
  const std::byte* at = cloud.data.data() + index * cloud.point_bytes;
  const auto number = [&](std::size_t offset) {
    return std::bit_cast<float>(someip::load<std::uint32_t>(at + offset, std::endian::little));
  };
  return {
      number(0), number(4), number(8), number(12), someip::load<std::uint16_t>(at + 16, std::endian::little),
      number(20)};
}

TEST(LidarScene, HasTheShapeOfARealLidar) {
  const Cloud cloud = rendered(1, 0);
  EXPECT_EQ(cloud.height, 64U);
  EXPECT_EQ(cloud.width, 2048U);
  EXPECT_EQ(cloud.point_bytes, 24U);
  EXPECT_EQ(cloud.data.size(), 3'145'728U);
  std::size_t hits = 0;
  std::set<std::uint32_t> distances;
  float nearest = 1000;
  float farthest = 0;
  for (std::size_t i = 0; i < 131'072; ++i) {
    const Point point = point_at(cloud, i);
    EXPECT_EQ(point.ring, i / 2048);
    EXPECT_GE(point.time, 0);
    EXPECT_LT(point.time, LidarScene::turn_s);
    if (std::isnan(point.x)) {
      continue;
    }
    ++hits;
    const float range = std::hypot(point.x, point.y, point.z);
    nearest = std::min(nearest, range);
    farthest = std::max(farthest, range);
    distances.insert(std::bit_cast<std::uint32_t>(range));
    EXPECT_GE(point.intensity, 0);
    EXPECT_LE(point.intensity, 255);
    EXPECT_GT(point.z, -2.1) << "under the road";
  }
  // Nearly every ray meets the road or a house, and hardly two distances are the same.
  EXPECT_GT(hits, 120'000U);
  EXPECT_GT(distances.size(), hits / 2);
  EXPECT_GT(nearest, 1.5);
  EXPECT_GT(farthest, 60);
  EXPECT_LE(farthest, LidarScene::max_range_m + 0.1);
}

TEST(LidarScene, ShowsTheRoadWhereTheBeamsMeetIt) {
  const Cloud cloud = rendered(1, 0);
  // The lowest beam, 24.8 degrees down from 1.9 m, meets a flat road at 1.9 / tan(24.8) = 4.112 m.
  int on_the_road = 0;
  for (std::size_t column = 0; column < 2048; ++column) {
    const Point point = point_at(cloud, column);
    on_the_road += std::abs(std::hypot(point.x, point.y) - 4.112F) < 0.03F ? 1 : 0;
  }
  EXPECT_GT(on_the_road, 1500);
}

TEST(LidarScene, HasWallsThatRiseUpright) {
  const Cloud cloud = rendered(1, 0);
  // To the right (column 512 of a clockwise turn is -y) there are houses; beams up a wall are at one
  // distance.
  int upright = 0;
  for (std::size_t column = 400; column < 620; ++column) {
    const Point low = point_at(cloud, 55 * 2048 + column);
    const Point high = point_at(cloud, 62 * 2048 + column);
    upright +=
        high.z > low.z && std::abs(std::hypot(low.x, low.y) - std::hypot(high.x, high.y)) < 0.05F ? 1 : 0;
  }
  EXPECT_GT(upright, 100);
}

TEST(LidarScene, IsTheSameForTheSameSeedAndFrame) {
  EXPECT_TRUE(rendered(7, 42).data == rendered(7, 42).data);
  EXPECT_FALSE(rendered(7, 42).data == rendered(8, 42).data);
}

TEST(LidarScene, MovesFromFrameToFrame) {
  const Cloud first = rendered(1, 10);
  const Cloud second = rendered(1, 11);
  const Cloud later = rendered(1, 100);
  int changed = 0;
  int moved_far = 0;
  for (std::size_t i = 0; i < 131'072; ++i) {
    const Point a = point_at(first, i);
    const Point b = point_at(second, i);
    const Point c = point_at(later, i);
    changed += a.x != b.x ? 1 : 0;
    moved_far += std::abs(std::hypot(a.x, a.y) - std::hypot(c.x, c.y)) > 1 ? 1 : 0;
  }
  EXPECT_GT(changed, 120'000);  // noise alone does that
  EXPECT_GT(moved_far, 5'000);  // the scene does that
}

TEST(LidarScene, ReusesTheMemoryOfItsCloud) {
  const LidarScene scene{1};
  Cloud cloud;
  scene.render(0, cloud);
  const std::byte* before = cloud.data.data();
  scene.render(1, cloud);
  EXPECT_EQ(cloud.data.data(), before);
  EXPECT_TRUE(cloud.data == rendered(1, 1).data);
}

}  // namespace
}  // namespace trestle::measure::demo::lidar_scene_test
