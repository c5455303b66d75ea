// The kinds of data types, one after the other.
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bridge/describe/read/arxml/type_facts.hpp"
#include "bridge/describe/read/arxml/types.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

using messages::Primitive;

Value Types::build_value(const Node& node, const Frame& frame) {
  const Node* base_holder = frame.representation;
  const Node* base = tree_.follow(frame.representation, "BASE-TYPE-REF"_tag);
  for (const Node* const type : {&node, frame.implementation}) {
    const Node* const own = type == nullptr ? nullptr : properties_of(*type);
    if (base == nullptr && own != nullptr && own->child("BASE-TYPE-REF"_tag) != nullptr) {
      base_holder = own;
      base = tree_.follow(own, "BASE-TYPE-REF"_tag);
    }
  }
  std::optional<Primitive> primitive = base_type(base);
  const Node* const reference = base_holder == nullptr ? nullptr : base_holder->child("BASE-TYPE-REF"_tag);
  if (!primitive && reference != nullptr) {
    primitive = standard_primitive(last_name(reference->text));
  }
  if (!primitive && frame.implementation != nullptr) {
    // Behind a reference: what the implementation type is tells.
    Frame inner = inside(frame);
    const Value value = build(*frame.implementation, inner);
    const Type& type = resolved(model_, value.type);
    if (type.kind == Kind::primitive || type.kind == Kind::enumeration) {
      primitive = type.primitive;
      if (type.kind == Kind::enumeration && compu_method(node, frame.implementation) == nullptr) {
        return value;
      }
    }
  }
  if (!primitive) {
    primitive = standard_primitive(node.name);
  }
  if (!primitive) {
    primitive = standard_primitive(node.child_text("CATEGORY"_tag));  // "UINT8", made by hand
  }
  if (!primitive && reference != nullptr) {
    problems_.error(reference->place(), "the base type " + std::string{reference->text} +
                                            " is in none of the files: read the file that has it as well");
    primitive = Primitive::uint8;
  }
  if (!primitive) {
    problems_.warning_once(Tree::path(&node), node.place(),
                           Tree::path(&node) +
                               " has no base type, so its size is not known; uint8 "
                               "is taken");
    primitive = Primitive::uint8;
  }
  const Node* const method = compu_method(node, frame.implementation);
  const std::string_view category =
      method == nullptr ? std::string_view{} : method->child_text("CATEGORY"_tag);
  if (category == "TEXTTABLE" && is_integer(*primitive)) {
    return build_enumeration(node, *method, *primitive, frame);
  }
  Type number{.kind = Kind::primitive, .primitive = *primitive};
  Notes notes = notes_of(node);
  if (*primitive != Primitive::boolean) {
    add_numbers(node, frame.implementation, number, notes);
  }
  const bool plain_one = standard_primitive(node.name) == *primitive;
  const bool is_element = to_string(node.tag).ends_with("-ELEMENT");
  const bool says_nothing = !number.minimum && !number.maximum && !number.invalid_value && notes == Notes{};
  Value value = unnamed(std::move(number), frame);
  if (is_element || (plain_one && (says_nothing || !is_application(node)))) {
    value.notes = std::move(notes);
    return value;
  }
  return named_alias(node, value, std::move(notes));
}

Value Types::build_string(const Node& node, const Frame& frame) {
  Type type{.kind = Kind::string};
  type.notes = notes_of(node);
  Frame used = frame;
  const Node* text = nullptr;
  for (const Node* const one : {&node, frame.implementation}) {
    const Node* const properties = one == nullptr ? nullptr : properties_of(*one);
    if (text == nullptr && properties != nullptr) {
      text = properties->child("SW-TEXT-PROPS"_tag);
    }
  }
  std::uint32_t character_bytes = 1;
  if (text != nullptr) {
    type.max_size = size_of(text->child("SW-MAX-TEXT-SIZE"_tag), problems_);
    type.fixed_size = text->child_text("ARRAY-SIZE-SEMANTICS"_tag) == "FIXED-SIZE";
    const Node* const base = tree_.follow(text, "BASE-TYPE-REF"_tag);
    const std::string_view encoding = base == nullptr ? last_name(text->child_text("BASE-TYPE-REF"_tag))
                                                      : base->child_text("BASE-TYPE-ENCODING"_tag);
    if (encoding.starts_with("UTF-16") || encoding == "UCS-2") {
      character_bytes = 2;
      if (!used.rules.encoding) {
        used.rules.encoding =
            encoding == "UTF-16LE" ? someip::StringEncoding::utf16le : someip::StringEncoding::utf16be;
      }
    }
  } else if (const Node* const size = node.child("ARRAY-SIZE"_tag); size != nullptr) {
    type.max_size = size_of(size, problems_);
  }
  if (used.rules.string == someip::FieldWidth::none) {
    // The array that implements it has the bytes on the wire, BOM and terminator included.
    std::uint32_t bytes = type.max_size * character_bytes;
    if (frame.implementation != nullptr && frame.implementation->child_text("CATEGORY"_tag) == "ARRAY") {
      const Node* const element =
          frame.implementation->down("SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag);
      const Node* const properties = element == nullptr ? nullptr : properties_of(*element);
      const Node* const size = element == nullptr ? nullptr : element->child("ARRAY-SIZE"_tag);
      auto stored = base_type(tree_.follow(properties, "BASE-TYPE-REF"_tag));
      if (!stored && properties != nullptr) {
        stored = standard_primitive(last_name(properties->child_text("BASE-TYPE-REF"_tag)));
      }
      if (size != nullptr) {
        bytes = size_of(size, problems_) * (stored ? messages::width(*stored) : 1U);
      }
    }
    type.wire.fixed_bytes = bytes;
    type.fixed_size = false;
    type.max_size = 0;
    if (bytes == 0) {
      problems_.error(node.place(), Tree::path(&node) +
                                        " is a string without length field and without a size: "
                                        "SW-MAX-TEXT-SIZE was expected");
    }
  }
  type.fixed_size = false;
  Value value = unnamed(std::move(type), used);
  Notes notes = notes_of(node);
  if (to_string(node.tag).ends_with("-ELEMENT") || plain(node.name) == "string") {
    value.notes = std::move(notes);
    return value;
  }
  return named_alias(node, value, std::move(notes));
}

namespace {

/// Whether the elements of this array, innermost ones included, say how many they are.
[[nodiscard]] const Node* innermost(const Node& array) {
  const Node* node = &array;
  while (const Node* const inner = node->down("SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag)) {
    const std::string_view category = node->child_text("CATEGORY"_tag);
    if (category != "ARRAY" && category != "VECTOR") {
      break;
    }
    node = inner;
  }
  return node;
}

}  // namespace

Value Types::build_array(const Node& node, const Frame& frame) {
  Type type{.kind = Kind::array};
  type.notes = notes_of(node);
  const Node* array = &node;
  if (node.child("DYNAMIC-ARRAY-SIZE-PROFILE"_tag) != nullptr) {
    // Classic's arrays of variable size: a size indicator, which is not on the wire, and the array itself.
    const Node* found = nullptr;
    each_in(&node, "SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag, [&](const Node& element) {
      const std::string_view category = element.child_text("CATEGORY"_tag);
      if (category == "ARRAY" || category == "STRUCTURE" || category == "TYPE_REFERENCE") {
        found = &element;
      }
    });
    if (found == nullptr) {
      problems_.error(node.place(),
                      Tree::path(&node) + " has a DYNAMIC-ARRAY-SIZE-PROFILE and no array in it");
      return primitive(Primitive::uint8, frame);
    }
    array = found;
    if (const Node* const properties = properties_of(*found);
        found->child_text("CATEGORY"_tag) == "TYPE_REFERENCE" && properties != nullptr) {
      const Node* const target = tree_.follow(properties, "IMPLEMENTATION-DATA-TYPE-REF"_tag);
      array = target == nullptr ? found : target;
    }
  }
  const Node* const element = array->down("SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag);
  const Node* const argument = array->down("TEMPLATE-ARGUMENTS"_tag, "CPP-TEMPLATE-ARGUMENT"_tag);
  const Node* sized = array;
  if (element != nullptr && innermost(*array)->child("ARRAY-SIZE"_tag) != nullptr) {
    sized = element;
  } else if (element != nullptr && array->child("ARRAY-SIZE"_tag) == nullptr) {
    sized = element;
  }
  const Node* const size = sized->child("ARRAY-SIZE"_tag);
  type.max_size = size_of(size, problems_);
  const bool is_vector = array->child_text("CATEGORY"_tag) == "VECTOR";
  const std::string_view semantics = sized->child_text("ARRAY-SIZE-SEMANTICS"_tag);
  type.fixed_size = size != nullptr && array == &node && !is_variable_size(*sized) &&
                    (!is_vector || semantics == "FIXED-SIZE");
  if (type.fixed_size && type.max_size == 0) {
    problems_.error(size->place(), Tree::path(&node) + " has 0 elements, and it cannot have more");
  }
  const Frame inner = inside(frame);
  if (element != nullptr) {
    type.element = element_type(*element, inner);
  } else if (argument != nullptr) {
    const Node* const reference = argument->child("TEMPLATE-TYPE-REF"_tag);
    if (reference != nullptr && plain(last_name(reference->text)) == "byte") {
      type.kind = Kind::bytes;
    } else {
      type.element = by_reference(node, reference, inner);
    }
  } else if (properties_of(*array) != nullptr) {
    type.element = build_value(*array, inner);  // the base type stands beside the array
    type.element.notes = {};
  } else {
    type.element = by_reference(node, nullptr, inner);
  }
  type.element.name.clear();
  if (to_string(node.tag).ends_with("-ELEMENT")) {
    return unnamed(std::move(type), frame);
  }
  return named(node, std::move(type), frame);
}

/// The type of an array's element or of a member, which the element itself has or refers to.
Value Types::element_type(const Node& element, const Frame& frame) {
  return build_implementation(element, frame);
}

Value Types::build_map(const Node& node, const Frame& frame) {
  Type type{.kind = Kind::map};
  type.notes = notes_of(node);
  std::vector<Value> parts;
  const Frame inner = inside(frame);
  for (const Tag tag : {"IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag, "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag}) {
    each_in(&node, "SUB-ELEMENTS"_tag, tag,
            [&](const Node& element) { parts.push_back(element_type(element, inner)); });
  }
  if (parts.empty()) {
    each_in(&node, "TEMPLATE-ARGUMENTS"_tag, "CPP-TEMPLATE-ARGUMENT"_tag, [&](const Node& argument) {
      parts.push_back(by_reference(node, argument.child("TEMPLATE-TYPE-REF"_tag), inner));
    });
  }
  if (parts.size() < 2) {
    problems_.error(node.place(), "the map " + Tree::path(&node) + " has " + std::to_string(parts.size()) +
                                      " types, and two were expected: of keys and of values");
    return primitive(Primitive::uint8, frame);
  }
  type.key = std::move(parts[0]);
  type.element = std::move(parts[1]);
  type.key.name.clear();
  type.element.name.clear();
  type.max_size = size_of(node.child("ARRAY-SIZE"_tag), problems_);
  // No category tells that a map has a fixed size: without a length field there are as many as there can be.
  type.fixed_size = type.max_size > 0 && frame.rules.array == someip::FieldWidth::none;
  return named(node, std::move(type), frame);
}

Value Types::member(const Node& element, const Frame& frame, const Node* implementation) {
  Frame inner = inside(frame);
  inner.rules = frame.base;
  inner.implementation = implementation;
  frame.trail->push_back(&element);
  for (const Override& special : frame.context->overrides) {
    if (special.target != &element) {
      continue;
    }
    const bool same_way = std::ranges::all_of(special.through, [&](const Node* on) {
      return std::ranges::find(*frame.trail, on) != frame.trail->end();
    });
    if (same_way) {
      inner.rules = joined(special.rules, inner.rules);
      inner.base.byte_order = inner.rules.byte_order;
      inner.representation = special.representation;
    }
  }
  Value value;
  if (element.tag == "APPLICATION-RECORD-ELEMENT"_tag) {
    const Node* const reference = element.child("TYPE-TREF"_tag);
    const Notes beside = notes_of(element);
    value = by_reference(element, reference, inner);
    if (!beside.description.empty()) {
      value.notes.description = beside.description;
    }
    if (!beside.unit.empty()) {
      value.notes.unit = beside.unit;
    }
  } else {
    const Notes beside = notes_of(element);
    value = build_implementation(element, inner);
    if (value.notes == Notes{}) {
      value.notes = beside;
    }
  }
  frame.trail->pop_back();
  value.name = element.name;
  value.place = element.place();
  value.optional = boolean(element.child_text("IS-OPTIONAL"_tag)).value_or(false);
  value.tag = contexts_.tag(*frame.context, &element);
  if (value.optional && !value.tag) {
    problems_.warning_once(Tree::path(&element), element.place(),
                           Tree::path(&element) +
                               " is optional and has no TLV data id: on the wire it would be "
                               "always there");
    value.optional = false;
  }
  return value;
}

namespace {

/// Files made by hand have two members of one name, which no other language allows.
void tell_apart(std::vector<Value>& members, Problems& problems) {
  std::set<std::string, std::less<>> names;
  for (const Value& member : members) {
    names.insert(member.name);
  }
  std::map<std::string, std::size_t, std::less<>> seen;  // and the number of the last one
  for (Value& member : members) {
    const auto [last, is_new] = seen.emplace(member.name, 1);
    if (is_new) {
      continue;
    }
    std::string name;
    do {
      name = member.name + "_" + std::to_string(++last->second);
    } while (!names.insert(name).second);
    problems.warning(member.place,
                     "there is a member " + member.name + " before: this one is called " + name);
    member.name = std::move(name);
  }
}

}  // namespace

Value Types::build_members(const Node& node, const Frame& frame, Kind kind) {
  if (!may_build_again(node)) {
    return primitive(Primitive::uint8, frame);
  }
  Type type{.kind = kind};
  type.notes = notes_of(node);
  for (const Tag tag : {"IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag, "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag}) {
    each_in(&node, "SUB-ELEMENTS"_tag, tag,
            [&](const Node& element) { type.members.push_back(member(element, frame, nullptr)); });
  }
  if (type.members.empty()) {
    // std::variant has no names for what it may hold.
    Frame inner = inside(frame);
    inner.rules = frame.base;
    each_in(&node, "TEMPLATE-ARGUMENTS"_tag, "CPP-TEMPLATE-ARGUMENT"_tag, [&](const Node& argument) {
      Value value = by_reference(node, argument.child("TEMPLATE-TYPE-REF"_tag), inner);
      value.name = "value" + std::to_string(type.members.size() + 1);
      value.place = argument.place();
      type.members.push_back(std::move(value));
    });
  }
  if (to_string(node.tag).ends_with("-ELEMENT")) {
    // A structure in place has no name of its own: that of the path of its member, which is unique.
    std::string name;
    for (const Node* part = &node; part != nullptr; part = part->parent) {
      if (!part->name.empty()) {
        name = std::string{part->name} + (name.empty() ? "" : "_") + name;
        if (!to_string(part->tag).ends_with("-ELEMENT")) {
          type.scope = Tree::scope(*part);
          break;
        }
      }
    }
    type.name = name;
  }
  tell_apart(type.members, problems_);
  return named(node, std::move(type), frame);
}

Value Types::build_application(const Node& node, const Frame& frame) {
  Frame used = frame;
  if (const Node* const mapped = implementation_of(node); mapped != nullptr) {
    used.implementation = mapped;
  }
  if (node.tag == "APPLICATION-RECORD-DATA-TYPE"_tag) {
    if (!may_build_again(node)) {
      return primitive(Primitive::uint8, frame);
    }
    Type type{.kind = Kind::structure};
    type.notes = notes_of(node);
    // Its implementation has the same members in the same order.
    std::vector<const Node*> stored;
    each_in(used.implementation, "SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag,
            [&](const Node& element) { stored.push_back(&element); });
    each_in(used.implementation, "SUB-ELEMENTS"_tag, "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag,
            [&](const Node& element) { stored.push_back(&element); });
    std::size_t index = 0;
    each_in(&node, "ELEMENTS"_tag, "APPLICATION-RECORD-ELEMENT"_tag, [&](const Node& element) {
      type.members.push_back(member(element, used, index < stored.size() ? stored[index] : nullptr));
      ++index;
    });
    tell_apart(type.members, problems_);
    return named(node, std::move(type), frame);
  }
  if (node.tag == "APPLICATION-ARRAY-DATA-TYPE"_tag) {
    return build_application_array(node, used);
  }
  if (node.tag == "APPLICATION-ASSOC-MAP-DATA-TYPE"_tag) {
    return build_application_map(node, used);
  }
  return node.child_text("CATEGORY"_tag) == "STRING" ? build_string(node, used) : build_value(node, used);
}

Value Types::build_application_array(const Node& node, const Frame& frame) {
  Type type{.kind = Kind::array};
  type.notes = notes_of(node);
  const Node* const element = node.child("ELEMENT"_tag);
  if (element == nullptr) {
    problems_.error(node.place(), "the array " + Tree::path(&node) + " has no ELEMENT");
    return primitive(Primitive::uint8, frame);
  }
  const Node* const size = element->child("MAX-NUMBER-OF-ELEMENTS"_tag);
  type.max_size = size_of(size, problems_);
  type.fixed_size = size != nullptr && !is_variable_size(*element);
  Frame inner = inside(frame);
  if (frame.implementation != nullptr) {
    inner.implementation =
        frame.implementation->down("SUB-ELEMENTS"_tag, "IMPLEMENTATION-DATA-TYPE-ELEMENT"_tag);
  }
  type.element = by_reference(*element, element->child("TYPE-TREF"_tag), inner);
  type.element.name.clear();
  return named(node, std::move(type), frame);
}

Value Types::build_application_map(const Node& node, const Frame& frame) {
  Type type{.kind = Kind::map};
  type.notes = notes_of(node);
  const Frame inner = inside(frame);
  const Node* const key = node.child("KEY"_tag);
  const Node* const value = node.child("VALUE"_tag);
  type.key = by_reference(node, key == nullptr ? nullptr : key->child("TYPE-TREF"_tag), inner);
  type.element = by_reference(node, value == nullptr ? nullptr : value->child("TYPE-TREF"_tag), inner);
  type.key.name.clear();
  type.element.name.clear();
  return named(node, std::move(type), frame);
}

}  // namespace trestle::describe::arxml
