#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "bridge/measure/point_cloud.hpp"

namespace trestle::measure::demo {

/// A spinning lidar on a car in a street: houses, parked and moving cars, people, trees, and noise. Rays are
/// cast for every frame, so clouds have the shape, the size and the entropy of real ones.
///
/// 64 beams from 24.8 degrees below to 2 degrees above the horizon, 2048 columns a turn: 131,072 points of
/// 24 bytes (x y z intensity as float32, ring as uint16, time as float32 seconds from the start of the turn),
/// 3,145,728 bytes. Rays that hit nothing within 120 m are points of NaN, so the cloud is organised.
class LidarScene {
 public:
  static constexpr std::uint32_t beams = 64;
  static constexpr std::uint32_t columns = 2048;
  static constexpr std::uint32_t point_bytes = 24;
  static constexpr float max_range_m = 120.0F;
  static constexpr float turn_s = 0.1F;  ///< time between frames

  /// @param seed  of the street's looks and of all noise: same seed and frame, same bytes.
  explicit LidarScene(std::uint64_t seed);

  /// Replaces the contents of `cloud` by frame number `frame`. Keeps its memory, so that a cloud that is used
  /// again costs no allocation.
  void render(std::uint64_t frame, Cloud& cloud) const;

 private:
  /// An upright box, or cylinder if `radius` is not 0; in metres, in the street's coordinates (x along it).
  struct Solid {
    float x = 0;
    float y = 0;
    float half_length = 0;  ///< in x
    float half_width = 0;   ///< in y
    float radius = 0;
    float top = 0;  ///< height above the ground
    float reflectivity = 0;
    float speed = 0;  ///< along x, m/s
  };
  /// Where a column's vertical plane cuts a solid: horizontal distances from the sensor.
  struct Cut {
    float near = 0;
    float far = 0;
    float top = 0;
    float reflectivity = 0;
  };

  [[nodiscard]] std::vector<Solid> around(float travelled, float time_s) const;
  static void cut(const std::vector<Solid>& solids, float cos_azimuth, float sin_azimuth,
                  std::vector<Cut>& cuts);

  std::uint64_t seed_;
  std::vector<Solid> movers_;
  std::array<float, beams> slope_{};  ///< metres up for each metre ahead
  std::array<float, columns> cos_{};
  std::array<float, columns> sin_{};
};

}  // namespace trestle::measure::demo
