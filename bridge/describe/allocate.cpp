#include "bridge/describe/allocate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

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

  void take(std::uint16_t id) { taken_.insert(id); }
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
    }
    for (Service* const one : bases_first()) {
      Service& service = *one;
      LockedIds& locked = lock_.services[full_name(service.scope, service.name)];
      inherit(service, locked);
      members(service, methods_of(service), locked.methods, {0x0001, 0x7fff}, "method");
      members(service, events_of(service), locked.events, {0x8001, 0xfffe}, "event");
      eventgroups(service);
      instance(service);
      if (!locked.service && locked.methods.empty() && locked.events.empty()) {
        lock_.services.erase(full_name(service.scope, service.name));
      }
    }
    return std::move(problems_);
  }

 private:
  void services(IdRange range) {
    Numbers numbers{range.first, range.last};
    std::set<std::uint16_t> given;
    std::vector<std::pair<std::string, Service*>> without;
    for (Service& service : model_.services) {
      if (service.id) {
        numbers.take(someip::value(*service.id));
        given.insert(someip::value(*service.id));
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
      if (locked && given.contains(*locked)) {
        locked.reset();  // the model gives it to another one now
      }
      if (!locked) {
        locked = numbers.next(range.first + hash(name) % (range.last - range.first + 1U));
      }
      if (locked) {
        service->id = someip::ServiceId{*locked};
        service->id_is_chosen = true;
      } else {
        none_left(service->place, "service", name);
      }
    }
  }

  /// All services, each behind the one that it extends.
  std::vector<Service*> bases_first() {
    for (Service& service : model_.services) {
      by_name_.emplace(full_name(service.scope, service.name), &service);
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

  /// What a service has of the one that it extends has the id that it has there: FDEPL says it once. Not
  /// where the service uses that id for something else, or has got another one before.
  void inherit(Service& service, const LockedIds& locked) {
    Service* const base = base_of(service);
    if (base == nullptr) {
      return;
    }
    const auto take = [&](const std::vector<Element>& own, const std::vector<Element>& inherited,
                          const std::map<std::string, std::uint16_t, std::less<>>& chosen) {
      std::set<someip::MethodId> given;
      for (const auto& [name, id] : chosen) {
        given.insert(someip::MethodId{id});
      }
      std::map<std::string_view, someip::MethodId> known;
      for (const Element& element : own) {
        if (*element.id) {
          given.insert(**element.id);
        }
      }
      for (const Element& element : inherited) {
        if (*element.id) {
          known.emplace(element.name, **element.id);
        }
      }
      for (const Element& element : own) {
        const auto found = known.find(element.name);
        if (!*element.id && !chosen.contains(element.name) && found != known.end() &&
            given.insert(found->second).second) {
          *element.id = found->second;
          if (base->chosen_ids.contains(found->second)) {
            service.chosen_ids.insert(found->second);
          }
        }
      }
    };
    take(methods_of(service), methods_of(*base), locked.methods);
    take(events_of(service), events_of(*base), locked.events);
  }

  static std::vector<Element> methods_of(Service& service) {
    std::vector<Element> all;
    for (Method& method : service.methods) {
      all.push_back({member_key(method.name, method.selector), &method.id});
    }
    for (Field& field : service.fields) {
      if (field.has_getter) {
        all.push_back({field.name + "/getter", &field.getter});
      }
      if (field.has_setter) {
        all.push_back({field.name + "/setter", &field.setter});
      }
    }
    return all;
  }
  static std::vector<Element> events_of(Service& service) {
    std::vector<Element> all;
    for (Event& event : service.events) {
      all.push_back({member_key(event.name, event.selector), &event.id});
    }
    for (Field& field : service.fields) {
      if (field.has_notifier) {
        all.push_back({field.name + "/notifier", &field.notifier});
      }
    }
    return all;
  }

  void members(Service& service, const std::vector<Element>& elements,
               std::map<std::string, std::uint16_t, std::less<>>& locked, IdRange range, const char* what) {
    Numbers numbers{range.first, range.last};
    std::set<std::uint16_t> given;
    for (const Element& element : elements) {
      if (*element.id) {
        numbers.take(someip::value(**element.id));
        given.insert(someip::value(**element.id));
      }
    }
    for (const auto& [name, id] : locked) {
      numbers.take(id);
    }
    for (const Element& element : elements) {
      if (*element.id) {
        continue;
      }
      auto kept = locked.find(element.name);
      if (kept != locked.end() && given.contains(kept->second)) {
        locked.erase(kept);  // the model gives it to another one now
        kept = locked.end();
      }
      if (kept == locked.end()) {
        const std::optional<std::uint16_t> id = numbers.next();
        if (!id) {
          none_left(service.place, what, element.name);
          return;
        }
        kept = locked.emplace(element.name, *id).first;
      }
      *element.id = someip::MethodId{kept->second};
      service.chosen_ids.insert(**element.id);
    }
  }

  /// Events without an eventgroup join the lowest one that there is. Of what a capture alone knows, it stays
  /// open: a guess would look like something that was seen.
  void eventgroups(Service& service) {
    const auto lowest = std::ranges::min_element(service.eventgroups, {}, &Eventgroup::id);
    const someip::EventgroupId id =
        lowest == service.eventgroups.end() ? someip::EventgroupId{1} : lowest->id;
    bool used = false;
    const auto join = [&](auto& element) {
      if (!element.eventgroups.empty() || (element.observed_bytes && !element.payload.known)) {
        return;
      }
      element.eventgroups = {id};
      used = true;
      if (element.observed_bytes) {
        warning(element.place,
                fmt::format("{}.{}: the capture does not tell its eventgroup; 0x{:04x} is taken",
                            service.name, element.name, someip::value(id)));
      }
    };
    for (Event& event : service.events) {
      join(event);
    }
    for (Field& field : service.fields) {
      if (field.has_notifier) {
        join(field);
      }
    }
    if (used && service.eventgroups.empty()) {
      service.eventgroups.push_back({.name = "all", .id = id, .id_is_chosen = true});
    }
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
  std::set<std::string, std::less<>> named_{};  ///< services that have instances: by name
  std::set<someip::ServiceId> nameless_{};      ///< and by id
  std::vector<documents::Problem> problems_{};
};

documents::Format<std::uint64_t> id_format() {
  return documents::id_number(1, 0xffff);
}

void read_ids(const YAML::Node& node, const char* name, documents::Problems& problems,
              std::map<std::string, std::uint16_t, std::less<>>& into) {
  if (!node.IsDefined()) {
    return;
  }
  documents::Section section{node, name, problems};
  for (const std::string& key : section.keys()) {
    std::uint64_t id = 0;
    if (section.require(key.c_str(), id_format(), id)) {
      into.emplace(key, static_cast<std::uint16_t>(id));
    }
  }
}

}  // namespace

tl::expected<IdLock, std::vector<documents::Problem>> read_id_lock(const std::string& file,
                                                                   const std::string& text) {
  IdLock lock;
  documents::Problems problems{file};
  if (const YAML::Node node = documents::parse_document(text, "'services'", problems)) {
    documents::Section top{node, "", problems};
    for (const YAML::Node& element : top.required_list("services", "a list of services")) {
      documents::Section section{element, "services", problems};
      std::string name;
      section.require("name", documents::any_text("the full name of a service"), name);
      LockedIds ids;
      if (std::uint64_t id = 0; section.read("id", id_format(), id)) {
        ids.service = static_cast<std::uint16_t>(id);
      }
      read_ids(section.child("methods"), "methods", problems, ids.methods);
      read_ids(section.child("events"), "events", problems, ids.events);
      section.finish();
      if (!lock.services.emplace(name, std::move(ids)).second) {
        problems.error(section.mark(), fmt::format("{} is listed twice", documents::quote(name)));
      }
    }
    top.finish();
  }
  if (problems.has_errors()) {
    return tl::unexpected{problems.take()};
  }
  return lock;
}

std::string to_text(const IdLock& lock) {
  YAML::Emitter out;
  const auto id = [](std::uint16_t number) { return fmt::format("0x{:04x}", number); };
  const auto ids = [&](const char* name, const std::map<std::string, std::uint16_t, std::less<>>& all) {
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
