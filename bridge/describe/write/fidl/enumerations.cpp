#include "bridge/describe/write/fidl/enumerations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>

#include "bridge/describe/write/fidl/plan.hpp"

namespace trestle::describe::fidl_writing {
namespace {

bool declares_none(const Type& type) {
  return type.kind == Kind::enumeration && type.enumerators.empty();
}

/// An argument before the others.
Value argument_of_error(const Method& method, const Type& error) {
  std::string name = "error";
  const auto is_taken = [&](const Value& value) { return value.name == name; };
  while (std::ranges::any_of(method.response.values, is_taken) ||
         std::ranges::any_of(method.request.values, is_taken)) {
    name += "_";
  }
  return {.name = std::move(name), .type = method.error, .wire = error.wire, .place = method.place};
}

}  // namespace

std::optional<Model> with_enumerators(const Model& model, std::vector<NotCarried>& lost) {
  if (std::ranges::none_of(model.types, declares_none)) {
    return std::nullopt;
  }
  Model made = model;
  std::set<const Type*> integers;  // of the model that is written
  for (std::size_t at = 0; at < model.types.size(); ++at) {
    const Type& before = model.types[at];
    Type& type = made.types[at];
    if (!declares_none(before)) {
      continue;
    }
    const std::string name = full_name(before.scope, before.name);
    const bool is_told = before.variant_of == no_type && !before.name.empty();
    type.enumerators = all_enumerators(model, before);
    type.base = no_type;
    if (!type.enumerators.empty()) {
      if (is_told) {
        lost.push_back(
            {name,
             "that it extends another enumeration: it has no enumerators of its own, so those of the "
             "other one are copied in",
             before.place});
      }
      continue;
    }
    type.kind = Kind::primitive;
    type.backing.reset();
    integers.insert(&type);
    if (is_told) {
      lost.push_back({name,
                      fmt::format("that it is an enumeration: it has no enumerators, so it is written as {}",
                                  basic_name(type)),
                      before.place});
    }
  }
  for (Type& type : made.types) {
    // What extends none of the others' enumerators extends nothing.
    if (type.kind == Kind::enumeration && type.base != no_type &&
        integers.contains(&resolved(made, type.base))) {
      type.base = no_type;
    }
  }
  for (Service& service : made.services) {
    for (Method& method : service.methods) {
      if (method.error == no_type || !integers.contains(&resolved(made, method.error))) {
        continue;
      }
      method.response.values.insert(method.response.values.begin(),
                                    argument_of_error(method, resolved(made, method.error)));
      method.error = no_type;
      lost.push_back({full_name(service.scope, service.name) + "." + member_key(method.name, method.selector),
                      fmt::format("that its error is one: the enumeration has no enumerators, so it is the "
                                  "argument '{}'",
                                  method.response.values.front().name),
                      method.place});
    }
  }
  return made;
}

}  // namespace trestle::describe::fidl_writing
