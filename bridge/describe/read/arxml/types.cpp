#include "bridge/describe/read/arxml/types.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "bridge/describe/read/arxml/missing_types.hpp"
#include "bridge/describe/read/arxml/type_facts.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

using messages::Primitive;

namespace {

/// A type that contains itself by way of more than so many others would be one of these files' makers' jokes.
constexpr int max_type_depth = 64;

[[nodiscard]] std::uint64_t code(const Rules& rules) noexcept {
  const auto bits = [](const auto& value) {
    return value ? static_cast<std::uint64_t>(*value) + 1 : std::uint64_t{0};
  };
  std::uint64_t code = 0;
  for (const auto& width : {rules.array, rules.string, rules.structure, rules.choice, rules.selector}) {
    code = code * 8 + bits(width);
  }
  code = code * 4 + bits(rules.encoding);
  code = code * 4 + bits(rules.legacy_strings);
  code = code * 4 + (rules.byte_order
                         ? (*rules.byte_order == std::endian::big ? std::uint64_t{1} : std::uint64_t{2})
                         : std::uint64_t{0});
  code = code * 64 + bits(rules.alignment_bytes);
  return code * 4 + bits(rules.smallest_length);
}

[[nodiscard]] bool same(const Value& a, const Value& b) {
  return a.name == b.name && a.type == b.type && a.wire == b.wire && a.tag == b.tag &&
         a.optional == b.optional && a.notes == b.notes;
}

[[nodiscard]] bool same(const Type& a, const Type& b) {
  const auto same_enumerator = [](const Enumerator& x, const Enumerator& y) {
    return x.name == y.name && x.value == y.value;
  };
  return a.kind == b.kind && a.name == b.name && a.scope == b.scope && a.primitive == b.primitive &&
         a.invalid_value == b.invalid_value && a.minimum == b.minimum && a.maximum == b.maximum &&
         a.wire == b.wire && a.min_size == b.min_size && a.max_size == b.max_size &&
         a.fixed_size == b.fixed_size && same(a.element, b.element) && same(a.key, b.key) &&
         std::ranges::equal(a.members, b.members,
                            [](const Value& x, const Value& y) { return same(x, y); }) &&
         std::ranges::equal(a.enumerators, b.enumerators, same_enumerator);
}

/// Of what same() compares, as far as variants of one type differ in it.
[[nodiscard]] std::size_t hash_of(const Type& type) {
  std::size_t hash = 0;
  const auto add = [&hash](const auto& part) {
    const std::size_t own = std::hash<std::decay_t<decltype(part)>>{}(part);
    hash ^= own + 0x9e3779b9U + (hash << 6U) + (hash >> 2U);
  };
  const auto add_number = [&add](const auto& number) {
    add(number ? static_cast<std::int64_t>(*number) : std::int64_t{-1});
  };
  const auto add_use = [&](const Value& value) {
    add(static_cast<std::uint32_t>(value.type));
    add(static_cast<std::uint32_t>(value.wire.length) * 64U +
        static_cast<std::uint32_t>(value.wire.selector) * 8U +
        static_cast<std::uint32_t>(value.wire.encoding));
    add(value.wire.fixed_bytes);
    add_number(value.tag);
    add(value.wire.byte_order == std::endian::little);
  };
  add(static_cast<std::uint32_t>(type.kind) * 64U + static_cast<std::uint32_t>(type.primitive));
  add_number(type.invalid_value);
  add_number(type.minimum);
  add_number(type.maximum);
  add(type.min_size);
  add(type.max_size);
  add_use({.wire = type.wire});
  add_use(type.element);
  add_use(type.key);
  for (const Value& member : type.members) {
    add_use(member);
  }
  return hash;
}

/// Bounds of a number's type.
[[nodiscard]] std::pair<std::int64_t, std::int64_t> range(Primitive primitive) noexcept {
  switch (primitive) {
    case Primitive::int8:
      return {-0x80, 0x7f};
    case Primitive::uint8:
      return {0, 0xff};
    case Primitive::int16:
      return {-0x8000, 0x7fff};
    case Primitive::uint16:
      return {0, 0xffff};
    case Primitive::int32:
      return {-0x8000'0000LL, 0x7fff'ffff};
    case Primitive::uint32:
      return {0, 0xffff'ffff};
    default:
      return {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()};
  }
}

[[nodiscard]] std::optional<std::int64_t> limit(const Node* node, std::int64_t inwards) {
  if (node == nullptr) {
    return std::nullopt;
  }
  const std::optional<std::int64_t> value = integer(node->text);
  return value ? std::optional{*value + (node->open_interval ? inwards : 0)} : std::nullopt;
}

}  // namespace

Notes notes_beside(const Node& node) {
  Notes notes;
  const auto text_in = [](const Node* holder, Tag tag) {
    std::string_view text;
    bool english = false;
    each_child(holder, tag, [&](const Node& language) {
      if (text.empty() || (language.english && !english)) {
        text = language.text;
        english = language.english;
      }
    });
    return std::string{text};
  };
  notes.description = text_in(node.child("DESC"_tag), "L-2"_tag);
  each_in(&node, "ANNOTATIONS"_tag, "ANNOTATION"_tag, [&](const Node& annotation) {
    const std::string label = text_in(annotation.child("LABEL"_tag), "L-4"_tag);
    const Node* const text = annotation.child("ANNOTATION-TEXT"_tag);
    const Node* const verbatim = text == nullptr ? nullptr : text->child("VERBATIM"_tag);
    if (label == "unit") {
      notes.unit = text_in(verbatim, "L-5"_tag);  // as write/arxml has it
    } else if (!label.empty()) {
      notes.others[label] = text_in(verbatim, "L-5"_tag);
    }
  });
  return notes;
}

std::string identifier(std::string_view text) {
  std::string out;
  for (const char letter : text) {
    const bool good = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
                      (letter >= '0' && letter <= '9') || letter == '_';
    out += good ? letter : '_';
  }
  if (out.empty() || (out.front() >= '0' && out.front() <= '9')) {
    out.insert(0, "_");
  }
  return out;
}

Types::Types(const Tree& tree, Problems& problems, const Contexts& contexts, Copies& copies,
             const ArxmlOptions& options, Model& model)
    : tree_{tree},
      problems_{problems},
      contexts_{contexts},
      copies_{copies},
      options_{options},
      model_{model} {
  for (const Node* const map : tree.all("DATA-TYPE-MAP"_tag)) {
    const Node* const application = tree.follow(map, "APPLICATION-DATA-TYPE-REF"_tag);
    const Node* const implementation = tree.follow(map, "IMPLEMENTATION-DATA-TYPE-REF"_tag);
    if (application != nullptr && implementation != nullptr) {
      const auto [there, is_new] = implementations_.emplace(application, implementation);
      if (!is_new && there->second != implementation) {
        problems.warning(map->place(), Tree::path(application) +
                                           " is mapped to several implementation types; " +
                                           Tree::path(there->second) + " was taken");
      }
    }
  }
}

Value Types::value(const Node& prototype, const Context& context) {
  std::vector<const Node*> trail;
  Frame frame{.rules = context.rules, .base = context.rules, .context = &context, .trail = &trail};
  const Context& own = contexts_.of(&prototype);
  Context joint;
  if (&own != &context && !own.overrides.empty() &&
      copies_.take(prototype.place(), context.overrides.size() / 4)) {
    // An argument's own rules beside those of its method.
    joint = context;
    joint.overrides = own.overrides;
    frame.context = &joint;
  }
  for (const Override& special : frame.context->overrides) {
    if (special.target == &prototype) {
      frame.rules = joined(special.rules, frame.rules);
      frame.base.byte_order = frame.rules.byte_order;
      frame.representation = special.representation;
    }
  }
  const Node* reference = prototype.child("TYPE-TREF"_tag);
  Value value = by_reference(prototype, reference, frame);
  value.name = prototype.name;
  value.place = prototype.place();
  const Notes beside = notes_of(prototype);
  if (!beside.description.empty()) {
    value.notes.description = beside.description;
  }
  if (!beside.unit.empty()) {
    value.notes.unit = beside.unit;
  }
  value.notes.others.insert(beside.others.begin(), beside.others.end());
  return value;
}

std::optional<std::vector<Value>> Types::arguments(const Node& prototype, const Context& context) {
  const Node* const type = tree_.follow(&prototype, "TYPE-TREF"_tag);
  if (type == nullptr || Tree::scope(*type) != "/Trestle/Arguments") {
    return std::nullopt;
  }
  std::vector<const Node*> trail;
  const Frame frame{.rules = context.rules, .base = context.rules, .context = &context, .trail = &trail};
  std::vector<Value> values;
  each_in(type, "SUB-ELEMENTS"_tag, "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag,
          [&](const Node& element) { values.push_back(member(element, frame, nullptr)); });
  return values;
}

void Types::read_all() {
  const Context none;
  MissingTypes missing_types{tree_};
  std::set<const Node*> implementations;
  for (const auto& [application, implementation] : implementations_) {
    implementations.insert(implementation);
  }
  for (const Tag tag : {"STD-CPP-IMPLEMENTATION-DATA-TYPE"_tag, "CUSTOM-CPP-IMPLEMENTATION-DATA-TYPE"_tag,
                        "CPP-IMPLEMENTATION-DATA-TYPE"_tag, "IMPLEMENTATION-DATA-TYPE"_tag,
                        "APPLICATION-RECORD-DATA-TYPE"_tag, "APPLICATION-ARRAY-DATA-TYPE"_tag,
                        "APPLICATION-ASSOC-MAP-DATA-TYPE"_tag}) {
    for (const Node* const node : tree_.all(tag)) {
      if (variants_.contains(node) || full_) {
        continue;  // a service uses it
      }
      if (Tree::scope(*node).starts_with("/Trestle/")) {
        continue;  // what write/arxml needs beside the model's own types
      }
      if (!is_application(*node) && implementations.contains(node)) {
        continue;  // how an application type is implemented
      }
      if (const Node* const missing = missing_types.in(*node); missing != nullptr) {
        problems_.warning_once(
            "missing " + std::string{missing->text}, missing->place(),
            "the type " + std::string{missing->text} +
                " is in none of the files; no service needs it, and what consists of it is left "
                "out");
        continue;
      }
      std::vector<const Node*> trail;
      (void)build(*node, Frame{.context = &none, .trail = &trail});
    }
  }
}

Value Types::by_reference(const Node& holder, const Node* reference, const Frame& frame) {
  if (reference == nullptr) {
    problems_.warning(holder.place(), Tree::path(&holder) +
                                          " names no type: a type reference or base type was expected; uint8 "
                                          "is taken");
    return primitive(Primitive::uint8, frame);
  }
  if (const Node* const type = tree_.resolve(*reference); type != nullptr) {
    Value value = build(*type, frame);
    if (!copies_.take(reference->place(), Copies::of_text(value.notes))) {
      value.notes = {};
    }
    return value;
  }
  if (!is_standard(reference->text)) {
    problems_.error(reference->place(), "the type " + std::string{reference->text} +
                                            " is in none of the files: read the file that has it as well");
  }
  return standard(reference->text, frame);
}

/// uint8 of what no file has.
Value Types::standard(std::string_view path, const Frame& frame) {
  const std::string_view name = last_name(path);
  if (const auto found = standard_primitive(name)) {
    return primitive(*found, frame);
  }
  const std::string simple = plain(name);
  if (is_standard_string(simple)) {
    return unnamed({.kind = Kind::string}, frame);
  }
  if (is_standard_bytes(simple)) {
    return unnamed({.kind = Kind::bytes}, frame);
  }
  if (const std::optional<StandardArray> array = standard_array(path)) {
    Type type{.kind = Kind::array, .max_size = array->elements, .fixed_size = array->elements > 0};
    type.element = standard(array->element, frame);
    return unnamed(std::move(type), frame);
  }
  return primitive(Primitive::uint8, frame);
}

// --- keeping types ----------------------------------------------------------------------------------------

TypeIndex Types::keep(const Node* node, Type type) {
  NamedVariants& known = variants_[node];
  std::vector<TypeIndex>& others = known.all[hash_of(type)];
  for (const TypeIndex index : others) {
    if (same(model_.at(index), type)) {
      return index;
    }
  }
  type.variant_of = known.first;
  const TypeIndex index = model_.add(std::move(type));
  others.push_back(index);
  known.first = known.first == no_type ? index : known.first;
  return index;
}

Value Types::named(const Node& node, Type type, const Frame& frame) {
  if (type.name.empty()) {
    type.name = node.name;
    type.scope = Tree::scope(node);
  }
  // Types that have no name where they come from; write/arxml puts them there.
  if (type.scope == "/Trestle/Unnamed" && type.kind != Kind::structure && type.kind != Kind::choice &&
      type.kind != Kind::enumeration) {
    return unnamed(std::move(type), frame);
  }
  type.place = node.place();
  Value value;
  value.wire = lay_out(type, frame);
  type.wire = value.wire;
  value.type = keep(&node, std::move(type));
  return value;
}

Value Types::unnamed(Type type, const Frame& frame) {
  type.name.clear();
  type.scope.clear();
  type.place = {};
  type.notes = {};
  Value value;
  value.wire = lay_out(type, frame);
  type.wire = value.wire;
  std::vector<TypeIndex>& others = unnamed_[hash_of(type)];
  for (const TypeIndex index : others) {
    if (same(model_.at(index), type)) {
      value.type = index;
      return value;
    }
  }
  value.type = model_.add(std::move(type));
  others.push_back(value.type);
  return value;
}

Value Types::primitive(Primitive primitive, const Frame& frame) {
  return unnamed({.kind = Kind::primitive, .primitive = primitive}, frame);
}

Value Types::unknown(Place place, const Frame& frame) {
  if (!full_) {
    full_ = true;
    problems_.error(place, "there are more than " + std::to_string(options_.max_types) +
                               " types; further ones are not read");
  }
  return primitive(Primitive::uint8, frame);
}

Wire Types::lay_out(const Type& type, const Frame& frame) const {
  const Type* what = &type;
  Wire wire;
  if (type.kind == Kind::alias) {
    return type.element.wire;
  }
  wire = default_wire(what->kind);
  const Rules& rules = frame.rules;
  switch (what->kind) {
    case Kind::string:
      wire.length = rules.string.value_or(wire.length);
      wire.encoding = rules.encoding.value_or(wire.encoding);
      wire.bom = wire.terminator = !rules.legacy_strings.value_or(false);
      if (wire.length == someip::FieldWidth::none) {
        wire.fixed_bytes = type.wire.fixed_bytes;
      }
      break;
    case Kind::array:
    case Kind::map:
    case Kind::bytes:
      // A length field before a fixed number of elements stands only where it is asked for.
      wire.length = rules.array.value_or(type.fixed_size ? someip::FieldWidth::none : wire.length);
      break;
    case Kind::structure:
      wire.length = rules.structure.value_or(wire.length);
      break;
    case Kind::choice:
      wire.length = rules.choice.value_or(wire.length);
      wire.selector = rules.selector.value_or(wire.selector);
      break;
    case Kind::primitive:
    case Kind::enumeration:
    case Kind::alias:
      break;
  }
  if (frame.rules.byte_order && frame.context != nullptr &&
      *frame.rules.byte_order != frame.context->rules.byte_order.value_or(std::endian::big)) {
    wire.byte_order = frame.rules.byte_order;
  }
  return wire;
}

// --- building ---------------------------------------------------------------------------------------------

Types::Frame Types::inside(const Frame& frame) const {
  Frame inner = frame;
  inner.implementation = nullptr;
  inner.representation = nullptr;
  ++inner.depth;
  return inner;
}

Value Types::build(const Node& node, const Frame& frame) {
  if (frame.depth > max_type_depth) {
    problems_.error(node.place(), "types are nested more than " + std::to_string(max_type_depth) + " deep");
    return primitive(Primitive::uint8, frame);
  }
  if (full_ || ++built_count_ > options_.max_types) {
    return unknown(node.place(), frame);
  }
  if (!active_.insert(&node).second) {
    problems_.error(node.place(), "the type " + Tree::path(&node) + " contains itself");
    return primitive(Primitive::uint8, frame);
  }
  Value value;
  // Overrides tell uses of one type apart by the way that leads there.
  if (!frame.context->overrides.empty()) {
    value = build_new(node, frame);
  } else {
    const std::size_t tag_sets =
        tag_set_numbers_.emplace(frame.context->tag_sets, tag_set_numbers_.size()).first->second;
    const Key key{&node, frame.implementation, code(frame.rules), code(frame.base), tag_sets};
    if (const auto found = built_.find(key); found != built_.end()) {
      --built_count_;
      value = found->second;
    } else {
      value = build_new(node, frame);
      built_.emplace(key, value);
    }
  }
  active_.erase(&node);
  return value;
}

Value Types::build_new(const Node& node, const Frame& frame) {
  if (is_application(node)) {
    return build_application(node, frame);
  }
  if (node.tag == "SW-BASE-TYPE"_tag) {
    const auto found = base_type(&node);
    return found ? primitive(*found, frame) : unnamed({.kind = Kind::string}, frame);
  }
  const std::string_view tag = to_string(node.tag);
  if (tag.ends_with("IMPLEMENTATION-DATA-TYPE") || tag.ends_with("IMPLEMENTATION-DATA-TYPE-ELEMENT")) {
    return build_implementation(node, frame);
  }
  problems_.error(node.place(),
                  Tree::path(&node) + " is a " + std::string{tag} + ", and a data type was expected");
  return primitive(Primitive::uint8, frame);
}

Value Types::build_implementation(const Node& node, const Frame& frame) {
  const std::string_view category = node.child_text("CATEGORY"_tag);
  if (category == "STRUCTURE") {
    return node.child("DYNAMIC-ARRAY-SIZE-PROFILE"_tag) != nullptr
               ? build_array(node, frame)
               : build_members(node, frame, Kind::structure);
  }
  if (category == "UNION" || category == "VARIANT") {
    return build_members(node, frame, Kind::choice);
  }
  if (category == "ARRAY" || category == "VECTOR") {
    return build_array(node, frame);
  }
  if (category == "ASSOCIATIVE_MAP") {
    return build_map(node, frame);
  }
  if (category == "STRING") {
    return build_string(node, frame);
  }
  const Node* const properties = properties_of(node);
  const Node* const base = properties == nullptr ? nullptr : properties->child("BASE-TYPE-REF"_tag);
  const Node* reference =
      properties == nullptr ? nullptr : properties->child("IMPLEMENTATION-DATA-TYPE-REF"_tag);
  for (const Node* const holder : {&node, node.child("TYPE-REFERENCE"_tag)}) {
    for (const Tag tag : {"TYPE-REFERENCE-REF"_tag, "TYPE-TREF"_tag}) {
      if (reference == nullptr && holder != nullptr) {
        reference = holder->child(tag);
      }
    }
  }
  if (category == "TYPE_REFERENCE" || category == "TYPE_REF" ||
      (reference != nullptr && (category != "VALUE" || base == nullptr))) {
    return build_reference(node, reference, frame);
  }
  if (category != "VALUE" && category != "BOOLEAN" && !category.empty()) {
    problems_.warning(node.place(), "the CATEGORY " + std::string{category} + " of " + Tree::path(&node) +
                                        " is not known; it is read as VALUE");
  }
  return build_value(node, frame);
}

Value Types::build_reference(const Node& node, const Node* reference, const Frame& frame) {
  const Node* inner = nullptr;
  std::size_t elements = 0;
  if (reference == nullptr) {
    each_in(&node, "SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag, [&](const Node& element) {
      inner = &element;
      ++elements;
    });
  }
  if (elements == 1) {
    problems_.warning_once("reference in an element", node.place(),
                           Tree::path(&node) +
                               " has its reference in a SUB-ELEMENT, and one of its own was expected; such "
                               "types are read as if it were theirs");
  }
  const Value target = elements == 1 ? build_implementation(*inner, inside(frame))
                                     : by_reference(node, reference, inside(frame));
  // What it refers to may be a number to which only this type gives names.
  const Node* const method = compu_method(node, nullptr);
  const Node* const named = reference == nullptr ? nullptr : tree_.resolve(*reference);
  const Type& type = resolved(model_, target.type);
  const bool is_number = type.kind == Kind::primitive || type.kind == Kind::enumeration;
  if (method != nullptr && method->child_text("CATEGORY"_tag) == "TEXTTABLE" && is_number &&
      is_integer(type.primitive) && (named == nullptr || compu_method(*named, nullptr) != method)) {
    return build_enumeration(node, *method, Primitive{type.primitive}, frame);
  }
  return build_alias(node, target);
}

/// Elements have no name as types: what they refer to is meant.
Value Types::build_alias(const Node& node, const Value& target) {
  Value value = target;
  value.notes = notes_of(node);
  const Type& type = resolved(model_, target.type);
  // What it says of the number itself.
  Type number{.kind = type.kind, .primitive = type.primitive};
  if (type.kind == Kind::primitive) {
    add_numbers(node, nullptr, number, value.notes);
  }
  if (to_string(node.tag).ends_with("-ELEMENT")) {
    return value;
  }
  const std::string_view name = node.name;
  if (type.kind == Kind::primitive && standard_primitive(name) == type.primitive) {
    return value;
  }
  if (number.minimum || number.maximum || number.invalid_value) {
    number.name = name;
    number.scope = Tree::scope(node);
    if (!number.minimum && !number.maximum) {
      number.minimum = type.minimum;
      number.maximum = type.maximum;
    }
    number.invalid_value = number.invalid_value ? number.invalid_value : type.invalid_value;
    number.notes = std::exchange(value.notes, {});
    number.wire = target.wire;
    number.place = node.place();
    value.type = keep(&node, std::move(number));
    return value;
  }
  return named_alias(node, target, std::exchange(value.notes, {}));
}

Value Types::named_alias(const Node& node, const Value& target, Notes notes) {
  Value value = target;
  value.notes = {};
  Type alias{.kind = Kind::alias, .name = std::string{node.name}, .scope = Tree::scope(node)};
  if (alias.scope == "/Trestle/Unnamed") {
    return value;
  }
  alias.notes = std::move(notes);
  alias.element = value;
  alias.element.name.clear();
  alias.wire = target.wire;
  alias.place = node.place();
  value.type = keep(&node, std::move(alias));
  return value;
}

/// Whether the members of a structure or choice may be made once more, for other rules than those before.
bool Types::may_build_again(const Node& node) {
  if (!variants_.contains(&node)) {
    return true;
  }
  std::size_t members = 0;
  for (const Tag list : {"SUB-ELEMENTS"_tag, "ELEMENTS"_tag, "TEMPLATE-ARGUMENTS"_tag}) {
    each_child(copies_.full() ? nullptr : &node, list, [&](const Node& parts) {
      for (const Node* part = parts.first_child; part != nullptr; part = part->next) {
        ++members;
      }
    });
  }
  return copies_.take(node.place(), members);
}

Notes Types::notes_of(const Node& node) {
  Notes notes = notes_beside(node);
  const Node* const properties = properties_of(node);
  const Node* unit = tree_.follow(properties, "UNIT-REF"_tag);
  if (unit == nullptr) {  // also of a COMPU-METHOD that computes nothing
    unit = tree_.follow(tree_.follow(properties, "COMPU-METHOD-REF"_tag), "UNIT-REF"_tag);
  }
  if (unit != nullptr) {
    const std::string_view shown = unit->child_text("DISPLAY-NAME"_tag);
    if (copies_.take(node.place(), Copies::of_text(shown.size()))) {
      notes.unit = shown.empty() ? unit->name : shown;
    }
  }
  return notes;
}

const Node* Types::implementation_of(const Node& application) const {
  const auto found = implementations_.find(&application);
  return found == implementations_.end() ? nullptr : found->second;
}

const Node* Types::compu_method(const Node& node, const Node* implementation) const {
  for (const Node* const type : {&node, implementation}) {
    const Node* const properties = type == nullptr ? nullptr : properties_of(*type);
    const Node* const method = tree_.follow(properties, "COMPU-METHOD-REF"_tag);
    if (method != nullptr && method->child_text("CATEGORY"_tag) != "IDENTICAL") {
      return method;
    }
  }
  return nullptr;
}

std::optional<Primitive> Types::base_type(const Node* base) {
  if (base == nullptr) {
    return std::nullopt;
  }
  const std::optional<std::int64_t> bits = integer(base->child_text("BASE-TYPE-SIZE"_tag));
  const std::string_view encoding = base->child_text("BASE-TYPE-ENCODING"_tag);
  // Without an encoding, the type of C or the name tells what the bits are.
  const std::string_view native = base->child_text("NATIVE-DECLARATION"_tag);
  auto by_name = standard_primitive(native);
  by_name = by_name ? by_name : standard_primitive(base->name);
  if (!bits || (encoding.empty() && by_name && *bits == 8 * messages::width(*by_name))) {
    return by_name;
  }
  if (encoding.starts_with("UTF") || encoding.starts_with("ISO") || encoding == "UCS-2") {
    return *bits > 8 ? Primitive::uint16 : Primitive::uint8;
  }
  if (encoding == "BOOLEAN") {
    return Primitive::boolean;
  }
  if (encoding.starts_with("IEEE754")) {
    return *bits > 32 ? Primitive::float64 : Primitive::float32;
  }
  if (*bits != 8 && *bits != 16 && *bits != 32 && *bits != 64) {
    problems_.warning_once(Tree::path(base), base->place(),
                           "the base type " + Tree::path(base) + " has " + std::to_string(*bits) +
                               " bits: SOME/IP carries it in the next larger type of 8, 16, 32 or 64");
  }
  const bool is_signed = encoding == "2C" || encoding == "1C" || encoding == "SM" ||
                         (encoding.empty() && (native.starts_with("signed") || native.starts_with("int") ||
                                               native.starts_with("short") || native.starts_with("long")));
  if (*bits <= 8) {
    return is_signed ? Primitive::int8 : Primitive::uint8;
  }
  if (*bits <= 16) {
    return is_signed ? Primitive::int16 : Primitive::uint16;
  }
  if (*bits <= 32) {
    return is_signed ? Primitive::int32 : Primitive::uint32;
  }
  return is_signed ? Primitive::int64 : Primitive::uint64;
}

/// Limits and invalid value of an integer.
void Types::add_limits(const Node& node, const Node* implementation, Type& type) const {
  for (const Node* const one : {&node, implementation}) {
    const Node* const properties = one == nullptr ? nullptr : properties_of(*one);
    if (properties == nullptr) {
      continue;
    }
    const Node* const constraint = tree_.follow(properties, "DATA-CONSTR-REF"_tag);
    const Node* const limits =
        constraint == nullptr
            ? nullptr
            : constraint->down("DATA-CONSTR-RULES"_tag, "DATA-CONSTR-RULE"_tag, "INTERNAL-CONSTRS"_tag);
    if (limits != nullptr && is_integer(type.primitive)) {
      const auto [least, most] = range(type.primitive);
      const auto low = limit(limits->child("LOWER-LIMIT"_tag), 1);
      const auto high = limit(limits->child("UPPER-LIMIT"_tag), -1);
      const std::int64_t lowest = low.value_or(least);
      const std::int64_t highest = high.value_or(most);
      // One of them may be missing.
      if ((lowest != least || highest != most) && lowest <= highest && !type.minimum && !type.maximum) {
        type.minimum = low;
        type.maximum = high;
      }
    }
    const Node* const invalid = properties->down("INVALID-VALUE"_tag, "NUMERICAL-VALUE-SPECIFICATION"_tag);
    if (invalid != nullptr && is_integer(type.primitive) && !type.invalid_value) {
      type.invalid_value = integer(invalid->child_text("VALUE"_tag));
    }
  }
}

/// Limits, invalid value, unit and scale of a number.
void Types::add_numbers(const Node& node, const Node* implementation, Type& type, Notes& notes) {
  add_limits(node, implementation, type);
  const Node* const method = compu_method(node, implementation);
  if (method == nullptr) {
    return;
  }
  const Notes& computed = computation_of(*method);
  if (!copies_.take(node.place(), Copies::of_text(computed))) {
    return;
  }
  if (notes.unit.empty()) {
    notes.unit = computed.unit;
  }
  for (const auto& [key, text] : computed.others) {
    notes.others.insert_or_assign(key, text);
  }
}

/// What a COMPU-METHOD says of numbers: their unit, "scale", "offset", "divisor" and "texts".
const Notes& Types::computation_of(const Node& method) {
  const auto [known, is_new] = computations_.try_emplace(&method);
  Notes& notes = known->second;
  if (!is_new) {
    return notes;
  }
  if (const Node* const unit = tree_.follow(&method, "UNIT-REF"_tag); unit != nullptr) {
    const std::string_view shown = unit->child_text("DISPLAY-NAME"_tag);
    if (copies_.take(method.place(), Copies::of_text(shown.size()))) {
      notes.unit = shown.empty() ? unit->name : shown;
    }
  }
  std::string texts;
  each_in(method.child("COMPU-INTERNAL-TO-PHYS"_tag), "COMPU-SCALES"_tag, "COMPU-SCALE"_tag,
          [&](const Node& scale) {
            const Node* const factors = scale.child("COMPU-RATIONAL-COEFFS"_tag);
            if (factors != nullptr) {
              std::vector<std::string_view> numerator;
              each_child(factors->child("COMPU-NUMERATOR"_tag), "V"_tag,
                         [&](const Node& factor) { numerator.push_back(factor.text); });
              if (numerator.size() == 2 && (numerator[0] != "0" || numerator[1] != "1")) {
                notes.others["offset"] = numerator[0];
                notes.others["scale"] = numerator[1];
                std::vector<std::string_view> denominator;
                each_child(factors->child("COMPU-DENOMINATOR"_tag), "V"_tag,
                           [&](const Node& factor) { denominator.push_back(factor.text); });
                if (denominator.size() == 1 && denominator[0] != "1") {
                  notes.others["divisor"] = denominator[0];
                }
              }
            } else if (const Node* const text = scale.down("COMPU-CONST"_tag, "VT"_tag); text != nullptr) {
              texts += (texts.empty() ? "" : ", ") + std::string{scale.child_text("LOWER-LIMIT"_tag)} + " " +
                       std::string{text->text};
            }
          });
  if (!texts.empty()) {
    notes.others["texts"] = texts;
  }
  return notes;
}

Value Types::build_enumeration(const Node& node, const Node& method, Primitive primitive,
                               const Frame& frame) {
  const bool own = !to_string(node.tag).ends_with("-ELEMENT");
  Type type{.kind = Kind::enumeration, .primitive = primitive};
  const Node& origin = own ? node : method;
  add_limits(node, frame.implementation, type);
  type.minimum.reset();
  type.maximum.reset();
  const EnumerationKey key{&origin, &method, primitive, type.invalid_value, lay_out(type, frame).byte_order};
  if (const auto known = enumerations_.find(key); known != enumerations_.end()) {
    return known->second;
  }
  if (!used_texts_.insert(&method).second) {
    std::size_t enumerators = 0;
    each_in(copies_.full() ? nullptr : method.child("COMPU-INTERNAL-TO-PHYS"_tag), "COMPU-SCALES"_tag,
            "COMPU-SCALE"_tag, [&](const Node&) { ++enumerators; });
    if (!copies_.take(node.place(), enumerators)) {
      return this->primitive(primitive, frame);
    }
  }
  type.name = origin.name;
  type.scope = Tree::scope(origin);
  type.notes = notes_of(origin);
  std::set<std::string> names;
  each_in(method.child("COMPU-INTERNAL-TO-PHYS"_tag), "COMPU-SCALES"_tag, "COMPU-SCALE"_tag,
          [&](const Node& scale) {
            std::string_view name = scale.child_text("SYMBOL"_tag);
            name = name.empty() ? scale.child_text("SHORT-LABEL"_tag) : name;
            const Node* const text = scale.down("COMPU-CONST"_tag, "VT"_tag);
            name = name.empty() && text != nullptr ? text->text : name;
            const auto low = limit(scale.child("LOWER-LIMIT"_tag), 1);
            const auto high = limit(scale.child("UPPER-LIMIT"_tag), -1);
            if (name.empty() || (!low && !high)) {
              problems_.warning(scale.place(), "a value of " + Tree::path(&method) +
                                                   " has no name or no LOWER-LIMIT; it is left out");
              return;
            }
            if (low && high && *low != *high) {
              problems_.warning(scale.place(), std::string{name} + " stands for values from " +
                                                   std::to_string(*low) + " to " + std::to_string(*high) +
                                                   "; the first is taken");
            }
            Enumerator enumerator{.name = identifier(name), .value = low ? *low : *high};
            while (!names.insert(enumerator.name).second) {
              enumerator.name += '_';
            }
            enumerator.notes.description = notes_beside(scale).description;
            enumerator.place = scale.place();
            type.enumerators.push_back(std::move(enumerator));
          });
  Value value = named(origin, std::move(type), frame);
  enumerations_.emplace(key, value);
  return value;
}

}  // namespace trestle::describe::arxml
