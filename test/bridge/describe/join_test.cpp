#include "bridge/describe/join.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "test/bridge/describe/described.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;
using namespace std::chrono_literals;

/// As vsomeip JSON tells of it.
Model configured() {
  Model model{.files = {"vsomeip.json"}, .configurations = {0}};
  Service service{.name = "service_1234", .id = someip::ServiceId{0x1234}};
  service.events = {
      {.name = "event_8001", .id = someip::MethodId{0x8001}, .eventgroups = {someip::EventgroupId{5}}},
      {.name = "event_8002", .id = someip::MethodId{0x8002}, .eventgroups = {someip::EventgroupId{6}}}};
  service.events[0].transfer.transport = Transport::tcp;
  service.eventgroups = {{.id = someip::EventgroupId{5}}, {.id = someip::EventgroupId{6}}};
  model.services = {service};
  model.instances = {{.service = "service_1234",
                      .service_id = someip::ServiceId{0x1234},
                      .id = someip::InstanceId{1},
                      .udp_port = 30501}};
  return model;
}

TEST(Join, AddsWhatAConfigurationKnowsToADescription) {
  Model model = described();
  append(model, configured());
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.services, SizeIs(1));
  const Service& door = model.services.front();
  EXPECT_EQ(door.name, "Door");
  EXPECT_EQ(door.events.front().transfer.transport, Transport::tcp);
  EXPECT_THAT(door.events.front().eventgroups, ElementsAre(someip::EventgroupId{5}));
  EXPECT_THAT(door.fields.front().eventgroups, ElementsAre(someip::EventgroupId{6}));
  ASSERT_THAT(model.instances, SizeIs(1));
  EXPECT_EQ(model.instances.front().service, "car.Door");
  EXPECT_EQ(model.instances.front().udp_port, 30501);
}

TEST(Join, DoesTheSameInTheOtherOrder) {
  Model model = configured();
  append(model, described());
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.services, SizeIs(1));
  EXPECT_EQ(model.services.front().name, "Door");
  ASSERT_THAT(model.instances, SizeIs(1));
  EXPECT_EQ(model.instances.front().service, "car.Door");
}

/// Names and types, and nothing of how they are carried.
Model named() {
  Model model{.files = {"Door.fidl"}};
  const TypeIndex number = model.add({.primitive = messages::Primitive::uint8});
  const Payload payload{.values = {{.name = "x", .type = number}}};
  Service door{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  door.events = {{.name = "moved", .id = someip::MethodId{0x8001}, .payload = payload}};
  door.methods = {{.name = "open", .id = someip::MethodId{1}, .request = payload, .response = payload}};
  door.fields = {{.name = "angle",
                  .payload = payload,
                  .getter = someip::MethodId{2},
                  .setter = someip::MethodId{3},
                  .notifier = someip::MethodId{0x8002}}};
  model.services = {door};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{1}}};
  return model;
}

/// The same ids, and nothing that one could know of them.
Model unnamed() {
  Model model{.files = {"vsomeip.json"}, .configurations = {0}};
  Service service{.name = "service_1234", .id = someip::ServiceId{0x1234}};
  service.events = {{.name = "event_8001", .id = someip::MethodId{0x8001}, .payload = {.known = false}}};
  for (const int id : {1, 2, 3}) {
    service.methods.push_back({.name = "method", .id = static_cast<someip::MethodId>(id)});
    service.methods.back().request.known = service.methods.back().response.known = false;
  }
  service.fields = {{.name = "field_8002",
                     .payload = {.known = false},
                     .notifier = someip::MethodId{0x8002},
                     .has_getter = false,
                     .has_setter = false}};
  model.services = {service};
  model.instances = {
      {.service = "service_1234", .service_id = someip::ServiceId{0x1234}, .id = someip::InstanceId{1}}};
  return model;
}

Transfer transfer(std::uint32_t segment_bytes) {
  return {.transport = Transport::tcp,
          .segment_bytes = segment_bytes,
          .separation = 1ms,
          .debounce = 2ms,
          .retention = 3ms};
}

Protection protection(std::uint64_t data_id) {
  return {.profile = "4", .numbers = {{"data_id", data_id}}, .words = {}};
}

/// Everything that can be said of an instance, and of a service beside its members.
void fill_instance(Model& model) {
  Service& service = model.services.front();
  service.has_version = true;
  service.major = 3;
  service.minor = 4;
  service.notes.description = "A door.";
  service.eventgroups = {{.name = "doors", .id = someip::EventgroupId{5}}};
  Instance& instance = model.instances.front();
  instance.name = "left";
  instance.major = 3;
  instance.minor = 4;
  instance.address = IpAddress::v4(10, 0, 0, 1);
  instance.udp_port = 30501;
  instance.tcp_port = 30502;
  instance.multicast = {
      {.eventgroup = someip::EventgroupId{5}, .group = {IpAddress::v4(239, 0, 0, 1), 30503}, .threshold = 2}};
  instance.timing = sd::Timing{.initial_delay_min = 7ms};
  instance.priority = 1;
  instance.weight = 2;
  instance.configuration = {{"key", "value"}};
  instance.machine = "ecu";
  instance.notes.unit = "1";
}

/// `named()` with all else that can be known.
Model full() {
  Model model = named();
  fill_instance(model);
  Service& door = model.services.front();
  Event& moved = door.events.front();
  moved.eventgroups = {someip::EventgroupId{5}};
  moved.transfer = transfer(160);
  moved.cycle = 10ms;
  moved.observed_bytes = 11;
  moved.e2e = protection(1);
  moved.notes.description = "It moved.";
  Method& open = door.methods.front();
  open.request_transfer = transfer(176);
  open.response_transfer = transfer(192);
  open.timeout = 12ms;
  open.observed_bytes = 13;
  open.e2e = protection(2);
  open.notes.unit = "mm";
  Field& angle = door.fields.front();
  angle.eventgroups = {someip::EventgroupId{5}};
  angle.getter_transfer = transfer(208);
  angle.setter_transfer = transfer(224);
  angle.notifier_transfer = transfer(240);
  angle.cycle = 14ms;
  angle.observed_bytes = 15;
  angle.e2e = protection(3);
  angle.getter_e2e = protection(4);
  angle.setter_e2e = protection(5);
  angle.notes.others = {{"@author", "me"}};
  return model;
}

/// `unnamed()` with the same.
Model unnamed_and_full() {
  Model model = unnamed();
  fill_instance(model);
  Service& service = model.services.front();
  const Model known = full();
  const Service& door = known.services.front();
  const auto take = [](auto& to, auto from) {
    from.name = to.name;
    from.id = to.id;
    return to = std::move(from);
  };
  take(service.events[0], door.events[0]);
  service.events[0].payload = {.known = false};
  take(service.methods[0], door.methods[0]);
  service.methods[0].request = service.methods[0].response = {.known = false};
  const Field& angle = door.fields[0];
  service.methods[1].response_transfer = angle.getter_transfer;
  service.methods[1].e2e = angle.getter_e2e;
  service.methods[2].request_transfer = service.methods[2].response_transfer = angle.setter_transfer;
  service.methods[2].e2e = angle.setter_e2e;
  Field& field = service.fields[0];
  field.eventgroups = angle.eventgroups;
  field.notifier_transfer = angle.notifier_transfer;
  field.cycle = angle.cycle;
  field.observed_bytes = angle.observed_bytes;
  field.e2e = angle.e2e;
  field.notes = angle.notes;
  return model;
}

std::string joined(Model first, Model second) {
  append(first, std::move(second));
  EXPECT_THAT(join(first), IsEmpty());
  return canonical(first);
}

TEST(Join, LosesNothingBesideADescriptionThatKnowsNothing) {
  Model alone = full();
  ASSERT_THAT(join(alone), IsEmpty());
  EXPECT_EQ(joined(full(), unnamed()), canonical(alone));
  EXPECT_EQ(joined(unnamed(), full()), canonical(alone));
}

TEST(Join, LosesNothingOfWhatIsKnownByIdsAlone) {
  Model alone = full();
  ASSERT_THAT(join(alone), IsEmpty());
  EXPECT_EQ(joined(named(), unnamed_and_full()), canonical(alone));
  EXPECT_EQ(joined(unnamed_and_full(), named()), canonical(alone));
}

TEST(Join, GivesEachMessageItsProtection) {
  const std::string text = R"({"e2e":{"e2e_enabled":"true","protected":[
{"service_id":"0x1234","event_id":"0x8001","profile":"P04","variant":"protector","data_id":"1"},
{"service_id":"0x1234","event_id":"0x0001","profile":"P04","variant":"checker","data_id":"2"},
{"service_id":"0x1234","event_id":"0x8002","profile":"P04","variant":"protector","data_id":"3"},
{"service_id":"0x1234","event_id":"0x0002","profile":"P04","variant":"checker","data_id":"4"},
{"service_id":"0x1234","event_id":"0x0003","profile":"P04","variant":"checker","data_id":"5"}]}})";
  // As an event, and as a field.
  for (const std::string& front :
       {std::string{"{"}, std::string{R"({"services":[{"service":"0x1234","instance":"1",
"events":[{"event":"0x8002","is_field":"true","cycle":"20"}]}],)"}}) {
    const std::vector<SourceText> sources{{"e2e.json", front + text.substr(1)}};
    Reading reading = read_vsomeip(sources);
    ASSERT_TRUE(reading.ok());
    Model model = named();
    append(model, std::move(reading.model));
    EXPECT_THAT(join(model), IsEmpty());
    ASSERT_THAT(model.services, SizeIs(1));
    const Service& door = model.services.front();
    EXPECT_EQ(door.events[0].e2e.numbers.at("data_id"), 1U);
    EXPECT_EQ(door.methods[0].e2e.numbers.at("data_id"), 2U);
    EXPECT_EQ(door.fields[0].e2e.numbers.at("data_id"), 3U);
    EXPECT_EQ(door.fields[0].getter_e2e.numbers.at("data_id"), 4U);
    EXPECT_EQ(door.fields[0].setter_e2e.numbers.at("data_id"), 5U);
    EXPECT_EQ(door.fields[0].cycle.has_value(), front.size() > 1);
  }
}

TEST(Join, KeepsMembersThatOneSourceAloneHas) {
  Model model = named();
  Model other = unnamed();
  other.services[0].events.push_back({.name = "event_8009", .id = someip::MethodId{0x8009}});
  other.services[0].methods.push_back({.name = "method_0009", .id = someip::MethodId{9}});
  append(model, std::move(other));
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.services, SizeIs(1));
  EXPECT_THAT(model.services[0].events, SizeIs(2));
  EXPECT_THAT(model.services[0].methods, SizeIs(2));
  EXPECT_THAT(model.services[0].fields, SizeIs(1));
}

TEST(Join, TakesAnInstanceWithoutIdForTheOnlyOne) {
  Model model = named();
  Model other = unnamed();
  other.instances[0].id.reset();
  other.instances[0].udp_port = 30501;
  append(model, other);
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.instances, SizeIs(1));
  EXPECT_EQ(model.instances[0].udp_port, 30501);
  // Not where they contradict.
  other.instances[0].udp_port = 30502;
  append(model, other);
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_THAT(model.instances, SizeIs(2));
}

TEST(Join, KeepsInstancesOfOneMachineAtTwoAddresses) {
  Model model = named();
  const auto at = [](std::uint8_t network) { return IpAddress::v4(192, 168, network, 1); };
  Instance& first = model.instances[0];
  first.machine = "gateway";
  first.address = at(2);
  Instance second = first;
  second.address = at(3);
  second.udp_port = 30501;
  Instance again = second;  // of which another file tells more
  again.machine.clear();
  again.udp_port.reset();
  again.tcp_port = 30502;
  model.instances.push_back(second);
  model.instances.push_back(again);
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.instances, SizeIs(2));
  EXPECT_EQ(model.instances[0].address, at(2));
  EXPECT_EQ(model.instances[0].tcp_port, std::nullopt);
  EXPECT_EQ(model.instances[1].address, at(3));
  EXPECT_EQ(model.instances[1].udp_port, 30501);
  EXPECT_EQ(model.instances[1].tcp_port, 30502);
  EXPECT_EQ(model.instances[1].machine, "gateway");
}

std::vector<std::string> told_of(Model first, Model second) {
  append(first, std::move(second));
  std::vector<std::string> texts;
  for (const documents::Problem& problem : join(first)) {
    texts.push_back(to_string(problem));
  }
  return texts;
}

/// Each setting of an instance that two files say: with both values, and where they are said.
TEST(Join, TellsOfSettingsThatContradict) {
  Model fdepl = named();
  fdepl.files = {"Door.fidl", "Door.fdepl"};
  Instance& first = fdepl.instances[0];
  first.place = {.file = 1, .mark = {9, 3}};
  first.udp_port = 30509;
  first.said_at["udp_port"] = {.file = 1, .mark = {11, 5}};
  first.tcp_port = 30510;
  first.minor = 1;
  first.multicast = {{.eventgroup = someip::EventgroupId{5},
                      .group = {IpAddress::v4(239, 0, 0, 1), 30490},
                      .threshold = 2,
                      .group_at = Place{1, {12, 5}},
                      .threshold_at = Place{1, {13, 5}}}};
  first.timing = sd::Timing{.ttl_s = 3};
  first.said_at["ttl"] = {.file = 1, .mark = {14, 5}};
  Model other = unnamed();
  Instance& second = other.instances[0];
  second.place = {.file = 0, .mark = {2, 7}};
  second.udp_port = 30501;
  second.said_at["udp_port"] = {.file = 0, .mark = {3, 9}};
  second.tcp_port = 30510;  // the same
  second.minor = 2;
  second.multicast = {{.eventgroup = someip::EventgroupId{5},
                       .group = {IpAddress::v4(239, 0, 0, 1), 30491},
                       .threshold = 4,
                       .group_at = Place{0, {4, 9}},
                       .threshold_at = Place{0, {5, 9}}}};
  second.timing = sd::Timing{.initial_delay_max = 500ms, .ttl_s = 5};
  second.said_at["ttl"] = {.file = 0, .mark = {6, 9}};
  other.files = {"car.arxml"};
  other.configurations.clear();
  const auto text = [](const char* at, const std::string& here, const std::string& there) {
    return fmt::format(
        "car.arxml:{}: error: instance 0x0001 of car.Door has {} here, but {}: make them the same, "
        "or leave one of the two files out",
        at, here, there);
  };
  EXPECT_THAT(
      told_of(fdepl, other),
      ElementsAre(text("3:9", "the UDP port 30501", "30509 at Door.fdepl:11:5"),
                  text("2:7", "the minor version 2", "1 at Door.fdepl:9:3"),
                  text("6:9", "the ttl 5", "3 at Door.fdepl:14:5"),
                  text("4:9", "for eventgroup 0x0005 the multicast port 30491", "30490 at Door.fdepl:12:5"),
                  text("5:9", "for eventgroup 0x0005 the threshold 4", "2 at Door.fdepl:13:5")));
}

/// CommonAPI reads ports and addresses from the configuration of vsomeip alone, whatever the FDEPL file says.
TEST(Join, TakesSettingsOfHostsFromTheConfigurationOfVsomeip) {
  Model fdepl = named();
  Instance& first = fdepl.instances[0];
  first.address = IpAddress::v4(10, 0, 0, 1);
  first.udp_port = 30509;
  first.said_at["udp_port"] = {.file = 0, .mark = {11, 5}};
  first.multicast = {{.eventgroup = someip::EventgroupId{5},
                      .group = {IpAddress::v4(239, 0, 0, 1), 30490},
                      .group_at = Place{0, {12, 5}}}};
  Model json = unnamed();
  Instance& second = json.instances[0];
  second.address = IpAddress::v4(10, 0, 0, 2);
  second.udp_port = 30501;
  second.said_at["udp_port"] = {.file = 0, .mark = {3, 9}};
  second.multicast = {{.eventgroup = someip::EventgroupId{5},
                       .group = {IpAddress::v4(239, 0, 0, 2), 30491},
                       .group_at = Place{0, {4, 9}}}};
  for (const bool json_first : {false, true}) {
    Model both = json_first ? json : fdepl;
    append(both, json_first ? fdepl : json);
    const std::vector<documents::Problem> problems = join(both);
    ASSERT_EQ(problems.size(), 3U);
    for (const documents::Problem& one : problems) {
      EXPECT_EQ(one.severity, documents::Problem::Severity::warning) << one.text;
      EXPECT_THAT(one.text, HasSubstr("of the configuration of vsomeip, is taken"));
    }
    ASSERT_THAT(both.instances, SizeIs(1));
    EXPECT_EQ(both.instances[0].address, second.address);
    EXPECT_EQ(both.instances[0].udp_port, 30501);
    EXPECT_EQ(both.instances[0].multicast.at(0).group, second.multicast[0].group);
  }
  // So it is with what was seen on the network.
  Model seen = json;
  seen.files = {"network:lo"};
  seen.configurations.clear();
  seen.instances[0].observed_ttl_s = 3;
  for (const bool seen_first : {false, true}) {
    Model both = seen_first ? seen : fdepl;
    append(both, seen_first ? fdepl : seen);
    const std::vector<documents::Problem> problems = join(both);
    ASSERT_EQ(problems.size(), 3U);
    for (const documents::Problem& one : problems) {
      EXPECT_EQ(one.severity, documents::Problem::Severity::warning) << one.text;
      EXPECT_THAT(one.text, HasSubstr("which was seen on the network, is taken"));
    }
    ASSERT_THAT(both.instances, SizeIs(1));
    EXPECT_EQ(both.instances[0].address, second.address);
    EXPECT_EQ(both.instances[0].udp_port, 30501);
  }
  // But a configuration says what a host does from now on.
  seen.instances[0].address = IpAddress::v4(10, 0, 0, 4);
  EXPECT_THAT(told_of(seen, json),
              ElementsAre(HasSubstr("10.0.0.2, of the configuration of vsomeip, is taken")));
  // A model in JSON is no configuration.
  Model described_in_json = json;
  described_in_json.configurations.clear();
  EXPECT_THAT(told_of(fdepl, described_in_json), testing::Each(HasSubstr("error: ")));
  // Two hosts may list a service that one of them offers.
  Model other = unnamed();
  other.files = {"other.json"};
  other.instances[0].address = IpAddress::v4(10, 0, 0, 3);
  other.instances[0].udp_port = 30501;
  EXPECT_THAT(
      told_of(json, other),
      ElementsAre(HasSubstr("warning: instance 0x0001 of service_1234 is listed by two hosts, 10.0.0.3 here "
                            "and 10.0.0.2 at vsomeip.json")));
}

TEST(Join, TakesWhatOneSaysBeforeTheDefaultOfAnother) {
  Model first = named();
  Instance& known = first.instances[0];
  known.multicast = {{.eventgroup = someip::EventgroupId{5},
                      .group = {IpAddress::v4(239, 0, 0, 1), 30490},
                      .threshold = 1,
                      .group_at = Place{}}};
  known.timing = sd::Timing{};
  first.services[0].events[0].transfer.retention = 5ms;
  Model second = unnamed();
  Instance& other = second.instances[0];
  other.multicast = known.multicast;
  other.multicast[0].group.port = 30501;  // that of the instance
  other.multicast[0].has_usual_port = true;
  other.multicast[0].threshold = 4;
  other.multicast[0].threshold_at = Place{};
  other.timing = sd::Timing{.initial_delay_max = 3s, .ttl_s = 5};
  other.said_at["ttl"] = {};
  Transfer& transfer = second.services[0].events[0].transfer;
  transfer = {
      .transport = Transport::tcp, .retention = 20ms, .transport_at = Place{}, .retention_at = Place{}};
  append(first, std::move(second));
  EXPECT_THAT(join(first), IsEmpty());
  ASSERT_THAT(first.instances, SizeIs(1));
  const Instance& joined = first.instances[0];
  EXPECT_EQ(joined.multicast[0].group.port, 30490);
  EXPECT_EQ(joined.multicast[0].threshold, 4U);
  EXPECT_EQ(joined.timing->ttl_s, 5U);
  EXPECT_EQ(joined.timing->initial_delay_max, sd::Timing{}.initial_delay_max);
  EXPECT_EQ(first.services[0].events[0].transfer.transport, Transport::tcp);
  EXPECT_EQ(first.services[0].events[0].transfer.retention, 20ms);
}

TEST(Join, TellsOfMessagesThatAreSaidDifferently) {
  Model fidl = named();
  Service& door = fidl.services[0];
  door.events[0].transfer.transport = Transport::tcp;
  door.events[0].transfer.transport_at = Place{0, {7, 3}};
  door.events[0].eventgroups = {someip::EventgroupId{1}};
  door.methods[0].e2e = protection(1);
  Model other = unnamed();
  Service& service = other.services[0];
  service.events[0].transfer.transport_at = Place{0, {3, 5}};  // UDP
  service.events[0].eventgroups = {someip::EventgroupId{2}};
  service.methods[0].e2e = protection(2);
  EXPECT_THAT(
      told_of(fidl, other),
      ElementsAre(HasSubstr("vsomeip.json:3:5: error: Door.moved has the transport UDP here, but TCP at "
                            "Door.fidl:7:3: make them the same"),
                  HasSubstr("Door.moved has the eventgroup 0x0002 here, but 0x0001 at Door.fidl"),
                  HasSubstr("Door.open has for E2E the data_id 2 here, but 1 at Door.fidl")));
  // Eventgroups stand where the ids do, which is in the FDEPL.
  Model deployed = fidl;
  deployed.files.emplace_back("Door.fdepl");
  deployed.services[0].events[0].id_place = Place{1, {11, 5}};
  EXPECT_THAT(told_of(deployed, other)[1],
              HasSubstr("has the eventgroup 0x0002 here, but 0x0001 at Door.fdepl:11:5"));
  // An event may be in several.
  service.events[0].transfer.transport_at.reset();
  service.events[0].eventgroups = {someip::EventgroupId{2}, someip::EventgroupId{1}};
  service.methods[0].e2e = {};
  append(fidl, other);
  EXPECT_THAT(join(fidl), IsEmpty());
  EXPECT_THAT(fidl.services[0].events[0].eventgroups,
              ElementsAre(someip::EventgroupId{1}, someip::EventgroupId{2}));
  EXPECT_EQ(fidl.services[0].events[0].transfer.transport, Transport::tcp);
}

TEST(Join, TakesTheProtectionOfOneHostForThatOfItsInstance) {
  Model arxml = named();
  Protection& e2e = arxml.services[0].methods[0].e2e;
  e2e = protection(1);
  e2e.set(someip::InstanceId{2}, protection(2));
  const Protection all = e2e;
  Model host = unnamed();
  host.services[0].methods[0].e2e = protection(2);
  for (const auto& [first, second] : {std::pair{arxml, host}, std::pair{host, arxml}}) {
    Model both = first;
    append(both, second);
    EXPECT_THAT(join(both), IsEmpty());
    EXPECT_EQ(both.services.at(0).methods.at(0).e2e, all);
  }
  host.services[0].methods[0].e2e = protection(3);
  EXPECT_THAT(told_of(arxml, host),
              ElementsAre(HasSubstr("Door.open has for E2E the data_id 3 here, but 1")));
  // Two that know instances are compared in each, and add what the other one does not know.
  host.services[0].methods[0].e2e = protection(1);
  host.services[0].methods[0].e2e.set(someip::InstanceId{2}, protection(4));
  host.services[0].methods[0].e2e.set(someip::InstanceId{3}, protection(5));
  EXPECT_THAT(told_of(arxml, host),
              ElementsAre(HasSubstr("Door.open has for E2E the data_id 4 here, but 2")));
  e2e.of_instances.clear();
  append(arxml, host);
  EXPECT_THAT(join(arxml), IsEmpty());
  EXPECT_EQ(arxml.services[0].methods[0].e2e, host.services[0].methods[0].e2e);
}

TEST(Join, TellsOfTwoAddressesThatNoHostsExplain) {
  Model model = named();
  model.instances[0].address = IpAddress::v4(10, 0, 0, 1);
  Model other = unnamed();
  other.instances[0].address = IpAddress::v4(10, 0, 0, 2);
  other.files = {"car.arxml"};
  other.configurations.clear();
  EXPECT_THAT(told_of(model, other),
              ElementsAre(HasSubstr("car.arxml: error: instance 0x0001 of car.Door has the address 10.0.0.2 "
                                    "here, but 10.0.0.1 at Door.fidl: make them the same")));
  other.instances[0].machine = "car";
  EXPECT_THAT(told_of(model, other), SizeIs(1));
  // Of two hosts, of two versions, or where one of the files has both addresses.
  model.instances[0].machine = "gateway";
  EXPECT_THAT(told_of(model, other), IsEmpty());
  model.instances[0].machine.clear();
  Model versions = other;
  versions.instances[0].major = 2;
  EXPECT_THAT(told_of(model, versions), IsEmpty());
  other.instances.push_back(other.instances[0]);
  other.instances[1].address = IpAddress::v4(10, 0, 0, 1);
  EXPECT_THAT(told_of(model, other), IsEmpty());
}

/// vsomeip JSON has no name for its host.
TEST(Join, TakesTheHostOfOneAddressForTheSame) {
  Model model = named();
  const IpAddress address = IpAddress::v4(10, 0, 0, 1);
  model.machines = {{.name = "ecu", .address = address, .place = {0, {20, 1}}}};
  model.instances[0].machine = "ecu";
  model.instances[0].address = address;
  model.instances[0].udp_port = 30501;
  Model other = unnamed();
  other.machines = {{.name = "vsomeip", .address = address, .sd_port = 30490}};
  other.instances[0].machine = "vsomeip";
  other.instances[0].address = address;
  other.instances[0].tcp_port = 30502;
  Model both = model;
  append(both, other);
  EXPECT_THAT(join(both), IsEmpty());
  ASSERT_THAT(both.machines, SizeIs(1));
  EXPECT_EQ(both.machines[0].sd_port, 30490);
  ASSERT_THAT(both.instances, SizeIs(1));
  EXPECT_EQ(both.instances[0].tcp_port, 30502);
  other.instances[0].udp_port = 30509;
  EXPECT_THAT(told_of(model, other),
              ElementsAre(HasSubstr("the UDP port 30509 here, but 30501 at Door.fidl")));
}

TEST(Join, KeepsTheMajorVersionsOfAnInstanceApart) {
  Model model = named();
  model.instances[0].major = 1;
  Instance second = model.instances[0];
  second.major = 2;
  Instance again = second;  // of which another file tells more
  again.udp_port = 30502;
  Instance unknown = model.instances[0];  // whose version another file does not tell
  unknown.major.reset();
  unknown.tcp_port = 30501;
  model.instances.push_back(second);
  model.instances.push_back(again);
  model.instances.push_back(unknown);
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.instances, SizeIs(2));
  EXPECT_EQ(model.instances[0].major, 1);
  EXPECT_EQ(model.instances[0].tcp_port, 30501);
  EXPECT_EQ(model.instances[0].udp_port, std::nullopt);
  EXPECT_EQ(model.instances[1].major, 2);
  EXPECT_EQ(model.instances[1].udp_port, 30502);
}

TEST(Join, NamesAnInstanceAfterTheServiceOfItsMajorVersion) {
  Model model = named();
  Service next = model.services[0];
  next.name = "Door2";
  next.major = 2;
  model.services.push_back(next);
  Model seen = unnamed();
  seen.instances[0].id = someip::InstanceId{7};
  seen.instances[0].major = 2;
  append(model, seen);
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.instances, SizeIs(2));
  EXPECT_EQ(model.instances[1].service, full_name(next.scope, "Door2"));
}

TEST(Join, TakesAnInstanceWithoutAddressForTheFirst) {
  Model model = named();
  model.instances[0].machine = "gateway";
  Instance second = model.instances[0];
  second.address = IpAddress::v4(192, 168, 3, 1);
  model.instances.push_back(second);
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.instances, SizeIs(1));
  EXPECT_EQ(model.instances[0].address, second.address);
}

TEST(Join, TakesTheServiceOfTheSameMajorVersion) {
  Model model = named();
  model.services.push_back({.name = "Door2", .scope = "car", .id = someip::ServiceId{0x1234}, .major = 2});
  Model other = unnamed();
  other.services[0].major = 2;
  other.services[0].minor = 7;
  other.services[0].has_version = true;
  append(model, std::move(other));
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_EQ(model.services[0].minor, 0U);
  EXPECT_EQ(model.services[1].minor, 7U);
}

TEST(Join, KeepsWhatNobodyDescribes) {
  Model model = configured();
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_THAT(model.services, SizeIs(1));
  EXPECT_EQ(model.instances.front().service, "service_1234");
}

TEST(Join, TellsOfServicesThatAreThereTwice) {
  Model model = described();
  Model other = described();
  other.services[0].events[0].payload.values.clear();
  append(model, std::move(other));
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems.front().text,
            "service car.Door is described twice, also at Door.fidl:3:1: name one of the two files");
  EXPECT_EQ(problems.front().mark, (documents::Mark{3, 1}));
}

/// A part of one may be missing for an error of reading. What else contradicts is told with that one.
TEST(Join, TellsOfErrorsThatDoNotFollowFromThoseOfReading) {
  Model model = described();
  Model other = described();
  other.services[0].events[0].payload.values.clear();
  append(model, std::move(other));
  append(model, configured());
  model.services[0].events[0].transfer.transport_at = Place{0, {5, 1}};
  model.services[2].events[0].transfer.transport_at = Place{2, {7, 1}};
  const TypeIndex narrow = model.add({.kind = Kind::enumeration, .enumerators = {{"MANY", 300}}});
  model.services[0].events[0].payload.values[0].type = narrow;
  std::vector<documents::Problem> told{{.file = "Door.fidl", .mark = {}, .text = "what reading has found"}};
  Model again = model;
  join_with_errors(model, told);
  ASSERT_THAT(told, SizeIs(2));
  EXPECT_THAT(to_string(told[1]),
              StartsWith("vsomeip.json:7:1: error: Door.moved has the transport TCP here, "
                         "but UDP at Door.fidl:5:1: "));
  join_with_errors(again, told);
  EXPECT_THAT(told, SizeIs(2)) << "each once";
  EXPECT_THAT(join(again), SizeIs(2)) << "without such an error";
}

TEST(Join, TakesTwoDescriptionsThatSayTheSameForOne) {
  Model model = described();
  Model other = described();
  // As ARXML has it: another scope, and a place that the first does not know.
  other.files = {"Door.arxml"};
  other.services[0].scope = "/car";
  other.types[0].name = "Number";
  other.instances[0] = {.service = "/car/Door", .id = someip::InstanceId{1}, .udp_port = 30501};
  append(model, std::move(other));
  EXPECT_THAT(join(model), IsEmpty());
  ASSERT_THAT(model.services, SizeIs(1));
  EXPECT_EQ(model.services[0].scope, "car");
  EXPECT_THAT(model.types, SizeIs(1)) << "there would be two of each name";
  EXPECT_EQ(model.services[0].fields[0].payload.values[0].type, TypeIndex{0});
  ASSERT_THAT(model.instances, SizeIs(1));
  EXPECT_EQ(model.instances[0].udp_port, 30501);
  // Scopes of two languages say nothing, however they are spelt.
  Model vehicle = described();
  Model own = described();
  own.files = {"Door.arxml"};
  own.services[0].scope = "vehicle";
  append(vehicle, std::move(own));
  EXPECT_THAT(join(vehicle), IsEmpty());
  EXPECT_THAT(vehicle.services, SizeIs(1));
}

TEST(Join, TellsWhichOneIsGoneOfTwoServicesInOneLanguage) {
  Model model = described();
  Model other = described();
  other.files = {"Rear.fidl"};
  other.services[0].scope = "rear";
  append(model, std::move(other));
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_THAT(problems[0].text, HasSubstr("service rear.Door is taken for car.Door, at "));
  EXPECT_THAT(problems[0].text, HasSubstr("have the id 0x1234"));
  EXPECT_THAT(model.services, SizeIs(1));
}

}  // namespace
}  // namespace trestle::describe
