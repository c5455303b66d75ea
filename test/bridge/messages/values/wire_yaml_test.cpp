#include "bridge/messages/values/wire_yaml.hpp"

#include <gmock/gmock.h>

#include "bridge/messages/values/load_wire.hpp"

namespace trestle::test::wire_yaml_test {
namespace {

using namespace messages;
using someip::FieldWidth;
using testing::IsEmpty;

MessageRules again(const MessageRules& rules) {
  const YAML::Node yaml = wire_yaml(rules);
  // As text and back: an emitter may write what a reader reads otherwise.
  YAML::Emitter out;
  out << yaml;
  MessageRules read;
  documents::Problems problems{"wire"};
  if (yaml.size() != 0) {
    load_wire(YAML::Load(out.c_str()), read, problems);
  }
  std::string told;
  for (const documents::Problem& problem : problems.take()) {
    told += to_string(problem) + "\n";
  }
  EXPECT_THAT(told, IsEmpty()) << out.c_str();
  return read;
}

TEST(WireYaml, IsNothingForTheDefaults) {
  EXPECT_EQ(wire_yaml({}).size(), 0U);
}

TEST(WireYaml, IsReadAsTheSameRules) {
  const std::vector<std::function<void(MessageRules&)>> changes{
      [](MessageRules& r) { r.payload.byte_order = std::endian::little; },
      [](MessageRules& r) { r.payload.length_fields_always_big = false; },
      [](MessageRules& r) { r.payload.array_length = FieldWidth::bits8; },
      [](MessageRules& r) { r.payload.fixed_array_length = FieldWidth::bits16; },
      [](MessageRules& r) { r.payload.string_length = FieldWidth::none; },
      [](MessageRules& r) { r.payload.struct_length = FieldWidth::bits32; },
      [](MessageRules& r) { r.payload.union_length = FieldWidth::bits8; },
      [](MessageRules& r) { r.payload.union_type = FieldWidth::bits16; },
      [](MessageRules& r) { r.payload.union_null = true; },
      [](MessageRules& r) { r.payload.union_length_first = false; },
      [](MessageRules& r) { r.payload.string_encoding = someip::StringEncoding::utf16le; },
      [](MessageRules& r) { r.payload.string_bom = false; },
      [](MessageRules& r) { r.payload.string_terminator = false; },
      [](MessageRules& r) { r.payload.alignment = 8; },
      [](MessageRules& r) { r.payload.tagged_length = FieldWidth::bits16; },
      [](MessageRules& r) { r.payload.smallest_tagged_length = true; },
      [](MessageRules& r) { r.payload.cut_longer_arrays = false; },
      [](MessageRules& r) { r.default_missing = true; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].form = TypeRules::Form::choice; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].form = TypeRules::Form::bits16; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].form = TypeRules::Form::empty; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].tags["x"] = someip::DataId{0xfff}; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fixed_strings["x"] = 12; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].byte_orders["x"] = std::endian::little; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].itself.struct_length = FieldWidth::bits8; },
      [](MessageRules& r) {
        r.types["a_msgs/msg/B"].itself.selectors = {1, 7, 0xffff'ffff};
      },
      [](MessageRules& r) { r.types["a_msgs/msg/B#2"].itself.union_bytes = 0; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].array_length = FieldWidth::none; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].string_length = FieldWidth::bits8; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].encoding = someip::StringEncoding::utf16be; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].bom = false; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].terminator = true; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].union_length_first = false; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].union_type = FieldWidth::bits8; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].bits = 5; },
      [](MessageRules& r) { r.types["a_msgs/msg/B"].fields["x"].variant = "a_msgs/msg/C#2"; },
  };
  MessageRules all;
  for (const auto& change : changes) {
    MessageRules one;
    change(one);
    EXPECT_EQ(again(one), one);
    change(all);
  }
  EXPECT_EQ(again(all), all);
}

}  // namespace
}  // namespace trestle::test::wire_yaml_test
