#include "bridge/describe/compare_types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>

#include "bridge/describe/compare_pairs.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/units.hpp"

namespace trestle::describe::comparing {
namespace {

/// How many elements a change of a type names that have the type, too.
constexpr std::size_t max_listed_uses = 20;

/// "8 bits", or "int8" where only the sign differs.
std::string width(const Type& type, const Type& other) {
  const std::size_t bytes = messages::width(type.primitive);
  return bytes == messages::width(other.primitive) ? std::string{messages::to_string(type.primitive)}
                                                   : fmt::format("{} bits", 8 * bytes);
}

/// An alternative with the number that announces it.
struct Alternative {
  Value value;
  std::uint32_t selector;
};
std::vector<Alternative> alternatives_of(const Model& model, const Type& type) {
  std::vector<Alternative> all;
  for (Value& value : all_members(model, type)) {
    const std::size_t number = all.size();
    all.push_back({std::move(value), number < type.selectors.size()
                                         ? type.selectors[number]
                                         : static_cast<std::uint32_t>(number + 1)});
  }
  return all;
}

std::map<std::string_view, std::size_t> places_of(const std::vector<Value>& values) {
  std::map<std::string_view, std::size_t> places;
  for (std::size_t i = 0; i < values.size(); ++i) {
    places.try_emplace(values[i].name, i);
  }
  return places;
}

// Whether a name that stands in one list has another place in the other one.
bool stands_elsewhere(std::string_view name, const std::map<std::string_view, std::size_t>& places,
                      const std::vector<Value>& others) {
  const auto place = places.find(name);
  return place != places.end() && (place->second >= others.size() || others[place->second].name != name);
}

}  // namespace

void PayloadComparison::payloads(const std::string& element, const Payload& old, const Payload& now,
                                 Place old_place, Place new_place) {
  if (!old.known || !now.known) {
    return;
  }
  const auto word = [](std::endian order) { return std::string{word_of(order)}; };
  const auto alignment = [](const Payload& payload) {
    return payload.alignment <= 1 ? std::string{"none"} : fmt::format("{} bytes", payload.alignment);
  };
  log_.differs("byte-order", element, word(old.byte_order), word(now.byte_order), old_place, new_place);
  log_.differs("alignment", element, alignment(old), alignment(now), old_place, new_place);
  if (has_tagged_lengths(before_, old) && has_tagged_lengths(after_, now)) {
    const auto tagged_length = [](const Payload& payload) {
      return payload.smallest_tagged_length
                 ? std::string{"length fields before tagged members as small as possible"}
                 : fmt::format("length fields before tagged members {} bits",
                               8 * bytes(payload.tagged_length));
    };
    log_.differs("layout", element, tagged_length(old), tagged_length(now), old_place, new_place);
  }
  old_side_ = {before_, old, element};
  new_side_ = {after_, now, element};
  values(element, old.values, now.values, false, old_place, new_place);
  old_side_ = Side{before_};
  new_side_ = Side{after_};
}

void PayloadComparison::values(const std::string& element, const std::vector<Value>& old,
                               const std::vector<Value>& now, bool behind_length, Place old_place,
                               Place new_place) {
  if (std::ranges::any_of(old, [](const Value& value) { return value.tag.has_value(); })) {
    tagged(element, old, now, new_place);
    return;
  }
  const std::size_t common = std::min(old.size(), now.size());
  const std::map<std::string_view, std::size_t> old_places = places_of(old);
  const std::map<std::string_view, std::size_t> new_places = places_of(now);
  for (std::size_t i = 0; i < common; ++i) {
    const std::string name = path_of(element, now[i].name);
    const bool has_moved =
        stands_elsewhere(now[i].name, old_places, now) || stands_elsewhere(old[i].name, new_places, old);
    log_.renamed(has_moved ? "value-moved" : "value-renamed", name, old[i].name, now[i].name, old[i].place,
                 now[i].place);
    if (old[i].tag != now[i].tag) {
      log_.add("member-tag", name, text_of(old[i].tag), text_of(now[i].tag), old[i].place, now[i].place);
    }
    uses(name, old[i], now[i]);
  }
  appended(element, old, now, behind_length, old_place);
  for (std::size_t i = common; i < old.size(); ++i) {
    const std::string name = path_of(element, old[i].name);
    log_.add("value-removed", name, old_side_.bytes_of(name, old[i]), {}, old[i].place, new_place);
  }
}

void PayloadComparison::appended(const std::string& element, const std::vector<Value>& old,
                                 const std::vector<Value>& now, bool behind_length, Place old_place) {
  for (std::size_t i = old.size(); i < now.size(); ++i) {
    const std::string name = path_of(element, now[i].name);
    log_.add(behind_length ? "value-appended-behind-length" : "value-appended", name, {},
             new_side_.bytes_of(name, now[i]), old_place, now[i].place);
  }
}

void PayloadComparison::tagged(const std::string& element, const std::vector<Value>& old,
                               const std::vector<Value>& now, Place new_place) {
  const Pairs pairs{old, now, [](const Value& value) { return value.name; },
                    [](const Value& value) { return value.tag; }};
  for (const auto& [before, after] : pairs.both) {
    const std::string name = path_of(element, after->name);
    log_.renamed("value-renamed", name, before->name, after->name, before->place, after->place);
    log_.differs("member-tag", name, text_of(before->tag), text_of(after->tag), before->place, after->place);
    if (before->optional != after->optional) {
      const auto word = [](bool optional) { return std::string{optional ? "optional" : "always there"}; };
      log_.add("member-optional", name, word(before->optional), word(after->optional), before->place,
               after->place);
    }
    uses(name, *before, *after);
  }
  for (const Value* value : pairs.added) {
    const std::string name = path_of(element, value->name);
    log_.add(value->optional ? "member-optional-added" : "value-appended", name, {},
             new_side_.bytes_of(name, *value), {}, value->place);
  }
  for (const Value* value : pairs.removed) {
    const std::string name = path_of(element, value->name);
    log_.add(value->optional ? "member-optional-removed" : "value-removed", name,
             old_side_.bytes_of(name, *value), {}, value->place, new_place);
  }
}

void PayloadComparison::uses(const std::string& element, const Value& old, const Value& now) {
  if (uses_ == max_compared_uses) {
    log_.add("not-compared", element, {}, {}, old.place, now.place);
  }
  if (++uses_ > max_compared_uses) {
    return;
  }
  const Type& before = resolved(before_, old.type);
  const Type& after = resolved(after_, now.type);
  if (before.kind == after.kind || (is_bytes(before_, before) && is_bytes(after_, after))) {
    const std::string was = rules_of(before.kind, old.wire);
    const std::string is = rules_of(after.kind, now.wire);
    log_.differs("layout", element, was, is, old.place, now.place);
  }
  said_of_use(element, old, now);
  // Tagged members have a length field, too.
  const bool behind_length = (old.tag && now.tag) || (old.wire.length != someip::FieldWidth::none &&
                                                      now.wire.length != someip::FieldWidth::none);
  const std::endian old_order = old_side_.enter(old);
  const std::endian new_order = new_side_.enter(now);
  types(element, old, now, behind_length);
  old_side_.leave(old_order);
  new_side_.leave(new_order);
}

void PayloadComparison::said_of_use(const std::string& element, const Value& old, const Value& now) {
  const auto optional = [&](std::string_view rule, const std::string& before, const std::string& after) {
    if (is_strict_ || (!before.empty() && !after.empty())) {
      log_.differs(rule, element, before, after, old.place, now.place);
    }
  };
  optional("value-unit", measured_as_whole_in(before_, old), measured_as_whole_in(after_, now));
  optional("value-default", old.default_value, now.default_value);
}

void PayloadComparison::types(const std::string& element, const Value& old_use, const Value& new_use,
                              bool behind_length) {
  const TypeIndex old_index = old_use.type;
  const TypeIndex new_index = new_use.type;
  const Place& old_place = old_use.place;
  const Place& new_place = new_use.place;
  if (!is_type(before_, old_index) || !is_type(after_, new_index)) {
    log_.differs("type-changed", element, name_of(before_, old_index), name_of(after_, new_index), old_place,
                 new_place);
    return;
  }
  const Type& old = resolved(before_, old_index);
  const Type& now = resolved(after_, new_index);
  const bool both_numbers = is_number(old) && is_number(now);
  if ((both_numbers && old.kind != now.kind && on_wire(old.primitive) == on_wire(now.primitive)) ||
      (old.kind != now.kind && is_bytes(before_, old) && is_bytes(after_, now))) {
    log_.add("type-form", element, old_side_.bytes_of(element, old_use), new_side_.bytes_of(element, new_use),
             old_place, new_place);
    sizes(element, old, now, old_place, new_place);
    return;
  }
  if (old.kind != now.kind ||
      (old.kind == Kind::primitive && on_wire(old.primitive) != on_wire(now.primitive))) {
    log_.add("type-changed", element, old_side_.bytes_of(element, old_use),
             new_side_.bytes_of(element, new_use), old_place, new_place);
    return;
  }
  log_.differs("type-renamed", element, old.name, now.name, old_place, new_place);
  // Types that contain themselves, and types that are used often, are told once, with the elements that have
  // them, too; but what is appended hurts more where no length field is before it.
  const auto [at, is_new] = seen_.try_emplace(std::pair{old_index, new_index},
                                              Seen{.is_behind_length = behind_length, .element = element});
  Seen& seen = at->second;
  if (!is_new) {
    tell_again(seen, element);
    if (std::exchange(seen.is_behind_length, seen.is_behind_length && behind_length) && !behind_length &&
        now.kind == Kind::structure) {
      appended(element, all_members(before_, old), all_members(after_, now), false, old_place);
    }
    return;
  }
  // Two that contain themselves in circles of different lengths are a longer circle together.
  if (open_.size() > max_type_nesting) {
    log_.add("not-compared", element, {}, {}, old_place, new_place);
    return;
  }
  const std::size_t begin = log_.size();
  open_.push_back(&seen);
  inside(element, old, now, behind_length, old_place, new_place);
  open_.pop_back();
  for (std::size_t change = begin; change < log_.size(); ++change) {
    if (!keep(seen, change, log_.element_of(change))) {
      break;
    }
  }
  seen.is_done = true;
}

bool PayloadComparison::keep(Seen& seen, std::size_t change, const std::string& element) {
  constexpr std::size_t most = 50;
  if (seen.changes.size() >= most) {
    return false;
  }
  if (element.starts_with(seen.element)) {
    seen.changes.emplace_back(change, element.substr(seen.element.size()));
  }
  return true;
}

void PayloadComparison::tell_again(Seen& seen, const std::string& element) {
  if (!seen.is_done || seen.changes.empty() || seen.uses == max_listed_uses) {
    return;
  }
  ++seen.uses;
  for (const auto& [change, rest] : seen.changes) {
    const std::string again = element + rest;
    log_.also(change, again);
    for (Seen* const around : open_) {
      keep(*around, change, again);
    }
  }
}

void PayloadComparison::inside(const std::string& element, const Type& old, const Type& now,
                               bool behind_length, Place old_place, Place new_place) {
  sizes(element, old, now, old_place, new_place);
  limits(element, old, now, old_place, new_place);
  switch (now.kind) {
    case Kind::structure:
      values(element, all_members(before_, old), all_members(after_, now), behind_length, old_place,
             new_place);
      break;
    case Kind::choice:
      alternatives(element, old, now, old_place, new_place);
      break;
    case Kind::enumeration:
      log_.differs("layout", element, width(old, now), width(now, old), old_place, new_place);
      enumerators(element, old, now);
      break;
    case Kind::map:
      uses(element + ".key", old.key, now.key);
      uses(element + "[]", old.element, now.element);
      break;
    case Kind::array:
      uses(element + "[]", old.element, now.element);
      break;
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
    case Kind::alias:
      break;
  }
}

void PayloadComparison::sizes(const std::string& element, const Type& old, const Type& now, Place old_place,
                              Place new_place) {
  if (old.fixed_size || now.fixed_size) {
    const auto word = [](const Type& type) {
      return type.fixed_size ? fmt::format("always {}", type.max_size) : std::string{"as many as come"};
    };
    log_.differs("size-fixed", element, word(old), word(now), old_place, new_place);
    return;
  }
  if (old.max_size != now.max_size) {
    const auto word = [](std::uint32_t most) {
      return most == 0 ? std::string{"no limit"} : fmt::format("at most {}", most);
    };
    const bool raised = now.max_size == 0 || (old.max_size != 0 && now.max_size > old.max_size);
    log_.add(raised ? "size-raised" : "size-lowered", element, word(old.max_size), word(now.max_size),
             old_place, new_place);
  }
}

void PayloadComparison::limits(const std::string& element, const Type& old, const Type& now, Place old_place,
                               Place new_place) {
  const auto optional = [&](std::string_view rule, const std::string& before, const std::string& after) {
    if (is_strict_ || (!before.empty() && !after.empty())) {
      log_.differs(rule, element, before, after, old_place, new_place);
    }
  };
  const auto range = [](const Type& type) {
    const auto word = [](const std::optional<std::int64_t>& limit) {
      return limit ? fmt::to_string(*limit) : std::string{};
    };
    return type.minimum || type.maximum ? fmt::format("from {} to {}", word(type.minimum), word(type.maximum))
                                        : std::string{};
  };
  const auto invalid = [](const Type& type) {
    return type.invalid_value ? fmt::to_string(*type.invalid_value) : std::string{};
  };
  optional("value-range", range(old), range(now));
  optional("value-invalid", invalid(old), invalid(now));
}

void PayloadComparison::enumerators(const std::string& element, const Type& old, const Type& now) {
  const std::vector<Enumerator> before = all_enumerators(before_, old);
  const std::vector<Enumerator> after = all_enumerators(after_, now);
  const Pairs pairs{before, after, [](const Enumerator& one) { return one.name; },
                    [](const Enumerator& one) { return std::optional{one.value}; }};
  for (const auto& [was, is] : pairs.both) {
    log_.differs("enumerator-renamed", path_of(element, is->name), was->name, is->name, was->place,
                 is->place);
    log_.differs("enumerator-value", path_of(element, is->name), fmt::to_string(was->value),
                 fmt::to_string(is->value), was->place, is->place);
  }
  for (const Enumerator* one : pairs.added) {
    log_.add("enumerator-added", path_of(element, one->name), {}, fmt::to_string(one->value), {}, one->place);
  }
  for (const Enumerator* one : pairs.removed) {
    log_.add("enumerator-removed", path_of(element, one->name), fmt::to_string(one->value), {}, one->place,
             {});
  }
}

void PayloadComparison::alternatives(const std::string& element, const Type& old, const Type& now,
                                     Place old_place, Place new_place) {
  const std::vector<Alternative> before = alternatives_of(before_, old);
  const std::vector<Alternative> after = alternatives_of(after_, now);
  const Pairs pairs{before, after, [](const Alternative& one) { return one.value.name; },
                    [](const Alternative& one) { return std::optional{one.selector}; }};
  for (const auto& [was, is] : pairs.both) {
    const std::string name = path_of(element, is->value.name);
    log_.renamed("value-renamed", name, was->value.name, is->value.name, was->value.place, is->value.place);
    log_.differs("alternative-selector", name, fmt::to_string(was->selector), fmt::to_string(is->selector),
                 was->value.place, is->value.place);
    uses(name, was->value, is->value);
  }
  for (const Alternative* one : pairs.added) {
    log_.add("alternative-added", path_of(element, one->value.name), {}, fmt::to_string(one->selector),
             old_place, one->value.place);
  }
  for (const Alternative* one : pairs.removed) {
    log_.add("alternative-removed", path_of(element, one->value.name), fmt::to_string(one->selector), {},
             one->value.place, new_place);
  }
}

}  // namespace trestle::describe::comparing
