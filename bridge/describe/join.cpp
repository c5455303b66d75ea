#include "bridge/describe/join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

namespace trestle::describe {
namespace {

template <typename T>
void fill(std::optional<T>& to, const std::optional<T>& from) {
  if (!to) {
    to = from;
  }
}

/// Has ids and no types: what vsomeip JSON and captures know of a service.
bool is_bare(const Service& service) {
  const auto empty = [](const Payload& payload) { return payload.values.empty(); };
  return std::ranges::all_of(service.events, [&](const Event& event) { return empty(event.payload); }) &&
         std::ranges::all_of(
             service.methods,
             [&](const Method& method) { return empty(method.request) && empty(method.response); }) &&
         std::ranges::all_of(service.fields, [&](const Field& field) { return empty(field.payload); });
}

/// Made by a reader from the id, as there is no name.
bool has_made_name(const Service& service) {
  return service.scope.empty() && service.id &&
         service.name == fmt::format("service_{:04x}", someip::value(*service.id));
}

void add_transfer(Transfer& to, const Transfer& from) {
  if (to == Transfer{}) {
    to = from;
  }
}

/// The first element of each id.
template <typename Element, typename Id>
auto first_of_each(std::vector<Element>& elements, Id id) {
  std::map<std::decay_t<decltype(elements.front().*id)>, Element*> first;
  for (Element& element : elements) {
    first.try_emplace(element.*id, &element);
  }
  return first;
}

/// What `from` knows of the members of `to`, by their ids.
void add_members(Service& to, const Service& from) {
  std::set<someip::EventgroupId> groups;
  for (const Eventgroup& eventgroup : to.eventgroups) {
    groups.insert(eventgroup.id);
  }
  for (const Eventgroup& eventgroup : from.eventgroups) {
    if (groups.insert(eventgroup.id).second) {
      to.eventgroups.push_back(eventgroup);
    }
  }
  std::ranges::sort(to.eventgroups, {}, &Eventgroup::id);
  const auto events = first_of_each(to.events, &Event::id);
  const auto fields = first_of_each(to.fields, &Field::notifier);
  const auto methods = first_of_each(to.methods, &Method::id);
  for (const Event& event : from.events) {
    if (const auto same = events.find(event.id); same != events.end()) {
      Event& known = *same->second;
      add_transfer(known.transfer, event.transfer);
      if (known.eventgroups.empty()) {
        known.eventgroups = event.eventgroups;
      }
      if (known.e2e.profile.empty()) {
        known.e2e = event.e2e;
      }
      fill(known.cycle, event.cycle);
      fill(known.observed_bytes, event.observed_bytes);
    } else if (const auto field = fields.find(event.id); field != fields.end()) {
      Field& known = *field->second;
      add_transfer(known.notifier_transfer, event.transfer);
      if (known.eventgroups.empty()) {
        known.eventgroups = event.eventgroups;
      }
      if (known.e2e.profile.empty()) {
        known.e2e = event.e2e;
      }
      fill(known.observed_bytes, event.observed_bytes);
    }
  }
  for (const Method& method : from.methods) {
    if (const auto same = methods.find(method.id); same != methods.end()) {
      Method& known = *same->second;
      add_transfer(known.request_transfer, method.request_transfer);
      add_transfer(known.response_transfer, method.response_transfer);
      if (known.e2e.profile.empty()) {
        known.e2e = method.e2e;
      }
      fill(known.observed_bytes, method.observed_bytes);
    }
  }
}

void add_instance(Instance& to, const Instance& from) {
  fill(to.service_id, from.service_id);
  fill(to.address, from.address);
  fill(to.udp_port, from.udp_port);
  fill(to.tcp_port, from.tcp_port);
  fill(to.major, from.major);
  fill(to.minor, from.minor);
  fill(to.timing, from.timing);
  fill(to.priority, from.priority);
  fill(to.weight, from.weight);
  if (to.multicast.empty()) {
    to.multicast = from.multicast;
  }
  if (to.eventgroups.empty()) {
    to.eventgroups = from.eventgroups;
  }
  to.configuration.insert(from.configuration.begin(), from.configuration.end());
  if (to.machine.empty()) {
    to.machine = from.machine;
  }
  if (to.name.empty()) {
    to.name = from.name;
  }
}

class Joining {
 public:
  explicit Joining(Model& model) : model_{model} {}

  std::vector<documents::Problem> run() {
    services();
    index();
    for (Instance& instance : model_.instances) {
      name_service(instance);
    }
    instances();
    for (const Service& service : model_.services) {
      members(service);
    }
    depth();
    inheritance();
    return std::move(problems_);
  }

 private:
  void services() {
    std::vector<Service> bare;
    std::vector<Service> kept;
    for (Service& service : model_.services) {
      (has_made_name(service) && is_bare(service) ? bare : kept).push_back(std::move(service));
    }
    std::map<std::string, const Service*, std::less<>> by_name;
    std::map<someip::ServiceId, const Service*> by_id;
    for (Service& service : kept) {
      if (const auto [other, is_new] = by_name.try_emplace(full_name(service.scope, service.name), &service);
          !is_new) {
        error(service.place, fmt::format("service {} is described twice, also at {}", other->first,
                                         to_string(model_, other->second->place)));
        continue;
      }
      if (service.id) {
        if (const auto [other, is_new] = by_id.try_emplace(*service.id, &service);
            !is_new && other->second->major == service.major) {
          error(service.place, fmt::format("service {} has the id 0x{:04x} of {}, at {}", service.name,
                                           someip::value(*service.id), other->second->name,
                                           to_string(model_, other->second->place)));
        }
      }
    }
    std::map<std::optional<someip::ServiceId>, std::size_t> places;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      places.try_emplace(kept[i].id, i);
    }
    for (Service& service : bare) {
      const auto [place, is_new] = places.try_emplace(service.id, kept.size());
      if (is_new) {
        kept.push_back(std::move(service));
      } else {
        add_members(kept[place->second], service);
      }
    }
    model_.services = std::move(kept);
  }

  void index() {
    for (const Service& service : model_.services) {
      by_name_.try_emplace(full_name(service.scope, service.name), &service);
      if (service.id) {
        by_id_.try_emplace(*service.id, &service);
      }
    }
  }

  /// Instances that know an id alone get the name, and the reverse.
  void name_service(Instance& instance) const {
    if (const auto named = by_name_.find(instance.service); named != by_name_.end()) {
      fill(instance.service_id, named->second->id);
    } else if (instance.service_id) {
      if (const auto same = by_id_.find(*instance.service_id); same != by_id_.end()) {
        instance.service = full_name(same->second->scope, same->second->name);
      }
    }
  }

  void instances() {
    std::vector<Instance> kept;
    using Key = std::tuple<Instance::Role, std::string, std::optional<someip::InstanceId>,
                           std::optional<someip::ServiceId>>;
    struct Alike {
      std::optional<std::size_t> first{};
      std::map<std::string, std::set<std::size_t>> by_machine{};  ///< an empty name may be any
    };
    std::map<Key, Alike> places;
    for (Instance& instance : model_.instances) {
      auto& [first, alike] = places[Key{instance.role, instance.service, instance.id, instance.service_id}];
      std::optional<std::size_t> same = instance.machine.empty() ? first : std::nullopt;
      for (const std::string& machine : {instance.machine, std::string{}}) {
        const auto found = alike.find(machine);
        if (found != alike.end() && (!same || *found->second.begin() < *same)) {
          same = *found->second.begin();
        }
      }
      if (!same) {
        first = first.value_or(kept.size());
        alike[instance.machine].insert(kept.size());
        kept.push_back(std::move(instance));
        continue;
      }
      Instance& known = kept[*same];
      const std::string before = known.machine;
      add_instance(known, instance);
      if (known.machine != before) {
        alike[before].erase(*same);
        if (alike[before].empty()) {
          alike.erase(before);
        }
        alike[known.machine].insert(*same);
      }
    }
    model_.instances = std::move(kept);
  }

  void members(const Service& service) {
    std::map<someip::MethodId, std::pair<std::string, Place>> taken;
    const auto take = [&](const std::optional<someip::MethodId>& id, const std::string& name,
                          const Place& place) {
      if (!id) {
        return;
      }
      if (const auto [other, is_new] = taken.try_emplace(*id, name, place); !is_new) {
        error(place,
              fmt::format("{}.{} has the id 0x{:04x} of {}.{}, at {}", service.name, name, someip::value(*id),
                          service.name, other->second.first, to_string(model_, other->second.second)));
      }
    };
    for (const Method& method : service.methods) {
      take(method.id, method.name, method.place);
    }
    for (const Event& event : service.events) {
      take(event.id, event.name, event.place);
    }
    for (const Field& field : service.fields) {
      if (field.has_getter) {
        take(field.getter, field.name + " (getter)", field.place);
      }
      if (field.has_setter) {
        take(field.setter, field.name + " (setter)", field.place);
      }
      if (field.has_notifier) {
        take(field.notifier, field.name + " (notifier)", field.place);
      }
    }
  }

  /// What works on types goes as deep as they are.
  void depth() {
    constexpr std::size_t open = std::size_t(-1);  // its parts are looked at: what uses itself goes no deeper
    std::vector<std::size_t> heights(model_.types.size(), 0);
    for (std::size_t first = 0; first < model_.types.size(); ++first) {
      std::vector<std::size_t> path{first};
      while (!path.empty()) {
        const std::size_t at = path.back();
        const Type& type = model_.types[at];
        std::size_t height = 1;
        bool complete = true;
        const auto look = [&](TypeIndex part) {
          const auto index = static_cast<std::size_t>(part);
          if (part == no_type || index >= heights.size()) {
            return;
          }
          if (heights[index] == 0) {
            complete = false;
            path.push_back(index);
          } else if (heights[index] != open) {
            height = std::max(height, heights[index] + 1);
          }
        };
        if (heights[at] != 0 && heights[at] != open) {
          path.pop_back();
          continue;
        }
        heights[at] = open;
        look(type.base);
        look(type.element.type);
        look(type.key.type);
        for (const Value& member : type.members) {
          look(member.type);
        }
        if (complete) {
          heights[at] = height;
          path.pop_back();
          if (height == max_type_nesting + 1) {
            error(type.place, fmt::format("types are nested more than {} deep", max_type_nesting));
          }
        }
      }
    }
  }

  /// Each type that extends others has their members, too: what works on all of them takes all of these.
  void inheritance() {
    std::size_t all = 0;
    for (const Type& type : model_.types) {
      const Type* part = &type;
      for (std::size_t steps = 0; part->base != no_type && steps < max_type_nesting; ++steps) {
        part = &resolved(model_, part->base);
        all += part->members.size() + part->enumerators.size();
      }
      if (all > max_inherited_members) {
        error(type.place,
              fmt::format("types have inherited more than {} members up to here", max_inherited_members));
        return;
      }
    }
  }

  void error(const Place& place, std::string text) {
    problems_.push_back({.file = place.file < model_.files.size() ? model_.files[place.file] : std::string{},
                         .mark = place.mark,
                         .text = std::move(text)});
  }

  Model& model_;
  std::map<std::string, const Service*, std::less<>> by_name_{};
  std::map<someip::ServiceId, const Service*> by_id_{};
  std::vector<documents::Problem> problems_{};
};

}  // namespace

std::vector<documents::Problem> join(Model& model) {
  return Joining{model}.run();
}

std::string to_string(const Model& model, const Place& place) {
  if (place.file >= model.files.size()) {
    return {};
  }
  const std::string& file = model.files[place.file];
  return place.mark.line == 0 ? file : fmt::format("{}:{}:{}", file, place.mark.line, place.mark.column);
}

}  // namespace trestle::describe
