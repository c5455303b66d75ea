// The keys of `dds` that big systems need.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::load_dds_test {
namespace {

using carry::DdsSettings;
using dds::DiscoveryServer;
using testing::ElementsAre;
using testing::HasSubstr;

std::string with(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\n"
         "dds:\n"
         "  " +
         keys +
         "\n"
         "routes:\n"
         "  - {topic: /a, type: std_msgs/msg/String, direction: someip_to_dds, service: 1, instance: 2, "
         "eventgroup: 3, "
         "event: 0x8004}\n";
}

class BigSystems : public testing::Test {
 protected:
  BigSystems() {
    std::filesystem::create_directories(folder_ + "/keys/enclaves");
    std::ofstream{folder_ + "/profiles.xml"} << "<dds/>";
  }
  ~BigSystems() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] carry::BridgeConfig load(const std::string& keys) const {
    auto loaded = carry::parse_config(with(keys), folder_ + "/b.yaml");
    if (!loaded) {
      ADD_FAILURE() << to_string(loaded.error().front());
      return {};
    }
    return std::move(loaded->config);
  }

  const std::string folder_ = testing::TempDir() + "trestle-dds-" + std::to_string(getpid());
};

TEST_F(BigSystems, HaveNoneOfThisByDefault) {
  const DdsSettings dds = load("domain: 1").dds;
  EXPECT_EQ(dds.profiles_file, "");
  EXPECT_TRUE(dds.discovery_servers.empty());
  EXPECT_EQ(dds.security, carry::SecuritySettings{});
}

TEST_F(BigSystems, NameAProfile) {
  EXPECT_EQ(load("profiles: profiles.xml").dds.profiles_file, folder_ + "/profiles.xml");
  EXPECT_EQ(load("profiles: profiles.xml").dds.profile, "trestle");
  const auto config = load("profiles: " + folder_ + "/profiles.xml\n  profile: vehicle");
  EXPECT_EQ(config.dds.profiles_file, folder_ + "/profiles.xml");
  EXPECT_EQ(config.dds.profile, "vehicle");
  EXPECT_THAT(summary(config, {}), HasSubstr("  profile vehicle of " + folder_ + "/profiles.xml\n"));
  EXPECT_THAT(problems_of(with("profiles: none.xml")),
              ElementsAre("b.yaml:3:13: error: profiles: there is no file 'none.xml'"));
  EXPECT_THAT(problems_of(with("profile: vehicle")),
              ElementsAre("b.yaml:3:12: error: profile: needs 'profiles', the file that contains it"));
}

TEST_F(BigSystems, AreToldWhichProfilesAreNotUsed) {
  const auto warnings = [&](const std::string& xml) {
    std::ofstream{folder_ + "/some.xml"} << xml;
    auto loaded = carry::parse_config(with("profiles: some.xml"), folder_ + "/b.yaml");
    std::vector<std::string> texts;
    for (const documents::Problem& warning : loaded.value().warnings) {
      texts.push_back(fmt::format("{}: {}", warning.mark.line, warning.text));
    }
    return texts;
  };
  const std::string unused =
      R"(<profiles><participant profile_name="trestle"/><!-- <data_writer profile_name="c"/> -->)"
      R"(<data_writer profile_name="rt/a"/></profiles>)";
  EXPECT_THAT(
      warnings("<dds>" + unused + R"(<profiles><data_reader profile_name="b"/></profiles></dds>)"),
      ElementsAre(
          "3: profiles: 'rt/a', 'b' of readers and writers: not used, because these have the `qos` of "
          "their routes"));
  EXPECT_THAT(warnings(unused), ElementsAre(HasSubstr("'rt/a' of readers")));
  EXPECT_THAT(warnings(R"(<dds><profiles><participant profile_name="trestle"/></profiles></dds>)"),
              testing::IsEmpty());
  EXPECT_THAT(warnings("<dds><profiles>"), testing::IsEmpty());
}

TEST_F(BigSystems, NameDiscoveryServers) {
  EXPECT_THAT(load("discovery_server: 10.0.0.1").dds.discovery_servers,
              ElementsAre(DiscoveryServer{"10.0.0.1", 11811}));
  const auto config = load("discovery_server: 10.0.0.1:7000;10.0.0.2");
  EXPECT_THAT(config.dds.discovery_servers,
              ElementsAre(DiscoveryServer{"10.0.0.1", 7000}, DiscoveryServer{"10.0.0.2", 11811}));
  EXPECT_THAT(summary(config, {}), HasSubstr("  discovery server 10.0.0.1:7000\n"));
  // As ROS_DISCOVERY_SERVER may have them: the place is the number.
  const auto more = load("discovery_server: ';[fd00::1]:7000;;fd00::2;host-1.local:7001;'");
  EXPECT_THAT(more.dds.discovery_servers,
              ElementsAre(DiscoveryServer{}, DiscoveryServer{"fd00::1", 7000}, DiscoveryServer{},
                          DiscoveryServer{"fd00::2", 11811}, DiscoveryServer{"host-1.local", 7001}));
  EXPECT_THAT(summary(more, {}), HasSubstr("  discovery server [fd00::1]:7000\n"));
  EXPECT_THAT(summary(more, {}), HasSubstr("  discovery server host-1.local:7001\n"));
  for (const char* const word :
       {"10.0.0.1:0", "10.0.0.1:70000", "10.0.0.1:", "239.0.0.1", "10.0.0", "ff02::1", "10.0.0.1;a/b", ";",
        ";[fd00::1", ";[fd00::1]7000", ";[10.0.0.1]:7000", "a:b:c"}) {
    const std::string wrong{word};
    EXPECT_THAT(
        problems_of(with("discovery_server: '" + wrong + "'")),
        ElementsAre("b.yaml:3:21: error: discovery_server: expected addresses of discovery servers such as "
                    "10.0.0.1:11811, [fd00::1]:11811 or host:11811 (several with ';' between them), found '" +
                    wrong + "'"));
  }
}

TEST_F(BigSystems, NameAnEnclave) {
  EXPECT_EQ(load("security: {keystore: keys}").dds.security,
            (carry::SecuritySettings{folder_ + "/keys", "/"}));
  const auto config = load("security: {keystore: keys, enclave: /vehicle/trestle}");
  EXPECT_EQ(config.dds.security, (carry::SecuritySettings{folder_ + "/keys", "/vehicle/trestle"}));
  EXPECT_THAT(summary(config, {}),
              HasSubstr("  security: enclave /vehicle/trestle of " + folder_ + "/keys\n"));
  EXPECT_THAT(problems_of(with("security: {keystore: none}")),
              ElementsAre("b.yaml:3:24: error: keystore: 'none' has no folder 'enclaves'"));
  EXPECT_THAT(
      problems_of(with("security: {enclave: x}")),
      ElementsAre(
          "b.yaml:3:13: error: security: 'keystore' is missing: expected a folder that `ros2 security` made",
          "b.yaml:3:23: error: enclave: expected the absolute name of an enclave such as "
          "/vehicle/trestle, found 'x'"));
}

}  // namespace
}  // namespace trestle::test::load_dds_test
