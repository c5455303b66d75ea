#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trestle::test {

/// Samples of ROS 2 types as CDR with encapsulation header, written by eProsima's serialiser, not ours. Each
/// number gives another sample.
using Sample = std::vector<std::byte>;

[[nodiscard]] Sample point_cloud(std::uint32_t number, std::uint32_t points);
[[nodiscard]] Sample tf_message(std::uint32_t number);
[[nodiscard]] Sample nav_sat_fix(std::uint32_t number);
[[nodiscard]] Sample point(std::uint32_t number);
[[nodiscard]] Sample image(std::uint32_t number);
[[nodiscard]] Sample string(std::uint32_t number);
/// Of std_msgs/msg/Float32MultiArray.
[[nodiscard]] Sample floats(std::uint32_t number, std::uint32_t count);
/// Of test_msgs/msg/Tracks, see tracks_package().
[[nodiscard]] Sample tracks(std::uint32_t number);

/// Writes the packages of a nested custom type into a folder.
void write_tracks_package(const char* folder);

}  // namespace trestle::test
