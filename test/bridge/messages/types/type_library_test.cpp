#include "bridge/messages/types/type_library.hpp"

#include <gmock/gmock.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): setenv is POSIX

#include "test/bridge/messages/types/folder_test.hpp"

namespace trestle::messages::type_library_test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class TypeLibraryTest : public test::FolderTest {
 protected:
  [[nodiscard]] std::string error_of(std::string_view type) const {
    TypeLibrary library{{root_}};
    const auto tree = library.resolve(type);
    return tree ? "no error" : to_string(tree.error());
  }
  static std::vector<std::string> names(const TypeTree& tree) {
    std::vector<std::string> result;
    for (const auto& message : tree.messages) {
      result.push_back(message.name);
    }
    return result;
  }
};

TEST_F(TypeLibraryTest, KnowsTheBuiltInTypesWithoutAnyFolder) {
  TypeLibrary library;
  const auto tree = library.resolve("sensor_msgs/msg/PointCloud2");
  ASSERT_TRUE(tree) << to_string(tree.error());
  EXPECT_THAT(names(*tree), ElementsAre("builtin_interfaces/msg/Time", "std_msgs/msg/Header",
                                        "sensor_msgs/msg/PointField", "sensor_msgs/msg/PointCloud2"));
  ASSERT_EQ(tree->root().fields.size(), 9U);
  EXPECT_EQ(tree->root().fields[0].type.message_index, 1U);
  EXPECT_EQ(tree->root().fields[3].type.message_index, 2U);
  EXPECT_EQ(tree->root().fields[3].type.array, ArrayKind::unbounded);
}

TEST_F(TypeLibraryTest, ResolvesEveryBuiltInType) {
  TypeLibrary library;
  const auto builtin = TypeLibrary::builtin_names();
  const auto of_kind = [&](std::string_view kind) {
    return std::ranges::count_if(builtin, [&](const auto& name) { return name.find(kind) != name.npos; });
  };
  EXPECT_EQ(of_kind("/msg/"), 161);
  EXPECT_EQ(of_kind("/srv/"), 29);
  EXPECT_EQ(of_kind("/action/"), 1);
  for (const auto& name : builtin) {
    const auto kind = interface_name(name)->kind;
    const std::string message = name + (kind == InterfaceKind::message   ? ""
                                        : kind == InterfaceKind::service ? "_Response"
                                                                         : "_FeedbackMessage");
    const auto tree = library.resolve(message);
    ASSERT_TRUE(tree) << to_string(tree.error());
    EXPECT_EQ(tree->root().name, message);
  }
}

TEST_F(TypeLibraryTest, FindsTypesInFoldersWithAndWithoutShare) {
  write("a_msgs/msg/A.msg", "b_msgs/B[] bs\nstd_msgs/Header header\n");
  write("share/b_msgs/msg/B.msg", "string<=5 name\n");
  TypeLibrary library{{root_}};
  const auto tree = library.resolve("a_msgs/A");
  ASSERT_TRUE(tree) << to_string(tree.error());
  EXPECT_THAT(names(*tree), ElementsAre("b_msgs/msg/B", "builtin_interfaces/msg/Time", "std_msgs/msg/Header",
                                        "a_msgs/msg/A"));
}

TEST_F(TypeLibraryTest, PrefersGivenFoldersThenAmentThenBuiltIn) {
  write("mine/std_msgs/msg/Bool.msg", "uint16 mine\n");
  write("ament/share/std_msgs/msg/Bool.msg", "uint16 installed\n");
  write("ament/share/std_msgs/msg/Byte.msg", "uint16 installed\n");
  ASSERT_EQ(::setenv("AMENT_PREFIX_PATH", (":" + (root_ / "ament").string() + ":/does/not/exist").c_str(), 1),
            0);
  TypeLibrary library{{root_ / "mine"}, ament_prefixes()};
  ASSERT_EQ(::unsetenv("AMENT_PREFIX_PATH"), 0);
  EXPECT_EQ(library.resolve("std_msgs/Bool")->root().fields[0].name, "mine");
  EXPECT_EQ(library.resolve("std_msgs/Byte")->root().fields[0].name, "installed");
  EXPECT_EQ(library.resolve("std_msgs/Char")->root().fields[0].name, "data");
  EXPECT_TRUE(ament_prefixes().empty());
}

TEST_F(TypeLibraryTest, ReadsAnOldStyleHeaderAsStdMsgs) {
  write("old_msgs/msg/A.msg", "Header header\n");
  write("own_msgs/msg/A.msg", "Header header\n");
  write("own_msgs/msg/Header.msg", "uint8 own\n");
  TypeLibrary library{{root_}};
  EXPECT_EQ(library.resolve("old_msgs/A")->root().fields[0].type.message, "std_msgs/msg/Header");
  EXPECT_EQ(library.resolve("own_msgs/A")->root().fields[0].type.message, "own_msgs/msg/Header");
}

TEST_F(TypeLibraryTest, NamesThePlaceOfAnUnknownType) {
  EXPECT_EQ(error_of("std_msgs/Sting"), "unknown type std_msgs/msg/Sting: not found in " + root_.string() +
                                            ", and not among the built-in ones");
  EXPECT_EQ(error_of("Sting"), "\"Sting\" is no message type: expected pkg/msg/Type or pkg/Type");
  write("a_msgs/msg/A.msg", "uint8 a\n  b_msgs/B b\n");
  EXPECT_THAT(error_of("a_msgs/A"), testing::StartsWith((root_ / "a_msgs/msg/A.msg").string() +
                                                        ":2:3: unknown type b_msgs/msg/B: "));
  write("c_msgs/msg/C.msg", "uint8 a\nuint8 a\n");
  EXPECT_EQ(error_of("c_msgs/C"), (root_ / "c_msgs/msg/C.msg").string() + ":2:7: the name a is used twice");
}

TEST_F(TypeLibraryTest, RefusesMessagesThatContainThemselves) {
  write("a_msgs/msg/A.msg", "B b\n");
  write("a_msgs/msg/B.msg", "A[] a\n");
  EXPECT_THAT(error_of("a_msgs/A"),
              HasSubstr("a_msgs/msg/A contains itself: a_msgs/msg/A > a_msgs/msg/B > a_msgs/msg/A"));
}

TEST_F(TypeLibraryTest, RefusesNestingBeyondTheLimit) {
  for (std::size_t i = 0; i < max_type_depth + 1; ++i) {
    write("deep_msgs/msg/D" + std::to_string(i) + ".msg",
          i == 0 ? "uint8 x\n" : "D" + std::to_string(i - 1) + " x\n");
  }
  EXPECT_EQ(error_of("deep_msgs/D" + std::to_string(max_type_depth - 1)), "no error");
  EXPECT_THAT(error_of("deep_msgs/D" + std::to_string(max_type_depth)),
              HasSubstr("is made of too many messages: at most 32 deep"));
}

TEST_F(TypeLibraryTest, ReportsAFileThatIsTooLarge) {
  write("a_msgs/msg/A.msg", std::string((std::size_t{1} << 20U) + 1, '\n'));
  EXPECT_EQ(error_of("a_msgs/A"), (root_ / "a_msgs/msg/A.msg").string() + ": larger than 1048576 bytes");
}

}  // namespace
}  // namespace trestle::messages::type_library_test
