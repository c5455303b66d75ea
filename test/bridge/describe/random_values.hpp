#pragma once
#include <gtest/gtest.h>

#include <algorithm>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "test/bridge/messages/convert/random_message.hpp"
#include "test/bytes.hpp"

/// Random values of a type: from a sample to a payload and back.
namespace trestle::describe::random_values {

/// The largest number of bits that a field of this name may not exceed in any variant, so that all have room.
inline messages::MessageRules with_fewest_bits(const messages::MessageRules& rules) {
  messages::MessageRules fewest = rules;
  for (const auto& [key, type] : rules.types) {
    messages::TypeRules& own = fewest.types[std::string{messages::type_of_rules(key)}];
    own.form = type.form;
    for (const auto& [name, field] : type.fields) {
      std::uint8_t& bits = own.fields[name].bits;
      bits = bits == 0 ? field.bits : field.bits == 0 ? bits : std::min(bits, field.bits);
    }
  }
  return fewest;
}

/// Sends values of a type both ways, in the quick and in the plain way, and expects that the samples come
/// back.
/// @return how many were carried: of those that do not fit (a text that is longer than its length field can
///         tell) there is no payload.
inline unsigned carried(const messages::TypeTree& tree, const messages::MessageRules& rules, unsigned turns,
                        const test::RandomSizes& sizes = {.elements = 2}) {
  using messages::ConversionPlan;
  const auto quick = ConversionPlan::compile(tree, rules, 64);
  const auto plain = ConversionPlan::compile(tree, rules, 64, ConversionPlan::Execution::plain);
  if (!quick || !plain) {
    ADD_FAILURE() << quick.error();
    return 0;
  }
  const messages::MessageRules bits = with_fewest_bits(rules);
  messages::ConversionScratch there;
  messages::ConversionScratch back;
  messages::ConversionScratch other;
  unsigned count = 0;
  for (unsigned turn = 0; turn < turns; ++turn) {
    const auto sample = test::RandomMessage{tree, std::endian::native, turn / 2, turn, bits, sizes}.bytes();
    const auto payload = quick->cdr_to_someip(sample, there);
    const auto same = plain->cdr_to_someip(sample, other);
    EXPECT_EQ(payload.has_value(), same.has_value());
    if (!payload || !same) {
      continue;
    }
    const auto bytes = joined(*payload);
    EXPECT_EQ(test::to_hex(bytes), test::to_hex(joined(*same)));
    const auto again = quick->someip_to_cdr(bytes, back);
    if (!again) {
      ADD_FAILURE() << to_string(again.error());
      continue;
    }
    EXPECT_EQ(test::to_hex(joined(*again)), test::to_hex(sample));
    ++count;
  }
  return count;
}

}  // namespace trestle::describe::random_values
