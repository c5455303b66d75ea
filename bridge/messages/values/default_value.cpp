#include "bridge/messages/values/default_value.hpp"

#include "bridge/messages/types/default_elements.hpp"

namespace trestle::messages {

TextValue default_value(const Field& field) {
  TextValue list;
  list.kind = TextValue::Kind::list;
  for (DefaultElement& element : default_elements(field)) {
    TextValue value;
    value.kind = element.quoted ? TextValue::Kind::quoted : TextValue::Kind::plain;
    value.text = std::move(element.text);
    list.elements.push_back(std::move(value));
  }
  return field.type.array == ArrayKind::none ? std::move(list.elements.front()) : std::move(list);
}

}  // namespace trestle::messages
