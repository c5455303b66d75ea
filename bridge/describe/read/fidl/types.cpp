#include "bridge/describe/read/fidl/types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr int deepest_type = 200;
constexpr std::size_t most_types = 500'000;
constexpr std::size_t most_steps = 300'000;  // names that constants are computed from
constexpr std::int64_t most_elements = std::numeric_limits<std::int32_t>::max();

/// A structure's length field is the one thing that an overwrite takes back when it does not repeat it:
/// CommonAPI asks "#struct" for it, which then has the default of the specification.
bool is_reset_by(const Layer& layer, std::string_view key) {
  return layer.node->tag == "#struct" && !layer.node->within_overwrite && key == "StructLengthWidth";
}

std::string_view prefix(User user) {
  switch (user) {
    case User::attribute:
      return "SomeIpAttr";
    case User::argument:
      return "SomeIpArg";
    case User::struct_field:
      return "SomeIpStruct";
    case User::union_field:
      return "SomeIpUnion";
    case User::other:
      break;
  }
  return "";
}

/// Whether a layer can make a type of this kind another one, and not only its use.
bool concerns_type(const Layer& layer, Kind kind) {
  if (layer.overwrites()) {
    return kind != Kind::primitive;
  }
  if (kind == Kind::structure || kind == Kind::choice) {
    return false;
  }
  return std::ranges::any_of(layer.node->settings, [](const Setting& setting) {
    return setting.key.text.starts_with("SomeIp") &&
           std::ranges::any_of(
               std::initializer_list<const char*>{"Array", "Map", "ByteBuffer", "Enum", "SomeIpString",
                                                  "Integer"},
               [&](const char* word) { return setting.key.text.find(word) != std::string::npos; });
  });
}

bool same_use(const Value& a, const Value& b) {
  return a.type == b.type && a.wire == b.wire;
}

bool same_type(const Type& a, const Type& b) {
  return a.primitive == b.primitive && a.backing == b.backing && a.invalid_value == b.invalid_value &&
         std::ranges::equal(a.members, b.members, same_use) && a.base == b.base &&
         same_use(a.element, b.element) && same_use(a.key, b.key) && a.min_size == b.min_size &&
         a.max_size == b.max_size && a.fixed_size == b.fixed_size && a.wire.bits == b.wire.bits;
}

/// False: what it is made of has an error.
bool is_whole(const Type& type) {
  const bool needs_element = type.kind == Kind::array || type.kind == Kind::alias || type.kind == Kind::map;
  return !(needs_element && type.element.type == no_type) &&
         !(type.kind == Kind::map && type.key.type == no_type);
}

messages::Primitive unsigned_of(std::int64_t bytes) {
  return bytes == 1   ? messages::Primitive::uint8
         : bytes == 2 ? messages::Primitive::uint16
         : bytes == 4 ? messages::Primitive::uint32
                      : messages::Primitive::uint64;
}

messages::Primitive signed_of(std::int64_t bytes) {
  return bytes == 1   ? messages::Primitive::int8
         : bytes == 2 ? messages::Primitive::int16
         : bytes == 4 ? messages::Primitive::int32
                      : messages::Primitive::int64;
}

bool is_signed(messages::Primitive primitive) {
  return primitive == messages::Primitive::int8 || primitive == messages::Primitive::int16 ||
         primitive == messages::Primitive::int32 || primitive == messages::Primitive::int64;
}

std::string json_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (c == '\n') {
      result += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      result += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      result += c;
    }
  }
  return result + '"';
}

}  // namespace

Layers layers_of(const Node* node, User user) {
  Layers layers;
  if (node != nullptr) {
    layers.push_back({node, user});
    if (const Node* overwrite = node->overwrite()) {
      layers.push_back({overwrite, user});
    }
  }
  return layers;
}

TypeIndex Types::add(Type type) {
  if (model_.types.size() >= most_types) {
    findings_.error(type.place, fmt::format("there are more than {} types", most_types));
    return no_type;
  }
  return model_.add(std::move(type));
}

bool Types::too_deep(Place place, int deep) {
  if (deep > deepest_type) {
    findings_.error(place, fmt::format("types are nested more than {} deep", deepest_type));
  }
  return deep > deepest_type;
}

void Types::make_all() {
  for (Declared& declared : names_.types()) {
    (void)type(declared);
  }
  constants();
}

const Setting* Types::find(const Layers& layers, std::string_view key) const {
  const std::string own = fmt::format("SomeIp{}", key);
  for (const Layer& layer : layers) {
    if (layer.arrays_taken && key.starts_with("Array")) {
      continue;
    }
    if (const Setting* setting = layer.node->setting(own)) {
      return setting;
    }
    if (layer.user != User::other && !layer.overwrites()) {
      if (const Setting* setting = layer.node->setting(fmt::format("{}{}", prefix(layer.user), key))) {
        return setting;
      }
    }
    if (is_reset_by(layer, key)) {
      return nullptr;
    }
  }
  return nullptr;
}

std::optional<std::int64_t> Types::number(const Layers& layers, std::string_view key, std::int64_t min,
                                          std::int64_t max) {
  const Setting* setting = find(layers, key);
  return setting == nullptr ? std::nullopt : number_of(*setting, min, max, findings_);
}

someip::FieldWidth Types::width(const Layers& layers, std::string_view key, someip::FieldWidth otherwise) {
  const Setting* setting = find(layers, key);
  const auto bytes = setting == nullptr ? std::nullopt : number_of(*setting, 0, 4, findings_);
  if (!bytes) {
    return otherwise;
  }
  if (*bytes == 3) {
    findings_.error(setting->values.front().place,
                    fmt::format("{} is 3; expected 0, 1, 2 or 4 bytes", setting->key.text));
    return otherwise;
  }
  return someip::FieldWidth{static_cast<std::uint8_t>(*bytes)};
}

Wire Types::wire(Kind kind, const Layers& layers, int version) {
  (void)version;  // of these, both have the same defaults
  Wire wire = default_wire(kind);
  switch (kind) {
    case Kind::string: {
      wire.length = width(layers, "StringLengthWidth", wire.length);
      if (const Setting* encoding = find(layers, "StringEncoding")) {
        wire.encoding = static_cast<someip::StringEncoding>(
            word_of(*encoding, {"utf8", "utf16le", "utf16be"}, findings_));
      }
      if (wire.length == someip::FieldWidth::none) {
        wire.fixed_bytes =
            static_cast<std::uint32_t>(number(layers, "StringLength", 0, most_elements).value_or(0));
        if (wire.fixed_bytes == 0) {
          const Setting* setting = find(layers, "StringLengthWidth");
          findings_.warning(
              setting->key.place,
              "a string without a length field needs SomeIpStringLength: how many bytes it has");
        }
      }
      break;
    }
    case Kind::bytes:
      wire.length = width(layers, "ByteBufferLengthWidth", wire.length);
      break;
    case Kind::array:
      wire.length = width(layers, "ArrayLengthWidth", wire.length);
      break;
    case Kind::map:
      wire.length = width(layers, "MapLengthWidth", wire.length);
      break;
    case Kind::structure:
      wire.length = width(layers, "StructLengthWidth", wire.length);
      break;
    case Kind::choice:
      wire.length = width(layers, "UnionLengthWidth", wire.length);
      wire.selector = width(layers, "UnionTypeWidth", wire.selector);
      if (const Setting* order = find(layers, "UnionDefaultOrder")) {
        wire.length_first = truth_of(*order, findings_).value_or(true);
      }
      if (wire.length == someip::FieldWidth::none) {
        wire.fixed_bytes =
            static_cast<std::uint32_t>(number(layers, "UnionMaxLength", 0, most_elements).value_or(0));
      }
      break;
    case Kind::primitive:
      break;
    case Kind::enumeration:
      wire.bits = static_cast<std::uint8_t>(number(layers, "EnumBitWidth", 0, 64).value_or(0));
      break;
    case Kind::alias:
      break;
  }
  return wire;
}

/// Limits of an array, map or byte buffer.
void Types::sizes(Type& type, const char* stem, const Layers& layers, int version) {
  type.min_size = static_cast<std::uint32_t>(
      number(layers, fmt::format("{}MinLength", stem), 0, most_elements).value_or(0));
  type.max_size = static_cast<std::uint32_t>(
      number(layers, fmt::format("{}MaxLength", stem), 0, most_elements).value_or(0));
  if (wire(type.kind, layers, version).length == someip::FieldWidth::none) {
    const Setting* setting = find(layers, fmt::format("{}LengthWidth", stem));
    type.fixed_size = type.max_size > 0;
    if (type.fixed_size) {
      type.min_size = type.max_size;
    } else {
      findings_.warning(setting->key.place,
                        fmt::format("without a length field there have to be SomeIp{}MaxLength elements; "
                                    "without that, too, they go on to the end of the payload",
                                    stem));
    }
  } else if (type.max_size > 0 && type.min_size > type.max_size) {
    findings_.error(
        find(layers, fmt::format("{}MinLength", stem))->key.place,
        fmt::format("at least {} elements are more than at most {}", type.min_size, type.max_size));
  }
}

Value Types::use(const Variable& variable, const Scope& scope, const Layers& layers, int version, int deep) {
  Value value = use(variable.type, scope, layers, version, deep);
  value.name = variable.name.in_model();
  value.notes = variable.notes;
  value.place = variable.name.place;
  return value;
}

Value Types::use(const TypeRef& ref, const Scope& scope, const Layers& layers, int version, int deep) {
  Value value;
  value.place = ref.name.place;
  if (too_deep(value.place, deep)) {
    return value;
  }
  if (ref.array) {
    Type array{.kind = Kind::array, .place = value.place};
    value.wire = wire(Kind::array, layers, version);
    array.wire = value.wire;
    sizes(array, "Array", layers, version);
    TypeRef element = ref;
    element.array = false;
    Layers inner = layers;
    for (Layer& layer : inner) {
      layer.arrays_taken = true;
    }
    array.element = use(element, scope, inner, version, deep + 1);
    value.type = array.element.type == no_type ? no_type : add(std::move(array));
    return value;
  }
  if (ref.basic) {
    Kind kind = Kind::primitive;
    value.type = basic(ref, kind, layers, value.wire, version);
    return value;
  }
  Declared* declared = names_.type(ref.name, scope);
  if (declared == nullptr) {
    return value;
  }
  const TypeIndex plain = type(*declared, deep);
  if (plain == no_type) {
    return value;
  }
  Layers concerning;
  std::ranges::copy_if(layers, std::back_inserter(concerning),
                       [&](const Layer& layer) { return concerns_type(layer, declared->tree->kind); });
  value.type = concerning.empty() ? plain : variant(*declared, concerning, deep);
  if (value.type == no_type) {
    return value;
  }
  if (declared->tree->kind == Kind::alias) {
    // As the type behind it is used there, but for what this use says itself.
    Layers all = layers;
    const Declared* at = declared;
    std::set<const Declared*> seen;
    for (; at != nullptr && at->tree->kind == Kind::alias && seen.insert(at).second;) {
      std::ranges::copy(layers_of(at->node, User::other), std::back_inserter(all));
      const TypeRef& next = at->tree->element;
      if (next.basic) {
        TypeRef basic_ref = next;
        Kind kind = Kind::primitive;
        (void)basic(basic_ref, kind, all, value.wire, at->version);
        return value;
      }
      at = names_.type(next.name, at->scope);
    }
    if (at != nullptr && at->tree->kind != Kind::alias) {
      if (at->node != nullptr) {
        all.push_back({at->node, User::other});
      }
      value.wire = wire(at->tree->kind, all, at->version);
    }
  } else {
    Layers all = layers;
    if (declared->node != nullptr) {
      all.push_back({declared->node, User::other});
    }
    value.wire = wire(declared->tree->kind, all, declared->version);
  }
  const Type& target = resolved(model_, value.type);
  if (target.kind == Kind::enumeration && value.wire.bits >= messages::width(target.primitive) * 8U) {
    value.wire.bits = 0;
  }
  return value;
}

/// Basic types have no names; those with limits or an invalid value are types of their own.
TypeIndex Types::basic(const TypeRef& ref, Kind& kind, const Layers& layers, Wire& wire_of_it, int version) {
  Type type;
  type.place = ref.name.place;
  if (ref.name.text == "String" || ref.name.text == "ByteBuffer") {
    type.kind = ref.name.text == "String" ? Kind::string : Kind::bytes;
    wire_of_it = wire(type.kind, layers, version);
    if (type.kind == Kind::bytes) {
      sizes(type, "ByteBuffer", layers, version);
    } else if (wire_of_it.length != someip::FieldWidth::none) {
      type.max_size =
          static_cast<std::uint32_t>(number(layers, "StringLength", 0, most_elements).value_or(0));
    }
  } else if (ref.name.text == "undefined") {
    findings_.error(ref.name.place, "the type 'undefined' has no form in a message; expected a type");
    return no_type;
  } else {
    type.kind = Kind::primitive;
    type.primitive =
        primitive_of(ref.name.text).value_or(messages::Primitive::int32);  // Integer: as CommonAPI has it
    type.minimum = ref.minimum;
    type.maximum = ref.maximum;
    const bool is_integer = type.primitive != messages::Primitive::boolean &&
                            type.primitive != messages::Primitive::float32 &&
                            type.primitive != messages::Primitive::float64;
    if (is_integer) {
      constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
      constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
      type.invalid_value = number(layers, "IntegerInvalidValue", least, most);
      const std::int64_t own = messages::width(type.primitive) * 8;
      const std::int64_t bits = number(layers, "IntegerBitWidth", 0, own).value_or(0);
      wire_of_it.bits = static_cast<std::uint8_t>(bits == own ? 0 : bits);
      if (wire_of_it.bits == 8 || wire_of_it.bits == 16 || wire_of_it.bits == 32) {
        findings_.warning(
            find(layers, "IntegerBitWidth")->key.place,
            fmt::format("CommonAPI writes {} as {} bits all the same: only widths that are no whole "
                        "number's are packed",
                        ref.name.text, own));
        wire_of_it.bits = 0;
      }
    }
    if (type.minimum && type.maximum && *type.minimum > *type.maximum) {
      findings_.error(ref.name.place,
                      fmt::format("Integer({}, {}) has no values", *type.minimum, *type.maximum));
    }
  }
  kind = type.kind;
  const auto text = [](const std::optional<std::int64_t>& number) {
    return number ? fmt::format("{}", *number) : "";
  };
  const std::string key =
      fmt::format("{} {} {} {} {} {} {} {}", static_cast<int>(type.kind), static_cast<int>(type.primitive),
                  text(type.minimum), text(type.maximum), text(type.invalid_value), type.min_size,
                  type.max_size, type.fixed_size);
  const auto [found, is_new] = basics_.emplace(key, no_type);
  if (is_new) {
    type.wire = default_wire(type.kind);
    found->second = add(std::move(type));
  }
  return found->second;
}

TypeIndex Types::type(Declared& declared, int deep) {
  if (declared.state == Declared::State::done) {
    return declared.type;
  }
  const Place place = declared.tree->name.place;
  if (declared.state == Declared::State::open) {
    findings_.error(place, fmt::format("the types go round: {} contains itself, directly or through others",
                                       documents::quote(declared.tree->name.text)));
    return no_type;
  }
  if (too_deep(place, deep)) {
    return no_type;
  }
  declared.state = Declared::State::open;
  Type type = build(declared, {}, deep);
  declared.state = Declared::State::done;
  declared.type = is_whole(type) ? add(std::move(type)) : no_type;
  return declared.type;
}

TypeIndex Types::variant(Declared& declared, const Layers& layers, int deep) {
  if (too_deep(declared.tree->name.place, deep)) {
    return no_type;
  }
  std::string key = fmt::format("{}", static_cast<const void*>(&declared));
  for (const Layer& layer : layers) {
    key += fmt::format(" {} {}{}", static_cast<const void*>(layer.node), static_cast<int>(layer.user),
                       layer.arrays_taken);
  }
  const auto known = variants_.find(key);
  if (known != variants_.end()) {
    return known->second;
  }
  Type type = build(declared, layers, deep);
  type.variant_of = declared.type;
  const TypeIndex index =
      !is_whole(type) || same_type(type, model_.at(declared.type)) ? declared.type : add(std::move(type));
  variants_.emplace(std::move(key), index);
  return index;
}

Type Types::build(Declared& declared, const Layers& layers, int deep) {
  const TypeTree& tree = *declared.tree;
  Type type{.kind = tree.kind, .name = tree.name.in_model(), .scope = declared.scope.model};
  type.notes = tree.notes;
  type.place = tree.name.place;
  Layers all = layers;
  const Layers own = layers_of(declared.node, User::other);
  std::ranges::copy(own, std::back_inserter(all));
  Layers outer = layers;
  if (declared.node != nullptr) {
    outer.push_back({declared.node, User::other});
  }
  Layers plain;
  if (declared.node != nullptr) {
    plain.push_back({declared.node, User::other});
  }
  if (tree.kind != Kind::alias) {
    type.wire = wire(tree.kind, plain, declared.version);
  }
  switch (tree.kind) {
    case Kind::array:
      sizes(type, "Array", outer, declared.version);
      for (Layer& layer : all) {
        layer.arrays_taken = true;
      }
      type.element = use(tree.element, declared.scope, all, declared.version, deep + 1);
      break;
    case Kind::alias:
      type.element = use(tree.element, declared.scope, all, declared.version, deep + 1);
      type.wire = type.element.wire;
      break;
    case Kind::map: {
      sizes(type, "Map", outer, declared.version);
      const auto part = [&](const char* tag) {
        return layers_of(declared.node == nullptr ? nullptr : declared.node->child(tag, ""), User::other);
      };
      type.key = use(tree.key, declared.scope, part("key"), declared.version, deep + 1);
      type.element = use(tree.element, declared.scope, part("value"), declared.version, deep + 1);
      break;
    }
    case Kind::enumeration:
      build_enumeration(type, declared, outer, deep);
      break;
    case Kind::structure:
    case Kind::choice:
      build_fields(type, declared, layers, deep);
      break;
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
      break;
  }
  return type;
}

/// A type and all that it extends; it does not go round.
std::vector<const TypeTree*> Types::line_of(const Declared& declared) {
  std::vector<const TypeTree*> line;
  for (const Declared* at = &declared; at != nullptr && line.size() < deepest_type;) {
    line.push_back(at->tree);
    at = at->tree->base.empty() ? nullptr : names_.type(at->tree->base, at->scope);
  }
  return line;
}

void Types::build_fields(Type& type, Declared& declared, const Layers& layers, int deep) {
  const TypeTree& tree = *declared.tree;
  const User user = tree.kind == Kind::structure ? User::struct_field : User::union_field;
  type.polymorphic = tree.polymorphic;
  Layers naming = layers;
  if (declared.node != nullptr) {
    naming.push_back({declared.node, User::other});
  }
  std::set<std::string, std::less<>> names;
  if (!tree.base.empty()) {
    Declared* base = names_.type(tree.base, declared.scope);
    if (base != nullptr && base->tree->kind != tree.kind) {
      findings_.error(tree.base.place,
                      fmt::format("{} is no {}; only one can be extended", documents::quote(tree.base.text),
                                  tree.kind == Kind::structure ? "struct" : "union"));
    } else if (base != nullptr) {
      type.base = this->type(*base, deep + 1);
      if (type.base != no_type) {
        for (const TypeTree* tree_of_base : line_of(*base)) {
          for (const Variable& field : tree_of_base->fields) {
            names.insert(field.name.text);
          }
        }
        // Overwrites may name fields of the base.
        Layers of_base;
        for (const Layer& layer : naming) {
          if (std::ranges::any_of(
                  names, [&](const std::string& name) { return layer.node->child("", name) != nullptr; })) {
            of_base.push_back(layer);
          }
        }
        if (!of_base.empty()) {
          type.base = variant(*base, of_base, deep + 1);
        }
      }
    }
  }
  for (const Variable& field : tree.fields) {
    if (!names.insert(field.name.text).second) {
      findings_.error(field.name.place,
                      fmt::format("the field {} is there twice", documents::quote(field.name.text)));
      continue;
    }
    Layers of_field;
    for (const Layer& layer : naming) {
      std::ranges::copy(layers_of(layer.node->child("", field.name.text), user),
                        std::back_inserter(of_field));
    }
    // What a field itself says is stronger than overwrites that come with it.
    Value member = use(field, declared.scope, of_field, declared.version, deep + 1);
    if (member.type != no_type) {
      type.members.push_back(std::move(member));
    }
  }
  for (const Layer& layer : naming) {
    for (const Node& child : layer.node->children) {
      if (child.tag.empty() && !names.contains(child.target.text)) {
        findings_.error(child.place, fmt::format("{} has no field {}{}", documents::quote(tree.name.text),
                                                 documents::quote(child.target.text),
                                                 hint(child.target.text, {names.begin(), names.end()})));
      }
    }
  }
}

void Types::build_enumeration(Type& type, Declared& declared, const Layers& layers, int deep) {
  const TypeTree& tree = *declared.tree;
  std::int64_t bytes = number(layers, "EnumWidth", 0, 8).value_or(declared.version == 1 ? 4 : 1);
  if (bytes != 1 && bytes != 2 && bytes != 4 && bytes != 8) {
    findings_.error(find(layers, "EnumWidth")->values.front().place,
                    fmt::format("SomeIpEnumWidth is {}; expected 1, 2, 4 or 8 bytes", bytes));
    bytes = 1;
  }
  static const std::vector<std::string> backings{"UInt8", "UInt16", "UInt32", "UInt64",
                                                 "Int8",  "Int16",  "Int32",  "Int64"};
  const Setting* backing = nullptr;
  for (const Layer& layer : layers) {
    backing = backing == nullptr ? layer.node->setting("EnumBackingType") : backing;
  }
  if (backing == nullptr && declared.of_all != nullptr) {
    backing = declared.of_all->setting("DefaultEnumBackingType");
  }
  if (backing != nullptr) {
    type.backing = primitive_of(backings[word_of(*backing, backings, findings_)]);
  }
  bool needs_sign = type.backing && is_signed(*type.backing);
  std::set<std::string, std::less<>> names;
  if (!tree.base.empty()) {
    Declared* base = names_.type(tree.base, declared.scope);
    if (base != nullptr && base->tree->kind != Kind::enumeration) {
      findings_.error(tree.base.place, fmt::format("{} is no enumeration; only one can be extended",
                                                   documents::quote(tree.base.text)));
    } else if (base != nullptr) {
      type.base = this->type(*base, deep + 1);
      if (type.base != no_type) {
        const Type& of_base = model_.at(type.base);
        bytes = std::max<std::int64_t>(bytes, messages::width(of_base.primitive));
        needs_sign = needs_sign || is_signed(of_base.primitive);
        for (const TypeTree* tree_of_base : line_of(*base)) {
          for (const EnumeratorTree& enumerator : tree_of_base->enumerators) {
            names.insert(enumerator.name.text);
          }
        }
      }
    }
  }
  for (std::size_t i = 0; i < tree.enumerators.size(); ++i) {
    const EnumeratorTree& one = tree.enumerators[i];
    if (!names.insert(one.name.text).second) {
      findings_.error(one.name.place,
                      fmt::format("the enumerator {} is there twice", documents::quote(one.name.text)));
      continue;
    }
    Enumerator enumerator{one.name.in_model(), this->enumerator(declared, i, 0).value_or(0), one.notes,
                          one.name.place};
    if (const Node* node = declared.node == nullptr ? nullptr : declared.node->child("", one.name.text)) {
      if (const Setting* kept = node->setting("ErrorType")) {
        enumerator.notes.others["ErrorType"] = written(*kept);
      }
    }
    needs_sign = needs_sign || enumerator.value < 0;
    type.enumerators.push_back(std::move(enumerator));
  }
  for (const Layer& layer : layers) {
    for (const Node& child : layer.node->children) {
      if (child.tag.empty() && !names.contains(child.target.text)) {
        findings_.error(child.place,
                        fmt::format("{} has no enumerator {}{}", documents::quote(tree.name.text),
                                    documents::quote(child.target.text),
                                    hint(child.target.text, {names.begin(), names.end()})));
      }
    }
  }
  type.primitive = needs_sign ? signed_of(bytes) : unsigned_of(bytes);
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  type.invalid_value = number(layers, "EnumInvalidValue", least, most);
  if (const Setting* kept = declared.node == nullptr ? nullptr : declared.node->setting("ErrorType")) {
    type.notes.others["ErrorType"] = written(*kept);
  }
  const std::int64_t bits = type.wire.bits == 0 ? bytes * 8 : type.wire.bits;
  const bool is_wide = bits >= 64;
  const std::int64_t highest = is_wide ? most : (std::int64_t{1} << (needs_sign ? bits - 1 : bits)) - 1;
  for (const Enumerator& enumerator : type.enumerators) {
    if (!is_wide &&
        (enumerator.value > highest || (enumerator.value < 0 && enumerator.value < -highest - 1))) {
      findings_.warning(enumerator.place, fmt::format("the enumerator {} = {} has no place in {} bits",
                                                      enumerator.name, enumerator.value, bits));
    }
  }
  if (type.wire.bits >= bytes * 8) {
    type.wire.bits = 0;
  }
}

TypeIndex Types::own_error(const TypeTree& tree, const Scope& scope, int version) {
  Declared& declared = own_errors_.emplace_back();
  declared.tree = &tree;
  declared.scope = scope;
  declared.version = version;
  return type(declared);
}

/// Of an enumerator without a value: one more than the one before it, in a base too.
std::optional<std::int64_t> Types::enumerator(Declared& declared, std::size_t index, int deep) {
  const TypeTree& tree = *declared.tree;
  auto& values = enumerators_[&declared];
  if (values.size() == tree.enumerators.size() && !values.empty()) {
    return values[index];
  }
  std::int64_t next = 0;
  if (!tree.base.empty()) {
    Declared* base = names_.type(tree.base, declared.scope);
    if (base != nullptr && base->state == Declared::State::done && base->type != no_type) {
      for (const Enumerator& one : all_enumerators(model_, model_.at(base->type))) {
        next = static_cast<std::int64_t>(static_cast<std::uint64_t>(one.value) + 1);
      }
    }
  }
  Scope scope = declared.scope;
  scope.inner = tree.name.text;
  std::vector<std::optional<std::int64_t>> found;
  values.assign(tree.enumerators.size(), std::nullopt);  // what refers to itself has no value
  for (const EnumeratorTree& one : tree.enumerators) {
    std::optional<std::int64_t> value = next;
    if (one.value) {
      value = whole(*one.value, scope, deep);
      if (!value && !findings_.full()) {
        findings_.error(one.value->place,
                        fmt::format("the value of {} cannot be computed; expected a whole number, or "
                                    "constants and enumerators with + - * /",
                                    documents::quote(one.name.text)));
      }
    }
    enumerators_[&declared][found.size()] = value;
    next = static_cast<std::int64_t>(static_cast<std::uint64_t>(value.value_or(next)) + 1);
    found.push_back(value);
  }
  return found[index];
}

std::optional<std::int64_t> Types::whole(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return std::nullopt;
  }
  switch (expression.kind) {
    case Expression::Kind::number:
      return to_whole(expression.text);
    case Expression::Kind::text: {
      const bool negative = expression.text.starts_with('-');
      const auto value = to_whole(std::string_view{expression.text}.substr(negative ? 1 : 0));
      return value && negative
                 ? std::optional{static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(*value))}
                 : value;
    }
    case Expression::Kind::unary: {
      const auto value = expression.text == "-" ? whole(expression.parts[0], scope, deep + 1) : std::nullopt;
      return value ? std::optional{static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(*value))}
                   : std::nullopt;
    }
    case Expression::Kind::binary: {
      const auto left = whole(expression.parts[0], scope, deep + 1);
      const auto right = whole(expression.parts[1], scope, deep + 1);
      if (!left || !right) {
        return std::nullopt;
      }
      std::int64_t result = 0;
      bool fails = true;
      if (expression.text == "+") {
        fails = __builtin_add_overflow(*left, *right, &result);
      } else if (expression.text == "-") {
        fails = __builtin_sub_overflow(*left, *right, &result);
      } else if (expression.text == "*") {
        fails = __builtin_mul_overflow(*left, *right, &result);
      } else if (expression.text == "/" && *right != 0 && *right != -1) {
        result = *left / *right;
        fails = false;
      }
      return fails ? std::nullopt : std::optional{result};
    }
    case Expression::Kind::name: {
      const Constantlike* found = ++steps_ > most_steps ? nullptr : names_.value(expression.text, scope);
      if (found == nullptr) {
        return std::nullopt;
      }
      if (found->constant == nullptr) {
        return enumerator(*found->enumeration, found->enumerator, deep + 1);
      }
      const auto [known, is_new] = wholes_.emplace(found->constant, std::nullopt);
      if (is_new) {
        known->second = whole(found->constant->value, found->scope, deep + 1);
      }
      return known->second;
    }
    case Expression::Kind::real:
    case Expression::Kind::truth:
    case Expression::Kind::compound:
    case Expression::Kind::bracket:
      break;
  }
  return std::nullopt;
}

std::string Types::constant_text(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return {};
  }
  switch (expression.kind) {
    case Expression::Kind::real:
    case Expression::Kind::truth:
      return expression.text;
    case Expression::Kind::text:
      return json_text(expression.text);
    case Expression::Kind::unary:
      if (expression.text == "-" && expression.parts[0].kind == Expression::Kind::real) {
        return "-" + expression.parts[0].text;
      }
      if (expression.text == "!" && expression.parts[0].kind == Expression::Kind::truth) {
        return expression.parts[0].text == "true" ? "false" : "true";
      }
      break;
    case Expression::Kind::name: {
      const Constantlike* found = ++steps_ > most_steps ? nullptr : names_.value(expression.text, scope);
      if (found == nullptr && steps_ > most_steps) {
        findings_.error(expression.place, "the constants take too long to compute");
        return {};
      }
      if (found == nullptr) {
        findings_.error(expression.place,
                        fmt::format("{} is not known here; expected a constant or an enumerator",
                                    documents::quote(expression.text)));
        return {};
      }
      if (found->constant != nullptr) {
        return constant_text(found->constant->value, found->scope, deep + 1);
      }
      break;
    }
    case Expression::Kind::compound: {
      std::string all;
      for (std::size_t i = 0; i < expression.parts.size(); ++i) {
        all += fmt::format("{}{}: {}", i == 0 ? "" : ", ", json_text(expression.names[i].text),
                           constant_text(expression.parts[i], scope, deep + 1));
        if (all.size() > 1'000'000) {
          return {};
        }
      }
      return "{" + all + "}";
    }
    case Expression::Kind::bracket: {
      std::string all;
      const std::size_t step = expression.pairs ? 2 : 1;
      for (std::size_t i = 0; i + step <= expression.parts.size(); i += step) {
        const std::string first = constant_text(expression.parts[i], scope, deep + 1);
        all += i == 0 ? "" : ", ";
        all += step == 1
                   ? first
                   : fmt::format("[{}, {}]", first, constant_text(expression.parts[i + 1], scope, deep + 1));
        if (all.size() > 1'000'000) {
          return {};
        }
      }
      return "[" + all + "]";
    }
    case Expression::Kind::number:
    case Expression::Kind::binary:
      break;
  }
  const auto number = whole(expression, scope, deep);
  if (!number) {
    findings_.warning(expression.place, "the value of the constant cannot be computed, and is left out");
  }
  return number ? fmt::format("{}", *number) : "";
}

void Types::constants() {
  for (const Collection& collection : names_.collections()) {
    for (const ConstantTree& tree : collection.scope.in->constants) {
      const Value use = this->use(tree.type, collection.scope, {}, collection.version);
      std::string value = constant_text(tree.value, collection.scope);
      if (use.type == no_type || value.empty()) {
        continue;
      }
      const Type& type = resolved(model_, use.type);
      if (type.kind == Kind::primitive && type.primitive == messages::Primitive::uint64 &&
          value.starts_with('-')) {
        value =
            fmt::format("{}", static_cast<std::uint64_t>(whole(tree.value, collection.scope).value_or(0)));
      }
      model_.constants.push_back({tree.name.in_model(), use.type, std::move(value), collection.scope.model,
                                  tree.notes, tree.name.place});
    }
  }
}

std::string Types::polymorphic_in(TypeIndex index, int deep) {
  if (index == no_type || deep > deepest_type) {
    return {};
  }
  const auto known = polymorphic_.find(index);
  if (known != polymorphic_.end()) {
    return known->second;
  }
  polymorphic_[index] = "";
  const Type& type = model_.at(index);
  std::string found = type.polymorphic ? full_name(type.scope, type.name) : "";
  for (const TypeIndex other : {type.base, type.element.type, type.key.type}) {
    found = found.empty() ? polymorphic_in(other, deep + 1) : found;
  }
  for (const Value& member : type.members) {
    found = found.empty() ? polymorphic_in(member.type, deep + 1) : found;
  }
  return polymorphic_[index] = found;
}

}  // namespace trestle::describe::fidl
