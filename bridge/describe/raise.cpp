#include "bridge/describe/raise.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "bridge/describe/marks.hpp"
#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/number_text.hpp"

namespace trestle::describe {
namespace {

using messages::ArrayKind;
using messages::FieldRules;
using messages::MessageRules;
using messages::Primitive;
using messages::TypeRules;
using someip::FieldWidth;
using Form = TypeRules::Form;

Notes notes_of(const messages::Comment& comment) {
  return {.description = comment.text, .unit = comment.unit};
}

/// The comment of a request is the service's.
bool is_request(std::string_view name) {
  return name.ends_with("_Request") && name.find("/srv/") != std::string_view::npos;
}

/// The constants of a message that are enumerators of its fields: those of each "GEAR_", the longest one that
/// a constant begins with.
class Enumerations {
 public:
  using Constants = std::map<std::string, std::vector<const messages::Constant*>>;  ///< by prefix

  /// @param beside  the request of a response: it has the constants that both have.
  Enumerations(const messages::TypeTree& tree, const messages::MessageDefinition& definition,
               const messages::MessageDefinition* beside) {
    add_uses(tree, definition);
    const auto own = uses_;
    if (beside != nullptr) {
      add_uses(tree, *beside);
      for (const messages::Constant& constant : beside->constants) {
        add(constant);
      }
    }
    for (const messages::Constant& constant : definition.constants) {
      add(constant);
    }
    uses_ = own;
  }

  /// Nothing: the field is none.
  static std::optional<std::string_view> name_of(const messages::Field& field) {
    std::string_view mark = marks::parse(field.mark).what;
    const auto word = mark.substr(0, mark.find(' '));
    if ((word != marks::enumeration && word != marks::error) || !field.type.primitive ||
        !is_whole(*field.type.primitive)) {
      return std::nullopt;
    }
    mark.remove_prefix(std::min(word.size() + 1, mark.size()));
    return mark;
  }

  [[nodiscard]] std::vector<const messages::Constant*> of(const std::string& prefix, Primitive type) const {
    std::vector<const messages::Constant*> all;
    if (const auto found = constants_.find(prefix); found != constants_.end()) {
      std::ranges::copy_if(found->second, std::back_inserter(all),
                           [&](const messages::Constant* one) { return one->type == type; });
    }
    return all;
  }

  /// Whether a constant is an enumerator of a field of the message itself.
  [[nodiscard]] bool has(const messages::Constant& constant) const {
    const std::string prefix = prefix_of(constant);
    return !prefix.empty() && uses_.contains({prefix, constant.type});
  }

 private:
  static bool is_whole(Primitive primitive) {
    return primitive != Primitive::boolean && primitive != Primitive::float32 &&
           primitive != Primitive::float64 && messages::width(primitive) != 0;
  }

  void add_uses(const messages::TypeTree& tree, const messages::MessageDefinition& definition) {
    for (const messages::Field& field : definition.fields) {
      // Those of the array that a message stands for are in both.
      const bool stands_for_array = marks::parse(field.mark).what == marks::array && !field.type.primitive;
      const auto& fields =
          stands_for_array ? tree.messages[field.type.message_index].fields : definition.fields;
      const messages::Field& marked = stands_for_array && fields.size() == 1 ? fields[0] : field;
      if (const auto name = name_of(marked)) {
        uses_.emplace(marks::prefix_of(*name, field.name), *marked.type.primitive);
        prefixes_.insert(marks::prefix_of(*name, field.name));
      }
    }
  }

  /// The longest one of ours; empty: none.
  [[nodiscard]] std::string prefix_of(const messages::Constant& constant) const {
    for (std::size_t end = constant.name.rfind('_'); end != std::string::npos && end > 0;
         end = constant.name.rfind('_', end - 1)) {
      if (std::string prefix = constant.name.substr(0, end + 1);
          prefix.size() < constant.name.size() && prefixes_.contains(prefix)) {
        return prefix;
      }
    }
    return {};
  }

  void add(const messages::Constant& constant) {
    if (const std::string prefix = prefix_of(constant); !prefix.empty()) {
      constants_[prefix].push_back(&constant);
    }
  }

  Constants constants_{};
  std::set<std::pair<std::string, Primitive>> uses_{};
  std::set<std::string> prefixes_{};
};

/// One payload. What holds in a message is found as the conversion finds it: what its field says, else what
/// its type says, else what the payload does.
class Raising {
 public:
  Raising(RaisedTypes& types, const messages::TypeTree& tree, const MessageRules& rules,
          std::vector<std::string>& lost, const messages::MessageDefinition* beside = nullptr)
      : types_{types}, model_{types.model()}, tree_{tree}, rules_{rules}, lost_{lost}, beside_{beside} {}

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
              .ros_name = definition.name,
              .notes = is_request(definition.name) ? Notes{} : notes_of(definition.comment)};
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
        type.members.push_back(member(definition, field, own, is_bits));
      }
    }
    if (type.members.empty() && own.form == Form::structure) {
      // The byte that such a message has in ROS, and in SOME/IP too.
      type.members.push_back(
          value_of(model_, primitive(Primitive::uint8), "structure_needs_at_least_one_member"));
    }
    constants(definition);
    const TypeIndex index = types_.add_once(std::move(type));
    known_.emplace(std::pair{key, selectors}, index);
    return index;
  }

  Value member(const messages::MessageDefinition& of, const messages::Field& field, const TypeRules& own,
               bool is_bits) {
    static const FieldRules none;
    const auto found = own.fields.find(field.name);
    const FieldRules& rules = found == own.fields.end() ? none : found->second;
    const auto tag = own.tags.find(field.name);
    // A T[<=1] that is no array: a member that may be missing, or one of a choice.
    const bool may_be_missing = field.type.array == ArrayKind::bounded && field.type.array_size == 1 &&
                                (own.form == Form::choice || tag != own.tags.end());
    const marks::FieldMark mark = marks::parse(field.mark);
    Value value{};
    if (field.type.array == ArrayKind::none || may_be_missing) {
      value = element(of, field, own, rules, is_bits);
    } else {
      const bool is_fixed = field.type.array == ArrayKind::fixed;
      Type array{.kind = Kind::array,
                 .wire = default_wire(Kind::array),
                 .max_size = field.type.array_size,
                 .fixed_size = is_fixed};
      if (mark.what == marks::bytes && field.type.primitive == Primitive::uint8) {
        array.kind = Kind::bytes;
      } else if (!make_map(array, field, rules)) {
        array.element = element(of, field, own, rules, is_bits);
        array.element.type = with_aliases(array.element.type, mark.element_aliases, of);
        if (messages::is_identifier(mark.array_name)) {
          array.name = mark.array_name;
          array.scope = package_of(of);
          array.name = types_.free_name(array);
        }
      }
      array.wire.length = is_bits ? FieldWidth::none
                                  : rules.array_length.value_or(is_fixed ? rules_.payload.fixed_array_length
                                                                         : rules_.payload.array_length);
      value = value_of(model_, types_.add_once(std::move(array)), {});
    }
    value.type = with_aliases(value.type, mark.aliases, of);
    value.name = field.name;
    value.default_value = field.default_value;
    value.notes = notes_of(field.comment);
    if (tag != own.tags.end()) {
      value.tag = tag->second;
      value.optional = may_be_missing;
    }
    if (const auto order = own.byte_orders.find(field.name); order != own.byte_orders.end()) {
      value.wire.byte_order = order->second;
    }
    return value;
  }

  static std::string package_of(const messages::MessageDefinition& definition) {
    return definition.name.substr(0, definition.name.find('/'));
  }

  /// The type behind aliases of these names, the first one outside.
  TypeIndex with_aliases(TypeIndex type, std::span<const std::string_view> names,
                         const messages::MessageDefinition& of) {
    for (auto name = names.rbegin(); name != names.rend(); ++name) {
      if (type == no_type || !messages::is_identifier(*name)) {
        continue;
      }
      Type alias{.kind = Kind::alias, .name = std::string{*name}, .scope = package_of(of)};
      alias.element = value_of(model_, type, {});
      alias.wire = alias.element.wire;
      alias.name = types_.free_name(alias);
      type = types_.add_once(std::move(alias));
    }
    return type;
  }

  /// Whether the field's message has no bytes of its own.
  [[nodiscard]] bool is_bare(const FieldRules& rules, const TypeRules& type) {
    return type.form == Form::structure && frame(rules, type, {}).length == FieldWidth::none;
  }

  /// Makes a map of an array of pairs; false: the field is none.
  bool make_map(Type& array, const messages::Field& field, const FieldRules& rules) {
    if (marks::parse(field.mark).what != marks::map || field.type.primitive) {
      return false;
    }
    constexpr std::string_view end = "Entry";
    const messages::MessageDefinition& pair = tree_.messages[field.type.message_index];
    const TypeRules& own = rules_of(rules.variant.empty() ? pair.name : rules.variant);
    if (pair.fields.size() != 2 || pair.fields[0].name != "key" || pair.fields[1].name != "value" ||
        !is_bare(rules, own)) {
      return false;
    }
    array.kind = Kind::map;
    array.ros_name = pair.name;
    array.scope = pair.name.substr(0, pair.name.find('/'));
    array.name = pair.name.substr(pair.name.rfind('/') + 1);
    if (array.name.size() > end.size() && array.name.ends_with(end)) {
      array.name.resize(array.name.size() - end.size());
    }
    array.key = member(pair, pair.fields[0], own, false);
    array.element = member(pair, pair.fields[1], own, false);
    array.key.name.clear();
    array.element.name.clear();
    return true;
  }

  /// The enumeration of a marked field.
  TypeIndex enumeration(const messages::MessageDefinition& of, const messages::Field& field,
                        std::string_view name) {
    const std::string prefix = marks::prefix_of(name, field.name);
    const Primitive primitive = *field.type.primitive;
    const auto [known, is_new] = known_enumerations_.try_emplace({&of, prefix, primitive}, no_type);
    if (!is_new) {
      return known->second;
    }
    Type type{.kind = Kind::enumeration,
              .scope = package_of(of),
              .primitive = primitive,
              .wire = default_wire(Kind::enumeration)};
    for (const messages::Constant* const one : enumerations_of(of).of(prefix, primitive)) {
      const auto value =
          primitive == Primitive::uint64
              ? static_cast<std::int64_t>(messages::read_integer<std::uint64_t>(one->value).value_or(0))
              : messages::read_integer<std::int64_t>(one->value).value_or(0);
      type.enumerators.push_back(
          {.name = one->name.substr(prefix.size()), .value = value, .notes = notes_of(one->comment)});
    }
    if (name.empty()) {
      type.scope.clear();
      return known->second = types_.add_once(std::move(type));
    }
    // One of the same name with other enumerators is another one.
    type.name = name;
    type.name = types_.free_name(type);
    return known->second = types_.add_once(std::move(type));
  }

  const Enumerations& enumerations_of(const messages::MessageDefinition& definition) {
    const auto known = enumerations_.find(&definition);
    return known != enumerations_.end() ? known->second
                                        : enumerations_
                                              .try_emplace(&definition, tree_, definition,
                                                           &definition == &tree_.root() ? beside_ : nullptr)
                                              .first->second;
  }

  /// What is no array, or an element of one.
  Value element(const messages::MessageDefinition& of, const messages::Field& field, const TypeRules& own,
                const FieldRules& rules, bool is_bit) {
    const messages::FieldType& type = field.type;
    if (!type.primitive) {
      const messages::MessageDefinition& definition = tree_.messages[type.message_index];
      const std::string& key = rules.variant.empty() ? definition.name : rules.variant;
      if (const TypeRules& inner = rules_of(key);
          marks::parse(field.mark).what == marks::array && definition.fields.size() == 1 &&
          definition.fields[0].type.array != ArrayKind::none && is_bare(rules, inner)) {
        Value value = member(definition, definition.fields[0], inner, false);
        value.name.clear();
        return value;
      }
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
    const auto name = Enumerations::name_of(field);
    const TypeIndex index = name ? enumeration(of, field, *name) : no_type;
    Value value = value_of(model_, index != no_type ? index : primitive(*type.primitive), {});
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
    if (types_.has_constants(definition.name)) {
      return;
    }
    const Enumerations& enumerations = enumerations_of(definition);
    for (const messages::Constant& constant : definition.constants) {
      if (enumerations.has(constant)) {
        continue;
      }
      const bool is_text = messages::width(constant.type) == 0;
      model_.constants.push_back(
          {.name = constant.name,
           .type = is_text ? text(constant.type, 0, default_wire(Kind::string)) : primitive(constant.type),
           .value = constant.value,
           .scope = definition.name,
           .notes = notes_of(constant.comment)});
    }
  }

  TypeIndex primitive(Primitive primitive) {
    return types_.add_once({.kind = Kind::primitive, .primitive = primitive});
  }

  TypeIndex text(Primitive primitive, std::uint32_t bound, const Wire& wire) {
    return types_.add_once({.kind = Kind::string,
                            .ros_name = primitive == Primitive::wstring ? "wstring" : "",
                            .wire = wire,
                            .max_size = bound});
  }

  RaisedTypes& types_;
  Model& model_;
  const messages::TypeTree& tree_;
  const MessageRules& rules_;
  std::vector<std::string>& lost_;
  const messages::MessageDefinition* beside_;  ///< see Enumerations
  std::map<const messages::MessageDefinition*, Enumerations> enumerations_{};
  /// By message, prefix and what is on the wire.
  std::map<std::tuple<const messages::MessageDefinition*, std::string, Primitive>, TypeIndex>
      known_enumerations_{};
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

/// The selectors of a choice that a mark says; nothing: it does not fit the message.
std::optional<std::vector<std::uint32_t>> choice_of(const messages::MessageDefinition& definition) {
  std::string_view mark = definition.mark;
  const bool fits =
      !definition.fields.empty() && std::ranges::all_of(definition.fields, [](const messages::Field& field) {
        return field.type.array == ArrayKind::bounded && field.type.array_size == 1;
      });
  if (!fits || mark.substr(0, mark.find(' ')) != marks::choice) {
    return std::nullopt;
  }
  std::vector<std::uint32_t> selectors;
  std::set<std::uint32_t> known;
  for (mark.remove_prefix(marks::choice.size()); !mark.empty();) {
    mark.remove_prefix(1);  // the blank
    const std::string_view word = mark.substr(0, mark.find(' '));
    mark.remove_prefix(word.size());
    const auto selector = messages::read_integer<std::uint32_t>(word);
    if (!selector || !known.insert(*selector).second) {
      return std::nullopt;
    }
    selectors.push_back(*selector);
  }
  return selectors.empty() || selectors.size() == definition.fields.size() ? std::optional{selectors}
                                                                           : std::nullopt;
}

/// For messages that nobody gave rules: what their marks say.
void add_marked(const messages::TypeTree& tree, MessageRules& rules) {
  for (const messages::MessageDefinition& definition : tree.messages) {
    if (auto selectors = choice_of(definition)) {
      TypeRules& own = rules.types[definition.name];
      own.form = Form::choice;
      own.itself.selectors = std::move(*selectors);
    }
  }
}

}  // namespace

Value value_of(const Model& model, TypeIndex type, std::string name) {
  Value value{.name = std::move(name), .type = type};
  if (type != no_type) {
    value.wire = model.at(type).wire;
  }
  return value;
}

TypeIndex raise(RaisedTypes& types, const messages::TypeTree& tree) {
  std::vector<std::string> lost;
  MessageRules rules;
  add_marked(tree, rules);
  return Raising{types, tree, rules, lost}.root({}).type;
}

Payload raise(RaisedTypes& types, const messages::TypeTree& tree, const MessageRules& rules, std::string name,
              std::vector<std::string>& lost) {
  Payload payload = payload_of(rules, lost);
  payload.values = {Raising{types, tree, rules, lost}.root(std::move(name))};
  return payload;
}

Method raise(RaisedTypes& types, const messages::ServiceTypes& service, const MessageRules& rules,
             std::string name, std::vector<std::string>& lost) {
  Method method{.name = std::move(name), .notes = notes_of(service.request.root().comment)};
  method.request = payload_of(rules, lost);
  method.response = method.request;
  // Calls without arguments have no payload.
  if (!service.request.root().fields.empty()) {
    method.request.values = {Raising{types, service.request, rules, lost}.root("request")};
  }
  if (!service.response.root().fields.empty()) {
    Raising response{types, service.response, rules, lost, &service.request.root()};
    method.response.values = {response.root("response")};
  }
  const std::string& request = service.request.root().name;
  constexpr std::string_view end = "_Request";
  if (method.request.values.empty() && method.response.values.empty() &&
      request.find("/srv/") != std::string::npos && request.ends_with(end)) {
    method.ros_type = request.substr(0, request.size() - end.size());
  }
  return method;
}

Method raise(RaisedTypes& types, const messages::ServiceTypes& service, std::string name) {
  std::vector<std::string> lost;
  MessageRules rules;
  add_marked(service.request, rules);
  add_marked(service.response, rules);
  return raise(types, service, rules, std::move(name), lost);
}

}  // namespace trestle::describe
