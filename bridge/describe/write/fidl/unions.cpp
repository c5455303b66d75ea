#include "bridge/describe/write/fidl/unions.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/write/fidl/plan.hpp"

namespace trestle::describe::fidl_writing {
namespace {

constexpr const char* only_field = "value";

/// By what Franca tells the types of members apart: their names without the package, behind typedefs.
std::string type_name(const Model& model, const Plan& plan, TypeIndex index) {
  if (plan.is_inline(plan.root(index))) {
    return type_name(model, plan, model.at(index).element.type) + "[]";
  }
  const Type& type = resolved(model, index);
  const Declared* const declared = plan.declared(behind_aliases(model, index));
  if (declared != nullptr && type.kind != Kind::primitive && type.kind != Kind::string &&
      type.kind != Kind::bytes) {
    return declared->name;
  }
  const std::string name = basic_name(type);
  return name.substr(0, name.find('('));
}

/// A member of a union, by its place among those that the union does not inherit.
struct Member {
  std::size_t type;
  std::size_t member;
};

std::vector<Member> doubled_members(const Model& model) {
  std::vector<Member> doubled;
  if (std::ranges::none_of(model.types, [](const Type& type) { return type.kind == Kind::choice; })) {
    return doubled;
  }
  std::vector<NotCarried> told_later;
  const Plan plan{model, told_later};
  for (std::size_t i = 0; i < model.types.size(); ++i) {
    const Type& type = model.types[i];
    if (type.kind != Kind::choice || type.variant_of != no_type) {
      continue;
    }
    std::set<std::string> names;
    if (type.base != no_type) {
      for (const Value& member : all_members(model, resolved(model, type.base))) {
        names.insert(type_name(model, plan, member.type));
      }
    }
    for (std::size_t at = 0; at < type.members.size(); ++at) {
      const TypeIndex of_member = type.members[at].type;
      if (!plan.is_left_out(of_member) && !names.insert(type_name(model, plan, of_member)).second) {
        doubled.push_back({i, at});
      }
    }
  }
  return doubled;
}

/// Puts a struct around a member.
/// @param around  what it is a variant of; no_type: it is the first
TypeIndex wrap(Model& model, std::size_t type, std::size_t at, TypeIndex around) {
  const Type& owner = model.types[type];
  const Value& member = owner.members[at];
  Type wrapper{.kind = Kind::structure,
               .name = owner.name.empty() ? member.name : owner.name + "_" + member.name,
               .scope = owner.scope,
               .variant_of = around,
               .wire = default_wire(Kind::structure),
               .place = member.place};
  wrapper.members.push_back({.name = only_field, .type = member.type, .wire = member.wire});
  wrapper.notes.others["@details"] = std::string{"wraps: "} + only_field;
  const TypeIndex added = model.add(std::move(wrapper));
  Value& wrapped = model.types[type].members[at];
  wrapped.type = added;
  wrapped.wire = default_wire(Kind::structure);
  return added;
}

}  // namespace

std::optional<Model> with_distinct_members(const Model& model) {
  const std::vector<Member> doubled = doubled_members(model);
  if (doubled.empty()) {
    return std::nullopt;
  }
  Model made = model;
  std::vector<std::vector<std::size_t>> variants(model.types.size());
  for (std::size_t i = 0; i < model.types.size(); ++i) {
    if (const TypeIndex of = model.types[i].variant_of; of != no_type) {
      variants[static_cast<std::size_t>(of)].push_back(i);
    }
  }
  for (const auto& [type, at] : doubled) {
    const TypeIndex first = wrap(made, type, at, no_type);
    for (const std::size_t variant : variants[type]) {
      if (at >= made.types[variant].members.size()) {
        continue;
      }
      Value& member = made.types[variant].members[at];
      const Value& declared = made.at(first).members.front();
      if (member.type == declared.type && member.wire == declared.wire) {
        member.type = first;
        member.wire = default_wire(Kind::structure);
      } else {
        (void)wrap(made, variant, at, first);
      }
    }
  }
  return made;
}

}  // namespace trestle::describe::fidl_writing
