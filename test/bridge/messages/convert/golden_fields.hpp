#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "test/bridge/messages/convert/support.hpp"

/// Whole messages in bytes computed by hand: field by field what stands in the CDR sample (little endian,
/// with the padding before the field) and in the payload (default rules: big endian, no padding; arrays with
/// their length in bytes and strings with theirs, a byte order mark and a terminator; no struct lengths).
namespace trestle::test {

/// One field of a message in both forms.
struct GoldenField {
  const char* name_and_value;
  std::string cdr;
  std::string payload;
};

inline std::string times(int count, const std::string& digits) {
  std::string all;
  for (int i = 0; i < count; ++i) {
    all += digits;
  }
  return all;
}

/// What was converted, field by field, so that a failure names the first wrong one.
inline void expect_fields(std::string_view converted, const std::vector<GoldenField>& fields,
                          std::string GoldenField::*form) {
  for (const GoldenField& field : fields) {
    const std::string digits = compact(field.*form);
    ASSERT_EQ(converted.substr(0, digits.size()), digits) << field.name_and_value;
    converted.remove_prefix(digits.size());
  }
  EXPECT_EQ(converted, "");
}

/// Converts the CDR sample that the fields make up into their payload, and back.
inline void expect_both_ways(std::string_view type, const std::vector<GoldenField>& fields) {
  const messages::ConversionPlan plan = plan_of(builtin(type));
  const std::string encapsulation = "00010000";
  std::string cdr = encapsulation;
  std::string payload;
  for (const GoldenField& field : fields) {
    cdr += field.cdr;
    payload += field.payload;
  }
  expect_fields(to_someip(plan, cdr), fields, &GoldenField::payload);
  const std::string sample = to_cdr(plan, payload);
  ASSERT_EQ(sample.substr(0, encapsulation.size()), encapsulation);
  expect_fields(std::string_view{sample}.substr(encapsulation.size()), fields, &GoldenField::cdr);
}

}  // namespace trestle::test
