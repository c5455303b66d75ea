#include "bridge/generate/page_form.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace trestle::generate {
namespace {

using describe::Kind;
using describe::Value;
using messages::ArrayKind;
using messages::Primitive;
using Json = nlohmann::ordered_json;

bool is_listed(Kind kind) {
  return kind == Kind::array || kind == Kind::map || kind == Kind::bytes;
}

bool is_signed(Primitive primitive) {
  return primitive == Primitive::int8 || primitive == Primitive::int16 || primitive == Primitive::int32 ||
         primitive == Primitive::int64;
}

/// Goes through a message and what it is in the description side by side. Where the two do not fit, there are
/// no labels and enumerators, and else the same form.
class FormMaker {
 public:
  FormMaker(const describe::Model& model, const messages::TypeTree& tree) : model_{model}, tree_{tree} {}

  Json made(const std::vector<Value>& values) {
    const std::size_t root = tree_.messages.size() - 1;
    const std::size_t type = type_of(root, values, "", Kind::structure);
    return Json{{"type", type}, {"types", std::move(types_)}};
  }

 private:
  /// The type of a value behind aliases; null: it has none.
  [[nodiscard]] const describe::Type* known(const Value& value) const {
    return static_cast<std::size_t>(value.type) < model_.types.size()
               ? &describe::resolved(model_, value.type)
               : nullptr;
  }

  /// The form of a message, made once.
  std::size_t type_of(std::size_t message, const std::vector<Value>& values, const std::string& label,
                      Kind kind) {
    if (const auto found = made_.find(message); found != made_.end()) {
      return found->second;
    }
    const std::size_t index = types_.size();
    made_[message] = index;
    const messages::MessageDefinition& definition = tree_.messages[message];
    types_.push_back({{"label", label.empty() ? definition.name : label}});
    if (kind == Kind::choice) {
      types_[index]["choice"] = true;
    }
    Json fields = Json::array();
    const bool fits = values.size() == definition.fields.size();
    for (std::size_t i = 0; i < definition.fields.size(); ++i) {
      fields.push_back(field(definition.fields[i], fits ? &values[i] : nullptr, kind));
    }
    types_[index]["fields"] = std::move(fields);
    return index;
  }

  Json field(const messages::Field& field, const Value* value, Kind owner) {
    const describe::Type* const type = value != nullptr ? known(*value) : nullptr;
    Json json{{"name", field.name},
              {"label", value != nullptr && !value->name.empty() ? value->name : field.name}};
    // What is in a choice, or may be missing, is a T[<=1].
    const bool alone = type != nullptr && field.type.array == ArrayKind::bounded &&
                       field.type.array_size == 1 &&
                       (owner == Kind::choice || (value->optional && value->tag && !is_listed(type->kind)));
    const Value* const element =
        type != nullptr && type->kind == Kind::array && !alone ? &type->element : value;
    scalar(json, field.type, element);
    if (!field.type.primitive) {
      json["type"] = nested(field.type.message_index, value, type, alone);
    }
    if (alone) {
      json["optional"] = true;
    } else if (field.type.array == ArrayKind::fixed) {
      json["array"] = "fixed";
    } else if (field.type.array != ArrayKind::none && json["kind"] != "bytes") {
      json["array"] = "list";
    }
    if (!alone && field.type.array_size != 0) {
      json["size"] = field.type.array_size;
    }
    if (!field.default_value.empty()) {
      json["default"] = field.default_value;
    }
    if (value != nullptr && !value->notes.unit.empty()) {
      json["unit"] = value->notes.unit;
    }
    if (value != nullptr && !value->notes.description.empty()) {
      json["description"] = value->notes.description;
    }
    return json;
  }

  std::size_t nested(std::size_t message, const Value* value, const describe::Type* type, bool alone) {
    if (type == nullptr) {
      return type_of(message, {}, "", Kind::structure);
    }
    if (alone && is_listed(type->kind)) {
      return type_of(message, {*value}, type->name, Kind::structure);
    }
    if (type->kind == Kind::map) {
      Value key = type->key;
      Value element = type->element;
      key.name = "key";
      element.name = "value";
      return type_of(message, {key, element}, type->name, Kind::structure);
    }
    const describe::Type* inner = type->kind == Kind::array ? known(type->element) : type;
    if (inner == nullptr) {
      return type_of(message, {}, "", Kind::structure);
    }
    if (type->kind == Kind::array && is_listed(inner->kind)) {
      return type_of(message, {type->element}, inner->name, Kind::structure);
    }
    return type_of(message, describe::all_members(model_, *inner), inner->name, inner->kind);
  }

  void scalar(Json& json, const messages::FieldType& of, const Value* value) const {
    const describe::Type* const type = value != nullptr ? known(*value) : nullptr;
    if (!of.primitive) {
      json["kind"] = "message";
      return;
    }
    const Primitive primitive = *of.primitive;
    json["what"] = type != nullptr && !type->name.empty() ? type->name : messages::to_string(primitive);
    switch (primitive) {
      case Primitive::boolean:
        json["kind"] = "bool";
        return;
      case Primitive::float32:
      case Primitive::float64:
        json["kind"] = "float";
        return;
      case Primitive::string:
      case Primitive::wstring:
        json["kind"] = "string";
        if (of.string_bound != 0) {
          json["bound"] = of.string_bound;
        }
        return;
      default:
        break;
    }
    const bool are_bytes = messages::width(primitive) == 1 && !is_signed(primitive);
    if (are_bytes && of.array != ArrayKind::none && (type == nullptr || type->kind == Kind::bytes)) {
      json["kind"] = "bytes";
      return;
    }
    json["kind"] = "integer";
    const unsigned bits =
        value != nullptr && value->wire.bits != 0 ? value->wire.bits : messages::width(primitive) * 8U;
    const std::uint64_t all = ~std::uint64_t{0} >> (64U - bits);
    const bool negative = is_signed(primitive);
    json["low"] = negative ? fmt::format("-{}", (all >> 1U) + 1) : "0";
    json["high"] = fmt::format("{}", negative ? all >> 1U : all);
    if (type == nullptr) {
      return;
    }
    if (type->minimum) {
      json["low"] = fmt::format("{}", *type->minimum);
    }
    if (type->maximum) {
      json["high"] = fmt::format("{}", *type->maximum);
    }
    if (type->kind == Kind::enumeration) {
      Json enumerators = Json::array();
      for (const describe::Enumerator& one : describe::all_enumerators(model_, *type)) {
        enumerators.push_back({one.name, negative
                                             ? fmt::format("{}", one.value)
                                             : fmt::format("{}", static_cast<std::uint64_t>(one.value))});
      }
      json["enumerators"] = std::move(enumerators);
    }
  }

  const describe::Model& model_;
  const messages::TypeTree& tree_;
  Json types_ = Json::array();
  std::map<std::size_t, std::size_t> made_{};  ///< by the message's place in the tree
};

}  // namespace

Json form_of(const describe::Model& model, const messages::TypeTree& tree, const std::vector<Value>& values) {
  return FormMaker{model, tree}.made(values);
}

}  // namespace trestle::generate
