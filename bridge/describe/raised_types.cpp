#include "bridge/describe/raised_types.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace trestle::describe {
namespace {

bool is_alike(const Value& a, const Value& b) {
  return a.name == b.name && a.type == b.type && a.wire == b.wire && a.tag == b.tag &&
         a.optional == b.optional && a.default_value == b.default_value;
}

bool is_alike(const std::vector<Enumerator>& a, const std::vector<Enumerator>& b) {
  return std::ranges::equal(
      a, b, [](const Enumerator& x, const Enumerator& y) { return x.name == y.name && x.value == y.value; });
}

/// Whether the two are one type: of one message, or both without a name, and with the same bytes.
bool is_alike(const Type& a, const Type& b) {
  return a.kind == b.kind && a.ros_name == b.ros_name && a.name == b.name && a.primitive == b.primitive &&
         a.wire == b.wire && a.min_size == b.min_size && a.max_size == b.max_size &&
         a.fixed_size == b.fixed_size && a.scope == b.scope && is_alike(a.enumerators, b.enumerators) &&
         a.invalid_value == b.invalid_value && a.minimum == b.minimum && a.maximum == b.maximum &&
         a.selectors == b.selectors && a.base == b.base && is_alike(a.element, b.element) &&
         is_alike(a.key, b.key) &&
         std::ranges::equal(a.members, b.members,
                            [](const Value& x, const Value& y) { return is_alike(x, y); });
}

/// Of what is_alike() compares as much as tells types apart.
std::size_t hash_of(const Type& type) {
  std::size_t hash = 0;
  const auto mix = [&](std::size_t value) { hash = (hash ^ value) * 0x9e37'79b9'7f4a'7c15U + (hash >> 29U); };
  const auto text = [&](const std::string& value) { mix(std::hash<std::string>{}(value)); };
  const auto use = [&](const Value& value) {
    text(value.name);
    mix(static_cast<std::size_t>(value.type));
    mix(static_cast<std::size_t>(value.wire.length) << 8U | value.wire.bits);
  };
  mix(static_cast<std::size_t>(type.kind) << 8U | static_cast<std::size_t>(type.primitive));
  text(type.ros_name);
  text(type.name);
  text(type.scope);
  mix(type.min_size);
  mix(type.max_size);
  mix(type.wire.fixed_bytes);
  use(type.element);
  use(type.key);
  for (const Value& member : type.members) {
    use(member);
  }
  for (const Enumerator& one : type.enumerators) {
    text(one.name);
    mix(static_cast<std::size_t>(one.value));
  }
  for (const std::uint32_t selector : type.selectors) {
    mix(selector);
  }
  return hash;
}

/// Names have no line ends.
std::string joined(const std::string& scope, const std::string& name) {
  return scope + "\n" + name;
}

std::string name_key(const Type& type) {
  return joined(type.scope, type.name) + "\n" +
         (type.ros_name.empty() ? std::string{to_string(type.kind)} : "/" + type.ros_name);
}

std::string text_of(const std::vector<Enumerator>& enumerators) {
  std::string text;
  for (const Enumerator& one : enumerators) {
    text += one.name + "=" + std::to_string(one.value) + "\n";
  }
  return text;
}

bool is_numbered(const Type& type) {
  return !type.name.empty() &&
         (type.kind == Kind::enumeration || type.kind == Kind::alias || type.kind == Kind::array);
}

}  // namespace

void RaisedTypes::catch_up() {
  for (; types_known_ < model_.types.size(); ++types_known_) {
    const Type& type = model_.types[types_known_];
    const TypeIndex index{static_cast<std::uint32_t>(types_known_)};
    by_content_[hash_of(type)].push_back(index);
    if (!type.name.empty()) {
      by_name_.try_emplace(name_key(type), index);
    }
    if (is_numbered(type)) {
      named_.try_emplace(name_key(type), index);
    }
  }
  for (; constants_known_ < model_.constants.size(); ++constants_known_) {
    constant_scopes_.insert(model_.constants[constants_known_].scope);
  }
}

TypeIndex RaisedTypes::add_once(Type type) {
  catch_up();
  if (const auto found = by_content_.find(hash_of(type)); found != by_content_.end()) {
    for (const TypeIndex index : found->second) {
      ++comparisons_;
      if (is_alike(model_.at(index), type)) {
        return index;
      }
    }
  }
  if (!type.name.empty()) {
    // The same message, map or enumeration with other rules.
    if (const auto first = by_name_.find(name_key(type)); first != by_name_.end()) {
      type.variant_of = first->second;
    }
  }
  return model_.add(std::move(type));
}

std::string RaisedTypes::content_of(TypeIndex index, std::size_t depth) const {
  if (static_cast<std::size_t>(index) >= model_.types.size() || depth > max_type_nesting) {
    return {};
  }
  const Type& type = model_.at(index);
  const std::string kind = to_string(type.kind);
  if (!type.name.empty()) {
    return kind + "\n" + joined(type.scope, type.name);
  }
  std::string text = kind + " " + messages::to_string(type.primitive) + " " + type.ros_name + " " +
                     std::to_string(type.max_size) + (type.fixed_size ? " fixed" : "");
  for (const Value* part : {&type.key, &type.element}) {
    text += part->type == no_type ? "" : "\n" + content_of(part->type, depth + 1);
  }
  return text;
}

/// What tells two of a name apart.
std::string RaisedTypes::content_of(const Type& type) const {
  return type.kind == Kind::enumeration ? text_of(type.enumerators)
                                        : std::to_string(type.max_size) + (type.fixed_size ? " fixed" : "") +
                                              "\n" + content_of(type.element.type, 0);
}

std::string RaisedTypes::free_name(const Type& type) {
  catch_up();
  Type numbered{.kind = type.kind, .scope = type.scope};
  const auto set_number = [&](unsigned number) {
    numbered.name = number == 1 ? type.name : type.name + std::to_string(number);
  };
  Numbered& of_name = numbered_[name_key(type)];
  const std::string wanted = content_of(type);
  if (const auto known = of_name.numbers.find(wanted); known != of_name.numbers.end()) {
    set_number(known->second);
    return numbered.name;
  }
  while (true) {
    const unsigned number = of_name.next++;
    set_number(number);
    ++comparisons_;
    const auto taken = named_.find(name_key(numbered));
    const std::string there = taken == named_.end() ? wanted : content_of(model_.at(taken->second));
    of_name.numbers.try_emplace(there, number);
    if (there == wanted) {
      return numbered.name;
    }
  }
}

bool RaisedTypes::has_constants(std::string_view scope) {
  catch_up();
  return constant_scopes_.contains(scope);
}

}  // namespace trestle::describe
