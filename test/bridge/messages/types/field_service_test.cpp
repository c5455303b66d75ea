#include "bridge/messages/types/field_service.hpp"

#include <gmock/gmock.h>

#include "bridge/messages/types/type_hash.hpp"
#include "test/bridge/messages/types/folder_test.hpp"

namespace trestle::messages::field_service_test {
namespace {

using enum FieldAccess;
using testing::HasSubstr;

class FieldServiceTest : public test::FolderTest {
 protected:
  [[nodiscard]] std::string fault(const std::string& service, const std::string& value,
                                  FieldAccess access) const {
    TypeLibrary library{{root_}};
    const auto types = resolve_field_service(library, service, value, access);
    return types ? "none" : types.error();
  }
};

TEST_F(FieldServiceTest, IsMadeWhereNoneIsNamed) {
  EXPECT_EQ(field_service_name("std_msgs/msg/Float64", get), "std_msgs_fields/srv/GetFloat64");
  EXPECT_EQ(field_service_name("std_msgs/msg/Float64", set), "std_msgs_fields/srv/SetFloat64");
  EXPECT_EQ(field_service_text("std_msgs/msg/Float64", get), "---\nstd_msgs/Float64 value\n");
  EXPECT_EQ(field_service_text("std_msgs/msg/Float64", set),
            "std_msgs/Float64 value\n---\nstd_msgs/Float64 value\n");
  TypeLibrary library;
  const auto made =
      resolve_field_service(library, "std_msgs_fields/srv/SetFloat64", "std_msgs/msg/Float64", set);
  ASSERT_TRUE(made) << made.error();
  EXPECT_EQ(made->value.root().name, "std_msgs/msg/Float64");
  for (const TypeTree* tree : {&made->service.request, &made->service.response}) {
    ASSERT_EQ(tree->root().fields.size(), 1U);
    EXPECT_EQ(tree->root().fields[0].name, "value");
    EXPECT_EQ(tree->root().fields[0].type.message, "std_msgs/msg/Float64");
  }
}

TEST_F(FieldServiceTest, HasTheHashOfTheFileThatWouldSayIt) {
  TypeLibrary made;
  ASSERT_TRUE(resolve_field_service(made, "std_msgs_fields/srv/GetFloat64", "std_msgs/msg/Float64", get));
  write("std_msgs_fields/srv/GetFloat64.srv", "# nothing\n---\nstd_msgs/Float64 value  # the value\n");
  TypeLibrary read{{root_}};
  const auto hash = type_hash(made, "std_msgs_fields/srv/GetFloat64_Response");
  ASSERT_TRUE(hash) << to_string(hash.error());
  EXPECT_EQ(*hash, type_hash(read, "std_msgs_fields/srv/GetFloat64_Response").value_or("none"));
  EXPECT_TRUE(type_hash(made, "std_msgs_fields/srv/GetFloat64"));
}

TEST_F(FieldServiceTest, IsThatOfTheFileWhereThereIsOne) {
  write("std_msgs_fields/srv/GetFloat64.srv", "---\nfloat32 value\n");
  EXPECT_EQ(fault("std_msgs_fields/srv/GetFloat64", "std_msgs/msg/Float64", get),
            "std_msgs_fields/srv/GetFloat64_Response does not hold the value: expected one member of type "
            "std_msgs/msg/Float64, or its members in their order");
}

TEST_F(FieldServiceTest, HoldsTheValueOrItsMembers) {
  EXPECT_EQ(fault("nav_msgs/srv/GetMap", "nav_msgs/msg/OccupancyGrid", get), "none");
  write("a/msg/Light.msg", "uint8 level\nstring<=8 name\nstd_msgs/ColorRGBA[] colours\n");
  write("a/srv/Members.srv",
        "uint8 level\nstring<=8 title\nstd_msgs/ColorRGBA[] colours\n---\n"
        "uint8 level\nstring<=8 title\nstd_msgs/ColorRGBA[] colours\n");
  EXPECT_EQ(fault("a/srv/Members", "a/msg/Light", set), "none");
  EXPECT_THAT(fault("a/srv/Members", "a/msg/Light", get), HasSubstr("a/srv/Members_Request is not empty"));
}

TEST_F(FieldServiceTest, SaysWhatDoesNotFit) {
  EXPECT_THAT(fault("std_srvs/srv/SetBool", "std_msgs/msg/Bool", set),
              HasSubstr("std_srvs/srv/SetBool_Response does not hold the value"));
  EXPECT_THAT(fault("std_srvs/srv/SetBool", "std_msgs/msg/Float64", set),
              HasSubstr("std_srvs/srv/SetBool_Request does not hold the value"));
  write("a/msg/Light.msg", "uint8 level\nstring<=8 name\n");
  const auto of_response = [&](const std::string& response) {
    write("a/srv/Get.srv", "---\n" + response);
    return fault("a/srv/Get", "a/msg/Light", get);
  };
  EXPECT_EQ(of_response("Light light\n"), "none");
  EXPECT_EQ(of_response("uint8 level\nstring<=8 name\n"), "none");
  for (const char* response : {"", "Light[] lights\n", "Light[1] lights\n", "Light light\nuint8 more\n",
                               "uint8 level\n", "uint8 level\nstring name\n", "string<=8 name\nuint8 level\n",
                               "uint8 level\nstring<=8 name\nuint8 more\n", "std_msgs/Bool light\n"}) {
    EXPECT_THAT(of_response(response), HasSubstr("a/srv/Get_Response does not hold the value")) << response;
  }
  EXPECT_THAT(fault("std_msgs_fields/srv/GetEmpty", "std_msgs/msg/Empty", get),
              HasSubstr("std_msgs/msg/Empty has no fields, so it cannot be the value of a field"));
  EXPECT_THAT(fault("a/srv/Gone", "a/msg/Light", get), HasSubstr("unknown type a/srv/Gone"));
  EXPECT_THAT(fault("b_fields/srv/GetGone", "b/msg/Gone", get), HasSubstr("unknown type b/msg/Gone"));
}

}  // namespace
}  // namespace trestle::messages::field_service_test
