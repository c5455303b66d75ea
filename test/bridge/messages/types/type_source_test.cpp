#include "bridge/messages/types/type_source.hpp"

#include <gmock/gmock.h>

#include <map>

#include "bridge/messages/types/parsers.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "test/bridge/messages/types/folder_test.hpp"

namespace trestle::messages::type_source_test {
namespace {

// A source of a new kind: one text for all interfaces, as an interface description has.
class Description : public TypeSource {
 public:
  explicit Description(std::map<std::string, std::string> texts) : texts_{std::move(texts)} {}

  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override {
    const auto text = texts_.find(interface.full());
    if (text == texts_.end()) {
      return std::nullopt;
    }
    return parse_interface(text->second, interface, place());
  }
  [[nodiscard]] std::string place() const override { return "car.description"; }

 private:
  std::map<std::string, std::string> texts_;
};

class TypeSourceTest : public test::FolderTest {
 protected:
  [[nodiscard]] TypeLibrary library(std::map<std::string, std::string> texts) const {
    return TypeLibrary::of({std::make_shared<FolderSource>(root_),
                            std::make_shared<Description>(std::move(texts)),
                            std::make_shared<BuiltinSource>()});
  }
};

std::string first_field(TypeLibrary& library, std::string_view type) {
  const auto tree = library.resolve(type);
  return tree ? tree->root().fields.at(0).name : to_string(tree.error());
}

TEST_F(TypeSourceTest, AreAskedInTheirOrder) {
  write("a/msg/InFolder.msg", "uint8 folder\n");
  TypeLibrary types = library({{"a/msg/InFolder", "uint8 description\n"},
                               {"a/msg/Described", "std_msgs/Bool[] description\n"},
                               {"std_msgs/msg/Byte", "uint8 description\n"}});
  EXPECT_EQ(first_field(types, "a/InFolder"), "folder");
  EXPECT_EQ(first_field(types, "a/Described"), "description");
  EXPECT_EQ(first_field(types, "std_msgs/Byte"), "description");
  EXPECT_EQ(first_field(types, "std_msgs/Char"), "data");
  // What is defined is the last.
  types.define(*interface_name("a/msg/Described"), "uint8 made\n");
  types.define(*interface_name("std_msgs/msg/Empty"), "uint8 made\n");
  types.define(*interface_name("a/msg/Made"), "uint8 made\n");
  EXPECT_EQ(first_field(types, "a/Described"), "description");
  ASSERT_TRUE(types.resolve("std_msgs/Empty"));
  EXPECT_TRUE(types.resolve("std_msgs/Empty")->root().fields.empty());
  EXPECT_EQ(first_field(types, "a/Made"), "made");
}

TEST_F(TypeSourceTest, WithAFaultDoNotLetTheNextOneAnswer) {
  write("a/msg/A.msg", "uint8 x\nuint8 x\n");
  TypeLibrary types = library({{"a/msg/A", "uint8 x\n"}, {"std_msgs/msg/Bool", "uint8 y\n\n=\n"}});
  EXPECT_EQ(first_field(types, "a/A"), (root_ / "a/msg/A.msg").string() + ":2:7: the name x is used twice");
  EXPECT_THAT(first_field(types, "std_msgs/Bool"), testing::StartsWith("car.description:3:1: "));
}

TEST_F(TypeSourceTest, AreNamedWhenNoneHasTheType) {
  TypeLibrary types = library({});
  EXPECT_EQ(first_field(types, "a/A"), "unknown type a/msg/A: not found in " + root_.string() +
                                           ", car.description, and not among the built-in ones");
}

TEST_F(TypeSourceTest, AreSharedByCopiesOfALibraryButForWhatIsDefined) {
  TypeLibrary first = library({{"a/msg/Described", "uint8 description\n"}});
  TypeLibrary second = first;
  second.define(*interface_name("a/msg/Made"), "uint8 made\n");
  EXPECT_EQ(first_field(second, "a/Described"), "description");
  EXPECT_EQ(first_field(second, "a/Made"), "made");
  EXPECT_FALSE(first.resolve("a/Made"));
}

}  // namespace
}  // namespace trestle::messages::type_source_test
