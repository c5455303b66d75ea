// What people wrote beside types, from each source to each target that has a place for it, and back.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"
#include "bridge/describe/write/sheet/write_sheet.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Pair;

/// By "Type", "Type.member", "Type.ENUMERATOR" …: "description|unit" of those that have one.
using Found = std::map<std::string, std::string>;

Found notes_of(const Model& model) {
  Found found;
  const auto add = [&](const std::string& name, const Notes& notes) {
    if (!notes.description.empty() || !notes.unit.empty()) {
      found[name] = notes.description + "|" + notes.unit;
    }
  };
  for (const Type& type : model.types) {
    add(type.name, type.notes);
    for (const Value& member : type.members) {
      add(type.name + "." + member.name, member.notes);
    }
    for (const Enumerator& one : type.enumerators) {
      add(type.name + "." + one.name, one.notes);
    }
  }
  for (const Constant& constant : model.constants) {
    add(constant.name, constant.notes);
  }
  for (const Service& service : model.services) {
    for (const Method& method : service.methods) {
      add(method.name + "()", method.notes);
    }
  }
  return found;
}

Found notes_of_files(const std::vector<SourceText>& files) {
  const Reading reading = read_ros_files(files, {}, false);
  EXPECT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  return notes_of(reading.model);
}

const std::vector<SourceText>& package() {
  static const std::vector<SourceText> files{{"/ws/car_msgs/msg/Gear.msg",
                                              "# What the gearbox does.\n"
                                              "\n"
                                              "# Highest number of a gear.\n"
                                              "uint8 MOST=8\n"
                                              "# It stands still.\n"
                                              "uint8 MODE_PARK=0\n"
                                              "uint8 MODE_DRIVE=3  # It moves.\n"
                                              "# Which way.\n"
                                              "uint8 mode  # trestle: enumeration Mode\n"
                                              "# Of the shaft.\n"
                                              "# unit: rad/s\n"
                                              "float32 speed\n"},
                                             {"/ws/car_msgs/srv/Shift.srv",
                                              "# Takes another gear.\n"
                                              "\n"
                                              "# Which one.\n"
                                              "uint8 gear\n"
                                              "---\n"
                                              "# Whether it is in.\n"
                                              "bool done\n"}};
  return files;
}

const Found& package_notes() {
  static const Found found{{"Gear", "What the gearbox does.|"},
                           {"MOST", "Highest number of a gear.|"},
                           {"Mode.PARK", "It stands still.|"},
                           {"Mode.DRIVE", "It moves.|"},
                           {"Gear.mode", "Which way.|"},
                           {"Gear.speed", "Of the shaft.|rad/s"},
                           {"shift()", "Takes another gear.|"},
                           {"Shift_Request.gear", "Which one.|"},
                           {"Shift_Response.done", "Whether it is in.|"}};
  return found;
}

TEST(NotesOfMsgFiles, AreThoseOfMessagesFieldsConstantsAndServices) {
  EXPECT_EQ(notes_of_files(package()), package_notes());
}

TEST(NotesOfMsgFiles, StandInMsgFilesThatAreWritten) {
  const Reading reading = read_ros_files(package(), {}, false);
  const Lowered lowered = lower(reading.model);
  EXPECT_EQ(notes_of_files({{"/again/car_msgs/msg/Gear.msg",
                             msg_text(lowered, *lowered.definition("car_msgs/msg/Gear"))},
                            {"/again/car_msgs/srv/Shift.srv", srv_text(lowered, "car_msgs/srv/Shift")}}),
            package_notes());
}

TEST(NotesOfMsgFiles, StandInFidlThatIsWritten) {
  const Reading reading = read_ros_files(package(), {}, false);
  std::vector<SourceText> files;
  for (const TextFile& file : write_fidl(reading.model).files) {
    files.push_back({file.path, file.text});
  }
  const Reading again =
      read_sources(files, [](const std::string&) { return tl::unexpected{std::string{"is not there"}}; });
  EXPECT_EQ(notes_of(again.model), package_notes());
}

TEST(NotesOfMsgFiles, StandInArxmlAndSheetsThatAreWritten) {
  const Reading reading = read_ros_files(package(), {}, false);
  const std::string arxml = write_arxml(reading.model).text;
  const Reading again = read_sources(std::vector<SourceText>{{"car.arxml", arxml}},
                                     [](const std::string&) { return tl::unexpected{std::string{}}; });
  Found expected = package_notes();
  expected.erase("MOST");  // ARXML has no constants, which the writer tells
  EXPECT_EQ(notes_of(again.model), expected);
  for (const TextFile& file : write_sheet(reading.model).files) {
    for (const auto& [name, text] : package_notes()) {
      EXPECT_THAT(file.text, HasSubstr(text.substr(0, text.find('|')))) << name << " in " << file.path;
    }
  }
}

TEST(NotesOfMsgFiles, AreFoundInFoldersThatTypesAreLookedUpIn) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("trestle_notes_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "car_msgs/msg");
  std::ofstream{folder / "car_msgs/msg/Gear.msg"} << package()[0].text;
  const std::vector<SourceText> files{{"/ws/box_msgs/msg/Box.msg", "car_msgs/Gear gear  # In use.\n"}};
  const Reading given = read_ros_files(files, {folder.string()}, false);
  messages::TypeLibrary library = messages::TypeLibrary::in({.folders = {folder.string()}});
  const Reading named =
      describe_ros(std::vector<RosInterface>{{.type = "car_msgs/Gear", .name = "/gear"}}, library);
  std::filesystem::remove_all(folder);
  Found expected = package_notes();
  std::erase_if(expected, [](const auto& one) {
    return one.first.starts_with("Shift") || one.first.starts_with("shift");
  });
  EXPECT_EQ(notes_of(named.model), expected);
  expected["Box.gear"] = "In use.|";
  EXPECT_EQ(notes_of(given.model), expected);
}

TEST(NotesOfMsgFiles, TakeWhatBeginsOnTheFirstLineForThatOfTheMessage) {
  const auto of = [](const std::string& text) {
    return notes_of_files({{"/ws/car_msgs/msg/Part.msg", text}});
  };
  EXPECT_THAT(of("# A part.\nuint8 a\n"), ElementsAre(Pair("Part", "A part.|")));
  EXPECT_THAT(of("\n# A part.\nuint8 a\n"), ElementsAre(Pair("Part.a", "A part.|")));
  EXPECT_THAT(of("# Two\r\n#  lines.\r\n# ---\r\n\r\n# More.\r\n\r\nuint8 a\r\n"),
              ElementsAre(Pair("Part", "Two\nlines.\nMore.|")));
  EXPECT_THAT(of("# Copyright (c) 2024 Somebody\n# Do as you like.\n\n# A part.\n\nuint8 a\n"),
              ElementsAre(Pair("Part", "A part.|")));
  EXPECT_THAT(of("# SPDX-License-Identifier: MIT\nuint8 a  # One.\n"), ElementsAre(Pair("Part.a", "One.|")));
}

TEST(NotesOfMsgFiles, GoOnBelowAFieldWhereTheyAreFurtherIn) {
  const Found found = notes_of_files({{"/ws/car_msgs/msg/Part.msg",
                                       "uint8 a  # First\n"
                                       "         # and second.\n"
                                       "uint8 b\n"
                                       "  # Of b.\n"
                                       "# Of c.\n"
                                       "  uint8 c\n"
                                       "  # Of d.\n"
                                       "  uint8 d\n"
                                       "\n"
                                       "    # Of nothing.\n"}});
  EXPECT_THAT(found, ElementsAre(Pair("Part.a", "First\nand second.|"), Pair("Part.b", "Of b.|"),
                                 Pair("Part.c", "Of c.|"), Pair("Part.d", "Of d.|")));
}

TEST(NotesOfMsgFiles, HaveTheUnitInBracketsAsForRosidl) {
  const auto of_field = [](const std::string& comment) {
    return notes_of_files({{"/ws/car_msgs/msg/Part.msg", "\n" + comment + "\nfloat32 a\n"}})["Part.a"];
  };
  EXPECT_EQ(of_field("# Speed [m/s]"), "Speed|m/s");
  EXPECT_EQ(of_field("# Latitude [degrees]. Positive is north."), "Latitude. Positive is north.|degrees");
  EXPECT_EQ(of_field("# Of the shaft.\n# [rad/s]"), "Of the shaft.|rad/s");
  EXPECT_EQ(of_field("# [%]"), "|%");
  EXPECT_EQ(of_field("# From [0, 1]."), "From [0, 1].|");
  EXPECT_EQ(of_field("# [m] or [ft]"), "[m] or [ft]|");
  EXPECT_EQ(of_field("# Nothing: [], [m"), "Nothing: [], [m|");
  EXPECT_EQ(of_field("# See [1]\n# unit: m"), "See [1]|m");
  EXPECT_EQ(of_field("# See [1]\n# unit: none"), "See [1]|");
  EXPECT_THAT(notes_of_files({{"/ws/car_msgs/msg/Part.msg", "float32 MOST=8  # Speed [m/s]\n"}}),
              ElementsAre(Pair("MOST", "Speed|m/s")));
}

TEST(NotesOfMsgFiles, AreReadAsTheyWereWrittenWhateverIsInBrackets) {
  for (const auto& [description, unit] : {std::pair{"Speed", "m/s"},
                                          {"", "%"},
                                          {"See [1]", "m"},
                                          {"See [1]", ""},
                                          {"From [0, 1]", "m"},
                                          {"See [1] and [2]", ""},
                                          {"See [1] and [2]", "m"},
                                          {"Speed", "a, b"},
                                          {"Speed", "a]"}}) {
    Model model;
    const TypeIndex number = model.add({.kind = Kind::primitive});
    model.add(
        {.kind = Kind::structure,
         .name = "Part",
         .scope = "car_msgs",
         .members = {{.name = "a", .type = number, .notes = {.description = description, .unit = unit}}}});
    model.services.push_back(
        {.name = "Car", .events = {{.name = "moved", .payload = {.values = {{.type = TypeIndex{1}}}}}}});
    const Lowered lowered = lower(model);
    const std::string text = msg_text(lowered, *lowered.definition("car_msgs/msg/Part"));
    EXPECT_EQ(notes_of_files({{"/ws/car_msgs/msg/Part.msg", text}})["Part.a"],
              std::string{description} + "|" + unit)
        << text;
  }
}

TEST(NotesOfTypes, GiveFieldsTheirUnitInMsgFiles) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .notes = {.unit = "km/h"}});
  const TypeIndex speed = model.add({.kind = Kind::alias, .name = "Speed", .element = {.type = number}});
  const TypeIndex list = model.add({.kind = Kind::array, .element = {.type = speed}});
  const TypeIndex part =
      model.add({.kind = Kind::structure,
                 .name = "Part",
                 .scope = "car_msgs",
                 .members = {{.name = "a", .type = speed},
                             {.name = "b", .type = speed, .notes = {.unit = "m/s"}},
                             {.name = "c", .type = list, .wire = default_wire(Kind::array)}}});
  model.services.push_back(
      {.name = "Car", .events = {{.name = "moved", .payload = {.values = {{.type = part}}}}}});
  const Lowered lowered = lower(model);
  const std::string text = msg_text(lowered, *lowered.definition("car_msgs/msg/Part"));
  EXPECT_THAT(text, HasSubstr("# [km/h]\nuint8 a"));
  EXPECT_THAT(notes_of_files({{"/ws/car_msgs/msg/Part.msg", text}}),
              ElementsAre(Pair("Part.a", "|km/h"), Pair("Part.b", "|m/s"), Pair("Part.c", "|km/h")));
}

TEST(NotesOfTypes, StandInMsgFilesWhereverTheUnitIs) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive});
  const TypeIndex speed = model.add({.kind = Kind::alias,
                                     .name = "Speed",
                                     .scope = "car_msgs",
                                     .element = {.type = number},
                                     .notes = {.unit = "km/h"}});
  const TypeIndex row =
      model.add({.kind = Kind::array, .name = "Row", .element = {.type = number, .notes = {.unit = "bar"}}});
  const TypeIndex point = model.add({.kind = Kind::structure,
                                     .name = "Point",
                                     .scope = "car_msgs",
                                     .members = {{.name = "x", .type = number, .notes = {.unit = "mm"}}},
                                     .notes = {.description = "See [1]", .unit = "m"}});
  const TypeIndex place = model.add({.kind = Kind::alias,
                                     .name = "Place",
                                     .scope = "car_msgs",
                                     .element = {.type = point},
                                     .notes = {.unit = "ft"}});
  const TypeIndex part =
      model.add({.kind = Kind::structure,
                 .name = "Part",
                 .scope = "car_msgs",
                 .members = {{.name = "speed", .type = speed},
                             {.name = "row", .type = row, .wire = default_wire(Kind::array)},
                             {.name = "whole", .type = point, .notes = {.unit = "cm"}},
                             {.name = "there", .type = place}}});
  model.constants.push_back({.name = "MOST", .type = speed, .value = "3", .scope = "car_msgs"});
  model.services.push_back(
      {.name = "Car",
       .scope = "car_msgs",
       .events = {{.name = "moved", .payload = {.values = {{.name = "part", .type = part}}}},
                  {.name = "went",
                   .payload = {.values = {{.name = "to", .type = point, .notes = {.unit = "km"}}}}},
                  {.name = "came", .payload = {.values = {{.name = "from", .type = place}}}},
                  {.name = "stood", .payload = {.values = {{.name = "at", .type = point}}}}},
       .notes = {.unit = "h"}});
  const Written written = write_msg(model, lower(model));
  std::vector<SourceText> files;
  for (const TextFile& file : written.files) {
    if (file.path.ends_with(".msg")) {
      files.push_back({"/ws/" + file.path, file.text});
    }
  }
  EXPECT_EQ(notes_of_files(files), (Found{{"Part.speed", "|km/h"},
                                          {"Part.row", "|bar"},
                                          {"Part.whole", "|cm"},
                                          {"Part.there", "|ft"},
                                          {"Point", "See [1]|m"},
                                          {"Point.x", "|mm"},
                                          {"MOST", "|km/h"}}));
  EXPECT_THAT(lines_of(written.not_carried),
              ElementsAre("car_msgs.Car: its unit: h", "car_msgs.Car.went.to: its unit: km",
                          "car_msgs.Car.came.from: its unit: ft"));
}

TEST(NotesOfTypes, AreToldWhereArxmlHasNoPlaceForTheUnit) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive});
  const TypeIndex gear = model.add(
      {.kind = Kind::enumeration,
       .name = "Gear",
       .scope = "car",
       .enumerators = {{.name = "PARK",
                        .notes = {.description = "Stands", .unit = "rpm", .others = {{"@see", "Box"}}}}}});
  const TypeIndex row = model.add({.kind = Kind::array,
                                   .name = "Row",
                                   .scope = "car",
                                   .element = {.type = number, .notes = {.unit = "bar"}}});
  const TypeIndex part =
      model.add({.kind = Kind::structure,
                 .name = "Part",
                 .scope = "car",
                 .members = {{.name = "gear", .type = gear, .notes = {.unit = "km/h"}},
                             {.name = "row", .type = row, .wire = default_wire(Kind::array)}}});
  model.services.push_back({.name = "Car",
                            .scope = "car",
                            .events = {{.name = "moved",
                                        .id = someip::MethodId{0x8001},
                                        .payload = {.values = {{.name = "moved", .type = part}}}}}});
  const ArxmlFile written = write_arxml(model);
  const Reading again = read_sources(std::vector<SourceText>{{"car.arxml", written.text}},
                                     [](const std::string&) { return tl::unexpected{std::string{}}; });
  EXPECT_EQ(notes_of(again.model), (Found{{"Gear.PARK", "Stands|"}, {"Part.gear", "|km/h"}}));
  EXPECT_THAT(lines_of(written.not_carried),
              IsSupersetOf({"car.Gear.PARK: its unit: rpm", "car.Gear.PARK: its annotation: @see",
                            "car.Row: the unit of its elements: bar"}));
}

TEST(NotesOfIdlFiles, AreCommentsAndAnnotations) {
  const std::string text = R"(// generated by nobody

#include "std_msgs/msg/Header.idl"
// About all modules.
module car_msgs {
  module msg {
    module Gear_Constants {
      /** Highest number
       *  of a gear. */
      const uint8 MOST = 8;
      const uint8 LEAST = 1;  // Lowest one.
      @verbatim (language="comment", text="At the" "\n" "start.")
      const uint8 START = 1;
    };
    // Not directly above.

    /// What the gearbox \"does\".
    @verbatim (language="comment", text="More of \"it\".")
    @verbatim (language="c++", text="int x;")
    struct Gear {  // of no member
      uint8 mode;  ///< Which way
                   ///< it goes.
      // ------
      /* Of the shaft. */
      @unit ("rad/s") @default (value=1.5)
      float speed;
      @unit (value="m") /* Of both. */ float wide, high;  /**< Outside. */
      @verbatim (language="comment", text="trestle: bytes")
      sequence<uint8> data; /* Of name. */ string name;
      @range (min=1, max=2) // Last.
      long last;
      // Of nobody.
    };
  };
};
)";
  const Found found = notes_of_files({{"/ws/car_msgs/msg/Gear.idl", text}});
  EXPECT_EQ(found, (Found{{"MOST", "Highest number\nof a gear.|"},
                          {"LEAST", "Lowest one.|"},
                          {"START", "At the\nstart.|"},
                          {"Gear", "What the gearbox \\\"does\\\".\nMore of \"it\".|"},
                          {"Gear.mode", "Which way\nit goes.|"},
                          {"Gear.speed", "Of the shaft.|rad/s"},
                          {"Gear.wide", "Of both.\nOutside.|m"},
                          {"Gear.high", "Of both.\nOutside.|m"},
                          {"Gear.name", "Of name.|"},
                          {"Gear.last", "Last.|"}}));
}

TEST(NotesOfIdlFiles, OfARequestAreTheService) {
  const Found found = notes_of_files({{"/ws/car_msgs/srv/Shift.idl",
                                       "module car_msgs { module srv {\n"
                                       "/// Takes another gear.\n"
                                       "struct Shift_Request { uint8 gear; };\n"
                                       "/// Whether it is in.\n"
                                       "struct Shift_Response { boolean done; };\n"
                                       "}; };\n"}});
  EXPECT_THAT(found, ElementsAre(Pair("Shift_Response", "Whether it is in.|"),
                                 Pair("shift()", "Takes another gear.|")));
}

}  // namespace
}  // namespace trestle::describe
