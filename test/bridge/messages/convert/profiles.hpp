#pragma once
#include <stdexcept>
#include <string>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "someip/wire/payload_rules.hpp"

namespace trestle::test {

/// The wire rules that test/bridge/oracle/oracle.py calls by this name.
inline someip::PayloadRules profile(const std::string& name) {
  using someip::FieldWidth;
  using someip::StringEncoding;
  someip::PayloadRules rules;
  if (name == "autosar") {
    rules.struct_length = rules.fixed_array_length = FieldWidth::bits32;
  } else if (name == "commonapi_little") {
    rules = someip::commonapi_rules;
    rules.byte_order = std::endian::little;
  } else if (name == "little") {
    rules.byte_order = std::endian::little;
    rules.struct_length = FieldWidth::bits16;
  } else if (name == "short") {
    rules.array_length = rules.string_length = rules.struct_length = rules.fixed_array_length =
        FieldWidth::bits16;
  } else if (name == "legacy_strings") {
    rules.string_bom = rules.string_terminator = false;
    rules.string_length = FieldWidth::bits8;
  } else if (name == "utf16le") {
    rules.string_encoding = StringEncoding::utf16le;
  } else if (name == "utf16be_plain") {
    rules.string_encoding = StringEncoding::utf16be;
    rules.string_bom = false;
  } else if (name == "aligned4") {
    rules.alignment = 4;
  } else if (name == "aligned32") {
    rules.alignment = 32;
    rules.byte_order = std::endian::little;
    rules.struct_length = FieldWidth::bits32;
  } else if (name == "commonapi") {
    rules = someip::commonapi_rules;
  } else {
    throw std::invalid_argument{"no profile " + name};
  }
  return rules;
}

/// The same with the rules of single fields, which "by_field" has.
inline messages::MessageRules message_rules(const std::string& name, const messages::TypeTree& tree) {
  using messages::ArrayKind;
  using someip::FieldWidth;
  if (name != "by_field") {
    return profile(name);
  }
  messages::MessageRules rules;
  for (const messages::MessageDefinition& message : tree.messages) {
    for (std::size_t i = 0; i < message.fields.size(); ++i) {
      const messages::Field& field = message.fields[i];
      if (i % 3 == 0) {
        continue;
      }
      messages::FieldRules& own = rules.types[message.name].fields[field.name];
      if (field.type.array != ArrayKind::none) {
        const bool is_fixed = field.type.array == ArrayKind::fixed;
        own.array_length = i % 3 == 1 ? FieldWidth::bits16 : is_fixed ? FieldWidth::none : FieldWidth::bits32;
      }
      if (!field.type.primitive) {
        own.struct_length = i % 3 == 1 ? FieldWidth::bits16 : FieldWidth::bits32;
      } else if (messages::width(*field.type.primitive) == 0) {
        own.string_length = i % 3 == 1 ? FieldWidth::bits16 : FieldWidth::bits8;
        if (i % 3 == 2) {
          own.encoding = someip::StringEncoding::utf16be;
          own.bom = false;
        }
      }
    }
  }
  return rules;
}

}  // namespace trestle::test
