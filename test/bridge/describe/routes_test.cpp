#include <fmt/format.h>
#include <gmock/gmock.h>

#include "bridge/describe/write/routes/route_entries.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

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
  for (const NotCarried& one : lost) {
    made.lost.push_back(one.element + ": " + one.what);
  }
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

TEST(RouteEntries, GiveEachMemberATopicOfItsOwn) {
  Model model = lamp();
  model.services.push_back(model.services[0]);
  model.services[1].scope = "house.hall";
  model.services[1].id = someip::ServiceId{0x1235};
  model.instances.push_back({.service = "house.hall.Lamp", .id = someip::InstanceId{1}});
  model.services[0].fields.push_back(model.services[0].fields[0]);
  model.services[0].fields[1].name = "Colour";
  std::vector<std::string> topics;
  for (const RouteEntry& entry : made_of(model).entries) {
    topics.push_back(entry.node["topic"].Scalar());
  }
  EXPECT_THAT(topics, ElementsAre("/car/lamp/colour", "/car/lamp/colour_2", "/house_hall/lamp/colour"));
}

}  // namespace
}  // namespace trestle::describe
