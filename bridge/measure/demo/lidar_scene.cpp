#include "bridge/measure/demo/lidar_scene.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "someip/wire/bytes.hpp"

namespace trestle::measure::demo {

namespace {

constexpr float sensor_height_m = 1.9F;
constexpr float own_speed = 8.0F;       // m/s
constexpr float street_half_width = 9;  // to the houses
constexpr float range_noise_m = 0.02F;

/// SplitMix64: a small generator whose every seed gives a good sequence.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_{seed} {}
  std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xbf58476d1ce4e5b9;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94d049bb133111eb;
    return mixed ^ (mixed >> 31U);
  }
  /// From 0 up to but not including 1.
  float unit() { return static_cast<float>(bits() >> 40U) * 0x1p-24F; }
  float between(float low, float high) { return low + (high - low) * unit(); }

 private:
  std::uint64_t state_;
};

/// Writes one point, little-endian.
void put(std::byte*& at, float x, float y, float z, float intensity, std::uint16_t ring, float time) {
  constexpr auto order = std::endian::little;
  someip::store(at, std::bit_cast<std::uint32_t>(x), order);
  someip::store(at + 4, std::bit_cast<std::uint32_t>(y), order);
  someip::store(at + 8, std::bit_cast<std::uint32_t>(z), order);
  someip::store(at + 12, std::bit_cast<std::uint32_t>(intensity), order);
  someip::store(at + 16, ring, order);
  someip::store(at + 18, std::uint16_t{0}, order);
  someip::store(at + 20, std::bit_cast<std::uint32_t>(time), order);
  at += LidarScene::point_bytes;
}

}  // namespace

LidarScene::LidarScene(std::uint64_t seed) : seed_{seed} {
  constexpr float lowest = -24.8F;
  constexpr float highest = 2.0F;
  constexpr float degree = std::numbers::pi_v<float> / 180;
  for (std::uint32_t beam = 0; beam < beams; ++beam) {
    // Ring 0 is the lowest, as lidar drivers for ROS number them.
    slope_[beam] = std::tan((lowest + (highest - lowest) * static_cast<float>(beam) / (beams - 1)) * degree);
  }
  for (std::uint32_t column = 0; column < columns; ++column) {
    const float azimuth = -2 * std::numbers::pi_v<float> * static_cast<float>(column) / columns;  // clockwise
    cos_[column] = std::cos(azimuth);
    sin_[column] = std::sin(azimuth);
  }
  Random random{seed};
  for (int i = 0; i < 10; ++i) {  // cars: our lane and the opposite one
    const bool ahead = i % 2 == 0;
    movers_.push_back({.x = random.between(-100, 100),
                       .y = ahead ? 0.0F : 3.4F,
                       .half_length = random.between(2.0F, 2.6F),
                       .half_width = 0.9F,
                       .top = random.between(1.4F, 2.2F),
                       .reflectivity = random.between(0.3F, 0.9F),
                       .speed = ahead ? own_speed + random.between(-1, 3) : -random.between(6, 12)});
  }
  for (int i = 0; i < 16; ++i) {  // people on the pavements
    const float side = i % 2 == 0 ? -1.0F : 1.0F;
    movers_.push_back({.x = random.between(-60, 60),
                       .y = side * random.between(6.5F, 8.2F),
                       .radius = random.between(0.22F, 0.35F),
                       .top = random.between(1.5F, 1.95F),
                       .reflectivity = random.between(0.2F, 0.5F),
                       .speed = random.between(-1.8F, 1.8F)});
  }
}

/// All solids near the sensor, in its coordinates.
std::vector<LidarScene::Solid> LidarScene::around(float travelled, float time_s) const {
  std::vector<Solid> solids;
  // Houses, trees and parked cars: each stretch of the street is generated from its number, so it always
  // looks the same.
  constexpr float stretch_m = 14;
  const auto first = static_cast<std::int64_t>(std::floor((travelled - max_range_m) / stretch_m));
  const auto last = static_cast<std::int64_t>(std::ceil((travelled + max_range_m) / stretch_m));
  for (std::int64_t stretch = first; stretch <= last; ++stretch) {
    Random random{seed_ ^ (static_cast<std::uint64_t>(stretch) * 0x2545f4914f6cdd1d)};
    const float x = static_cast<float>(stretch) * stretch_m - travelled;
    for (const float side : {-1.0F, 1.0F}) {
      const float setback = random.between(0, 3);
      solids.push_back({.x = x,
                        .y = side * (street_half_width + setback + 5),
                        .half_length = random.between(4.5F, 6.9F),
                        .half_width = 5,
                        .top = random.between(5, 16),
                        .reflectivity = random.between(0.2F, 0.7F)});
      if (random.unit() < 0.6F) {
        solids.push_back({.x = x + random.between(-4, 4),
                          .y = side * 5.2F,
                          .half_length = random.between(1.9F, 2.5F),
                          .half_width = 0.9F,
                          .top = random.between(1.4F, 2.0F),
                          .reflectivity = random.between(0.3F, 0.9F)});
      }
      solids.push_back({.x = x + 7,
                        .y = side * 7.0F,
                        .radius = random.between(0.15F, 0.4F),
                        .top = random.between(4, 8),
                        .reflectivity = 0.35F});
    }
  }
  for (Solid mover : movers_) {
    // When they leave the visible range at one end, they come back at the other.
    constexpr float circuit = 2 * max_range_m;
    const float x = mover.x + mover.speed * time_s - travelled;
    mover.x = x - circuit * std::round(x / circuit);
    if (std::abs(mover.x) > 4 || std::abs(mover.y) > 2) {  // not through the own car
      solids.push_back(mover);
    }
  }
  return solids;
}

/// The cuts of one column, nearest first.
void LidarScene::cut(const std::vector<Solid>& solids, float cos_azimuth, float sin_azimuth,
                     std::vector<Cut>& cuts) {
  cuts.clear();
  for (const Solid& solid : solids) {
    Cut found{.top = solid.top, .reflectivity = solid.reflectivity};
    const float along = solid.x * cos_azimuth + solid.y * sin_azimuth;
    if (solid.radius > 0) {
      const float aside = solid.x * sin_azimuth - solid.y * cos_azimuth;
      if (along <= 0 || std::abs(aside) >= solid.radius) {
        continue;
      }
      const float half = std::sqrt(solid.radius * solid.radius - aside * aside);
      found.near = along - half;
      found.far = along + half;
    } else {
      // Slabs; a division by zero gives infinities that compare as they should.
      const float x_1 = (solid.x - solid.half_length) / cos_azimuth;
      const float x_2 = (solid.x + solid.half_length) / cos_azimuth;
      const float y_1 = (solid.y - solid.half_width) / sin_azimuth;
      const float y_2 = (solid.y + solid.half_width) / sin_azimuth;
      found.near = std::max(std::min(x_1, x_2), std::min(y_1, y_2));
      found.far = std::min(std::max(x_1, x_2), std::max(y_1, y_2));
    }
    if (found.near > 0 && found.near < found.far && found.near < max_range_m) {
      cuts.push_back(found);
    }
  }
  std::ranges::sort(cuts, {}, &Cut::near);
}

void LidarScene::render(std::uint64_t frame, Cloud& cloud) const {
  cloud.height = beams;
  cloud.width = columns;
  cloud.point_bytes = point_bytes;
  cloud.dense = false;
  cloud.fields = {{"x", 0, FieldType::float32, 1},    {"y", 4, FieldType::float32, 1},
                  {"z", 8, FieldType::float32, 1},    {"intensity", 12, FieldType::float32, 1},
                  {"ring", 16, FieldType::uint16, 1}, {"time", 20, FieldType::float32, 1}};
  cloud.data.resize(std::size_t{beams} * columns * point_bytes);

  const float time_s = static_cast<float>(frame) * turn_s;
  const std::vector<Solid> solids = around(own_speed * time_s, time_s);
  Random random{seed_ + frame * 0xd1342543de82ef95};
  std::vector<Cut> cuts;
  for (std::uint32_t column = 0; column < columns; ++column) {
    cut(solids, cos_[column], sin_[column], cuts);
    const float time = turn_s * static_cast<float>(column) / columns;
    for (std::uint32_t beam = 0; beam < beams; ++beam) {
      const float slope = slope_[beam];
      float distance = slope < 0 ? -sensor_height_m / slope : std::numeric_limits<float>::infinity();
      float reflectivity = 0.15F;  // of the road
      for (const Cut& solid : cuts) {
        if (solid.near >= distance) {
          break;
        }
        if (sensor_height_m + slope * solid.near <= solid.top) {  // its face
          distance = solid.near;
          reflectivity = solid.reflectivity;
          break;
        }
        if (sensor_height_m + slope * solid.far < solid.top) {  // its roof, hit from above
          distance = std::min(distance, (solid.top - sensor_height_m) / slope);
          reflectivity = solid.reflectivity;
          break;
        }
      }
      // One draw gives the noise of range and of intensity.
      const std::uint64_t noise = random.bits();
      std::byte* at = cloud.data.data() + (std::size_t{beam} * columns + column) * point_bytes;
      const float stretch = std::sqrt(1 + slope * slope);
      if (distance * stretch > max_range_m) {
        constexpr float nan = std::numeric_limits<float>::quiet_NaN();
        put(at, nan, nan, nan, 0, static_cast<std::uint16_t>(beam), time);
        continue;
      }
      const float jitter = static_cast<float>(static_cast<std::int32_t>(noise & 0xffffU) - 0x8000) / 0x8000;
      const float grain = static_cast<float>((noise >> 16U) & 0xffffU) / 0x10000;
      distance += jitter * range_noise_m;
      const float intensity =
          255 * reflectivity * (0.85F + 0.3F * grain) / (1 + 0.0004F * distance * distance);
      put(at, distance * cos_[column], distance * sin_[column], distance * slope, intensity,
          static_cast<std::uint16_t>(beam), time);
    }
  }
}

}  // namespace trestle::measure::demo
