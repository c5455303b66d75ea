#include "bridge/describe/model_json.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace trestle::describe {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TypeIndex add_number(Model& model, messages::Primitive primitive) {
  return model.add({.kind = Kind::primitive, .primitive = primitive});
}

/// A door with everything that has a place in the JSON.
Model full_door() {
  Model model;
  model.files = {"door.fidl"};
  const TypeIndex u8 = add_number(model, messages::Primitive::uint8);
  const TypeIndex text = model.add({.kind = Kind::string});
  const TypeIndex side =
      model.add({.kind = Kind::enumeration,
                 .name = "Side",
                 .scope = "org.example.Door",
                 .primitive = messages::Primitive::uint8,
                 .enumerators = {{.name = "LEFT", .value = 0}, {.name = "RIGHT", .value = 1}}});
  const TypeIndex list = model.add({.kind = Kind::array, .element = {.type = side}, .max_size = 4});
  const TypeIndex state = model.add({.kind = Kind::structure, .name = "State", .scope = "org.example.Door"});
  model.at(state).members = {{.name = "sides", .type = list, .wire = {.length = someip::FieldWidth::bits16}},
                             {.name = "why",
                              .type = text,
                              .wire = default_wire(Kind::string),
                              .tag = someip::DataId{5},
                              .optional = true}};
  Service service{
      .name = "Door", .scope = "org.example", .id = someip::ServiceId{0x1234}, .major = 2, .minor = 7};
  service.events = {{.name = "locked",
                     .id = someip::MethodId{0x8001},
                     .payload = {.values = {{.name = "state", .type = state}}},
                     .eventgroups = {someip::EventgroupId{1}},
                     .transfer = {.transport = Transport::tcp, .segment_bytes = 1392, .separation = 200us},
                     .e2e = {.profile = "4", .numbers = {{"data_id", 7}}}}};
  service.methods = {{.name = "open",
                      .id = someip::MethodId{1},
                      .request = {.values = {{.name = "side", .type = side, .wire = {.bits = 4}}}},
                      .response = {.values = {{.name = "ok", .type = u8}}},
                      .place = {.file = 0, .mark = {3, 5}}}};
  service.fields = {{.name = "speed",
                     .payload = {.values = {{.name = "speed", .type = u8, .notes = {.unit = "km/h"}}}},
                     .getter = someip::MethodId{2},
                     .has_setter = false,
                     .eventgroups = {someip::EventgroupId{1}}}};
  service.eventgroups = {{.name = "all", .id = someip::EventgroupId{1}}};
  model.services.push_back(std::move(service));
  model.instances = {{.name = "front",
                      .service = "org.example.Door",
                      .id = someip::InstanceId{1},
                      .address = IpAddress::v4(192, 168, 0, 1),
                      .udp_port = std::uint16_t{30501},
                      .multicast = {{.eventgroup = someip::EventgroupId{1},
                                     .group = {IpAddress::v4(224, 0, 0, 5), 30502},
                                     .threshold = 3}},
                      .timing = sd::Timing{}},
                     {.role = Instance::Role::required, .service_id = someip::ServiceId{0x4444}}};
  return model;
}

TEST(ModelJson, HasTheDocumentedFields) {
  const auto json = to_json(full_door(), true);
  const auto& service = json["services"][0];
  EXPECT_EQ(service["name"], "Door");
  EXPECT_EQ(service["scope"], "org.example");
  EXPECT_EQ(service["id"], "0x1234");
  EXPECT_EQ(service["major"], 2);
  EXPECT_EQ(service["minor"], 7);
  EXPECT_EQ(service["types"].dump(), R"(["org.example.Door.Side","org.example.Door.State"])");

  const auto& event = service["events"][0];
  EXPECT_EQ(event["id"], "0x8001");
  EXPECT_EQ(event["eventgroups"].dump(), R"(["0x0001"])");
  EXPECT_EQ(event["transport"], "tcp");
  EXPECT_EQ(event["tp"].dump(), R"({"segment_bytes":1392,"separation":"200 us"})");
  EXPECT_EQ(event["e2e"].dump(), R"({"profile":"4","data_id":7})");
  Model differing = full_door();
  Protection& e2e = differing.services[0].events[0].e2e;
  e2e.set(someip::InstanceId{2}, {.profile = "4", .numbers = {{"data_id", 8}}});
  e2e.set(someip::InstanceId{3}, {});
  EXPECT_EQ(
      to_json(differing, false)["services"][0]["events"][0]["e2e"].dump(),
      R"({"profile":"4","data_id":7,"instances":{"0x0002":{"profile":"4","data_id":8},"0x0003":{"profile":null}}})");
  EXPECT_EQ(event["payload"].dump(), R"({"values":[{"name":"state","type":"org.example.Door.State"}]})");

  const auto& method = service["methods"][0];
  EXPECT_EQ(method["place"], "door.fidl:3:5");
  EXPECT_EQ(method["request"].dump(),
            R"({"values":[{"name":"side","type":"org.example.Door.Side","wire":{"bits":4}}]})");
  EXPECT_EQ(method["response"].dump(), R"({"values":[{"name":"ok","type":"uint8"}]})");

  const auto& field = service["fields"][0];
  EXPECT_EQ(field["getter"], "0x0002");
  EXPECT_FALSE(field.contains("setter"));
  EXPECT_TRUE(field["notifier"].is_null());
  EXPECT_EQ(field["payload"]["values"][0]["unit"], "km/h");

  EXPECT_EQ(service["eventgroups"].dump(), R"([{"name":"all","id":"0x0001","events":["locked","speed"]}])");
  const auto& instance = service["instances"][0];
  EXPECT_EQ(instance["id"], "0x0001");
  EXPECT_EQ(instance["address"], "192.168.0.1");
  EXPECT_EQ(instance["udp_port"], 30501);
  EXPECT_EQ(instance["multicast"].dump(),
            R"([{"eventgroup":"0x0001","address":"224.0.0.5","port":30502,"threshold":3}])");
  EXPECT_EQ(instance["timing"]["repetitions_base_delay"], "30 ms");
}

TEST(ModelJson, WritesOnlyWireRulesThatDiffer) {
  const auto json = to_json(full_door());
  ASSERT_EQ(json["types"].size(), 2);  // those without a name stand where they are used
  EXPECT_EQ(
      json["types"][1].dump(),
      R"({"label":"org.example.Door.State","name":"State","scope":"org.example.Door","kind":"structure",)"
      R"("members":[{"name":"sides","type":{"kind":"array",)"
      R"("element":{"type":"org.example.Door.Side"},"max_size":4},"wire":{"length":16}},)"
      R"({"name":"why","type":"string","tag":5,"optional":true}]})");
}

TEST(ModelJson, KeepsInstancesOfServicesThatItDoesNotKnow) {
  const auto json = to_json(full_door());
  ASSERT_EQ(json["instances"].size(), 1);
  EXPECT_EQ(json["instances"][0]["service_id"], "0x4444");
  EXPECT_TRUE(json["instances"][0]["id"].is_null());
  EXPECT_EQ(json["instances"][0]["role"], "required");
}

TEST(ModelJson, LabelsTypesOfOneName) {
  Model model;
  model.add({.kind = Kind::structure, .name = "A", .scope = "s"});
  model.add({.kind = Kind::structure, .name = "A", .scope = "s"});
  model.add({.kind = Kind::structure});
  EXPECT_THAT(type_labels(model), ElementsAre("s.A", "s.A#2", "structure#2"));
}

TEST(ModelJson, EndsWithTypesThatGoRound) {
  Model model;
  const TypeIndex array = model.add({.kind = Kind::array, .element = {.type = TypeIndex{0}}});
  model.add({.kind = Kind::map, .element = {.type = TypeIndex{1}}, .key = {.type = TypeIndex{1}}});
  model.services.push_back(
      {.name = "S", .fields = {{.name = "f", .payload = {.values = {{.type = array}}}}}});
  EXPECT_THAT(to_json_text(model), HasSubstr("array#0"));
  EXPECT_THAT(canonical(model), HasSubstr("array"));
}

TEST(ModelJson, ReplacesWhatIsNotUtf8) {
  Model model;
  model.services.push_back({.name = "S\xff"});
  EXPECT_THAT(to_json_text(model), HasSubstr("S\xef\xbf\xbd"));
}

TEST(ModelJson, CanonicalTextIgnoresOrderIndicesAndPlaces) {
  const Model model = full_door();
  Model other;
  other.files = {"x", "y"};
  add_number(other, messages::Primitive::float64);  // all indices are others
  append(other, full_door());
  Service& service = other.services.front();
  service.events.push_back({.name = "a"});
  std::ranges::reverse(service.events);
  service.methods.front().place = {.file = 1, .mark = {9, 9}};
  std::ranges::reverse(other.instances);
  Model with_event = model;
  with_event.services.front().events.push_back({.name = "a"});
  EXPECT_EQ(canonical(with_event), canonical(other));
  EXPECT_NE(canonical(model), canonical(other));
}

TEST(ModelJson, CanonicalTextJoinsTypesThatAreAlike) {
  Model model = full_door();
  Model twice = full_door();
  Model again = full_door();
  again.services.clear();
  again.instances.clear();
  append(twice, std::move(again));
  EXPECT_EQ(canonical(model), canonical(twice));
  twice.types.back().members.front().name = "other";
  EXPECT_NE(canonical(model), canonical(twice));
}

TEST(ModelJson, CanonicalTextTellsVariantsApartThatDifferDeepInside) {
  const auto two_lists = [](bool reverse) {
    Model model;
    const TypeIndex u8 = add_number(model, messages::Primitive::uint8);
    const std::array<std::uint32_t, 2> sizes = reverse ? std::array{2U, 1U} : std::array{1U, 2U};
    std::vector<TypeIndex> outer;
    for (const std::uint32_t size : sizes) {
      const TypeIndex array =
          model.add({.kind = Kind::array, .name = "L", .element = {.type = u8}, .max_size = size});
      outer.push_back(
          model.add({.kind = Kind::structure, .name = "S", .members = {{.name = "l", .type = array}}}));
    }
    // The method uses the one of size 1 whatever stands first.
    model.services.push_back(
        {.name = "M",
         .methods = {{.name = "m", .request = {.values = {{.name = "v", .type = outer[reverse ? 1 : 0]}}}}}});
    return model;
  };
  EXPECT_EQ(canonical(two_lists(false)), canonical(two_lists(true)));
  EXPECT_THAT(canonical(two_lists(false)), HasSubstr("S#2"));
  EXPECT_THAT(canonical(two_lists(false)), Not(HasSubstr("S#3")));
}

}  // namespace
}  // namespace trestle::describe
