#include "bridge/describe/read/fidl/read_fidl.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>

namespace trestle::describe {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Files = std::map<std::string, std::string>;

Reading read(const Files& files, std::vector<std::string> named, const FidlLimits& limits = {}) {
  std::vector<SourceText> sources;
  for (const std::string& name : named) {
    sources.push_back({name, files.at(name)});
  }
  const Load load = [&](const std::string& name) -> tl::expected<std::string, std::string> {
    const auto found = files.find(name);
    if (found == files.end()) {
      return tl::unexpected{std::string{"there is no such file"}};
    }
    return found->second;
  };
  return read_fidl(sources, load, limits);
}

std::vector<std::string> told(const Reading& reading) {
  std::vector<std::string> all;
  for (const documents::Problem& problem : reading.problems) {
    all.push_back(documents::to_string(problem));
  }
  return all;
}

constexpr const char* v2 =
    "import "
    "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\n";
constexpr const char* v1 =
    "import "
    "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl\"\n";
constexpr const char* spec = "define org.genivi.commonapi.someip.deployment for ";

/// An interface a.b.I of version 1.2 and its deployment.
Reading deployed(const std::string& members, const std::string& deployment, const char* version = v2,
                 const std::string& more = "") {
  return read(
      {{"I.fidl", "package a.b\ninterface I {\nversion { major 1 minor 2 }\n" + members + "\n}\n"},
       {"I.fdepl", version + std::string{"import \"I.fidl\"\n"} + spec +
                       "interface a.b.I {\nSomeIpServiceID = 0x1234\n" + deployment + "\n}\n" + more}},
      {"I.fdepl"});
}

const Value& only_value(const Reading& reading) {
  return reading.model.services.at(0).fields.at(0).payload.values.at(0);
}

TEST(ReadFidl, TakesAServiceIdOfNothingForNone) {
  const Reading reading = read({{"I.fidl", "package a.b\ninterface I {\nversion { major 1 minor 2 }\n}\n"},
                                {"I.fdepl", v2 + std::string{"import \"I.fidl\"\n"} + spec +
                                                "interface a.b.I {\nSomeIpServiceID = 0\n}\n"}},
                               {"I.fdepl"});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading), ElementsAre(AllOf(HasSubstr("I.fdepl:4:1: warning: "), HasSubstr("'I' is 0"))));
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_FALSE(reading.model.services[0].id);
}

/// [feat_req_someipids_529] [feat_req_someipids_636]
TEST(ReadFidl, TakesReservedIdsOfMembersAndInstancesForNone) {
  const Reading reading = deployed("method m { } broadcast b { }",
                                   "method m { SomeIpMethodID = 0 }\nbroadcast b { SomeIpEventID = 0 }", v2,
                                   "define org.genivi.commonapi.someip.deployment for provider as P {\n"
                                   "instance a.b.I { InstanceId = \"x\" SomeIpInstanceID = 0xffff }\n"
                                   "instance a.b.I { InstanceId = \"y\" SomeIpInstanceID = 0 }\n}\n");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre("I.fdepl:5:29: warning: the SomeIpMethodID of 'm' is 0, which is reserved; it is "
                  "taken for none",
                  "I.fdepl:6:31: warning: the SomeIpEventID of 'b' is 0, which is reserved; it is taken "
                  "for none",
                  "I.fdepl:9:54: warning: the SomeIpInstanceID 0xffff cannot be that of an instance: it "
                  "is left open",
                  "I.fdepl:10:54: warning: the SomeIpInstanceID 0x0000 cannot be that of an instance: it "
                  "is left open"));
  EXPECT_FALSE(reading.model.services[0].methods[0].id);
  EXPECT_FALSE(reading.model.services[0].events[0].id);
  ASSERT_THAT(reading.model.instances, SizeIs(2));
  EXPECT_FALSE(reading.model.instances[0].id);
}

/// An id stands in a FDEPL file, which may be one of several.
TEST(ReadFidl, NamesTheFileOfAnIdThatIsThereTwice) {
  const std::string fidl =
      "package a interface A { version { major 1 minor 0 } method a { } broadcast e { } }\n"
      "interface B extends A { version { major 1 minor 0 } method b { } attribute UInt8 f }";
  const auto fdepl = [](const std::string& interface) {
    return v2 + std::string{"import \"I.fidl\"\n"} + spec + "interface a." + interface + "}";
  };
  const Files files{{"I.fidl", fidl},
                    {"A.fdepl", fdepl("A { SomeIpServiceID = 1\nmethod a {\nSomeIpMethodID = 7 }\n"
                                      "broadcast e { SomeIpEventID = 0x8001 SomeIpEventGroups = { 0 } } ")},
                    {"B.fdepl", fdepl("B { SomeIpServiceID = 2\n\nmethod b {\n\nSomeIpMethodID = 7 }\n"
                                      "attribute f { SomeIpGetterID = 8 SomeIpSetterID = 9\n"
                                      "SomeIpNotifierID = 0x8001 SomeIpNotifierEventGroups = { 1 } } ")}};
  const Reading reading = read(files, {"A.fdepl", "B.fdepl"});
  EXPECT_THAT(told(reading),
              ElementsAre("B.fdepl:7:18: error: B.b has the id 0x0007 of B.a, at A.fdepl:5:18",
                          "B.fdepl:9:20: error: B.f (notifier) has the id 0x8001 of B.e, at A.fdepl:6:31"));
  // Nor do two files say two things of one element.
  EXPECT_THAT(told(read({{"I.fidl", fidl},
                         {"A.fdepl", fdepl("A { SomeIpServiceID = 1\n")},
                         {"B.fdepl", fdepl("A {\nSomeIpServiceID = 2 ")}},
                        {"A.fdepl", "B.fdepl"})),
              ElementsAre(HasSubstr("SomeIpServiceID = 2 contradicts SomeIpServiceID = 1 at A.fdepl:3:67")));
  const Service& service = reading.model.services.at(1);
  EXPECT_EQ(service.id_place.mark, (documents::Mark{3, 85}));
  EXPECT_EQ(service.fields[0].getter_place.mark, (documents::Mark{8, 32}));
  EXPECT_EQ(service.fields[0].setter_place.mark, (documents::Mark{8, 51}));
  EXPECT_EQ(service.eventgroups[0].place.mark, (documents::Mark{6, 60})) << "of the base";
}

TEST(ReadFidl, TellsOfAnInterfaceWithTheServiceIdOfOneThatItExtends) {
  const auto fdepl = [](const char* one, const char* id) {
    return v2 + std::string{"import \"I.fidl\"\n"} + spec + "interface a." + one +
           " {\nSomeIpServiceID = " + id + "\n}\n";
  };
  const Files files{{"I.fidl",
                     "package a interface C extends B { version { major 1 minor 0 } }\n"
                     "interface A { version { major 1 minor 0 } }\n"
                     "interface B extends A { version { major 1 minor 0 } }"},
                    {"A.fdepl", fdepl("A", "5")},
                    {"B.fdepl", fdepl("B", "6")},
                    {"C.fdepl", fdepl("C", "5")}};
  EXPECT_THAT(told(read(files, {"A.fdepl", "B.fdepl", "C.fdepl"})),
              ElementsAre("C.fdepl:4:19: warning: 'C' has the service id 0x0005 of 'A', which it extends, at "
                          "A.fdepl:4:19"));
}

TEST(ReadFidl, LeavesOutKeysThatCommonApiDoesNotHave) {
  const Reading reading =
      deployed("attribute M m\nmap M { UInt8 to UInt8 }", "map M { SomeIpMapLengthWidth = 1 }");
  EXPECT_THAT(told(reading), Contains(HasSubstr("'SomeIpMapLengthWidth' is not known, and is left out")));
  EXPECT_EQ(only_value(reading).wire.length, someip::FieldWidth::bits32);
}

// Arrays, structs and others have such keys for who uses them, and strings have none.
TEST(ReadFidl, LeavesOutKeysOfUsersThatCommonApiDoesNotHave) {
  const Reading reading = deployed(
      "attribute String s", "attribute s { SomeIpNotifierID = 0x8001 SomeIpAttrStringLengthWidth = 2 }");
  EXPECT_THAT(told(reading),
              Contains(HasSubstr("'SomeIpAttrStringLengthWidth' is not known, and is left out")));
  EXPECT_EQ(only_value(reading).wire.length, someip::FieldWidth::bits32);
}

TEST(ReadFidl, ReadsAnInterfaceWithItsDeployment) {
  const Reading reading = deployed(
      R"(
      <** @description : how fast it goes
          @details : unit: km/h
          @deprecated : since 2020 **>
      attribute UInt16 speed readonly
      method open { in { UInt8 door String why } out { Boolean done } error { LOCKED BROKEN } }
      method beep fireAndForget { in { UInt8 times } }
      broadcast moved selective { out { Int32 by } })",
      R"(
      SomeIpEventGroups = { 7 }
      attribute speed { SomeIpGetterID = 1 SomeIpSetterID = 0 SomeIpNotifierID = 0x8001 SomeIpNotifierEventGroups = { 1, 2 }
                        SomeIpAttributeReliable = true SomeIpNotifierSegmentLength = 1008 SomeIpNotifierSeparationTime = 2 }
      method open { SomeIpMethodID = 2 SomeIpMethodEndianess = le SomeIpMethodCRCWidth = four MethodTimeout = 250
                    in { why { SomeIpStringLengthWidth = 2 SomeIpStringEncoding = utf16be } } }
      method beep { SomeIpMethodID = 0b11 SomeIpReliable = true }
      broadcast moved { SomeIpEventID = 0x8002 SomeIpEventGroups = { 2 } })",
      v2, R"(
      define org.genivi.commonapi.someip.deployment for provider as P {
        instance a.b.I { InstanceId = "here" SomeIpInstanceID = 0x10 Domain = "far"
          SomeIpUnicastAddress = "192.168.0.2" SomeIpReliableUnicastPort = 30499 SomeIpUnreliableUnicastPort = 30500
          SomeIpMulticastEventGroups = { 1 } SomeIpMulticastAddresses = { "224.244.224.245" }
          SomeIpMulticastPorts = { 30501 } SomeIpMulticastThreshold = { 3 } } })");
  ASSERT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const Service& service = reading.model.services[0];
  EXPECT_EQ(service.name, "I");
  EXPECT_EQ(service.scope, "a.b");
  EXPECT_EQ(service.id, someip::ServiceId{0x1234});
  EXPECT_EQ(service.major, 1);
  EXPECT_EQ(service.minor, 2u);
  ASSERT_THAT(service.eventgroups, SizeIs(3));
  EXPECT_EQ(service.eventgroups[2].id, someip::EventgroupId{7});

  const Field& speed = service.fields.at(0);
  EXPECT_EQ(speed.notes.description, "how fast it goes");
  EXPECT_EQ(speed.payload.values.at(0).notes.unit, "km/h");
  EXPECT_EQ(speed.notes.others.at("@deprecated"), "since 2020");
  EXPECT_EQ(speed.getter, someip::MethodId{1});
  EXPECT_FALSE(speed.has_setter);
  EXPECT_EQ(speed.setter, std::nullopt);
  EXPECT_EQ(speed.notifier, someip::MethodId{0x8001});
  EXPECT_THAT(speed.eventgroups, ElementsAre(someip::EventgroupId{1}, someip::EventgroupId{2}));
  EXPECT_EQ(speed.notifier_transfer.transport, Transport::tcp);
  EXPECT_EQ(speed.notifier_transfer.segment_bytes, 1008u);
  EXPECT_EQ(speed.notifier_transfer.separation, std::chrono::milliseconds{2});
  EXPECT_EQ(speed.notifier_transfer.retention, std::chrono::milliseconds{5});

  const Method& open = service.methods.at(0);
  EXPECT_EQ(open.request.byte_order, std::endian::little);
  EXPECT_EQ(open.request.crc_bytes, 4);
  EXPECT_EQ(open.timeout, std::chrono::milliseconds{250});
  EXPECT_EQ(open.request.values.at(1).wire.length, someip::FieldWidth::bits16);
  EXPECT_EQ(open.request.values.at(1).wire.encoding, someip::StringEncoding::utf16be);
  ASSERT_NE(open.error, no_type);
  EXPECT_THAT(reading.model.at(open.error).enumerators, SizeIs(2));
  EXPECT_EQ(service.methods.at(1).id, someip::MethodId{3});
  EXPECT_TRUE(service.methods.at(1).fire_and_forget);
  EXPECT_TRUE(service.events.at(0).selective);

  const Instance& instance = reading.model.instances.at(0);
  EXPECT_EQ(instance.name, "here");
  EXPECT_EQ(instance.service, "a.b.I");
  EXPECT_EQ(instance.service_id, someip::ServiceId{0x1234});
  EXPECT_EQ(instance.id, someip::InstanceId{0x10});
  EXPECT_EQ(instance.tcp_port, 30499);
  EXPECT_EQ(instance.udp_port, 30500);
  EXPECT_EQ(instance.notes.others.at("Domain"), "\"far\"");
  EXPECT_THAT(instance.multicast,
              ElementsAre(Multicast{someip::EventgroupId{1}, {IpAddress::v4(224, 244, 224, 245), 30501}, 3}));
}

TEST(ReadFidl, ReadsAFileWithoutDeployment) {
  const Reading reading = read(
      {{"d/I.fidl", "package p interface I { version { major 3 minor 0 } method m { } }"}}, {"d/I.fidl"});
  ASSERT_THAT(told(reading), IsEmpty());
  EXPECT_EQ(reading.model.services.at(0).id, std::nullopt);
  EXPECT_EQ(reading.model.services.at(0).methods.at(0).id, std::nullopt);
  EXPECT_EQ(reading.model.services.at(0).major, 3);
}

TEST(ReadFidl, TakesTheDefaultsOfTheVersionThatIsImported) {
  const std::string members = "enumeration E { A B } attribute E e";
  const std::string ids = "attribute e { SomeIpGetterID = 1 SomeIpEventGroups = { 1 } }";
  const Reading one = deployed(members, ids, v1);
  const Reading two = deployed(members, ids, v2);
  EXPECT_EQ(resolved(one.model, only_value(one).type).primitive, messages::Primitive::uint32);
  EXPECT_EQ(resolved(two.model, only_value(two).type).primitive, messages::Primitive::uint8);
  EXPECT_EQ(one.model.services[0].fields[0].getter_transfer.retention, std::chrono::milliseconds{0});
}

TEST(ReadFidl, ReadsTheOverwritingKeysOfVersionOne) {
  const Reading reading = deployed(
      "struct S { UInt8[] a } map M { UInt8 to String } union U { UInt8 x String y } attribute S s attribute "
      "M m attribute U u "
      "method f { in { UInt16[] list } }",
      "struct S { a { SomeIpStructArrayLengthWidth = 2 SomeIpStructArrayMaxLength = 8 } }\n"
      "attribute s { SomeIpGetterID = 1 SomeIpAttrStructLengthWidth = 1 }\n"
      "attribute m { SomeIpGetterID = 2 SomeIpAttrMapLengthWidth = 1 SomeIpAttrMapMaxLength = 9 }\n"
      "attribute u { SomeIpGetterID = 3 SomeIpAttrUnionLengthWidth = 0 SomeIpAttrUnionTypeWidth = 1 "
      "SomeIpAttrUnionMaxLength = 20 SomeIpAttrUnionDefaultOrder = false }\n"
      "method f { SomeIpMethodID = 4 in { list { SomeIpArgArrayLengthWidth = 1 } } }",
      v1);
  ASSERT_THAT(told(reading), IsEmpty());
  const Service& service = reading.model.services[0];
  const Value& s = service.fields[0].payload.values[0];
  EXPECT_EQ(s.wire.length, someip::FieldWidth::bits8);
  const Value& a = reading.model.at(s.type).members.at(0);
  EXPECT_EQ(a.wire.length, someip::FieldWidth::bits16);
  EXPECT_EQ(reading.model.at(a.type).max_size, 8u);
  const Value& m = service.fields[1].payload.values[0];
  EXPECT_EQ(m.wire.length, someip::FieldWidth::bits8);
  EXPECT_EQ(reading.model.at(m.type).max_size, 9u);
  EXPECT_NE(reading.model.at(m.type).variant_of, no_type);
  const Wire& u = service.fields[2].payload.values[0].wire;
  EXPECT_EQ(u.length, someip::FieldWidth::none);
  EXPECT_EQ(u.selector, someip::FieldWidth::bits8);
  EXPECT_EQ(u.fixed_bytes, 20u);
  EXPECT_FALSE(u.length_first);
  EXPECT_EQ(service.methods[0].request.values[0].wire.length, someip::FieldWidth::bits8);
}

TEST(ReadFidl, MakesVariantsOfTypesForNestedOverwrites) {
  const Reading reading = deployed(
      "enumeration E { A B } struct Inner { E e String t } struct S { Inner inner UInt8 n } attribute S "
      "plain attribute S other "
      "attribute S same",
      "struct S { SomeIpStructLengthWidth = 2 }\n"
      "attribute plain { SomeIpGetterID = 1 }\n"
      "attribute other { SomeIpGetterID = 2 #struct { inner { #struct { SomeIpStructLengthWidth = 1 "
      "e { #enumeration { SomeIpEnumWidth = 4 } } t { SomeIpStringLengthWidth = 1 } } } } }\n"
      "attribute same { SomeIpGetterID = 3 #struct { SomeIpStructLengthWidth = 4 } }");
  ASSERT_THAT(told(reading), IsEmpty());
  const Model& model = reading.model;
  const auto& fields = model.services[0].fields;
  const Value& plain = fields[0].payload.values[0];
  const Value& other = fields[1].payload.values[0];
  const Value& same = fields[2].payload.values[0];
  EXPECT_EQ(plain.wire.length, someip::FieldWidth::bits16);
  // CommonAPI: "#struct" has the default of the specification when it does not repeat the width.
  EXPECT_EQ(other.wire.length, someip::FieldWidth::none);
  EXPECT_EQ(same.wire.length, someip::FieldWidth::bits32);
  EXPECT_EQ(same.type, plain.type);
  EXPECT_EQ(model.at(other.type).variant_of, plain.type);
  const Value& inner = model.at(other.type).members.at(0);
  EXPECT_EQ(inner.wire.length, someip::FieldWidth::bits8);
  EXPECT_EQ(model.at(model.at(inner.type).members.at(0).type).primitive, messages::Primitive::uint32);
  EXPECT_EQ(model.at(inner.type).members.at(1).wire.length, someip::FieldWidth::bits8);
  // The declared type is as it was.
  const Value& declared = model.at(plain.type).members.at(0);
  EXPECT_EQ(declared.wire.length, someip::FieldWidth::none);
  EXPECT_EQ(model.at(model.at(declared.type).members.at(0).type).primitive, messages::Primitive::uint8);
}

TEST(ReadFidl, KnowsArraysStringsAndBuffersOfFixedSize) {
  const Reading reading = deployed(
      "array Cov of Double attribute Cov cov attribute String s attribute ByteBuffer b attribute UInt16[] "
      "list",
      "array Cov { SomeIpArrayLengthWidth = 0 SomeIpArrayMaxLength = 9 }\n"
      "attribute cov { SomeIpGetterID = 1 }\n"
      "attribute s { SomeIpGetterID = 2 SomeIpStringLengthWidth = 0 SomeIpStringLength = 20 }\n"
      "attribute b { SomeIpGetterID = 3 SomeIpByteBufferLengthWidth = 0 SomeIpByteBufferMaxLength = 4 }\n"
      "attribute list { SomeIpGetterID = 4 SomeIpArrayMinLength = 1 SomeIpArrayMaxLength = 5 "
      "SomeIpIntegerBitWidth = 12 "
      "SomeIpIntegerInvalidValue = 4095 }");
  ASSERT_THAT(told(reading), IsEmpty());
  const auto& fields = reading.model.services[0].fields;
  const auto type = [&](std::size_t i) { return resolved(reading.model, fields[i].payload.values[0].type); };
  EXPECT_TRUE(type(0).fixed_size);
  EXPECT_EQ(type(0).max_size, 9u);
  EXPECT_EQ(fields[0].payload.values[0].wire.length, someip::FieldWidth::none);
  EXPECT_EQ(fields[1].payload.values[0].wire.fixed_bytes, 20u);
  EXPECT_TRUE(type(2).fixed_size);
  EXPECT_FALSE(type(3).fixed_size);
  EXPECT_EQ(type(3).min_size, 1u);
  EXPECT_EQ(type(3).element.wire.bits, 12);
  EXPECT_EQ(reading.model.at(type(3).element.type).invalid_value, 4095);
}

TEST(ReadFidl, FindsTypesByScopePackageAndImport) {
  const Reading reading = read({{"a/I.fidl", R"(package p.q
        import p.t.* from "../t/T.fidl"
        import p.t.Other from "../t/T.fidl"
        import model "../t/T.fidl"
        interface Base { version { major 1 minor 0 } struct Own { UInt8 x } attribute Own inherited }
        interface I extends Base manages Base { version { major 1 minor 0 }
          attribute Own own  attribute Types.S s  attribute Other.O o  attribute p.t.Types.S full  attribute Free free }
        typeCollection { version { major 1 minor 0 } typedef Free is Base.Own })"},
                                {"t/T.fidl", R"(package p.t
        typeCollection Types { version { major 1 minor 0 } struct S { Integer(0, 10) a Integer(minInt, 5) b } }
        typeCollection Other { version { major 1 minor 0 } enumeration O { X = 0x10 Y Z = "7" W = Y + C * 2 } const UInt8 C = 3 })"}},
                               {"a/I.fidl"});
  ASSERT_THAT(told(reading), IsEmpty());
  const Service& service = reading.model.services.at(1);
  EXPECT_EQ(service.base, "p.q.Base");
  EXPECT_THAT(service.manages, ElementsAre("p.q.Base"));
  std::vector<std::string> types;
  for (const Field& field : service.fields) {
    const Type& type = reading.model.at(field.payload.values.at(0).type);
    types.push_back(full_name(type.scope, type.name));
  }
  EXPECT_THAT(types, ElementsAre("p.q.Base.Own", "p.q.Base.Own", "p.t.Types.S", "p.t.Other.O", "p.t.Types.S",
                                 "p.q.Free"));
  std::vector<std::int64_t> values;
  for (const Enumerator& one : reading.model.at(service.fields[3].payload.values[0].type).enumerators) {
    values.push_back(one.value);
  }
  EXPECT_THAT(values, ElementsAre(16, 17, 7, 23));
  EXPECT_EQ(reading.model.constants.at(0).value, "3");
}

TEST(ReadFidl, TakesTheCoreDeploymentOfAnInstanceForMoreOfIt) {
  const std::string core =
      "define org.genivi.commonapi.core.deployment for provider as C "
      "{ instance p.I { InstanceId = \"i\" Domain = \"local\" } }\n";
  const std::string someip =
      "define org.genivi.commonapi.someip.deployment for provider as P "
      "{ instance p.I { InstanceId = \"i\" SomeIpInstanceID = 5 SomeIpUnreliableUnicastPort = 6 } }\n";
  for (const std::string& both : {core + someip, someip + core}) {
    const Reading reading = read({{"K.fidl", "package p\ninterface I { version { major 1 minor 0 } }"},
                                  {"K.fdepl", std::string{v2} + "import \"K.fidl\"\n" + both}},
                                 {"K.fdepl"});
    ASSERT_THAT(told(reading), IsEmpty());
    ASSERT_THAT(reading.model.instances, SizeIs(1));
    EXPECT_EQ(reading.model.instances[0].id, someip::InstanceId{5});
    EXPECT_EQ(reading.model.instances[0].udp_port, 6);
    EXPECT_EQ(reading.model.instances[0].notes.others.at("Domain"), "\"local\"");
  }
}

/// Which join() compares, if the file says so.
TEST(ReadFidl, NotesWhereTransportsAndPortsAreSaid) {
  const Reading reading =
      deployed("method m { }\nbroadcast b { }\nbroadcast c { }",
               "method m { SomeIpMethodID = 1\nSomeIpReliable = false }\n"
               "broadcast b { SomeIpEventID = 32769 SomeIpEventGroups = { 1 }\nSomeIpReliable = true }",
               v2,
               std::string{spec} +
                   "provider as P { instance a.b.I { InstanceId = \"x\"\nSomeIpInstanceID = 1\n"
                   "SomeIpUnreliableUnicastPort = 31000 } }");
  ASSERT_THAT(told(reading), IsEmpty());
  const Service& service = reading.model.services.at(0);
  EXPECT_EQ(service.methods[0].request_transfer.transport_at, (Place{0, {6, 1}}));
  EXPECT_EQ(service.events[0].transfer.transport_at, (Place{0, {8, 1}}));
  EXPECT_EQ(service.events[0].transfer.retention_at, std::nullopt);
  EXPECT_EQ(service.events[1].transfer.transport_at, std::nullopt);
  EXPECT_EQ(reading.model.instances.at(0).said_at.at("udp_port"), (Place{0, {12, 1}}));
}

TEST(ReadFidl, TellsOfAnInstanceThatIsDeployedWithTwoIds) {
  const auto two = [](const char* second) {
    return deployed("", "", v2,
                    std::string{spec} +
                        "provider as P {\ninstance a.b.I { InstanceId = \"x\" SomeIpInstanceID = 1 "
                        "}\ninstance a.b.I { InstanceId = \"x\" SomeIpInstanceID = " +
                        second + " }\n}");
  };
  EXPECT_THAT(
      told(two("2")),
      ElementsAre("I.fdepl:9:35: error: instance 'x' of a.b.I has the SomeIpInstanceID 0x0002 here, but "
                  "0x0001 at I.fdepl:8:35: make them the same, or take one of them out"));
  EXPECT_THAT(told(two("1")), IsEmpty());
}

TEST(ReadFidl, ComputesConstantsOfEachType) {
  const Reading reading = read({{"K.fidl", R"(package p
    typeCollection T { version { major 1 minor 0 }
      const UInt8 N = 3 * (4 + 5) - 1
      const Double TWO_PI = 2 * 3.25d
      const Double MINUS = -TWO_PI / N
      const Boolean MORE = N > 3 && TWO_PI <= 6.5d
      const Boolean FIRST_AND = true || false && false
      const Boolean NONE = !(N == 26) || MORE != true
      const Boolean WRONG = N && true
      const Double INFINITE = 1.0d / 0.0d
      struct P { UInt8 x Double y }
      const P POINT = { x: 3, y: 1.5d }
      const UInt8 PART = POINT->x
      const P WITH_PART = { x: POINT->x, y: 1.5d }
    } )"}},
                               {"K.fidl"});
  std::map<std::string, std::string> constants;
  for (const Constant& one : reading.model.constants) {
    constants[one.name] = one.value;
  }
  EXPECT_EQ(constants, (std::map<std::string, std::string>{{"N", "26"},
                                                           {"TWO_PI", "6.5"},
                                                           {"MINUS", "-0.25"},
                                                           {"MORE", "true"},
                                                           {"FIRST_AND", "true"},
                                                           {"NONE", "false"},
                                                           {"POINT", "{\"x\": 3, \"y\": 1.5}"},
                                                           {"PART", "3"},
                                                           {"WITH_PART", "{\"x\": 3, \"y\": 1.5}"}}));
  EXPECT_THAT(
      told(reading),
      ElementsAre("K.fidl:9:31: warning: the value of the constant cannot be computed, and is left out",
                  "K.fidl:10:36: warning: the value of the constant cannot be computed, and is left out"));
}

TEST(ReadFidl, KeepsAtSignsWithinWordsOfAnnotations) {
  const Reading reading = read({{"K.fidl", R"(package p
    <** @author: Me <me@example.com>
        @description: Ask \@me. **>
    interface I { version { major 1 minor 0 } } )"}},
                               {"K.fidl"});
  const Notes& notes = reading.model.services.at(0).notes;
  EXPECT_EQ(notes.description, "Ask @me.");
  EXPECT_EQ(notes.others,
            (std::map<std::string, std::string, std::less<>>{{"@author", "Me <me@example.com>"}}));
}

TEST(ReadFidl, ReadsInheritanceConstantsAndContracts) {
  const Reading reading = read({{"K.fidl", R"(package p
    typeCollection T { version { major 1 minor 0 }
      struct A { UInt8 ^array } struct B extends A { String b }
      enumeration E { ONE = 1 } enumeration F extends E { TWO }
      map M { E to A }
      const Double PI = 3.14d  const Float S = -1.5e3f  const String TEXT = "a \"b\""  const Boolean YES = !false
      const A VALUE = { ^array : 7 }  const M LOOKUP = [ E.ONE => { ^array : 1 } ]
    }
    interface I { version { major 1 minor 0 } method m:one { } method m:two { in { UInt8 a } }
      contract { vars { UInt8 i } PSM { initial s state s { on call m -> s on respond m -> s } } } })"}},
                               {"K.fidl"});
  ASSERT_THAT(told(reading),
              ElementsAre("K.fidl:10:7: warning: contracts are skipped: no target has this one"));
  std::map<std::string, std::string> constants;
  for (const Constant& one : reading.model.constants) {
    constants[one.name] = one.value;
  }
  EXPECT_EQ(constants["PI"], "3.14");
  EXPECT_EQ(constants["S"], "-1.5e3");
  EXPECT_EQ(constants["TEXT"], "\"a \\\"b\\\"\"");
  EXPECT_EQ(constants["YES"], "true");
  EXPECT_EQ(constants["VALUE"], "{\"array\": 7}");
  EXPECT_EQ(constants["LOOKUP"], "[[1, {\"array\": 1}]]");
  EXPECT_THAT(reading.model.services.at(0).methods, SizeIs(2));
  for (const Type& type : reading.model.types) {
    if (type.name == "B") {
      EXPECT_THAT(all_members(reading.model, type), SizeIs(2));
    }
    if (type.name == "F") {
      EXPECT_EQ(type.enumerators.at(0).value, 2);
    }
  }
}

TEST(ReadFidl, ReadsWithAWarningWhatPeopleWrite) {
  const Reading reading =
      deployed("attribute UInt8 key", "attribute key { SomeIpGetterID = 1 }", v1,
               std::string{spec} +
                   "provider Service { instance a.b.I { InstanceId = \"x\" SomeIpInstanceID = 1 "
                   "SomeIpUnicastPort = 31000 SomeIpUnknownKey = 1 } }");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("I.fdepl:5:11: warning: 'key' is a keyword"),
                          HasSubstr("I.fdepl:7:60: warning: Franca wants 'provider as Service'"),
                          HasSubstr("SomeIpUnicastPort is in no version"),
                          HasSubstr("the key 'SomeIpUnknownKey' is not known")));
  EXPECT_EQ(reading.model.instances.at(0).udp_port, 31000);
  EXPECT_EQ(reading.model.instances.at(0).tcp_port, 31000);
}

TEST(ReadFidl, LeavesOutDeploymentsOfOthers) {
  const Reading reading = deployed(
      "attribute UInt8 a", "", v2,
      "define org.genivi.commonapi.dbus.deployment for interface a.b.I { DBusDefaultAttributeType = x }");
  EXPECT_THAT(told(reading), IsEmpty());
}

TEST(ReadFidl, NeedsNoSpecificationOfOtherProtocols) {
  for (const char* other : {"org.genivi.commonapi.dbus/deployment/CommonAPI-DBus_deployment.fdepl",
                            "org.genivi.commonapi.dbus/deployment/CommonAPI-DBus_deployment_spec.fdepl",
                            "com.example.other/deployment/Other_deployment.fdepl"}) {
    const Reading reading = deployed(
        "attribute String s", "", (std::string{v1} + "import \"platform:/plugin/" + other + "\"\n").c_str());
    EXPECT_THAT(told(reading), IsEmpty()) << other;
  }
}

TEST(ReadFidl, FindsFilesBelowTheFoldersOfTheirImporter) {
  const std::string types =
      "package q typeCollection T { version { major 1 minor 0 } typedef Speed is UInt16 }";
  for (const char* import : {"classpath:/org/T.fidl", "platform:/resource/project/org/T.fidl"}) {
    const std::string text = std::string{"package p import q.* from \""} + import +
                             "\" interface I { version { major 1 minor 0 } attribute T.Speed s }";
    const Reading reading =
        read({{"/idl/car/I.fidl", text}, {"/idl/org/T.fidl", types}}, {"/idl/car/I.fidl"});
    EXPECT_THAT(told(reading), IsEmpty()) << import;
    EXPECT_THAT(reading.model.files, ElementsAre("/idl/car/I.fidl", "/idl/org/T.fidl"));
  }
}

TEST(ReadFidl, TellsThatUndefinedIsNotCarried) {
  const Reading reading = deployed("typedef Any is undefined attribute Any a attribute UInt8 n", "");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("I.fidl:4:40: warning: 'a' uses the type 'undefined'")));
  EXPECT_THAT(reading.model.services.at(0).fields, SizeIs(2));
}

TEST(ReadFidl, TellsOnceThatIntegerIsInt32) {
  const Reading reading = deployed("attribute Integer a attribute Integer b attribute Integer(0, 9) c", "");
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("I.fidl:4:11: warning: Integer without limits is taken for Int32")));
  EXPECT_EQ(reading.model.at(only_value(reading).type).primitive, messages::Primitive::int32);
}

TEST(ReadFidl, TakesTextsOfEnumeratorsForNoNumbers) {
  const Reading reading = deployed("enumeration E { A = \"0x10\" B = \"x\" C } attribute E e", "");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("warning: the value of 'B' is a text and no number; 17 is taken")));
  const Type& type = reading.model.at(only_value(reading).type);
  EXPECT_EQ(type.enumerators.at(1).value, 17);
  EXPECT_EQ(type.enumerators.at(2).value, 18);
}

/// As it is used with another transport, or before anybody thought of one.
TEST(ReadFidl, TakesTheWidthThatEnumeratorsNeedWhereNothingIsDeployed) {
  const Reading reading = read({{"A.fidl",
                                 "package a typeCollection T { enumeration S { A B = 255 } "
                                 "enumeration M { A B = 256 } enumeration N { A = -40000 B } }"}},
                               {"A.fidl"});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("warning: 'M' has no SomeIpEnumWidth, and values that one "
                                                   "byte has no room for: 2 bytes are taken"),
                                         HasSubstr("4 bytes are taken")));
  std::map<std::string, std::size_t> widths;
  for (const Type& type : reading.model.types) {
    widths[type.name] = messages::width(type.primitive);
  }
  EXPECT_THAT(widths, ElementsAre(std::pair{"M", 2U}, std::pair{"N", 4U}, std::pair{"S", 1U}));
}

TEST(ReadFidl, TakesWidthsThatCannotBeWithAWarning) {
  const Reading reading = deployed("enumeration E { A B } attribute E e attribute Int16 n",
                                   "enumeration E { SomeIpEnumWidth = 0 SomeIpEnumBitWidth = 9 } "
                                   "attribute n { SomeIpIntegerBitWidth = 32 }");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre(
          HasSubstr("warning: SomeIpEnumWidth is 0; expected 1, 2, 4 or 8 bytes, of which 2 is taken"),
          HasSubstr("warning: Int16 has 16 bits, and not 32: it is read as a whole one")));
  EXPECT_EQ(reading.model.at(only_value(reading).type).primitive, messages::Primitive::uint16);
  EXPECT_EQ(only_value(reading).wire.bits, 9);
  EXPECT_EQ(reading.model.services[0].fields.at(1).payload.values[0].wire.bits, 0);
}

TEST(ReadFidl, RefusesSegmentsThatAreNoMultipleOf16Bytes) {
  const auto with = [](int bytes) {
    return deployed("broadcast b { out { UInt8 x } }",
                    fmt::format("broadcast b {{ SomeIpEventID = 32769 SomeIpEventGroups = {{ 1 }} "
                                "SomeIpBroadcastSegmentLength = {} }}",
                                bytes));
  };
  const auto error = [](int bytes, int likely) {
    return ElementsAre(
        testing::ContainsRegex(fmt::format("I.fdepl:[0-9]+:[0-9]+: error: SomeIpBroadcastSegmentLength is "
                                           "{}; expected a multiple of 16 bytes, as "
                                           "segments of SOME/IP-TP have it: {}",
                                           bytes, likely)));
  };
  EXPECT_THAT(told(with(17)), error(17, 16));
  EXPECT_THAT(told(with(7)), error(7, 16));
  EXPECT_THAT(told(with(1400)), error(1400, 1392));
  EXPECT_THAT(told(with(1392)), IsEmpty());
}

TEST(ReadFidl, LeavesOutMulticastGroupsOfNoEvents) {
  const Reading reading =
      deployed("", "", v2,
               std::string{spec} +
                   "provider as P { instance a.b.I { InstanceId = \"x\" SomeIpInstanceID = 1 "
                   "SomeIpMulticastAddresses = { \"224.1.2.3\" } SomeIpMulticastPorts = { 30500 } } }");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("warning: no SomeIpMulticastEventGroups tells")));
  EXPECT_THAT(reading.model.instances.at(0).multicast, IsEmpty());
}

TEST(ReadFidl, TellsMembersApartThatDifferInTheirArgumentsAlone) {
  const Reading reading = deployed(
      "method open { } method open { in { UInt8 speed } } broadcast moved { out { UInt8 x } } broadcast "
      "moved { }",
      "");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("this one is called open:overload2"),
                                         HasSubstr("this one is called moved:overload2")));
  const Service& service = reading.model.services.at(0);
  EXPECT_EQ(service.methods.at(0).selector, "");
  EXPECT_EQ(service.methods.at(1).selector, "overload2");
  EXPECT_EQ(service.events.at(1).selector, "overload2");
  const Reading by_result = deployed("method get { out { UInt8 a } } method get { out { String a } }", "");
  EXPECT_THAT(told(by_result), ElementsAre(HasSubstr("warning: the method 'get' is there twice")));
  EXPECT_EQ(by_result.model.services.at(0).methods.at(1).selector, "overload2");
  EXPECT_THAT(told(deployed("method open { in { UInt8 a } } method open { in { UInt8 b } }", "")),
              ElementsAre(HasSubstr("error: 'I' has the method 'open' twice")));
}

TEST(ReadFidl, TakesPolymorphicStructsButTellsThatNothingCarriesThem) {
  const Reading reading = deployed(
      "struct P polymorphic { } struct Q extends P { UInt8 x } attribute Q[] q attribute UInt8 n", "");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("I.fidl:4:71: warning: 'q' uses the polymorphic struct 'a.b.I.P'")));
  EXPECT_THAT(reading.model.services.at(0).fields, SizeIs(2));
}

/// The problems of an interface with these members and this deployment.
std::vector<std::string> problems(const std::string& members, const std::string& deployment,
                                  const std::string& more = "") {
  const Reading reading = deployed(members, deployment, v2, more);
  EXPECT_FALSE(reading.ok());
  return told(reading);
}

TEST(ReadFidl, TellsPlacesOfErrorsAndWhatWasExpected) {
  EXPECT_THAT(problems("attribute Uint8 a", ""),
              ElementsAre("I.fidl:4:11: error: the type 'Uint8' is not known here; did you mean 'UInt8'?"));
  EXPECT_THAT(problems("struct S { UInt8 x S[] more }", ""),
              ElementsAre(HasSubstr("I.fidl:4:8: error: the types form a cycle: 'S'")));
  EXPECT_THAT(problems("typedef A is B typedef B is A", ""),
              ElementsAre(HasSubstr("the types form a cycle")));
  EXPECT_THAT(problems("struct S extends T { } struct T extends S { }", ""),
              ElementsAre(HasSubstr("the types form a cycle")));
  EXPECT_THAT(problems("attribute UInt8[4] a", ""),
              ElementsAre(HasSubstr("I.fidl:4:17: error: there is '4'; expected ']'")));
  EXPECT_THAT(problems("attribute UInt8 a", "attribute b { }"),
              ElementsAre(HasSubstr("has no attribute 'b'")));
  EXPECT_THAT(problems("struct S { UInt8 a }", "struct S { b { } }"),
              ElementsAre(HasSubstr("I.fdepl:5:12: error: 'S' has no field 'b'")));
  EXPECT_THAT(problems("", "SomeIpServiceID = 5"),
              ElementsAre(HasSubstr(
                  "I.fdepl:5:1: error: SomeIpServiceID = 5 contradicts SomeIpServiceID = 4660 in line 4")));
  EXPECT_THAT(problems("method a { } method b { }",
                       "method a { SomeIpMethodID = 7 } method b { SomeIpMethodID = 7 }"),
              ElementsAre("I.fdepl:5:61: error: I.b has the id 0x0007 of I.a, at I.fdepl:5:29"));
  EXPECT_THAT(problems("method a { }", "method a { SomeIpMethodID = 0x12345 }"),
              ElementsAre(HasSubstr("expected a whole number from 0 to 65535")));
  EXPECT_THAT(problems("method a { }", "method a { SomeIpMethodID = true }"),
              ElementsAre(HasSubstr("SomeIpMethodID is 'true'")));
  EXPECT_THAT(problems("attribute String s", "attribute s { SomeIpStringEncoding = utf8be }"),
              ElementsAre(HasSubstr("expected one of utf8, utf16le, utf16be; did you mean")));
  EXPECT_THAT(problems("attribute String s", "attribute s { SomeIpStringLengthWidth = 3 }"),
              ElementsAre(HasSubstr("expected 0, 1, 2 or 4")));
  EXPECT_THAT(problems("attribute UInt8 a attribute UInt8 a", ""),
              ElementsAre(HasSubstr("has the attribute 'a' twice")));
  EXPECT_THAT(problems("struct S { UInt8 a } struct S { UInt8 b }", ""),
              ElementsAre(HasSubstr("'a.b.I.S' is declared twice, first in I.fidl:4")));
  EXPECT_THAT(problems("enumeration E { A = B B = A }", ""),
              ::testing::Contains(HasSubstr("cannot be computed")));
}

TEST(ReadFidl, FindsAnInheritedEnumeratorByTheNameOfTheDerived) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    enumeration E1 { A B C }
    enumeration E2 extends E1 { D = 10 }
    enumeration E3 extends E2 { F = C + 20 }
    const E1 c = E3.C
    const E2 d = E3.D
    const E3 f = E3.F
    const E1 none = E3.X
    const E1 no_type = c.C
    enumeration R1 extends R2 { } enumeration R2 extends R1 { } const R1 r = R1.A })"}},
                               {"A.fidl"});
  std::map<std::string, std::string> values;
  for (const Constant& one : reading.model.constants) {
    values[one.name] = one.value;
  }
  EXPECT_EQ(values["c"], "2");
  EXPECT_EQ(values["d"], "10");
  EXPECT_EQ(values["f"], "22");
  EXPECT_THAT(told(reading), AllOf(Contains(HasSubstr("'E3.X' is not known here")),
                                   Contains(HasSubstr("'c.C' is not known here")),
                                   Contains(HasSubstr("'R1.A' is not known here"))));
}

TEST(ReadFidl, ComputesWithPartsOfConstants) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    struct P { UInt8 e1 String e2 Boolean e3 Double e4 }
    struct Q { P p UInt8 e5 }
    const UInt16 x = 123
    const P p = { e1 : 5, e2 : "two", e3 : true, e4 : 0.5d }
    const Q q = { p : p, e5 : x }
    enumeration E { A = p->e1 + x B = q->p->e1 C = q->e5 }
    const String s = p->e2
    const Boolean b = !p->e3
    const Double d = q->p->e4 * 3
    const P copy = q->p
    const UInt8 none = p->e9 })"}},
                               {"A.fidl"});
  std::map<std::string, std::string> values;
  for (const Constant& one : reading.model.constants) {
    values[one.name] = one.value;
  }
  EXPECT_EQ(values["s"], "\"two\"");
  EXPECT_EQ(values["b"], "false");
  EXPECT_EQ(values["d"], "1.5");
  EXPECT_EQ(values["copy"], values["p"]);
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("warning: the value of the constant cannot be computed")));
  const auto is_e = [](const Type& one) { return one.kind == Kind::enumeration; };
  const auto e = std::ranges::find_if(reading.model.types, is_e);
  ASSERT_NE(e, reading.model.types.end());
  ASSERT_THAT(e->enumerators, SizeIs(3));
  EXPECT_EQ(e->enumerators[0].value, 128);
  EXPECT_EQ(e->enumerators[1].value, 5);
  EXPECT_EQ(e->enumerators[2].value, 123);
}

TEST(ReadFidl, EndsSoonWithPartsOfConstantsThatGoRound) {
  EXPECT_FALSE(told(read({{"A.fidl", R"(package a typeCollection T { struct P { UInt8 a P b }
    const P p = { a : p->a + p->b->a, b : { a : p->a, b : p->b } } })"}},
                         {"A.fidl"}))
                   .empty());
}

TEST(ReadFidl, TellsOfConstantsThatReferToEachOtherInACycle) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    const UInt8 a = b
    const UInt8 b = 1 + c
    const UInt8 c = -a
    const UInt8 own = own
    const UInt8 uses = a
    struct P { UInt8 x }
    array Ps of P
    const P p = { x: q->x }
    const P q = { x: 5 }
    const Ps list = [ p, q, r ]
    const P r = { x: last }
    const UInt8 last = 2 * last
    const Boolean no = !no || false
    const Double real = 1.5d * real
    const UInt8 good = 7 })"}},
                               {"A.fidl"});
  EXPECT_FALSE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre("A.fidl:4:22: error: the constants form a cycle: 'a' refers to itself, through 'b', 'c'",
                  "A.fidl:5:23: error: the constants form a cycle: 'own' refers to itself",
                  "A.fidl:13:28: error: the constants form a cycle: 'last' refers to itself",
                  "A.fidl:14:25: error: the constants form a cycle: 'no' refers to itself",
                  "A.fidl:15:32: error: the constants form a cycle: 'real' refers to itself"));
  std::vector<std::string> names;
  for (const Constant& one : reading.model.constants) {
    names.push_back(one.name);
  }
  EXPECT_THAT(names, ElementsAre("p", "q", "good"));
}

TEST(ReadFidl, TellsOfConstantsThatItLeavesOut) {
  std::string chain = "package p typeCollection T { const UInt64 c0 = 1\n";
  for (int i = 1; i <= 120; ++i) {
    chain += "const UInt64 c" + std::to_string(i) + " = c" + std::to_string(i - 1) + "\n";
  }
  const Reading reading = read({{"A.fidl", chain + "}"}}, {"A.fidl"});
  EXPECT_THAT(told(reading),
              Contains(HasSubstr("warning: the value of the constant is made of constants more "
                                 "than 100 deep, and is left out")));
}

/// Once for each specification, however often its keys are used.
TEST(ReadFidl, TellsOfKeysOfASpecificationOfTheFilesOwn) {
  const std::string own = std::string{v2} + R"(import "I.fidl"
specification my.base extends org.genivi.commonapi.someip.deployment {
  for attributes { Colour: Integer (default: 1); Unused: String; }
}
specification my.own extends my.base {
  for attributes { Shape: { ROUND, SQUARE } (optional); SomeIpGetterID: Integer; }
  for interfaces { Owner: String (optional); }
}
specification other.one { for attributes { Size: Integer; } }
define my.own for interface p.I { SomeIpServiceID = 5 Owner = "me"
  attribute a { SomeIpGetterID = 1 SomeIpSetterID = 2 Colour = 3 Shape = ROUND }
  attribute b { SomeIpGetterID = 3 SomeIpSetterID = 4 Colour = 4 Size = 5 } }
define other.one for interface p.J { attribute a { Size = 1 } }
define other.one for interface p.K { attribute a { Size = 2 } }
)";
  const Reading reading = read({{"I.fidl",
                                 "package p interface I { version { major 1 minor 0 } attribute UInt8 a "
                                 "noSubscriptions attribute UInt8 "
                                 "b noSubscriptions } interface J { version { major 1 minor 0 } attribute "
                                 "UInt8 a } interface K { version "
                                 "{ major 1 minor 0 } attribute UInt8 a }"},
                                {"I.fdepl", own}},
                               {"I.fdepl"});
  EXPECT_TRUE(reading.ok());
  EXPECT_EQ(reading.model.services.at(0).fields.at(1).setter, someip::MethodId{4});
  EXPECT_THAT(
      told(reading),
      ElementsAre(
          "I.fdepl:3:15: warning: of the keys that the specification 'my.base' declares, these are not "
          "known, and are left out where deployments have them: Colour",
          "I.fdepl:6:15: warning: of the keys that the specification 'my.own' declares, these are not "
          "known, and are left out where deployments have them: Owner, Shape",
          HasSubstr("I.fdepl:13:66: warning: the key 'Size' is not known, and is left out"),
          HasSubstr("I.fdepl:14:8: warning: deployments of 'other.one' are left out")));
}

TEST(ReadFidl, TellsAllErrorsOfAFileAtOnce) {
  EXPECT_THAT(problems("attribute UInt8\nstruct S { 7 }\nmethod m { in { x } }\nattribute Nothing n", ""),
              SizeIs(4));
}

TEST(ReadFidl, TellsOfImportsThatAreMissingOrGoRound) {
  const std::string import = "package p import model \"../y/J.fidl\"";
  const Reading reading = read({{"x/I.fidl", import}}, {"x/I.fidl"});
  EXPECT_TRUE(reading.ok()) << "nothing needs it";
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("x/I.fidl:1:11: warning: 'y/J.fidl' cannot be read: there is no "
                                    "such file")));
  EXPECT_THAT(
      told(read({{"x/I.fidl", import + " interface I { version { major 1 minor 0 } attribute J.T a }"}},
                {"x/I.fidl"})),
      ElementsAre(HasSubstr("warning: 'y/J.fidl' cannot be read"), HasSubstr("error: the type 'J.T'")));
  // What a deployment misses would be other bytes.
  EXPECT_THAT(told(read({{"I.fdepl", std::string{v2} + "import \"J.fdepl\""}}, {"I.fdepl"})),
              ElementsAre("I.fdepl:2:1: error: 'J.fdepl' cannot be read: there is no such file"));
  EXPECT_THAT(told(read({{"A.fidl", "package p import model \"B.fidl\""},
                         {"B.fidl", "package p import model \"A.fidl\""}},
                        {"A.fidl"})),
              ElementsAre(HasSubstr("B.fidl:1:11: warning: the imports form a cycle")));
}

TEST(ReadFidl, NamesAMissingImportInFull) {
  const std::string name = "/a/" + std::string(70, 'x') + "/J.fdepl";
  EXPECT_THAT(told(read({{"I.fdepl", std::string{v2} + "import \"" + name + "\""}}, {"I.fdepl"})),
              ElementsAre("I.fdepl:2:1: error: '" + name + "' cannot be read: there is no such file"));
}

TEST(ReadFidl, TellsOfInterfacesThatGoRound) {
  const Reading reading =
      read({{"A.fidl", "package p interface A extends B { } interface B extends A { }"}}, {"A.fidl"});
  EXPECT_FALSE(reading.ok());
  EXPECT_THAT(told(reading), ::testing::Contains(HasSubstr("the interfaces form a cycle")));
}

TEST(ReadFidl, EndsSoonWithWhatIsMadeToTakeLong) {
  std::string deep = "package p typeCollection T { const UInt8 c = ";
  deep += std::string(100'000, '(') + "1" + std::string(100'000, ')') + "}";
  EXPECT_FALSE(read({{"A.fidl", deep}}, {"A.fidl"}).ok());

  std::string chain = "package p typeCollection T { const UInt64 c0 = 1\n";
  for (int i = 1; i < 90; ++i) {
    chain += "const UInt64 c" + std::to_string(i) + " = c" + std::to_string(i - 1) + " * c" +
             std::to_string(i - 1) + "\n";
  }
  EXPECT_TRUE(read({{"A.fidl", chain + "}"}}, {"A.fidl"}).ok());

  std::string types = "package p typeCollection T { struct S0 { UInt8 a }\n";
  for (int i = 1; i < 3000; ++i) {
    types += "struct S" + std::to_string(i) + " { S" + std::to_string(i + 1) + " a S" +
             std::to_string(i + 1) + " b }\n";
  }
  EXPECT_FALSE(read({{"A.fidl", types + "struct S3000 { UInt8 a } }"}}, {"A.fidl"}).ok());

  std::string upwards = "package p typeCollection T { array A0 of UInt8\n";
  for (int i = 1; i < 30'000; ++i) {
    upwards += "array A" + std::to_string(i) + " of A" + std::to_string(i - 1) + "\n";
  }
  static_cast<void>(read({{"A.fidl", upwards + "} interface I { attribute T.A29999 a }"}}, {"A.fidl"}));

  std::string nodes =
      std::string{v2} + "import \"A.fidl\" define org.genivi.commonapi.someip.deployment for interface p.I {";
  for (int i = 0; i < 10'000; ++i) {
    nodes += "a b {";
  }
  EXPECT_FALSE(read({{"A.fidl", "package p interface I { }"}, {"A.fdepl", nodes}}, {"A.fdepl"}).ok());

  const Reading errors =
      read({{"A.fidl", "package p interface I { " + std::string(5000, '?') + "}"}}, {"A.fidl"});
  EXPECT_LE(errors.problems.size(), 100u);
}

/// Nothing else is said of the files, such as that an interface is missing.
TEST(ReadFidl, RefusesMoreThanItsLimits) {
  const Files files{
      {"A.fidl", "package p interface I { attribute UInt8 x attribute UInt8 y }"},
      {"B.fidl", "package q import p.* from \"A.fidl\" interface J extends p.I { }"},
      {"A.fdepl", std::string{v2} + "import \"A.fidl\"\n" + spec + "interface p.I { SomeIpServiceID = 1 }"}};
  const auto read_with = [&](std::vector<std::string> names, const FidlLimits& limits) {
    const Reading reading = read(files, std::move(names), limits);
    EXPECT_THAT(reading.model.services, IsEmpty());
    return told(reading);
  };
  EXPECT_THAT(read_with({"A.fdepl", "A.fidl"}, {.bytes = 230}),
              ElementsAre("A.fidl: error: 'A.fidl' has 61 bytes; expected at most 230, of all FIDL and FDEPL "
                          "files together"));
  EXPECT_THAT(read_with({"B.fidl"}, {.bytes = 100}),
              ElementsAre("B.fidl:1:11: error: 'A.fidl' has 61 bytes; expected at most 100, of all FIDL and "
                          "FDEPL files together"));
  EXPECT_THAT(read_with({"B.fidl"}, {.files = 1}),
              ElementsAre("B.fidl:1:11: error: 'A.fidl' is one file too many: at most 1 FIDL and FDEPL files "
                          "are read"));
  EXPECT_THAT(
      read_with({"A.fidl"}, {.tokens = 9}),
      Contains("A.fidl:1:53: error: there is too much in the FIDL and FDEPL files; expected at most 9 "
               "words, numbers and signs in all of them"));
  EXPECT_TRUE(read(files, {"A.fidl"}, {.files = 1, .bytes = 61, .tokens = 12}).ok());
}

TEST(ReadFidl, SaysOnceThatAFileIsUtf16) {
  for (const char* mark : {"\xff\xfe", "\xfe\xff"}) {
    const Reading reading =
        read({{"I.fidl", std::string{mark} + std::string{"p\0a\0\n\0c\0", 8}}}, {"I.fidl"});
    EXPECT_THAT(told(reading),
                ElementsAre("I.fidl:1:1: error: the file is UTF-16, and UTF-8 was expected: save it "
                            "as that"));
  }
}

}  // namespace
}  // namespace trestle::describe
