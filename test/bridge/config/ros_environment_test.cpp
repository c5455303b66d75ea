#include "bridge/config/ros_environment.hpp"

#include <gtest/gtest.h>

#include <map>

namespace trestle::test::ros_environment_test {
namespace {

using namespace bridge;

Environment environment(std::map<std::string, std::string> values) {
  return [values = std::move(values)](const char* name) {
    const auto value = values.find(name);
    return value == values.end() ? std::nullopt : std::optional{value->second};
  };
}

TEST(RosEnvironment, NamesTheDistributionWhereTheFileDoesNot) {
  DdsSettings open;
  apply_ros_environment(open, environment({{"ROS_DISTRO", "jazzy"}}));
  EXPECT_EQ(open.ros_distro, "jazzy");
  DdsSettings set;
  set.ros_distro = "humble";
  apply_ros_environment(set, environment({{"ROS_DISTRO", "jazzy"}}));
  EXPECT_EQ(set.ros_distro, "humble");
  DdsSettings nonsense;
  apply_ros_environment(nonsense, environment({{"ROS_DISTRO", "../x"}}));
  EXPECT_EQ(nonsense.ros_distro, "");
}

TEST(RosEnvironment, TurnsSecurityOnAsForRosNodes) {
  const auto keystore = [](std::map<std::string, std::string> values) {
    DdsSettings dds;
    apply_ros_environment(dds, environment(std::move(values)));
    return security_folder(dds.security);
  };
  EXPECT_EQ(keystore({{"ROS_SECURITY_KEYSTORE", "/"}, {"ROS_SECURITY_STRATEGY", "Enforce"}}), "");
  EXPECT_EQ(keystore({{"ROS_SECURITY_ENABLE", "true"}, {"ROS_SECURITY_KEYSTORE", "/none"}}), "");
  EXPECT_EQ(keystore({{"ROS_SECURITY_ENABLE", "true"},
                      {"ROS_SECURITY_KEYSTORE", "/none"},
                      {"ROS_SECURITY_STRATEGY", "Enforce"}}),
            "/none/enclaves");
  EXPECT_EQ(keystore({{"ROS_SECURITY_ENABLE", "true"},
                      {"ROS_SECURITY_KEYSTORE", "/none"},
                      {"ROS_SECURITY_ENCLAVE_OVERRIDE", "/front/trestle"},
                      {"ROS_SECURITY_STRATEGY", "Enforce"}}),
            "/none/enclaves/front/trestle");
  DdsSettings set;
  set.security = {"/file", "/own"};
  apply_ros_environment(set, environment({{"ROS_SECURITY_ENABLE", "true"},
                                          {"ROS_SECURITY_KEYSTORE", "/none"},
                                          {"ROS_SECURITY_STRATEGY", "Enforce"}}));
  EXPECT_EQ(security_folder(set.security), "/file/enclaves/own");
}

TEST(RosEnvironment, TellsHowLongIdsAre) {
  EXPECT_EQ(gid_bytes("foxy"), 24U);
  EXPECT_EQ(gid_bytes("humble"), 24U);
  EXPECT_EQ(gid_bytes("iron"), 16U);
  EXPECT_EQ(gid_bytes("rolling"), 16U);
  EXPECT_EQ(gid_bytes(""), 0U);
}

}  // namespace
}  // namespace trestle::test::ros_environment_test
