#include "bridge/console/json_schema.hpp"

#include <nlohmann/json.hpp>

namespace trestle::console {
namespace {

using messages::ArrayKind;
using messages::FieldType;
using messages::Primitive;
using Json = nlohmann::json;

const char* name_of(Primitive primitive) {
  switch (primitive) {
    case Primitive::boolean:
      return "boolean";
    case Primitive::float32:
    case Primitive::float64:
      return "number";
    case Primitive::string:
    case Primitive::wstring:
      return "string";
    default:
      return "integer";
  }
}

bool is_byte(Primitive primitive) {
  return primitive == Primitive::byte || primitive == Primitive::character || primitive == Primitive::uint8;
}

/// Writes the types of one tree.
class Describer {
 public:
  explicit Describer(const messages::TypeTree& tree) : tree_{tree} {}

  [[nodiscard]] Json message(const messages::MessageDefinition& definition) {
    Json result{{"type", "object"}, {"properties", Json::object()}};
    for (const messages::Field& field : definition.fields) {
      if (++fields_ > most_schema_fields) {
        break;
      }
      result["properties"][field.name] = type(field.type);
    }
    return result;
  }
  [[nodiscard]] bool is_too_large() const noexcept { return fields_ > most_schema_fields; }

 private:
  [[nodiscard]] Json type(const FieldType& what) {
    if (what.primitive && what.array != ArrayKind::none && is_byte(*what.primitive)) {
      return {{"type", "string"}};
    }
    Json one = what.primitive ? Json{{"type", name_of(*what.primitive)}}
                              : message(tree_.messages.at(what.message_index));
    return what.array == ArrayKind::none ? one : Json{{"type", "array"}, {"items", std::move(one)}};
  }

  const messages::TypeTree& tree_;
  std::size_t fields_ = 0;
};

}  // namespace

std::string json_schema(const messages::TypeTree& tree) {
  Describer describer{tree};
  Json schema = describer.message(tree.root());
  if (describer.is_too_large()) {
    schema = {{"type", "object"}};
  }
  schema["title"] = tree.root().name;
  return schema.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace trestle::console
