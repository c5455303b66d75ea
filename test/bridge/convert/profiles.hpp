#pragma once
#include <stdexcept>
#include <string>

#include "someip/wire/payload_rules.hpp"

namespace trestle::test {

/// The wire rules that test/bridge/oracle/oracle.py calls by this name.
inline someip::PayloadRules profile(const std::string& name) {
  using someip::FieldWidth;
  using someip::StringEncoding;
  someip::PayloadRules rules;
  if (name == "autosar") {
    rules.struct_length = rules.fixed_array_length = FieldWidth::bits32;
    rules.length_fields_always_big = true;
  } else if (name == "little") {
    rules.byte_order = std::endian::little;
  } else if (name == "little_big_lengths") {
    rules.byte_order = std::endian::little;
    rules.length_fields_always_big = true;
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
  } else if (name != "commonapi") {
    throw std::invalid_argument{"no profile " + name};
  }
  return rules;
}

}  // namespace trestle::test
