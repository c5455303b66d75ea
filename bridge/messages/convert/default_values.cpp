#include "bridge/messages/convert/default_values.hpp"

#include <bit>

#include "bridge/messages/types/default_elements.hpp"
#include "bridge/messages/types/number_text.hpp"

namespace trestle::messages {
namespace {

std::uint64_t bits_of(Primitive type, const std::string& text) {
  switch (type) {
    case Primitive::boolean:
      return text == "true" ? 1 : 0;
    case Primitive::float32:
      return std::bit_cast<std::uint32_t>(read_float<float>(text).value_or(0));
    case Primitive::float64:
      return std::bit_cast<std::uint64_t>(read_float<double>(text).value_or(0));
    default:
      break;
  }
  const Whole whole = read_signed(text).value_or(Whole{});
  return whole.negative ? std::uint64_t{0} - whole.magnitude : whole.magnitude;
}

}  // namespace

DefaultValue default_value_of(const Field& field) {
  DefaultValue value;
  value.type = *field.type.primitive;
  value.is_sequence = field.type.array == ArrayKind::bounded || field.type.array == ArrayKind::unbounded;
  for (DefaultElement& element : default_elements(field)) {
    if (width(value.type) == 0) {
      value.strings.push_back(std::move(element.text));
    } else {
      value.numbers.push_back(bits_of(value.type, element.text));
    }
  }
  return value;
}

}  // namespace trestle::messages
