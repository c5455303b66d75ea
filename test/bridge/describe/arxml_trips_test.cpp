// FIDL and FDEPL become ARXML, and are read back: whatever names and keys they have, nothing is an error
// then, and what differs is in the list of what ARXML does not carry.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bridge/describe/compare.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "test/bridge/describe/fidl/corpus.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe::arxml_trips_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string texts_of(const std::vector<documents::Problem>& problems) {
  std::string text;
  for (const documents::Problem& one : problems) {
    text += documents::to_string(one) + "\n";
  }
  return text;
}

std::vector<std::string> lines_of(const std::vector<Change>& changes) {
  std::vector<std::string> lines;
  for (const Change& one : changes) {
    lines.push_back(std::string{one.rule->id} + " " + one.element + ": " + one.before + " -> " + one.after);
  }
  return lines;
}

struct Trip {
  std::vector<Change> changes;
  std::vector<std::string> lost;
};

Trip trip_of(Reading reading) {
  IdLock lock;
  const System before = make_system(std::move(reading), lock, {.lowers = false});
  const ArxmlFile written = write_arxml(before.model);
  // For arxml/written_test.py, which has others read it.
  static std::size_t number = 0;
  if (const char* const out = std::getenv("TRESTLE_ARXML_OUT"); out != nullptr) {
    std::ofstream{std::filesystem::path{out} / (std::to_string(++number) + ".arxml")} << written.text;
  }
  const std::vector<SourceText> again{{"again.arxml", written.text}};
  const Reading after = read_sources(again, {});
  EXPECT_TRUE(after.ok()) << texts_of(after.problems);
  return {compare(before.model, after.model), lines_of(written.not_carried)};
}

/// Whether the list has what changed.
bool is_listed(const Change& change, const std::vector<std::string>& lost) {
  const std::string_view rule = change.rule->id;
  const std::string_view member{
      change.element.data(),
      std::min(change.element.find('.', change.element.find('.') + 1), change.element.size())};
  return std::ranges::any_of(lost, [&](const std::string& line) {
    const std::size_t colon = line.find(": ");
    const std::string_view element{line.data(), colon};
    const std::string_view what = std::string_view{line}.substr(colon + 2);
    if (rule.ends_with("-renamed") || rule == "value-moved") {
      // "Car.open__it.a__b: its name: it is a_b", "Car.close:slow: its name: it is close_2"
      return element.substr(0, element.find(':')).ends_with(change.before) &&
             what == "its name: it is " + change.after;
    }
    return (rule == "event-id" || rule == "field-id" ? what.starts_with("that its id has no bit 15")
            : rule == "error-changed" ? what.starts_with("that its first argument out is an error")
                                      : false) &&
           element == member;
  });
}

TEST(ArxmlOfFidl, IsReadBackWithUnusualNamesAndKeys) {
  const std::string long_name(140, 'n');
  const std::vector<SourceText> sources{
      {"Car.fidl",
       "package car\ninterface Car {\nversion { major 1 minor 2 }\n"
       "<** @description : Gr\xc3\xb6\xc3\x9f"
       "e & <H\xc3\xb6he>, \"quoted\"\n @smartml : a=b; c\n @see : http://example.com/?a=1&b=2 **>\n"
       "attribute my__State __state\nattribute UInt8 _Level_\nattribute UInt8 _level_\n"
       "method open__it { in { my__State ^struct } out { UInt8 a__b UInt8 a_b } }\n"
       "method close:fast { in { UInt8 x } }\nmethod close:slow { in { UInt16 x } }\n"
       "broadcast " +
           long_name +
           " { out { UInt8 SHORT_NAME } }\nstruct my__State { UInt8 n1__a UInt8 n1_a String ^array }\n}\n"},
      {"Car.fdepl",
       "import \"platform:/plugin/org.genivi.commonapi.someip/deployment/"
       "CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\nimport \"Car.fidl\"\n"
       "define org.genivi.commonapi.someip.deployment for interface car.Car {\nSomeIpServiceID = 4700\n"
       "SmartML = 5\nSomeIpSmartML = \"x\"\n"
       "attribute __state { SomeIpGetterID = 1 SomeIpSetterID = 2 SomeIpNotifierID = 32769 "
       "SomeIpNotifierEventGroups = { 1 } SmartMLKey = true }\n"
       "attribute _Level_ { SomeIpGetterID = 3 SomeIpSetterID = 4 SomeIpNotifierID = 32770 "
       "SomeIpNotifierEventGroups = { 1 } }\n"
       "attribute _level_ { SomeIpGetterID = 5 SomeIpSetterID = 6 SomeIpNotifierID = 32771 "
       "SomeIpNotifierEventGroups = { 1 } }\n"
       "method open__it { SomeIpMethodID = 7 SmartML = { 1, 2 } }\n"
       "method close:fast { SomeIpMethodID = 8 }\nmethod close:slow { SomeIpMethodID = 9 }\nbroadcast " +
           long_name +
           " { SomeIpEventID = 32780 SomeIpEventGroups = { 1 } }\n}\n"
           "define org.genivi.commonapi.someip.deployment for provider as Cars {\n"
           "instance car.Car { InstanceId = \"car.front.<1>&2\" SomeIpInstanceID = 50 SmartML = \"i\" "
           "}\n}\n"}};
  Reading reading = read_sources(sources, {});
  ASSERT_TRUE(reading.ok()) << texts_of(reading.problems);
  EXPECT_THAT(texts_of(reading.problems),
              HasSubstr("Car.fdepl:5:1: warning: the key 'SmartML' is not known"));
  const Trip trip = trip_of(std::move(reading));
  EXPECT_THAT(trip.changes, SizeIs(::testing::Gt(10U)));
  for (const Change& change : trip.changes) {
    // An attribute is called as its value is.
    EXPECT_TRUE(is_listed(change, trip.lost)) << lines_of({change}).front() << "\n"
                                              << ::testing::PrintToString(trip.lost);
  }
  EXPECT_THAT(trip.lost, Contains("car.front.<1>&2: its name: it is car_front_1_2"));
  EXPECT_THAT(trip.lost, Contains("Car.close: its selector slow"));
}

/// Each file of the corpora that can be read.
TEST(ArxmlOfFidl, IsReadBackOfRealFiles) {
  std::size_t trips = 0;
  for (const char* const ending : {".fidl", ".fdepl"}) {
    for (const auto& file : corpus::files("files", ending)) {
      Reading reading = corpus::read(file);
      if (!reading.ok()) {
        continue;  // corpus_test.cpp says why
      }
      const Trip trip = trip_of(std::move(reading));
      ++trips;
      for (const Change& change : trip.changes) {
        EXPECT_TRUE(is_listed(change, trip.lost)) << file << "\n"
                                                  << lines_of({change}).front() << "\n"
                                                  << ::testing::PrintToString(trip.lost);
      }
    }
  }
  if (!corpus::folder()) {
    GTEST_SKIP() << "there are no corpora";
  }
  EXPECT_GT(trips, 50U);
}

}  // namespace
}  // namespace trestle::describe::arxml_trips_test
