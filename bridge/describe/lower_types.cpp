#include "bridge/describe/lower_types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/marks.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/describe/units.hpp"
#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::describe {
namespace {

using messages::ArrayKind;
using messages::Primitive;
using messages::TypeRules;
using someip::FieldWidth;

/// The field that a message without fields has in IDL.
constexpr std::string_view only_member = "structure_needs_at_least_one_member";

bool is_array(const Type& type) {
  return type.kind == Kind::array || type.kind == Kind::map || type.kind == Kind::bytes;
}

bool is_in(const Model& model, TypeIndex index) {
  return static_cast<std::size_t>(index) < model.types.size();
}

bool is_number_of_bytes(const Type& type) {
  return (type.kind == Kind::primitive || type.kind == Kind::enumeration) &&
         messages::width(type.primitive) > 1;
}

std::string type_part(std::string_view name) {
  return std::string{name.substr(name.rfind('/') + 1)};
}

std::string package_part(std::string_view name) {
  return std::string{name.substr(0, name.find('/'))};
}

/// An error is an enumeration. A field that is one or the other makes no other message.
/// Names of aliases and arrays make none either: those of the first one hold.
std::string_view mark_of(const messages::Field& field) {
  std::string_view mark = marks::parse(field.mark).what;
  if (mark.starts_with(marks::error)) {
    mark.remove_prefix(marks::error.size());
  } else if (mark.starts_with(marks::enumeration)) {
    mark.remove_prefix(marks::enumeration.size());
  }
  return mark;
}

bool same_fields(const messages::MessageDefinition& a, const messages::MessageDefinition& b) {
  return std::ranges::equal(a.fields, b.fields,
                            [](const messages::Field& left, const messages::Field& right) {
                              return left.name == right.name && left.type == right.type &&
                                     left.default_value == right.default_value &&
                                     mark_of(left) == mark_of(right);
                            }) &&
         std::ranges::equal(a.constants, b.constants, [](const auto& left, const auto& right) {
           return left.name == right.name && left.type == right.type && left.value == right.value;
         });
}

/// All that same_fields() compares, and the form.
std::string fields_text(const Shape& shape) {
  std::string text = fmt::format("{}", static_cast<int>(shape.form));
  for (const messages::Field& field : shape.definition.fields) {
    const messages::FieldType& type = field.type;
    text += fmt::format("\n{} {} {} {} {} {} {} {}", field.name, type.message,
                        type.primitive ? static_cast<int>(*type.primitive) : -1, static_cast<int>(type.array),
                        type.array_size, type.string_bound, mark_of(field), field.default_value);
  }
  for (const messages::Constant& constant : shape.definition.constants) {
    text += fmt::format("\n{} = {} {}", constant.name, static_cast<int>(constant.type), constant.value);
  }
  return text;
}

}  // namespace

TypeLowering::TypeLowering(const Model& model, const LowerOptions& options, Lowered& into)
    : model_{model}, options_{options}, into_{into} {
  for (const Constant& constant : model.constants) {
    constants_[constant.scope].push_back(&constant);
  }
}

void TypeLowering::complain(std::string element, std::string what, Place place) {
  into_.not_carried.push_back({std::move(element), std::move(what), place});
}

std::string TypeLowering::package_of(const std::string& scope, Place place) {
  if (!options_.package.empty()) {
    return options_.package;
  }
  const std::string package = ros_package_name(scope);
  const std::string fitting = short_name(package, 'h');
  if (fitting != package && shortened_.insert(package).second) {
    complain(scope, fmt::format("the whole name of its package, which is too long for a file: {}", fitting),
             place);
  }
  return package.empty() ? options_.package_without_scope : fitting;
}

std::string TypeLowering::fit(const std::string& name, const std::string& source, Place place) {
  const std::size_t type = name.rfind('/') + 1;
  const std::string fitting = name.substr(0, type) + short_name(name.substr(type), 'H');
  if (fitting != name && shortened_.insert(name).second) {
    complain(source, fmt::format("its whole name, which is too long for a file: {}", fitting.substr(type)),
             place);
  }
  return fitting;
}

std::optional<std::size_t> TypeLowering::shape_of(TypeIndex index) {
  if (const auto known = known_.find(index); known != known_.end()) {
    return known->second;
  }
  const Type& type = model_.at(index);
  const std::string source = full_name(type.scope, type.name);
  if (!open_.insert(index).second) {
    complain(source, "a type that contains itself", type.place);
    return std::nullopt;
  }
  std::optional<std::size_t> result;
  if (is_polymorphic(model_, type)) {
    complain(source, "a polymorphic structure", type.place);
  } else if (++depth_ > messages::max_type_depth) {
    --depth_;
    complain(source, fmt::format("types nested deeper than {}", messages::max_type_depth), type.place);
  } else {
    const std::string name =
        !type.ros_name.empty() ? type.ros_name
                               : fit(package_of(type.scope, type.place) + "/msg/" + ros_type_name(type.name),
                                     source, type.place);
    result = structure(type, {name, source});
    --depth_;
  }
  open_.erase(index);
  known_[index] = result;
  return result;
}

std::optional<std::size_t> TypeLowering::structure(const Type& type, const Owner& owner) {
  Shape shape;
  shape.source = owner.source;
  shape.definition.name = owner.name;
  const std::vector<Value> members = all_members(model_, type);
  if (members.size() > messages::max_messages_per_type * 64) {
    complain(owner.source, "too many members", type.place);
    return std::nullopt;
  }
  if (type.kind == Kind::choice) {
    shape.form = TypeRules::Form::choice;
    shape.selectors = type.selectors;
    for (std::uint32_t i = 0; i < shape.selectors.size(); ++i) {
      if (shape.selectors[i] != i + 1) {
        break;
      }
      if (i + 1 == shape.selectors.size()) {
        shape.selectors.clear();
      }
    }
    shape.definition.mark = marks::choice;
    for (const std::uint32_t selector : shape.selectors) {
      shape.definition.mark += fmt::format(" {}", selector);
    }
  }
  const bool is_only = members.size() == 1 && members[0].name == only_member;
  if (!is_only && !add_uses(shape, members, owner, type.kind == Kind::choice, !type.ros_name.empty())) {
    return std::nullopt;
  }
  if (members.empty()) {
    if (type.kind == Kind::choice) {
      complain(owner.source, "a choice without members", type.place);
      return std::nullopt;
    }
    shape.form = TypeRules::Form::empty;
  }
  if (!type.ros_name.empty()) {
    constants_of(shape, type.ros_name, true);
  }
  const auto result = made(std::move(shape), owner, !type.ros_name.empty());
  if (result) {
    into_.notes.emplace(shapes_[*result].definition.name, type.notes);
  }
  return result;
}

/// The wanted name, or one with a number, unless a shape of that name is the same.
std::string TypeLowering::free_name(const Shape& shape) {
  const std::string& wanted = shape.definition.name;
  const auto [known, is_new] = alike_[wanted].try_emplace(fields_text(shape));
  if (!is_new) {
    return known->second;
  }
  const auto is_other = [&](const std::string& name) {
    const auto other = defined_.find(name);
    return other != defined_.end() && !(same_fields(shapes_[other->second].definition, shape.definition) &&
                                        shapes_[other->second].form == shape.form);
  };
  unsigned& number = next_numbers_.try_emplace(wanted, 1U).first->second;
  std::string name = number == 1 ? wanted : wanted + std::to_string(number);
  while (is_other(name)) {
    name = wanted + std::to_string(++number);
  }
  return known->second = std::move(name);
}

/// Adds the shape, and its definition unless there is an equal one.
std::optional<std::size_t> TypeLowering::made(Shape shape, const Owner& owner, bool is_fixed) {
  const std::string wanted = shape.definition.name;
  const std::string name = free_name(shape);
  if (is_fixed && name != wanted) {
    complain(owner.source, fmt::format("{} is there with other fields, so this one is {}", wanted, name));
  }
  shape.constant_at.clear();
  shape.constant_names = {};
  const auto constant_notes = std::exchange(shape.constant_notes, {});
  shape.enumerations.clear();
  shape.definition.name = name;
  shape.definition.file = "description";
  shapes_.push_back(std::move(shape));
  const std::size_t index = shapes_.size() - 1;
  const Shape& there = shapes_.back();
  if (defined_.emplace(name, index).second) {
    into_.by_name.emplace(name, into_.definitions.size());
    into_.definitions.push_back(there.definition);
    into_.sources.emplace(name, there.source);
    messages::MessageWords& words = into_.words[name];
    words.form = there.is_wrapper                        ? messages::MessageWords::Form::wrapper
                 : there.form == TypeRules::Form::choice ? messages::MessageWords::Form::choice
                                                         : messages::MessageWords::Form::structure;
    for (const Shape::Use& use : there.uses) {
      words.fields.push_back(use.words);
    }
    for (const auto& [constant, source] : there.constants) {
      into_.sources.emplace(name + "." + constant, source);
    }
    for (const auto& [constant, notes] : constant_notes) {
      into_.notes.emplace(name + "." + constant, notes);
    }
    for (const Shape::Use& use : there.uses) {
      into_.sources.emplace(name + "." + use.field.name, use.source);
      Notes notes = use.notes != nullptr ? *use.notes : Notes{};
      notes.unit = use.unit;
      if (notes != Notes{}) {
        into_.notes.emplace(name + "." + use.field.name, std::move(notes));
      }
    }
  }
  return index;
}

std::optional<std::size_t> TypeLowering::shape_of(const std::vector<Value>& values, const std::string& name,
                                                  const std::string& source, bool begins_with_error) {
  Shape shape;
  shape.source = source;
  shape.definition.name = name;
  const Owner owner{name, source};
  if (!add_uses(shape, values, owner, false, false)) {
    return std::nullopt;
  }
  if (values.empty()) {
    shape.form = TypeRules::Form::empty;
  } else if (std::string& mark = shape.definition.fields.front().mark;
             begins_with_error && mark.starts_with(marks::enumeration)) {
    mark.replace(0, marks::enumeration.size(), marks::error);
  }
  return made(std::move(shape), owner, false);
}

/// What an array is of; the type itself where it is none.
const Type& TypeLowering::resolved_element(const Type& type) const {
  const bool has_element = type.kind == Kind::array && type.element.type != no_type &&
                           static_cast<std::size_t>(type.element.type) < model_.types.size();
  return has_element ? resolved(model_, type.element.type) : type;
}

bool TypeLowering::add_uses(Shape& shape, const std::vector<Value>& values, const Owner& owner,
                            bool is_choice, bool keeps_names) {
  FreeNames taken;
  const bool is_tagged =
      std::ranges::any_of(values, [](const Value& value) { return value.tag.has_value(); });
  for (const Value& value : values) {
    const std::string what = owner.source + "." + value.name;
    const std::string wanted = keeps_names && !value.name.empty() ? value.name : ros_field_name(value.name);
    const std::string name = taken.take(wanted, "_");
    if (value.type == no_type || static_cast<std::size_t>(value.type) >= model_.types.size()) {
      complain(what, "a member without a type", value.place);
      return false;
    }
    if (is_tagged && !value.tag) {
      complain(what, "a member without a tag among others with tags", value.place);
      return false;
    }
    const Type& type = resolved(model_, value.type);
    // An array that may be missing is an empty one: a T[<=1] of arrays would have a length field of its own.
    const bool is_optional = value.optional && value.tag && !is_array(type);
    if (value.optional && !is_optional) {
      complain(what,
               value.tag ? "optional: of an array, which is empty where it is missing"
                         : "optional without a tag: it is always there",
               value.place);
      shape.has_optional_array = shape.has_optional_array || value.tag;
    }
    auto use = use_of(value, owner, name, is_choice || is_optional);
    if (!use) {
      return false;
    }
    if (is_choice || is_optional) {
      use->field.type.array = ArrayKind::bounded;
      use->field.type.array_size = 1;
    }
    use->field.name = name;
    use->words.name = value.name;
    if (is_optional) {
      use->words.form = messages::FieldWords::Form::optional;
    } else if (!is_choice) {
      use->words.form = type.kind == Kind::bytes ? messages::FieldWords::Form::bytes
                        : type.kind == Kind::map ? messages::FieldWords::Form::entries
                                                 : messages::FieldWords::Form::plain;
    }
    const bool stands_for_array =
        is_array(type) && use->nested && (is_choice || is_array(resolved_element(type)));
    if (stands_for_array) {
      use->field.mark = marks::array;
    }
    if (!is_choice && (type.kind == Kind::bytes || type.kind == Kind::map)) {
      use->field.mark = type.kind == Kind::bytes ? marks::bytes : marks::map;
    }
    use->field.default_value = is_choice ? "" : value.default_value;
    use->source = value.name;
    use->tag = value.tag;
    use->notes = &value.notes;
    if (value.wire.byte_order) {
      const Type& numbers = type.kind == Kind::array ? resolved(model_, type.element.type) : type;
      const bool has_numbers = is_number_of_bytes(numbers) || use->nested.has_value();
      use->byte_order = has_numbers ? value.wire.byte_order : std::nullopt;
    }
    if (use->nested) {
      shape.has_optional_array = shape.has_optional_array || shapes_[use->shape].has_optional_array;
    }
    add_enumerators(shape, *use, value);
    if (!is_array(type) || !is_choice) {  // else those of the message between
      add_names(use->field, value, what);
    }
    use->unit = measured_in(model_, value);
    shape.definition.fields.push_back(use->field);
    shape.uses.push_back(std::move(*use));
  }
  return true;
}

/// @param is_single  whether the field may be no array, because it becomes a T[<=1].
std::optional<Shape::Use> TypeLowering::use_of(const Value& value, const Owner& owner,
                                               const std::string& name, bool is_single) {
  const Type& type = resolved(model_, value.type);
  const std::string what = owner.source + "." + value.name;
  Shape::Use use;
  if (!is_array(type)) {
    return element(use, value, owner) ? std::optional{use} : std::nullopt;
  }
  if (is_single) {
    const auto inner = wrapper(value, owner, name);
    if (!inner) {
      return std::nullopt;
    }
    use.field.type.message = shapes_[*inner].definition.name;
    use.shape = *inner;
    use.nested = Wire{};
    return use;
  }
  if (!array(use, type, value, what)) {
    return std::nullopt;
  }
  if (type.kind == Kind::bytes) {
    use.field.type.primitive = Primitive::uint8;
    return use;
  }
  if (type.kind == Kind::map) {
    const auto pair = entry(type, owner, name);
    if (!pair) {
      return std::nullopt;
    }
    use.field.type.message = shapes_[*pair].definition.name;
    use.shape = *pair;
    use.nested = Wire{};
    return use;
  }
  if (type.element.type == no_type || static_cast<std::size_t>(type.element.type) >= model_.types.size()) {
    complain(what, "an array of no type", type.place);
    return std::nullopt;
  }
  if (is_array(resolved(model_, type.element.type))) {
    // Arrays of arrays: ROS has none, a message without bytes of its own stands between them.
    const auto inner = wrapper(type.element, owner, name);
    if (!inner) {
      return std::nullopt;
    }
    use.field.type.message = shapes_[*inner].definition.name;
    use.shape = *inner;
    use.nested = Wire{};
    return use;
  }
  return element(use, type.element, owner) ? std::optional{use} : std::nullopt;
}

/// What is no array: a number, a string or a message.
bool TypeLowering::element(Shape::Use& use, const Value& value, const Owner& owner) {
  const Type& type = resolved(model_, value.type);
  const std::string what = owner.source + "." + value.name;
  switch (type.kind) {
    case Kind::primitive:
    case Kind::enumeration:
      use.field.type.primitive = type.primitive;
      use.bits = value.wire.bits;
      return true;
    case Kind::string:
      use.field.type.primitive = type.ros_name == "wstring" ? Primitive::wstring : Primitive::string;
      use.field.type.string_bound = type.max_size;
      use.string = value.wire;
      if (value.wire.length == FieldWidth::none && value.wire.fixed_bytes == 0) {
        complain(what, "a string without a length field or a fixed size", value.place);
        return false;
      }
      return true;
    case Kind::structure:
    case Kind::choice: {
      const TypeIndex index = behind_aliases(model_, value.type);
      const auto shape = shape_of(index);
      if (!shape) {
        complain(what, fmt::format("{} is not carried", full_name(type.scope, type.name)), value.place);
        return false;
      }
      use.field.type.message = shapes_[*shape].definition.name;
      use.shape = *shape;
      use.nested = value.wire;
      return true;
    }
    case Kind::alias:
      complain(what, "an alias of itself", type.place);
      return false;
    case Kind::bytes:
    case Kind::array:
    case Kind::map:
      break;
  }
  return false;
}

bool TypeLowering::array(Shape::Use& use, const Type& type, const Value& value, const std::string& what) {
  use.array = value.wire;
  const bool is_fixed = type.fixed_size || value.wire.length == FieldWidth::none;
  if (is_fixed && type.max_size == 0) {
    complain(what, "an array without a length field and a size", value.place);
    return false;
  }
  if (type.min_size != 0 && !is_fixed) {
    complain(what, fmt::format("at least {} elements", type.min_size), value.place);
  }
  use.field.type.array_size = type.max_size;
  use.field.type.array = is_fixed             ? ArrayKind::fixed
                         : type.max_size != 0 ? ArrayKind::bounded
                                              : ArrayKind::unbounded;
  return true;
}

/// A message of nothing but an array, which has no bytes of its own.
std::optional<std::size_t> TypeLowering::wrapper(const Value& value, const Owner& owner,
                                                 const std::string& name) {
  if (++depth_ > messages::max_type_depth) {
    --depth_;
    complain(owner.source + "." + value.name, "arrays of arrays without end", value.place);
    return std::nullopt;
  }
  const Owner inner{owner.name + ros_type_name(name), owner.source + "." + name};
  Shape shape;
  shape.source = inner.source;
  // A message of its own, also where the owner is one of a service.
  shape.definition.name =
      fit(package_part(owner.name) + "/msg/" + ros_type_name(type_part(inner.name)), inner.source);
  Value array = value;
  array.name = "elements";
  array.optional = false;
  array.tag.reset();
  array.notes = {};
  array.default_value.clear();
  const bool good = add_uses(shape, {array}, {shape.definition.name, inner.source}, false, false);
  --depth_;
  if (!good) {
    return std::nullopt;
  }
  shape.uses[0].notes = nullptr;
  shape.is_wrapper = true;
  return made(std::move(shape), inner, false);
}

/// A pair of a map. That of a map with a name is the same for all.
std::optional<std::size_t> TypeLowering::entry(const Type& map, const Owner& owner, const std::string& name) {
  const TypeIndex index{static_cast<std::uint32_t>(&map - model_.types.data())};
  if (const auto known = entries_.find(index); known != entries_.end()) {
    return known->second;
  }
  const bool is_nested = entry_depth_ > 0;
  nested_maps_of_member_ = is_nested ? nested_maps_of_member_ + 1 : 0;
  nested_maps_ += is_nested ? 1 : 0;
  if (nested_maps_of_member_ > max_nested_maps_of_member || nested_maps_ > max_nested_maps) {
    complain(owner.source,
             fmt::format("more than {} maps in maps",
                         nested_maps_ > max_nested_maps ? max_nested_maps : max_nested_maps_of_member),
             map.place);
    return std::nullopt;
  }
  ++entry_depth_;
  const auto made = new_entry(map, owner, name);
  --entry_depth_;
  if (made && !map.name.empty()) {
    entries_.emplace(index, made);
  }
  return made;
}

std::optional<std::size_t> TypeLowering::new_entry(const Type& map, const Owner& owner,
                                                   const std::string& name) {
  if (++depth_ > messages::max_type_depth) {
    --depth_;
    complain(owner.source, "maps of maps without end", map.place);
    return std::nullopt;
  }
  const std::string base =
      map.name.empty()
          ? package_part(owner.name) + "/msg/" + ros_type_name(type_part(owner.name) + "_" + name)
          : package_of(map.scope, map.place) + "/msg/" + ros_type_name(map.name);
  Shape shape;
  shape.source = map.name.empty() ? owner.source + "." + name : full_name(map.scope, map.name);
  // One that was read from a ROS type stays that type.
  shape.definition.name = map.ros_name.empty() ? fit(base, shape.source) + "Entry" : map.ros_name;
  Value key = map.key;
  key.name = "key";
  Value value = map.element;
  value.name = "value";
  const Owner inner{shape.definition.name, shape.source};
  const bool good = add_uses(shape, {key, value}, inner, false, false);
  --depth_;
  if (!good) {
    return std::nullopt;
  }
  for (Shape::Use& use : shape.uses) {
    use.notes = nullptr;
  }
  return made(std::move(shape), inner, false);
}

namespace {

/// Whether a name of a number says no more than what it is made of, as those of AUTOSAR's platform do:
/// "uint8", "std_uint8_t", "UInt8".
bool is_plain_name(const Type& type) {
  std::string name;
  for (const char c : type.name) {
    name += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  const std::string_view part = std::string_view{name}.substr(name.starts_with("std_") ? 4 : 0);
  const std::string_view bare = part.substr(0, part.size() - (part.ends_with("_t") ? 2 : 0));
  constexpr std::array<std::string_view, 6> others{"boolean", "float", "double",
                                                   "string",  "char",  "bytebuffer"};
  return bare == messages::to_string(type.primitive) || std::ranges::find(others, bare) != others.end();
}

}  // namespace

/// Marks the field with the names of typedefs and arrays, for which ROS has no place.
void TypeLowering::add_names(messages::Field& field, const Value& value, const std::string& what) {
  marks::FieldMark mark = marks::parse(field.mark);
  const auto add = [&](const Type& type, std::vector<std::string_view>& aliases) {
    const bool is_plain =
        type.kind == Kind::primitive || type.kind == Kind::string || type.kind == Kind::bytes;
    if (!messages::is_identifier(type.name) || (is_plain && is_plain_name(type)) ||
        !(is_plain || type.kind == Kind::array || type.kind == Kind::alias)) {
      return;
    }
    if (type.kind == Kind::array) {
      mark.array_name = type.name;
    } else {
      aliases.push_back(type.name);
    }
  };
  const auto add_all = [&](TypeIndex index, std::vector<std::string_view>& aliases) {
    for (std::size_t steps = 0; steps <= max_type_nesting && is_in(model_, index); ++steps) {
      const Type& type = model_.at(index);
      add(type, aliases);
      index = type.kind == Kind::alias ? type.element.type : no_type;
    }
  };
  add_all(value.type, mark.aliases);
  const Type& type = resolved(model_, value.type);
  if (type.kind == Kind::array && !is_array(resolved_element(type))) {
    add_all(type.element.type, mark.element_aliases);
  }
  std::string text = marks::text_of(mark);
  if (text.size() > messages::max_mark_bytes - messages::mark_comment.size()) {
    into_.renamed.push_back({what, "the names of its typedefs, which are too long", value.place});
    return;
  }
  field.mark = std::move(text);
}

}  // namespace trestle::describe
