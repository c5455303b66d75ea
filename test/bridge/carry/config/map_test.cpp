// The keys of a mapping of fields, and where its mistakes are.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bridge/carry/commands/explain.hpp"
#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::map_test {
namespace {

using namespace carry;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class MapKeys : public testing::Test {
 protected:
  MapKeys() {
    std::filesystem::create_directories(folder_ / "car_msgs/msg");
    std::ofstream{folder_ / "car_msgs/msg/Gnss.msg"}
        << "int32 lat_e7\nint32 lon_e7\nuint8 fix\nuint8 counter\nuint32 time_ms\n";
    std::ofstream{folder_ / "Gnss.fidl"} << "package car\ninterface Gnss {\n  version { major 1 minor 0 }\n"
                                            "  broadcast fixed { out { Fix fix } }\n"
                                            "  struct Fix { Int32 lat Int32 lon UInt8 quality }\n}\n";
    std::ofstream{folder_ / "Gnss.fdepl"}
        << "import \"platform:/plugin/org.genivi.commonapi.someip/deployment/"
           "CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\nimport \"Gnss.fidl\"\n"
           "define org.genivi.commonapi.someip.deployment for interface car.Gnss {\n"
           "  SomeIpServiceID = 0x1234\n  SomeIpEventGroups = { 5 }\n"
           "  broadcast fixed { SomeIpEventID = 0x8002 SomeIpEventGroups = { 5 } }\n}\n"
           "define org.genivi.commonapi.someip.deployment for provider as P {\n"
           "  instance car.Gnss { InstanceId = \"car.Gnss\" SomeIpInstanceID = 7 }\n}\n";
  }
  ~MapKeys() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] tl::expected<Loaded, std::vector<documents::Problem>> load(const std::string& text) const {
    return parse_config(text, (folder_ / "b.yaml").string(), verdict_on);
  }
  /// What is said of a route with these keys, which begin in line 5: "LINE:COLUMN: error: text".
  [[nodiscard]] std::vector<std::string> said(const std::string& direction, const std::string& keys) const {
    const auto loaded = load(head(direction) + keys);
    std::vector<std::string> result = lines(loaded ? loaded->warnings : loaded.error());
    for (std::string& line : result) {
      line.erase(0, (folder_ / "b.yaml").string().size() + 1);
    }
    return result;
  }
  static std::string head(const std::string& direction) {
    return "someip: {address: 127.0.0.1}\ntypes: {paths: [.]}\nroutes:\n  - {topic: /fix, type: "
           "sensor_msgs/msg/NavSatFix, service: 1, instance: 1, eventgroup: 1, event: 0x8001, direction: " +
           direction + (direction == "dds_to_someip" ? ", port: 40001" : "") + ",\n";
  }

  const std::filesystem::path folder_ =
      std::filesystem::path{testing::TempDir()} / ("trestle-map-" + std::to_string(getpid()));
};

constexpr const char* good_keys = R"(payload: car_msgs/msg/Gnss, others: default, drop: [counter], map: {
  header.stamp: {from: time_ms, time: ms},
  header.frame_id: {value: gnss},
  status.status: {from: fix, table: {0: -1, 1: 0, 2: 2}, otherwise: keep},
  latitude: {from: lat_e7, scale: 1e-7},
  longitude: {from: lon_e7, scale: 1e-7, offset: -0.5},
  altitude: {value: 1.5, only: someip_to_dds}}}
)";

TEST_F(MapKeys, AreRead) {
  const auto loaded = load(head("someip_to_dds") + good_keys);
  ASSERT_TRUE(loaded) << to_string(loaded.error().front());
  EXPECT_THAT(loaded->warnings, IsEmpty());
  const messages::FieldMapping& mapping = loaded->config.routes.front().mapping.value();
  EXPECT_EQ(mapping.payload.text, "car_msgs/msg/Gnss");
  ASSERT_THAT(mapping.rules, SizeIs(6));
  EXPECT_EQ(mapping.rules[0].unit, messages::TimeUnit::ms);
  EXPECT_EQ(mapping.rules[1].value.value().text, "gnss");
  EXPECT_THAT(mapping.rules[2].table, SizeIs(3));
  EXPECT_EQ(mapping.rules[2].otherwise, messages::Otherwise::keep);
  EXPECT_EQ(mapping.rules[3].scale, 1e-7);
  EXPECT_EQ(mapping.rules[4].offset, -0.5);
  EXPECT_EQ(mapping.rules[5].only, messages::MapDirection::to_ros);
  EXPECT_TRUE(mapping.others_default);
  EXPECT_THAT(said("dds_to_someip", good_keys), IsEmpty());
}

TEST_F(MapKeys, AreShownAsWhatTheyDo) {
  const auto there = load(head("someip_to_dds") + good_keys);
  const auto back = load(head("dds_to_someip") + good_keys);
  ASSERT_TRUE(there && back);
  EXPECT_THAT(summary(there->config, {}),
              HasSubstr("  map   /fix: sensor_msgs/msg/NavSatFix of car_msgs/msg/Gnss\n"
                        "          header.stamp = time_ms in ms\n"
                        "          header.frame_id = \"gnss\"\n"
                        "          status.status = fix by {0: -1, 1: 0, 2: 2}, otherwise as it is\n"
                        "          latitude = 1e-07 * lat_e7\n"
                        "          longitude = 1e-07 * lon_e7 - 0.5\n"
                        "          altitude = \"1.5\"\n"
                        "          dropped: counter\n"
                        "          others = default\n"));
  EXPECT_THAT(summary(back->config, {}),
              HasSubstr("  map   /fix: car_msgs/msg/Gnss of sensor_msgs/msg/NavSatFix\n"
                        "          time_ms = header.stamp in ms\n"
                        "          fix = status.status by {-1: 0, 0: 1, 2: 2}, otherwise as it is\n"
                        "          lat_e7 = latitude / 1e-07\n"
                        "          lon_e7 = (longitude + 0.5) / 1e-07\n"
                        "          counter = default\n"
                        "          others = default\n"));
}

TEST_F(MapKeys, OfFieldsThatAreNotThereAreErrorsWithWhatWasMeant) {
  EXPECT_THAT(
      said("someip_to_dds",
           R"(payload: car_msgs/msg/Gnss, others: default, drop: [countr, time_ms, fix], map: {
  latitud: {from: lat_e7},
  longitude: {from: lon_e6}}}
)"),
      ElementsAre("5:53: error: drop: car_msgs/msg/Gnss has no field 'countr'; did you mean 'counter'?",
                  "6:3: error: map: sensor_msgs/msg/NavSatFix has no field 'latitud'; did you mean "
                  "'latitude'?",
                  "7:21: error: from: car_msgs/msg/Gnss has no field 'lon_e6'; did you mean 'lon_e7'?"));
}

TEST_F(MapKeys, MustSpeakOfEachFieldThatIsMade) {
  EXPECT_THAT(
      said("someip_to_dds", "payload: car_msgs/msg/Gnss, map: {latitude: {from: lat_e7}}}\n"),
      ElementsAre(HasSubstr("5:34: error: map: nothing is said of header, status, longitude, altitude, "
                            "position_covariance, position_covariance_type of sensor_msgs/msg/NavSatFix")));
  EXPECT_THAT(said("dds_to_someip", "payload: car_msgs/msg/Gnss, map: {latitude: {from: lat_e7}}}\n"),
              ElementsAre(HasSubstr("5:34: error: map: nothing says what lon_e7, fix, counter, time_ms of "
                                    "car_msgs/msg/Gnss becomes")));
}

TEST_F(MapKeys, ThatDoNotGoTogetherAreErrors) {
  EXPECT_THAT(
      said("someip_to_dds", R"(payload: car_msgs/msg/Gnss, others: default, drop: [counter, time_ms], map: {
  latitude: {from: lat_e7, value: 1},
  longitude: {},
  altitude: {from: lon_e7, scale: much},
  status.status: {from: fix, otherwise: keep},
  header.stamp: {time: ms},
  header.frame_id: {valu: gnss}}}
)"),
      ElementsAre("6:14: error: from: cannot stand beside value",
                  "7:14: error: map: 'longitude' needs `from`, a field of the payload, or `value`, or "
                  "`time: received`",
                  "8:35: error: scale: expected a decimal number, such as 0.01, found 'much'",
                  "9:30: error: otherwise: needs `table` beside it",
                  "10:18: error: map: 'header.stamp' needs `from`, a field of the payload",
                  "11:20: error: map: 'header.frame_id' needs `from`, a field of the payload, or `value`, "
                  "or `time: received`",
                  "11:21: error: unknown key 'valu' in map; did you mean 'value'?"));
}

TEST_F(MapKeys, NeedAMapAndAPayload) {
  EXPECT_THAT(said("someip_to_dds", "payload: car_msgs/msg/Gnss, drop: [fix], others: default}\n"),
              ElementsAre("5:10: error: payload: is for routes with `map`",
                          "5:35: error: drop: is for routes with `map`",
                          "5:50: error: others: is for routes with `map`"));
  EXPECT_THAT(said("someip_to_dds", "map: {}}\n"),
              ElementsAre(HasSubstr("4:5: error: route: 'payload' is missing")));
  EXPECT_THAT(said("someip_to_dds", "map: {}, payload: car_msgs/msg/Gns, others: default}\n"),
              ElementsAre(HasSubstr("5:19: error: payload: ")));
}

TEST_F(MapKeys, NameTypesOfTheInterfaces) {
  const std::string head = "someip: {address: 127.0.0.1}\ninterfaces: [Gnss.fidl, Gnss.fdepl]\nroutes:\n";
  const auto loaded = load(head +
                           "  - {someip: Gnss.fixed, topic: /fix, type: sensor_msgs/msg/NavSatFix, others: "
                           "default, map: {latitude: {from: lat}}, drop: [lon, quality]}\n");
  ASSERT_TRUE(loaded) << to_string(loaded.error().front());
  const Route& route = loaded->config.routes.front();
  EXPECT_EQ(route.type, "sensor_msgs/msg/NavSatFix");
  EXPECT_EQ(route.event, someip::MethodId{0x8002});
  EXPECT_NE(route.mapping.value().payload.text, "sensor_msgs/msg/NavSatFix");

  const std::string ids =
      "  - {topic: /fix, type: sensor_msgs/msg/NavSatFix, direction: someip_to_dds, service: 1, "
      "instance: 1, eventgroup: 1, event: 0x8001, others: default,\n";
  const auto by_name =
      load(head + ids + "     payload: Fix, map: {latitude: {from: lat}}, drop: [lon, quality]}\n");
  ASSERT_TRUE(by_name) << to_string(by_name.error().front());
  EXPECT_THAT(by_name->config.routes.front().mapping.value().payload.text, HasSubstr("/msg/Fix"));
  const auto wrong = load(head + ids + "     payload: Fixx, map: {latitude: {from: lat}}}\n");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(to_string(wrong.error().front()),
              HasSubstr(":5:15: error: payload: the interfaces have no type 'Fixx'; did you mean 'Fix'?"));
}

}  // namespace
}  // namespace trestle::test::map_test
