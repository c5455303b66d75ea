#include "bridge/generate/service_inputs.hpp"

#include <gmock/gmock.h>

#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/generate/targets.hpp"

namespace trestle::generate {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ServiceInputs inputs(const std::string& arguments) {
  ServiceInputs inputs;
  CLI::App app;
  inputs.add_to(app);
  app.parse(arguments);
  return inputs;
}

describe::Reading cloud() {
  messages::TypeLibrary library;
  const std::vector<describe::RosInterface> wanted{{.type = "sensor_msgs/msg/PointCloud2"}};
  return describe::describe_ros(wanted, library);
}

constexpr const char* all =
    "--package car.sensing --name Lidar --major 3 --minor 7 --event cloud --argument points --service-id "
    "0x1234 "
    "--event-id 0x8042 --eventgroup 0x21 --instance-name car.sensing.Front --instance 0x55 --address "
    "192.168.7.9 "
    "--udp-port 30511 --tcp-port 30512";

std::string text_of(const describe::System& system, std::string_view target_name) {
  std::string text;
  for (const describe::TextFile& file : target(target_name)->write(system, {}).files) {
    text += file.text;
  }
  return text;
}

TEST(ServiceInputs, AreAllHonouredInTheFidlAndFdepl) {
  describe::Reading reading = cloud();
  const ServiceInputs given = inputs(all);
  EXPECT_EQ(given.count(), 14U);
  ASSERT_THAT(given.apply(reading.model), IsEmpty());
  describe::IdLock lock;
  const describe::System system = make_system(std::move(reading), lock);
  ASSERT_TRUE(system.good);
  EXPECT_THAT(lock.services, IsEmpty());  // nothing was left to choose
  const std::string text = text_of(system, "fidl");
  for (const char* line :
       {"package car.sensing\n", "interface Lidar {", "major 3 minor 7", "broadcast cloud {",
        "PointCloud2 points\n", "SomeIpServiceID = 4660", "SomeIpEventID = 32834",
        "SomeIpEventGroups = { 33 }", "InstanceId = \"car.sensing.Front\"", "SomeIpInstanceID = 85",
        "SomeIpUnicastAddress = \"192.168.7.9\"", "SomeIpUnreliableUnicastPort = 30511",
        "SomeIpReliableUnicastPort = 30512"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(ServiceInputs, AreHonouredInTheOtherTargets) {
  describe::Reading reading = cloud();
  ASSERT_THAT(inputs(all).apply(reading.model), IsEmpty());
  describe::IdLock lock;
  const describe::System system = make_system(std::move(reading), lock);
  for (const char* name : {"arxml", "vsomeip", "routes", "sheet", "json", "wireshark"}) {
    const std::string text = text_of(system, name);
    const bool decimal = std::string_view{name} == "arxml";
    EXPECT_THAT(text, testing::AnyOf(HasSubstr(decimal ? ">4660<" : "0x1234"), HasSubstr("1234"))) << name;
    EXPECT_THAT(text, testing::AnyOf(HasSubstr(decimal ? ">32834<" : "0x8042"), HasSubstr("8042"))) << name;
    EXPECT_THAT(text, HasSubstr("30511")) << name;
  }
}

TEST(ServiceInputs, KeepTheTypesOfTheSource) {
  describe::Reading reading = cloud();
  const auto types = reading.model.types.size();
  ASSERT_THAT(inputs("--service-id 0x1234").apply(reading.model), IsEmpty());
  EXPECT_EQ(reading.model.types.size(), types);
  EXPECT_EQ(reading.model.services[0].name, "PointCloud2Service");
}

TEST(ServiceInputs, RefuseWhatTheyCannotMean) {
  describe::Reading reading = cloud();
  reading.model.services.push_back(reading.model.services[0]);
  EXPECT_THAT(inputs("--name Lidar").apply(reading.model)[0].text, HasSubstr("are for one service"));
  EXPECT_THAT(inputs("--address 10.0.0.1").apply(reading.model), IsEmpty());  // the bridge's, then
  reading.model.services.pop_back();
  reading.model.services[0].events.clear();
  EXPECT_THAT(inputs("--event cloud").apply(reading.model)[0].text, HasSubstr("are for one event"));
  EXPECT_THROW(static_cast<void>(inputs("--name 1st").apply(reading.model)), CLI::ValidationError);
  EXPECT_THROW(static_cast<void>(inputs("--service-id 0x12345").apply(reading.model)), CLI::ValidationError);
  EXPECT_THROW(static_cast<void>(inputs("--address car").apply(reading.model)), CLI::ValidationError);
  EXPECT_THROW(inputs("--udp-port 70000"), CLI::ValidationError);
}

}  // namespace
}  // namespace trestle::generate
