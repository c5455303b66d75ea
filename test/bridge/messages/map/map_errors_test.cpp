// What a mapping may not say, and which direction it is about.
#include <gmock/gmock.h>

#include "test/bridge/messages/map/mappings.hpp"

namespace trestle::messages::map_errors_test {
namespace {

using namespace trestle::test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr auto to_ros = MapDirection::to_ros;
constexpr auto to_payload = MapDirection::to_payload;

FieldMapping mapping(std::vector<MapRule> rules) {
  return {.mark = {1, 1}, .rules = std::move(rules)};
}

TEST(MapErrors, NameTheFieldThatWasMeant) {
  const MapTypes types{"uint16 speed\nuint16 rate", "float64 velocity\nstd_msgs/Header header"};
  EXPECT_THAT(said(types, mapping({from("velocty", "spee", {}, 3)}), to_ros),
              ElementsAre("3:1 map: out_msgs/msg/State has no field 'velocty'; did you mean 'velocity'?",
                          "3:2 from: car_msgs/msg/Status has no field 'spee'; did you mean 'speed'?"));
  EXPECT_THAT(said(types, mapping({from("header.stamp.seg", "rate", {}, 4)}), to_ros),
              ElementsAre("4:1 map: out_msgs/msg/State has no field 'header.stamp.seg'; did you mean "
                          "'header.stamp.sec'?"));
  EXPECT_THAT(
      said(types, mapping({from("velocity.x", "rate", {}, 4)}), to_ros),
      ElementsAre("4:1 map: 'velocity' of out_msgs/msg/State is float64, which has no fields to be named"));
}

TEST(MapErrors, NameElementsOfArraysOfFixedSizeOnly) {
  const MapTypes types{"uint16[4] wheels\nuint16[] more", "float64 velocity"};
  EXPECT_THAT(said(types, mapping({from("velocity", "wheels[4]", {}, 3)}), to_ros),
              ElementsAre("3:2 from: 'wheels[4]': uint16[4] has the elements 0 to 3"));
  EXPECT_THAT(
      said(types, mapping({from("velocity", "more[0]", {}, 3)}), to_ros),
      ElementsAre("3:2 from: 'more[0]': only elements of arrays of fixed size have names, and 'more' is "
                  "uint16[]"));
  EXPECT_THAT(said(types, mapping({from("velocity", "wheels[", {}, 3)}), to_ros),
              ElementsAre(HasSubstr("3:2 from: car_msgs/msg/Status has no field 'wheels['")));
}

TEST(MapErrors, TellWhatIsMissingOnTheWay) {
  const MapTypes types{"uint16 speed\nuint8 counter", "float64 velocity\ngeometry_msgs/Point where"};
  const FieldMapping one = mapping({from("velocity", "speed"), fixed("where.x", "1")});
  EXPECT_THAT(
      said(types, one, to_ros),
      ElementsAre("1:1 map: nothing is said of where.y, where.z of out_msgs/msg/State: give each a rule, or "
                  "write `others: default`"));
  EXPECT_THAT(
      said(types, one, to_payload),
      ElementsAre("1:1 map: nothing says what counter of car_msgs/msg/Status becomes on the way to SOME/IP: "
                  "name it in a `from`, under `constants` or under `drop`, or write `others: default`"));
}

TEST(MapErrors, WarnOfWhatIsNotCarried) {
  const MapTypes types{"uint16 speed\nuint8 counter\ngeometry_msgs/Point where",
                       "float64 velocity\nfloat64 x\nuint8 z"};
  FieldMapping one = mapping({from("velocity", "speed"), from("x", "where.x"), fixed("z", "1")});
  EXPECT_THAT(
      said(types, one, to_ros),
      ElementsAre(
          "1:1 warning: map: ROS gets nothing of counter, where.y, where.z of car_msgs/msg/Status: name "
          "it under `drop` if that is meant"));
  one.dropped = {{"counter", {}}, {"where.y", {}}, {"where.z", {}}};
  EXPECT_THAT(said(types, one, to_ros), IsEmpty());
  EXPECT_THAT(said(types, one, to_payload), IsEmpty());
  one.rules.pop_back();
  EXPECT_THAT(said(types, one, to_payload),
              ElementsAre("1:1 warning: map: SOME/IP gets nothing of z of out_msgs/msg/State"));
}

TEST(MapErrors, AreAboutTheDirectionThatIsImpossible) {
  const MapTypes types{"uint16 speed", "float64 velocity\nfloat64 copy"};
  FieldMapping one =
      mapping({from("velocity", "speed", {.scale = 0, .scale_mark = {4, 9}}), fixed("copy", "0")});
  EXPECT_THAT(said(types, one, to_ros), IsEmpty());
  EXPECT_THAT(said(types, one, to_payload),
              ElementsAre("4:9 scale: with 0 there is no way back (dds_to_someip) to 'speed': write `only: "
                          "someip_to_dds` here, and give it under `constants` or `drop`"));
  one = mapping({from("velocity", "speed", {}, 3), from("copy", "speed", {}, 4)});
  EXPECT_THAT(said(types, one, to_ros), IsEmpty());
  EXPECT_THAT(
      said(types, one, to_payload),
      ElementsAre("4:2 map: on the way back 'speed' would come from 'velocity' and from 'copy'; write `only: "
                  "someip_to_dds` in one of these rules"));
  one.rules[1].only = to_ros;
  EXPECT_THAT(said(types, one, to_payload), IsEmpty());
}

TEST(MapErrors, AskForTheWayBackOfATableThatIsNotOneToOne) {
  const MapTypes types{"uint8 raw", "uint8 PARK=22\nuint8 DRIVE=2\nuint8 gear"};
  FieldMapping one =
      mapping({from("gear", "raw", {.table = table({{"0", "PARK"}, {"1", "DRIVE"}, {"2", "DRIVE"}})})});
  EXPECT_THAT(said(types, one, to_ros), IsEmpty());
  EXPECT_THAT(
      said(types, one, to_payload),
      ElementsAre("7:8 table: '1' and '2' both become 'DRIVE', so that the way back (dds_to_someip) is not "
                  "known: say it, as in `back: {DRIVE: 1}`"));
  one.rules[0].back = table({{"PARK", "0"}, {"DRIVE", "2"}});
  EXPECT_THAT(said(types, one, to_payload), IsEmpty());
}

TEST(MapErrors, NameWrongValues) {
  const MapTypes types{"uint8 raw\nfloat32 real", "uint8 PARK=22\nuint8 gear\nstring<=4 name\nbool is_it"};
  const auto one = [&](const MapRule& rule) {
    FieldMapping all = mapping({rule});
    all.others_default = true;
    all.dropped = {{"real", {}}};
    if (rule.payload.text.empty()) {
      all.dropped.push_back({"raw", {}});
    }
    return said(types, all, to_ros);
  };
  EXPECT_THAT(one(fixed("gear", "256", 3)), ElementsAre(HasSubstr("3:3 value: ")));
  EXPECT_THAT(one(fixed("gear", "PARC", 3)),
              ElementsAre("3:3 value: out_msgs/msg/State has no constant 'PARC'; did you mean 'PARK'?"));
  EXPECT_THAT(one(fixed("gear", "PARK", 3)), IsEmpty());
  EXPECT_THAT(one(fixed("name", "abcde", 3)), ElementsAre("3:3 value: 'name' has at most 4 characters"));
  EXPECT_THAT(one(fixed("is_it", "yes", 3)), ElementsAre(HasSubstr("3:3 value: expected true or false")));
  EXPECT_THAT(one(received("gear", 3)),
              ElementsAre("3:4 time: 'gear' is uint8; only a builtin_interfaces/msg/Time can be a time"));
  EXPECT_THAT(one(from("gear", "raw", {.table = table({{"0", "1"}, {"0x0", "2"}})})),
              ElementsAre("7:7 table: '0x0' is the same as '0'"));
  EXPECT_THAT(one(from("gear", "raw", {.table = table({{"300", "1"}})})),
              ElementsAre(HasSubstr("7:7 table: ")));
  EXPECT_THAT(
      one(from(
          "gear", "raw",
          {.table = table({{"0", "1"}}), .otherwise = Otherwise::value, .otherwise_value = {"999", {8, 1}}})),
      ElementsAre(HasSubstr("8:1 otherwise: ")));
}

TEST(MapErrors, NameTypesThatDoNotSuit) {
  const MapTypes types{
      "string text\nuint16[3] three\ngeometry_msgs/Point point\nfloat32 real",
      "uint8 gear\nuint16[4] four\ngeometry_msgs/Quaternion turn\ngeometry_msgs/Point[] points"};
  const auto one = [&](const MapRule& rule) {
    FieldMapping all = mapping({rule});
    all.others_default = true;
    return said(types, all, to_ros);
  };
  EXPECT_THAT(one(from("gear", "text", {}, 3)),
              ElementsAre("3:2 'text' (string) cannot become 'gear' (uint8)"));
  EXPECT_THAT(one(from("four", "three", {}, 3)),
              ElementsAre("3:2 'three' (uint16[3]) cannot become 'four' (uint16[4])"));
  EXPECT_THAT(one(from("turn", "point", {}, 3)),
              ElementsAre(HasSubstr("have different fields: give them one by one")));
  EXPECT_THAT(
      one(from("points", "point", {}, 3)),
      ElementsAre(
          "3:2 'point' (geometry_msgs/msg/Point) cannot become 'points' (geometry_msgs/msg/Point[]): give "
          "the fields one by one, as `position.x: {from: x}`"));
  EXPECT_THAT(one(from("turn", "point", {.scale = 2}, 3)),
              ElementsAre(HasSubstr(": scale, offset and table are for numbers")));
  EXPECT_THAT(one(from("gear", "real", {.table = table({{"0", "1"}}), .table_mark = {5, 5}})),
              ElementsAre("5:5 table: is for whole numbers and booleans, and float32 is not whole"));
}

TEST(MapErrors, NameWhatIsSaidTwice) {
  const MapTypes types{"uint8 raw\ngeometry_msgs/Point point", "uint8 gear\ngeometry_msgs/Point where"};
  FieldMapping one = mapping({from("gear", "raw"), from("where", "point"), fixed("where.x", "1", 5)});
  EXPECT_THAT(said(types, one, to_ros),
              ElementsAre("5:1 'where.x' is given twice, the other time as 'where'"));
  one.rules.pop_back();
  one.dropped = {{"raw", {6, 1}}};
  EXPECT_THAT(said(types, one, to_ros), ElementsAre("6:1 drop: 'raw' is read for 'gear'"));
  one.dropped.clear();
  one.constants = {{{"raw", {7, 1}}, {"1", {}}}};
  EXPECT_THAT(said(types, one, to_payload), ElementsAre("7:1 'raw' is given twice, the other time as 'raw'"));
}

}  // namespace
}  // namespace trestle::messages::map_errors_test
