#include "bridge/describe/raise.hpp"

#include <algorithm>
#include <utility>

namespace trestle::describe {
namespace {

using messages::ArrayKind;
using messages::Primitive;

class Raising {
 public:
  explicit Raising(Model& model) : model_{model} {}

  TypeIndex message(const messages::MessageDefinition& definition) {
    const auto known = std::ranges::find_if(model_.types, [&](const Type& type) {
      return type.kind == Kind::structure && type.ros_name == definition.name;
    });
    if (known != model_.types.end()) {
      return TypeIndex{static_cast<std::uint32_t>(known - model_.types.begin())};
    }
    Type type{.kind = Kind::structure,
              .name = definition.name.substr(definition.name.rfind('/') + 1),
              .scope = definition.name.substr(0, definition.name.find('/')),
              .ros_name = definition.name};
    for (const messages::Field& field : definition.fields) {
      Value value = value_of(model_, of_field(field.type), field.name);
      value.default_value = field.default_value;
      type.members.push_back(std::move(value));
    }
    if (type.members.empty()) {
      // The byte that such a message has in ROS, and in SOME/IP too.
      type.members.push_back(
          value_of(model_, primitive(Primitive::uint8), "structure_needs_at_least_one_member"));
    }
    for (const messages::Constant& constant : definition.constants) {
      const bool is_text = messages::width(constant.type) == 0;
      model_.constants.push_back({.name = constant.name,
                                  .type = is_text ? text(constant.type, 0) : primitive(constant.type),
                                  .value = constant.value,
                                  .scope = definition.name});
    }
    return model_.add(std::move(type));
  }

 private:
  TypeIndex of_field(const messages::FieldType& type) {
    const TypeIndex element = !type.primitive ? named(type.message)
                              : messages::width(*type.primitive) == 0
                                  ? text(*type.primitive, type.string_bound)
                                  : primitive(*type.primitive);
    if (type.array == ArrayKind::none) {
      return element;
    }
    const bool is_fixed = type.array == ArrayKind::fixed;
    Type array{.kind = Kind::array,
               .wire = default_wire(Kind::array),
               .element = value_of(model_, element, {}),
               .max_size = type.array_size,
               .fixed_size = is_fixed};
    if (is_fixed) {
      array.wire.length = someip::FieldWidth::none;
    }
    return model_.add(std::move(array));
  }

  /// A message that stands before this one in the tree.
  [[nodiscard]] TypeIndex named(const std::string& name) const {
    const auto found = std::ranges::find_if(model_.types, [&](const Type& type) {
      return type.kind == Kind::structure && type.ros_name == name;
    });
    return found == model_.types.end() ? no_type
                                       : TypeIndex{static_cast<std::uint32_t>(found - model_.types.begin())};
  }

  TypeIndex primitive(Primitive primitive) {
    return add_once({.kind = Kind::primitive, .primitive = primitive});
  }

  TypeIndex text(Primitive primitive, std::uint32_t bound) {
    Type type{.kind = Kind::string, .wire = default_wire(Kind::string), .max_size = bound};
    if (primitive == Primitive::wstring) {
      type.ros_name = "wstring";
      type.wire.encoding = someip::StringEncoding::utf16be;
    }
    return add_once(std::move(type));
  }

  TypeIndex add_once(Type type) {
    const auto found = std::ranges::find_if(model_.types, [&](const Type& one) {
      return one.kind == type.kind && one.name.empty() && one.ros_name == type.ros_name &&
             one.primitive == type.primitive && one.max_size == type.max_size && one.wire == type.wire &&
             !one.invalid_value && !one.minimum && !one.maximum && one.min_size == 0 && !one.fixed_size;
    });
    return found == model_.types.end() ? model_.add(std::move(type))
                                       : TypeIndex{static_cast<std::uint32_t>(found - model_.types.begin())};
  }

  Model& model_;
};

}  // namespace

TypeIndex raise(Model& model, const messages::TypeTree& tree) {
  TypeIndex last = no_type;
  for (const messages::MessageDefinition& definition : tree.messages) {
    last = Raising{model}.message(definition);
  }
  return last;
}

Value value_of(const Model& model, TypeIndex type, std::string name) {
  Value value{.name = std::move(name), .type = type};
  if (type != no_type) {
    value.wire = model.at(type).wire;
  }
  return value;
}

Method raise(Model& model, const messages::ServiceTypes& types, std::string name) {
  Method method{.name = std::move(name)};
  // Calls without arguments have no payload.
  if (!types.request.root().fields.empty()) {
    method.request.values = {value_of(model, raise(model, types.request), "request")};
  }
  if (!types.response.root().fields.empty()) {
    method.response.values = {value_of(model, raise(model, types.response), "response")};
  }
  return method;
}

}  // namespace trestle::describe
