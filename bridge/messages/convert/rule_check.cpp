#include "bridge/messages/convert/rule_check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trestle::messages {
namespace {

bool is_integer(Primitive primitive) {
  return width(primitive) != 0 && primitive != Primitive::boolean && primitive != Primitive::float32 &&
         primitive != Primitive::float64;
}

}  // namespace

void RuleCheck::check_types() {
  for (const auto& [name, own] : rules_.types) {
    const auto used = std::ranges::find(tree_.messages, type_of_rules(name), &MessageDefinition::name);
    if (used == tree_.messages.end()) {
      complain_(fmt::format("there are rules for {}, which it does not contain", name));
      continue;
    }
    const auto has_field = [&](const std::string& field) {
      return std::ranges::find(used->fields, field, &Field::name) != used->fields.end();
    };
    const auto expect_fields = [&](const auto& rules, const char* what) {
      for (const auto& [field, rule] : rules) {
        if (!has_field(field)) {
          complain_(fmt::format("{} has no field {}, for which there is a {}", used->name, field, what));
        }
      }
    };
    expect_fields(own.tags, "tag");
    expect_fields(own.fixed_strings, "size");
    expect_fields(own.byte_orders, "byte order");
    expect_fields(own.fields, "rule");
    for (const Field& field : used->fields) {
      if (own.byte_orders.contains(field.name) && field.type.primitive && width(*field.type.primitive) < 2) {
        complain_(fmt::format("{} has a byte order for {}, which has no numbers of several bytes", name,
                              field.name));
      }
    }
    const bool has_fields = own.form == TypeRules::Form::structure || own.form == TypeRules::Form::choice;
    if ((own.form != TypeRules::Form::structure && !own.tags.empty()) ||
        (!has_fields && !own.fixed_strings.empty())) {
      complain_(fmt::format("{} is no struct, so its fields have no tags or fixed sizes", name));
    }
    if (!has_fields && !own.fields.empty()) {
      complain_(fmt::format("{} is neither a struct nor a union, so its fields have no rules", name));
    }
    if (own.form == TypeRules::Form::empty && !used->fields.empty()) {
      complain_(fmt::format("{} is empty, but has fields", name));
    }
    check_itself(own, name);
  }
}

/// Of a message as a whole there are only the rules of structs and unions.
void RuleCheck::check_itself(const TypeRules& own, const std::string& name) {
  const FieldRules& itself = own.itself;
  if (itself.array_length || itself.string_length || itself.encoding || itself.bom || itself.terminator ||
      itself.bits != 0 || !itself.variant.empty()) {
    complain_(fmt::format("{} has rules for itself that only fields have", name));
  }
  check_frame(itself, own.form, name);
}

/// Whether a message of this form has what the rules are about.
void RuleCheck::check_frame(const FieldRules& rules, TypeRules::Form form, const std::string& what) {
  const bool of_union = rules.union_length || rules.union_type || rules.union_length_first ||
                        rules.union_bytes || !rules.selectors.empty();
  if (rules.struct_length && form != TypeRules::Form::structure) {
    complain_(fmt::format("{} has a struct length, but is no struct", what));
  }
  if (of_union && form != TypeRules::Form::choice) {
    complain_(fmt::format("{} has rules of a union, but is none", what));
  }
}

void RuleCheck::check_variants() {
  const auto is_taken = [&](const std::string& variant) {
    return std::ranges::any_of(rules_.types, [&](const auto& type) {
      return std::ranges::any_of(type.second.fields,
                                 [&](const auto& field) { return field.second.variant == variant; });
    });
  };
  for (const auto& [name, own] : rules_.types) {
    if (type_of_rules(name) != name && !is_taken(name)) {
      complain_(fmt::format("there are rules for {}, which no field takes", name));
    }
  }
}

void RuleCheck::check_use(const FieldType& type, const FieldRules& use, const std::string& path,
                          bool is_tagged) {
  const bool is_array = type.array != ArrayKind::none;
  const bool is_string = type.primitive && width(*type.primitive) == 0;
  if (use.array_length && !is_array) {
    complain_(fmt::format("{} has an array length, but is no array", path));
  }
  if ((use.string_length || use.encoding || use.bom || use.terminator) && !is_string) {
    complain_(fmt::format("{} has rules of a string, but is none", path));
  }
  if (use.bits != 0 && (!type.primitive || !is_integer(*type.primitive))) {
    complain_(fmt::format("{} has a number of bits, but is no integer", path));
  }
  if (type.primitive) {
    check_frame(use, TypeRules::Form::empty, path);
    if (!use.variant.empty()) {
      complain_(fmt::format("{} takes the rules {}, but is no message", path, use.variant));
    }
  } else {
    const MessageDefinition& nested = tree_.messages[type.message_index];
    const TypeRules* const own = rules_of(nested, &use);
    check_frame(use, own == nullptr ? TypeRules::Form::structure : own->form, path);
  }
  if (is_tagged && (use.array_length || use.bits != 0 ||
                    (!is_array && (use.string_length || use.struct_length || use.union_length)))) {
    complain_(fmt::format("{} is tagged: its length field is the one of tagged members", path));
  }
}

const TypeRules* RuleCheck::rules_of(const MessageDefinition& definition, const FieldRules* use) {
  const bool is_variant = use != nullptr && !use->variant.empty();
  const std::string& key = is_variant ? use->variant : definition.name;
  const auto own = rules_.types.find(key);
  if (is_variant && (own == rules_.types.end() || type_of_rules(key) != definition.name)) {
    complain_(fmt::format("a field takes the rules {}, which are none of {}", key, definition.name));
    return nullptr;
  }
  return own == rules_.types.end() ? nullptr : &own->second;
}

}  // namespace trestle::messages
