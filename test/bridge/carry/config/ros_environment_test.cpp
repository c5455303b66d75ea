#include "bridge/carry/config/ros_environment.hpp"

#include <gtest/gtest.h>

#include <map>

namespace trestle::test::ros_environment_test {
namespace {

using namespace carry;

Environment environment(std::map<std::string, std::string> values) {
  return [values = std::move(values)](const char* name) {
    const auto value = values.find(name);
    return value == values.end() ? std::nullopt : std::optional{value->second};
  };
}

TEST(RosEnvironment, NamesTheDistributionWhereTheFileDoesNot) {
  DdsSettings open;
  EXPECT_EQ(apply_ros_environment(open, environment({{"ROS_DISTRO", "jazzy"}})), "");
  EXPECT_EQ(open.ros_distro, "jazzy");
  DdsSettings set;
  set.ros_distro = "humble";
  EXPECT_EQ(apply_ros_environment(set, environment({{"ROS_DISTRO", "jazzy"}})), "");
  EXPECT_EQ(set.ros_distro, "humble");
  DdsSettings nonsense;
  EXPECT_EQ(apply_ros_environment(nonsense, environment({{"ROS_DISTRO", "../x"}})), "");
  EXPECT_EQ(nonsense.ros_distro, "");
}

TEST(RosEnvironment, ChoosesTheDomainWhereTheFileDoesNot) {
  DdsSettings open;
  EXPECT_EQ(apply_ros_environment(open, environment({{"ROS_DOMAIN_ID", "42"}})), "");
  EXPECT_EQ(open.domain, 42U);
  DdsSettings empty;
  EXPECT_EQ(apply_ros_environment(empty, environment({{"ROS_DOMAIN_ID", ""}})), "");
  EXPECT_FALSE(empty.has_domain);
  EXPECT_EQ(empty.domain, 0U);
  for (const char* const wrong : {"233", "-1", "x", "1 "}) {
    DdsSettings set;
    set.has_domain = true;
    EXPECT_EQ(apply_ros_environment(set, environment({{"ROS_DOMAIN_ID", wrong}})), "");
    EXPECT_EQ(set.domain, 0U);
    DdsSettings left_open;
    EXPECT_EQ(apply_ros_environment(left_open, environment({{"ROS_DOMAIN_ID", wrong}})),
              "ROS_DOMAIN_ID in the environment: expected a whole number from 0 to 232, found '" +
                  std::string{wrong} + "' (dds.domain would override it)");
  }
}

TEST(RosEnvironment, NamesDiscoveryServersWhereTheFileDoesNot) {
  const auto servers = [](const std::string& value, DdsSettings dds) {
    EXPECT_EQ(apply_ros_environment(dds, environment({{"ROS_DISCOVERY_SERVER", value}})), "");
    return dds.discovery_servers;
  };
  using Servers = std::vector<dds::DiscoveryServer>;
  EXPECT_EQ(servers(";10.0.0.1:7000", {}), (Servers{{}, {"10.0.0.1", 7000}}));
  EXPECT_EQ(servers("TCPv4:[10.0.0.1]:7000", {}), Servers{});
  DdsSettings set;
  set.discovery_servers = {{"host"}};
  EXPECT_EQ(servers("10.0.0.1", set), Servers{{"host"}});
  DdsSettings profiled;
  profiled.profiles_file = "profiles.xml";
  EXPECT_EQ(servers("10.0.0.1", profiled), Servers{});
}

TEST(RosEnvironment, TurnsSecurityOnAsForRosNodes) {
  const auto keystore = [](std::map<std::string, std::string> values) {
    DdsSettings dds;
    EXPECT_EQ(apply_ros_environment(dds, environment(std::move(values))), "");
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
  EXPECT_EQ(apply_ros_environment(set, environment({{"ROS_SECURITY_ENABLE", "true"},
                                                    {"ROS_SECURITY_KEYSTORE", "/none"},
                                                    {"ROS_SECURITY_STRATEGY", "Enforce"}})),
            "");
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
