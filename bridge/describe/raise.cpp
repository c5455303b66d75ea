#include "bridge/describe/raise.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace trestle::describe {
namespace {

using messages::ArrayKind;
using messages::FieldRules;
using messages::MessageRules;
using messages::Primitive;
using messages::TypeRules;
using someip::FieldWidth;
using Form = TypeRules::Form;

bool is_alike(const Value& a, const Value& b) {
  return a.name == b.name && a.type == b.type && a.wire == b.wire && a.tag == b.tag &&
         a.optional == b.optional && a.default_value == b.default_value;
}

/// Whether the two are one type: of one message, or both without a name, and with the same bytes.
bool is_alike(const Type& a, const Type& b) {
  return a.kind == b.kind && a.ros_name == b.ros_name && a.name == b.name && a.primitive == b.primitive &&
         a.wire == b.wire && a.min_size == b.min_size && a.max_size == b.max_size &&
         a.fixed_size == b.fixed_size && a.invalid_value == b.invalid_value && a.minimum == b.minimum &&
         a.maximum == b.maximum && a.selectors == b.selectors && a.base == b.base &&
         is_alike(a.element, b.element) && is_alike(a.key, b.key) &&
         std::ranges::equal(a.members, b.members,
                            [](const Value& x, const Value& y) { return is_alike(x, y); });
}

/// One payload. What holds in a message is found as the conversion finds it: what its field says, else what
/// its type says, else what the payload does.
class Raising {
 public:
  Raising(Model& model, const messages::TypeTree& tree, const MessageRules& rules,
          std::vector<std::string>& lost)
      : model_{model}, tree_{tree}, rules_{rules}, lost_{lost} {}

  Value root(std::string name) {
    const messages::MessageDefinition& definition = tree_.root();
    Value value{.name = std::move(name), .type = message(definition, definition.name, {})};
    value.wire = frame({}, rules_of(definition.name), definition.name);
    return value;
  }

 private:
  [[nodiscard]] const TypeRules& rules_of(const std::string& key) const {
    static const TypeRules none;
    const auto found = rules_.types.find(key);
    return found == rules_.types.end() ? none : found->second;
  }

  /// @param key        of its rules: "pkg/msg/Type#2"
  /// @param selectors  of a choice, if a field gives them
  TypeIndex message(const messages::MessageDefinition& definition, const std::string& key,
                    const std::vector<std::uint32_t>& selectors) {
    if (const auto known = known_.find({key, selectors}); known != known_.end()) {
      return known->second;
    }
    const TypeRules& own = rules_of(key);
    Type type{.kind = own.form == Form::choice ? Kind::choice : Kind::structure,
              .name = definition.name.substr(definition.name.rfind('/') + 1),
              .scope = definition.name.substr(0, definition.name.find('/')),
              .ros_name = definition.name};
    type.wire = frame({}, own, {});
    type.selectors = selectors.empty() ? own.itself.selectors : selectors;
    const bool is_bits = own.form == Form::bits8 || own.form == Form::bits16 || own.form == Form::bits32;
    if (own.form == Form::bits16 || own.form == Form::bits32) {
      // Its first bit is the lowest one of the number, which in big endian is not that of the first byte.
      lost_.push_back(definition.name + ": the names of its bits");
      type.members.push_back(value_of(
          model_, primitive(own.form == Form::bits16 ? Primitive::uint16 : Primitive::uint32), "bits"));
    }
    for (const messages::Field& field : definition.fields) {
      if (own.form == Form::structure || own.form == Form::choice || own.form == Form::bits8) {
        type.members.push_back(member(field, own, is_bits));
      }
    }
    if (type.members.empty() && own.form == Form::structure) {
      // The byte that such a message has in ROS, and in SOME/IP too.
      type.members.push_back(
          value_of(model_, primitive(Primitive::uint8), "structure_needs_at_least_one_member"));
    }
    constants(definition);
    const TypeIndex index = add_once(std::move(type));
    known_.emplace(std::pair{key, selectors}, index);
    return index;
  }

  Value member(const messages::Field& field, const TypeRules& own, bool is_bits) {
    static const FieldRules none;
    const auto found = own.fields.find(field.name);
    const FieldRules& rules = found == own.fields.end() ? none : found->second;
    const auto tag = own.tags.find(field.name);
    // A T[<=1] that is no array: a member that may be missing, or one of a choice.
    const bool may_be_missing = field.type.array == ArrayKind::bounded && field.type.array_size == 1 &&
                                (own.form == Form::choice || tag != own.tags.end());
    Value value = element(field, own, rules, is_bits);
    if (field.type.array != ArrayKind::none && !may_be_missing) {
      const bool is_fixed = field.type.array == ArrayKind::fixed;
      Type array{.kind = Kind::array,
                 .wire = default_wire(Kind::array),
                 .element = std::move(value),
                 .max_size = field.type.array_size,
                 .fixed_size = is_fixed};
      array.wire.length = is_bits ? FieldWidth::none
                                  : rules.array_length.value_or(is_fixed ? rules_.payload.fixed_array_length
                                                                         : rules_.payload.array_length);
      value = value_of(model_, add_once(std::move(array)), {});
    }
    value.name = field.name;
    value.default_value = field.default_value;
    if (tag != own.tags.end()) {
      value.tag = tag->second;
      value.optional = may_be_missing;
    }
    if (const auto order = own.byte_orders.find(field.name); order != own.byte_orders.end()) {
      value.wire.byte_order = order->second;
    }
    return value;
  }

  /// What is no array, or an element of one.
  Value element(const messages::Field& field, const TypeRules& own, const FieldRules& rules, bool is_bit) {
    const messages::FieldType& type = field.type;
    if (!type.primitive) {
      const messages::MessageDefinition& definition = tree_.messages[type.message_index];
      const std::string& key = rules.variant.empty() ? definition.name : rules.variant;
      Value value{.type = message(definition, key, rules.selectors)};
      value.wire = frame(rules, rules_of(key), definition.name);
      return value;
    }
    if (messages::width(*type.primitive) == 0) {
      Wire wire = default_wire(Kind::string);
      wire.encoding = rules.encoding.value_or(rules_.payload.string_encoding);
      if (*type.primitive == Primitive::wstring && wire.encoding == someip::StringEncoding::utf8 &&
          !rules.encoding && rules_.payload == someip::PayloadRules{}) {
        wire.encoding = someip::StringEncoding::utf16be;
      }
      wire.bom = rules.bom.value_or(rules_.payload.string_bom);
      wire.terminator = rules.terminator.value_or(rules_.payload.string_terminator);
      const auto fixed = own.fixed_strings.find(field.name);
      wire.length = fixed != own.fixed_strings.end()
                        ? FieldWidth::none
                        : rules.string_length.value_or(rules_.payload.string_length);
      wire.fixed_bytes = fixed != own.fixed_strings.end() ? fixed->second : 0;
      return value_of(model_, text(*type.primitive, type.string_bound, wire), {});
    }
    Value value = value_of(model_, primitive(*type.primitive), {});
    value.wire.bits = is_bit ? std::uint8_t{1} : rules.bits;
    return value;
  }

  /// Of a message as a whole, or of a use of it.
  /// @param name  of the message, for what is lost; empty: it is not used with this.
  Wire frame(const FieldRules& use, const TypeRules& type, const std::string& name) {
    const someip::PayloadRules& payload = rules_.payload;
    const bool is_choice = type.form == Form::choice;
    Wire wire = default_wire(is_choice ? Kind::choice : Kind::structure);
    const auto either = [](const auto& first, const auto& second) { return first ? first : second; };
    if (is_choice) {
      wire.length = either(use.union_length, type.itself.union_length).value_or(payload.union_length);
      wire.selector = either(use.union_type, type.itself.union_type).value_or(payload.union_type);
      wire.length_first =
          either(use.union_length_first, type.itself.union_length_first).value_or(payload.union_length_first);
      if (wire.length == FieldWidth::none) {
        const auto bytes = either(use.union_bytes, type.itself.union_bytes);
        wire.fixed_bytes = bytes.value_or(0);
        if (!bytes && !name.empty()) {
          lost_.push_back(name + ": the padding of a union to its longest member");
        }
      }
    } else if (type.form == Form::structure) {
      wire.length = either(use.struct_length, type.itself.struct_length).value_or(payload.struct_length);
    }
    return wire;
  }

  void constants(const messages::MessageDefinition& definition) {
    if (std::ranges::find(model_.constants, definition.name, &Constant::scope) != model_.constants.end()) {
      return;
    }
    for (const messages::Constant& constant : definition.constants) {
      const bool is_text = messages::width(constant.type) == 0;
      model_.constants.push_back(
          {.name = constant.name,
           .type = is_text ? text(constant.type, 0, default_wire(Kind::string)) : primitive(constant.type),
           .value = constant.value,
           .scope = definition.name});
    }
  }

  TypeIndex primitive(Primitive primitive) {
    return add_once({.kind = Kind::primitive, .primitive = primitive});
  }

  TypeIndex text(Primitive primitive, std::uint32_t bound, const Wire& wire) {
    return add_once({.kind = Kind::string,
                     .ros_name = primitive == Primitive::wstring ? "wstring" : "",
                     .wire = wire,
                     .max_size = bound});
  }

  TypeIndex add_once(Type type) {
    const auto found =
        std::ranges::find_if(model_.types, [&](const Type& one) { return is_alike(one, type); });
    if (found != model_.types.end()) {
      return TypeIndex{static_cast<std::uint32_t>(found - model_.types.begin())};
    }
    if (!type.name.empty()) {
      // The same message with other rules.
      const auto first = std::ranges::find(model_.types, type.ros_name, &Type::ros_name);
      if (first != model_.types.end()) {
        type.variant_of = TypeIndex{static_cast<std::uint32_t>(first - model_.types.begin())};
      }
    }
    return model_.add(std::move(type));
  }

  Model& model_;
  const messages::TypeTree& tree_;
  const MessageRules& rules_;
  std::vector<std::string>& lost_;
  std::map<std::pair<std::string, std::vector<std::uint32_t>>, TypeIndex> known_{};
};

/// What the model says of a payload as a whole.
Payload payload_of(const MessageRules& rules, std::vector<std::string>& lost) {
  Payload payload{.byte_order = rules.payload.byte_order,
                  .length_fields_always_big = rules.payload.length_fields_always_big,
                  .alignment = std::max<std::uint8_t>(rules.payload.alignment, 1),
                  .tagged_length = rules.payload.tagged_length,
                  .smallest_tagged_length = rules.payload.smallest_tagged_length};
  if (rules.payload.byte_order == std::endian::big) {
    payload.length_fields_always_big = false;  // the same, and the default of a model
  }
  if (rules.default_missing) {
    lost.emplace_back("missing_fields: default");
  }
  if (!rules.payload.cut_longer_arrays) {
    lost.emplace_back("longer_arrays: refuse");
  }
  if (rules.payload.union_null) {
    lost.emplace_back("union_null");
  }
  return payload;
}

}  // namespace

Value value_of(const Model& model, TypeIndex type, std::string name) {
  Value value{.name = std::move(name), .type = type};
  if (type != no_type) {
    value.wire = model.at(type).wire;
  }
  return value;
}

TypeIndex raise(Model& model, const messages::TypeTree& tree) {
  std::vector<std::string> lost;
  return Raising{model, tree, {}, lost}.root({}).type;
}

Payload raise(Model& model, const messages::TypeTree& tree, const MessageRules& rules, std::string name,
              std::vector<std::string>& lost) {
  Payload payload = payload_of(rules, lost);
  payload.values = {Raising{model, tree, rules, lost}.root(std::move(name))};
  return payload;
}

Method raise(Model& model, const messages::ServiceTypes& types, const MessageRules& rules, std::string name,
             std::vector<std::string>& lost) {
  Method method{.name = std::move(name)};
  method.request = payload_of(rules, lost);
  method.response = method.request;
  // Calls without arguments have no payload.
  if (!types.request.root().fields.empty()) {
    method.request.values = {Raising{model, types.request, rules, lost}.root("request")};
  }
  if (!types.response.root().fields.empty()) {
    method.response.values = {Raising{model, types.response, rules, lost}.root("response")};
  }
  return method;
}

Method raise(Model& model, const messages::ServiceTypes& types, std::string name) {
  std::vector<std::string> lost;
  return raise(model, types, {}, std::move(name), lost);
}

}  // namespace trestle::describe
