#include "bridge/describe/model.hpp"

#include <gmock/gmock.h>

#include "bridge/describe/edits.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;

Type structure(std::string name, TypeIndex base, std::vector<std::string> members, TypeIndex of) {
  Type type{.kind = Kind::structure, .name = std::move(name), .base = base};
  for (std::string& member : members) {
    type.members.push_back({.name = std::move(member), .type = of});
  }
  return type;
}

std::vector<std::string> names(const std::vector<Value>& values) {
  std::vector<std::string> names;
  for (const Value& value : values) {
    names.push_back(value.name);
  }
  return names;
}

Model with_inheritance() {
  Model model;
  model.files = {"a.fidl"};
  const TypeIndex number = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::int16});
  const TypeIndex base = model.add(structure("Base", no_type, {"a", "b"}, number));
  const TypeIndex alias = model.add({.kind = Kind::alias, .name = "Alias", .element = {.type = base}});
  model.add(structure("Derived", alias, {"c"}, number));
  return model;
}

TEST(Model, TellsTheMembersOfBasesFirst) {
  const Model model = with_inheritance();
  EXPECT_THAT(names(all_members(model, model.types[3])), ElementsAre("a", "b", "c"));
}

TEST(Model, EndsWithBasesAndAliasesThatGoRound) {
  Model model = with_inheritance();
  model.types[1].base = TypeIndex{3};
  EXPECT_FALSE(all_members(model, model.types[3]).empty());
  model.types[2].element.type = TypeIndex{2};
  EXPECT_EQ(resolved(model, TypeIndex{2}).name, "Alias");
}

TEST(Model, KeepsIndicesRightWhenItIsAppended) {
  Model model = with_inheritance();
  Model other = with_inheritance();
  other.types[3].place = {.file = 0, .mark = {7, 1}};
  other.services.push_back(
      {.name = "S", .fields = {{.name = "f", .payload = {.values = {{.type = TypeIndex{3}}}}}}});
  append(model, std::move(other));
  EXPECT_THAT(names(all_members(model, model.types[7])), ElementsAre("a", "b", "c"));
  EXPECT_EQ(model.types[7].place.file, 1);
  EXPECT_EQ(model.types[7].variant_of, no_type);
  EXPECT_EQ(model.services.front().fields.front().payload.values.front().type, TypeIndex{7});
}

TEST(Edits, GiveAnInstanceItsProtectionUnderItsNewId) {
  Model model;
  model.services = {{.name = "Door", .events = {{.name = "moved", .e2e = {.profile = "4"}}}}};
  Protection& e2e = model.services[0].events[0].e2e;
  e2e.set(someip::InstanceId{2}, {.profile = "7"});
  model.instances = {{.service = "Door", .id = someip::InstanceId{2}}};
  EXPECT_TRUE(apply_edits({{"Door", {.instance = std::uint16_t{5}}}}, model).problems.empty());
  EXPECT_EQ(e2e.of(someip::InstanceId{5}).profile, "7");
  EXPECT_EQ(e2e.of(someip::InstanceId{2}).profile, "4");
  // Others with the old id keep it.
  model.instances.push_back(model.instances[0]);
  EXPECT_TRUE(apply_edits({{"Door", {.instance = std::uint16_t{6}}}}, model).problems.empty());
  EXPECT_EQ(e2e.of(someip::InstanceId{5}).profile, "7");
  EXPECT_EQ(e2e.of(someip::InstanceId{6}).profile, "7");
}

TEST(Model, NamesElementsByScope) {
  EXPECT_EQ(full_name("org.example", "Door"), "org.example.Door");
  EXPECT_EQ(full_name("/Services/Body", "Door"), "/Services/Body/Door");
  EXPECT_EQ(full_name("", "Door"), "Door");
}

}  // namespace
}  // namespace trestle::describe
