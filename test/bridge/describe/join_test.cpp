#include "bridge/describe/join.hpp"

#include <gmock/gmock.h>

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// As a FIDL file tells of it.
Model described() {
  Model model{.files = {"Door.fidl"}};
  const TypeIndex number = model.add({.primitive = messages::Primitive::uint8});
  Service door{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  door.events = {{.name = "moved",
                  .id = someip::MethodId{0x8001},
                  .payload = {.values = {{.name = "x", .type = number}}}}};
  door.fields = {
      {.name = "angle", .payload = {.values = {{.type = number}}}, .notifier = someip::MethodId{0x8002}}};
  door.place = {.file = 0, .mark = {3, 1}};
  model.services = {door};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{1}}};
  return model;
}

/// As vsomeip JSON tells of it.
Model configured() {
  Model model{.files = {"vsomeip.json"}};
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

TEST(Join, KeepsWhatNobodyDescribes) {
  Model model = configured();
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_THAT(model.services, SizeIs(1));
  EXPECT_EQ(model.instances.front().service, "service_1234");
}

TEST(Join, TellsOfServicesThatAreThereTwice) {
  Model model = described();
  append(model, described());
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems.front().text, "service car.Door is described twice, also at Door.fidl:3:1");
  EXPECT_EQ(problems.front().mark, (documents::Mark{3, 1}));
}

TEST(Join, TellsOfIdsThatAreThereTwice) {
  Model model = described();
  model.services.push_back({.name = "Window", .scope = "car", .id = someip::ServiceId{0x1234}});
  model.services.front().methods = {{.name = "open", .id = someip::MethodId{0x8002}}};
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(2));
  EXPECT_THAT(problems[0].text, HasSubstr("service Window has the id 0x1234 of Door"));
  EXPECT_THAT(problems[1].text, HasSubstr("Door.angle (notifier) has the id 0x8002 of Door.open"));
}

TEST(Join, RefusesTypesThatAreNestedTooDeep) {
  const auto nested = [](std::uint32_t count) {
    Model model;
    model.add({.primitive = messages::Primitive::uint8});
    for (std::uint32_t i = 0; i < count; ++i) {
      model.add({.kind = Kind::array, .element = {.type = TypeIndex{i}}});
    }
    return model;
  };
  Model good = nested(199);
  EXPECT_THAT(join(good), IsEmpty());
  Model deep = nested(30'000);
  ASSERT_THAT(join(deep), SizeIs(1));
  EXPECT_EQ(join(deep).front().text, "types are nested more than 200 deep");
  Model round = nested(3);
  round.types[1].element.type = TypeIndex{3};
  round.types[2].members = {{.name = "a", .type = TypeIndex{2}}, {.name = "b", .type = TypeIndex{1}}};
  EXPECT_THAT(join(round), IsEmpty()) << "a circle has an end";
}

TEST(Join, LetsTwoMajorVersionsHaveOneId) {
  Model model = described();
  model.services.push_back({.name = "Door2", .scope = "car", .id = someip::ServiceId{0x1234}, .major = 2});
  EXPECT_THAT(join(model), IsEmpty());
}

}  // namespace
}  // namespace trestle::describe
