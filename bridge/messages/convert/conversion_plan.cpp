#include "bridge/messages/convert/conversion_plan.hpp"

#include <fmt/format.h>

#include <array>

namespace trestle::messages {

const char* to_string(ConversionFault fault) noexcept {
  constexpr std::array<const char*, conversion_faults> names{
      "truncated",  "bad_encapsulation", "trailing_bytes", "bound_exceeded",  "bad_bool",
      "bad_string", "bad_encoding",      "bad_length",     "length_overflow", "too_large",
      "bad_tag",    "missing_member",    "bad_union",      "not_in_table"};
  const auto index = static_cast<std::size_t>(fault);
  return index < names.size() ? names[index] : "?";
}

std::string place_of(const ConversionError& error) {
  return fmt::format("{}{}{}{}", to_string(error.fault),
                     error.is_between ? "" : fmt::format(" at byte {}", error.offset),
                     error.field.empty() ? "" : " in ", error.field);
}

std::string to_string(const ConversionError& error) {
  return place_of(error) + (error.expected.empty() ? "" : ": ") + error.expected;
}

void ConversionPlan::expect(ByteView message, const ConversionScratch& scratch) const noexcept {
  if (program_.quick.array_at == 0 || message.empty()) {
    return;
  }
  scratch.memory().fetch();
  __builtin_prefetch(message.data());
  __builtin_prefetch(&message.back());
}

}  // namespace trestle::messages
