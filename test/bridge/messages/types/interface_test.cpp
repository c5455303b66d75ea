#include "bridge/messages/types/parsers.hpp"

#include <gmock/gmock.h>

#include "bridge/messages/types/type_library.hpp"
#include "test/bridge/messages/types/folder_test.hpp"

namespace trestle::messages::interface_test {
namespace {

using testing::ElementsAre;

using InterfaceTest = test::FolderTest;

std::vector<std::string> fields_of(const MessageDefinition& message) {
  std::vector<std::string> fields;
  for (const Field& field : message.fields) {
    std::string text = field.type.primitive ? to_string(*field.type.primitive) : field.type.message;
    if (field.type.array == ArrayKind::bounded) {
      text += "[<=" + std::to_string(field.type.array_size) + "]";
    }
    fields.push_back(text + " " + field.name);
  }
  return fields;
}

std::vector<std::string> fields_of(const tl::expected<TypeTree, TypeError>& tree) {
  return tree ? fields_of(tree->root()) : std::vector{to_string(tree.error())};
}

TEST(InterfaceName, HasThreeParts) {
  EXPECT_EQ(interface_name("a_msgs/srv/B"), (InterfaceName{"a_msgs", InterfaceKind::service, "B"}));
  EXPECT_EQ(interface_name("a/action/B_C2")->full(), "a/action/B_C2");
  EXPECT_EQ(interface_name("a/B")->full(), "a/msg/B");
  EXPECT_EQ(interface_name("a/B", InterfaceKind::service)->full(), "a/srv/B");
  EXPECT_EQ(interface_name("a/msg/B", InterfaceKind::service)->full(), "a/msg/B");
  for (const char* name : {"", "a", "a/", "/a", "a/srv/", "a/service/B", "a/srv/B/C", "a/../B", "a/srv/../B",
                           "a/srv/1B", "_a/srv/B", "a/srv/B C"}) {
    EXPECT_EQ(interface_name(name), std::nullopt) << name;
  }
}

TEST(InterfaceName, LeadsToTheFileThatDefinesIt) {
  const std::pair<const char*, const char*> cases[] = {
      {"a/msg/B_Request", "a/msg/B_Request"},
      {"a/srv/B_Request", "a/srv/B"},
      {"a/srv/B_Response", "a/srv/B"},
      {"a/srv/B_Event", "a/srv/B"},
      {"a/action/B_Goal", "a/action/B"},
      {"a/action/B_Result", "a/action/B"},
      {"a/action/B_Feedback", "a/action/B"},
      {"a/action/B_FeedbackMessage", "a/action/B"},
      {"a/action/B_SendGoal_Request", "a/action/B"},
      {"a/action/B_SendGoal_Response", "a/action/B"},
      {"a/action/B_GetResult_Event", "a/action/B"},
  };
  for (const auto& [message, interface] : cases) {
    const auto found = defining_interface(*interface_name(message));
    EXPECT_EQ(found ? found->full() : "none", interface) << message;
  }
  for (const char* name : {"a/srv/B", "a/srv/B_Goal", "a/action/B", "a/action/B_SendGoal",
                           "a/action/B_Request", "a/action/B_Other_Request"}) {
    EXPECT_EQ(defining_interface(*interface_name(name)), std::nullopt) << name;
  }
}

TEST_F(InterfaceTest, AServiceHasTwoMessagesAndAnEvent) {
  write(
      "my_msgs/srv/Find.srv",
      "# what to find\r\nint8 MAX=3\nstring<=9 name \"x\"\nPoint near\n--- \r\nbool found\nuint8[<=4] raw\n");
  write("my_msgs/msg/Point.msg", "float64 x\n");
  TypeLibrary library{{root_}};
  const auto service = library.resolve_service("my_msgs/Find");
  ASSERT_TRUE(service) << to_string(service.error());
  EXPECT_EQ(service->request.root().name, "my_msgs/srv/Find_Request");
  EXPECT_EQ(service->response.root().name, "my_msgs/srv/Find_Response");
  EXPECT_THAT(fields_of(service->request.root()), ElementsAre("string name", "my_msgs/msg/Point near"));
  EXPECT_EQ(service->request.root().constants.at(0).name, "MAX");
  EXPECT_EQ(service->request.messages.size(), 2U);
  EXPECT_THAT(fields_of(service->response.root()), ElementsAre("bool found", "uint8[<=4] raw"));
  EXPECT_THAT(fields_of(library.resolve("my_msgs/srv/Find_Event")),
              ElementsAre("service_msgs/msg/ServiceEventInfo info", "my_msgs/srv/Find_Request[<=1] request",
                          "my_msgs/srv/Find_Response[<=1] response"));
}

TEST_F(InterfaceTest, PartsMayBeEmptyAndShareNames) {
  write("a/srv/Nothing.srv", "---\n");
  write("a/srv/Same.srv", "uint8 x\n---\nuint8 x");
  TypeLibrary library{{root_}};
  EXPECT_THAT(fields_of(library.resolve("a/srv/Nothing_Request")), ElementsAre());
  EXPECT_THAT(fields_of(library.resolve("a/srv/Nothing_Response")), ElementsAre());
  EXPECT_THAT(fields_of(library.resolve("a/srv/Same_Response")), ElementsAre("uint8 x"));
}

TEST_F(InterfaceTest, AnActionHasAllTheMessagesOfRosidl) {
  write("a/action/Go.action", "int32 order\n---\nint32[] sequence\n---\nfloat32 part\n");
  TypeLibrary library{{root_}};
  EXPECT_THAT(fields_of(library.resolve("a/action/Go_Goal")), ElementsAre("int32 order"));
  EXPECT_THAT(fields_of(library.resolve("a/action/Go_Result")), ElementsAre("int32 sequence"));
  EXPECT_THAT(fields_of(library.resolve("a/action/Go_Feedback")), ElementsAre("float32 part"));
  EXPECT_THAT(fields_of(library.resolve("a/action/Go_FeedbackMessage")),
              ElementsAre("unique_identifier_msgs/msg/UUID goal_id", "a/action/Go_Feedback feedback"));
  const auto send_goal = library.resolve_service("a/action/Go_SendGoal");
  ASSERT_TRUE(send_goal) << to_string(send_goal.error());
  EXPECT_THAT(fields_of(send_goal->request.root()),
              ElementsAre("unique_identifier_msgs/msg/UUID goal_id", "a/action/Go_Goal goal"));
  EXPECT_THAT(fields_of(send_goal->response.root()),
              ElementsAre("bool accepted", "builtin_interfaces/msg/Time stamp"));
  const auto get_result = library.resolve_service("a/action/Go_GetResult");
  ASSERT_TRUE(get_result) << to_string(get_result.error());
  EXPECT_THAT(fields_of(get_result->request.root()), ElementsAre("unique_identifier_msgs/msg/UUID goal_id"));
  EXPECT_THAT(fields_of(get_result->response.root()),
              ElementsAre("int8 status", "a/action/Go_Result result"));
  EXPECT_THAT(
      fields_of(library.resolve("a/action/Go_GetResult_Event")),
      ElementsAre("service_msgs/msg/ServiceEventInfo info", "a/action/Go_GetResult_Request[<=1] request",
                  "a/action/Go_GetResult_Response[<=1] response"));
}

TEST_F(InterfaceTest, KnowsTheBuiltInServices) {
  TypeLibrary library;
  const auto trigger = library.resolve_service("std_srvs/srv/Trigger");
  ASSERT_TRUE(trigger) << to_string(trigger.error());
  EXPECT_THAT(fields_of(trigger->request.root()), ElementsAre());
  EXPECT_THAT(fields_of(trigger->response.root()), ElementsAre("bool success", "string message"));
  EXPECT_TRUE(library.resolve_service("action_msgs/CancelGoal"));
}

TEST_F(InterfaceTest, SaysWhatIsWrongAndWhere) {
  const auto error_of = [&](const char* file, std::string_view text, const char* type) {
    write(file, text);
    TypeLibrary library{{root_}};
    const auto tree = library.resolve(type);
    return tree ? "no error" : to_string(tree.error());
  };
  const std::string srv = (root_ / "a/srv/B.srv").string();
  EXPECT_EQ(error_of("a/srv/B.srv", "uint8 x\n", "a/srv/B_Request"),
            srv + ": expected 2 parts with --- between them, found 1");
  EXPECT_EQ(error_of("a/srv/B.srv", "---\n---\n", "a/srv/B_Request"),
            srv + ":2:1: expected 2 parts with --- between them, found more");
  EXPECT_EQ(error_of("a/srv/B.srv", "uint8 x\n--- y\n", "a/srv/B_Request"),
            srv + ":2:1: expected a type, found \"---\"");
  EXPECT_EQ(error_of("a/srv/B.srv", "uint8 x\n---\nuint9 y\n", "a/srv/B_Response"),
            srv + ":3:1: unknown type a/msg/uint9: not found in " + root_.string() +
                ", and not among the built-in ones");
  EXPECT_EQ(error_of("a/action/B.action", "---\n", "a/action/B_Goal"),
            (root_ / "a/action/B.action").string() + ": expected 3 parts with --- between them, found 2");
  EXPECT_EQ(error_of("a/srv/B.srv", "---\n", "a/srv/B"),
            "a/srv/B is a service, not a message; its messages are a/srv/B_Request, ...");
  EXPECT_EQ(error_of("a/srv/B.srv", "---\n", "a/action/B"),
            "a/action/B is an action, not a message; its messages are a/action/B_Goal, ...");
  TypeLibrary library{{root_}};
  EXPECT_EQ(to_string(library.resolve_service("std_msgs/msg/String").error()),
            "\"std_msgs/msg/String\" is no service: expected pkg/srv/Name or pkg/Name");
  EXPECT_EQ(to_string(library.resolve_service("a/action/B").error()),
            "\"a/action/B\" is no service: expected pkg/srv/Name or pkg/Name");
  EXPECT_EQ(
      to_string(library.resolve_service("a/Missing").error()),
      "unknown type a/srv/Missing: not found in " + root_.string() + ", and not among the built-in ones");
}

TEST_F(InterfaceTest, AreReadOnceByEachLibrary) {
  write("a/msg/A.msg", "uint8 first\n");
  TypeLibrary library{{root_}};
  const auto before = library.resolve("a/A");
  write("a/msg/A.msg", "uint8 second\n");
  EXPECT_THAT(fields_of(library.resolve("a/A")), ElementsAre("uint8 first"));
  EXPECT_THAT(fields_of(TypeLibrary{{root_}}.resolve("a/A")), ElementsAre("uint8 second"));
  EXPECT_THAT(fields_of(before), ElementsAre("uint8 first"));
}

}  // namespace
}  // namespace trestle::messages::interface_test
