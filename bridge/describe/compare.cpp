#include "bridge/describe/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <type_traits>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/ros_names.hpp"

namespace trestle::describe {
namespace {

using enum Impact;

constexpr std::array rules{
    ChangeRule{"service-added", none, none, "a new service"},
    ChangeRule{"service-removed", breaking, breaking, "clients no longer find it"},
    ChangeRule{"service-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"service-id", breaking, none, "old clients look for another service"},
    ChangeRule{"service-major", breaking, breaking, "clients ask for the other major version"},
    ChangeRule{"service-minor", compatible, none,
               "clients that ask for a higher minor version do not find it"},
    ChangeRule{"method-added", compatible, none, "old servers answer E_UNKNOWN_METHOD"},
    ChangeRule{"method-removed", breaking, breaking, "old clients get E_UNKNOWN_METHOD"},
    ChangeRule{"method-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"method-id", breaking, none, "old clients call another method, or none"},
    ChangeRule{"method-fire-and-forget", breaking, breaking,
               "one side waits for an answer that does not come"},
    ChangeRule{"event-added", compatible, none, "old clients ignore it; old servers do not send it"},
    ChangeRule{"event-removed", breaking, breaking, "old clients wait for it"},
    ChangeRule{"event-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"event-id", breaking, none, "old clients do not know the id"},
    ChangeRule{"event-eventgroups", breaking, none, "a subscription brings other events"},
    ChangeRule{"field-added", compatible, none, "old servers do not have it"},
    ChangeRule{"field-removed", breaking, breaking, "old clients use it"},
    ChangeRule{"field-renamed", none, breaking, "the same ids under another name"},
    ChangeRule{"field-id", breaking, none, "old clients use the other id"},
    ChangeRule{"field-access-added", compatible, none,
               "a getter, setter or notifier that old servers do not have"},
    ChangeRule{"field-access-removed", breaking, breaking,
               "a getter, setter or notifier that old clients use"},
    ChangeRule{"transport", breaking, none, "old clients use the other transport"},
    ChangeRule{"segmentation", compatible, none, "other segments or pauses: receivers cope"},
    ChangeRule{"byte-order", breaking, none, "numbers are read the wrong way round"},
    ChangeRule{"alignment", breaking, none, "what follows stands elsewhere"},
    ChangeRule{"protection", breaking, none, "the other side's check fails"},
    ChangeRule{"value-renamed", none, breaking, "another name at the same place"},
    ChangeRule{"value-appended", breaking, breaking,
               "at the end: old receivers skip it, new receivers miss it in old messages"},
    ChangeRule{
        "value-appended-behind-length", compatible, breaking,
        "at the end of a structure with a length field: old receivers skip it; new ones use a default"},
    ChangeRule{"value-removed", breaking, breaking, "what follows stands elsewhere, or the end is missing"},
    ChangeRule{"member-optional-added", compatible, none, "a tagged optional member: old receivers skip it"},
    ChangeRule{"member-optional-removed", compatible, breaking, "new receivers skip it"},
    ChangeRule{"member-tag", breaking, none,
               "the receiver takes it for another member, or for an unknown one"},
    ChangeRule{"member-optional", breaking, breaking, "one side cannot do without it"},
    ChangeRule{"type-changed", breaking, breaking, "other bytes, and another type in code"},
    ChangeRule{"type-form", none, breaking,
               "the same bytes, and another type in code: a number and an enumeration, bytes and an array"},
    ChangeRule{"type-renamed", none, breaking, "the same bytes under another name"},
    ChangeRule{"layout", breaking, none, "length field, encoding or width differ"},
    ChangeRule{"size-fixed", breaking, breaking, "another number of elements"},
    ChangeRule{"size-raised", breaking, none, "old receivers may refuse what is longer"},
    ChangeRule{"size-lowered", compatible, breaking, "new receivers may refuse what old senders send"},
    ChangeRule{"enumerator-added", compatible, none, "old receivers do not know the value"},
    ChangeRule{"enumerator-removed", compatible, breaking, "old senders may still send it"},
    ChangeRule{"enumerator-renamed", none, breaking, "the same value under another name"},
    ChangeRule{"enumerator-value", breaking, none, "the same name for another number"},
    ChangeRule{"alternative-added", compatible, none, "old receivers refuse a message that has it"},
    ChangeRule{"alternative-removed", breaking, breaking, "new receivers refuse it"},
    ChangeRule{"alternative-selector", breaking, none, "the receiver takes it for another alternative"},
    ChangeRule{"error-changed", none, compatible,
               "the first value of the answer is an error on one side alone: its bytes are compared as any"},
    ChangeRule{"not-compared", breaking, breaking,
               "too many types, or nested too deep: the rest was not compared"},
};

const ChangeRule& rule(std::string_view id) {
  return *std::ranges::find(rules, id, &ChangeRule::id);
}

std::string hex(std::uint32_t number) {
  return fmt::format("0x{:04x}", number);
}

template <typename Id>
std::string text(const std::optional<Id>& id) {
  return id ? hex(static_cast<std::uint32_t>(*id)) : std::string{};
}

/// Pairs elements of two lists: those of one name first, then those of one id, by the first key of several
/// that they share.
template <typename Element, typename Name, typename... Ids>
struct Pairs {
  std::vector<std::pair<const Element*, const Element*>> both;
  std::vector<const Element*> removed;
  std::vector<const Element*> added;

  Pairs(const std::vector<Element>& before, const std::vector<Element>& after, Name name, Ids... ids) {
    std::set<const Element*> taken;
    std::map<const Element*, const Element*> old_of;
    const auto pair_by = [&](auto key) {
      // Those of one key wait in the order in which they stand.
      std::map<std::decay_t<decltype(*key(before.front()))>, std::vector<const Element*>> waiting;
      for (auto old = before.rbegin(); old != before.rend(); ++old) {
        if (const auto of = key(*old); of && !taken.contains(&*old)) {
          waiting[*of].push_back(&*old);
        }
      }
      for (const Element& element : after) {
        const auto of = key(element);
        const auto found = of && !old_of.contains(&element) ? waiting.find(*of) : waiting.end();
        if (found != waiting.end() && !found->second.empty()) {
          old_of[&element] = found->second.back();
          taken.insert(found->second.back());
          found->second.pop_back();
        }
      }
    };
    pair_by([&](const Element& one) { return std::optional{name(one)}; });
    (pair_by(ids), ...);
    for (const Element& element : after) {
      if (const auto old = old_of.find(&element); old != old_of.end()) {
        both.emplace_back(old->second, &element);
      } else {
        added.push_back(&element);
      }
    }
    for (const Element& element : before) {
      if (!taken.contains(&element)) {
        removed.push_back(&element);
      }
    }
  }
};

/// "a.b.C" of "/a/b/C".
std::string dotted(std::string name) {
  std::ranges::replace(name, '/', '.');
  return name.starts_with('.') ? name.substr(1) : name;
}

/// The name of a service however its language spells the scope: FIDL has packages, ARXML packages or
/// NAMESPACES.
std::string spelled_alike(const Service& service) {
  return service.namespaces.empty() ? dotted(full_name(service.scope, service.name))
                                    : fmt::format("{}.{}", fmt::join(service.namespaces, "."), service.name);
}

bool has_same_name(const Service& old, const Service& now) {
  return spelled_alike(old) == spelled_alike(now) ||
         dotted(full_name(old.scope, old.name)) == dotted(full_name(now.scope, now.name));
}

/// Names of members, as ROS spells them.
std::set<std::string> names_of_members(const Service& service) {
  std::set<std::string> names;
  const auto add = [&](const auto& members) {
    for (const auto& member : members) {
      names.insert(ros_field_name(member.name));
    }
  };
  add(service.methods);
  add(service.events);
  add(service.fields);
  return names;
}

/// Most of the members of each are in the other.
bool have_same_members(const Service& old, const Service& now) {
  const std::set<std::string> before = names_of_members(old);
  const std::set<std::string> after = names_of_members(now);
  const auto common = static_cast<std::size_t>(
      std::ranges::count_if(before, [&](const std::string& name) { return after.contains(name); }));
  return common > 0 && 2 * common > std::max(before.size(), after.size());
}

/// A route file has the names of ROS, without packages of interfaces.
bool is_of_routes(const Service& service) {
  const auto has_ros_name = [](const auto& member) { return !member.ros_name.empty(); };
  return !service.from_ros && (std::ranges::any_of(service.methods, has_ros_name) ||
                               std::ranges::any_of(service.events, has_ros_name) ||
                               std::ranges::any_of(service.fields, has_ros_name));
}

bool is_unknown(const Method& method) {
  return !method.request.known && !method.response.known;
}

/// Has ids alone, as vsomeip JSON and captures do: what it does not say may be so or not.
bool has_ids_alone(const Service& service) {
  return std::ranges::all_of(service.methods, is_unknown) &&
         std::ranges::none_of(service.events, &Payload::known, &Event::payload) &&
         std::ranges::none_of(service.fields, &Payload::known, &Field::payload) &&
         (has_made_name(service) || !service.methods.empty() || !service.events.empty() ||
          !service.fields.empty());
}
bool has_events(const Service& service) {
  return !service.events.empty() || !service.fields.empty();
}
/// What a capture shows stands at no line of a file.
bool is_of_capture(const Service& service) {
  const auto is_seen = [](const auto& one) { return one.observed_bytes.has_value(); };
  return std::ranges::any_of(service.methods, is_seen) || std::ranges::any_of(service.events, is_seen) ||
         (has_made_name(service) && service.methods.empty() && !has_events(service) &&
          service.place.mark.line == 0);
}
/// Whether the model is what a capture shows: other services may be there too.
bool is_of_capture(const Model& model) {
  return !model.services.empty() && std::ranges::all_of(model.services, [](const Service& service) {
    return has_made_name(service) && has_ids_alone(service) && is_of_capture(service);
  });
}

/// What a service says that is compared with `other`'s.
struct Said {
  bool ids_alone;
  bool names;
  bool version;
  bool members;      ///< all methods, and all parts of fields, that there are
  bool events;       ///< and all events
  bool eventgroups;  ///< which event is in which
  bool transport;

  Said(const Model& model, const Service& service, const Service& other)
      : ids_alone{has_ids_alone(service)},
        names{!ids_alone || !has_made_name(service)},
        version{!ids_alone || service.has_version},
        members{!ids_alone || (names && has_ids_alone(other))},
        // An application of vsomeip may offer events that its configuration does not have.
        events{!ids_alone || (!is_of_capture(service) && (names || has_events(service)))},
        eventgroups{is_of_capture(service) || has_eventgroups(service)},
        transport{names || is_of_capture(service) || has_port(model, service)} {}

 private:
  static bool has_eventgroups(const Service& service) {
    const auto is_in_some = [](const auto& member) { return !member.eventgroups.empty(); };
    return std::ranges::any_of(service.events, is_in_some) || std::ranges::any_of(service.fields, is_in_some);
  }
  /// vsomeip carries what has no port within one host, by neither transport.
  static bool has_port(const Model& model, const Service& service) {
    return std::ranges::any_of(model.instances, [&](const Instance& instance) {
      return instance.service_id == service.id && (instance.udp_port || instance.tcp_port);
    });
  }
};

/// `service`, which has ids alone, with the methods and events of `other`'s fields as parts of fields.
Service with_fields(const Service& service, const Service& other) {
  struct Part {
    const Field* field;
    char kind;
  };
  std::map<someip::MethodId, Part> parts;
  for (const Field& field : other.fields) {
    for (const auto& [id, kind] :
         {std::pair{field.getter, 'g'}, {field.setter, 's'}, {field.notifier, 'n'}}) {
      if (id) {
        parts.try_emplace(*id, Part{&field, kind});
      }
    }
  }
  Service made = service;
  std::map<const Field*, std::size_t> places;
  for (std::size_t at = 0; at < made.fields.size(); ++at) {
    if (made.fields[at].notifier) {
      if (const auto found = parts.find(*made.fields[at].notifier); found != parts.end()) {
        places.try_emplace(found->second.field, at);
      }
    }
  }
  const auto field_of = [&](const Part& part, const Place& place) -> Field& {
    const auto [at, is_new] = places.try_emplace(part.field, made.fields.size());
    if (is_new) {
      made.fields.push_back({.name = part.field->name,
                             .payload = {.known = false},
                             .has_getter = false,
                             .has_setter = false,
                             .has_notifier = false,
                             .place = place});
    }
    return made.fields[at->second];
  };
  std::erase_if(made.events, [&](const Event& event) {
    const auto part = event.id ? parts.find(*event.id) : parts.end();
    if (part == parts.end() || part->second.kind != 'n') {
      return false;
    }
    Field& field = field_of(part->second, event.place);
    field.has_notifier = true;
    field.notifier = event.id;
    field.eventgroups = event.eventgroups;
    field.notifier_transfer = event.transfer;
    field.e2e = event.e2e;
    field.observed_bytes = event.observed_bytes;
    return true;
  });
  std::erase_if(made.methods, [&](const Method& method) {
    const auto part = method.id ? parts.find(*method.id) : parts.end();
    if (part == parts.end() || part->second.kind == 'n') {
      return false;
    }
    Field& field = field_of(part->second, method.place);
    const bool is_getter = part->second.kind == 'g';
    (is_getter ? field.has_getter : field.has_setter) = true;
    (is_getter ? field.getter : field.setter) = method.id;
    (is_getter ? field.getter_transfer : field.setter_transfer) =
        is_getter ? method.response_transfer : method.request_transfer;
    (is_getter ? field.getter_e2e : field.setter_e2e) = method.e2e;
    if (!field.observed_bytes) {
      field.observed_bytes = method.observed_bytes;
    }
    return true;
  });
  return made;
}

bool is_type(const Model& model, TypeIndex index) {
  return static_cast<std::size_t>(index) < model.types.size();
}

/// The rules of a use that matter for its kind, in words.
std::string rules_of(Kind kind, const Wire& wire) {
  std::string words = fmt::format("length field {} bits", 8 * bytes(wire.length));
  if (kind == Kind::choice) {
    words += fmt::format(", selector {} bits {}", 8 * bytes(wire.selector),
                         wire.length_first ? "behind the length" : "before the length");
  }
  if (kind == Kind::string) {
    constexpr std::array names{"UTF-8", "UTF-16LE", "UTF-16BE"};
    words += fmt::format(", {}{}{}", names.at(static_cast<std::size_t>(wire.encoding)),
                         wire.bom ? ", BOM" : "", wire.terminator ? ", terminator" : "");
  }
  if (wire.fixed_bytes != 0) {
    words += fmt::format(", always {} bytes", wire.fixed_bytes);
  }
  if (wire.bits != 0) {
    words += fmt::format(", {} bits", wire.bits);
  }
  if (wire.byte_order) {
    words += *wire.byte_order == std::endian::big ? ", big endian" : ", little endian";
  }
  return words;
}

std::string name_of(const Model& model, TypeIndex index) {
  std::string dimensions;
  for (std::size_t steps = 0; is_type(model, index); ++steps) {
    const Type& type = model.at(index);
    if (!type.name.empty()) {
      return type.name + dimensions;
    }
    const Type& behind = resolved(model, index);
    if (behind.kind != Kind::array || steps == max_type_nesting) {
      return (behind.kind == Kind::primitive ? messages::to_string(behind.primitive)
                                             : to_string(behind.kind)) +
             dimensions;
    }
    dimensions += "[]";
    index = behind.element.type;
  }
  return dimensions;
}

std::string_view word_of(std::endian order) {
  return order == std::endian::big ? "big endian" : "little endian";
}

/// One of two payloads that are compared: what its bytes are, in words.
class Side {
 public:
  explicit Side(const Model& model) : model_{&model} {}
  Side(const Model& model, const Payload& payload, std::string element)
      : model_{&model}, payload_{&payload}, element_{std::move(element)}, order_{payload.byte_order} {}

  /// Takes the byte order of a use, for what is in it; returns the one before.
  std::endian enter(const Value& use) { return std::exchange(order_, use.wire.byte_order.value_or(order_)); }
  void leave(std::endian order) { order_ = order; }

  /// "Angle (uint16, 16 bits, big endian, at byte 4)"
  std::string bytes_of(const std::string& element, const Value& use) {
    const Type& type = resolved(*model_, use.type);
    const std::string name = name_of(*model_, use.type);
    std::vector<std::string> words;
    const bool is_number = type.kind == Kind::primitive || type.kind == Kind::enumeration;
    const std::string form = is_number ? messages::to_string(type.primitive) : to_string(type.kind);
    if (type.kind == Kind::enumeration) {
      words.emplace_back("enumeration");
    }
    if (form != name && type.kind != Kind::array) {
      words.push_back(form);
    }
    if (is_number) {
      const std::size_t width = messages::width(type.primitive);
      words.push_back(fmt::format("{} bits", use.wire.bits != 0 ? use.wire.bits : 8 * width));
      if (width > 1 && payload_ != nullptr) {
        words.emplace_back(word_of(use.wire.byte_order.value_or(order_)));
      }
    } else if (type.kind != Kind::alias &&
               !(type.kind == Kind::structure && use.wire.length == someip::FieldWidth::none)) {
      words.push_back(rules_of(type.kind, use.wire));
    }
    if (std::string offset = offset_of(element); !offset.empty()) {
      words.push_back(std::move(offset));
    }
    return words.empty() ? name : fmt::format("{} ({})", name, fmt::join(words, ", "));
  }

 private:
  /// "at byte 4 + name"; empty: it has no place of its own, or too many were asked for.
  std::string offset_of(const std::string& element) {
    if (payload_ == nullptr || !element.starts_with(element_) || asked_ == max_offsets) {
      return {};
    }
    if (asked_++ == 0) {
      ranges_ = layout(*model_, *payload_).ranges;
    }
    std::string_view path = std::string_view{element}.substr(element_.size());
    path.remove_prefix(path.starts_with('.') ? 1 : 0);
    const auto found = std::ranges::find_if(ranges_, [&](const ByteRange& range) {
      const std::string_view there = range.path;
      return there.starts_with(path) &&
             (there.size() == path.size() || there[path.size()] == '.' || there[path.size()] == '[');
    });
    if (found == ranges_.end()) {
      return {};
    }
    return fmt::format("at byte {}{}", found->depth > 0 ? "+" : "", found->offset_text);
  }

  /// Of one payload: each one is looked for in all of its ranges.
  static constexpr std::size_t max_offsets = 100;
  const Model* model_;
  const Payload* payload_ = nullptr;
  std::string element_{};
  std::endian order_ = std::endian::big;
  std::size_t asked_ = 0;
  std::vector<ByteRange> ranges_{};
};

/// byte and char of ROS are one unsigned byte.
messages::Primitive on_wire(messages::Primitive primitive) {
  return primitive == messages::Primitive::byte || primitive == messages::Primitive::character
             ? messages::Primitive::uint8
             : primitive;
}

bool is_number(const Type& type) {
  return type.kind == Kind::primitive || type.kind == Kind::enumeration;
}

/// A byte buffer, or an array of numbers of one byte.
bool is_bytes(const Model& model, const Type& type) {
  return type.kind == Kind::bytes ||
         (type.kind == Kind::array && resolved(model, type.element.type).kind == Kind::primitive &&
          on_wire(resolved(model, type.element.type).primitive) == messages::Primitive::uint8);
}

/// Method::error as a value.
Value error_of(const Model& model, const Method& method) {
  Value value{.type = method.error, .place = method.place};
  value.wire = is_type(model, method.error) ? model.at(method.error).wire : Wire{};
  return value;
}

class Comparison {
 public:
  Comparison(const Model& before, const Model& after, MissingId missing)
      : before_{before}, after_{after}, missing_{missing} {}

  std::vector<Change> run() {
    Pairs services{before_.services, after_.services, spelled_alike,
                   [](const Service& service) {
                     return service.id ? std::optional{std::pair{*service.id, service.major}} : std::nullopt;
                   },
                   [](const Service& service) { return service.id; }};
    pair_without_ids(services.removed, services.added, services.both);
    for (const auto& [old, now] : services.both) {
      compare(*old, *now);
    }
    if (is_of_capture(before_)) {
      services.added.clear();
    }
    if (is_of_capture(after_)) {
      services.removed.clear();
    }
    for (const Service* service : services.added) {
      add("service-added", service->name, {}, text(service->id), {}, service->place);
    }
    for (const Service* service : services.removed) {
      add("service-removed", service->name, text(service->id), {}, service->place, {});
    }
    return std::move(changes_);
  }

 private:
  using ServiceList = std::vector<const Service*>;

  /// Where one side alone has an id for a service, the other one is found by the last part of its name, else
  /// by what it has in it: a route file knows no packages.
  static void pair_without_ids(ServiceList& removed, ServiceList& added,
                               std::vector<std::pair<const Service*, const Service*>>& both) {
    constexpr std::size_t most = 1'000'000;  // each is compared with each
    const auto pair_where = [&](const auto& is_same) {
      if (added.size() > most / std::max<std::size_t>(removed.size(), 1)) {
        return;
      }
      for (const Service*& old : removed) {
        const auto found = std::ranges::find_if(added, [&](const Service* now) {
          return old->id.has_value() != now->id.has_value() && is_same(*old, *now);
        });
        if (found != added.end()) {
          both.emplace_back(old, *found);
          added.erase(found);
          old = nullptr;
        }
      }
      std::erase(removed, nullptr);
    };
    pair_where([](const Service& old, const Service& now) { return old.name == now.name; });
    pair_where(have_same_members);
  }

  void add(std::string_view id, std::string element, std::string before, std::string after, Place old_place,
           Place new_place) {
    changes_.push_back(
        {&rule(id), std::move(element), std::move(before), std::move(after), old_place, new_place});
  }
  /// When the two differ, but for how ROS spells names where one side is a route file.
  void renamed(std::string_view id, const std::string& element, const std::string& before,
               const std::string& after, Place old_place, Place new_place) {
    if (!ros_names_ || ros_field_name(before) != ros_field_name(after)) {
      differs(id, element, before, after, old_place, new_place);
    }
  }
  /// When the two differ.
  void differs(std::string_view id, const std::string& element, std::string before, std::string after,
               Place old_place, Place new_place) {
    if (before != after) {
      add(id, element, std::move(before), std::move(after), old_place, new_place);
    }
  }

  template <typename Id>
  void ids_differ(std::string_view rule, const std::string& element, const std::optional<Id>& before,
                  const std::optional<Id>& after, Place old_place, Place new_place) {
    if ((before && after) || missing_ == MissingId::different) {
      differs(rule, element, text(before), text(after), old_place, new_place);
    }
  }

  void compare(const Service& old, const Service& now) {
    const Said was{before_, old, now};
    const Said is{after_, now, old};
    known_ = {.names = was.ids_alone == is.ids_alone && was.names && is.names,
              .version = was.version && is.version,
              .old_members = was.members,
              .new_members = is.members,
              .old_events = was.events,
              .new_events = is.events,
              .eventgroups = was.eventgroups && is.eventgroups,
              .transport = was.transport && is.transport};
    // Who has ids alone may have the methods and events of the other one's fields by themselves.
    const bool old_has_less = was.ids_alone && (!is.ids_alone || is_of_capture(old));
    const bool new_has_less = is.ids_alone && (!was.ids_alone || is_of_capture(now));
    one_has_ids_ = old.id.has_value() != now.id.has_value();
    ros_names_ = one_has_ids_ && (is_of_routes(old) || is_of_routes(now));
    const std::string& name = is.names ? now.name : old.name;
    compare(name, old_has_less ? with_fields(old, now) : old, new_has_less ? with_fields(now, old) : now);
  }

  /// What can be compared, as both sides say it.
  struct Known {
    bool names = true;
    bool version = true;
    bool old_members = true;  ///< the old side has all methods, and all parts of fields, that there are
    bool new_members = true;
    bool old_events = true;  ///< and all events
    bool new_events = true;
    bool eventgroups = true;
    bool transport = true;
  };

  void compare(const std::string& name, const Service& old, const Service& now) {
    if (known_.names && !has_same_name(old, now) && !(ros_names_ && old.name == now.name)) {
      differs("service-renamed", name, full_name(old.scope, old.name), full_name(now.scope, now.name),
              old.place, now.place);
    }
    ids_differ("service-id", name, old.id, now.id, old.place, now.place);
    if (known_.version) {
      differs("service-major", name, fmt::to_string(old.major), fmt::to_string(now.major), old.place,
              now.place);
      differs("service-minor", name, fmt::to_string(old.minor), fmt::to_string(now.minor), old.place,
              now.place);
    }
    members(name, "method", old.methods, now.methods, [](const Method& method) { return method.id; });
    members(name, "event", old.events, now.events, [](const Event& event) { return event.id; });
    members(name, "field", old.fields, now.fields, [](const Field& field) {
      return field.notifier ? field.notifier : field.getter ? field.getter : field.setter;
    });
  }

  template <typename Member, typename Id>
  void members(const std::string& service, const std::string& kind, const std::vector<Member>& old,
               const std::vector<Member>& now, Id id) {
    Pairs pairs{old, now, [](const Member& member) { return member.name; }, id,
                [this](const Member& member) {
                  return one_has_ids_ ? std::optional{ros_field_name(member.name)} : std::nullopt;
                }};
    for (const auto& [before, after] : pairs.both) {
      const std::string element = service + "." + (known_.names || known_.new_members ? after : before)->name;
      if (known_.names) {
        renamed(kind + "-renamed", element, before->name, after->name, before->place, after->place);
      }
      compare(element, *before, *after);
    }
    // A field without notifier is methods alone.
    const auto is_event = [](const Member* member) {
      if constexpr (requires { member->has_notifier; }) {
        return member->has_notifier;
      } else {
        return !requires {
          member->request;
        };
      }
    };
    std::erase_if(pairs.added, [&](const Member* member) {
      return !(is_event(member) ? known_.old_events : known_.old_members);
    });
    std::erase_if(pairs.removed, [&](const Member* member) {
      return !(is_event(member) ? known_.new_events : known_.new_members);
    });
    for (const Member* member : pairs.added) {
      add(kind + "-added", service + "." + member->name, {}, text(id(*member)), {}, member->place);
    }
    for (const Member* member : pairs.removed) {
      add(kind + "-removed", service + "." + member->name, text(id(*member)), {}, member->place, {});
    }
  }

  void compare(const std::string& element, const Method& old, const Method& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    ids_differ("method-id", element, old.id, now.id, old.place, now.place);
    const bool both_known =
        is_known(old.request, old.observed_bytes) && is_known(now.request, now.observed_bytes);
    if (both_known && old.fire_and_forget != now.fire_and_forget) {
      const auto word = [](bool forget) {
        return std::string{forget ? "fire and forget" : "with an answer"};
      };
      add("method-fire-and-forget", element, word(old.fire_and_forget), word(now.fire_and_forget), old.place,
          now.place);
    }
    transfers(element, old.request_transfer, now.request_transfer, old.place, now.place, both_known);
    if (!old.fire_and_forget && !now.fire_and_forget) {
      transfers(element, old.response_transfer, now.response_transfer, old.place, now.place, both_known);
    }
    protection(element, old.e2e, now.e2e, old.place, now.place);
    payloads(element + ".request", old.request, now.request, old.place, now.place);
    if ((old.error == no_type) != (now.error == no_type)) {
      if (old.response.known && now.response.known) {
        add("error-changed", element, name_of(before_, old.error), name_of(after_, now.error), old.place,
            now.place);
      }
      payloads(element + ".response", response_of(before_, old), response_of(after_, now), old.place,
               now.place);
      return;
    }
    if (now.error != no_type) {
      types(element + ".error", error_of(before_, old), error_of(after_, now), false);
    }
    payloads(element + ".response", old.response, now.response, old.place, now.place);
  }

  void compare(const std::string& element, const Event& old, const Event& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    ids_differ("event-id", element, old.id, now.id, old.place, now.place);
    groups(element, old, now);
    transfers(element, old.transfer, now.transfer, old.place, now.place);
    protection(element, old.e2e, now.e2e, old.place, now.place);
    payloads(element, old.payload, now.payload, old.place, now.place);
  }

  void compare(const std::string& element, const Field& old, const Field& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    const auto access = [&](const char* part, bool was, const std::optional<someip::MethodId>& before,
                            bool is, const std::optional<someip::MethodId>& after) {
      if (was != is) {
        if (is ? !known_.old_members : !known_.new_members) {
          return;
        }
        add(is ? "field-access-added" : "field-access-removed", element + "." + part, text(before),
            text(after), old.place, now.place);
      } else if (is) {
        ids_differ("field-id", element + "." + part, before, after, old.place, now.place);
      }
    };
    access("getter", old.has_getter, old.getter, now.has_getter, now.getter);
    access("setter", old.has_setter, old.setter, now.has_setter, now.setter);
    access("notifier", old.has_notifier, old.notifier, now.has_notifier, now.notifier);
    if (old.has_notifier && now.has_notifier) {
      groups(element, old, now);
    }
    const bool both_known =
        is_known(old.payload, old.observed_bytes) && is_known(now.payload, now.observed_bytes);
    if (old.has_getter && now.has_getter) {
      transfers(element + ".getter", old.getter_transfer, now.getter_transfer, old.place, now.place,
                both_known);
      protection(element + ".getter", old.getter_e2e, now.getter_e2e, old.place, now.place);
    }
    if (old.has_setter && now.has_setter) {
      transfers(element + ".setter", old.setter_transfer, now.setter_transfer, old.place, now.place,
                both_known);
      protection(element + ".setter", old.setter_e2e, now.setter_e2e, old.place, now.place);
    }
    if (old.has_notifier && now.has_notifier) {
      transfers(element + ".notifier", old.notifier_transfer, now.notifier_transfer, old.place, now.place);
      protection(element, old.e2e, now.e2e, old.place, now.place);
    }
    payloads(element, old.payload, now.payload, old.place, now.place);
  }

  /// Of events and fields. A capture has the eventgroups of the subscriptions that it shows, and may leave
  /// them open.
  template <typename Member>
  void groups(const std::string& element, const Member& old, const Member& now) {
    using Groups = std::vector<someip::EventgroupId>;
    const auto sorted = [](Groups ids) {
      std::ranges::sort(ids);
      return ids;
    };
    const Groups before = sorted(old.eventgroups);
    const Groups after = sorted(now.eventgroups);
    if ((!known_.eventgroups && missing_ == MissingId::unknown) || (is_seen(old) && is_seen(now))) {
      return;
    }
    if ((is_seen(old) && std::ranges::includes(after, before)) ||
        (is_seen(now) && std::ranges::includes(before, after))) {
      return;
    }
    const auto list = [](const Groups& ids) {
      std::string all;
      for (const someip::EventgroupId id : ids) {
        all += (all.empty() ? "" : ", ") + hex(static_cast<std::uint32_t>(id));
      }
      return all;
    };
    differs("event-eventgroups", element, list(before), list(after), old.place, now.place);
  }

  /// Whether a capture has it: that has no segments, as it has whole messages, and does not tell what is
  /// protected.
  static bool is_seen(const Payload& payload, const std::optional<std::uint32_t>& observed_bytes) {
    return !payload.known && observed_bytes.has_value();
  }
  template <typename Member>
  static bool is_seen(const Member& member) {
    if constexpr (requires { member.request; }) {
      return is_seen(member.request, member.observed_bytes);
    } else {
      return is_seen(member.payload, member.observed_bytes);
    }
  }

  /// Whether somebody says how a method is carried. vsomeip JSON does not; a capture shows it.
  static bool is_known(const Payload& payload, const std::optional<std::uint32_t>& observed_bytes) {
    return payload.known || observed_bytes.has_value();
  }

  void transfers(const std::string& element, const Transfer& old, const Transfer& now, Place old_place,
                 Place new_place, bool are_known = true) {
    const auto word = [](Transport transport) {
      return std::string{transport == Transport::tcp ? "TCP" : "UDP"};
    };
    if (are_known && known_.transport) {
      differs("transport", element, word(old.transport), word(now.transport), old_place, new_place);
    }
    const auto segments = [](const Transfer& transfer) {
      return fmt::format("{} bytes, {} us apart", transfer.segment_bytes, transfer.separation.count());
    };
    if (!either_is_seen_) {
      differs("segmentation", element, segments(old), segments(now), old_place, new_place);
    }
  }

  /// Only what is on the wire: what a receiver tolerates is its own affair.
  void protection(const std::string& element, const Protection& old, const Protection& now, Place old_place,
                  Place new_place) {
    const auto before = wire_settings(old);
    const auto after = wire_settings(now);
    const auto word = [](const Protection& e2e) {
      return e2e.profile.empty() ? std::string{"none"} : "profile " + e2e.profile;
    };
    std::string was = word(old);
    std::string is = word(now);
    bool changed = before.profile != after.profile;
    // A parameter that one side does not give is not known; defaults are among the settings.
    for (const auto& [key, value] : before.values) {
      const auto other = after.values.find(key);
      if (other != after.values.end() && other->second != value) {
        was += fmt::format(", {} {}", key, value);
        is += fmt::format(", {} {}", key, other->second);
        changed = true;
      }
    }
    if (changed && !either_is_seen_) {
      add("protection", element, std::move(was), std::move(is), old_place, new_place);
    }
  }

  void payloads(const std::string& element, const Payload& old, const Payload& now, Place old_place,
                Place new_place) {
    const auto word = [](std::endian order) { return std::string{word_of(order)}; };
    if (!old.known || !now.known) {
      return;
    }
    const auto alignment = [](const Payload& payload) {
      return payload.alignment <= 1 ? std::string{"none"} : fmt::format("{} bytes", payload.alignment);
    };
    differs("byte-order", element, word(old.byte_order), word(now.byte_order), old_place, new_place);
    differs("alignment", element, alignment(old), alignment(now), old_place, new_place);
    if (has_tagged_lengths(before_, old) && has_tagged_lengths(after_, now)) {
      const auto tagged_length = [](const Payload& payload) {
        return payload.smallest_tagged_length
                   ? std::string{"length fields before tagged members as small as possible"}
                   : fmt::format("length fields before tagged members {} bits",
                                 8 * bytes(payload.tagged_length));
      };
      differs("layout", element, tagged_length(old), tagged_length(now), old_place, new_place);
    }
    old_side_ = {before_, old, element};
    new_side_ = {after_, now, element};
    values(element, old.values, now.values, false, old_place, new_place);
    old_side_ = Side{before_};
    new_side_ = Side{after_};
  }

  /// @param behind_length  a length field tells where the values end.
  void values(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
              bool behind_length, Place old_place, Place new_place) {
    if (std::ranges::any_of(old, [](const Value& value) { return value.tag.has_value(); })) {
      tagged(element, old, now, new_place);
      return;
    }
    const std::size_t common = std::min(old.size(), now.size());
    for (std::size_t i = 0; i < common; ++i) {
      const std::string name = path(element, now[i].name);
      renamed("value-renamed", name, old[i].name, now[i].name, old[i].place, now[i].place);
      if (old[i].tag != now[i].tag) {
        add("member-tag", name, text(old[i].tag), text(now[i].tag), old[i].place, now[i].place);
      }
      uses(name, old[i], now[i]);
    }
    appended(element, old, now, behind_length, old_place);
    for (std::size_t i = common; i < old.size(); ++i) {
      const std::string name = path(element, old[i].name);
      add("value-removed", name, old_side_.bytes_of(name, old[i]), {}, old[i].place, new_place);
    }
  }

  void appended(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
                bool behind_length, Place old_place) {
    for (std::size_t i = old.size(); i < now.size(); ++i) {
      const std::string name = path(element, now[i].name);
      add(behind_length ? "value-appended-behind-length" : "value-appended", name, {},
          new_side_.bytes_of(name, now[i]), old_place, now[i].place);
    }
  }

  void tagged(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
              Place new_place) {
    const Pairs pairs{old, now, [](const Value& value) { return value.name; },
                      [](const Value& value) { return value.tag; }};
    for (const auto& [before, after] : pairs.both) {
      const std::string name = path(element, after->name);
      renamed("value-renamed", name, before->name, after->name, before->place, after->place);
      differs("member-tag", name, text(before->tag), text(after->tag), before->place, after->place);
      if (before->optional != after->optional) {
        const auto word = [](bool optional) { return std::string{optional ? "optional" : "always there"}; };
        add("member-optional", name, word(before->optional), word(after->optional), before->place,
            after->place);
      }
      uses(name, *before, *after);
    }
    for (const Value* value : pairs.added) {
      const std::string name = path(element, value->name);
      add(value->optional ? "member-optional-added" : "value-appended", name, {},
          new_side_.bytes_of(name, *value), {}, value->place);
    }
    for (const Value* value : pairs.removed) {
      const std::string name = path(element, value->name);
      add(value->optional ? "member-optional-removed" : "value-removed", name,
          old_side_.bytes_of(name, *value), {}, value->place, new_place);
    }
  }

  /// One use of a type, and another.
  void uses(const std::string& element, const Value& old, const Value& now) {
    if (uses_ == max_compared_uses) {
      add("not-compared", element, {}, {}, old.place, now.place);
    }
    if (++uses_ > max_compared_uses) {
      return;
    }
    const Type& before = resolved(before_, old.type);
    const Type& after = resolved(after_, now.type);
    if (before.kind == after.kind || (is_bytes(before_, before) && is_bytes(after_, after))) {
      const std::string was = rules_of(before.kind, old.wire);
      const std::string is = rules_of(after.kind, now.wire);
      differs("layout", element, was, is, old.place, now.place);
    }
    // Tagged members have a length field, too.
    const bool behind_length = (old.tag && now.tag) || (old.wire.length != someip::FieldWidth::none &&
                                                        now.wire.length != someip::FieldWidth::none);
    const std::endian old_order = old_side_.enter(old);
    const std::endian new_order = new_side_.enter(now);
    types(element, old, now, behind_length);
    old_side_.leave(old_order);
    new_side_.leave(new_order);
  }

  /// @param behind_length  a length field of the use tells where the type ends.
  void types(const std::string& element, const Value& old_use, const Value& new_use, bool behind_length) {
    const TypeIndex old_index = old_use.type;
    const TypeIndex new_index = new_use.type;
    const Place& old_place = old_use.place;
    const Place& new_place = new_use.place;
    if (!is_type(before_, old_index) || !is_type(after_, new_index)) {
      differs("type-changed", element, name_of(before_, old_index), name_of(after_, new_index), old_place,
              new_place);
      return;
    }
    const Type& old = resolved(before_, old_index);
    const Type& now = resolved(after_, new_index);
    const bool both_numbers = is_number(old) && is_number(now);
    if ((both_numbers && old.kind != now.kind && on_wire(old.primitive) == on_wire(now.primitive)) ||
        (old.kind != now.kind && is_bytes(before_, old) && is_bytes(after_, now))) {
      add("type-form", element, old_side_.bytes_of(element, old_use), new_side_.bytes_of(element, new_use),
          old_place, new_place);
      sizes(element, old, now, old_place, new_place);
      return;
    }
    if (old.kind != now.kind ||
        (old.kind == Kind::primitive && on_wire(old.primitive) != on_wire(now.primitive))) {
      add("type-changed", element, old_side_.bytes_of(element, old_use), new_side_.bytes_of(element, new_use),
          old_place, new_place);
      return;
    }
    differs("type-renamed", element, old.name, now.name, old_place, new_place);
    // Types that contain themselves, and types that are used often, are told once; but what is appended hurts
    // more where no length field is before it.
    const auto [seen, is_new] = seen_.try_emplace(std::pair{old_index, new_index}, behind_length);
    if (!is_new) {
      if (std::exchange(seen->second, seen->second && behind_length) && !behind_length &&
          now.kind == Kind::structure) {
        appended(element, all_members(before_, old), all_members(after_, now), false, old_place);
      }
      return;
    }
    // Two that contain themselves in circles of different lengths are a longer circle together.
    if (depth_ > max_type_nesting) {
      add("not-compared", element, {}, {}, old_place, new_place);
      return;
    }
    ++depth_;
    inside(element, old, now, behind_length, old_place, new_place);
    --depth_;
  }

  void inside(const std::string& element, const Type& old, const Type& now, bool behind_length,
              Place old_place, Place new_place) {
    sizes(element, old, now, old_place, new_place);
    switch (now.kind) {
      case Kind::structure:
        values(element, all_members(before_, old), all_members(after_, now), behind_length, old_place,
               new_place);
        break;
      case Kind::choice:
        alternatives(element, old, now, old_place, new_place);
        break;
      case Kind::enumeration:
        differs("layout", element, width(old, now), width(now, old), old_place, new_place);
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

  /// "8 bits", or "int8" where only the sign differs.
  static std::string width(const Type& type, const Type& other) {
    const std::size_t bytes = messages::width(type.primitive);
    return bytes == messages::width(other.primitive) ? std::string{messages::to_string(type.primitive)}
                                                     : fmt::format("{} bits", 8 * bytes);
  }

  void sizes(const std::string& element, const Type& old, const Type& now, Place old_place, Place new_place) {
    if (old.fixed_size || now.fixed_size) {
      const auto word = [](const Type& type) {
        return type.fixed_size ? fmt::format("always {}", type.max_size) : std::string{"as many as come"};
      };
      differs("size-fixed", element, word(old), word(now), old_place, new_place);
      return;
    }
    if (old.max_size != now.max_size) {
      const auto word = [](std::uint32_t most) {
        return most == 0 ? std::string{"no limit"} : fmt::format("at most {}", most);
      };
      const bool raised = now.max_size == 0 || (old.max_size != 0 && now.max_size > old.max_size);
      add(raised ? "size-raised" : "size-lowered", element, word(old.max_size), word(now.max_size), old_place,
          new_place);
    }
  }

  void enumerators(const std::string& element, const Type& old, const Type& now) {
    const std::vector<Enumerator> before = all_enumerators(before_, old);
    const std::vector<Enumerator> after = all_enumerators(after_, now);
    const Pairs pairs{before, after, [](const Enumerator& one) { return one.name; },
                      [](const Enumerator& one) { return std::optional{one.value}; }};
    for (const auto& [was, is] : pairs.both) {
      differs("enumerator-renamed", path(element, is->name), was->name, is->name, was->place, is->place);
      differs("enumerator-value", path(element, is->name), fmt::to_string(was->value),
              fmt::to_string(is->value), was->place, is->place);
    }
    for (const Enumerator* one : pairs.added) {
      add("enumerator-added", path(element, one->name), {}, fmt::to_string(one->value), {}, one->place);
    }
    for (const Enumerator* one : pairs.removed) {
      add("enumerator-removed", path(element, one->name), fmt::to_string(one->value), {}, one->place, {});
    }
  }

  /// An alternative with the number that announces it.
  struct Alternative {
    Value value;
    std::uint32_t selector;
  };
  static std::vector<Alternative> alternatives_of(const Model& model, const Type& type) {
    std::vector<Alternative> all;
    for (Value& value : all_members(model, type)) {
      const std::size_t number = all.size();
      all.push_back({std::move(value), number < type.selectors.size()
                                           ? type.selectors[number]
                                           : static_cast<std::uint32_t>(number + 1)});
    }
    return all;
  }

  void alternatives(const std::string& element, const Type& old, const Type& now, Place old_place,
                    Place new_place) {
    const std::vector<Alternative> before = alternatives_of(before_, old);
    const std::vector<Alternative> after = alternatives_of(after_, now);
    const Pairs pairs{before, after, [](const Alternative& one) { return one.value.name; },
                      [](const Alternative& one) { return std::optional{one.selector}; }};
    for (const auto& [was, is] : pairs.both) {
      const std::string name = path(element, is->value.name);
      renamed("value-renamed", name, was->value.name, is->value.name, was->value.place, is->value.place);
      differs("alternative-selector", name, fmt::to_string(was->selector), fmt::to_string(is->selector),
              was->value.place, is->value.place);
      uses(name, was->value, is->value);
    }
    for (const Alternative* one : pairs.added) {
      add("alternative-added", path(element, one->value.name), {}, fmt::to_string(one->selector), old_place,
          one->value.place);
    }
    for (const Alternative* one : pairs.removed) {
      add("alternative-removed", path(element, one->value.name), fmt::to_string(one->selector), {},
          one->value.place, new_place);
    }
  }

  static std::string path(const std::string& element, const std::string& name) {
    return name.empty() ? element : element + "." + name;
  }

  const Model& before_;
  const Model& after_;
  const MissingId missing_;
  Side old_side_{before_};  ///< of the payloads that are compared
  Side new_side_{after_};
  Known known_{};
  std::vector<Change> changes_{};
  std::map<std::pair<TypeIndex, TypeIndex>, bool> seen_{};  ///< whether always behind a length field
  bool one_has_ids_ = false;                                ///< of the services that are compared
  bool ros_names_ = false;       ///< and one of them is of a route file, which has the names of ROS
  bool either_is_seen_ = false;  ///< of the members that are compared, by is_seen()
  std::size_t uses_ = 0;
  std::size_t depth_ = 0;
};

}  // namespace

std::span<const ChangeRule> change_rules() {
  return rules;
}

std::vector<Change> compare(const Model& before, const Model& after, MissingId missing) {
  return Comparison{before, after, missing}.run();
}

}  // namespace trestle::describe
