#include "bridge/describe/sources/ros_types.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/sources/generated_list.hpp"
#include "bridge/describe/sources/sources.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

template <typename Element>
std::vector<std::string> names(const std::vector<Element>& elements) {
  std::vector<std::string> names;
  for (const Element& element : elements) {
    names.push_back(element.name);
  }
  return names;
}

Reading of_types(std::vector<RosInterface> interfaces) {
  messages::TypeLibrary library;
  return describe_ros(interfaces, library);
}

TEST(DescribeRos, MakesAServiceOfAMessage) {
  const Reading reading = of_types({{.type = "sensor_msgs/PointCloud2"}});
  ASSERT_THAT(reading.problems, IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const Service& service = reading.model.services[0];
  EXPECT_EQ(full_name(service.scope, service.name), "sensor_msgs.PointCloud2Service");
  EXPECT_TRUE(service.from_ros);
  ASSERT_THAT(names(service.events), ElementsAre("point_cloud2"));
  EXPECT_EQ(service.events[0].ros_name, "/point_cloud2");
  ASSERT_THAT(names(service.events[0].payload.values), ElementsAre("data"));
  EXPECT_EQ(reading.model.at(service.events[0].payload.values[0].type).ros_name,
            "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(reading.model.files[service.place.file], "sensor_msgs/PointCloud2");
}

TEST(DescribeRos, MakesAMethodOfAServiceAndFiveMembersOfAnAction) {
  const Reading reading = of_types(
      {{.type = "std_srvs/SetBool", .name = "/arm/enable"}, {.type = "tf2_msgs/action/LookupTransform"}});
  ASSERT_THAT(reading.problems, IsEmpty());
  ASSERT_THAT(names(reading.model.services), ElementsAre("ArmEnableService", "LookupTransformService"));
  EXPECT_THAT(names(reading.model.services[0].methods), ElementsAre("enable"));
  EXPECT_EQ(reading.model.services[0].methods[0].ros_name, "/arm/enable");
  EXPECT_THAT(names(reading.model.services[1].methods),
              ElementsAre("send_goal", "cancel_goal", "get_result"));
  EXPECT_THAT(names(reading.model.services[1].events), ElementsAre("feedback", "status"));
  EXPECT_EQ(reading.model.services[1].events[1].ros_name, "/lookup_transform/_action/status");
}

TEST(DescribeRos, TellsOfTypesThatAreNotThere) {
  const Reading reading = of_types({{.type = "my_msgs/msg/Door"}, {.type = "Door"}});
  ASSERT_THAT(reading.problems, SizeIs(2));
  EXPECT_THAT(reading.problems[0].text, HasSubstr("my_msgs/msg/Door"));
  EXPECT_THAT(reading.problems[1].text, HasSubstr("is no name of a ROS type"));
  EXPECT_THAT(reading.model.services, IsEmpty());
}

TEST(DescribeRos, GivesTwoOfOneNameTwoNames) {
  const Reading reading =
      of_types({{.type = "std_msgs/String", .name = "/a/b"}, {.type = "std_msgs/String", .name = "/a_b"}});
  EXPECT_THAT(names(reading.model.services), ElementsAre("ABService", "ABService2"));
}

TEST(ReadRosFiles, FindsPackagesByTheirFolders) {
  const std::vector<SourceText> files{
      {"/ws/src/car_msgs/msg/Door.msg", "bool open\ncar_msgs/Window[] windows\nstd_msgs/Header header\n"},
      {"/ws/src/car_msgs/msg/Window.msg", "uint8 DOWN=1\nfloat32 height\n"},
      {"/ws/src/car_msgs/srv/Lock.srv", "bool all\n---\n"},
      {"/ws/Loose.msg", "int8 a\n"},
      {"/ws/src/car_msgs/msg/Seat.idl",
       "module car_msgs { module msg { struct Seat { sequence<uint8, 4> heat; }; }; };\n"}};
  const Reading reading = read_ros_files(files);
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  // Window is within Door.
  EXPECT_THAT(names(reading.model.services),
              ElementsAre("DoorService", "LockService", "LooseService", "SeatService"));
  EXPECT_EQ(reading.model.services[2].scope, "ws");
  EXPECT_THAT(reading.model.services[1].methods[0].response.values, IsEmpty());
  EXPECT_EQ(reading.model.files[reading.model.services[0].place.file], "/ws/src/car_msgs/msg/Door.msg");
  const auto window = std::ranges::find(reading.model.types, "Window", &Type::name);
  ASSERT_NE(window, reading.model.types.end());
  EXPECT_EQ(reading.model.files[window->place.file], "/ws/src/car_msgs/msg/Window.msg");
  EXPECT_EQ(reading.model.files[window->members.at(0).place.file], "/ws/src/car_msgs/msg/Window.msg");
}

TEST(ReadRosFiles, TakesCommentsOfFieldsForTheirDescriptions) {
  const std::vector<SourceText> files{
      {"/ws/src/car_msgs/msg/Door.msg",
       "# About the door.\n\n# Old: see Window.\nuint8 SHUT=0\n"
       "# How far it is open.\r\n#  ------------\n## Over\xc3\xa4ll.\n# unit: deg\nfloat32 angle 1.5  # 0 is "
       "shut\r\n"
       "string name \"a # b\"\n# Alone.\n\nuint8 state  # trestle: enumeration State\nbool locked # unit: "
       "none\n"
       "car_msgs/Window window # of glass\n"},
      {"/ws/src/car_msgs/msg/Window.msg", "float32 height # of the pane\n"},
      {"/ws/src/car_msgs/srv/Lock.srv",
       "\xef\xbb\xbf# Of all\nbool all # doors\n---\n# That went well.\nbool done\n"}};
  const Reading reading = read_ros_files(files);
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  std::map<std::string, std::string> found;
  for (const Type& type : reading.model.types) {
    for (const Value& member : type.members) {
      found[type.name + "." + member.name] = member.notes.description + "|" + member.notes.unit;
    }
  }
  EXPECT_EQ(found["Door.angle"], "How far it is open.\nOver\xc3\xa4ll.\n0 is shut|deg");
  EXPECT_EQ(found["Door.name"], "|");
  EXPECT_EQ(found["Door.state"], "|");
  EXPECT_EQ(found["Door.locked"], "|");
  EXPECT_EQ(found["Door.window"], "of glass|");
  EXPECT_EQ(found["Window.height"], "of the pane|");
  EXPECT_EQ(found["Lock_Request.all"], "Of all\ndoors|");
  EXPECT_EQ(found["Lock_Response.done"], "That went well.|");
}

TEST(ReadRosFiles, TellsWhereAFileIsWrong) {
  const std::vector<SourceText> files{{"/ws/car_msgs/msg/Door.msg", "bool open\nWindw window\n"},
                                      {"/ws/car_msgs/msg/lower-case.msg", "bool open\n"}};
  const Reading reading = read_ros_files(files);
  ASSERT_THAT(reading.problems, SizeIs(2));
  EXPECT_THAT(reading.problems[0].text, HasSubstr("is not named like a ROS type"));
  EXPECT_EQ(reading.problems[1].file, "/ws/car_msgs/msg/Door.msg");
  EXPECT_EQ(reading.problems[1].mark.line, 2);
}

TEST(ReadRosFiles, TellsAllThatIsWrongInAFile) {
  const std::vector<SourceText> files{
      {"/ws/car_msgs/msg/Door.msg", "bool open\nuint8[ a\nuint8 LIMIT=300\nbool open\n"},
      // It needs the first one, of which nothing is told again.
      {"/ws/car_msgs/msg/Car.msg", "car_msgs/Door[] doors\n"},
      {"/ws/car_msgs/srv/Lock.srv", "string<=0 name\n---\nuint99 x\nbool 1st\n---\n"},
      {"/ws/car_msgs/msg/Seat.idl",
       "module car_msgs { module msg {\n"
       "  enum Mode { A, B };\n"
       "  typedef wchar letter;\n"
       "  const uint8 MOST = 300;\n"
       "  struct Seat {\n"
       "    letter l;\n"
       "    map<uint8, uint8> m;\n"
       "    uint8 a; uint8 a;\n"
       "    long double d;\n"
       "  };\n"
       "  }; };\n"}};
  std::vector<std::string> places;
  for (const documents::Problem& one : read_ros_files(files).problems) {
    places.push_back(one.file.substr(one.file.rfind('/') + 1) + ":" + std::to_string(one.mark.line));
  }
  EXPECT_THAT(places, ElementsAre("Door.msg:2", "Door.msg:3", "Door.msg:4", "Lock.srv:1", "Lock.srv:4",
                                  "Lock.srv:5", "Seat.idl:2", "Seat.idl:3", "Seat.idl:4", "Seat.idl:7",
                                  "Seat.idl:8", "Seat.idl:9"));
}

TEST(ReadRosFiles, TellsOfAFewErrorsOfEachFile) {
  std::string text;
  for (int i = 0; i < 100; ++i) {
    text += "uint8[ a\n";
  }
  EXPECT_THAT(read_ros_files(std::vector<SourceText>{{"/ws/car_msgs/msg/Door.msg", text}}).problems,
              SizeIs(20));
}

TEST(ReadSources, ReadsRosFilesFromFoldersWithOthers) {
  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("ros_sources_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "car_msgs" / "msg");
  std::ofstream{folder / "car_msgs" / "msg" / "Door.msg"} << "bool open\n";
  std::ofstream{folder / "Lamp.fidl"}
      << "package car\ninterface Lamp { version { major 1 minor 0 } method on { } }\n";
  std::vector<documents::Problem> problems;
  const auto texts = load_sources({folder.string()}, problems);
  const Reading reading = read_sources(texts, file_loader());
  ASSERT_THAT(problems, IsEmpty());
  ASSERT_TRUE(reading.ok()) << reading.problems[0].text;
  EXPECT_THAT(names(reading.model.services), ElementsAre("Lamp", "DoorService"));
  std::filesystem::remove_all(folder);
}

TEST(GeneratedList, HasTheChecksumsAndOriginsOfFiles) {
  const std::string sum(64, 'a');
  const std::string text = generated_list({{"p/B.msg", sum, "msg Door.fidl"},
                                           {"a b.yaml", sum, "routes Door.fidl"},
                                           {"p/A.msg", sum, "msg Door.fidl"},
                                           {"old.msg"}});
  EXPECT_THAT(
      text,
      EndsWith("generated.lock` tells which were changed since.\nold.msg\n# --to msg Door.fidl\n" + sum +
               "  p/A.msg\n" + sum + "  p/B.msg\n# --to routes Door.fidl\n" + sum + "  a b.yaml\n"));
  std::vector<std::string> read;
  std::vector<documents::Problem> problems;
  for (const GeneratedFile& file : read_generated_list("generated.lock", text, problems)) {
    read.push_back(file.origin + "|" + file.path + "|" + std::to_string(file.sha256.size()));
  }
  EXPECT_THAT(problems, IsEmpty());
  EXPECT_THAT(read, ElementsAre("|old.msg|0", "msg Door.fidl|p/A.msg|64", "msg Door.fidl|p/B.msg|64",
                                "routes Door.fidl|a b.yaml|64"));
}

TEST(GeneratedList, IsRefusedWhereAMergeHasLeftItsMarks) {
  const std::string line = std::string(64, 'a') + "  p/A.msg\n";
  for (const std::string mark : {"<<<<<<< HEAD", "||||||| 1234567", "=======\r", ">>>>>>> theirs"}) {
    std::vector<documents::Problem> problems;
    EXPECT_THAT(read_generated_list("gen/generated.lock", line + mark + "\n" + line, problems), IsEmpty());
    ASSERT_THAT(problems, SizeIs(1));
    EXPECT_EQ(documents::to_string(problems[0]),
              "gen/generated.lock:2:1: error: '" + mark.substr(0, 7) +
                  "' is what a merge has left: keep the lines of one side, "
                  "and run `trestle generate` again");
  }
  std::vector<documents::Problem> problems;
  EXPECT_THAT(read_generated_list("generated.lock", "=======.msg\n", problems), SizeIs(1));
  EXPECT_THAT(problems, IsEmpty());
}

/// What comes out of sources does not go in again.
TEST(LoadSources, LeavesOutWhatWasGenerated) {
  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("generated_sources_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "gen" / "p" / "msg");
  const auto write = [&](const char* name, const std::string& text) { std::ofstream{folder / name} << text; };
  write("Door.fidl", "package car\n");
  write("gen/Door.fidl", "package car\n");
  write("gen/p/msg/A.msg", "uint8 a\n");
  write("gen/Mine.fidl", "package mine\n");
  write("gen/generated.lock", generated_list({{.path = "Door.fidl", .sha256 = std::string(64, 'a')},
                                              {.path = "p/msg/A.msg", .origin = "msg Door.fidl"},
                                              {.path = "../Door.fidl"}}));
  write("renamed.json", to_json_text(Model{}));
  write("package.json", R"({"name": "door", "scripts": {"services": "x"}})");
  write("list.json", "[]");
  write("car.json", R"({"unicast": "10.0.0.1"})");
  write("broken.json", R"({"services": [)");
  const auto told = [&](const std::string& path) {
    std::vector<documents::Problem> problems;
    std::vector<std::string> all;
    for (const SourceText& text : load_sources({(folder / path).string()}, problems)) {
      all.push_back(text.name.substr(folder.string().size() + 1));
    }
    for (const documents::Problem& one : problems) {
      all.push_back(documents::to_string(one).substr(folder.string().size() + 1));
    }
    return all;
  };
  EXPECT_THAT(told(""),
              ElementsAre("Door.fidl", "broken.json", "car.json", "gen/Mine.fidl",
                          ": warning: has 3 files that `trestle generate` wrote, which are left out: name "
                          "what is to be read",
                          ": warning: has JSON with nothing of a vsomeip configuration, which is left "
                          "out: 'list.json' and 1 other"));
  EXPECT_FALSE(has_ros_files(folder.string()));
  // What is named is read, and so is a folder that has nothing else.
  EXPECT_THAT(told("gen/Door.fidl"), ElementsAre("gen/Door.fidl"));
  EXPECT_THAT(told("gen/p"), ElementsAre("gen/p/msg/A.msg"));
  std::filesystem::remove(folder / "gen" / "Mine.fidl");
  EXPECT_THAT(told("gen"), ElementsAre("gen/Door.fidl", "gen/p/msg/A.msg"));
  write("gen/generated.lock", "<<<<<<< HEAD\nDoor.fidl\n");
  EXPECT_THAT(told("gen"), testing::Contains(HasSubstr("gen/generated.lock:1:1: error: '<<<<<<<'")));
  std::filesystem::remove_all(folder);
}

TEST(ReadSources, KnowsJsonByWhatIsInIt) {
  const auto told = [](const char* name, const std::string& text) {
    const std::vector<SourceText> sources{{name, text}};
    const Reading reading = read_sources(sources, {});
    return reading.problems.empty() ? std::string{} : documents::to_string(reading.problems[0]);
  };
  EXPECT_EQ(told("model.json", to_json_text(Model{})),
            "model.json:1:1: error: this is a model that `trestle generate --to json` wrote, which is not "
            "read again: name "
            "the files that it was made of");
  EXPECT_THAT(
      told("package.json", R"({"name": "door"})"),
      HasSubstr(
          "package.json:1:1: error: there is nothing of a vsomeip configuration: expected \"services\""));
  EXPECT_EQ(told("vsomeip", R"({"clients": []})"), "");
  EXPECT_THAT(told("a.json", R"({"services": [)"), HasSubstr("a.json:1:15: error"));
  EXPECT_THAT(told("a.json", "[]"), HasSubstr("a.json:1:1: error: expected a vsomeip configuration"));
}

TEST(LoadSources, RefusesMoreThanItsLimits) {
  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("large_sources_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const char* name : {"a.fidl", "b.fidl", "c.fidl"}) {
    std::ofstream{folder / name} << std::string(name[0] == 'b' ? 200 : 100, ' ');
  }
  const auto told = [&](const SourceLimits& limits) {
    std::vector<documents::Problem> problems;
    std::string text = std::to_string(load_sources({folder.string()}, problems, limits).size()) + " files";
    for (const documents::Problem& one : problems) {
      text += "; " + documents::to_string(one).substr(folder.string().size());
    }
    return text;
  };
  EXPECT_EQ(told({}), "3 files");
  EXPECT_EQ(told({.file_bytes = 200, .all_bytes = 400}), "3 files");
  EXPECT_EQ(told({.file_bytes = 199}),
            "2 files; /b.fidl: error: cannot be read: it has 200 bytes; expected at most 199 bytes");
  EXPECT_EQ(told({.file_bytes = 200, .all_bytes = 399}),
            "2 files; /c.fidl: error: cannot be read: it has 100 bytes; expected at most 99 bytes, which is "
            "what all files together may still have");
  std::filesystem::remove_all(folder);
}

TEST(ReadSources, MakesUtf8OfLatin1WithAWarningForEachFile) {
  const std::vector<SourceText> files{
      {"A.fidl",
       "package a import model \"B.fidl\"\ninterface I { version { major 1 minor 0 }\n"
       "<** @description : Gr\xf6\xdf"
       "e **> attribute UInt8 x }"},
      {"p/msg/A.msg",
       "float32 x # in \xb0"
       "C, \xb0"
       "F\n"},
      {"v.json", "{\"services\": [{\"service\": \"1\", \"instance\": \"1\", \"x\xfc\": 1}]}"},
  };
  const Reading reading = read_sources(
      files, [](const std::string&) { return tl::expected<std::string, std::string>{"// \xc4\npackage b"}; });
  const auto warnings_at = [&](const std::string& place) {
    return std::ranges::count_if(reading.problems, [&](const documents::Problem& one) {
      return documents::to_string(one).starts_with(place + ": warning: here the file is not UTF-8");
    });
  };
  EXPECT_EQ(warnings_at("A.fidl:3:22"), 1);
  EXPECT_EQ(warnings_at("B.fidl:1:4"), 1);
  EXPECT_EQ(warnings_at("p/msg/A.msg:1:16"), 1);
  EXPECT_EQ(warnings_at("v.json:1:51"), 1);
  const std::string json = to_json_text(reading.model);
  EXPECT_THAT(json, HasSubstr("Gr\xc3\xb6\xc3\x9f"
                              "e"));
  EXPECT_THAT(json, HasSubstr("in \xc2\xb0"
                              "C, \xc2\xb0"
                              "F"));
}

/// Nobody has named Window.msg: it is found beside the other one.
TEST(ReadSources, WarnsOfLatin1InFilesThatItFindsInFolders) {
  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("ros_found_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "p" / "msg");
  std::filesystem::create_directories(folder / "p" / "srv");
  const auto write = [&](const char* name, const char* text) { std::ofstream{folder / name} << text; };
  write("p/msg/A.msg", "p/Window window # in \xb0\np/Window other\n");
  write("p/msg/Window.msg", "# The pane.\nuint8 x # in \xb0\n");
  write("p/srv/Lock.srv", "p/Window window\n---\n# gr\xfcn\n");
  std::vector<documents::Problem> problems;
  const auto texts = load_sources({(folder / "p/msg/A.msg").string()}, problems);
  std::vector<std::string> warnings;
  const auto take = [&](const Reading& reading) {
    warnings.clear();
    for (const documents::Problem& one : reading.problems) {
      warnings.push_back(documents::to_string(one).substr(folder.string().size()));
    }
  };
  const std::string what =
      ": warning: here the file is not UTF-8: such bytes are taken as Windows-1252 (ISO "
      "8859-1)";
  take(read_sources(texts, file_loader()));
  EXPECT_THAT(warnings, ElementsAre("/p/msg/A.msg:1:22" + what, "/p/msg/Window.msg:2:14" + what));
  messages::TypeLibrary library = messages::TypeLibrary::in({.folders = {folder.string()}});
  take(describe_ros(std::vector<RosInterface>{{.type = "p/Lock"}, {.type = "p/msg/Window"}}, library));
  EXPECT_THAT(warnings, ElementsAre("/p/msg/Window.msg:2:14" + what, "/p/srv/Lock.srv:3:5" + what));
  std::filesystem::remove_all(folder);
}

TEST(FolderSource, MakesUtf8OfLatin1) {
  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("ros_latin1_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "p" / "msg");
  std::ofstream{folder / "p" / "msg" / "A.msg"} << "string x \"\xe4\"\n";
  messages::TypeLibrary library = messages::TypeLibrary::in({.folders = {folder.string()}});
  const auto tree = library.resolve("p/msg/A");
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->messages.back().fields.front().default_value, "\"\xc3\xa4\"");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace trestle::describe
