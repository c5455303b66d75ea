// Names of typedefs and arrays, for which ROS has no place: from FIDL to .msg files and back.
#include <gmock/gmock.h>

#include <map>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"

namespace trestle::describe::type_names_test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

Reading read(const std::vector<SourceText>& files) {
  Reading reading =
      read_sources(files, [](const std::string&) { return tl::unexpected{std::string{"is not there"}}; });
  for (const documents::Problem& problem : reading.problems) {
    EXPECT_NE(problem.severity, documents::Problem::Severity::error) << problem.text;
  }
  return reading;
}

Reading read_fidl(const std::string& body) {
  return read({{"Car.fidl", "package car\ninterface Door {\nversion { major 1 minor 0 }\n" + body + "}\n"}});
}

std::vector<SourceText> msg_files(const Model& model) {
  const Lowered lowered = lower(model);
  EXPECT_THAT(lowered.not_carried, IsEmpty());
  std::vector<SourceText> files;
  for (const messages::MessageDefinition& one : lowered.definitions) {
    if (one.name.find("/msg/") != std::string::npos) {
      files.push_back({"/ws/" + one.name + ".msg", msg_text(lowered, one)});
    }
  }
  return files;
}

std::string label(const Model& model, TypeIndex index) {
  const Type& type = model.at(index);
  return !type.name.empty()             ? type.name
         : type.kind == Kind::primitive ? messages::to_string(type.primitive)
         : type.kind == Kind::array     ? label(model, type.element.type) + "[]"
                                        : to_string(type.kind);
}

/// What each typedef and each array with a name is of: "Speed" -> "uint16".
std::map<std::string, std::string> names(const Model& model) {
  std::map<std::string, std::string> all;
  for (const Type& type : model.types) {
    if (!type.name.empty() && (type.kind == Kind::alias || type.kind == Kind::array)) {
      all[type.name] = label(model, type.element.type) + (type.kind == Kind::array ? "[]" : "");
    }
  }
  return all;
}

/// By "Type.member", what the member is called to be.
std::map<std::string, std::string> members(const Model& model) {
  std::map<std::string, std::string> all;
  for (const Type& type : model.types) {
    for (const Value& member : type.members) {
      all[type.name + "." + member.name] = label(model, member.type);
    }
  }
  return all;
}

constexpr const char* body = R"(
  typedef Speed is UInt16
  typedef Fast is Speed
  typedef Text is String
  typedef Image is ByteBuffer
  array Names of Text
  array Rows of Names
  array Points of Point
  typedef Many is Names
  typedef Piece is Point
  enumeration Side { LEFT RIGHT }
  typedef Hand is Side
  map Places { Speed to Text }
  typedef Map is Places
  struct Point { Speed x }
  union Any { Fast fast Names names Many many Piece piece }
  struct All {
    Speed speed
    Fast fast
    Text text
    Image image
    Names names
    Rows rows
    Points points
    Many many
    Piece piece
    Hand hand
    Hand[] hands
    Piece[] pieces
    Speed[] speeds
    Many[] lists
    Map map
    Any either
    UInt16 plain
  }
  broadcast moved { out { All all } }
)";

TEST(TypeNames, ComeBackFromMsgFilesByTheirMarks) {
  const Model before = read_fidl(body).model;
  const Model after = read(msg_files(before)).model;
  EXPECT_EQ(names(after), names(before));
  EXPECT_EQ(names(before).size(), 11U);
  std::map<std::string, std::string> there = members(after);
  for (const auto& [member, type] : members(before)) {
    EXPECT_THAT(there, Contains(Pair(member, type)));
  }
}

TEST(TypeNames, StandInFidlThatIsMadeOfMsgFiles) {
  const Model before = read_fidl(body).model;
  std::string text;
  for (const TextFile& file : write_fidl(read(msg_files(before)).model).files) {
    text += file.text;
  }
  for (const char* line : {"typedef Speed is UInt16", "typedef Fast is Speed", "array Names of Text",
                           "array Rows of Names", "typedef Many is Names", "Hand[] hands"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(TypeNames, OfTwoTypesAreToldApart) {
  const Model model = read({{"/ws/car/msg/A.msg",
                             "uint8 a  # trestle: alias Speed\n"
                             "uint16 b  # trestle: alias Speed\n"
                             "uint8 c  # trestle: alias Speed\n"
                             "uint8[] d  # trestle: array List\n"
                             "uint8[<=4] e  # trestle: array List\n"}})
                          .model;
  EXPECT_EQ(members(model),
            (std::map<std::string, std::string>{
                {"A.a", "Speed"}, {"A.b", "Speed2"}, {"A.c", "Speed"}, {"A.d", "List"}, {"A.e", "List2"}}));
}

TEST(TypeNames, AreCommentsWhereTheyDoNotFit) {
  const Model model = read({{"/ws/car/msg/A.msg",
                             "uint8 a  # trestle: array List\n"
                             "uint8 b  # trestle: of Speed\n"
                             "uint8 c  # trestle: alias 9 lives\n"
                             "uint8 d  # trestle: alias\n"
                             "uint8[] e  # trestle: of Speed, nonsense\n"}})
                          .model;
  EXPECT_THAT(names(model), ElementsAre(Pair("Speed", "uint8")));
}

TEST(TypeNames, OfThePlatformAreNotMarked) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .name = "std_uint8_t", .scope = "/ara"});
  const TypeIndex part = model.add(
      {.kind = Kind::structure, .name = "Part", .scope = "car", .members = {{.name = "a", .type = number}}});
  model.services.push_back(
      {.name = "Car", .events = {{.name = "moved", .payload = {.values = {{.type = part}}}}}});
  EXPECT_EQ(msg_files(model).front().text, "uint8 a\n");
}

TEST(TypesInMsgFiles, ThatNothingUsesAreTold) {
  const Model model = read_fidl(
                          "typedef Used is UInt8\narray List of Used\nenumeration Side { LEFT }\n"
                          "map Map { UInt8 to UInt8 }\ntypedef Again is Used\nstruct S { Used used }\n"
                          "struct Animal polymorphic { UInt8 legs }\n")
                          .model;
  std::vector<std::string> lost;
  for (const NotCarried& one : write_msg(model, lower(model)).not_carried) {
    lost.push_back(one.element + ": " + one.what);
  }
  EXPECT_THAT(
      lost, ElementsAre("car.Door.List: a type that nothing uses", "car.Door.Side: a type that nothing uses",
                        "car.Door.Map: a type that nothing uses", "car.Door.Again: a type that nothing uses",
                        "car.Door.Animal: a polymorphic structure"));
}

TEST(PackagesOfMsgFiles, ThatHideOthersOrCannotBeBuiltAreTold) {
  const auto told = [](const std::string& scope, const std::string& ros_name) {
    Model model;
    const TypeIndex number = model.add({.kind = Kind::primitive});
    model.add({.kind = Kind::structure,
               .name = "Part",
               .scope = scope,
               .ros_name = ros_name,
               .members = {{.name = "a", .type = number}},
               .place = {0, {7, 3}}});
    return write_msg(model, lower(model)).not_carried;
  };
  const std::vector<NotCarried> of_ros = told("std_msgs", "");
  ASSERT_EQ(of_ros.size(), 1U);
  EXPECT_EQ(of_ros[0].element, "std_msgs");
  EXPECT_THAT(of_ros[0].what, ::testing::HasSubstr("that of a package of ROS 2"));
  EXPECT_EQ(of_ros[0].place.mark, (documents::Mark{7, 3}));
  const std::vector<NotCarried> of_cmake = told("test", "");
  ASSERT_EQ(of_cmake.size(), 1U);
  EXPECT_THAT(of_cmake[0].what, ::testing::HasSubstr("which CMake keeps for a target of its own"));
  EXPECT_THAT(told("car", ""), ::testing::IsEmpty());
  // What was read from ROS is ROS's own.
  EXPECT_THAT(told("std_msgs", "std_msgs/msg/Part"), ::testing::IsEmpty());
}

TEST(NamesInMsgFiles, ThatRosHasOtherwiseAreTold) {
  const Model model = read_fidl(
                          "struct my_part { UInt8 angleNow UInt8 speed }\n"
                          "broadcast moved { out { my_part partNow UInt8 side UInt8 sideNow } }\n")
                          .model;
  std::vector<std::string> lost;
  for (const NotCarried& one : write_msg(model, lower(model)).not_carried) {
    lost.push_back(one.element + ": " + one.what);
  }
  EXPECT_THAT(
      lost,
      ElementsAre("car.Door.my_part: its name, which ROS has otherwise: it is MyPart",
                  "car.Door.my_part: names of its members, which ROS has otherwise: angleNow is angle_now",
                  "car.Door.moved: names of its members, which ROS has otherwise: partNow is part_now, "
                  "sideNow is side_now"));
}

TEST(NotesInMsgFiles, ThatHaveNoPlaceAreTold) {
  const Model model =
      read_fidl(
          "<** @description : D1 **> typedef Speed is UInt16\n"
          "<** @description : D2 @author : A1 **> enumeration E { <** @description : D3 **> ONE }\n"
          "<** @description : D4 **> struct S { <** @description : D5 @see : A2 **> E e }\n"
          "<** @description : D6 **> broadcast moved { out { Speed speed } }\n"
          "broadcast ranged { out { Integer(0, 100) percent } }\n"
          "<** @description : D7 **> broadcast same { out { <** @description : D8 **> S s } }\n"
          "method open { error { <** @see : A3 **> JAMMED } }\n")
          .model;
  std::vector<std::string> lost;
  for (const NotCarried& one : write_msg(model, lower(model)).not_carried) {
    lost.push_back(one.element + ": " + one.what);
  }
  EXPECT_THAT(lost, ElementsAre("car.Door.Speed: its description", "car.Door.E: its description",
                                "car.Door.E: its annotation: @author", "car.Door.S.e: its annotation: @see",
                                "car.Door.open.error.JAMMED: its annotation: @see",
                                "car.Door.ranged.percent: its least and greatest value",
                                "car.Door.same: its description", "car.Door.same.s: its description"));
}

}  // namespace
}  // namespace trestle::describe::type_names_test
