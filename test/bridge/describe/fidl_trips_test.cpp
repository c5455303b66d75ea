// What is described in any language becomes FIDL and FDEPL, and is read back: nothing is an error then, the
// bytes are the same, and what differs is in the list of what FIDL does not carry. franca/franca.py has
// Franca judge the files.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "bridge/describe/compare.hpp"
#include "bridge/describe/fidl_words.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"
#include "test/bridge/describe/fidl/corpus.hpp"
#include "test/bridge/describe/lost.hpp"
#include "test/bridge/generate/interfaces.hpp"
#include "test/source_dir.hpp"

namespace trestle::describe::fidl_trips_test {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::Pair;

std::string texts_of(const std::vector<documents::Problem>& problems) {
  std::string text;
  for (const documents::Problem& one : problems) {
    text += documents::to_string(one) + "\n";
  }
  return text;
}

std::string line_of(const Change& one) {
  return std::string{one.rule->id} + " " + one.element + ": " + one.before + " -> " + one.after;
}

Reading read(const std::vector<SourceText>& files) {
  return read_sources(files, file_loader());
}

struct Trip {
  System before{};
  Written written{};
  System after{};
  std::string text{};  ///< of all files
  std::vector<std::string> lost{};
};

System with_ids(Reading reading) {
  IdLock lock;
  return make_system(std::move(reading), lock, {.lowers = false});
}

/// @param name  of the folder that the files are put into for franca.py, below TRESTLE_FIDL_OUT
Trip trip_of(Reading reading, const std::string& name) {
  Trip trip{.before = with_ids(std::move(reading))};
  EXPECT_TRUE(trip.before.good) << name << "\n" << texts_of(trip.before.problems);
  trip.written = write_fidl(trip.before.model);
  trip.lost = lines_of(trip.written.not_carried);
  std::vector<SourceText> sources;
  for (const TextFile& file : trip.written.files) {
    trip.text += "--- " + file.path + "\n" + file.text;
    sources.push_back({file.path, file.text});
    if (const char* const out = std::getenv("TRESTLE_FIDL_OUT")) {
      fs::create_directories(fs::path{out} / name);
      std::ofstream{fs::path{out} / name / file.path} << file.text;
    }
  }
  Reading again = read_sources(sources, {});
  EXPECT_TRUE(again.ok()) << name << "\n" << texts_of(again.problems) << trip.text;
  trip.after = with_ids(std::move(again));
  return trip;
}

/// What differs on the wire and is not in the list.
std::vector<std::string> changes_of(const Trip& trip) {
  static const std::map<std::string_view, std::string> reasons{
      {"field-removed", ": an attribute without a value"},
      {"value-removed", ": a use of a type without content"},
      {"transport", ": getter, setter and notifier by different transports"}};
  const auto is_listed = [&](const Change& change) {
    const auto reason = reasons.find(change.rule->id);
    // "Car.level.getter" is a part of Car.level.
    const std::string element =
        change.rule->id == "transport" ? change.element.substr(0, change.element.rfind('.')) : change.element;
    return reason != reasons.end() && std::ranges::any_of(trip.lost, [&](const std::string& line) {
             return line.ends_with(element + reason->second);
           });
  };
  std::vector<std::string> lines;
  for (const Change& change : compare(trip.before.model, trip.after.model)) {
    if (change.rule->wire != Impact::none && !is_listed(change)) {
      lines.push_back(line_of(change));
    }
  }
  return lines;
}

TEST(FidlOfOthers, IsReadBackOfRealFiles) {
  if (!corpus::folder()) {
    GTEST_SKIP() << "the real files are not here";
  }
  std::size_t trips = 0;
  for (const char* const within : {"files", "probes", "arxml_oracle"}) {
    for (const char* const ending : {".arxml", ".fidl", ".fdepl"}) {
      for (const fs::path& file : corpus::files(within, ending)) {
        Reading reading = std::string_view{ending} == ".arxml"
                              ? read({{file.string(), corpus::text_of(file).value_or("")}})
                              : corpus::read(file);
        if (!reading.ok()) {
          continue;  // the readers' tests say why
        }
        const Trip trip = trip_of(std::move(reading), "corpus" + std::to_string(trips));
        ++trips;
        EXPECT_THAT(changes_of(trip), IsEmpty()) << file << "\n" << ::testing::PrintToString(trip.lost);
      }
    }
  }
  EXPECT_GT(trips, 100U);
}

TEST(FidlOfOthers, IsReadBackOfTheProjectsOwnFiles) {
  const std::string root = test::source_dir() + "/";
  std::vector<std::vector<std::string>> groups{
      {"examples/seat/seat.arxml"},         {"examples/seat/Seat.fdepl"},
      {"examples/door/Door.fdepl"},         {"examples/tutorial/Climate.fdepl"},
      {"examples/ets_device/ets.fdepl"},    {"examples/gnss/car_msgs/msg/Gnss.msg"},
      {"fuzz/corpus/arxml/adaptive.arxml"}, {"fuzz/corpus/arxml/classic.arxml"},
      {"fuzz/corpus/arxml/types.arxml"}};
  for (const std::vector<std::string>& group : groups) {
    std::vector<documents::Problem> problems;
    std::vector<std::string> paths;
    for (const std::string& file : group) {
      paths.push_back(root + file);
    }
    Reading reading = read(load_sources(paths, problems));
    const std::string name = fs::path{group.front()}.filename().string();
    ASSERT_TRUE(problems.empty() && reading.ok()) << name << "\n" << texts_of(reading.problems);
    const Trip trip = trip_of(std::move(reading), name);
    EXPECT_THAT(changes_of(trip), IsEmpty()) << name << "\n" << ::testing::PrintToString(trip.lost);
  }
}

std::string argument(const std::string& name, const std::string& type, const std::string& direction) {
  return "<ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>" + name + "</SHORT-NAME><TYPE-TREF DEST=\"X\">" + type +
         "</TYPE-TREF><DIRECTION>" + direction + "</DIRECTION></ARGUMENT-DATA-PROTOTYPE>";
}

std::vector<std::string> names_of(const Payload& payload) {
  std::vector<std::string> names;
  for (const Value& value : payload.values) {
    names.push_back(value.name);
  }
  return names;
}

/// Franca: "Duplicate argument name 'speed' used for in and out".
TEST(FidlOfOthers, HasInoutArgumentsTwiceAndKnowsThemAgain) {
  const std::string text = arxml(
      "<SERVICE-INTERFACE><SHORT-NAME>Door</SHORT-NAME><METHODS><CLIENT-SERVER-OPERATION>"
      "<SHORT-NAME>open</SHORT-NAME><ARGUMENTS>" +
      argument("done", "/x/bool", "OUT") + argument("speed", "/x/float", "INOUT") +
      argument("side", "/x/uint8_t", "IN") + argument("int", "/x/uint16_t", "INOUT") +
      argument("speed_out", "/x/uint32_t", "OUT") +
      "</ARGUMENTS></CLIENT-SERVER-OPERATION></METHODS></SERVICE-INTERFACE>");
  const Trip trip = trip_of(read({{"car.arxml", text}}), "inout");
  EXPECT_THAT(changes_of(trip), IsEmpty());
  EXPECT_THAT(trip.text, HasSubstr("            Float speed\n"));
  EXPECT_THAT(trip.text,
              HasSubstr("            <** @details : inout: speed **>\n            Float speed_out\n"));
  EXPECT_THAT(trip.text, HasSubstr("<** @details : name: speed_out **>\n            UInt32 speed_out_out\n"));
  EXPECT_THAT(trip.text, HasSubstr("<** @details : inout: int **>\n            UInt16 int__out\n"));
  EXPECT_THAT(trip.lost, Not(Contains(HasSubstr("INOUT"))));
  const Method& method = trip.after.model.services.at(0).methods.at(0);
  EXPECT_THAT(method.inout, ElementsAre("speed", "int"));
  EXPECT_THAT(names_of(method.request), ElementsAre("speed", "side", "int"));
  EXPECT_THAT(names_of(method.response), ElementsAre("done", "speed", "int", "speed_out"));
  // And as ARXML, which has the arguments of both in one order.
  const System again = with_ids(read({{"again.arxml", write_arxml(trip.after.model).text}}));
  ASSERT_TRUE(again.good) << texts_of(again.problems);
  const Method& last = again.model.services.at(0).methods.at(0);
  EXPECT_EQ(last.inout, method.inout);
  EXPECT_EQ(names_of(last.request), names_of(method.request));
  EXPECT_EQ(names_of(last.response), names_of(method.response));
}

TEST(FidlOfOthers, HasNoInoutArgumentThatIsNotAlsoIn) {
  const Reading reading =
      read({{"D.fidl",
             "package car interface D { version { major 1 minor 0 } method m {\n"
             "in { UInt8 a UInt8 b UInt8[] d UInt8[] e }\n"
             "out { <** @details : inout: a **> UInt16 a_out\n"
             "<** @details : inout: c **> UInt8 c_out <** @details : inout: b **> UInt8 b_out\n"
             "<** @details : inout: d **> UInt8[] d_out <** @details : inout: e **> UInt16[] "
             "e_out } } }"}});
  EXPECT_THAT(reading.model.services.at(0).methods.at(0).inout, ElementsAre("b", "d"));
  EXPECT_THAT(
      texts_of(reading.problems),
      HasSubstr("D.fidl:3:42: warning: 'a_out' is not also in (inout), as its annotation tells: there "
                "is no 'a' in 'in', or one of another type"));
  EXPECT_THAT(texts_of(reading.problems), HasSubstr("D.fidl:4:35: warning: 'c_out' is not also in"));
  EXPECT_THAT(texts_of(reading.problems), HasSubstr("'e_out' is not also in"));
}

/// AUTOSAR's ARGUMENTS have one order.
TEST(ArxmlOfOthers, HasNoInoutArgumentsOfAnotherOrderInTheAnswer) {
  const System system =
      with_ids(read({{"D.fidl",
                      "package car interface D { version { major 1 minor 0 } method m {\n"
                      "in { UInt8 a UInt8 b }\n"
                      "out { <** @details : inout: b **> UInt8 b_out <** @details : inout: a "
                      "**> UInt8 a_out } } }"}}));
  const ArxmlFile written = write_arxml(system.model);
  EXPECT_THAT(lines_of(written.not_carried),
              Contains("D.m: that arguments are INOUT, which are not all in its answer in this order"));
  const System again = with_ids(read({{"again.arxml", written.text}}));
  EXPECT_THAT(names_of(again.model.services.at(0).methods.at(0).response), ElementsAre("b_2", "a_2"));
}

/// Franca: "Duplicate element type 'UInt16'".
TEST(FidlOfOthers, HasAStructAroundMembersOfAUnionThatHaveOneType) {
  const std::vector<SourceText> files{{"Car.fidl", R"(package car
interface Door { version { major 1 minor 0 }
  typedef Speed is UInt16
  array Names of String
  struct Part { UInt8 x String y }
  enumeration Side { LEFT RIGHT }
  union Twice {
    UInt16 first
    UInt16 second
    Speed third
    <** @description : Again. @details : unit: km/h **>
    Names names
    Names again
    UInt8[] few
    UInt8[] many
    Part one
    Part class
    Other.Part other
    Integer(0, 5) small
    Integer(-9, 9) large
    Side side
    Side hand
  }
  union More extends Twice { UInt16 fourth Double wide Double wider }
  union Nested { Twice one Twice two }
  attribute Nested plain
  attribute Nested ruled
  attribute Twice choice
}
typeCollection Other { version { major 1 minor 0 } struct Part { UInt8 x } }
)"},
                                      {"Car.fdepl", R"(
import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Car.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Door {
  SomeIpServiceID = 4
  union Twice { SomeIpUnionTypeWidth = 1
    second { SomeIpIntegerBitWidth = 12 }
    many { SomeIpArrayLengthWidth = 1 }
    class { #struct { SomeIpStructLengthWidth = 2 y { SomeIpStringLengthWidth = 1 } } } }
  attribute ruled { SomeIpGetterID = 1 SomeIpSetterID = 2 SomeIpNotifierID = 32769 SomeIpNotifierEventGroups = { 1 }
    #union { two { #union { again { # { SomeIpArrayLengthWidth = 2 } }
                            second { SomeIpIntegerBitWidth = 9 } hand { #enumeration { SomeIpEnumWidth = 2 } } } } } }
}
define org.genivi.commonapi.someip.deployment for provider as P { instance car.Door { InstanceId = "d" } }
)"}};
  Reading reading = read(files);
  Model chosen = with_ids(reading).model;
  for (Service& service : chosen.services) {  // in the files that are written all ids are given
    service.chosen_ids.clear();
  }
  for (Instance& instance : chosen.instances) {
    instance.id_is_chosen = false;
  }
  const std::string before = canonical(chosen);
  const Trip trip = trip_of(std::move(reading), "unions");
  EXPECT_EQ(canonical(trip.after.model), before) << trip.text;
  EXPECT_THAT(trip.text, HasSubstr("    <** @details : wraps: value **>\n    struct Twice_second {\n"
                                   "        UInt16 value\n    }\n"));
  EXPECT_THAT(trip.text, HasSubstr("        UInt16 first\n        Twice_second second\n"));
  // Without the annotation it is a struct as any other, and adds no byte.
  std::vector<SourceText> plain;
  for (const TextFile& file : trip.written.files) {
    plain.push_back({file.path, file.text});
    for (std::size_t at = 0; (at = plain.back().text.find("wraps: ", at)) != std::string::npos;) {
      plain.back().text.replace(at, 5, "holds");
    }
  }
  const Reading other = read_sources(plain, {});
  EXPECT_TRUE(other.ok()) << texts_of(other.problems);
  std::size_t structs = 0;
  for (const Type& type : other.model.types) {
    if (type.kind == Kind::structure && (type.name.starts_with("Twice_") || type.name.starts_with("More_"))) {
      ++structs;
      EXPECT_EQ(type.wire, default_wire(Kind::structure)) << type.name;
      EXPECT_EQ(type.members.size(), 1U) << type.name;
    }
  }
  EXPECT_GE(structs, 10U);
}

TEST(FidlOfOthers, HasEachNameOnce) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const auto values = [&](std::initializer_list<const char*> names) {
    std::vector<Value> all;
    for (const char* const name : names) {
      all.push_back({.name = name, .type = u8});
    }
    return all;
  };
  const TypeIndex base = model.add(
      {.kind = Kind::structure, .name = "Base", .scope = "/car/Types", .members = values({"int", "a-b"})});
  const TypeIndex heir = model.add({.kind = Kind::structure,
                                    .name = "Heir",
                                    .scope = "/car/Types",
                                    .members = values({"int_", "a_b", "a b"}),
                                    .base = base});
  const TypeIndex mode = model.add({.kind = Kind::enumeration, .name = "class", .scope = "/car/Types"});
  model.at(mode).enumerators = {{"new", 0}, {"new_", 1}, {"1st", 2}, {"_1st", 3}};
  model.add({.kind = Kind::structure, .name = "class_", .scope = "/car/Types", .members = values({"x"})});
  Service service{.name = "Door", .scope = "/car", .has_version = true};
  service.methods = {{.name = "open"}, {.name = "delete"}, {.name = "delete_"}};
  service.methods[0].request.values = values({"a-b", "a_b", "in"});
  service.methods[0].response.values = values({"a_b", "a-b", "out"});
  service.events = {{.name = "try"}, {.name = "try_"}};
  service.events[0].payload.values = {{.name = "heir", .type = heir}, {.name = "heir ", .type = mode}};
  for (const char* const name : {"union", "do", "do_"}) {
    Field field{.name = name};
    field.payload.values = {{.name = name, .type = heir}};
    service.fields.push_back(std::move(field));
  }
  model.services = {service};
  // A type collection where an interface is.
  Service other = service;
  other.name = "Types";
  other.scope = "car";
  model.services.push_back(std::move(other));
  model.constants = {{.name = "if", .type = u8, .value = "1", .scope = "/car/Types"},
                     {.name = "if_", .type = u8, .value = "2", .scope = "/car/Types"},
                     {.name = "heirs",
                      .type = heir,
                      .value = R"({"int": 1, "a-b": 2, "int_": 3, "a_b": 4, "a b": 5})",
                      .scope = "/car/Types"}};
  const Trip trip = trip_of({.model = std::move(model)}, "once");
  EXPECT_THAT(changes_of(trip), IsEmpty()) << trip.text;
  EXPECT_THAT(trip.text, HasSubstr("{ int_ : 1, a_b : 2, int__ : 3, a_b_ : 4, a_b_2 : 5 }"));
  ASSERT_EQ(trip.after.model.services.size(), 2U);
  const Service& after = trip.after.model.services[0];
  EXPECT_THAT(names_of(after.methods.at(0).request), ElementsAre("a-b", "a_b", "in"));
  EXPECT_THAT(names_of(after.methods.at(0).response), ElementsAre("a_b", "a-b", "out"));
  EXPECT_THAT(after.methods.at(0).inout, IsEmpty());
}

/// Words of FIDL, FDEPL and C++ wherever there is a name.
TEST(FidlOfOthers, EscapesAllWords) {
  std::vector<std::string> words{"class", "default", "delete", "register", "namespace", "int", "double"};
  for (const std::vector<std::string>* const all : {&fidl_keywords(), &fdepl_keywords()}) {
    words.insert(words.end(), all->begin(), all->end());
  }
  std::ranges::sort(words);
  words.erase(std::unique(words.begin(), words.end()), words.end());
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive, .minimum = 0});
  Type every{.kind = Kind::structure, .name = "struct", .scope = "in.package"};
  Type choice{
      .kind = Kind::choice, .name = "union", .scope = "in.package", .wire = default_wire(Kind::choice)};
  Type mode{.kind = Kind::enumeration, .name = "enumeration", .scope = "in.package"};
  Service service{.name = "interface", .scope = "public.version", .has_version = true};
  Wire bits;
  bits.bits = 3;
  for (const std::string& word : words) {
    every.members.push_back({.name = word, .type = u8, .wire = bits});
    choice.members.push_back({.name = word, .type = u8, .wire = bits});
    Enumerator enumerator{.name = word, .value = static_cast<std::int64_t>(mode.enumerators.size())};
    enumerator.notes.others["ErrorType"] = "Warning";
    mode.enumerators.push_back(std::move(enumerator));
    const TypeIndex own = model.add({.kind = Kind::structure,
                                     .name = word,
                                     .scope = "in.package",
                                     .members = {{.name = "x", .type = u8, .wire = bits}}});
    const TypeIndex inner = model.add({.kind = Kind::structure,
                                       .name = word,
                                       .scope = "public.version.interface",
                                       .members = {{.name = "x", .type = own}}});
    Method method{.name = word};
    method.request.values = {{.name = word, .type = u8, .wire = bits}, {.name = "more", .type = inner}};
    service.methods.push_back(method);
    Event event{.name = word};
    event.payload = method.request;
    service.events.push_back(event);
    Field field{.name = word};
    field.payload.values = {{.name = word, .type = u8, .wire = bits}};
    service.fields.push_back(std::move(field));
    model.constants.push_back({.name = word, .type = u8, .value = "1", .scope = "in.package"});
  }
  const TypeIndex all = model.add(std::move(every));
  const TypeIndex any = model.add(std::move(choice));
  const TypeIndex modes = model.add(std::move(mode));
  Field field{.name = "whole"};
  field.payload.values = {{.name = "whole", .type = all}};
  service.fields.push_back(std::move(field));
  Event event{.name = "either"};
  event.payload.values = {{.name = "any", .type = any, .wire = default_wire(Kind::choice)},
                          {.name = "mode", .type = modes}};
  service.events.push_back(std::move(event));
  model.services = {service};
  model.instances.push_back({.name = "interface", .service = "public.version.interface"});
  const Trip trip = trip_of({.model = std::move(model)}, "words");
  EXPECT_THAT(changes_of(trip), IsEmpty());
}

TEST(FidlOfOthers, KeepsUnitsOfArxmlAndTellsOfKeysThatItHasNoPlaceFor) {
  const auto number = [](const char* name, const char* method) {
    return "<APPLICATION-PRIMITIVE-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>VALUE</CATEGORY><SW-DATA-DEF-PROPS><SW-DATA-DEF-PROPS-VARIANTS>"
           "<SW-DATA-DEF-PROPS-CONDITIONAL>" +
           method +
           "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></SW-DATA-DEF-PROPS>"
           "</APPLICATION-PRIMITIVE-DATA-TYPE>";
  };
  const auto element = [](const char* name) {
    return "<IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>VALUE</CATEGORY><SW-DATA-DEF-PROPS><SW-DATA-DEF-PROPS-VARIANTS>"
           "<SW-DATA-DEF-PROPS-CONDITIONAL><BASE-TYPE-REF DEST=\"X\">/x/uint8</BASE-TYPE-REF>"
           "<UNIT-REF DEST=\"UNIT\">/P/Kmh</UNIT-REF></SW-DATA-DEF-PROPS-CONDITIONAL>"
           "</SW-DATA-DEF-PROPS-VARIANTS></SW-DATA-DEF-PROPS></IMPLEMENTATION-DATA-TYPE-ELEMENT>";
  };
  const std::string text = arxml(
      "<UNIT><SHORT-NAME>Kmh</SHORT-NAME><DISPLAY-NAME>km/h</DISPLAY-NAME></UNIT>"
      "<COMPU-METHOD><SHORT-NAME>Scaled</SHORT-NAME><CATEGORY>LINEAR</CATEGORY><UNIT-REF DEST=\"UNIT\">/P/Kmh"
      "</UNIT-REF><COMPU-INTERNAL-TO-PHYS><COMPU-SCALES><COMPU-SCALE><COMPU-RATIONAL-COEFFS><COMPU-NUMERATOR>"
      "<V>0</V><V>0.5</V></COMPU-NUMERATOR><COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR>"
      "</COMPU-RATIONAL-COEFFS></COMPU-SCALE></COMPU-SCALES></COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>"
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Pair</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" +
      element("left") +
      "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Row</SHORT-NAME><CATEGORY>ARRAY</CATEGORY>"
      "<ARRAY-SIZE>3</ARRAY-SIZE><ARRAY-SIZE-SEMANTICS>FIXED-SIZE</ARRAY-SIZE-SEMANTICS><SUB-ELEMENTS>" +
      element("one") + "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>" +
      number("uint16",
             "<BASE-TYPE-REF DEST=\"X\">/x/uint16</BASE-TYPE-REF><COMPU-METHOD-REF DEST=\"X\">"
             "/P/Scaled</COMPU-METHOD-REF>") +
      number("Speed",
             "<BASE-TYPE-REF DEST=\"X\">/x/uint16</BASE-TYPE-REF><UNIT-REF DEST=\"UNIT\">/P/Kmh"
             "</UNIT-REF>") +
      "<SERVICE-INTERFACE><SHORT-NAME>Car</SHORT-NAME><EVENTS>"
      "<VARIABLE-DATA-PROTOTYPE><SHORT-NAME>moved</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/Pair</TYPE-TREF>"
      "</VARIABLE-DATA-PROTOTYPE>"
      "<VARIABLE-DATA-PROTOTYPE><SHORT-NAME>row</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/Row</TYPE-TREF>"
      "</VARIABLE-DATA-PROTOTYPE></EVENTS>"
      "<FIELDS><FIELD><SHORT-NAME>plain</SHORT-NAME><SW-DATA-DEF-PROPS><SW-DATA-DEF-PROPS-VARIANTS>"
      "<SW-DATA-DEF-PROPS-CONDITIONAL><UNIT-REF DEST=\"UNIT\">/P/Kmh</UNIT-REF>"
      "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></SW-DATA-DEF-PROPS>"
      "<TYPE-TREF DEST=\"X\">/x/uint8_t</TYPE-TREF></FIELD>"
      "<FIELD><SHORT-NAME>scaled</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/uint16</TYPE-TREF></FIELD>"
      "<FIELD><SHORT-NAME>speed</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/Speed</TYPE-TREF></FIELD>"
      "</FIELDS></SERVICE-INTERFACE>");
  const Trip trip = trip_of(read({{"car.arxml", text}}), "units");
  EXPECT_THAT(changes_of(trip), IsEmpty());
  for (const Change& change : compare(trip.before.model, trip.after.model)) {
    EXPECT_NE(change.rule->id, "value-unit") << line_of(change);
  }
  const auto unit = "    <** @details : unit: km/h **>\n    ";
  for (const char* const line : {"attribute UInt8 plain\n", "typedef Speed is UInt16\n"}) {
    EXPECT_THAT(trip.text, HasSubstr(unit + std::string{line}));
  }
  EXPECT_THAT(trip.text, HasSubstr("<** @details : unit: km/h **>\n        UInt8 left\n"));
  EXPECT_EQ(trip.after.model.services.at(0).fields.at(0).payload.values.at(0).notes.unit, "km/h");
  EXPECT_THAT(trip.lost, Contains("/P/Row: the unit of its elements: km/h"));
  EXPECT_THAT(trip.lost, Contains(HasSubstr(": scale = 0.5")));
  // Back to ARXML.
  const System again = with_ids(read({{"again.arxml", write_arxml(trip.after.model).text}}));
  ASSERT_TRUE(again.good) << texts_of(again.problems);
  for (const Change& change : compare(trip.after.model, again.model)) {
    EXPECT_NE(change.rule->id, "value-unit") << line_of(change);
  }
}

/// All keys of CommonAPI's specifications, and what interfaces of FIDL may have.
/// "Line: Point": base; "Line.points": unit.
std::map<std::string, std::string> bases_and_units(const Model& model) {
  std::map<std::string, std::string> all;
  for (const Type& type : model.types) {
    if (type.kind != Kind::structure) {
      continue;
    }
    all[type.name] = (type.polymorphic ? "polymorphic " : "") +
                     (type.base == no_type ? std::string{} : model.at(type.base).name);
    for (const Value& member : type.members) {
      all[type.name + "." + member.name] = member.notes.unit;
    }
  }
  return all;
}

TEST(FidlOfOthers, KeepsUnitsOfMembersAndHeirsOfPolymorphicStructures) {
  const std::string text = R"(package car
interface Car {
  version { major 1 minor 0 }
  <** @details : unit: km/h **>
  typedef Speed is UInt16
  struct Point {
    <** @details : unit: m **>
    Double x
    Speed y
  }
  struct Line extends Point {
    <** @details : unit: mm **>
    Point[] points
    <** @details : unit: kg **>
    Point end
  }
  struct Animal polymorphic {
    <** @details : unit: g **>
    UInt8 weight
  }
  struct Dog extends Animal {
    <** @details : unit: cm **>
    UInt8 jumps
  }
  struct Puppy extends Dog {
    UInt8 age
  }
  <** @details : unit: ft **>
  attribute Line line
}
)";
  const Trip trip = trip_of(read({{"Car.fidl", text}}), "members");
  EXPECT_THAT(changes_of(trip), IsEmpty());
  const std::map<std::string, std::string> expected{{"Point", ""},
                                                    {"Point.x", "m"},
                                                    {"Point.y", ""},
                                                    {"Line", "Point"},
                                                    {"Line.points", "mm"},
                                                    {"Line.end", "kg"},
                                                    {"Animal", "polymorphic "},
                                                    {"Animal.weight", "g"},
                                                    {"Dog", "Animal"},
                                                    {"Dog.jumps", "cm"},
                                                    {"Puppy", "Dog"},
                                                    {"Puppy.age", ""}};
  EXPECT_EQ(bases_and_units(trip.before.model), expected);
  EXPECT_EQ(bases_and_units(trip.after.model), expected);
  EXPECT_EQ(trip.after.model.services.at(0).fields.at(0).payload.values.at(0).notes.unit, "ft");
  // ARXML has members of bases copied in.
  const ArxmlFile written = write_arxml(trip.after.model);
  const System again = with_ids(read({{"again.arxml", written.text}}));
  ASSERT_TRUE(again.good) << texts_of(again.problems);
  EXPECT_THAT(bases_and_units(again.model),
              IsSupersetOf({Pair("Point.x", "m"), Pair("Point.y", ""), Pair("Line", ""), Pair("Line.x", "m"),
                            Pair("Line.points", "mm"), Pair("Line.end", "kg"), Pair("Dog.weight", "g"),
                            Pair("Dog.jumps", "cm"), Pair("Puppy.weight", "g")}));
  EXPECT_EQ(again.model.services.at(0).fields.at(0).payload.values.at(0).notes.unit, "ft");
  EXPECT_THAT(lines_of(written.not_carried),
              IsSupersetOf({"car.Car.Animal: that it is polymorphic", "car.Car.Dog: that it is polymorphic",
                            "car.Car.Puppy: that it is polymorphic"}));
  EXPECT_THAT(
      lines_of(write_msg(trip.after.model, lower(trip.after.model)).not_carried),
      IsSupersetOf({"car.Car.line.line: its unit: ft", "car.Car.Animal: a polymorphic structure",
                    "car.Car.Dog: a polymorphic structure", "car.Car.Puppy: a polymorphic structure"}));
}

TEST(FidlOfOthers, IsReadBackOfEveryKey) {
  std::size_t trips = 0;
  for (const generate::Interface& one : generate::interfaces()) {
    Reading reading = read(generate::texts_of(one));
    ASSERT_TRUE(reading.ok()) << one.name << "\n" << texts_of(reading.problems);
    const Trip trip = trip_of(std::move(reading), "key_" + one.name);
    EXPECT_THAT(changes_of(trip), IsEmpty()) << one.name << "\n" << ::testing::PrintToString(trip.lost);
    ++trips;
  }
  EXPECT_GE(trips, 36U);
}

TEST(FidlOfOthers, IsReadBackOfRosTypes) {
  const Trip trip =
      trip_of(read({{"/ws/car_msgs/msg/State.msg",
                     "# Of the car.\nuint8 OFF=0\nuint8 ON=1\nstring NAME=\"it's \\\"x\\\"\"\nfloat32 "
                     "PI=3.0\nbool YES=true\n"
                     "uint8 state\nstring<=5 version\nuint8[] array\nfloat64[3] in\nstring[] out\nPart[<=4] "
                     "parts\nbyte "
                     "raw\nchar letter\nwstring wide\nbuiltin_interfaces/Time set\n"},
                    {"/ws/car_msgs/msg/Part.msg", "int32 to 5\nbool from\n"},
                    {"/ws/car_msgs/msg/Empty.msg", ""},
                    {"/ws/car_msgs/srv/Set.srv", "bool data\nstring error\n---\nbool data\nstring error\n"},
                    {"/ws/car_msgs/srv/Nothing.srv", "---\n"},
                    {"/ws/car_msgs/action/Go.action", "uint8 goal\n---\nuint8 result\n---\nuint8 part\n"}}),
              "ros");
  EXPECT_THAT(changes_of(trip), IsEmpty()) << ::testing::PrintToString(trip.lost);
  // The same bytes, but other files of ROS.
  EXPECT_THAT(trip.lost, IsSupersetOf({HasSubstr("byte: a type of ROS: it is UInt8 here"),
                                       HasSubstr("char: a type of ROS: it is UInt8 here"),
                                       HasSubstr("wstring: a type of ROS: it is String here"),
                                       HasSubstr("NAME: that it is a constant of a message of ROS")}));
  EXPECT_THAT(lines_of(write_arxml(trip.before.model).not_carried),
              IsSupersetOf({"byte: a type of ROS: it is uint8 here", "char: a type of ROS: it is uint8 here",
                            "wstring: a type of ROS: it is a string here"}));
}

TEST(FidlOfOthers, IsReadBackOfVsomeipJson) {
  const Trip trip = trip_of(read({{"car.json", R"({ "unicast": "192.168.0.1", "services": [
      { "service": "0x1234", "instance": "22", "reliable": {"port": "30506"}, "unreliable": 30501,
        "events": [ {"event": "0x8001", "is_field": "true"}, {"event": 32770, "is_reliable": true} ],
        "eventgroups": [ {"eventgroup": "0x5", "events": ["0x8001", "0x8002"],
          "multicast": {"address": "224.225.226.233", "port": "32344"}, "threshold": "4"} ],
        "someip-tp": { "client-to-service": ["0x1"] } },
      { "service": "0x1235", "instance": "1", "unreliable": 30502 } ] })"}}),
                            "vsomeip");
  EXPECT_THAT(changes_of(trip), IsEmpty());
  EXPECT_THAT(trip.lost, Contains(HasSubstr("field_8001: an attribute without a value")));
}

}  // namespace
}  // namespace trestle::describe::fidl_trips_test
