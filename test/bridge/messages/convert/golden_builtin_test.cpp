#include <algorithm>
#include <array>

#include "test/bridge/messages/convert/golden_builtin.hpp"

namespace trestle::messages::golden_builtin_test {
namespace {

using namespace trestle::test;

std::vector<const std::vector<Golden>*> packages() {
  return {&geometry_msgs(), &nav_msgs(), &sensor_msgs(), &std_msgs(), &tf2_msgs()};
}

TEST(GoldenBuiltins, ConvertBothWays) {
  for (const auto* package : packages()) {
    for (const Golden& golden : *package) {
      SCOPED_TRACE(golden.type);
      expect_both_ways(golden.type, golden.fields);
    }
  }
}

/// The messages of the packages that are shown here field by field.
std::vector<std::string> builtin_messages() {
  std::vector<std::string> names = TypeLibrary::builtin_names();
  std::erase_if(names, [](const std::string& name) {
    constexpr std::array packages{"builtin_interfaces", "geometry_msgs", "nav_msgs",
                                  "sensor_msgs",        "std_msgs",      "tf2_msgs"};
    return std::ranges::none_of(
        packages, [&](const char* package) { return name.starts_with(std::string{package} + "/msg/"); });
  });
  return names;
}

TEST(GoldenBuiltins, LeaveNoTypeOut) {
  std::vector<std::string> names{
      // golden_messages_test.cpp
      "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration", "std_msgs/msg/ColorRGBA",
      "std_msgs/msg/UInt8MultiArray", "geometry_msgs/msg/Twist", "geometry_msgs/msg/PoseStamped",
      "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Path", "nav_msgs/msg/OccupancyGrid", "nav_msgs/msg/Odometry",
      "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField", "sensor_msgs/msg/NavSatFix",
      "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Joy", "sensor_msgs/msg/JointState",
      "sensor_msgs/msg/BatteryState", "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage",
      "sensor_msgs/msg/CameraInfo",
      // golden_test.cpp
      "std_msgs/msg/String", "std_msgs/msg/Header", "sensor_msgs/msg/PointCloud2", "geometry_msgs/msg/Point"};
  for (const auto* package : packages()) {
    for (const Golden& golden : *package) {
      std::string name = golden.type;
      names.push_back(name.insert(name.find('/'), "/msg"));
    }
  }
  std::ranges::sort(names);
  EXPECT_EQ(names, builtin_messages());
}

}  // namespace
}  // namespace trestle::messages::golden_builtin_test
