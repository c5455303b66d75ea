#include "bridge/describe/compare.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <set>

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr TypeIndex number{0};
constexpr TypeIndex text{1};
constexpr TypeIndex mode{2};
constexpr TypeIndex status{3};
constexpr TypeIndex extras{4};
constexpr TypeIndex either{5};
constexpr TypeIndex list{6};
constexpr TypeIndex long_status{7};

/// A service with one of everything.
Model door() {
  Model model;
  model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint16});
  model.add({.kind = Kind::string});
  model.add({.kind = Kind::enumeration, .name = "Mode", .enumerators = {{"OPEN", 0}, {"SHUT", 1}}});
  model.add({.kind = Kind::structure,
             .name = "Status",
             .members = {{.name = "mode", .type = mode}, {.name = "angle", .type = number}}});
  model.add({.kind = Kind::structure,
             .name = "Extras",
             .members = {{.name = "a", .type = number, .tag = someip::DataId{1}},
                         {.name = "b", .type = number, .tag = someip::DataId{2}, .optional = true}}});
  model.add({.kind = Kind::choice,
             .name = "Either",
             .members = {{.name = "one", .type = number}, {.name = "other", .type = text}}});
  model.add({.kind = Kind::array, .element = {.type = number}, .max_size = 8});
  model.add({.kind = Kind::structure, .name = "LongStatus", .members = {{.name = "angle", .type = number}}});
  Service service{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  service.methods.push_back({.name = "open",
                             .id = someip::MethodId{1},
                             .request = {.values = {{.name = "extras", .type = extras}}},
                             .response = {.values = {{.name = "done", .type = either}}},
                             .error = mode});
  service.events.push_back({.name = "moved",
                            .id = someip::MethodId{0x8001},
                            .payload = {.values = {{.name = "status", .type = status},
                                                   {.name = "angles", .type = list},
                                                   {.name = "more",
                                                    .type = long_status,
                                                    .wire = {.length = someip::FieldWidth::bits32}}}},
                            .eventgroups = {someip::EventgroupId{1}}});
  service.fields.push_back(
      {.name = "label",
       .payload = {.values = {{.name = "label", .type = text, .wire = default_wire(Kind::string)}}},
       .getter = someip::MethodId{2},
       .setter = someip::MethodId{3},
       .notifier = someip::MethodId{0x8002}});
  model.services.push_back(std::move(service));
  model.instances.push_back({.name = "front", .service = "car.Door", .id = someip::InstanceId{1}});
  model.constants.push_back({.name = "LIMIT", .type = number, .value = "5", .scope = "car"});
  return model;
}

std::vector<std::string> ids(const std::vector<Change>& changes) {
  std::vector<std::string> ids;
  for (const Change& change : changes) {
    ids.emplace_back(change.rule->id);
  }
  return ids;
}

/// What somebody does to the door, and which rules tell it.
struct Edit {
  std::vector<std::string> rules;
  std::function<void(Model&)> edit;
};

Service& service(Model& model) {
  return model.services.front();
}

/// As a FIDL file without its FDEPL.
void leave_out_ids(Service& service) {
  service.id = std::nullopt;
  for (Method& method : service.methods) {
    method.id = std::nullopt;
  }
  for (Event& event : service.events) {
    event.id = std::nullopt;
  }
  for (Field& field : service.fields) {
    field.getter = field.setter = field.notifier = std::nullopt;
  }
}

const std::vector<Edit>& edits() {
  static const std::vector<Edit> all{
      {{"deployment-missing"},
       [](Model& m) {
         leave_out_ids(service(m));
         service(m).methods.front().request_transfer.transport = Transport::tcp;
       }},
      {{"service-added"}, [](Model& m) { m.services.push_back({.name = "Window"}); }},
      {{"service-removed"}, [](Model& m) { m.services.clear(); }},
      {{"service-renamed"},
       [](Model& m) {
         service(m).name = "Gate";
         m.instances.front().service = "car.Gate";
       }},
      {{"service-id"}, [](Model& m) { service(m).id = someip::ServiceId{0x4321}; }},
      {{"service-major"}, [](Model& m) { service(m).major = 2; }},
      {{"service-minor"}, [](Model& m) { service(m).minor = 7; }},
      {{"method-added"},
       [](Model& m) { service(m).methods.push_back({.name = "shut", .id = someip::MethodId{9}}); }},
      {{"method-removed"}, [](Model& m) { service(m).methods.clear(); }},
      {{"method-renamed"}, [](Model& m) { service(m).methods.front().name = "unlock"; }},
      {{"method-id"}, [](Model& m) { service(m).methods.front().id = someip::MethodId{5}; }},
      {{"method-fire-and-forget"}, [](Model& m) { service(m).methods.front().fire_and_forget = true; }},
      {{"error-changed"},
       [](Model& m) {
         Method& open = service(m).methods.front();
         open.response.values.insert(open.response.values.begin(), {.name = "error", .type = open.error});
         open.error = no_type;
       }},
      {{"event-added"},
       [](Model& m) { service(m).events.push_back({.name = "shut", .id = someip::MethodId{0x8009}}); }},
      {{"event-removed"}, [](Model& m) { service(m).events.clear(); }},
      {{"event-renamed"}, [](Model& m) { service(m).events.front().name = "turned"; }},
      {{"event-id"}, [](Model& m) { service(m).events.front().id = someip::MethodId{0x8005}; }},
      {{"event-eventgroups"},
       [](Model& m) { service(m).events.front().eventgroups = {someip::EventgroupId{2}}; }},
      {{"event-eventgroups-added"},
       [](Model& m) { service(m).events.front().eventgroups.push_back(someip::EventgroupId{7}); }},
      {{"event-selective"}, [](Model& m) { service(m).events.front().selective = true; }},
      {{"event-cycle"}, [](Model& m) { service(m).events.front().cycle = std::chrono::milliseconds{20}; }},
      {{"event-cycle"}, [](Model& m) { service(m).fields.front().cycle = std::chrono::milliseconds{20}; }},
      {{"method-timeout"},
       [](Model& m) { service(m).methods.front().timeout = std::chrono::milliseconds{250}; }},
      {{"collecting"},
       [](Model& m) { service(m).events.front().transfer.retention = std::chrono::milliseconds{5}; }},
      {{"instance-added"},
       [](Model& m) {
         m.instances.push_back({.name = "rear", .service = "car.Door", .id = someip::InstanceId{2}});
       }},
      {{"instance-removed"},
       [](Model& m) { m.instances.front() = {.service = "car.Window", .id = someip::InstanceId{1}}; }},
      {{"client-added"},
       [](Model& m) { m.instances.push_back({.role = Instance::Role::required, .service = "car.Door"}); }},
      {{"instance-removed", "client-added"},
       [](Model& m) { m.instances.front().role = Instance::Role::required; }},
      {{"instance-id"}, [](Model& m) { m.instances.front().id = someip::InstanceId{3}; }},
      {{"instance-endpoint"}, [](Model& m) { m.instances.front().address = IpAddress::v4(10, 0, 0, 1); }},
      {{"instance-endpoint", "instance-endpoint"},
       [](Model& m) { m.instances.front().udp_port = m.instances.front().tcp_port = 30501; }},
      {{"instance-multicast"},
       [](Model& m) {
         m.instances.front().multicast = {{someip::EventgroupId{1}, {IpAddress::v4(239, 0, 0, 1), 30600}, 1}};
       }},
      {{"instance-timing"}, [](Model& m) { m.instances.front().timing = sd::Timing{}; }},
      {{"instance-settings"}, [](Model& m) { m.instances.front().priority = 3; }},
      {{"instance-settings"},
       [](Model& m) {
         m.instances.front().configuration = {{"side", "left"}};
       }},
      {{"constant-value"}, [](Model& m) { m.constants.front().value = "6"; }},
      {{"constant-renamed"}, [](Model& m) { m.constants.front().scope = "car.Types"; }},
      {{"constant-added"},
       [](Model& m) { m.constants.push_back({.name = "MORE", .type = number, .value = "7"}); }},
      {{"constant-added", "constant-removed"}, [](Model& m) { m.constants.front().name = "MOST"; }},
      {{"value-range"}, [](Model& m) { m.at(number).minimum = 5; }},
      {{"value-invalid"}, [](Model& m) { m.at(number).invalid_value = 5; }},
      {{"value-unit"}, [](Model& m) { m.at(status).members[1].notes.unit = "km/h"; }},
      // Of elements alone, not of the whole array as well.
      {{"value-unit"}, [](Model& m) { m.at(list).element.notes.unit = "km/h"; }},
      {{"value-default"}, [](Model& m) { m.at(status).members[1].default_value = "1"; }},
      {{"transport"},
       [](Model& m) {
         service(m).methods.front().request_transfer.transport =
             service(m).methods.front().response_transfer.transport = Transport::tcp;
       }},
      {{"transport"}, [](Model& m) { service(m).events.front().transfer.transport = Transport::tcp; }},
      {{"segmentation"}, [](Model& m) { service(m).events.front().transfer.segment_bytes = 1000; }},
      {{"byte-order"}, [](Model& m) { service(m).events.front().payload.byte_order = std::endian::little; }},
      {{"alignment"}, [](Model& m) { service(m).events.front().payload.alignment = 4; }},
      {{"protection"}, [](Model& m) { service(m).events.front().e2e.profile = "4"; }},
      {{"field-added"},
       [](Model& m) { service(m).fields.push_back({.name = "lamp", .notifier = someip::MethodId{0x8009}}); }},
      {{"field-removed"}, [](Model& m) { service(m).fields.clear(); }},
      {{"field-renamed"}, [](Model& m) { service(m).fields.front().name = "sign"; }},
      {{"field-id"}, [](Model& m) { service(m).fields.front().getter = someip::MethodId{7}; }},
      {{"field-access-removed"}, [](Model& m) { service(m).fields.front().has_setter = false; }},
      {{"value-renamed"}, [](Model& m) { m.at(status).members[1].name = "degrees"; }},
      {{"value-moved", "value-moved"},
       [](Model& m) { std::swap(m.at(status).members[0].name, m.at(status).members[1].name); }},
      {{"value-appended"},
       [](Model& m) { m.at(status).members.push_back({.name = "speed", .type = number}); }},
      {{"value-appended-behind-length"},
       [](Model& m) { m.at(long_status).members.push_back({.name = "speed", .type = number}); }},
      {{"value-removed"}, [](Model& m) { m.at(status).members.pop_back(); }},
      {{"member-optional-added"},
       [](Model& m) {
         m.at(extras).members.push_back(
             {.name = "c", .type = number, .tag = someip::DataId{3}, .optional = true});
       }},
      {{"member-optional-removed"}, [](Model& m) { m.at(extras).members.pop_back(); }},
      {{"member-tag"}, [](Model& m) { m.at(extras).members[0].tag = someip::DataId{4}; }},
      {{"member-optional"}, [](Model& m) { m.at(extras).members[0].optional = true; }},
      {{"type-changed"}, [](Model& m) { m.at(status).members[1].type = text; }},
      {{"type-form", "type-form"}, [](Model& m) { m.at(mode) = {.kind = Kind::primitive, .name = "Mode"}; }},
      {{"type-renamed"}, [](Model& m) { m.at(status).name = "State"; }},
      {{"layout"},
       [](Model& m) {
         service(m).fields.front().payload.values.front().wire.encoding = someip::StringEncoding::utf16be;
       }},
      {{"size-fixed"}, [](Model& m) { m.at(list).fixed_size = true; }},
      {{"size-raised"}, [](Model& m) { m.at(list).max_size = 9; }},
      {{"size-raised"}, [](Model& m) { m.at(list).max_size = 0; }},
      {{"size-lowered"}, [](Model& m) { m.at(list).max_size = 4; }},
      {{"enumerator-added"},
       [](Model& m) {
         m.at(mode).enumerators.push_back({"AJAR", 2});
       }},
      {{"enumerator-removed"}, [](Model& m) { m.at(mode).enumerators.pop_back(); }},
      {{"enumerator-renamed"}, [](Model& m) { m.at(mode).enumerators[1].name = "CLOSED"; }},
      {{"enumerator-value"}, [](Model& m) { m.at(mode).enumerators[1].value = 7; }},
      {{"alternative-added"},
       [](Model& m) { m.at(either).members.push_back({.name = "third", .type = number}); }},
      {{"alternative-removed"}, [](Model& m) { m.at(either).members.pop_back(); }},
      {{"alternative-selector"},
       [](Model& m) {
         m.at(either).selectors = {1, 9};
       }},
  };
  return all;
}

TEST(Compare, FindsNothingBetweenEquals) {
  EXPECT_THAT(compare(door(), door()), IsEmpty());
}

TEST(Compare, TellsEachKindOfChangeAndNothingElse) {
  for (const Edit& edit : edits()) {
    Model edited = door();
    edit.edit(edited);
    EXPECT_EQ(ids(compare(door(), edited)), edit.rules);
  }
}

TEST(Compare, TellsTheReverse) {
  Model without = door();
  service(without).fields.front().has_setter = false;
  EXPECT_THAT(ids(compare(without, door())), ElementsAre("field-access-added"));
  Model with = door();
  with.instances.push_back({.role = Instance::Role::required, .service = "car.Door"});
  EXPECT_THAT(ids(compare(with, door())), ElementsAre("client-removed"));
}

/// Two languages: what one of them has no form for is no difference.
TEST(Compare, TakesWhatOneLanguageDoesNotSayForUnknown) {
  Model fidl = door();
  fidl.files = {"Door.fidl"};
  service(fidl).place = fidl.constants.front().place = {0, {1, 1}};
  service(fidl).events.front().selective = true;
  service(fidl).events.front().transfer.retention = std::chrono::milliseconds{5};
  service(fidl).methods.front().timeout = std::chrono::milliseconds{250};
  fidl.at(number).minimum = 1;
  fidl.at(status).members[1].notes.unit = "km/h";
  fidl.instances.front().udp_port = 30501;
  fidl.instances.push_back({.name = "rear", .service = "car.Door", .id = someip::InstanceId{2}});
  Model arxml = door();
  arxml.files = {"car.ARXML"};
  service(arxml).place = {0, {1, 1}};
  arxml.constants.clear();
  EXPECT_THAT(ids(compare(fidl, arxml)), IsEmpty());
  EXPECT_THAT(ids(compare(arxml, fidl)), IsEmpty());
  // What both say is compared.
  arxml.at(number).minimum = 2;
  arxml.at(status).members[1].notes.unit = "m/s";
  arxml.instances.front().udp_port = 30502;
  EXPECT_THAT(ids(compare(fidl, arxml)), ElementsAre("value-range", "value-unit", "instance-endpoint"));
  // In one language also what one side alone says: constants, too, of which none is left.
  arxml.files = {"Door2.fidl"};
  EXPECT_THAT(ids(compare(fidl, arxml)),
              ElementsAre("method-timeout", "value-range", "event-selective", "collecting", "value-unit",
                          "instance-endpoint", "instance-removed", "constant-removed"));
}

/// Once, with all that it is true of.
TEST(Compare, TellsOfAllElementsThatHaveAChangedType) {
  Model old = door();
  service(old).fields.push_back({.name = "state",
                                 .payload = {.values = {{.name = "now", .type = status}}},
                                 .getter = someip::MethodId{5},
                                 .has_setter = false,
                                 .has_notifier = false});
  Model edited = old;
  edited.at(status).members.pop_back();
  const std::vector<Change> changes = compare(old, edited);
  ASSERT_THAT(ids(changes), ElementsAre("value-removed"));
  EXPECT_EQ(changes[0].element, "Door.moved.status.angle");
  EXPECT_THAT(changes[0].also, ElementsAre("Door.state.now.angle"));
  // The types in it, too, wherever they were told first.
  edited = old;
  edited.at(mode).enumerators[1].value = 7;
  const std::vector<Change> deep = compare(old, edited);
  ASSERT_THAT(ids(deep), ElementsAre("enumerator-value"));
  EXPECT_EQ(deep[0].element, "Door.open.error.SHUT");
  EXPECT_THAT(deep[0].also, ElementsAre("Door.moved.status.mode.SHUT", "Door.state.now.mode.SHUT"));
}

/// Of both messages of a method, where they do not change alike.
TEST(Compare, TellsOfRequestAndAnswerByThemselves) {
  Model edited = door();
  service(edited).methods.front().response_transfer.segment_bytes = 64;
  const std::vector<Change> changes = compare(door(), edited);
  ASSERT_THAT(ids(changes), ElementsAre("segmentation"));
  EXPECT_EQ(changes[0].element, "Door.open.response");
}

TEST(Compare, TellsWhatBreaksReceivers) {
  const auto impact = [](std::string_view id) {
    return std::ranges::find(change_rules(), id, &ChangeRule::id)->wire;
  };
  EXPECT_EQ(impact("value-moved"), Impact::breaking);
  EXPECT_EQ(impact("size-raised"), Impact::breaking);
  EXPECT_EQ(impact("size-lowered"), Impact::breaking);
  EXPECT_EQ(impact("event-eventgroups-added"), Impact::compatible);
  EXPECT_EQ(impact("event-eventgroups"), Impact::breaking);
  // One that moves while another name takes its place.
  Model edited = door();
  edited.at(status).members[0].name = "angle";
  edited.at(status).members[1].name = "speed";
  EXPECT_THAT(ids(compare(door(), edited)), ElementsAre("value-moved", "value-moved"));
}

TEST(Compare, HasAnEditForEachRule) {
  // The second needs more than an edit: bounds_test.cpp.
  std::set<std::string, std::less<>> tried{"field-access-added", "client-removed", "not-compared"};
  for (const Edit& edit : edits()) {
    tried.insert(edit.rules.begin(), edit.rules.end());
  }
  for (const ChangeRule& rule : change_rules()) {
    EXPECT_THAT(tried, Contains(rule.id)) << "no test tries this rule";
  }
}

TEST(Compare, LooksAtTheLengthFieldOfTheUse) {
  // The type says that it has one, and the use of it has none.
  Model old = door();
  old.at(status).wire.length = someip::FieldWidth::bits32;
  Model longer = old;
  longer.at(status).members.push_back({.name = "speed", .type = number});
  EXPECT_THAT(ids(compare(old, longer)), ElementsAre("value-appended"));
  // Used in both ways: what hurts more is told, too.
  service(old).events.front().payload.values.push_back({.name = "again", .type = long_status});
  longer = old;
  longer.at(long_status).members.push_back({.name = "speed", .type = number});
  EXPECT_THAT(ids(compare(old, longer)), ElementsAre("value-appended-behind-length", "value-appended"));
}

TEST(Compare, LooksAtTheLengthFieldsBeforeTaggedMembers) {
  const auto with = [](someip::FieldWidth width, TypeIndex type) {
    Model model = door();
    model.at(extras).members[0].type = type;
    service(model).methods.front().request.tagged_length = width;
    return model;
  };
  const std::vector<Change> changes =
      compare(with(someip::FieldWidth::bits32, text), with(someip::FieldWidth::bits16, text));
  ASSERT_THAT(ids(changes), ElementsAre("layout"));
  EXPECT_EQ(changes[0].element, "Door.open.request");
  EXPECT_EQ(changes[0].before, "length fields before tagged members 32 bits");
  EXPECT_EQ(changes[0].after, "length fields before tagged members 16 bits");
  // Numbers have none.
  EXPECT_THAT(compare(with(someip::FieldWidth::bits32, number), with(someip::FieldWidth::bits16, number)),
              IsEmpty());
}

TEST(Compare, TakesTypesThatAreNone) {
  Model old = door();
  old.at(list).element.type = no_type;
  service(old).methods.front().request.values.front().type = no_type;
  EXPECT_THAT(compare(old, old), IsEmpty());
  EXPECT_THAT(ids(compare(old, door())), Contains("type-changed"));
}

TEST(Compare, NamesTheElementAndWhatItWas) {
  Model edited = door();
  edited.at(mode).enumerators[1].value = 7;
  edited.at(mode).enumerators[1].place = {.file = 0, .mark = {12, 5}};
  const std::vector<Change> changes = compare(door(), edited);
  ASSERT_EQ(changes.size(), 1);
  EXPECT_EQ(changes[0].element, "Door.open.error.SHUT");  // the first use of the type
  EXPECT_EQ(changes[0].before, "1");
  EXPECT_EQ(changes[0].after, "7");
  EXPECT_EQ(changes[0].new_place.mark, (documents::Mark{12, 5}));
}

TEST(Compare, TellsTheBytesOfBothSides) {
  Model edited = door();
  edited.at(status).members[1].type = text;
  edited.at(status).members[1].wire = default_wire(Kind::string);
  edited.at(status).members.push_back({.name = "near", .type = mode});
  service(edited).events.front().payload.values[0].wire.byte_order = std::endian::little;
  edited.at(long_status).members.push_back({.name = "speed", .type = number});
  const std::vector<Change> changes = compare(door(), edited);
  ASSERT_THAT(ids(changes),
              ElementsAre("layout", "type-changed", "value-appended", "value-appended-behind-length"));
  EXPECT_EQ(changes[1].element, "Door.moved.status.angle");
  EXPECT_EQ(changes[1].before, "uint16 (16 bits, big endian, at byte 1)");
  EXPECT_EQ(changes[1].after, "string (length field 32 bits, UTF-8, BOM, terminator, at byte 1)");
  EXPECT_EQ(changes[2].before, "");
  EXPECT_EQ(changes[2].after, "Mode (enumeration, uint8, 8 bits, at byte 5 + status.angle)");
  EXPECT_THAT(changes[3].after, StartsWith("uint16 (16 bits, big endian, at byte "));
}

TEST(Compare, KnowsTypesThatAreTheSameBytes) {
  Model buffer = door();
  buffer.at(list) = {.kind = Kind::bytes, .max_size = 8};
  Model bytes = door();
  bytes.at(number).primitive = messages::Primitive::uint8;
  Model chars = door();
  chars.at(number).primitive = messages::Primitive::character;
  EXPECT_THAT(compare(bytes, chars), IsEmpty());
  for (const Model* const other : {&bytes, &chars}) {
    const std::vector<Change> changes = compare(buffer, *other);
    ASSERT_THAT(ids(changes), Contains("type-form"));
    for (const Change& change : changes) {
      EXPECT_EQ(change.element == "Door.moved.angles", std::string{change.rule->id} == "type-form");
    }
  }
  // With another length field they are other bytes.
  service(bytes).events.front().payload.values[1].wire.length = someip::FieldWidth::bits16;
  EXPECT_THAT(ids(compare(buffer, bytes)), Contains("layout"));
}

TEST(Compare, ComparesAnErrorWithTheValueThatIsOneNoMore) {
  Model edited = door();
  Method& open = service(edited).methods.front();
  open.response.values.insert(open.response.values.begin(), {.name = "error", .type = number});
  open.error = no_type;
  const std::vector<Change> changes = compare(door(), edited);
  EXPECT_THAT(ids(changes), ElementsAre("error-changed", "type-changed"));
  EXPECT_EQ(changes[0].rule->wire, Impact::none);
  EXPECT_EQ(changes[1].element, "Door.open.response.error");
}

TEST(Compare, TellsTheWidthOfAnEnumerationAndWhatElseChangedInIt) {
  Model old = door();
  old.at(mode).primitive = messages::Primitive::uint16;
  Model edited = door();
  edited.at(mode).primitive = messages::Primitive::uint8;
  edited.at(mode).enumerators.push_back({"AJAR", 2});
  const std::vector<Change> changes = compare(old, edited);
  ASSERT_THAT(ids(changes), ElementsAre("layout", "enumerator-added"));
  EXPECT_EQ(changes[0].before, "16 bits");
  EXPECT_EQ(changes[0].after, "8 bits");
  EXPECT_EQ(changes[0].rule->api, Impact::none);
}

/// What a description without names, types and methods of fields says of door().
Model ids_of_door() {
  Model model;
  Service bare{.name = "service_1234", .id = someip::ServiceId{0x1234}};
  bare.events = {{.name = "event_8001",
                  .id = someip::MethodId{0x8001},
                  .payload = {.known = false},
                  .eventgroups = {someip::EventgroupId{1}}}};
  bare.fields = {{.name = "field_8002",
                  .payload = {.known = false},
                  .notifier = someip::MethodId{0x8002},
                  .has_getter = false,
                  .has_setter = false}};
  model.services = {bare};
  model.instances = {{.service = bare.name, .service_id = bare.id, .udp_port = 30509}};
  return model;
}

TEST(Compare, SkipsWhatADescriptionOfIdsDoesNotSay) {
  Model full = door();
  service(full).has_version = true;
  service(full).major = 2;
  service(full).methods.front().request_transfer.transport = Transport::tcp;
  service(full).methods.front().fire_and_forget = true;
  service(full).fields.front().getter_transfer.transport = Transport::tcp;
  Model bare = ids_of_door();
  EXPECT_THAT(ids(compare(full, bare)), IsEmpty());
  EXPECT_THAT(ids(compare(bare, full)), IsEmpty());
  // A method, a getter and a setter are methods there.
  for (const int id : {1, 2, 3}) {
    service(bare).methods.push_back({.name = "method", .id = static_cast<someip::MethodId>(id)});
    service(bare).methods.back().request.known = service(bare).methods.back().response.known = false;
  }
  EXPECT_THAT(ids(compare(full, bare)), IsEmpty());
  EXPECT_THAT(ids(compare(bare, full)), IsEmpty());
}

TEST(Compare, SkipsTheAnswerOfWhatHasNone) {
  Model old = door();
  service(old).methods.front().fire_and_forget = true;
  Model now = old;
  service(now).methods.front().response_transfer.transport = Transport::tcp;
  EXPECT_THAT(ids(compare(old, now)), IsEmpty());
  service(now).methods.front().fire_and_forget = service(old).methods.front().fire_and_forget = false;
  EXPECT_THAT(ids(compare(old, now)), ElementsAre("transport"));
}

TEST(Compare, FindsWhatADescriptionOfIdsSaysOtherwise) {
  Model bare = ids_of_door();
  service(bare).events.front().transfer.transport = Transport::tcp;
  service(bare).fields.front().eventgroups = {someip::EventgroupId{7}};
  service(bare).events.push_back(
      {.name = "event_8009", .id = someip::MethodId{0x8009}, .payload = {.known = false}});
  const std::vector<Change> changes = compare(door(), bare);
  EXPECT_THAT(ids(changes), ElementsAre("transport", "event-added", "event-eventgroups"));
  EXPECT_EQ(changes[0].element, "Door.moved");
  service(bare).events.erase(service(bare).events.begin());
  EXPECT_THAT(ids(compare(door(), bare)), Contains("event-removed"));
  // A capture has what was seen, with the transport of methods.
  service(bare).methods = {{.name = "method_0001", .id = someip::MethodId{1}, .observed_bytes = 3}};
  service(bare).methods[0].request = service(bare).methods[0].response = {.known = false};
  service(bare).methods[0].request_transfer.transport = Transport::tcp;
  const auto seen = ids(compare(door(), bare));
  EXPECT_THAT(seen, ::testing::Not(Contains("event-removed")));
  EXPECT_THAT(seen, Contains("transport"));
}

TEST(Compare, ComparesWhatAProtectionPutsOnTheWire) {
  Model old = door();
  Protection& e2e = service(old).events.front().e2e;
  e2e = {.profile = "4", .numbers = {{"data_id", 0x1234}, {"max_delta_counter", 1}}};
  // What the receiver tolerates, a default that is written down, and a profile of the same bytes.
  for (const Protection& same :
       {Protection{.profile = "4", .numbers = {{"data_id", 0x1234}, {"max_delta_counter", 9}}},
        Protection{.profile = "4", .numbers = {{"data_id", 0x1234}, {"offset_bits", 64}}},
        Protection{.profile = "4",
        .numbers = {{"data_id", 0x1234}, {"window_size_valid", 5}},
        .words = {{"payload_only", "false"}}},
        Protection{.profile = "44", .numbers = {{"data_id", 0x1234}}}}) {
    Model edited = door();
    service(edited).events.front().e2e = same;
    EXPECT_THAT(compare(old, edited), IsEmpty());
  }
  Model edited = door();
  service(edited).events.front().e2e = {.profile = "4",
                                        .numbers = {{"data_id", 0x1235}, {"offset_bits", 128}}};
  const std::vector<Change> changes = compare(old, edited);
  ASSERT_THAT(ids(changes), ElementsAre("protection"));
  EXPECT_EQ(changes[0].before, "profile 4, data_id 0x1234, offset_bits 64");
  EXPECT_EQ(changes[0].after, "profile 4, data_id 0x1235, offset_bits 128");
  // The list is the same in whatever numbers it is written.
  e2e = {.profile = "2", .numbers = {{"data_bits", 80}}, .words = {{"data_id_list", "0x10 2 3"}}};
  service(edited).events.front().e2e = {.profile = "2", .words = {{"data_id_list", "16 2 3"}}};
  EXPECT_THAT(compare(old, edited), IsEmpty());
  service(edited).events.front().e2e.words["data_id_list"] = "16 2 4";
  EXPECT_THAT(ids(compare(old, edited)), ElementsAre("protection"));
}

TEST(Compare, ComparesTheProtectionOfEachInstance) {
  Model old = door();
  old.instances.clear();
  for (const std::uint16_t id : {std::uint16_t{1}, std::uint16_t{2}}) {
    old.instances.push_back(
        {.service = full_name(service(old).scope, service(old).name), .id = someip::InstanceId{id}});
  }
  Protection& e2e = service(old).events.front().e2e;
  e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  e2e.set(someip::InstanceId{2}, {.profile = "4", .numbers = {{"data_id", 2}}});
  // The other way round it is the same.
  Model now = old;
  Protection& other = service(now).events.front().e2e;
  other = {.profile = "4", .numbers = {{"data_id", 2}}};
  other.set(someip::InstanceId{1}, {.profile = "4", .numbers = {{"data_id", 1}}});
  EXPECT_THAT(compare(old, now), IsEmpty());
  other = {.profile = "4", .numbers = {{"data_id", 1}}};
  const std::vector<Change> changes = compare(old, now);
  ASSERT_THAT(ids(changes), ElementsAre("protection"));
  EXPECT_THAT(changes[0].element, EndsWith(" in instance 0x0002"));
  EXPECT_EQ(changes[0].before, "profile 4, data_id 0x0002");
  EXPECT_EQ(changes[0].after, "profile 4, data_id 0x0001");
}

TEST(Compare, TakesWhatACaptureLeavesOpenForUnknown) {
  Model full = door();
  service(full).events.front().e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  service(full).events.front().transfer.segment_bytes = 1024;
  service(full).events.front().eventgroups = {someip::EventgroupId{1}, someip::EventgroupId{2}};
  service(full).fields.front().eventgroups = {someip::EventgroupId{1}};
  Model seen = ids_of_door();
  service(seen).fields.clear();
  service(seen).events.front().observed_bytes = 7;
  // The getter of a field alone.
  service(seen).methods = {{.name = "method_0002", .id = someip::MethodId{2}, .observed_bytes = 3}};
  service(seen).methods[0].request.known = service(seen).methods[0].response.known = false;
  for (const std::vector<someip::EventgroupId>& groups :
       {std::vector<someip::EventgroupId>{}, {someip::EventgroupId{2}}}) {
    service(seen).events.front().eventgroups = groups;
    EXPECT_THAT(ids(compare(full, seen)), IsEmpty());
    EXPECT_THAT(ids(compare(seen, full)), IsEmpty());
  }
  service(seen).events.front().eventgroups = {someip::EventgroupId{3}};
  EXPECT_THAT(ids(compare(full, seen)), ElementsAre("event-eventgroups"));
}

/// The same interface in two descriptions of ids: vsomeip's JSON, and a capture, which has no fields.
TEST(Compare, ComparesTwoDescriptionsOfIdsByWhatBothSay) {
  const Model json = ids_of_door();
  Model seen = json;
  service(seen).fields.clear();
  service(seen).events = {{.name = "event_8002",
                           .id = someip::MethodId{0x8002},
                           .payload = {.known = false},
                           .observed_bytes = 1}};
  service(seen).methods = {{.name = "method_0001", .id = someip::MethodId{1}, .observed_bytes = 3}};
  service(seen).methods[0].request.known = service(seen).methods[0].response.known = false;
  service(seen).has_version = true;
  service(seen).major = 2;
  EXPECT_THAT(ids(compare(json, seen)), IsEmpty());
  EXPECT_THAT(ids(compare(seen, json)), IsEmpty());
  // Another capture, of other calls and subscriptions.
  Model other = seen;
  service(other).methods[0].id = someip::MethodId{7};
  service(other).methods[0].name = "method_0007";
  service(seen).events[0].eventgroups = {someip::EventgroupId{1}};
  service(other).events[0].eventgroups = {someip::EventgroupId{2}};
  EXPECT_THAT(ids(compare(seen, other)), IsEmpty());
  // What both say is compared.
  service(other).major = 3;
  service(other).events[0].transfer.transport = Transport::tcp;
  EXPECT_THAT(ids(compare(seen, other)), ElementsAre("service-major", "transport"));
  Model fewer = json;
  service(fewer).events.clear();
  EXPECT_THAT(ids(compare(json, fewer)), ElementsAre("event-removed"));
}

TEST(Compare, TakesTheEventsAndTransportsThatAConfigurationLeavesOutForUnknown) {
  const Model full = door();
  Model bare = ids_of_door();
  service(bare).events[0].eventgroups.clear();
  EXPECT_THAT(ids(compare(full, bare)), IsEmpty());
  Model tcp = full;
  service(tcp).events[0].transfer.transport = Transport::tcp;
  EXPECT_THAT(ids(compare(tcp, bare)), ElementsAre("transport"));
  bare.instances.clear();  // within one host
  EXPECT_THAT(ids(compare(tcp, bare)), IsEmpty());
  service(bare).events.clear();
  service(bare).fields.clear();
  for (const Model& other : {full, ids_of_door()}) {
    EXPECT_THAT(ids(compare(other, bare)), IsEmpty());
    EXPECT_THAT(ids(compare(bare, other)), IsEmpty());
  }
  // A field without notifier is methods alone, which such a description does not have.
  Model polled = full;
  service(polled).fields[0].has_notifier = false;
  service(polled).fields[0].notifier = std::nullopt;
  bare = ids_of_door();
  service(bare).fields.clear();
  EXPECT_THAT(ids(compare(polled, bare)), IsEmpty());
}

TEST(Compare, FindsTheVersionOfTheServiceThatADescriptionOfIdsHas) {
  Model both = door();
  both.services.push_back(both.services.front());
  both.services.back().name = "DoorV2";
  both.services.back().major = 2;
  both.services.back().has_version = both.services.front().has_version = true;
  Model bare = ids_of_door();
  service(bare).has_version = true;
  service(bare).major = 2;
  EXPECT_THAT(ids(compare(bare, both)), ElementsAre("service-added"));
}

TEST(Compare, TakesTheServicesThatACaptureDoesNotShowForUnknown) {
  Model full = door();
  full.services.push_back({.name = "Window", .id = someip::ServiceId{0x1235}});
  Model seen;
  seen.services = {{.name = "service_1234", .id = someip::ServiceId{0x1234}, .has_version = true}};
  EXPECT_THAT(ids(compare(full, seen)), IsEmpty());
  EXPECT_THAT(ids(compare(seen, full)), IsEmpty());
  // A configuration has them all.
  EXPECT_THAT(ids(compare(full, ids_of_door())), ElementsAre("service-removed"));
}

TEST(Compare, TakesAnIdThatNobodyGaveForUnknown) {
  const Model full = door();
  Model without = full;
  service(without).id = std::nullopt;
  service(without).methods[0].id = std::nullopt;
  service(without).events[0].id = std::nullopt;
  service(without).events[0].eventgroups.clear();
  service(without).fields[0].getter = service(without).fields[0].notifier = std::nullopt;
  service(without).fields[0].eventgroups.clear();
  EXPECT_THAT(ids(compare(full, without)), IsEmpty());
  EXPECT_THAT(ids(compare(without, full)), IsEmpty());
  EXPECT_THAT(
      ids(compare(full, without, MissingId::different)),
      ElementsAre("service-id", "method-id", "event-id", "event-eventgroups", "field-id", "field-id"));
}

TEST(Compare, TellsInOneLineWhatOneSideLeavesOpenWithoutDeployment) {
  Model full = door();
  // As a FDEPL would have it: widths, limits, eventgroups, transports.
  service(full).fields[0].payload.values[0].wire.length = someip::FieldWidth::bits16;
  service(full).methods[0].request_transfer.transport = Transport::tcp;
  full.at(list).fixed_size = true;
  full.at(mode).primitive = messages::Primitive::uint32;
  Model without = door();
  leave_out_ids(service(without));
  EXPECT_THAT(ids(compare(full, without)), ElementsAre("deployment-missing"));
  EXPECT_THAT(ids(compare(without, full)), ElementsAre("deployment-missing"));
  // Names and types are compared.
  service(without).events[0].name = "turned";
  without.at(extras).members[0].type = text;
  EXPECT_THAT(ids(compare(full, without)),
              ElementsAre("type-changed", "event-added", "event-removed", "deployment-missing"));
  // With one id, a deployment is there.
  without = door();
  service(without).id = std::nullopt;
  EXPECT_THAT(ids(compare(full, without)), Contains("transport"));
}

TEST(Compare, FindsAServiceWithoutIdByTheLastPartOfItsNameOrItsMembers) {
  const Model full = door();
  Model without = full;
  service(without).id = std::nullopt;
  service(without).scope = "body";
  EXPECT_THAT(ids(compare(without, full)), ElementsAre("service-renamed"));
  EXPECT_THAT(ids(compare(full, without)), ElementsAre("service-renamed"));
  service(without).name = "Doors";
  EXPECT_THAT(ids(compare(without, full)), ElementsAre("service-renamed"));
  // With ids on both sides, or nothing in common, it is another one.
  Model other = without;
  service(other).id = someip::ServiceId{0x4321};
  EXPECT_THAT(ids(compare(other, full)), ElementsAre("service-added", "service-removed"));
  service(without).methods.clear();
  service(without).fields.clear();
  service(without).events.clear();
  EXPECT_THAT(ids(compare(without, full)), ElementsAre("service-added", "service-removed"));
}

TEST(Compare, TakesTheNamesOfARouteFileForThoseOfInterfaces) {
  Model routes = door();
  service(routes).scope = "door";
  service(routes).methods[0].ros_name = "/door/open_it";
  service(routes).methods[0].name = "open_it";
  Model interfaces = door();
  service(interfaces).id = std::nullopt;
  service(interfaces).methods[0].name = "openIt";
  service(interfaces).methods[0].id = std::nullopt;
  EXPECT_THAT(compare(interfaces, routes), IsEmpty());
  EXPECT_THAT(compare(routes, interfaces), IsEmpty());
}

TEST(Compare, TakesAScopeInTheSpellingOfAnotherLanguageForTheSame) {
  const auto named = [](std::string scope, std::vector<std::string> namespaces = {}) {
    Model model = door();
    service(model).scope = std::move(scope);
    service(model).namespaces = std::move(namespaces);
    return model;
  };
  EXPECT_THAT(compare(named("org.car"), named("/org/car")), IsEmpty());
  EXPECT_THAT(compare(named("org.car"), named("/Services/Body", {"org", "car"})), IsEmpty());
  EXPECT_THAT(compare(named("/org/car", {"a"}), named("org.car")), IsEmpty());
  EXPECT_THAT(ids(compare(named("org.car"), named("/org/truck"))), ElementsAre("service-renamed"));
  // Found by its name also where the id is another one.
  Model other = named("/org/car");
  service(other).id = someip::ServiceId{0x4321};
  EXPECT_THAT(ids(compare(named("org.car"), other)), ElementsAre("service-id"));
}

TEST(Compare, EndsWithTypesThatContainThemselves) {
  Model old = door();
  old.at(list).element.type = list;
  EXPECT_THAT(compare(old, old), IsEmpty());
}

}  // namespace
}  // namespace trestle::describe
