#include "bridge/describe/write/fidl/write_fidl.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <set>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/compare.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/model_json.hpp"
#include "test/bridge/describe/fidl/corpus.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string all_problems(const Reading& reading) {
  std::string all;
  for (const documents::Problem& problem : reading.problems) {
    all += documents::to_string(problem) + "\n";
  }
  return all;
}

std::string all_text(const Written& written) {
  std::string all;
  for (const TextFile& file : written.files) {
    all += "--- " + file.path + "\n" + file.text;
  }
  return all;
}

std::vector<std::string> lost(const Written& written) {
  return lines_of(written.not_carried);
}

Reading read_back(const Written& written) {
  std::vector<SourceText> sources;
  for (const TextFile& file : written.files) {
    sources.push_back({file.path, file.text});
  }
  return read_fidl(sources);
}

/// Reads what was written, and expects the same model. For a look from outside, the files are also put into
/// the folder that TRESTLE_FIDL_OUT names.
void expect_round_trip(const Model& model, const std::string& name) {
  const Written written = write_fidl(model);
  if (const char* folder = std::getenv("TRESTLE_FIDL_OUT")) {
    std::filesystem::create_directories(std::filesystem::path{folder} / name);
    for (const TextFile& file : written.files) {
      std::ofstream{std::filesystem::path{folder} / name / file.path} << file.text;
    }
  }
  const Reading again = read_back(written);
  EXPECT_TRUE(again.ok()) << name << "\n" << all_problems(again) << all_text(written);
  EXPECT_EQ(canonical(again.model), canonical(model)) << name << "\n" << all_text(written);
  // Writing is the same again.
  EXPECT_EQ(all_text(write_fidl(again.model)), all_text(written)) << name;
}

/// What version 2, or FIDL as Franca has it, has no form for.
const std::map<std::string, std::string>& lossy() {
  static const std::map<std::string, std::string> files{
      {"drivingLane.fdepl", "genivi.aasr.showcase.IDrivingLane.LaneDetected: SomeIpPriority = 0"},
      {"N2.fidl", "std_msgs.msg.Empty: a type without content, and what is of it"}};
  return files;
}

TEST(WriteFidl, WritesRealFilesSoThatTheyAreReadAsTheSame) {
  if (!corpus::folder()) {
    GTEST_SKIP() << "the real files are not here";
  }
  for (const char* within : {"files", "probes"}) {
    for (const char* ending : {".fdepl", ".fidl"}) {
      for (const auto& file : corpus::files(within, ending)) {
        Reading reading = corpus::read(file);
        for (Service& service : reading.model.services) {  // 0 is no id, and a deployment needs one
          if (!service.id && file.filename() == "namedFixedSizedArrayTypeInInterface.fdepl") {
            service.id = someip::ServiceId{0x1234};
          }
        }
        const auto loss = lossy().find(file.filename().string());
        if (loss != lossy().end()) {
          EXPECT_THAT(lost(write_fidl(reading.model)), Contains(loss->second));
        } else if (reading.ok()) {
          expect_round_trip(reading.model, file.filename().string());
        }
      }
    }
  }
}

/// FDEPL says the ids of what an interface inherits with the base alone.
TEST(WriteFidl, WritesIdsOfABaseAndItsHeirThatAreReadAgain) {
  const auto generated = [](const std::string& of_base, const std::vector<SourceText>& more, IdLock& lock) {
    std::vector<SourceText> sources{
        {"D.fidl", "package car interface Door { version { major 1 minor 0 } method open {} method shut {} " +
                       of_base +
                       " }\ninterface Front extends Door { version { major 1 minor 0 } method lock {} "
                       "broadcast locked {} }"}};
    sources.insert(sources.end(), more.begin(), more.end());
    Reading reading =
        read_fidl(sources, [&](const std::string& name) -> tl::expected<std::string, std::string> {
          return name == "D.fidl" ? sources.front().text : "";
        });
    EXPECT_TRUE(reading.ok()) << all_problems(reading);
    for (const documents::Problem& problem : allocate_ids(reading.model, lock)) {
      EXPECT_THAT(problem.text, HasSubstr("in no eventgroup"));
    }
    const Written written = write_fidl(reading.model);
    EXPECT_THAT(lost(written), Not(Contains(HasSubstr("other ids"))));
    const Reading again = read_back(written);
    EXPECT_TRUE(again.ok()) << all_problems(again) << all_text(written);
    std::vector<documents::Problem> told;
    lock = read_id_lock("ids.lock", to_text(lock), told).value();
    return reading.model;
  };
  const auto id_of_lock = [](const Model& model) { return model.service("car.Front")->methods.back().id; };
  IdLock lock;
  const auto before = id_of_lock(generated("", {}, lock));
  EXPECT_EQ(before, someip::MethodId{3});
  // The base grows: what the heir has had stays.
  EXPECT_EQ(id_of_lock(generated("method more {} broadcast mored {}", {}, lock)), before);
  // The heir alone has a FDEPL file.
  IdLock none;
  const SourceText deployment{
      "F.fdepl",
      "import \"platform:/plugin/org.genivi.commonapi.someip/deployment/"
      "CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\nimport \"D.fidl\"\n"
      "define org.genivi.commonapi.someip.deployment for interface car.Front { SomeIpServiceID = 4660 "
      "SomeIpEventGroups = { 1 } method lock { SomeIpMethodID = 1 } "
      "broadcast locked { SomeIpEventID = 32769 SomeIpEventGroups = { 1 } } }"};
  EXPECT_EQ(id_of_lock(generated("broadcast moved {}", {deployment}, none)), someip::MethodId{1});
}

constexpr const char* everything_fidl = R"(package org.example.all

<** @description : things of an \@example
    @author : somebody **>
interface Base { version { major 2 minor 7 }
  attribute UInt8 inherited
  method base { }
}

<** @description : everything
    on two lines **>
interface All extends Base manages Base { version { major 2 minor 8 }
  <** @description : how warm **>
  attribute Float temperature readonly
  attribute String text noSubscriptions
  attribute Types.Big big noRead
  attribute UInt16[] packed
  attribute ByteBuffer buffer
  attribute Types.Table table
  attribute Types.Choice choice
  attribute Types.Cov cov
  attribute Local local
  attribute Types.Mode mode
  attribute Types.Alias alias
  attribute Types.Big[] bigs
  attribute Integer(-5, 100) ranged
  <** @details : unit: km/h **>
  attribute UInt32 state
  method call { in { String ^in Types.Big big Types.Mode mode Types.Table table } out { Types.Choice ^out ByteBuffer raw }
    error { BROKEN = 3 <** @description : too late **> LATE } }
  method named { error Types.Mode }
  method extended { error extends Types.Mode { MORE = 9 } }
  method over:one { in { UInt8 a } }
  method over:two { in { UInt8 a UInt8 b } }
  method away fireAndForget { in { Int64 x Double y Boolean z Int8 i Int16 j } }
  broadcast told selective { out { Types.Big[] list String why } }
  broadcast plain:sel { out { Types.Cov cov } }
  struct Local { UInt8 ^array Types.Mode mode }
  const UInt8 COUNT = 3
}

typeCollection Types { version { major 1 minor 0 }
  enumeration Mode { OFF = 0 <** @description : it runs **> ON = 1 }
  enumeration MoreModes extends Mode { STANDBY = 7 }
  enumeration Signed { BELOW = -1 ABOVE = 1 }
  struct Inner { String name UInt8[] data Mode mode }
  struct Big extends Inner { Inner inner Choice choice Int16 number UInt64 large }
  union Choice { UInt8 small Inner inner String text }
  union Wider extends Choice { Double more }
  map Table { String to Inner }
  map Numbers { UInt8 to UInt16 }
  array Cov of Double
  array Inners of Inner
  array Nested of Inners
  typedef Alias is Big
  typedef Name is String
  struct Poly polymorphic { }
  struct PolyOne extends Poly { UInt8 x }
  const Double PI = 3.14d
  const Float SMALL = -1.5e-3f
  const String HELLO = "he said \"hello\""
  const Boolean YES = true
  const Mode START = Mode.ON
  const Inners NOBODY = [ { name : "x", data : [ 1, 2 ], mode : Mode.OFF } ]
  const Numbers LOOKUP = [ 1 => 2, 3 => 4 ]
}
)";

constexpr const char* everything_fdepl = R"(
import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "all.fidl"

define org.genivi.commonapi.someip.deployment for typeCollection org.example.all.Types as org.example.all.Types {
  enumeration Mode { SomeIpEnumWidth = 2 SomeIpEnumBitWidth = 12 SomeIpEnumInvalidValue = 4095 EnumBackingType = UInt16
                     ON { ErrorType = Warning } }
  struct Inner { SomeIpStructLengthWidth = 2
    name { SomeIpStringLengthWidth = 1 SomeIpStringEncoding = utf16be }
    data { SomeIpArrayLengthWidth = 2 SomeIpArrayMaxLength = 9 SomeIpArrayMinLength = 2 } }
  struct Big { SomeIpStructLengthWidth = 4
    inner { #struct { SomeIpStructLengthWidth = 1 name { SomeIpStringLengthWidth = 4 } } }
    number { SomeIpIntegerBitWidth = 12 SomeIpIntegerInvalidValue = 2047 } }
  union Choice { SomeIpUnionLengthWidth = 2 SomeIpUnionTypeWidth = 1 SomeIpUnionDefaultOrder = false
    text { SomeIpStringLengthWidth = 0 SomeIpStringLength = 20 } }
  union Wider { SomeIpUnionLengthWidth = 0 SomeIpUnionMaxLength = 100 }
  array Cov { SomeIpArrayLengthWidth = 0 SomeIpArrayMaxLength = 9 }
  array Inners { SomeIpArrayLengthWidth = 1 #struct { SomeIpStructLengthWidth = 1 } }
  map Numbers { key { SomeIpIntegerInvalidValue = 255 } value { SomeIpIntegerBitWidth = 10 } }
}

define org.genivi.commonapi.someip.deployment for interface org.example.all.Base {
  SomeIpServiceID = 100
  attribute inherited { SomeIpGetterID = 21 SomeIpSetterID = 22 SomeIpNotifierID = 33021 SomeIpNotifierEventGroups = { 5 } }
  method base { SomeIpMethodID = 20 }
}

define org.genivi.commonapi.someip.deployment for interface org.example.all.All {
  use org.example.all.Types
  SomeIpServiceID = 0x1234
  SomeIpEventGroups = { 1, 2, 77 }
  DefaultTimeout = 900
  attribute temperature { SomeIpGetterID = 1 SomeIpNotifierID = 33001 SomeIpNotifierEventGroups = { 1, 2 }
    SomeIpAttributeReliable = true SomeIpAttributeEndianess = le SomeIpAttributeCRCWidth = one
    SomeIpGetterSegmentLengthResponse = 1008 SomeIpGetterSeparationTimeResponse = 2
    SomeIpNotifierSegmentLength = 1120 SomeIpNotifierSeparationTime = 3 SomeIpNotifierDebounceTime = 4
    SomeIpNotifierMaxRetentionTime = 6 SomeIpGetterMaxRetentionTime = 7 SomeIpGetterRequestDebounceTime = 8
    SomeIpGetterResponseMaxRetentionTime = 9 SomeIpGetterResponseDebounceTime = 10
    AttributeGetterTimeout = 100 AttributeNotifierTimeout = 200 AttributeNotifierUpdateMode = Cyclic }
  attribute text { SomeIpGetterID = 2 SomeIpSetterID = 3 SomeIpStringLengthWidth = 0 SomeIpStringLength = 32
    SomeIpSetterSegmentLength = 1200 SomeIpSetterSeparationTime = 1 SomeIpSetterMaxRetentionTime = 0
    SomeIpSetterRequestDebounceTime = 2 SomeIpSetterResponseMaxRetentionTime = 3 SomeIpSetterResponseDebounceTime = 4
    AttributeSetterTimeout = 100 }
  attribute big { SomeIpSetterID = 4 SomeIpNotifierID = 33002 SomeIpNotifierEventGroups = { 1 }
    #struct { SomeIpStructLengthWidth = 2 choice { #union { SomeIpUnionLengthWidth = 1 SomeIpUnionTypeWidth = 2
      text { SomeIpStringLength = 30 } } } } }
  attribute packed { SomeIpGetterID = 5 SomeIpSetterID = 6 SomeIpNotifierID = 33003 SomeIpNotifierEventGroups = { 1 }
    SomeIpArrayLengthWidth = 1 SomeIpArrayMinLength = 1 SomeIpArrayMaxLength = 5 SomeIpIntegerBitWidth = 12
    SomeIpIntegerInvalidValue = 4095 }
  attribute buffer { SomeIpGetterID = 7 SomeIpSetterID = 8 SomeIpNotifierID = 33004 SomeIpNotifierEventGroups = { 1 }
    SomeIpByteBufferLengthWidth = 2 SomeIpByteBufferMinLength = 1 SomeIpByteBufferMaxLength = 500 }
  attribute table { SomeIpGetterID = 9 SomeIpSetterID = 10 SomeIpNotifierID = 33005 SomeIpNotifierEventGroups = { 1 }
    SomeIpAttrMapLengthWidth = 2 SomeIpAttrMapMinLength = 1 SomeIpAttrMapMaxLength = 7 }
  attribute choice { SomeIpGetterID = 11 SomeIpSetterID = 12 SomeIpNotifierID = 33006 SomeIpNotifierEventGroups = { 1 }
    #union { SomeIpUnionDefaultOrder = true } }
  attribute cov { SomeIpGetterID = 13 SomeIpSetterID = 14 SomeIpNotifierID = 33007 SomeIpNotifierEventGroups = { 1 }
    # { SomeIpArrayLengthWidth = 2 SomeIpArrayMaxLength = 36 } }
  attribute local { SomeIpGetterID = 15 SomeIpSetterID = 16 SomeIpNotifierID = 33008 SomeIpNotifierEventGroups = { 1 } }
  attribute mode { SomeIpGetterID = 17 SomeIpSetterID = 18 SomeIpNotifierID = 33009 SomeIpNotifierEventGroups = { 1 }
    #enumeration { SomeIpEnumWidth = 4 SomeIpEnumBitWidth = 20 SomeIpEnumInvalidValue = 9 } }
  attribute alias { SomeIpGetterID = 31 SomeIpSetterID = 32 SomeIpNotifierID = 33010 SomeIpNotifierEventGroups = { 1 } }
  attribute bigs { SomeIpGetterID = 33 SomeIpSetterID = 34 SomeIpNotifierID = 33011 SomeIpNotifierEventGroups = { 1 }
    SomeIpArrayLengthWidth = 2 #struct { SomeIpStructLengthWidth = 1 inner { #struct { SomeIpStructLengthWidth = 4 } } } }
  attribute ranged { SomeIpGetterID = 35 SomeIpSetterID = 36 SomeIpNotifierID = 33012 SomeIpNotifierEventGroups = { 1 } }
  attribute state { SomeIpGetterID = 37 SomeIpSetterID = 38 SomeIpNotifierID = 33013 SomeIpNotifierEventGroups = { 1 } }
  method call { SomeIpMethodID = 40 SomeIpReliable = true SomeIpMethodEndianess = le SomeIpMethodCRCWidth = four
    SomeIpErrorCoding = Header MethodTimeout = 250 Errors = { "a", "b" }
    SomeIpMethodMaxRetentionTime = 1 SomeIpMethodResponseMaxRetentionTime = 2 SomeIpMethodRequestDebounceTime = 3
    SomeIpMethodResponseDebounceTime = 4 SomeIpMethodSegmentLength = 1008 SomeIpMethodSeparationTime = 5
    SomeIpMethodSegmentLengthResponse = 1120 SomeIpMethodSeparationTimeResponse = 6
    in { ^in { SomeIpStringLengthWidth = 2 SomeIpStringEncoding = utf16le SomeIpStringLength = 80 }
         big { #struct { SomeIpStructLengthWidth = 0 number { SomeIpIntegerBitWidth = 9 } } }
         table { SomeIpArgMapLengthWidth = 1 SomeIpArgMapMinLength = 2 SomeIpArgMapMaxLength = 3 } }
    out { raw { SomeIpByteBufferLengthWidth = 0 SomeIpByteBufferMaxLength = 4 } } }
  method named { SomeIpMethodID = 41 }
  method extended { SomeIpMethodID = 42 }
  method over:one { SomeIpMethodID = 43 }
  method over:two { SomeIpMethodID = 44 }
  method away { SomeIpMethodID = 45 }
  broadcast told { SomeIpEventID = 33020 SomeIpEventGroups = { 1, 2 } SomeIpReliable = true SomeIpBroadcastEndianess = le
    SomeIpBroadcastCRCWidth = four SomeIpBroadcastMaxRetentionTime = 1 SomeIpBroadcastDebounceTime = 2
    SomeIpBroadcastSegmentLength = 1392 SomeIpBroadcastSeparationTime = 3 BroadcastType = error ErrorName = "x.y"
    out { list { SomeIpArrayLengthWidth = 1 #struct { SomeIpStructLengthWidth = 2 } } } }
  broadcast plain:sel { SomeIpEventID = 33022 SomeIpEventGroups = { 77 } }
  struct Local { ^array { SomeIpIntegerBitWidth = 3 } }
}

define org.genivi.commonapi.someip.deployment for provider as P {
  instance org.example.all.All { InstanceId = "org.example.one" SomeIpInstanceID = 0x10 Domain = "far" Variant = "high"
    Year = "2026" PreregisteredProperties = { "a=b" } SomeIpDefaultErrorCoding = Header
    SomeIpUnicastAddress = "192.168.0.2" SomeIpReliableUnicastPort = 30499 SomeIpUnreliableUnicastPort = 30500
    SomeIpMulticastEventGroups = { 1, 2 } SomeIpMulticastAddresses = { "224.244.224.245", "224.244.224.246" }
    SomeIpMulticastPorts = { 30501, 30502 } SomeIpMulticastThreshold = { 3, 0 } }
}
)";

TEST(WriteFidl, WritesEveryKeySoThatItIsReadAsTheSame) {
  const std::vector<SourceText> sources{{"all.fidl", everything_fidl}, {"all.fdepl", everything_fdepl}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  expect_round_trip(reading.model, "everything");
  EXPECT_THAT(lost(write_fidl(reading.model)), IsEmpty());
}

TEST(WriteFidl, KeepsTheVersionsAndDescriptionsOfTypeCollections) {
  const std::vector<SourceText> sources{{"T.fidl", R"(package a.b
    <** @description: Of doors
                      and windows. @author: N.N. **>
    typeCollection Types { version { major 3 minor 7 } struct S { UInt8 x } }
    <** @description: Without a name. **>
    typeCollection { version { major 1 minor 0 } typedef T is UInt8 }
    <** @description: Without types. **>
    typeCollection Later { version { major 2 minor 0 } }
    typeCollection Plain { version { major 1 minor 0 } const UInt8 C = 1 }
    interface I { version { major 1 minor 0 } attribute Types.S s attribute T t })"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  ASSERT_EQ(reading.model.collections.size(), 3U);
  EXPECT_EQ(reading.model.collections[0].notes.description, "Of doors\nand windows.");
  EXPECT_EQ(reading.model.collections[0].major, 3U);
  EXPECT_EQ(reading.model.collections[0].minor, 7U);
  expect_round_trip(reading.model, "collections");
  const Written written = write_fidl(reading.model);
  EXPECT_THAT(lost(written), Not(Contains(HasSubstr("collection"))));
  EXPECT_THAT(all_text(written), HasSubstr("    version { major 3 minor 7 }"));
  EXPECT_THAT(all_text(written), HasSubstr("<** @description : Without a name. **>\ntypeCollection {"));
}

TEST(WriteFidl, TakesTypeCollectionsOfOneNameForOne) {
  const std::vector<SourceText> sources{{"T.fidl", R"(package p
    <** @description: One. **>
    typeCollection { version { major 2 minor 0 } typedef A is UInt8 }
    <** @description: Two. **>
    typeCollection { version { major 3 minor 0 } typedef B is UInt8 })"}};
  const Reading reading = read_fidl(sources);
  ASSERT_EQ(reading.model.collections.size(), 1U);
  EXPECT_EQ(reading.model.collections[0].notes.description, "One.\nTwo.");
  EXPECT_EQ(reading.model.collections[0].major, 2U);
  EXPECT_THAT(all_problems(reading),
              HasSubstr("T.fidl:5:5: warning: a type collection of the same name has version 2.0"));
}

/// Franca: "Enumeration must not be empty".
TEST(WriteFidl, WritesWhatFrancaAcceptsForEnumerationsWithoutEnumerators) {
  const std::vector<SourceText> sources{{"E.fidl", R"(package p
    typeCollection T { version { major 1 minor 0 }
      enumeration Nothing { }
      enumeration Base { A B }
      enumeration More extends Base { }
      enumeration Late extends Nothing { C }
      struct S { Nothing n UInt8 x More m Late l }
    }
    interface I { version { major 1 minor 0 }
      attribute T.S s
      attribute T.Nothing[] nos
      method m { in { T.Nothing a UInt8 b } error { } }
      method n { out { UInt8 error } error T.Nothing }
      method o { in { UInt8 b } error T.More }
      broadcast b { out { T.Nothing x T.More y } }
    })"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  const Written written = write_fidl(reading.model);
  const Reading again = read_back(written);
  ASSERT_TRUE(again.ok()) << all_problems(again) << all_text(written);
  for (const Change& change : compare(reading.model, again.model)) {
    EXPECT_TRUE(change.rule->wire == Impact::none || change.rule->id == "type-changed")
        << change.rule->id << " " << change.element << all_text(written);
  }
  for (const Type& type : again.model.types) {
    EXPECT_FALSE(type.kind == Kind::enumeration && type.enumerators.empty()) << type.name;
  }
  const std::vector<std::string> list = lost(written);
  EXPECT_THAT(
      list,
      Contains("p.T.Nothing: that it is an enumeration: it has no enumerators, so it is written as UInt8"));
  EXPECT_THAT(list, Contains(HasSubstr("p.T.More: that it extends another enumeration")));
  EXPECT_THAT(list, Contains(HasSubstr(
                        "p.I.m: that its error is one: the enumeration has no enumerators, so it is the "
                        "argument 'error'")));
  EXPECT_THAT(list, Contains(HasSubstr(
                        "p.I.n: that its error is one: the enumeration has no enumerators, so it is the "
                        "argument 'error_'")));
  EXPECT_THAT(list, Not(Contains(HasSubstr("without content"))));
}

TEST(WriteFidl, KeepsTheWidthOfAnErrorThatAMethodDeclares) {
  const std::vector<SourceText> sources{
      {"I.fidl", "package p interface I { version { major 1 minor 0 } method m { error { A B } } }"},
      {"I.fdepl",
       "import "
       "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl\"\n"
       "import \"I.fidl\" define org.genivi.commonapi.someip.deployment for interface p.I { SomeIpServiceID "
       "= 1 "
       "method m { SomeIpMethodID = 1 } }"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  EXPECT_EQ(reading.model.at(reading.model.services[0].methods[0].error).primitive,
            messages::Primitive::uint32);
  expect_round_trip(reading.model, "error");
}

Model with_names() {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint8});
  const TypeIndex text = model.add({.kind = Kind::string, .wire = default_wire(Kind::string)});
  Type string{.kind = Kind::structure, .name = "String", .scope = "std_msgs"};
  string.members.push_back({.name = "data", .type = text, .wire = default_wire(Kind::string)});
  const TypeIndex wrapped = model.add(std::move(string));
  Type joy{.kind = Kind::structure, .name = "class", .scope = "std_msgs"};
  for (const char* name : {"array", "error", "int", "state", "with space"}) {
    joy.members.push_back({.name = name, .type = number});
  }
  joy.members.push_back({.name = "text", .type = wrapped});
  const TypeIndex words = model.add(std::move(joy));
  Service service{.name = "Door", .scope = "std_msgs", .id = someip::ServiceId{5}, .has_version = true};
  Event event{.name = "double", .id = someip::MethodId{0x8001}, .eventgroups = {someip::EventgroupId{1}}};
  event.payload.values.push_back({.name = "words", .type = words});
  service.events.push_back(std::move(event));
  service.eventgroups.push_back({.id = someip::EventgroupId{1}});
  service.events[0].transfer.retention = std::chrono::milliseconds{5};
  model.services.push_back(std::move(service));
  return model;
}

TEST(WriteFidl, RenamesWordsOfFidlAndCppAndKeepsTheNames) {
  const Written written = write_fidl(with_names());
  const std::string text = all_text(written);
  EXPECT_THAT(text, HasSubstr("struct String_ {"));
  EXPECT_THAT(text, HasSubstr("String_ text"));
  EXPECT_THAT(text, HasSubstr("struct class_ {"));
  EXPECT_THAT(text, HasSubstr("UInt8 ^array"));
  EXPECT_THAT(text, HasSubstr("<** @details : name: int **>"));
  EXPECT_THAT(text, HasSubstr("broadcast double_ {"));
  expect_round_trip(with_names(), "names");
}

/// Franca lets nobody else use a type of an interface that is not public.
TEST(WriteFidl, MakesTypesPublicThatOtherInterfacesUse) {
  const SourceText source{"I.fidl",
                          "package p interface I { version { major 1 minor 0 } public struct S { Own o } "
                          "struct Own { UInt8 n } typedef N is UInt8 } "
                          "interface J { version { major 1 minor 0 } attribute I.S[] s } "
                          "interface K extends I { version { major 1 minor 0 } attribute N n }"};
  const Reading reading = read_fidl({&source, 1});
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  const std::string text = all_text(write_fidl(reading.model));
  EXPECT_THAT(text, HasSubstr("    public struct S {"));
  EXPECT_THAT(text, HasSubstr("    struct Own {"));
  EXPECT_THAT(text, HasSubstr("    typedef N is UInt8"));
  expect_round_trip(reading.model, "public");
}

TEST(WriteFidl, RenamesAnInterfaceThatIsAWordOfFdepl) {
  const SourceText source{"I.fidl", "package p interface Interface { version { major 1 minor 0 } }"};
  const Reading reading = read_fidl({&source, 1});
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  EXPECT_THAT(all_text(write_fidl(reading.model)), HasSubstr("for interface p.Interface_ {"));
  expect_round_trip(reading.model, "word");
}

TEST(WriteFidl, WritesUndefinedAsItIs) {
  const SourceText source{"I.fidl",
                          "package p interface I { version { major 1 minor 0 } typedef Any is undefined "
                          "struct S { UInt8 n undefined rest } attribute S s }"};
  const Reading reading = read_fidl({&source, 1});
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  const Written written = write_fidl(reading.model);
  EXPECT_THAT(all_text(written), HasSubstr("typedef Any is undefined"));
  EXPECT_THAT(all_text(written), HasSubstr("undefined rest"));
  const Reading again = read_back(written);
  ASSERT_TRUE(again.ok()) << all_problems(again) << all_text(written);
  EXPECT_EQ(canonical(again.model), canonical(reading.model));
}

TEST(WriteFidl, TellsOfIdsThatAreNotThoseOfTheBase) {
  Model model;
  Service base{.name = "Base", .scope = "p", .id = someip::ServiceId{1}};
  base.methods = {{.name = "open", .id = someip::MethodId{1}}, {.name = "shut", .id = someip::MethodId{2}}};
  Service heir = base;
  heir.name = "Heir";
  heir.base = "p.Base";
  heir.methods[1].id = someip::MethodId{3};
  model.services = {base, heir};
  EXPECT_THAT(
      lost(write_fidl(model)),
      ::testing::ElementsAre("p.Heir.shut: other ids than in the interface that it is inherited from"));
}

TEST(WriteFidl, TellsOfSettingsThatAreNotThoseOfTheBase) {
  Model model;
  const TypeIndex text = model.add({.kind = Kind::string});
  const Wire wire = default_wire(Kind::string);
  const Payload payload{.values = {{.name = "text", .type = text, .wire = wire}}};
  Service base{.name = "Base", .scope = "p", .id = someip::ServiceId{1}};
  base.methods = {{.name = "same", .id = someip::MethodId{1}}, {.name = "fast", .id = someip::MethodId{2}}};
  base.events = {{.name = "tick",
                  .id = someip::MethodId{0x8001},
                  .payload = payload,
                  .eventgroups = {someip::EventgroupId{1}}},
                 {.name = "safe",
                  .id = someip::MethodId{0x8002},
                  .payload = payload,
                  .eventgroups = {someip::EventgroupId{1}}}};
  base.fields = {{.name = "label", .payload = payload, .getter = someip::MethodId{3}, .has_setter = false}};
  base.methods[1].request_transfer.transport = base.methods[1].response_transfer.transport = Transport::tcp;
  Service heir = base;
  heir.name = "Heir";
  heir.id = someip::ServiceId{2};
  heir.base = "p.Base";
  heir.methods[1].request_transfer.transport = heir.methods[1].response_transfer.transport = Transport::udp;
  heir.events[0].payload.values[0].wire.encoding = someip::StringEncoding::utf16be;
  heir.events[0].eventgroups = {someip::EventgroupId{7}};
  heir.events[1].e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  heir.fields[0].cycle = std::chrono::milliseconds{20};
  model.services = {base, heir};
  const std::string rest = " than in the interface that it is inherited from";
  const std::vector<std::string> list = lost(write_fidl(model));
  EXPECT_THAT(list,
              ::testing::IsSupersetOf({"p.Heir.fast: other settings" + rest,
                                       "p.Heir.tick: other settings" + rest +
                                           ": SomeIpEventGroups = { 7 }, SomeIpStringEncoding = utf16be",
                                       "p.Heir.safe: another E2E protection" + rest,
                                       "p.Heir.label: another cycle" + rest}));
  EXPECT_THAT(list, Not(Contains(HasSubstr("p.Heir.same"))));
  // What the heir has as its base has it is told there.
  model.services[1] = base;
  model.services[1].name = "Heir";
  model.services[1].base = "p.Base";
  EXPECT_THAT(lost(write_fidl(model)), Not(Contains(HasSubstr("p.Heir"))));
}

TEST(WriteFidl, DeploysNoAttributeThatItDoesNotWrite) {
  Model model;
  Service service{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  // As in a configuration of vsomeip, which does not say what is in it.
  service.fields.push_back({.name = "field_0778",
                            .payload = {.known = false},
                            .notifier = someip::MethodId{0x778},
                            .has_getter = false,
                            .has_setter = false});
  model.services.push_back(std::move(service));
  const Written written = write_fidl(model);
  EXPECT_THAT(lost(written), Contains("car.Door.field_0778: an attribute without a value"));
  EXPECT_THAT(all_text(written), Not(HasSubstr("field_0778")));
  EXPECT_TRUE(read_back(written).ok()) << all_problems(read_back(written));
}

TEST(WriteFidl, TellsWhatItCannotCarry) {
  Model model = with_names();
  const TypeIndex empty = model.add({.kind = Kind::structure, .name = "Empty", .scope = "std_msgs"});
  Event& event = model.services[0].events[0];
  event.payload.values.push_back({.name = "nothing", .type = empty});
  event.payload.values[0].tag = someip::DataId{3};
  event.e2e.profile = "4";
  event.cycle = std::chrono::milliseconds{10};
  model.machines.push_back({.name = "M"});
  const Written written = write_fidl(model);
  for (const char* what : {"std_msgs.Door.double.words: a data id (TLV)",
                           "std_msgs.Door.double: E2E protection", "std_msgs.Door.double: a cycle",
                           "M: a machine", "std_msgs.Empty: a type without content, and what is of it",
                           "std_msgs.Door.double.nothing: a use of a type without content"}) {
    EXPECT_THAT(lost(written), Contains(what));
  }
  EXPECT_TRUE(read_back(written).ok());
}

/// A service whose event has one value.
Model with_value(Model model, const Value& value) {
  Service service{.name = "Door", .scope = "car", .id = someip::ServiceId{5}};
  service.events.push_back({.name = "moved", .id = someip::MethodId{0x8001}, .payload = {.values = {value}}});
  model.services = {service};
  return model;
}

Wire wire_of(Kind kind, someip::FieldWidth width) {
  Wire wire = default_wire(kind);
  wire.length = width;
  return wire;
}

/// "#" is said of the outermost array alone.
TEST(WriteFidl, TellsOfRulesOfArraysInArrays) {
  const Wire two = wire_of(Kind::array, someip::FieldWidth::bits16);
  const Wire four = default_wire(Kind::array);
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const TypeIndex row =
      model.add({.kind = Kind::array, .name = "Row", .scope = "car", .wire = two, .element = {.type = u8}});
  const auto rows = [&](const std::string& name, const Wire& inner) {
    return model.add({.kind = Kind::array,
                      .name = name,
                      .scope = name.empty() ? "" : "car",
                      .wire = two,
                      .element = {.type = row, .wire = inner}});
  };
  const TypeIndex named = rows("Rows", four);
  const TypeIndex other = rows("Others", two);
  const TypeIndex unnamed = rows("", four);
  Type variant = model.at(other);
  variant.element.wire = four;
  variant.variant_of = other;
  const TypeIndex changed = model.add(variant);
  const auto lost_of = [&](TypeIndex type) {
    const Written written = write_fidl(with_value(model, {.name = "rows", .type = type, .wire = two}));
    const Reading again = read_back(written);
    EXPECT_TRUE(again.ok()) << all_problems(again) << all_text(written);
    // The outer array keeps its rule.
    EXPECT_EQ(again.model.services.at(0).events.at(0).payload.values.at(0).wire, two) << all_text(written);
    return lost(written);
  };
  const std::string inner = "rules of arrays in an array that hold for this use alone";
  EXPECT_THAT(lost_of(named), Contains("car.Rows: " + inner));
  EXPECT_THAT(lost_of(unnamed), Contains("car.Door.moved.rows: " + inner));
  EXPECT_THAT(lost_of(changed), Contains("car.Door.moved.rows: " + inner));
  model.at(named).element.wire = two;
  EXPECT_THAT(lost_of(other), Not(Contains(HasSubstr(inner))));
}

TEST(WriteFidl, TellsOfFixedSizesBehindALengthField) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const Wire array = default_wire(Kind::array);
  const Wire none = wire_of(Kind::array, someip::FieldWidth::none);
  const Type nine{
      .kind = Kind::array, .element = {.type = u8}, .min_size = 9, .max_size = 9, .fixed_size = true};
  const TypeIndex numbers = model.add(nine);
  Type named = nine;
  named.name = "Nine";
  named.scope = "car";
  named.wire = array;
  const TypeIndex declared = model.add(named);
  const TypeIndex raw = model.add({.kind = Kind::bytes, .min_size = 9, .max_size = 9, .fixed_size = true});
  const auto lost_of = [&](TypeIndex type, const Wire& wire) {
    return lost(write_fidl(with_value(model, {.name = "nine", .type = type, .wire = wire})));
  };
  EXPECT_THAT(lost_of(numbers, array),
              Contains("car.Door.moved.nine: the fixed size of an array with a length field"));
  EXPECT_THAT(lost_of(declared, array), Contains("car.Nine: the fixed size of an array with a length field"));
  EXPECT_THAT(lost_of(raw, array),
              Contains("car.Door.moved.nine: the fixed size of a byte buffer with a length field"));
  model.at(declared).wire = none;
  EXPECT_THAT(lost_of(numbers, none), Not(Contains(HasSubstr("fixed size"))));
  EXPECT_THAT(lost_of(raw, wire_of(Kind::bytes, someip::FieldWidth::none)),
              Not(Contains(HasSubstr("fixed size"))));
}

TEST(WriteFidl, TellsOfWhichServiceAndWhereWhatIsLostStands) {
  Model model;
  model.files = {"First.arxml", "Second.arxml"};
  for (const char* name : {"Door", "Hatch"}) {
    Service service{.name = name, .scope = "car", .id = someip::ServiceId{0x1234}};
    service.notes.others["@odd"] = "x";
    service.manages = {"car.Lock"};
    Method method{.name = "open",
                  .id = someip::MethodId{1},
                  .selector = "slowly",
                  .place = {.file = 1, .mark = {.line = 7, .column = 3}}};
    method.response.alignment = 4;
    method.request.values.push_back({.name = "speed",
                                     .type = model.add({.kind = Kind::primitive}),
                                     .default_value = "1",
                                     .notes = {.others = {{"@odd", "y"}}}});
    service.methods.push_back(std::move(method));
    model.services.push_back(std::move(service));
  }
  const Written written = write_fidl(model);
  EXPECT_THAT(
      lost(written),
      ::testing::IsSupersetOf({"car.Door: the annotation @odd, which Franca does not know",
                               "car.Door: the interface car.Lock that it manages, which is not described",
                               "car.Door.open:slowly: alignment of its response",
                               "car.Door.open:slowly.speed: a default value",
                               "car.Door.open:slowly.speed: the annotation @odd, which Franca does not know",
                               "car.Hatch.open:slowly: alignment of its response"}));
  const auto aligned = std::ranges::find(written.not_carried, "alignment of its response", &NotCarried::what);
  ASSERT_NE(aligned, written.not_carried.end());
  EXPECT_EQ(to_string(model, aligned->place), "Second.arxml:7:3");
}

TEST(WriteFidl, DoesNotMissTheNameOfAGroupThatWasMade) {
  Model model;
  model.services.push_back({.name = "Door", .scope = "car", .id = someip::ServiceId{5}});
  model.services[0].eventgroups = {{.name = "all", .id = someip::EventgroupId{1}},
                                   {.name = "some", .id = someip::EventgroupId{2}}};
  EXPECT_THAT(lost(write_fidl(model)), ::testing::ElementsAre("car.Door: the name 'some' of an eventgroup"));
}

TEST(WriteFidl, WritesAnOverloadOfWhatTheBaseHas) {
  const std::vector<SourceText> sources{
      {"I.fidl",
       "package p interface A { version { major 1 minor 0 } method m { in { UInt8 x } } broadcast b { out { "
       "UInt8 x } } } interface B extends A { version { major 1 minor 0 } method m:wide { in { String x } } "
       "broadcast b:wide { out { String x } } }"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  ASSERT_EQ(reading.model.services.at(1).methods.size(), 2U);
  const std::string text = all_text(write_fidl(reading.model));
  EXPECT_THAT(text, HasSubstr("method m:wide {"));
  EXPECT_THAT(text, HasSubstr("broadcast b:wide {"));
}

/// They are the same for Franca.
TEST(WriteFidl, RenamesOverloadsThatDifferInTheKindOfIntegersAlone) {
  const std::vector<SourceText> sources{
      {"I.fidl",
       "package p interface A { version { major 1 minor 0 } method m:a { in { UInt8 x } } "
       "method m:b { in { Int64 x } } method m:c { in { Float x } } method n:a { in { UInt8[] x } out { "
       "UInt8 y } } "
       "method n:b { in { UInt16[] x } out { Integer(0, 4) y } } broadcast e:a { out { UInt8 x } } "
       "broadcast e:b { out { UInt16 x } } } "
       "interface B extends A { version { major 1 minor 0 } method m:d { in { UInt16 x } } }"},
      {"I.fdepl",
       "import "
       "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl\"\n"
       "import \"I.fidl\" define org.genivi.commonapi.someip.deployment for interface p.A { SomeIpServiceID "
       "= 1 "
       "method m:a { SomeIpMethodID = 1 } method m:b { SomeIpMethodID = 2 } method m:c { SomeIpMethodID = 3 "
       "} "
       "method n:a { SomeIpMethodID = 4 } method n:b { SomeIpMethodID = 5 } "
       "broadcast e:a { SomeIpEventID = 32769 SomeIpEventGroups = { 1 } } "
       "broadcast e:b { SomeIpEventID = 32770 SomeIpEventGroups = { 1 } } }\n"
       "define org.genivi.commonapi.someip.deployment for interface p.B { SomeIpServiceID = 2 "
       "method m:d { SomeIpMethodID = 6 } }"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  const std::string text = all_text(write_fidl(reading.model));
  for (const char* written : {"    method m:a {", "    method m_:b {", "    method m:c {", "    method n:a {",
                              "    method n_:b {", "    broadcast e:a {", "    broadcast e_:b {"}) {
    EXPECT_THAT(text, HasSubstr(written));
  }
  EXPECT_THAT(text, HasSubstr("<** @details : name: m **>\n    method m_2:d {"));
  expect_round_trip(reading.model, "overloads");
}

TEST(WriteFidl, RenamesTypesThatHaveTheNameOfAnInheritedOne) {
  const std::vector<SourceText> sources{
      {"I.fidl",
       "package p interface B extends A { version { major 1 minor 0 } struct S { UInt16 x } const UInt8 C = "
       "2 "
       "attribute S s } "
       "interface A { version { major 1 minor 0 } struct S { UInt8 x } const UInt8 C = 1 attribute S t } "
       "interface D extends A { version { major 1 minor 0 } typedef S is UInt8 attribute S s }"},
      {"I.fdepl",
       "import "
       "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl\"\n"
       "import \"I.fidl\" define org.genivi.commonapi.someip.deployment for interface p.A { SomeIpServiceID "
       "= 1 "
       "attribute t { SomeIpGetterID = 1 SomeIpSetterID = 2 SomeIpNotifierID = 32769 "
       "SomeIpNotifierEventGroups = { 1 } } }\n"
       "define org.genivi.commonapi.someip.deployment for interface p.B { SomeIpServiceID = 2 "
       "attribute s { SomeIpGetterID = 3 SomeIpSetterID = 4 SomeIpNotifierID = 32770 "
       "SomeIpNotifierEventGroups = { 1 } } }\n"
       "define org.genivi.commonapi.someip.deployment for interface p.D { SomeIpServiceID = 3 "
       "attribute s { SomeIpGetterID = 3 SomeIpSetterID = 4 SomeIpNotifierID = 32770 "
       "SomeIpNotifierEventGroups = { 1 } } }"}};
  const Reading reading = read_fidl(sources);
  ASSERT_TRUE(reading.ok()) << all_problems(reading);
  const std::string text = all_text(write_fidl(reading.model));
  for (const char* written :
       {"    struct S {", "    struct S_ {", "    typedef S_ is UInt8", "    const UInt8 C = 1",
        "    const UInt8 C_ = 2", "    attribute S_ s", "    attribute S t"}) {
    EXPECT_THAT(text, HasSubstr(written));
  }
  expect_round_trip(reading.model, "inherited");
}

TEST(WriteFidl, TellsOfTheDescriptionOfAnArrayWithoutADeclaration) {
  Model model;
  const TypeIndex text = model.add({.kind = Kind::string, .wire = default_wire(Kind::string)});
  Type names{.kind = Kind::array, .name = "Names", .scope = "car"};
  names.element = {.type = text, .wire = default_wire(Kind::string)};
  names.element.wire.length = someip::FieldWidth::bits16;
  names.notes.description = "who may drive";
  const TypeIndex array = model.add(std::move(names));
  model.services = {{.name = "Door", .scope = "car", .id = someip::ServiceId{1}}};
  model.services[0].methods = {{.name = "allow", .id = someip::MethodId{1}}};
  model.services[0].methods[0].request.values = {{.name = "names", .type = array}};
  const Written written = write_fidl(model);
  EXPECT_THAT(all_text(written), HasSubstr("String[] names"));
  EXPECT_THAT(lost(written), Contains("car.Names: the description of an array that is written as T[]"));
}

TEST(WriteFidl, NamesNoFileThatASystemRefuses) {
  Model model;
  const std::string longer(300, 'a');
  for (const char* end : {"x", "y"}) {
    model.services.push_back({.name = "Door", .scope = "org." + longer + end});
  }
  const Written written = write_fidl(model);
  ASSERT_EQ(written.files.size(), 4U);
  std::set<std::string> names;
  for (const TextFile& file : written.files) {
    EXPECT_LE(file.path.size(), 210U);
    names.insert(file.path);
  }
  EXPECT_EQ(names.size(), 4U);
  EXPECT_THAT(lost(written), Contains(::testing::StartsWith("org." + longer + "x.Door: the package '")));
  EXPECT_TRUE(read_back(written).ok()) << all_problems(read_back(written));
}

}  // namespace
}  // namespace trestle::describe
