#include "bridge/messages/types/type_hash.hpp"

#include <gtest/gtest.h>

#include "test/bridge/messages/types/folder_test.hpp"

// test/bridge/ros compares the hashes of hundreds of types with those of ROS 2 itself.
namespace trestle::messages::type_hash_test {
namespace {

using TypeHashTest = test::FolderTest;

std::string hash_of(TypeLibrary& library, std::string_view name) {
  const auto hash = type_hash(library, name);
  return hash ? *hash : to_string(hash.error());
}

TEST_F(TypeHashTest, IsThatOfPublishedTypes) {
  TypeLibrary library;
  EXPECT_EQ(hash_of(library, "std_msgs/String"),
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  EXPECT_EQ(hash_of(library, "sensor_msgs/msg/PointCloud2"),
            "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5");
}

TEST_F(TypeHashTest, DescribesEveryKindOfField) {
  write("a/msg/B.msg", "uint8 X=3\nchar[4] c [1, 2, 3, 4]\nwstring<=9[<=2] w\nN[] n\nbyte b\n# a comment\n");
  write("a/msg/N.msg", "");
  TypeLibrary library{{root_}};
  EXPECT_EQ(
      hashed_description(library, "a/B").value_or("an error"),
      R"({"type_description": {"type_name": "a/msg/B", "fields": [)"
      R"({"name": "c", "type": {"type_id": 51, "capacity": 4, "string_capacity": 0, "nested_type_name": ""}}, )"
      R"({"name": "w", "type": {"type_id": 118, "capacity": 2, "string_capacity": 9, "nested_type_name": ""}}, )"
      R"({"name": "n", "type": {"type_id": 145, "capacity": 0, "string_capacity": 0, "nested_type_name": "a/msg/N"}}, )"
      R"({"name": "b", "type": {"type_id": 16, "capacity": 0, "string_capacity": 0, "nested_type_name": ""}}]}, )"
      R"("referenced_type_descriptions": [{"type_name": "a/msg/N", "fields": [)"
      R"({"name": "structure_needs_at_least_one_member", "type": {"type_id": 3, "capacity": 0, )"
      R"("string_capacity": 0, "nested_type_name": ""}}]}]})");
}

TEST_F(TypeHashTest, DescribesServicesByTheirMessages) {
  write("a/srv/S.srv", "---\n");
  TypeLibrary library{{root_}};
  const auto description = hashed_description(library, "a/srv/S");
  ASSERT_TRUE(description) << to_string(description.error());
  EXPECT_TRUE(description->starts_with(
      R"({"type_description": {"type_name": "a/srv/S", "fields": [)"
      R"({"name": "request_message", "type": {"type_id": 1, "capacity": 0, "string_capacity": 0, )"
      R"("nested_type_name": "a/srv/S_Request"}}, )"
      R"({"name": "response_message", "type": {"type_id": 1, "capacity": 0, "string_capacity": 0, )"
      R"("nested_type_name": "a/srv/S_Response"}}, )"
      R"({"name": "event_message", "type": {"type_id": 1, "capacity": 0, "string_capacity": 0, )"
      R"("nested_type_name": "a/srv/S_Event"}}]}, "referenced_type_descriptions": [)"
      R"({"type_name": "a/srv/S_Event", "fields": [)"))
      << *description;
}

TEST_F(TypeHashTest, DependsOnNamesAndNotOnDefaults) {
  write("a/msg/A.msg", "uint8 x\n");
  const auto hash_now = [&] {
    TypeLibrary library{{root_}};
    return hash_of(library, "a/A");
  };
  const std::string first = hash_now();
  write("a/msg/A.msg", "uint8 K=1\nuint8 x 5 # changed\n");
  EXPECT_EQ(hash_now(), first);
  write("a/msg/A.msg", "uint8 y\n");
  EXPECT_NE(hash_now(), first);
}

TEST_F(TypeHashTest, SaysWhatIsWrongWithTheType) {
  TypeLibrary library;
  EXPECT_EQ(hash_of(library, "std_msgs/Sting"),
            "unknown type std_msgs/msg/Sting: not among the built-in ones");
  EXPECT_EQ(hash_of(library, "a/srv/Sting"), "unknown type a/srv/Sting: not among the built-in ones");
  EXPECT_EQ(hash_of(library, "a/action/Sting"), "unknown type a/action/Sting: not among the built-in ones");
  EXPECT_EQ(hash_of(library, "Sting"), "\"Sting\" is no message type: expected pkg/msg/Type or pkg/Type");
}

}  // namespace
}  // namespace trestle::messages::type_hash_test
