#include <fmt/format.h>

#include <map>

#include "test/bridge/describe/fidl/fidl_text.hpp"

namespace trestle::describe {
namespace {

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

TEST(ReadFidl, WarnsOfWhatFrancaRefuses) {
  const Reading reading =
      deployed("enumeration Empty { }\nmethod m { in { UInt8 a } out { UInt8 a UInt8 b } }",
               "method m { SomeIpMethodID = 7 }");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre("I.fidl:4:13: warning: an enumeration without enumerators: Franca refuses it",
                  "I.fidl:5:39: warning: the argument 'a' is in 'in', too: Franca refuses one name in "
                  "both"));
}

TEST(ReadFidl, TakesCopiesOfAFileOnce) {
  const std::string door = "package a\ninterface Door {\nversion { major 1 minor 0 }\n}\n";
  const std::string fdepl =
      std::string{v2} + "import \"Door.fidl\"\n" + spec + "interface a.Door { SomeIpServiceID = 7 }\n";
  const Files files{{"x/Door.fidl", door},
                    {"y/Door.fidl", door},
                    {"y/Door.fdepl", fdepl},
                    {"z/Door.fidl", door + "// Not a copy.\n"}};
  const Reading reading = read(files, {"x/Door.fidl", "y/Door.fidl", "y/Door.fdepl"});
  EXPECT_THAT(told(reading),
              ElementsAre("x/Door.fidl: warning: 'y/Door.fidl' has the same text, and is left out"));
  ASSERT_EQ(reading.model.services.size(), 1U);
  EXPECT_EQ(reading.model.services[0].id, someip::ServiceId{7});
  // Also one that is imported.
  EXPECT_THAT(told(read(files, {"x/Door.fidl", "y/Door.fdepl"})),
              ElementsAre("x/Door.fidl: warning: 'y/Door.fidl' has the same text, and is left out"));
  EXPECT_THAT(told(read(files, {"x/Door.fidl", "z/Door.fidl"})),
              ::testing::Contains(HasSubstr("'a.Door' is declared twice")));
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
