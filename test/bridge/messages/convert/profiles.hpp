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

}  // namespace trestle::test
