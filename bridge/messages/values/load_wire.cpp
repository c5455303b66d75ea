#include "bridge/messages/values/load_wire.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;
using someip::PayloadRules;
using someip::StringEncoding;

documents::Format<std::endian> byte_order() {
  return documents::one_of<std::endian>({{"big", std::endian::big}, {"little", std::endian::little}});
}

documents::Format<FieldWidth> field_width() {
  auto format = documents::one_of<FieldWidth>({{"0", FieldWidth::none},
                                               {"8", FieldWidth::bits8},
                                               {"16", FieldWidth::bits16},
                                               {"32", FieldWidth::bits32}});
  format.expected = "a width in bits: 0 (no such field), 8, 16 or 32";
  return format;
}

documents::Format<StringEncoding> encoding() {
  return documents::one_of<StringEncoding>({{"utf8", StringEncoding::utf8},
                                            {"utf16le", StringEncoding::utf16le},
                                            {"utf16be", StringEncoding::utf16be}});
}

documents::Format<bool> union_order() {
  return documents::one_of<bool>({{"length_first", true}, {"type_first", false}});
}

void load_payload_rules(documents::Section& wire, PayloadRules& rules) {
  // A profile replaces the defaults of the specification; the other keys then change single rules. There is
  // only one.
  wire.read("profile", documents::one_of<PayloadRules>({{"commonapi", someip::commonapi_rules}}), rules);
  wire.read("byte_order", byte_order(), rules.byte_order);
  wire.read("length_order", documents::one_of<bool>({{"big", true}, {"as_payload", false}}),
            rules.length_fields_always_big);
  wire.read("array_length", field_width(), rules.array_length);
  wire.read("fixed_array_length", field_width(), rules.fixed_array_length);
  wire.read("string_length", field_width(), rules.string_length);
  wire.read("struct_length", field_width(), rules.struct_length);
  wire.read("union_length", field_width(), rules.union_length);
  wire.read("union_type", field_width(), rules.union_type);
  wire.read("union_null", documents::truth(), rules.union_null);
  wire.read("union_order", union_order(), rules.union_length_first);
  wire.read("string_encoding", encoding(), rules.string_encoding);
  wire.read("string_bom", documents::truth(), rules.string_bom);
  wire.read("string_terminator", documents::truth(), rules.string_terminator);
  // In the file all widths are bits, as in the specification.
  auto alignment =
      documents::one_of<std::uint8_t>({{"8", 1}, {"16", 2}, {"32", 4}, {"64", 8}, {"128", 16}, {"256", 32}});
  alignment.expected = "an alignment in bits: 8 (none), 16, 32, 64, 128 or 256";
  wire.read("alignment", alignment, rules.alignment);
  wire.read("tagged_length", field_width(), rules.tagged_length);
  wire.read("tagged_lengths", documents::one_of<bool>({{"configured", false}, {"smallest", true}}),
            rules.smallest_tagged_length);
  wire.read("longer_arrays", documents::one_of<bool>({{"cut", true}, {"refuse", false}}),
            rules.cut_longer_arrays);
}

/// A mapping from fields to the setting of each.
template <typename T>
void load_fields(documents::Section& type, const char* key, const documents::Format<T>& format,
                 std::map<std::string, T, std::less<>>& into, documents::Problems& problems) {
  const YAML::Node node = type.child(key);
  if (!node) {
    return;
  }
  documents::Section fields{node, key, problems};
  for (const std::string& field : fields.keys()) {
    fields.read(field.c_str(), format, into[field]);
  }
}

template <typename T>
void read_optional(documents::Section& section, const char* key, const documents::Format<T>& format,
                   std::optional<T>& into) {
  T value{};
  if (section.read(key, format, value)) {
    into = std::move(value);
  }
}

/// What a message as a whole can have.
void load_frame(documents::Section& section, FieldRules& rules) {
  read_optional(section, "struct_length", field_width(), rules.struct_length);
  read_optional(section, "union_length", field_width(), rules.union_length);
  read_optional(section, "union_type", field_width(), rules.union_type);
  read_optional(section, "union_order", union_order(), rules.union_length_first);
  read_optional(section, "union_bytes", documents::as<std::uint32_t>(documents::whole_number(0, 65535)),
                rules.union_bytes);
  std::vector<documents::Mark> marks;
  section.read_list("selectors", documents::as<std::uint32_t>(documents::whole_number(0, 0xffff'ffff)),
                    rules.selectors, marks);
}

void load_field_rules(const YAML::Node& node, const std::string& field, FieldRules& rules,
                      documents::Problems& problems) {
  documents::Section section{node, field, problems};
  read_optional(section, "array_length", field_width(), rules.array_length);
  read_optional(section, "string_length", field_width(), rules.string_length);
  read_optional(section, "string_encoding", encoding(), rules.encoding);
  read_optional(section, "string_bom", documents::truth(), rules.bom);
  read_optional(section, "string_terminator", documents::truth(), rules.terminator);
  load_frame(section, rules);
  section.read("bits", documents::as<std::uint8_t>(documents::whole_number(1, 64)), rules.bits);
  section.read("rules", documents::any_text("a key of types, such as pkg/msg/Type#2"), rules.variant);
  section.finish();
}

void load_type(const YAML::Node& node, const std::string& name, TypeRules& rules,
               documents::Problems& problems) {
  using Form = TypeRules::Form;
  documents::Section type{node, name, problems};
  type.read("form",
            documents::one_of<Form>({{"struct", Form::structure},
                                     {"union", Form::choice},
                                     {"bits8", Form::bits8},
                                     {"bits16", Form::bits16},
                                     {"bits32", Form::bits32},
                                     {"empty", Form::empty}}),
            rules.form);
  load_fields(type, "tags", documents::as<someip::DataId>(documents::id_number(0, someip::max_data_id)),
              rules.tags, problems);
  load_fields(type, "fixed_strings", documents::as<std::uint32_t>(documents::whole_number(1, 65535)),
              rules.fixed_strings, problems);
  load_fields(type, "byte_orders", byte_order(), rules.byte_orders, problems);
  if (const YAML::Node itself = type.child("itself")) {
    documents::Section section{itself, "itself", problems};
    load_frame(section, rules.itself);
    section.finish();
  }
  if (const YAML::Node fields = type.child("fields")) {
    documents::Section section{fields, "fields", problems};
    for (const std::string& field : section.keys()) {
      if (const YAML::Node one = section.child(field.c_str())) {
        load_field_rules(one, field, rules.fields[field], problems);
      }
    }
  }
  type.finish();
}

void load_types(const YAML::Node& node, MessageRules& rules, documents::Problems& problems) {
  documents::Section types{node, "types", problems};
  for (const std::string& name : types.keys()) {
    const std::string_view message = type_of_rules(name);
    if (!is_type_name(message) && !is_service_type_name(message)) {
      problems.error(
          types.use_mark(name.c_str()),
          fmt::format("types: expected a message type such as sensor_msgs/msg/PointCloud2, found {}",
                      documents::quote(name)));
      continue;
    }
    const YAML::Node type = types.child(name.c_str());
    if (type) {
      load_type(type, name, rules.types[name], problems);
    }
  }
}

}  // namespace

void load_wire(const YAML::Node& node, MessageRules& rules, documents::Problems& problems) {
  documents::Section wire{node, "wire", problems};
  load_payload_rules(wire, rules.payload);
  wire.read("missing_fields", documents::one_of<bool>({{"refuse", false}, {"default", true}}),
            rules.default_missing);
  if (const YAML::Node types = wire.child("types")) {
    load_types(types, rules, problems);
  }
  wire.finish();
}

}  // namespace trestle::messages
