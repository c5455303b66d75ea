#include "bridge/describe/read/fidl/types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr std::size_t most_types = 500'000;
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
    if (!declared.tree->wraps) {
      (void)type(declared);
    }
  }
  constants();
}

const Setting* Types::find(const Layers& layers, std::string_view key) const {
  const std::string own = fmt::format("SomeIp{}", key);
  for (const Layer& layer : layers) {
    if (layer.arrays_taken && key.starts_with("Array")) {
      continue;
    }
    // Those of maps have a prefix always.
    if (const Setting* setting = key.starts_with("Map") ? nullptr : layer.node->setting(own)) {
      return setting;
    }
    if (layer.user != User::other && !layer.overwrites()) {
      const std::string of_user = fmt::format("{}{}", prefix(layer.user), key);
      if (const Setting* setting = layer.node->setting(of_user);
          setting != nullptr && std::ranges::binary_search(known_keys(), of_user)) {
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
    // Of anything that comes: as little to be carried as a polymorphic struct.
    type.kind = Kind::structure;
    type.name = ref.name.text;
    type.polymorphic = true;
  } else {
    type.kind = Kind::primitive;
    // Integer: as CommonAPI has it.
    type.primitive = primitive_of(ref.name.text).value_or(messages::Primitive::int32);
    if (ref.name.text == "Integer" && !ref.minimum && !ref.maximum && !integer_told_) {
      integer_told_ = true;
      findings_.warning(
          ref.name.place,
          "Integer without limits is taken for Int32, as CommonAPI does; so wherever else it stands");
    }
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
      std::int64_t bits = number(layers, "IntegerBitWidth", 0, 64).value_or(0);
      if (bits > own) {
        findings_.warning(
            find(layers, "IntegerBitWidth")->values.front().place,
            fmt::format("{} has {} bits, and not {}: it is read as a whole one", ref.name.text, own, bits));
        bits = own;
      }
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
    findings_.error(place,
                    fmt::format("the types form a cycle: {} contains itself, directly or through others",
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
  const Layer& first = layers.front();
  if (!copies_.take(first.node->place, declared.tree->fields.size() + declared.tree->enumerators.size())) {
    return declared.type;
  }
  Type type = build(declared, layers, deep);
  type.variant_of = declared.type;
  const TypeIndex index =
      !is_whole(type) || same_type(type, model_.at(declared.type)) ? declared.type : add(std::move(type));
  variants_.emplace(std::move(key), index);
  return index;
}

bool Types::same(const Value& a, const Value& b, int deep) const {
  if (a.wire != b.wire || a.type == b.type || a.type == no_type || b.type == no_type || deep > deepest_type) {
    return a.wire == b.wire && a.type == b.type;
  }
  const Type& one = model_.at(a.type);
  const Type& other = model_.at(b.type);
  const auto all_same = [&](const Value& first, const Value& second) {
    return first.name == second.name && same(first, second, deep + 1);
  };
  return one.kind == other.kind && full_name(one.scope, one.name) == full_name(other.scope, other.name) &&
         one.primitive == other.primitive && one.invalid_value == other.invalid_value &&
         one.minimum == other.minimum && one.maximum == other.maximum && one.min_size == other.min_size &&
         one.max_size == other.max_size && one.fixed_size == other.fixed_size &&
         all_same({.type = one.base}, {.type = other.base}) && all_same(one.element, other.element) &&
         all_same(one.key, other.key) && std::ranges::equal(one.members, other.members, all_same);
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
