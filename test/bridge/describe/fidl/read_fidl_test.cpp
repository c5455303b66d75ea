#include <chrono>
#include <map>

#include "bridge/describe/join.hpp"
#include "test/bridge/describe/fidl/fidl_text.hpp"

namespace trestle::describe {
namespace {

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

TEST(ReadFidl, WarnsOfTheDeploymentOfWhatAnInterfaceInherits) {
  const Reading reading = read(
      {{"I.fidl",
        "package a interface A { version { major 1 minor 0 } method m {} broadcast e {} }\n"
        "interface B extends A { version { major 1 minor 0 } method own {} }"},
       {"B.fdepl", v2 + std::string{"import \"I.fidl\"\n"} + spec +
                       "interface a.B { SomeIpServiceID = 2\nmethod m { SomeIpReliable = true }\n"
                       "broadcast e { SomeIpEventGroups = { 1 } }\nmethod own { SomeIpMethodID = 7 } }"}},
      {"B.fdepl"});
  const std::string rest = ", which 'a.A' declares: Franca takes its deployment there alone; write it there";
  EXPECT_THAT(told(reading), ElementsAre("B.fdepl:4:1: warning: 'a.B' inherits the method 'm'" + rest,
                                         "B.fdepl:5:1: warning: 'a.B' inherits the broadcast 'e'" + rest));
  EXPECT_EQ(reading.model.services.at(1).methods.at(0).request_transfer.transport, Transport::tcp);
}

TEST(ReadFidl, LeavesOutKeysThatCommonApiDoesNotHave) {
  const Reading reading =
      deployed("attribute M m\nmap M { UInt8 to UInt8 }", "map M { SomeIpMapLengthWidth = 1 }");
  EXPECT_THAT(told(reading), Contains(HasSubstr("'SomeIpMapLengthWidth' is not known, and is left out")));
  EXPECT_EQ(only_value(reading).wire.length, someip::FieldWidth::bits32);
}

// Arrays, structs and others have such keys for their users, and strings have none.
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

}  // namespace
}  // namespace trestle::describe
