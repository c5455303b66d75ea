#include "bridge/console/route_forms.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "bridge/console/json_schema.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "test/bytes.hpp"

namespace trestle::console::route_forms_test {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::byte>;
using test::hex;
using testing::HasSubstr;

// "hello" as the default wire rules have it, and as CDR.
const Bytes payload = hex("00000009 efbbbf 68656c6c6f 00");
const Bytes cdr = hex("00010000 06000000 68656c6c6f 00");

RouteForms forms_of(const std::string& type) {
  messages::TypeLibrary types;
  const auto tree = *types.resolve(type);
  return RouteForms{{.title = {.topic = "/seen", .type = type},
                     .ros = tree,
                     .payload = tree,
                     .rules = {},
                     .plan = *messages::ConversionPlan::compile(tree, {})}};
}

std::shared_ptr<const carry::SeenMessage> seen(bool is_cdr, const Bytes& bytes) {
  return std::make_shared<const carry::SeenMessage>(
      carry::SeenMessage{.is_cdr = is_cdr, .bytes = bytes, .size = bytes.size(), .at_ns = 4711});
}

std::string text_of(const tl::expected<RouteForms::Bytes, std::string>& bytes) {
  std::string text;
  for (const std::byte one : bytes ? **bytes : Bytes{}) {
    text += static_cast<char>(one);
  }
  return bytes ? text : bytes.error();
}

TEST(RouteForms, HasWhatIsOnTheTopic) {
  RouteForms forms = forms_of("std_msgs/msg/String");
  EXPECT_EQ(**forms.cdr(seen(false, payload)), cdr);
  const auto sample = seen(true, cdr);
  const auto same = forms.cdr(sample);
  EXPECT_EQ(**same, cdr);
  EXPECT_EQ((*same)->data(), sample->bytes.data()) << "is not copied";
  EXPECT_THAT(forms.ros_schema(), HasSubstr("string data"));
}

TEST(RouteForms, HasTheValuesOfThePayload) {
  RouteForms forms = forms_of("std_msgs/msg/String");
  EXPECT_EQ(text_of(forms.json(*seen(false, payload))), R"({"data":"hello"})");
  EXPECT_EQ(text_of(forms.json(*seen(true, cdr))), R"({"data":"hello"})");
  EXPECT_EQ(forms.payload_type(), "std_msgs/msg/String");
}

TEST(RouteForms, SaysWhyAMessageIsNone) {
  RouteForms forms = forms_of("std_msgs/msg/String");
  EXPECT_FALSE(forms.cdr(seen(false, hex("00000009 ef"))).has_value());
  EXPECT_FALSE(forms.json(*seen(false, hex("00000009 ef"))).has_value());
  EXPECT_FALSE(forms.json(*seen(true, hex("00010000 ff000000"))).has_value());
}

TEST(RouteForms, CutsLongArraysInJson) {
  RouteForms forms = forms_of("std_msgs/msg/UInt8MultiArray");
  messages::TypeLibrary types;
  const auto values = messages::MessageValues::make(*types.resolve("std_msgs/msg/UInt8MultiArray"));
  const std::string data = json(std::vector<int>(RouteForms::longest + 1)).dump();
  const auto bytes = values->parse("{\"data\": " + data + "}", messages::ValueForm::json);
  const std::string text = text_of(forms.json(*seen(false, *bytes)));
  EXPECT_LT(text.size(), 3 * RouteForms::longest);
  EXPECT_THAT(json::parse(text)["data"].get<std::string>(), HasSubstr("..."));
}

TEST(JsonSchema, DescribesFields) {
  messages::TypeLibrary types;
  EXPECT_EQ(json::parse(json_schema(*types.resolve("sensor_msgs/msg/PointCloud2")))["properties"],
            json::parse(R"({
    "header": {"type": "object", "properties": {
      "stamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nanosec": {"type": "integer"}}},
      "frame_id": {"type": "string"}}},
    "height": {"type": "integer"}, "width": {"type": "integer"},
    "fields": {"type": "array", "items": {"type": "object", "properties": {
      "name": {"type": "string"}, "offset": {"type": "integer"}, "datatype": {"type": "integer"},
      "count": {"type": "integer"}}}},
    "is_bigendian": {"type": "boolean"}, "point_step": {"type": "integer"}, "row_step": {"type": "integer"},
    "data": {"type": "string"}, "is_dense": {"type": "boolean"}})"));
  const auto numbers = json::parse(json_schema(*types.resolve("sensor_msgs/msg/LaserScan")))["properties"];
  EXPECT_EQ(numbers["ranges"], json::parse(R"({"type": "array", "items": {"type": "number"}})"));
}

// Each type has ten fields of the one before: 10^12 in all.
TEST(JsonSchema, DoesNotDescribeWhatIsTooLarge) {
  messages::TypeTree tree;
  messages::Field field;
  field.name = "x";
  field.type.primitive = messages::Primitive::int8;
  for (std::size_t level = 0; level <= 12; ++level) {
    messages::MessageDefinition one;
    one.name = "a/msg/T" + std::to_string(level);
    for (int i = 0; i < 10; ++i) {
      field.name = "f" + std::to_string(i);
      one.fields.push_back(field);
    }
    tree.messages.push_back(one);
    field.type = {};
    field.type.message = one.name;
    field.type.message_index = level;
  }
  EXPECT_EQ(json::parse(json_schema(tree)), json::parse(R"({"type": "object", "title": "a/msg/T12"})"));
}

}  // namespace
}  // namespace trestle::console::route_forms_test
