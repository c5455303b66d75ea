#include "bridge/describe/units.hpp"

namespace trestle::describe {

std::string measured_in(const Model& model, const Value& value) {
  TypeIndex index = value.type;
  const std::string* unit = &value.notes.unit;
  for (std::size_t steps = 0;
       unit->empty() && static_cast<std::size_t>(index) < model.types.size() && steps <= max_type_nesting;
       ++steps) {
    const Type& type = model.at(index);
    unit = &type.notes.unit;
    if (type.kind != Kind::alias && type.kind != Kind::array) {
      break;
    }
    if (unit->empty()) {
      unit = &type.element.notes.unit;
    }
    index = type.element.type;
  }
  return *unit;
}

}  // namespace trestle::describe
