#include "bridge/describe/units.hpp"

namespace trestle::describe {
namespace {

std::string unit_of(const Model& model, const Value& value, bool looks_into_arrays) {
  TypeIndex index = value.type;
  const std::string* unit = &value.notes.unit;
  for (std::size_t steps = 0;
       unit->empty() && static_cast<std::size_t>(index) < model.types.size() && steps <= max_type_nesting;
       ++steps) {
    const Type& type = model.at(index);
    unit = &type.notes.unit;
    if (type.kind != Kind::alias && (type.kind != Kind::array || !looks_into_arrays)) {
      break;
    }
    if (unit->empty()) {
      unit = &type.element.notes.unit;
    }
    index = type.element.type;
  }
  return *unit;
}

}  // namespace

std::string measured_in(const Model& model, const Value& value) {
  return unit_of(model, value, true);
}

std::string measured_as_whole_in(const Model& model, const Value& value) {
  return unit_of(model, value, false);
}

}  // namespace trestle::describe
