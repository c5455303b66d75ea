#include "bridge/messages/values/wire_yaml.hpp"

#include <fmt/format.h>

namespace trestle::messages {
namespace {

using someip::FieldWidth;
using someip::StringEncoding;

std::string word(FieldWidth width) {
  return fmt::to_string(8 * someip::bytes(width));
}
std::string word(std::endian order) {
  return order == std::endian::big ? "big" : "little";
}
std::string word(bool truth) {
  return truth ? "true" : "false";
}
std::string word(StringEncoding encoding) {
  return encoding == StringEncoding::utf8      ? "utf8"
         : encoding == StringEncoding::utf16le ? "utf16le"
                                               : "utf16be";
}
std::string word(std::uint32_t number) {
  return fmt::to_string(number);
}
std::string word(someip::DataId id) {
  return fmt::format("0x{:03x}", static_cast<unsigned>(id));
}
std::string union_order(bool length_first) {
  return length_first ? "length_first" : "type_first";
}

void put(YAML::Node& node, const char* key, const std::string& value) {
  node[key] = value;
}
/// When the two differ.
template <typename T>
void put(YAML::Node& node, const char* key, const T& value, const T& usual) {
  if (value != usual) {
    put(node, key, word(value));
  }
}
template <typename T>
void put(YAML::Node& node, const char* key, const std::optional<T>& value) {
  if (value) {
    put(node, key, word(*value));
  }
}
/// When there is something in it.
void put(YAML::Node& node, const char* key, const YAML::Node& child) {
  if (child.size() != 0) {
    node[key] = child;
  }
}

void put_payload(YAML::Node& node, const someip::PayloadRules& rules) {
  const someip::PayloadRules usual;
  put(node, "byte_order", rules.byte_order, usual.byte_order);
  if (rules.length_fields_always_big != usual.length_fields_always_big) {
    put(node, "length_order", rules.length_fields_always_big ? "big" : "as_payload");
  }
  put(node, "array_length", rules.array_length, usual.array_length);
  put(node, "fixed_array_length", rules.fixed_array_length, usual.fixed_array_length);
  put(node, "string_length", rules.string_length, usual.string_length);
  put(node, "struct_length", rules.struct_length, usual.struct_length);
  put(node, "union_length", rules.union_length, usual.union_length);
  put(node, "union_type", rules.union_type, usual.union_type);
  put(node, "union_null", rules.union_null, usual.union_null);
  if (rules.union_length_first != usual.union_length_first) {
    put(node, "union_order", union_order(rules.union_length_first));
  }
  put(node, "string_encoding", rules.string_encoding, usual.string_encoding);
  put(node, "string_bom", rules.string_bom, usual.string_bom);
  put(node, "string_terminator", rules.string_terminator, usual.string_terminator);
  if (rules.alignment > 1) {
    put(node, "alignment", word(std::uint32_t{rules.alignment} * 8));
  }
  put(node, "tagged_length", rules.tagged_length, usual.tagged_length);
  if (rules.smallest_tagged_length) {
    put(node, "tagged_lengths", "smallest");
  }
  if (!rules.cut_longer_arrays) {
    put(node, "longer_arrays", "refuse");
  }
}

void put_frame(YAML::Node& node, const FieldRules& rules) {
  put(node, "struct_length", rules.struct_length);
  put(node, "union_length", rules.union_length);
  put(node, "union_type", rules.union_type);
  if (rules.union_length_first) {
    put(node, "union_order", union_order(*rules.union_length_first));
  }
  put(node, "union_bytes", rules.union_bytes);
  YAML::Node selectors{YAML::NodeType::Sequence};
  for (const std::uint32_t selector : rules.selectors) {
    selectors.push_back(word(selector));
  }
  put(node, "selectors", selectors);
}

YAML::Node field_yaml(const FieldRules& rules) {
  YAML::Node node{YAML::NodeType::Map};
  put(node, "array_length", rules.array_length);
  put(node, "string_length", rules.string_length);
  put(node, "string_encoding", rules.encoding);
  put(node, "string_bom", rules.bom);
  put(node, "string_terminator", rules.terminator);
  put_frame(node, rules);
  if (rules.bits != 0) {
    put(node, "bits", word(std::uint32_t{rules.bits}));
  }
  if (!rules.variant.empty()) {
    put(node, "rules", rules.variant);
  }
  return node;
}

template <typename Map>
YAML::Node map_yaml(const Map& map) {
  YAML::Node node{YAML::NodeType::Map};
  for (const auto& [field, value] : map) {
    node[field] = word(value);
  }
  return node;
}

const char* word(TypeRules::Form form) {
  using Form = TypeRules::Form;
  switch (form) {
    case Form::structure:
      return "struct";
    case Form::choice:
      return "union";
    case Form::bits8:
      return "bits8";
    case Form::bits16:
      return "bits16";
    case Form::bits32:
      return "bits32";
    case Form::empty:
      return "empty";
  }
  return "";
}

YAML::Node type_yaml(const TypeRules& rules) {
  YAML::Node node{YAML::NodeType::Map};
  if (rules.form != TypeRules::Form::structure) {
    put(node, "form", word(rules.form));
  }
  put(node, "tags", map_yaml(rules.tags));
  put(node, "fixed_strings", map_yaml(rules.fixed_strings));
  put(node, "byte_orders", map_yaml(rules.byte_orders));
  YAML::Node itself{YAML::NodeType::Map};
  put_frame(itself, rules.itself);
  put(node, "itself", itself);
  YAML::Node fields{YAML::NodeType::Map};
  for (const auto& [field, one] : rules.fields) {
    if (const YAML::Node yaml = field_yaml(one); yaml.size() != 0) {
      fields[field] = yaml;
    }
  }
  put(node, "fields", fields);
  return node;
}

}  // namespace

YAML::Node wire_yaml(const MessageRules& rules) {
  YAML::Node node{YAML::NodeType::Map};
  put_payload(node, rules.payload);
  if (rules.default_missing) {
    put(node, "missing_fields", "default");
  }
  YAML::Node types{YAML::NodeType::Map};
  for (const auto& [name, one] : rules.types) {
    if (const YAML::Node yaml = type_yaml(one); yaml.size() != 0) {
      types[name] = yaml;
    }
  }
  put(node, "types", types);
  return node.size() == 0 ? YAML::Node{} : node;
}

}  // namespace trestle::messages
