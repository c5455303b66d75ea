#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/model_source.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/messages/values/message_values.hpp"

/// Small models, and what becomes of them.
namespace trestle::describe::lowered {

inline TypeIndex number(Model& model, messages::Primitive primitive) {
  return model.add({.kind = Kind::primitive, .primitive = primitive});
}
inline TypeIndex text(Model& model) {
  return model.add({.kind = Kind::string, .wire = default_wire(Kind::string)});
}
inline Value value(const Model& model, std::string name, TypeIndex type) {
  return {.name = std::move(name), .type = type, .wire = model.at(type).wire};
}
inline TypeIndex array_of(Model& model, const Value& element) {
  return model.add({.kind = Kind::array, .wire = default_wire(Kind::array), .element = element});
}
inline TypeIndex structure(Model& model, std::string name, std::vector<Value> members) {
  return model.add(
      {.kind = Kind::structure, .name = std::move(name), .scope = "org.test", .members = std::move(members)});
}

/// Makes the model one of a service whose event carries these values.
inline Event& event(Model& model, std::vector<Value> values) {
  if (model.services.empty()) {
    model.services.push_back({.name = "Door", .scope = "org.test", .id = someip::ServiceId{0x1234}});
  }
  Event event{.name = "changed", .id = someip::MethodId{0x8001}};
  event.payload.values = std::move(values);
  return model.services.back().events.emplace_back(std::move(event));
}

inline messages::TypeLibrary library_of(const Lowered& lowered) {
  return messages::TypeLibrary::of({std::make_shared<ModelSource>(lowered, "test.fidl")});
}

/// The values of a member, by the library.
inline messages::MessageValues values_of(const Lowered& lowered, const LoweredMember& member) {
  auto tree = library_of(lowered).resolve(member.type);
  if (!tree) {
    throw std::invalid_argument{to_string(tree.error())};
  }
  auto values = messages::MessageValues::make(std::move(*tree), member.rules);
  if (!values) {
    throw std::invalid_argument{values.error()};
  }
  return std::move(*values);
}

}  // namespace trestle::describe::lowered
