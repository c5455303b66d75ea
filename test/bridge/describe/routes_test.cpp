#include <fmt/format.h>
#include <gmock/gmock.h>

#include "bridge/describe/write/routes/write_routes.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

Protection profile_4() {
  return {.profile = "4", .numbers = {{"data_id", 1}}};
}

/// A service with a protected field, and its instance.
Model lamp() {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint8});
  model.services.push_back({.name = "Lamp",
                            .scope = "car",
                            .id = someip::ServiceId{0x1234},
                            .minor = 3,
                            .fields = {{.name = "colour",
                                        .payload = {.values = {{.name = "colour", .type = number}}},
                                        .getter = someip::MethodId{1},
                                        .setter = someip::MethodId{2},
                                        .notifier = someip::MethodId{0x8001},
                                        .eventgroups = {someip::EventgroupId{5}},
                                        .e2e = profile_4()}}});
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{1}});
  return model;
}

struct Made {
  std::vector<RouteEntry> entries;
  std::vector<std::string> lost;
};

Made made_of(const Model& model, const RouteOptions& options = {}) {
  Made made;
  std::vector<NotCarried> lost;
  made.entries = route_entries(model, lower(model), options, lost);
  made.lost = lines_of(lost);
  return made;
}

TEST(RouteEntries, TellThatPartsOfAFieldWouldBeCarriedOtherwise) {
  Model model = lamp();
  EXPECT_THAT(made_of(model).lost, IsEmpty());
  model.services[0].fields[0].getter_transfer.transport = Transport::tcp;
  EXPECT_THAT(made_of(model).lost,
              ElementsAre("Lamp.colour: its getter by TCP: the bridge uses one transport for a whole field, "
                          "here UDP"));
}

TEST(RouteEntries, TellWhatTheyDoNotHaveOfAField) {
  Model model = lamp();
  Field& field = model.services[0].fields[0];
  field.eventgroups.push_back(someip::EventgroupId{6});
  field.cycle = std::chrono::milliseconds{20};
  field.notifier_transfer.debounce = std::chrono::milliseconds{10};
  model.instances[0].priority = 3;
  EXPECT_THAT(made_of(model).lost,
              ElementsAre("Lamp.colour: all eventgroups but the first one", "Lamp.colour: its cycle",
                          "Lamp.colour: its times of collecting several messages", "Lamp: load balancing"));
}

/// `trestle check` takes what is written: what it would refuse is listed instead.
TEST(RouteEntries, LeaveOutWhatABridgeRefuses) {
  Model model = lamp();
  Service& service = model.services[0];
  const Payload payload = service.fields[0].payload;
  service.fields[0].e2e = {.profile = "5", .numbers = {{"data_id", 1}}};
  service.events = {{.name = "lit",
                     .id = someip::MethodId{0x8002},
                     .payload = payload,
                     .eventgroups = {someip::EventgroupId{0}, someip::EventgroupId{7}}},
                    {.name = "any",
                     .id = someip::MethodId{0xffff},
                     .payload = payload,
                     .eventgroups = {someip::EventgroupId{7}}}};
  service.methods = {{.name = "light", .id = someip::MethodId{0x8002}, .timeout = std::chrono::hours{2}},
                     {.name = "dim", .id = someip::MethodId{3}, .timeout = std::chrono::hours{2}}};
  model.services.push_back({.name = "Old", .scope = "car", .id = service.id, .major = 2});
  model.services.push_back({.name = "Any", .scope = "car", .id = someip::ServiceId{0x1235}, .major = 255});
  for (const char* name : {"car.Old", "car.Any"}) {
    model.instances.push_back({.service = name, .id = someip::InstanceId{1}});
  }
  const Made made = made_of(model);
  EXPECT_THAT(made.lost,
              UnorderedElementsAre(
                  "Lamp.any: its id is none that a route can have: 0xffff",
                  "Lamp.light: its id is that of lit: 0x8002", "Lamp.lit: all eventgroups but the first one",
                  "Lamp.dim: its timeout, which is not from 1 ms to 1 h",
                  HasSubstr("Lamp.colour: its E2E protection cannot be done: "),
                  "Old: its instance 0x0001, which Lamp has too: a route file has one version of a service",
                  "Any: its major version 255, which means any"));
  ASSERT_THAT(made.entries, SizeIs(2));
  EXPECT_EQ(made.entries[0].node["eventgroup"].Scalar(), "0x0007");
  EXPECT_FALSE(made.entries[1].node["timeout"].IsDefined());
}

/// The same reason for one that is asked for alone as in the list of all, where each is told once.
TEST(RouteEntries, TellWhyAMemberIsNotCarried) {
  Model model = lamp();
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{2}});
  model.services[0].fields[0].payload.crc_bytes = 4;
  const std::string why = "a CRC of 4 bytes in the payload, which Trestle does not make";
  EXPECT_THAT(made_of(model).lost, ElementsAre("car.Lamp.colour: " + why));
  const Lowered lowered = lower(model);
  const RouteOptions options;
  std::vector<NotCarried> lost;
  EXPECT_FALSE(RouteEntries(model, lowered, options)
                   .of(model.services[0], model.instances[0], Side::client, 30501,
                       {.kind = LoweredMember::Kind::field}, lost));
  EXPECT_THAT(lines_of(lost), ElementsAre("Lamp.colour: " + why));
}

/// AUTOSAR's REQUIRED-SERVICE-INSTANCE-ID "ALL".
TEST(RouteEntries, TakeARequirementOfAnyInstanceForOneOfThoseThatAreProvided) {
  Model model = lamp();
  model.instances.push_back({.role = Instance::Role::required, .service = "car.Lamp"});
  for (const std::optional<Side> side : {std::optional<Side>{}, std::optional{Side::server}}) {
    const Made made = made_of(model, {.side = side});
    EXPECT_THAT(made.lost, ElementsAre("Lamp: that it is required, as it is provided, too"));
    EXPECT_THAT(made.entries, SizeIs(1));
  }
  model.instances.erase(model.instances.begin());
  const Made made = made_of(model);
  EXPECT_THAT(made.lost, ElementsAre("Lamp.colour: its instance has no id"));
  EXPECT_THAT(made.entries, IsEmpty());
}

TEST(RouteEntries, GiveInstancesOfOneServicePortsOfTheirOwn) {
  Model model = lamp();
  model.instances[0].udp_port = 30509;
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{2}, .udp_port = 30509});
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{3}, .udp_port = 30490});
  const Made made = made_of(model, {.side = Side::server});
  std::vector<std::string> ports;
  for (const RouteEntry& entry : made.entries) {
    ports.push_back(entry.node["port"].Scalar());
  }
  EXPECT_THAT(ports, ElementsAre("30509", "30501", "30502"));
  EXPECT_THAT(made.lost, ElementsAre("Lamp: its port: 30509 is taken, so it is offered at 30501",
                                     "Lamp: its port: 30490 is taken, so it is offered at 30502"));
}

TEST(RouteEntries, OfferTheMinorVersionOfTheInstance) {
  Model model = lamp();
  EXPECT_EQ(made_of(model, {.side = Side::server}).entries.at(0).node["minor"].Scalar(), "3");
  model.instances[0].minor = 9;
  EXPECT_EQ(made_of(model, {.side = Side::server}).entries.at(0).node["minor"].Scalar(), "9");
}

TEST(RouteEntries, MakeAnEventOfTheNotifierOfAField) {
  const Model model = lamp();
  const Lowered lowered = lower(model);
  const RouteOptions options;
  std::vector<NotCarried> lost;
  const auto entry = RouteEntries{model, lowered, options}.of(
      model.services[0], model.instances[0], Side::server, 30501,
      {.kind = LoweredMember::Kind::field, .index = 0, .is_notifier_of_field = true}, lost);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->list, "routes");
  EXPECT_EQ(entry->node["direction"].Scalar(), "dds_to_someip");
  EXPECT_EQ(entry->node["e2e"]["profile"].Scalar(), "4");
  EXPECT_FALSE(entry->node["getter"].IsDefined());
  // As a field, the settings are those of its event.
  EXPECT_EQ(made_of(model).entries.at(0).node["e2e"]["event"]["profile"].Scalar(), "4");
}

TEST(RouteEntries, HaveTheProtectionOfTheirInstance) {
  Model model = lamp();
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{2}});
  model.instances.push_back({.service = "car.Lamp", .id = someip::InstanceId{3}});
  Protection& e2e = model.services[0].fields[0].e2e;
  e2e.set(someip::InstanceId{2}, {.profile = "7", .numbers = {{"data_id", 0x22}}});
  e2e.set(someip::InstanceId{3}, {.profile = "5", .numbers = {{"data_id", 1}}});
  const Made made = made_of(model);
  ASSERT_THAT(made.entries, SizeIs(2));
  const auto has = [&](std::size_t at, const char* key) {
    return made.entries[at].node["e2e"]["event"][key].Scalar();
  };
  EXPECT_EQ(has(0, "profile"), "4");
  EXPECT_EQ(has(1, "profile"), "7");
  EXPECT_NE(has(0, "data_id"), has(1, "data_id"));
  // Of one that cannot be done, only that instance has no route.
  EXPECT_THAT(made.lost, ElementsAre(HasSubstr("Lamp.colour: its E2E protection cannot be done: ")));
}

TEST(RouteEntries, GiveEachMemberATopicOfItsOwn) {
  Model model = lamp();
  model.services.push_back(model.services[0]);
  model.services[1].scope = "house.hall";
  model.services[1].id = someip::ServiceId{0x1235};
  model.instances.push_back({.service = "house.hall.Lamp", .id = someip::InstanceId{1}});
  model.services[0].fields.push_back(model.services[0].fields[0]);
  Field& second = model.services[0].fields[1];
  second.name = "Colour";
  second.getter = someip::MethodId{11};
  second.setter = someip::MethodId{12};
  second.notifier = someip::MethodId{0x8011};
  std::vector<std::string> topics;
  for (const RouteEntry& entry : made_of(model).entries) {
    topics.push_back(entry.node["topic"].Scalar());
  }
  EXPECT_THAT(topics, ElementsAre("/car/lamp/colour", "/car/lamp/colour_2", "/house_hall/lamp/colour"));
}

/// Ids and topics are all that a route file has.
TEST(WriteRoutes, ListsTheNamesThatTheFileDoesNotHave) {
  Model model = lamp();
  Service& service = model.services[0];
  service.minor = 0;
  service.scope = "org.example";
  service.name = "HTTPLamp";
  service.fields[0].name = "lightColour";
  const TypeIndex place = model.add({.kind = Kind::structure,
                                     .name = "Place",
                                     .scope = "org.example",
                                     .members = {{.name = "x", .type = TypeIndex{0}}}});
  service.events = {{.name = "moved",
                     .id = someip::MethodId{0x8002},
                     .payload = {.values = {{.name = "where", .type = place}}},
                     .eventgroups = {someip::EventgroupId{5}}}};
  service.eventgroups = {{.name = "Colours", .id = someip::EventgroupId{5}}, {.id = someip::EventgroupId{6}}};
  model.instances[0].service = "org.example.HTTPLamp";
  model.instances[0].name = "org.example.Front";
  model.machines = {{.name = "Ecu"}};
  const Lowered lowered = lower(model);
  EXPECT_THAT(lines_of(write_routes(model, lowered).not_carried),
              ElementsAre("HTTPLamp: its name: who reads the file calls it HttpLamp",
                          "HTTPLamp: its package: org.example",
                          "HTTPLamp: the names of its members, which are as ROS has them: lightColour is "
                          "light_colour",
                          "HTTPLamp: the name of its eventgroup: 0x0005 is Colours",
                          "HTTPLamp.moved: the name of its argument: where",
                          "org.example.Front: the name of the instance", "Ecu: the name of the machine"));
  // The description beside it has all of them.
  EXPECT_THAT(lines_of(write_routes(model, lowered, {.interfaces = {"Lamp.fidl"}}).not_carried), IsEmpty());
}

/// A client learns by service discovery where an instance is, and messages of routes do not wait for others.
TEST(WriteRoutes, ListsTheSettingsThatTheFileDoesNotHave) {
  Model model = lamp();
  Field& colour = model.services[0].fields[0];
  colour.getter_transfer.retention = colour.notifier_transfer.retention = std::chrono::milliseconds{5};
  Instance& front = model.instances[0];
  front.address = IpAddress::v4(192, 168, 7, 9);
  front.udp_port = 30511;
  front.tcp_port = 30510;
  front.multicast = {{someip::EventgroupId{5}, {IpAddress::v4(239, 1, 1, 1), 40001}, 3}};
  const auto lost = [&](const RouteFileOptions& options) {
    std::vector<std::string> lines = lines_of(write_routes(model, lower(model), options).not_carried);
    std::erase_if(lines, [](const std::string& line) {
      return line.find("its minor version") != std::string::npos ||
             line.find("its package") != std::string::npos;
    });
    return lines;
  };
  const std::string usual =
      "Lamp: that messages wait up to 5 ms for others, as CommonAPI has it where nobody says otherwise";
  EXPECT_THAT(lost({}), ElementsAre(usual,
                                    "car.Lamp 0x0001: where it is, which service discovery tells a client: "
                                    "192.168.7.9, UDP port 30511, TCP port 30510",
                                    "car.Lamp 0x0001: its multicast groups, which the server tells a client: "
                                    "0x0005 at 239.1.1.1:40001 from 3 on"));
  // The description beside it has all of them.
  EXPECT_THAT(lost({.interfaces = {"Lamp.fidl"}}), IsEmpty());
  // A server has the ports and the groups.
  front.tcp_port.reset();
  front.multicast[0].threshold = 0;
  EXPECT_THAT(lost({.routes = {.side = Side::server}}),
              ElementsAre(usual, "car.Lamp 0x0001: where it is: the bridge has its own address: 192.168.7.9",
                          "car.Lamp 0x0001: its multicast groups that nothing is sent to: 0x0005 at "
                          "239.1.1.1:40001 from 0 on"));
  // Times that somebody chose are told of the member, also those of requests and answers.
  colour.setter_transfer.retention = std::chrono::milliseconds{7};
  EXPECT_THAT(lost({}), Contains("Lamp.colour: its times of collecting several messages"));
}

}  // namespace
}  // namespace trestle::describe
