#pragma once
#include <array>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/parsers.hpp"
#include "bridge/messages/types/type_library.hpp"

/// The plans between which the first two bytes of an input choose.
namespace trestle::fuzz {

/// Every kind of field; `Part` is a message of mixed widths, `Even` one that becomes blocks.
inline messages::TypeTree everything() {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> messages{{
      {"fuzz_msgs/msg/Part", "uint8 a\nfloat64 b\nstring c\nbool d\n"},
      {"fuzz_msgs/msg/Even", "uint32[2] a\nfloat32 b\n"},
      {"fuzz_msgs/msg/All",
       "Part part\nuint8 a\nEven[] evens\nbool[] flags\nEven[2] two\nPart[] parts\nstring[2] "
       "names\nint64[<=3] few\n"
       "string<=5[<=3] bounded\nwstring wide\nwstring<=3[] wides\nPart[2] pair\nint16[] shorts\nuint16 "
       "last\n"},
  }};
  messages::TypeTree tree;
  for (const auto& [name, text] : messages) {
    auto parsed = messages::parse_msg(text, std::string{name}, std::string{name});
    for (auto& field : parsed->fields) {
      field.type.message_index = field.type.message == "fuzz_msgs/msg/Even" ? 1 : 0;
    }
    tree.messages.push_back(std::move(*parsed));
  }
  return tree;
}

inline std::vector<someip::PayloadRules> all_rules() {
  using someip::FieldWidth;
  std::vector<someip::PayloadRules> rules(6);
  rules[1].struct_length = rules[1].fixed_array_length = FieldWidth::bits32;
  rules[2].byte_order = std::endian::little;
  rules[2].length_fields_always_big = false;
  rules[2].struct_length = rules[2].array_length = rules[2].string_length = FieldWidth::bits16;
  rules[3].string_bom = rules[3].string_terminator = false;
  rules[3].string_length = rules[3].array_length = rules[3].fixed_array_length = FieldWidth::bits8;
  rules[4].string_encoding = someip::StringEncoding::utf16le;
  rules[4].alignment = 8;
  rules[5].string_encoding = someip::StringEncoding::utf16be;
  rules[5].string_terminator = false;
  rules[5].alignment = 4;
  rules[5].struct_length = FieldWidth::bits8;
  return rules;
}

/// Types for the rules of types: tags, unions, bit fields, defaults.
inline messages::TypeTree everything_with_rules() {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> messages{{
      {"fuzz_msgs/msg/Flags", "bool a\nbool[3] b\n"},
      {"fuzz_msgs/msg/Part", "uint8 kind 3\nstring name \"n\"\nuint8 added 7\n"},
      {"fuzz_msgs/msg/Shape", "uint8[<=1] dot\nPart[<=1] part\nuint32[<=1] wide\nFlags[<=1] flags\n"},
      {"fuzz_msgs/msg/Block", "uint16 a 1\nfloat64[<=2] b\nShape shape\nstring label\n"},
      {"fuzz_msgs/msg/All",
       "Block block\nBlock[] blocks\nShape[2] shapes\nwstring wide\nPart[<=1] maybe\nbool flag true\n"
       "string[<=2] texts\nPart part\nuint8[] data\nint16[3] more [1, 2, 3]\n"},
  }};
  messages::TypeTree tree;
  for (const auto& [name, text] : messages) {
    auto parsed = messages::parse_msg(text, std::string{name}, std::string{name});
    for (auto& field : parsed->fields) {
      for (std::size_t i = 0; i < tree.messages.size(); ++i) {
        if (field.type.message == tree.messages[i].name) {
          field.type.message_index = i;
        }
      }
    }
    tree.messages.push_back(std::move(*parsed));
  }
  return tree;
}

inline std::vector<messages::MessageRules> all_type_rules() {
  using someip::DataId;
  using someip::FieldWidth;
  std::vector<messages::MessageRules> rules(7);
  for (std::size_t i = 0; i < rules.size(); ++i) {
    rules[i].payload.struct_length = FieldWidth::bits16;
    rules[i].default_missing = i % 2 == 1;
    rules[i].types["fuzz_msgs/msg/Flags"].form = messages::TypeRules::Form::bits16;
    rules[i].types["fuzz_msgs/msg/Shape"].form = messages::TypeRules::Form::choice;
    rules[i].types["fuzz_msgs/msg/Block"].fixed_strings["label"] = 8;
    if (i < 3) {
      rules[i].types["fuzz_msgs/msg/Part"].tags = {
          {"kind", DataId{1}}, {"name", DataId{2}}, {"added", DataId{3}}};
    }
    if (i < 2) {
      std::uint16_t id = 0;
      for (const char* const name :
           {"block", "blocks", "shapes", "wide", "maybe", "flag", "texts", "part", "data", "more"}) {
        rules[i].types["fuzz_msgs/msg/All"].tags[name] = DataId{id++};
      }
    }
  }
  rules[1].payload.smallest_tagged_length = true;
  rules[1].payload.struct_length = FieldWidth::none;
  rules[1].types["fuzz_msgs/msg/Part"].tags.clear();
  rules[2].payload.union_length_first = false;
  rules[2].payload.union_null = true;
  rules[2].payload.tagged_length = rules[2].payload.union_type = FieldWidth::bits8;
  rules[3].payload.string_encoding = someip::StringEncoding::utf16le;
  rules[3].payload.byte_order = std::endian::little;
  rules[3].payload.cut_longer_arrays = false;
  rules[3].types["fuzz_msgs/msg/Shape"].byte_orders = {{"flags", std::endian::big},
                                                       {"wide", std::endian::big}};
  rules[4].types["fuzz_msgs/msg/Block"].byte_orders = {{"b", std::endian::little}};
  rules[4].payload.string_terminator = rules[4].payload.string_bom = false;
  rules[4].payload.alignment = 4;
  for (std::size_t i = 5; i < rules.size(); ++i) {  // rules of single fields
    using messages::FieldRules;
    rules[i].default_missing = i == 6;
    rules[i].payload.struct_length = FieldWidth::none;
    rules[i].payload.length_fields_always_big = false;
    rules[i].types["fuzz_msgs/msg/Part"].fields = {{"kind", {.bits = 3}}, {"added", {.bits = 7}}};
    rules[i].types["fuzz_msgs/msg/Part#2"].itself.struct_length = FieldWidth::bits8;
    rules[i].types["fuzz_msgs/msg/Shape"].itself = {.union_length = FieldWidth::bits16,
                                                    .union_type = FieldWidth::bits8,
                                                    .union_length_first = i == 5,
                                                    .selectors = {4, 1, 200, 3}};
    rules[i].types["fuzz_msgs/msg/Block"].fields = {
        {"b", {.array_length = FieldWidth::bits8}},
        {"shape", {.union_length = FieldWidth::none, .union_bytes = i == 5 ? 0 : 40}}};
    rules[i].types["fuzz_msgs/msg/All"].fields = {
        {"blocks", {.array_length = FieldWidth::bits16, .struct_length = FieldWidth::bits16}},
        {"texts", {.string_length = FieldWidth::bits8, .bom = false, .terminator = false}},
        {"wide", {.string_length = FieldWidth::bits16, .encoding = someip::StringEncoding::utf16le}},
        {"part", {.variant = "fuzz_msgs/msg/Part#2"}},
        {"more", {.bits = 11}}};
  }
  return rules;
}

/// A plan that references as much as it can, one of the same type and rules that copies everything, and one
/// that does so by its operations alone.
struct Plans {
  messages::ConversionPlan referencing;
  messages::ConversionPlan copying;
  messages::ConversionPlan plain;
  bool has_type_rules = false;
};

/// Takes the two bytes from `input`; nothing when there are none.
inline const Plans* choose(ByteView& input) {
  static const std::vector<std::vector<Plans>> all = [] {
    using messages::ConversionPlan;
    std::vector<std::vector<Plans>> result;
    const auto plans = [](const messages::TypeTree& tree, const messages::MessageRules& rules, bool types) {
      return Plans{
          std::move(*ConversionPlan::compile(tree, rules, 1)),
          std::move(*ConversionPlan::compile(tree, rules, SIZE_MAX)),
          std::move(*ConversionPlan::compile(tree, rules, SIZE_MAX, ConversionPlan::Execution::plain)),
          types};
    };
    const auto add = [&](const messages::TypeTree& tree) {
      auto& of_type = result.emplace_back();
      for (const auto& rules : all_rules()) {
        of_type.push_back(plans(tree, rules, false));
      }
    };
    add(everything());
    messages::TypeLibrary library;
    for (const char* const name : {"sensor_msgs/PointCloud2", "tf2_msgs/TFMessage", "sensor_msgs/NavSatFix",
                                   "nav_msgs/Path", "std_msgs/Empty", "sensor_msgs/CameraInfo"}) {
      add(*library.resolve(name));
    }
    auto& with_rules = result.emplace_back();
    for (const auto& rules : all_type_rules()) {
      with_rules.push_back(plans(everything_with_rules(), rules, true));
    }
    for (const char* const name : {"sensor_msgs/LaserScan", "std_msgs/Float64MultiArray"}) {
      add(*library.resolve(name));  // behind the others, between which the seeds choose
    }
    return result;
  }();
  if (input.size() < 2) {
    return nullptr;
  }
  const auto& of_type = all[std::to_integer<std::size_t>(input[0]) % all.size()];
  const Plans& plans = of_type[std::to_integer<std::size_t>(input[1]) % of_type.size()];
  input = input.subspan(2);
  return &plans;
}

inline void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

inline std::vector<std::byte> whole(const messages::Gathered& gathered) {
  std::size_t bytes = 0;
  for (const ByteView slice : gathered.slices) {
    require(!slice.empty());
    bytes += slice.size();
  }
  require(bytes == gathered.bytes);
  std::vector<std::byte> result(bytes);
  copy_to(gathered, result.data());
  return result;
}

/// A message of which this one differs in a single bit.
inline std::vector<std::byte> almost(ByteView message, std::size_t bit) {
  std::vector<std::byte> bytes{message.begin(), message.end()};
  if (!bytes.empty()) {
    bytes[bit / 8 % bytes.size()] ^= static_cast<std::byte>(1U << bit % 8);
  }
  return bytes;
}

/// Converts messages that are almost `input`, and then this one, with one scratch: what it remembers must
/// make no difference, and the plan's operations alone must make the same of each.
/// @param convert  (plan, input, scratch)
template <typename Convert>
void require_the_same(const Plans& plans, ByteView input, const Convert& convert) {
  const auto outcome = [&](const messages::ConversionPlan& plan, ByteView message,
                           messages::ConversionScratch& scratch) {
    const auto result = convert(plan, message, scratch);
    return result ? std::pair{whole(*result), std::string{}}
                  : std::pair{std::vector<std::byte>{}, to_string(result.error())};
  };
  std::size_t bit = input.size();
  for (const std::byte byte : input) {
    bit = bit * 31 + std::to_integer<std::size_t>(byte);
  }
  const auto first = almost(input, bit);
  const auto second = almost(first, bit / 8191);
  messages::ConversionScratch scratch;
  for (const ByteView message :
       {ByteView{first}, ByteView{first}, ByteView{second}, input, ByteView{second}}) {
    messages::ConversionScratch fresh;
    const auto result = outcome(plans.copying, message, scratch);
    require(outcome(plans.copying, message, fresh) == result);
    require(outcome(plans.plain, message, fresh) == result);
  }
}

}  // namespace trestle::fuzz
