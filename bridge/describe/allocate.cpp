#include "bridge/describe/allocate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/describe/id_faults.hpp"
#include "bridge/describe/member_ids.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/section.hpp"

namespace trestle::describe {
namespace {

constexpr std::string_view comment =
    "# Ids that trestle has chosen. Keep this file with the interfaces, so that these ids stay the same.\n";

/// FNV-1a: the same everywhere, and for ever.
std::uint32_t hash(std::string_view text) {
  std::uint32_t sum = 2166136261U;
  for (const char character : text) {
    sum = (sum ^ static_cast<unsigned char>(character)) * 16777619U;
  }
  return sum;
}

/// Ids from `first` to `last` of which some are taken.
class Numbers {
 public:
  Numbers(std::uint32_t first, std::uint32_t last) : first_{first}, last_{last} {}

  /// @return whether it was free.
  bool take(std::uint16_t id) { return taken_.insert(id).second; }
  /// Takes the next free one from `begin` on; at the end it begins anew.
  std::optional<std::uint16_t> next(std::uint32_t begin) {
    const std::uint32_t count = last_ - first_ + 1;
    for (std::uint32_t step = 0; step < count; ++step) {
      const auto id = static_cast<std::uint16_t>(first_ + (begin - first_ + step) % count);
      if (taken_.insert(id).second) {
        return id;
      }
    }
    return std::nullopt;
  }
  /// The lowest free one: none is given back, so that the search goes on where it ended.
  std::optional<std::uint16_t> next() {
    const std::optional<std::uint16_t> id = next(lowest_);
    lowest_ = id.value_or(lowest_);
    return id;
  }

 private:
  std::uint32_t first_;
  std::uint32_t last_;
  std::uint32_t lowest_ = first_;
  std::set<std::uint16_t> taken_{};
};

/// Something that has an id or shall get one.
struct Element {
  std::string name;
  std::optional<someip::MethodId>* id;
  const Place* place;
};

struct Channel {
  IdSort sort;
  IdsByName LockedIds::*locked;
  IdRange range;
  const char* what;
};

class Allocation {
 public:
  Allocation(Model& model, IdLock& lock) : model_{model}, lock_{lock} {}

  std::vector<documents::Problem> run(IdRange range) {
    services(range);
    instances();
    for (const Instance& instance : model_.instances) {
      if (!instance.service.empty()) {
        named_.insert(instance.service);
      } else if (instance.service_id) {
        nameless_.insert(*instance.service_id);
      }
      if (instance.role == Instance::Role::provided) {
        offered_.insert(instance.service);
      }
    }
    for (Service* const one : bases_first()) {
      Service& service = *one;
      const std::string name = full_name(service.scope, service.name);
      LockedIds& locked = lock_.services[name];
      eventgroups(service);
      for (const Channel& channel : {Channel{IdSort::called, &LockedIds::methods, {0x0001, 0x7ffe}, "method"},
                                     Channel{IdSort::sent, &LockedIds::events, {0x8001, 0xfffe}, "event"}}) {
        inherit(service, locked, channel);
        members(service, locked, channel);
      }
      instance(service);
      locked.base = service.base;
      if (!locked.service && locked.methods.empty() && locked.events.empty()) {
        lock_.services.erase(name);
      }
    }
    return std::move(problems_);
  }

 private:
  void services(IdRange range) {
    Numbers numbers{range.first, range.last};
    std::map<std::uint16_t, const Service*> given;
    std::vector<std::pair<std::string, Service*>> without;
    for (Service& service : model_.services) {
      if (service.id) {
        numbers.take(someip::value(*service.id));
        given.emplace(someip::value(*service.id), &service);
      } else {
        without.emplace_back(full_name(service.scope, service.name), &service);
      }
    }
    for (const auto& [name, locked] : lock_.services) {
      if (locked.service) {
        numbers.take(*locked.service);
      }
    }
    // By name: where two names give one number, the order in the files does not matter.
    std::ranges::sort(without, {}, [](const auto& one) { return one.first; });
    for (const auto& [name, service] : without) {
      std::optional<std::uint16_t>& locked = lock_.services[name].service;
      std::string moved;
      if (const auto other = locked ? given.find(*locked) : given.end(); other != given.end()) {
        moved = fmt::format("the service {} has had the id 0x{:04x}, which {} has now", name, *locked,
                            full_name(other->second->scope, other->second->name));
        locked.reset();
      }
      if (!locked) {
        locked = numbers.next(range.first + hash(name) % (range.last - range.first + 1U));
      }
      if (locked) {
        service->id = someip::ServiceId{*locked};
        service->id_is_chosen = true;
        if (!moved.empty()) {
          warning(service->place, fmt::format("{}: 0x{:04x} is taken", moved, *locked));
        }
      } else {
        none_left(service->place, "service", name);
      }
    }
  }

  /// All services, each behind the one that it extends.
  std::vector<Service*> bases_first() {
    for (Service& service : model_.services) {
      const std::string name = full_name(service.scope, service.name);
      by_name_.emplace(name, &service);
      if (!service.base.empty()) {
        heirs_[service.base].insert(name);
      }
    }
    for (const auto& [name, locked] : lock_.services) {
      if (!locked.base.empty() && !by_name_.contains(name)) {
        heirs_[locked.base].insert(name);
      }
    }
    std::vector<Service*> sorted;
    std::set<const Service*> placed;
    for (Service& service : model_.services) {
      std::vector<Service*> line;
      for (Service* one = &service; one != nullptr && placed.insert(one).second; one = base_of(*one)) {
        line.push_back(one);
      }
      sorted.insert(sorted.end(), line.rbegin(), line.rend());
    }
    return sorted;
  }

  Service* base_of(const Service& service) {
    const auto base = service.base.empty() ? by_name_.end() : by_name_.find(service.base);
    return base == by_name_.end() ? nullptr : base->second;
  }

  /// Not where the service uses that id for something else, or has got another one before.
  void inherit(Service& service, const LockedIds& locked, const Channel& channel) {
    Service* const base = base_of(service);
    if (base == nullptr) {
      return;
    }
    const std::vector<Element> own = elements_of(service, channel.sort);
    std::map<someip::MethodId, std::string> given;
    for (const auto& [name, id] : locked.*channel.locked) {
      given.emplace(someip::MethodId{id}, name);
    }
    for (const Element& element : own) {
      if (*element.id) {
        given.emplace(**element.id, element.name);
      }
    }
    std::map<std::string, someip::MethodId, std::less<>> known;
    for (const Element& element : elements_of(*base, channel.sort)) {
      if (*element.id) {
        known.emplace(element.name, **element.id);
      }
    }
    for (const Element& element : own) {
      const auto found = known.find(element.name);
      if (*element.id || (locked.*channel.locked).contains(element.name) || found == known.end()) {
        continue;
      }
      if (const auto [other, is_free] = given.emplace(found->second, element.name); is_free) {
        *element.id = found->second;
        if (base->chosen_ids.contains(found->second)) {
          service.chosen_ids.insert(found->second);
        }
      } else {
        warning(
            *element.place,
            fmt::format("{0}.{1} cannot have the id 0x{2:04x} of {3}.{1}, which {0}.{4} has: another one "
                        "is chosen, which no FDEPL file can say",
                        service.name, element.name, someip::value(found->second), base->name, other->second));
      }
    }
  }

  static std::vector<Element> elements_of(Service& service, IdSort sort) {
    std::vector<Element> all;
    each_id(service, sort,
            [&all](const std::string& member, std::string_view part, std::optional<someip::MethodId>& id,
                   const Place& place, const Place&) {
              all.push_back({part.empty() ? member : fmt::format("{}/{}", member, part), &id, &place});
            });
    return all;
  }
  void members(Service& service, LockedIds& lock, const Channel& channel) {
    IdsByName& locked = lock.*channel.locked;
    const std::vector<Element> elements = elements_of(service, channel.sort);
    Numbers numbers{channel.range.first, channel.range.last};
    std::map<std::uint16_t, std::string> given;
    bool is_complete = true;
    for (const Element& element : elements) {
      if (*element.id) {
        numbers.take(someip::value(**element.id));
        given.emplace(someip::value(**element.id), element.name);
      } else {
        is_complete = false;
      }
    }
    if (is_complete) {
      return;
    }
    for (const auto& [name, id] : locked) {
      numbers.take(id);
    }
    if (Service* const base = base_of(service)) {
      for (const Element& element : elements_of(*base, channel.sort)) {
        if (*element.id) {
          numbers.take(someip::value(**element.id));
        }
      }
    }
    const Names of_heirs = names_of_heirs(service, channel);
    IdsByName same;  // what heirs have an id for gets it, too
    for (const auto& [id, names] : of_heirs) {
      if (numbers.take(id) && names.size() == 1) {
        same.emplace(*names.begin(), id);
      }
    }
    for (const Element& element : elements) {
      if (*element.id) {
        continue;
      }
      auto kept = locked.find(element.name);
      std::string moved;
      if (kept != locked.end()) {
        if (const auto other = given.find(kept->second); other != given.end()) {
          moved = fmt::format("{}.{} has had the id 0x{:04x}, which {} has now", service.name, element.name,
                              kept->second, other->second);
          locked.erase(kept);
          kept = locked.end();
        }
      }
      if (kept == locked.end()) {
        const auto wanted = same.find(element.name);
        const std::optional<std::uint16_t> id =
            wanted == same.end() ? numbers.next() : std::optional{wanted->second};
        if (!id) {
          none_left(service.place, channel.what, element.name);
          return;
        }
        kept = locked.emplace(element.name, *id).first;
        if (!moved.empty()) {
          warning(*element.place, fmt::format("{}: 0x{:04x} is taken", moved, *id));
        }
      }
      *element.id = someip::MethodId{kept->second};
      service.chosen_ids.insert(**element.id);
    }
  }

  /// Ids that services have which extend this one, directly or not, and the names of what has them.
  using Names = std::map<std::uint16_t, std::set<std::string>>;
  Names names_of_heirs(const Service& service, const Channel& channel) {
    Names names;
    std::vector<std::string> open{full_name(service.scope, service.name)};
    std::set<std::string> seen{open.front()};
    while (!open.empty()) {
      const auto heirs = heirs_.find(open.back());
      open.pop_back();
      if (heirs == heirs_.end()) {
        continue;
      }
      for (const std::string& heir : heirs->second) {
        if (!seen.insert(heir).second) {
          continue;
        }
        open.push_back(heir);
        if (const auto in_model = by_name_.find(heir); in_model != by_name_.end()) {
          for (const Element& element : elements_of(*in_model->second, channel.sort)) {
            if (*element.id) {
              names[someip::value(**element.id)].insert(element.name);
            }
          }
        }
        if (const auto locked = lock_.services.find(heir); locked != lock_.services.end()) {
          for (const auto& [name, id] : locked->second.*channel.locked) {
            names[id].insert(name);
          }
        }
      }
    }
    return names;
  }

  /// Events without an eventgroup join those of what they are inherited from, else the lowest one that there
  /// is. Of what a capture or the configuration of a client alone knows, it stays open: a guess would look
  /// like something that was seen.
  void eventgroups(Service& service) {
    const auto lowest = std::ranges::min_element(service.eventgroups, {}, &Eventgroup::id);
    const bool has_some = lowest != service.eventgroups.end();
    const someip::EventgroupId id = has_some ? lowest->id : someip::EventgroupId{1};
    std::map<std::string, const std::vector<someip::EventgroupId>*> of_base;
    std::map<someip::EventgroupId, Eventgroup> known;
    if (const Service* const base = base_of(service)) {
      for (const Eventgroup& group : base->eventgroups) {
        known.emplace(group.id, group);
      }
      for (const Event& event : base->events) {
        of_base.emplace(member_key(event.name, event.selector), &event.eventgroups);
      }
      for (const Field& field : base->fields) {
        of_base.emplace(field.name + "/notifier", &field.eventgroups);
      }
    }
    std::vector<someip::EventgroupId> used;
    std::string first;
    Place place;
    std::size_t count = 0;
    const std::string name = full_name(service.scope, service.name);
    const bool is_of_client = named_.contains(name) && !offered_.contains(name);
    const auto join = [&](auto& element, const std::string& key, const Place& of_id, bool has_id) {
      if (!element.eventgroups.empty() ||
          (!element.payload.known && (element.observed_bytes || is_of_client))) {
        return;
      }
      if (const auto inherited = of_base.find(key);
          inherited != of_base.end() && !inherited->second->empty()) {
        element.eventgroups = *inherited->second;
        used.insert(used.end(), element.eventgroups.begin(), element.eventgroups.end());
        return;
      }
      element.eventgroups = {id};
      used.push_back(id);
      if (element.observed_bytes) {
        warning(element.place,
                fmt::format("{}.{}: the capture does not tell its eventgroup; 0x{:04x} is taken",
                            service.name, element.name, someip::value(id)));
      } else if (has_some || has_id) {  // somebody has chosen ids, and has left this out
        if (++count == 1) {
          first = element.name;
          place = place_of_id(of_id, element.place);
        }
      }
    };
    for (Event& event : service.events) {
      join(event, member_key(event.name, event.selector), event.id_place, event.id.has_value());
    }
    for (Field& field : service.fields) {
      if (field.has_notifier) {
        join(field, field.name + "/notifier", field.notifier_place, field.notifier.has_value());
      }
    }
    if (count > 0) {
      warning(place, fmt::format("{}.{}{} in no eventgroup: 0x{:04x} is taken", service.name, first,
                                 count == 1 ? " is" : fmt::format(" and {} more are", count - 1),
                                 someip::value(id)));
    }
    for (const someip::EventgroupId one : used) {
      if (std::ranges::find(service.eventgroups, one, &Eventgroup::id) == service.eventgroups.end()) {
        service.eventgroups.push_back(
            known.contains(one) ? known.at(one) : Eventgroup{.name = "all", .id = one, .id_is_chosen = true});
      }
    }
    std::ranges::sort(service.eventgroups, {}, &Eventgroup::id);
  }

  void instance(const Service& service) {
    const std::string name = full_name(service.scope, service.name);
    if (!named_.contains(name) && !(service.id && nameless_.contains(*service.id))) {
      named_.insert(name);
      model_.instances.push_back({.service = name,
                                  .service_id = service.id,
                                  .id = someip::InstanceId{1},
                                  .id_is_chosen = true,
                                  .place = service.place});
    }
  }

  /// Instances that are provided without an id: the lowest free one of their service.
  void instances() {
    const auto of = [](const Instance& one) { return std::pair{one.service, one.service_id}; };
    std::map<std::pair<std::string, std::optional<someip::ServiceId>>, Numbers> numbers;
    for (const Instance& one : model_.instances) {
      if (one.id) {
        numbers.try_emplace(of(one), 1, 0xfffe).first->second.take(someip::value(*one.id));
      }
    }
    for (Instance& one : model_.instances) {
      if (one.id || one.role != Instance::Role::provided || (one.service.empty() && !one.service_id)) {
        continue;
      }
      const auto id = numbers.try_emplace(of(one), 1, 0xfffe).first->second.next();
      if (id) {
        one.id = someip::InstanceId{*id};
        one.id_is_chosen = true;
        warning(one.place,
                fmt::format("an instance of {} has no id: 0x{:04x} is taken",
                            one.service.empty() ? fmt::format("0x{:04x}", someip::value(*one.service_id))
                                                : one.service,
                            *id));
      } else {
        none_left(one.place, "instance", one.service);
      }
    }
  }

  void warning(const Place& place, std::string text) {
    problems_.push_back({.severity = documents::Problem::Severity::warning,
                         .file = place.file < model_.files.size() ? model_.files[place.file] : std::string{},
                         .mark = place.mark,
                         .text = std::move(text)});
  }

  void none_left(const Place& place, const char* what, const std::string& name) {
    problems_.push_back({.file = place.file < model_.files.size() ? model_.files[place.file] : std::string{},
                         .mark = place.mark,
                         .text = fmt::format("no {} id is left for {}", what, documents::quote(name))});
  }

  Model& model_;
  IdLock& lock_;
  std::map<std::string, Service*, std::less<>> by_name_{};
  std::map<std::string, std::set<std::string>> heirs_{};  ///< of each service: who extends it
  std::set<std::string, std::less<>> named_{};            ///< services that have instances: by name
  std::set<someip::ServiceId> nameless_{};                ///< and by id
  std::set<std::string, std::less<>> offered_{};          ///< services that somebody provides
  std::vector<documents::Problem> problems_{};
};

documents::Format<std::uint64_t> id_format() {
  return documents::id_number(0, 0xffff);
}

/// Where an id of a lock file stands, and what has it.
struct LockedPlace {
  std::string name;
  documents::Mark mark{};
};

/// Those of one service.
struct LockedPlaces {
  std::map<std::uint16_t, LockedPlace> methods{};
  std::map<std::uint16_t, LockedPlace> events{};
};

constexpr const char* what_to_do = "remove the line of one that nobody uses yet, and another id is chosen";

void read_ids(const YAML::Node& node, const char* name, documents::Problems& problems, IdsByName& into,
              std::map<std::uint16_t, LockedPlace>& places) {
  if (!node.IsDefined()) {
    return;
  }
  documents::Section section{node, name, problems};
  for (const std::string& key : section.keys()) {
    std::uint64_t number = 0;
    if (!section.require(key.c_str(), id_format(), number)) {
      continue;
    }
    const auto id = static_cast<std::uint16_t>(number);
    into.emplace(key, id);
    const documents::Mark mark = section.value_mark(key.c_str());
    if (const auto [other, is_new] = places.try_emplace(id, LockedPlace{key, mark}); !is_new) {
      problems.error(mark, fmt::format("{}: 0x{:04x} of {} is that of {} in line {}, too: {}", name, id,
                                       documents::quote(key), documents::quote(other->second.name),
                                       other->second.mark.line, what_to_do));
    }
  }
}

void tell_reserved(const std::string& service, const LockedPlaces& places, documents::Problems& problems) {
  for (const auto& [of, sort] :
       {std::pair{&LockedPlaces::methods, IdSort::called}, std::pair{&LockedPlaces::events, IdSort::sent}}) {
    std::vector<IdUse> uses;
    for (const auto& [id, place] : places.*of) {
      uses.push_back({place.name, someip::MethodId{id}, {0, place.mark}});
    }
    tell_reserved_members(service, uses, sort, problems);
  }
}

/// A service inherits what it has no id of its own for.
void check_inherited(const IdLock& lock, const std::map<std::string, LockedPlaces, std::less<>>& places,
                     documents::Problems& problems) {
  const auto check = [&](const std::string& service, IdsByName LockedIds::*ids,
                         std::map<std::uint16_t, LockedPlace> LockedPlaces::*of, const char* what) {
    const auto& own = places.find(service)->second.*of;
    std::set<std::string, std::less<>> known;
    const auto add_names = [&](const IdsByName& names) {
      for (const auto& [name, id] : names) {
        known.insert(name);
      }
    };
    auto at = lock.services.find(service);
    add_names(at->second.*ids);
    for (std::size_t steps = 0; steps < max_type_nesting; ++steps) {
      at = lock.services.find(at->second.base);
      if (at == lock.services.end() || at->first == service) {
        return;
      }
      for (const auto& [id, place] : places.find(at->first)->second.*of) {
        const auto other = own.find(id);
        if (!known.contains(place.name) && other != own.end()) {
          problems.error(
              other->second.mark,
              fmt::format("{}: 0x{:04x} of {} is that of {} of {}, which {} extends, in line {}, "
                          "too: {}",
                          what, id, documents::quote(other->second.name), documents::quote(place.name),
                          at->first, service, place.mark.line, what_to_do));
        }
      }
      add_names(at->second.*ids);
    }
  };
  for (const auto& [service, ids] : lock.services) {
    if (!ids.base.empty()) {
      check(service, &LockedIds::methods, &LockedPlaces::methods, "methods");
      check(service, &LockedIds::events, &LockedPlaces::events, "events");
    }
  }
}

}  // namespace

std::optional<IdLock> read_id_lock(const std::string& file, const std::string& text,
                                   std::vector<documents::Problem>& told) {
  IdLock lock;
  documents::Problems problems{file};
  std::map<std::uint16_t, LockedPlace> services;
  std::map<std::string, LockedPlaces, std::less<>> places;
  if (const YAML::Node node = documents::parse_document(text, "'services'", problems)) {
    documents::Section top{node, "", problems};
    for (const YAML::Node& element : top.required_list("services", "a list of services")) {
      documents::Section section{element, "services", problems};
      std::string name;
      section.require("name", documents::any_text("the full name of a service"), name);
      LockedIds ids;
      LockedPlaces at;
      if (std::uint64_t id = 0; section.read("id", id_format(), id)) {
        ids.service = static_cast<std::uint16_t>(id);
        const documents::Mark mark = section.value_mark("id");
        tell_reserved_service(name, someip::ServiceId{*ids.service}, {0, mark}, problems);
        if (const auto [other, is_new] = services.try_emplace(*ids.service, LockedPlace{name, mark});
            !is_new && other->second.name != name) {
          problems.error(mark, fmt::format("id: 0x{:04x} of {} is that of {} in line {}, too: {}", id, name,
                                           other->second.name, other->second.mark.line, what_to_do));
        }
      }
      section.read("extends", documents::any_text("the full name of a service"), ids.base);
      read_ids(section.child("methods"), "methods", problems, ids.methods, at.methods);
      read_ids(section.child("events"), "events", problems, ids.events, at.events);
      tell_reserved(name, at, problems);
      section.finish();
      if (!lock.services.emplace(name, std::move(ids)).second) {
        problems.error(section.mark(),
                       fmt::format("{} is listed twice: make one list of both", documents::quote(name)));
      }
      places.emplace(name, std::move(at));
    }
    top.finish();
    check_inherited(lock, places, problems);
  }
  const bool is_good = !problems.has_errors();
  std::ranges::move(problems.take(), std::back_inserter(told));
  return is_good ? std::optional{std::move(lock)} : std::nullopt;
}

std::string to_text(const IdLock& lock) {
  YAML::Emitter out;
  const auto id = [](std::uint16_t number) { return fmt::format("0x{:04x}", number); };
  const auto ids = [&](const char* name, const IdsByName& all) {
    if (all.empty()) {
      return;
    }
    out << YAML::Key << name << YAML::Value << YAML::BeginMap;
    for (const auto& [element, number] : all) {
      out << YAML::Key << element << YAML::Value << id(number);
    }
    out << YAML::EndMap;
  };
  out << YAML::BeginMap << YAML::Key << "services" << YAML::Value << YAML::BeginSeq;
  for (const auto& [name, service] : lock.services) {
    out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << name;
    if (service.service) {
      out << YAML::Key << "id" << YAML::Value << id(*service.service);
    }
    if (!service.base.empty()) {
      out << YAML::Key << "extends" << YAML::Value << service.base;
    }
    ids("methods", service.methods);
    ids("events", service.events);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string{comment} + out.c_str() + "\n";
}

std::vector<documents::Problem> allocate_ids(Model& model, IdLock& lock, IdRange services) {
  return Allocation{model, lock}.run(services);
}

}  // namespace trestle::describe
