// Structures, unions and enumerations of a FIDL file.
#include "bridge/describe/read/fidl/types.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

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

}  // namespace

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
          if (copies_.take(tree.name.place, tree_of_base->fields.size())) {
            for (const Variable& field : tree_of_base->fields) {
              names.insert(field.name.text);
            }
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
                      fmt::format("the field {} is declared twice", documents::quote(field.name.text)));
      continue;
    }
    Layers of_field;
    for (const Layer& layer : naming) {
      std::ranges::copy(layers_of(layer.node->child("", field.name.text), user),
                        std::back_inserter(of_field));
    }
    // What a field itself says is stronger than overwrites that come with it.
    Value member = tree.kind == Kind::choice
                       ? use_in_union(field, declared.scope, of_field, declared.version, deep + 1)
                       : use(field, declared.scope, of_field, declared.version, deep + 1);
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

/// The type of a union's member may stand in a struct of its own: write/fidl/unions.hpp.
Value Types::use_in_union(const Variable& field, const Scope& scope, const Layers& layers, int version,
                          int deep) {
  const Declared* const type =
      field.type.basic || field.type.array ? nullptr : names_.type(field.type.name, scope);
  if (type == nullptr || !type->tree->wraps) {
    return use(field, scope, layers, version, deep);
  }
  const Variable& inner = type->tree->fields.front();
  Layers of_inner;
  const auto add = [&](const Node* node) {
    const Node* const child = node == nullptr ? nullptr : node->child("", inner.name.text);
    std::ranges::copy(layers_of(child, User::struct_field), std::back_inserter(of_inner));
  };
  for (const Layer& layer : layers) {
    add(layer.node);
  }
  add(type->node);
  Variable member = field;
  member.type = inner.type;
  return use(member, type->scope, of_inner, type->version, deep);
}

void Types::build_enumeration(Type& type, Declared& declared, const Layers& layers, int deep) {
  const TypeTree& tree = *declared.tree;
  if (tree.enumerators.empty()) {
    findings_.warning(declared.tree->name.place, "an enumeration without enumerators: Franca refuses it");
  }
  const std::int64_t usual_bytes = declared.version == 1 ? 4 : 1;
  std::int64_t bytes = number(layers, "EnumWidth", 0, 8).value_or(usual_bytes);
  if (bytes == 0) {
    const unsigned bits = type.wire.bits;
    bytes = bits == 0 ? usual_bytes : bits <= 8 ? 1 : bits <= 16 ? 2 : bits <= 32 ? 4 : 8;
    findings_.warning(
        find(layers, "EnumWidth")->values.front().place,
        fmt::format("SomeIpEnumWidth is 0; expected 1, 2, 4 or 8 bytes, of which {} is taken", bytes));
  }
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
          if (copies_.take(tree.name.place, tree_of_base->enumerators.size())) {
            for (const EnumeratorTree& enumerator : tree_of_base->enumerators) {
              names.insert(enumerator.name.text);
            }
          }
        }
      }
    }
  }
  for (std::size_t i = 0; i < tree.enumerators.size(); ++i) {
    const EnumeratorTree& one = tree.enumerators[i];
    if (!names.insert(one.name.text).second) {
      findings_.error(one.name.place,
                      fmt::format("the enumerator {} is declared twice", documents::quote(one.name.text)));
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
  const auto fits = [&](const Enumerator& one) {
    const auto bits = static_cast<unsigned>(bytes) * 8 - (needs_sign ? 1 : 0);
    const std::uint64_t most_bits = static_cast<std::uint64_t>(one.value < 0 ? ~one.value : one.value);
    return bits >= 64 || most_bits >> bits == 0;
  };
  // Where no file says how anything is carried, a width that does not do cannot be meant.
  if (!names_.has_deployments() && !std::ranges::all_of(type.enumerators, fits)) {
    while (bytes < 8 && !std::ranges::all_of(type.enumerators, fits)) {
      bytes *= 2;
    }
    findings_.warning(tree.name.place,
                      fmt::format("{} has no SomeIpEnumWidth, and values that one byte has no room for: {} "
                                  "bytes are taken",
                                  documents::quote(tree.name.text), bytes));
  }
  type.primitive = needs_sign ? signed_of(bytes) : unsigned_of(bytes);
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  type.invalid_value = number(layers, "EnumInvalidValue", least, most);
  if (const Setting* kept = declared.node == nullptr ? nullptr : declared.node->setting("ErrorType")) {
    type.notes.others["ErrorType"] = written(*kept);
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

}  // namespace trestle::describe::fidl
