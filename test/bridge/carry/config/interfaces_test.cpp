#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "bridge/carry/config/load.hpp"
#include "bridge/carry/config/load_interfaces.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::test::interfaces_test {
namespace {

using namespace carry;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* door_fidl = R"(
package car
interface Door {
  version { major 2 minor 3 }
  attribute UInt8 angle
  method open { in { Mode mode UInt16 speed } out { Boolean done } }
  method ring fireAndForget { in { String tune } }
  broadcast moved { out { UInt8 angle } }
  enumeration Mode { SLOW FAST }
}
)";
constexpr const char* door_fdepl = R"(
import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Door.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Door {
  SomeIpServiceID = 0x1234
  SomeIpEventGroups = { 5 }
  attribute angle { SomeIpGetterID = 1 SomeIpSetterID = 2 SomeIpNotifierID = 0x8001 SomeIpNotifierEventGroups = { 5 } }
  method open { SomeIpMethodID = 3 SomeIpReliable = true }
  method ring { SomeIpMethodID = 4 in { tune { SomeIpStringLengthWidth = 1 } } }
  broadcast moved { SomeIpEventID = 0x8002 SomeIpEventGroups = { 5 } }
}
define org.genivi.commonapi.someip.deployment for provider as P {
  instance car.Door { InstanceId = "car.Door" SomeIpInstanceID = 7 }
}
)";

class InterfacesTest : public testing::Test {
 protected:
  InterfacesTest() {
    std::filesystem::create_directories(folder_);
    write("Door.fidl", door_fidl);
    write("Door.fdepl", door_fdepl);
  }
  ~InterfacesTest() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }
  [[nodiscard]] tl::expected<Loaded, std::vector<documents::Problem>> load(const std::string& text) const {
    return parse_config("someip: {address: 127.0.0.1}\n" + text, (folder_ / "bridge.yaml").string());
  }
  [[nodiscard]] Loaded good(const std::string& text) const {
    auto loaded = load(text);
    if (!loaded) {
      ADD_FAILURE() << to_string(loaded.error().front());
      return {};
    }
    return std::move(*loaded);
  }
  /// The texts of the errors.
  [[nodiscard]] std::string errors(const std::string& text) const {
    const auto loaded = load(text);
    std::string all;
    if (!loaded) {
      for (const documents::Problem& problem : loaded.error()) {
        all += to_string(problem) + "\n";
      }
    }
    return all;
  }

  const std::filesystem::path folder_ = testing::TempDir() + "interfaces_test_" + std::to_string(getpid());
};

TEST_F(InterfacesTest, MakeARouteForEverything) {
  const Loaded loaded = good("interfaces: [Door.fidl, Door.fdepl]\ngenerate: all\n");
  EXPECT_THAT(loaded.warnings, IsEmpty());
  const BridgeConfig& config = loaded.config;
  ASSERT_THAT(config.routes, SizeIs(2));
  const Route& moved = config.routes[0];
  EXPECT_EQ(moved.topic, "/door/moved");
  EXPECT_EQ(moved.direction, Direction::someip_to_dds);
  EXPECT_EQ(moved.service, someip::ServiceId{0x1234});
  EXPECT_EQ(moved.instance, someip::InstanceId{7});
  EXPECT_EQ(moved.eventgroup, someip::EventgroupId{5});
  EXPECT_EQ(moved.event, someip::MethodId{0x8002});
  EXPECT_EQ(moved.major, 2);
  EXPECT_EQ(config.routes[1].topic, "/door/angle");
  ASSERT_THAT(config.methods, SizeIs(4));  // open, ring, and the field's getter and setter
  EXPECT_EQ(config.methods[0].ros_service, "/door/open");
  EXPECT_EQ(config.methods[0].transport, Transport::tcp);
  EXPECT_EQ(config.methods[0].server, Server::someip);
  EXPECT_TRUE(config.methods[1].fire_and_forget);
  // Types are those of the interface, and can be carried.
  messages::TypeLibrary types = messages::TypeLibrary::in(config.types);
  EXPECT_TRUE(types.resolve(moved.type)) << moved.type;
  EXPECT_TRUE(types.resolve_service(config.methods[0].type)) << config.methods[0].type;
}

TEST_F(InterfacesTest, GiveTheIdsOfRoutesTheirNames) {
  const Loaded loaded = good("interfaces: [Door.fidl, Door.fdepl]\nroutes: [{someip: Door.moved}]\n");
  const auto names_of = [&](std::uint16_t service, std::uint32_t major, std::uint16_t member) {
    RoutePicture route;
    route.service = service;
    route.major = major;
    route.member = member;
    route.eventgroup = 5;
    loaded.names.name(route);
    return route.service_name + " " + route.member_name + " (" + route.eventgroup_name + ")";
  };
  EXPECT_EQ(names_of(0x1234, 2, 0x8002), "Door moved (moved, angle)");
  EXPECT_EQ(names_of(0x1234, 2, 0x8001), "Door angle.notify (moved, angle)");
  EXPECT_EQ(names_of(0x1234, 2, 1), "Door angle.get (moved, angle)");
  EXPECT_EQ(names_of(0x1234, 2, 3), "Door open (moved, angle)");
  EXPECT_EQ(names_of(0x1234, 2, 0x8009), "Door  (moved, angle)") << "a member that nobody describes";
  EXPECT_EQ(names_of(0x1234, 1, 0x8002), "  ()") << "another version";
  EXPECT_EQ(names_of(0x1235, 2, 0x8002), "  ()");
}

TEST_F(InterfacesTest, MakeAnActionOfAnAction) {
  std::filesystem::create_directories(folder_ / "car" / "action");
  write("car/action/Spin.action", "int32 order\n---\nint32[] sequence\n---\nint32[] partial\n");
  const Loaded loaded = good("interfaces: [car/action/Spin.action]\ngenerate: all\n");
  const BridgeConfig& config = loaded.config;
  ASSERT_THAT(config.routes, SizeIs(2));
  EXPECT_EQ(config.routes[0].topic, "/spin/_action/feedback");
  ASSERT_THAT(config.methods, SizeIs(3));
  EXPECT_EQ(config.methods[0].ros_service, "/spin/_action/send_goal");
  messages::TypeLibrary types = messages::TypeLibrary::in(config.types);
  EXPECT_TRUE(types.resolve(config.routes[0].type)) << config.routes[0].type;
  EXPECT_TRUE(types.resolve_service(config.methods[0].type)) << config.methods[0].type;
  // Of other bridges, too: that is a key of each entry.
  const Loaded from = good("interfaces: [car/action/Spin.action]\ngenerate: {from_bridges: [10.0.0.9]}\n");
  EXPECT_THAT(from.config.routes.at(0).from_bridges, SizeIs(1));
  EXPECT_THAT(
      errors("interfaces: [car/action/Spin.action]\nroutes: [{someip: SpinService.feedback}]\n"),
      HasSubstr("'SpinService.feedback' is a part of an action, which `generate` carries as a whole"));
}

TEST_F(InterfacesTest, NameWhatARouteCarries) {
  const Loaded loaded = good(
      "interfaces: [Door.fidl, Door.fdepl]\n"
      "routes: [{someip: Door.moved, topic: /here, direction: someip_to_dds, port: 40000}]\n"
      "methods: [{someip: car.Door.open, ros_service: /go, server: someip}]\n"
      "fields: [{someip: Door.angle, server: someip, topic: /how_far}]\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_EQ(loaded.config.routes[0].topic, "/here");
  EXPECT_EQ(loaded.config.routes[0].port, 40000);
  EXPECT_EQ(loaded.config.routes[0].event, someip::MethodId{0x8002});
  ASSERT_THAT(loaded.config.methods, SizeIs(3));
  EXPECT_EQ(loaded.config.methods[0].ros_service, "/go");
  EXPECT_EQ(loaded.config.methods[1].ros_service, "/how_far/get");
}

TEST_F(InterfacesTest, AreOfferedByTheBridgeWhereItIsToldTo) {
  const Loaded loaded =
      good("interfaces: [Door.fidl, Door.fdepl]\ngenerate: {services: [Door], side: server, prefix: /car}\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_EQ(loaded.config.routes[0].topic, "/car/door/moved");
  EXPECT_EQ(loaded.config.routes[0].direction, Direction::dds_to_someip);
  EXPECT_NE(loaded.config.routes[0].port, 0);
}

TEST_F(InterfacesTest, AreOfferedWithWhatOtherBridgesBring) {
  const std::string file = "interfaces: [Door.fidl, Door.fdepl]\n";
  const Loaded loaded = good(file +
                             "generate: {side: server, from_bridges: [10.0.0.1, 10.0.0.5]}\n"
                             "routes: [{someip: Door.moved, direction: dds_to_someip}]\n");
  const std::vector both{IpAddress::v4(10, 0, 0, 1), IpAddress::v4(10, 0, 0, 5)};
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_THAT(loaded.config.routes[0].from_bridges,
              IsEmpty());                                 // an entry of the file, which has its own keys
  EXPECT_EQ(loaded.config.routes[1].from_bridges, both);  // the field
  ASSERT_THAT(loaded.config.methods, SizeIs(3));          // open, ring, and the setter
  for (const MethodRoute& method : loaded.config.methods) {
    EXPECT_EQ(method.from_bridges, both);
  }
  EXPECT_THAT(errors(file + "generate: {from_bridges: [10.0.0.1]}\n"),
              HasSubstr("bridge.yaml:3:26: error: from_bridges: is for what the bridge offers"));
  EXPECT_THAT(errors(file + "generate: {side: server, from_bridges: [nobody]}\n"), HasSubstr("'nobody'"));
  EXPECT_THAT(
      errors(file + "generate: {side: server, from_bridges: [1.0.0.1, 1.0.0.2, 1.0.0.3, 1.0.0.4, 1.0.0.5, "
                    "1.0.0.6, 1.0.0.7, 1.0.0.8, 1.0.0.9]}\n"),
      HasSubstr("has room for 8 addresses"));
}

TEST_F(InterfacesTest, AreOfferedAtOnePort) {
  std::string text = door_fdepl;
  text.replace(text.find("SomeIpInstanceID = 7"), 20,
               "SomeIpInstanceID = 7 SomeIpUnreliableUnicastPort = 30509 SomeIpReliableUnicastPort = 30510");
  write("Door.fdepl", text);
  const Loaded loaded = good("interfaces: [Door.fidl, Door.fdepl]\ngenerate: {side: server}\n");
  EXPECT_EQ(loaded.config.routes.at(0).port, 30509);
  EXPECT_EQ(loaded.config.methods.at(0).transport, Transport::tcp);
  EXPECT_EQ(loaded.config.methods.at(0).port, 30509);
  ASSERT_FALSE(loaded.warnings.empty());
  EXPECT_THAT(loaded.warnings.front().text, HasSubstr("its TCP port"));
}

TEST_F(InterfacesTest, NeedTheFullNameWhereTwoHaveOne) {
  write("Other.fidl", "package house interface Door { version { major 1 minor 0 } broadcast moved { } }");
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl, Other.fidl]\n";
  EXPECT_THAT(errors(begin + "routes: [{someip: Door.moved, direction: someip_to_dds}]\n"),
              HasSubstr("someip: there are car.Door and house.Door: write the full name"));
  const Loaded loaded = good(begin + "generate: {services: [car.Door]}\n");
  for (const Route& route : loaded.config.routes) {
    EXPECT_EQ(route.service, someip::ServiceId{0x1234});
  }
}

TEST_F(InterfacesTest, LeaveAListThatIsNoneToItsLoader) {
  EXPECT_THAT(errors("interfaces: [Door.fidl, Door.fdepl]\ngenerate: all\nroutes: 5\n"),
              HasSubstr("bridge.yaml:4:"));
}

TEST_F(InterfacesTest, SayWhereTheyAreWrong) {
  write("Door.fidl", "package car\ninterface Door {\n  attribute Unknown x\n}\n");
  const std::string text = errors("interfaces: [Door.fidl]\ngenerate: all\n");
  EXPECT_THAT(text, HasSubstr("bridge.yaml:2:13: error: interfaces: are not good"));
  EXPECT_THAT(text, HasSubstr("Door.fidl:3:13: error:"));
}

TEST_F(InterfacesTest, SayWhatIsWrongWithEachFileAtOnce) {
  write("Bad.fidl", "package car\ninterface Bad {\n  attribute Unknown x\n}\n");
  write("Cut.arxml", "<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\"><AR-PACKAGES>");
  const std::string text = errors("interfaces: [Bad.fidl, Cut.arxml, none.arxml]\ngenerate: all\n");
  EXPECT_THAT(text,
              HasSubstr("none.arxml' cannot be read: No such file or directory; names are taken from the "
                        "folder of this file"));
  EXPECT_THAT(text, HasSubstr("bridge.yaml:2:35: error: interfaces: '"));
  EXPECT_THAT(text, HasSubstr("Bad.fidl:3:13: error:"));
  EXPECT_THAT(text, HasSubstr("Cut.arxml:1:"));
}

TEST_F(InterfacesTest, SayOnlyThatADirectionIsWrong) {
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl]\n";
  EXPECT_THAT(errors(begin + "routes: [{someip: Door.moved, direction: to_dds}]\n"),
              testing::AllOf(HasSubstr("direction: expected one of"), testing::Not(HasSubstr("minor"))));
  EXPECT_THAT(errors(begin + "methods: [{someip: Door.open, server: dds}]\n"),
              testing::AllOf(HasSubstr("server: expected one of"), testing::Not(HasSubstr("minor"))));
}

TEST_F(InterfacesTest, NameAMissingFileInFull) {
  const std::string name = std::string(70, 'x') + ".fidl";
  EXPECT_THAT(errors("interfaces: [" + name + "]\ngenerate: all\n"),
              HasSubstr(name + "' cannot be read: No such file or directory"));
}

TEST_F(InterfacesTest, SayWhatTheyDoNotHave) {
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl]\n";
  EXPECT_THAT(
      errors(begin + "routes: [{someip: Door.mved, direction: someip_to_dds}]\n"),
      HasSubstr(
          "bridge.yaml:3:19: error: someip: the interfaces have no 'Door.mved'; did you mean 'Door.moved'?"));
  EXPECT_THAT(errors(begin + "routes: [{someip: Door.open}]\n"),
              HasSubstr("'Door.open' belongs into methods"));
  EXPECT_THAT(errors(begin + "generate: {services: [Window]}\n"),
              HasSubstr("the interfaces have no service 'Window'"));
  EXPECT_THAT(errors("generate: all\n"), HasSubstr("generate: needs `interfaces`"));
  EXPECT_THAT(errors("interfaces: [None.fidl]\ngenerate: all\n"), HasSubstr("None.fidl"));
  EXPECT_THAT(errors("interfaces: Door.fidl\ngenerate: all\n"), HasSubstr("expected a list of files"));
}

TEST_F(InterfacesTest, SayOnceWhatANameGotWrong) {
  const auto count = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl]\n";
  // Not what the name would have stood for: topic, type and so on.
  for (const std::string list :
       {"routes: [{someip: Door.mved}]\n", "routes: [{someip: Door.open}]\n",
        "fields: [{someip: Door.moved}]\n", "methods: [{someip: Door.opn}, {someip: Door.ring}]\n"}) {
    const std::string text = errors(begin + list);
    EXPECT_EQ(count(text), 1) << text;
    EXPECT_THAT(text, HasSubstr("error: someip: "));
  }
  const std::string unused = errors(begin);
  EXPECT_EQ(count(unused), 1) << unused;
  EXPECT_THAT(unused,
              HasSubstr("bridge.yaml:2:13: error: interfaces: nothing uses them: expected `generate: all`"));
  const std::string service = errors(begin + "generate: {services: [Dor]}\n");
  EXPECT_EQ(count(service), 1) << service;
  EXPECT_THAT(service, HasSubstr("generate: the interfaces have no service 'Dor'; did you mean 'Door'?"));
}

TEST_F(InterfacesTest, NameTheRouteThatATypeIsWrongFor) {
  const TypeCheck check = [](const TypeUse&, const messages::MessageRules&, const messages::TypePlaces&) {
    return TypeVerdict{.fault = {}, .warning = "is long"};
  };
  const auto loaded = parse_config(
      "someip: {address: 127.0.0.1}\ninterfaces: [Door.fidl, Door.fdepl]\ngenerate: all\n"
      "methods: [{someip: Door.open}]\n",
      (folder_ / "bridge.yaml").string(), check);
  ASSERT_TRUE(loaded);
  std::vector<std::string> texts;
  for (const documents::Problem& problem : loaded->warnings) {
    texts.push_back(problem.text);
  }
  EXPECT_THAT(texts, testing::Contains("type of /door/ring: is long"));
  EXPECT_THAT(texts, testing::Contains("type: is long")) << "it has a place of its own";
}

TEST_F(InterfacesTest, CarryAFieldAsAnEventWhereItIsNamedInRoutes) {
  const Loaded loaded = good(
      "interfaces: [Door.fidl, Door.fdepl]\n"
      "routes: [{someip: Door.angle, topic: /how_far}]\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(1));
  EXPECT_EQ(loaded.config.routes[0].direction, Direction::someip_to_dds);
  EXPECT_EQ(loaded.config.routes[0].event, someip::MethodId{0x8001});
  EXPECT_THAT(loaded.config.methods, IsEmpty());
}

TEST_F(InterfacesTest, TakeTheNamesThatToolsTake) {
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl]\n";
  const Loaded loaded = good(begin +
                             "routes: [{someip: Door.0x0007.moved}, {someip: car.Door.7.angle.notify}]\n"
                             "methods: [{someip: Door.*.open}]\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_EQ(loaded.config.routes[0].instance, someip::InstanceId{7});
  EXPECT_EQ(loaded.config.routes[1].event, someip::MethodId{0x8001});
  EXPECT_THAT(loaded.config.methods, SizeIs(1));
  EXPECT_THAT(errors(begin + "routes: [{someip: Door.0x0008.moved}]\n"), HasSubstr("has no such instance"));
  EXPECT_THAT(errors(begin + "routes: [{someip: Door.7.moved, instance: 8}]\n"),
              HasSubstr("someip: it names the instance 0x0007, and `instance` another one"));
  EXPECT_THAT(errors(begin + "fields: [{someip: Door.angle.get}]\n"), HasSubstr("no 'Door.angle.get'"));
}

TEST_F(InterfacesTest, TellOverloadedMethodsApart) {
  write("Two.fidl",
        "package two interface Lamp { version { major 1 minor 0 }\n"
        "method dim { in { UInt8 a } } method dim:fast { in { UInt16 b } } broadcast burnt:once { out { "
        "UInt8 c } } }");
  const Loaded loaded = good(
      "interfaces: [Two.fidl]\ngenerate: all\nmethods: [{someip: 'Lamp.dim:fast', ros_service: /fast}]\n"
      "routes: [{someip: Lamp.burnt}]\n");  // the only one of this name
  ASSERT_THAT(loaded.config.methods, SizeIs(2));
  EXPECT_EQ(loaded.config.methods[0].ros_service, "/fast");
  EXPECT_EQ(loaded.config.methods[0].method, someip::MethodId{2});
  EXPECT_EQ(loaded.config.methods[1].method, someip::MethodId{1});
  EXPECT_THAT(loaded.config.routes, SizeIs(1));
}

TEST_F(InterfacesTest, TakeTheEntryOfTheFileBeforeAGeneratedOne) {
  const Loaded loaded = good(
      "interfaces: [Door.fidl, Door.fdepl]\ngenerate: all\n"
      "routes: [{someip: Door.moved, topic: /here}, {someip: Door.angle, topic: /how_far}]\n"
      "methods: [{someip: Door.open, ros_service: /go}]\n");
  EXPECT_THAT(loaded.warnings, IsEmpty());
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_EQ(loaded.config.routes[0].topic, "/here");
  EXPECT_EQ(loaded.config.routes[1].topic, "/how_far");
  std::vector<std::string> services;
  for (const MethodRoute& method : loaded.config.methods) {
    services.push_back(method.ros_service);
  }
  EXPECT_THAT(services,
              testing::UnorderedElementsAre("/go", "/door/ring", "/door/angle/get", "/door/angle/set"));
}

TEST_F(InterfacesTest, FindAMemberAmongThoseOfTheList) {
  std::string fidl = door_fidl;
  fidl.replace(fidl.find("method ring"), 11, "method moved");
  std::string fdepl = door_fdepl;
  fdepl.replace(fdepl.find("method ring"), 11, "method moved");
  write("Door.fidl", fidl);
  write("Door.fdepl", fdepl);
  const Loaded loaded = good(
      "interfaces: [Door.fidl, Door.fdepl]\n"
      "routes: [{someip: Door.moved}]\nmethods: [{someip: Door.moved}]\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(1));
  EXPECT_EQ(loaded.config.routes[0].event, someip::MethodId{0x8002});
  ASSERT_THAT(loaded.config.methods, SizeIs(1));
  EXPECT_EQ(loaded.config.methods[0].method, someip::MethodId{4});
}

TEST_F(InterfacesTest, NameTopicsOfTwoServicesOfOneNameApart) {
  write("Other.fidl", "package house interface Door { version { major 1 minor 0 } broadcast moved { } }");
  const Loaded loaded = good("interfaces: [Door.fidl, Door.fdepl, Other.fidl]\ngenerate: all\n");
  std::vector<std::string> topics;
  for (const Route& route : loaded.config.routes) {
    topics.push_back(route.topic);
  }
  EXPECT_THAT(topics,
              testing::UnorderedElementsAre("/car/door/moved", "/car/door/angle", "/house/door/moved"));
}

TEST_F(InterfacesTest, TellWhereAnEntryWasAskedForThatIsWrong) {
  const std::string begin = "interfaces: [Door.fidl, Door.fdepl]\n";
  // No topic may have a space in it.
  const std::string generated = errors(begin + "generate: {prefix: \"/a b\"}\n");
  EXPECT_THAT(generated, HasSubstr("bridge.yaml:3:11: error: topic:"));
  EXPECT_THAT(generated, testing::Not(HasSubstr("bridge.yaml: error")));
  // The same event twice: what is told is where the second `someip` is, and the line of the first.
  const std::string twice = errors(begin +
                                   "routes:\n"
                                   "  - {someip: Door.moved, topic: /here}\n"
                                   "  - {someip: Door.moved, topic: /there}\n");
  EXPECT_THAT(twice, HasSubstr("bridge.yaml:5:"));
  EXPECT_THAT(twice, HasSubstr("line 4"));
}

TEST_F(InterfacesTest, ChooseIdsThatAreMissing) {
  const std::string forgotten = (folder_ / "Door.fdepl").string();
  const auto warning = [&] {
    const Loaded loaded = good("interfaces: [Door.fidl]\ngenerate: all\n");
    EXPECT_THAT(loaded.config.routes, SizeIs(2));
    EXPECT_EQ(loaded.config.routes.front().instance, someip::InstanceId{1});
    return loaded.warnings.empty() ? std::string{} : loaded.warnings.front().text;
  };
  EXPECT_THAT(warning(), HasSubstr("ids are missing, of 'car.Door'"));
  EXPECT_THAT(warning(), HasSubstr("Add " + forgotten + ", which was not given"));
  std::filesystem::remove(forgotten);
  EXPECT_THAT(warning(), HasSubstr("Add the file that has them, such as a FDEPL"));
}

TEST_F(InterfacesTest, TakeIdsThatAreKeptBesideThem) {
  write("ids.lock", "services:\n  - {name: car.Door, id: 0x5555}\n");
  const Loaded loaded = good("interfaces: [Door.fidl]\ngenerate: all\n");
  ASSERT_THAT(loaded.warnings, SizeIs(testing::Ge(2U)));
  EXPECT_THAT(loaded.warnings[0].text,
              HasSubstr("ids are missing, of 'car.Door' and maybe others: those of " +
                        (folder_ / "ids.lock").string() + " are used, which Trestle has chosen"));
  EXPECT_THAT(loaded.warnings[1].text, HasSubstr("they were chosen"));  // those of its members
  ASSERT_THAT(loaded.config.routes, SizeIs(2));
  EXPECT_EQ(loaded.config.routes[0].service, someip::ServiceId{0x5555});
  RoutePicture route;
  route.service = 0x5555;
  route.major = loaded.config.routes[0].major;
  route.member = someip::value(loaded.config.routes[0].event);
  route.eventgroup = someip::value(loaded.config.routes[0].eventgroup);
  loaded.names.name(route);
  EXPECT_TRUE(route.service_id_is_chosen);
  EXPECT_TRUE(route.member_id_is_chosen);
  EXPECT_TRUE(route.eventgroup_id_is_chosen);
  // Where all are given, nothing is to be said.
  const Loaded given = good("interfaces: [Door.fidl, Door.fdepl]\ngenerate: all\n");
  EXPECT_THAT(given.warnings, IsEmpty());
  route.service = 0x1234;
  route.member = 0x8002;
  route.eventgroup = 5;
  given.names.name(route);
  EXPECT_EQ(route.service_name, "Door");
  EXPECT_EQ(route.member_name, "moved");
  EXPECT_FALSE(route.service_id_is_chosen);
  EXPECT_FALSE(route.member_id_is_chosen);
  EXPECT_FALSE(route.eventgroup_id_is_chosen);
  // What is wrong with it has its place.
  write("ids.lock", "services:\n  - {name: car.Door, id: 0x5555}\n  - {name: car.Lamp, id: 0x5555}\n");
  EXPECT_THAT(errors("interfaces: [Door.fidl]\ngenerate: all\n"),
              HasSubstr("ids.lock:3:26: error: id: 0x5555 of car.Lamp is that of car.Door in line 2"));
}

TEST_F(InterfacesTest, LeaveOutWhatOnlyOthersExtend) {
  write("Base.fidl",
        "package car\ninterface Base { version { major 1 minor 0 } broadcast hot { out { UInt8 x } } }\n"
        "interface Heir extends Base { version { major 1 minor 0 } }\n");
  std::string deployed = door_fdepl;
  deployed = deployed.substr(0, deployed.find("import \"Door.fidl\"")) + R"(import "Base.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Base {
  broadcast hot { SomeIpEventID = 0x8001 SomeIpEventGroups = { 1 } }
}
define org.genivi.commonapi.someip.deployment for interface car.Heir { SomeIpServiceID = 0x1111 }
define org.genivi.commonapi.someip.deployment for provider as P {
  instance car.Heir { InstanceId = "car.Heir" SomeIpInstanceID = 1 }
}
)";
  write("Base.fdepl", deployed);
  const Loaded loaded = good("interfaces: [Base.fidl, Base.fdepl]\ngenerate: all\n");
  ASSERT_THAT(loaded.config.routes, SizeIs(1));
  EXPECT_EQ(loaded.config.routes[0].topic, "/heir/hot");
  ASSERT_THAT(loaded.warnings, SizeIs(1));
  EXPECT_THAT(loaded.warnings[0].text,
              HasSubstr("not carried: Base: it has no id and no instance, and others extend it"));
}

TEST_F(InterfacesTest, WarnsOfAPackageThatHidesOneOfRos) {
  write("Lamp.fidl",
        "package std_msgs\ninterface Lamp {\nversion { major 1 minor 0 }\nbroadcast lit { out { UInt8 level "
        "} } }\n");
  write("Lamp.fdepl", R"(
import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Lamp.fidl"
define org.genivi.commonapi.someip.deployment for interface std_msgs.Lamp {
  SomeIpServiceID = 0x1235
  broadcast lit { SomeIpEventID = 0x8002 SomeIpEventGroups = { 5 } }
}
define org.genivi.commonapi.someip.deployment for provider as P {
  instance std_msgs.Lamp { InstanceId = "std_msgs.Lamp" SomeIpInstanceID = 7 }
}
)");
  const Loaded loaded = good("interfaces: [Lamp.fidl, Lamp.fdepl]\ngenerate: all\n");
  ASSERT_THAT(loaded.warnings, SizeIs(1));
  EXPECT_THAT(loaded.warnings.front().text,
              HasSubstr("their package 'std_msgs' has the name of one of ROS 2"));
}

TEST_F(InterfacesTest, AreTriedBeforeAConfigurationNamesThem) {
  /// The configuration for a file, or what is wrong with it.
  const auto told = [&](const std::string& name) {
    const std::string file = (folder_ / name).string();
    EXPECT_TRUE(is_description(file)) << name;
    const auto text = configuration_for({file});
    std::string all = text.value_or(std::string{});
    for (const documents::Problem& one : text ? std::vector<documents::Problem>{} : text.error()) {
      all += to_string(one).substr(folder_.string().size() + 1) + "\n";
    }
    return all;
  };
  EXPECT_THAT(told("Door.fidl"), HasSubstr("\ninterfaces: [" + (folder_ / "Door.fidl").string() + ", " +
                                           (folder_ / "Door.fdepl").string() + "]\ngenerate: all\n"));
  write("Bad.fidl", "package car\ninterface Bad {\n  attribute Bolean locked\n}\n");
  EXPECT_THAT(told("Bad.fidl"), testing::StartsWith("Bad.fidl:3:13: error: "));
  write("Empty.fidl", "package car\n");
  EXPECT_EQ(told("Empty.fidl"),
            "Empty.fidl: error: is an interface description with nothing that a bridge can carry\n");
  write("Poly.fidl",
        "package car\ninterface Poly {\n  version { major 1 minor 0 }\n  struct S polymorphic { UInt8 a }\n"
        "  broadcast b { out { S s } }\n}\n");
  EXPECT_THAT(
      told("Poly.fidl"),
      testing::AllOf(HasSubstr("Poly.fidl: warning: interfaces: not carried: car.Poly.S: a polymorphic "
                               "structure\n"),
                     testing::EndsWith("\nPoly.fidl: error: is an interface description with nothing "
                                       "that a bridge can carry\n")));
  // Ids have no types. JSON without them may be anything, such as a configuration of a bridge.
  write("ids.json", R"({"services": [{"service": "0x1234", "instance": "1"}]})");
  EXPECT_THAT(
      told("ids.json"),
      testing::StartsWith("ids.json: error: is a configuration of vsomeip, which has ids and no types"));
  write("bad.json", R"({"services": [)");
  EXPECT_THAT(told("bad.json"), testing::StartsWith("bad.json:1:15: error: "));
  write("bridge.json", R"({"someip": {"address": "127.0.0.1"}, "generate": "all"})");
  EXPECT_FALSE(is_description((folder_ / "bridge.json").string()));
  EXPECT_FALSE(is_description((folder_ / "none.fidl").string()));
}

}  // namespace
}  // namespace trestle::test::interfaces_test
