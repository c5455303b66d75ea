#include "bridge/describe/join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "bridge/describe/compare.hpp"
#include "bridge/describe/compare_said.hpp"
#include "bridge/describe/contradictions.hpp"
#include "bridge/describe/id_faults.hpp"
#include "bridge/describe/join_instances.hpp"
#include "bridge/describe/join_members.hpp"
#include "bridge/describe/wide_enumerators.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe {
namespace {

/// Has ids and no types: what vsomeip JSON and captures know of a service.
bool is_bare(const Service& service) {
  const auto empty = [](const Payload& payload) { return payload.values.empty(); };
  return std::ranges::all_of(service.events, [&](const Event& event) { return empty(event.payload); }) &&
         std::ranges::all_of(
             service.methods,
             [&](const Method& method) { return empty(method.request) && empty(method.response); }) &&
         std::ranges::all_of(service.fields, [&](const Field& field) { return empty(field.payload); });
}

class Joining {
 public:
  /// @param has_errors  reading it has found some, so that parts of services may be missing.
  Joining(Model& model, bool has_errors) : model_{model}, has_errors_{has_errors} {}

  std::vector<documents::Problem> run() {
    names();
    services();
    index();
    for (Instance& instance : model_.instances) {
      name_service(instance);
    }
    machines();
    instances();
    ids();
    if (has_errors_) {  // a type that was not understood may be another one here
      return std::move(problems_);
    }
    depth();
    if (inheritance()) {
      tell([&](documents::Problems& problems) { tell_of_wide_enumerators(model_, problems); });
    }
    return std::move(problems_);
  }

 private:
  /// Names stand in messages, in answers on a terminal and in files of other languages.
  void names() {
    constexpr std::size_t most_told = 100;
    std::set<std::string, std::less<>> told;  // an event and its only value may have one name
    const auto check = [&](std::string_view name, const Place& place) {
      if (documents::has_control(name) && told.size() < most_told && told.emplace(name).second) {
        error(place, fmt::format("a control character, or one that is not UTF-8, is in the name {}",
                                 documents::quote(name)));
      }
    };
    const auto check_all = [&](const auto& elements) {
      for (const auto& one : elements) {
        check(one.name, one.place);
      }
    };
    for (const Type& type : model_.types) {
      check(type.scope, type.place);
      check_all(type.members);
      check_all(type.enumerators);
    }
    for (const Service& service : model_.services) {
      check(service.scope, service.place);
      for (const std::string& name : service.namespaces) {
        check(name, service.place);
      }
      check_all(service.methods);
      check_all(service.events);
      check_all(service.fields);
      check_all(service.eventgroups);
      for (const Method& method : service.methods) {
        check_all(method.request.values);
        check_all(method.response.values);
        check(method.selector, method.place);
      }
      for (const Event& event : service.events) {
        check_all(event.payload.values);
        check(event.selector, event.place);
      }
      for (const Field& field : service.fields) {
        check_all(field.payload.values);
      }
    }
    check_all(model_.types);
    check_all(model_.services);
    check_all(model_.instances);
    check_all(model_.machines);
    check_all(model_.constants);
  }

  void services() {
    std::vector<Service> bare;
    std::vector<Service> kept;
    for (Service& service : model_.services) {
      (has_made_name(service) && is_bare(service) ? bare : kept).push_back(std::move(service));
    }
    tell_of_twins(kept);
    std::map<std::optional<someip::ServiceId>, std::size_t> places;
    std::map<std::pair<std::optional<someip::ServiceId>, std::uint8_t>, std::size_t> versions;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      places.try_emplace(kept[i].id, i);
      versions.try_emplace({kept[i].id, kept[i].major}, i);
    }
    for (Service& service : bare) {
      const auto [place, is_new] = places.try_emplace(service.id, kept.size());
      if (is_new) {
        kept.push_back(std::move(service));
        continue;
      }
      const auto same = service.has_version ? versions.find({service.id, service.major}) : versions.end();
      add_service(kept[same == versions.end() ? place->second : same->second], service, contradictions_);
    }
    model_.services = std::move(kept);
  }

  /// Services that are described twice. Where both say the same, as the FIDL and the ARXML of one service do,
  /// the first stays.
  void tell_of_twins(std::vector<Service>& kept) {
    std::map<std::string, Service*, std::less<>> by_name;
    std::map<std::pair<someip::ServiceId, std::uint8_t>, Service*> by_id;
    std::vector<Service> twins;
    std::vector<bool> is_twin(kept.size());
    for (std::size_t at = 0; at < kept.size(); ++at) {
      Service& service = kept[at];
      const std::string name = full_name(service.scope, service.name);
      const auto named = by_name.find(name);
      const auto numbered = service.id ? by_id.find({*service.id, service.major}) : by_id.end();
      const bool same_id = numbered != by_id.end() && !extends(kept, service, *numbered->second) &&
                           !extends(kept, *numbered->second, service);
      Service* const other = named != by_name.end() ? named->second : same_id ? numbered->second : nullptr;
      if (other == nullptr) {
        by_name.emplace(name, &service);
        if (service.id) {
          by_id.emplace(std::pair{*service.id, service.major}, &service);
        }
        continue;
      }
      const bool other_file = service.place.file != other->place.file;
      if (other_file && service.name == other->name && say_the_same(*other, service)) {
        add_service(*other, service, contradictions_);
        is_twin[at] = true;
        twin_of_[name] = full_name(other->scope, other->name);
        // Between two languages scopes say nothing: those of ARXML are paths, those of FIDL packages.
        if (named == by_name.end() &&
            comparing::language_of(model_, service.place) == comparing::language_of(model_, other->place)) {
          warning(
              place_of_id(service.id_place, service.place),
              fmt::format("service {} is taken for {}, at {}: both have the id 0x{:04x}, and describe the "
                          "same; if it is another service, it needs an id of its own",
                          name, twin_of_[name], to_string(model_, place_of_id(other->id_place, other->place)),
                          someip::value(*service.id)));
        }
        continue;
      }
      if (named == by_name.end() && (has_more(service, *other) || has_more(*other, service))) {
        warning(place_of_id(service.id_place, service.place),
                fmt::format("service {} has the id 0x{:04x} of {}, at {}; one of them has all members of the "
                            "other, as if it extended it",
                            service.name, someip::value(*service.id), other->name,
                            to_string(model_, place_of_id(other->id_place, other->place))));
        by_name.emplace(name, &service);
        continue;
      }
      const bool is_same_in_other_file = other_file && service.name == other->name;
      if (is_same_in_other_file && has_errors_) {
        continue;
      }
      const char* const hint = is_same_in_other_file ? ": name one of the two files" : "";
      if (named != by_name.end()) {
        error(service.place, fmt::format("service {} is described twice, also at {}{}", name,
                                         to_string(model_, other->place), hint));
      } else {
        error(place_of_id(service.id_place, service.place),
              fmt::format("service {} has the id 0x{:04x} of {}, at {}{}", service.name,
                          someip::value(*service.id), other->name,
                          to_string(model_, place_of_id(other->id_place, other->place)), hint));
        by_name.emplace(name, &service);
      }
    }
    std::vector<Service> others;
    for (std::size_t at = 0; at < kept.size(); ++at) {
      (is_twin[at] ? twins : others).push_back(std::move(kept[at]));
    }
    kept = std::move(others);
    if (!twins.empty()) {
      drop_types_of(twins, kept);
      for (Instance& instance : model_.instances) {
        if (const auto twin = twin_of_.find(instance.service); twin != twin_of_.end()) {
          instance.service = twin->second;
        }
      }
    }
  }

  /// Whether one of FIDL's interfaces has all that another one has: who offers it may do so under the id of
  /// that one.
  static bool extends(const std::vector<Service>& all, const Service& heir, const Service& other) {
    const std::string wanted = full_name(other.scope, other.name);
    std::string base = heir.base;
    for (std::size_t steps = 0; !base.empty() && steps < max_type_nesting; ++steps) {
      if (base == wanted) {
        return true;
      }
      const auto next = std::ranges::find_if(
          all, [&](const Service& one) { return full_name(one.scope, one.name) == base; });
      base = next == all.end() ? std::string{} : next->base;
    }
    return false;
  }

  /// Whether `heir` has all that `other` has, and more: so do FIDL's interfaces that extend one, in the words
  /// of other languages, which copy the members.
  bool has_more(const Service& heir, const Service& other) {
    constexpr std::size_t max_heirs = 100;  // each is compared with all members of the first
    const auto size = [](const Service& service) {
      return service.methods.size() + service.events.size() + service.fields.size();
    };
    const auto has_all = [](const auto& members, const auto& of_other, const auto& ids) {
      using Ids = std::invoke_result_t<decltype(ids), decltype(members.front())>;
      std::set<std::pair<std::string, Ids>> known;
      for (const auto& member : members) {
        known.emplace(member.name, ids(member));
      }
      return std::ranges::all_of(of_other, [&](const auto& member) {
        return known.contains({member.name, ids(member)});
      });
    };
    const auto id = [](const auto& member) { return member.id; };
    const auto field_ids = [](const Field& field) {
      return std::tuple{field.getter, field.setter, field.notifier};
    };
    if (size(other) == 0 || size(heir) <= size(other) || ++heirs_compared_ > max_heirs) {
      return false;
    }
    return has_all(heir.methods, other.methods, id) && has_all(heir.events, other.events, id) &&
           has_all(heir.fields, other.fields, field_ids);
  }

  /// Whether nobody on the wire could tell two descriptions apart.
  bool say_the_same(const Service& one, const Service& other) {
    constexpr std::size_t max_twins = 16;  // each is compared with all types at hand
    if (++twins_compared_ > max_twins) {
      return false;
    }
    const auto alone = [this](const Service& service) {
      Model model{.files = model_.files, .types = model_.types};
      model.services = {service};
      model.services[0].scope.clear();
      return model;
    };
    return std::ranges::all_of(compare(alone(one), alone(other), MissingId::different),
                               [](const Change& change) { return change.rule->wire == Impact::none; });
  }

  /// Calls for each type that a service uses, of its payloads.
  template <typename Use>
  static void each_use(std::vector<Service>& services, const Use& use) {
    const auto payload = [&](Payload& of) {
      for (Value& value : of.values) {
        use(value.type);
      }
    };
    for (Service& service : services) {
      for (Event& event : service.events) {
        payload(event.payload);
      }
      for (Method& method : service.methods) {
        payload(method.request);
        payload(method.response);
        use(method.error);
      }
      for (Field& field : service.fields) {
        payload(field.payload);
      }
    }
  }
  /// And for each that a type uses.
  template <typename Use>
  static void each_part(Type& type, const Use& use) {
    for (TypeIndex* const part : {&type.base, &type.variant_of, &type.element.type, &type.key.type}) {
      use(*part);
    }
    for (Value& member : type.members) {
      use(member.type);
    }
  }
  std::vector<bool> types_of(std::vector<Service>& services, const std::vector<Constant>& constants = {}) {
    std::vector<bool> used(model_.types.size());
    std::vector<std::size_t> open;
    const auto use = [&](TypeIndex type) {
      const auto at = static_cast<std::size_t>(type);
      if (at < used.size() && !used[at]) {
        used[at] = true;
        open.push_back(at);
      }
    };
    each_use(services, use);
    for (const Constant& constant : constants) {
      use(constant.type);
    }
    while (!open.empty()) {
      Type& type = model_.types[open.back()];
      open.pop_back();
      each_part(type, use);
    }
    return used;
  }

  /// Types of `gone` that nothing else uses: there would be two of each name.
  void drop_types_of(std::vector<Service>& gone, std::vector<Service>& kept) {
    const std::vector<bool> of_gone = types_of(gone);
    const std::vector<bool> of_kept = types_of(kept, model_.constants);
    std::vector<TypeIndex> places(model_.types.size(), no_type);
    std::vector<Type> types;
    for (std::size_t at = 0; at < model_.types.size(); ++at) {
      if (of_kept[at] || !of_gone[at]) {
        places[at] = static_cast<TypeIndex>(types.size());
        types.push_back(std::move(model_.types[at]));
      }
    }
    const auto move = [&places](TypeIndex& type) {
      if (const auto at = static_cast<std::size_t>(type); at < places.size()) {
        type = places[at];
      }
    };
    model_.types = std::move(types);
    for (Type& type : model_.types) {
      each_part(type, move);
    }
    for (Constant& constant : model_.constants) {
      move(constant.type);
    }
    each_use(kept, move);
  }

  void index() {
    for (const Service& service : model_.services) {
      by_name_.try_emplace(full_name(service.scope, service.name), &service);
      if (service.id) {
        by_id_.try_emplace(*service.id, &service);
        by_version_.try_emplace({*service.id, service.major}, &service);
      }
    }
  }

  /// Instances that know an id alone get the name, and the reverse.
  void name_service(Instance& instance) const {
    if (const auto named = by_name_.find(instance.service); named != by_name_.end()) {
      fill(instance.service_id, named->second->id);
    } else if (instance.service_id) {
      const auto version =
          instance.major ? by_version_.find({*instance.service_id, *instance.major}) : by_version_.end();
      const auto any = by_id_.find(*instance.service_id);
      if (const Service* same = version != by_version_.end() ? version->second
                                : any != by_id_.end()        ? any->second
                                                             : nullptr) {
        instance.service = full_name(same->scope, same->name);
      }
    }
  }

  /// Instances of one service, id and role, by what may tell them apart: machine, address and major version.
  /// [feat_req_someipcompat_803]
  class Alike {
   public:
    /// The first that does not contradict `instance`. An empty name, no address and no version may be any.
    [[nodiscard]] std::optional<std::size_t> first_like(const Instance& instance) const {
      const bool any_machine = instance.machine.empty();
      const bool any_address = !instance.address;
      const bool any_major = !instance.major;
      std::optional<std::size_t> first;
      for (const MachineOrAll& machine :
           {any_machine ? MachineOrAll{} : MachineOrAll{instance.machine}, MachineOrAll{""}}) {
        for (const AddressOrAll& address : {any_address ? AddressOrAll{} : AddressOrAll{instance.address},
                                            AddressOrAll{std::optional<IpAddress>{}}}) {
          for (const MajorOrAll& major : {any_major ? MajorOrAll{} : MajorOrAll{instance.major},
                                          MajorOrAll{std::optional<std::uint8_t>{}}}) {
            const auto found = at_.find({machine, address, major});
            if (found != at_.end() && (!first || *found->second.begin() < *first)) {
              first = *found->second.begin();
            }
          }
        }
      }
      return first;
    }

    void insert(const Instance& instance, std::size_t index) {
      for (const Spot& spot : spots_of(instance)) {
        at_[spot].insert(index);
      }
    }

    void erase(const Instance& instance, std::size_t index) {
      for (const Spot& spot : spots_of(instance)) {
        if (const auto found = at_.find(spot);
            found != at_.end() && found->second.erase(index) > 0 && found->second.empty()) {
          at_.erase(found);
        }
      }
    }

   private:
    using MachineOrAll = std::optional<std::string>;                ///< nothing: all
    using AddressOrAll = std::optional<std::optional<IpAddress>>;   ///< nothing: all
    using MajorOrAll = std::optional<std::optional<std::uint8_t>>;  ///< nothing: all
    using Spot = std::tuple<MachineOrAll, AddressOrAll, MajorOrAll>;

    static std::array<Spot, 8> spots_of(const Instance& instance) {
      std::array<Spot, 8> spots;
      for (std::size_t at = 0; at < spots.size(); ++at) {
        auto& [machine, address, major] = spots[at];
        machine = (at & 1U) != 0 ? MachineOrAll{instance.machine} : MachineOrAll{};
        address = (at & 2U) != 0 ? AddressOrAll{instance.address} : AddressOrAll{};
        major = (at & 4U) != 0 ? MajorOrAll{instance.major} : MajorOrAll{};
      }
      return spots;
    }

    std::map<Spot, std::set<std::size_t>> at_{};
  };

  /// vsomeip JSON does not name its host: it is the one that has its address, if another source tells of it.
  void machines() {
    std::map<IpAddress, Machine*> known;
    for (Machine& machine : model_.machines) {
      if (machine.address && machine.place.mark.line != 0) {
        known.try_emplace(*machine.address, &machine);
      }
    }
    std::map<std::pair<std::string, IpAddress>, std::string> names;
    for (const Machine& machine : model_.machines) {
      const auto same =
          machine.address && machine.place.mark.line == 0 ? known.find(*machine.address) : known.end();
      if (same != known.end()) {
        fill(same->second->sd_multicast, machine.sd_multicast);
        fill(same->second->sd_port, machine.sd_port);
        names.emplace(std::pair{machine.name, *machine.address}, same->second->name);
      }
    }
    if (names.empty()) {
      return;
    }
    const auto name_of = [&](const std::string& name, const std::optional<IpAddress>& address) {
      return address ? names.find({name, *address}) : names.end();
    };
    for (Instance& instance : model_.instances) {
      if (const auto found = name_of(instance.machine, instance.address); found != names.end()) {
        instance.machine = found->second;
      }
    }
    std::erase_if(model_.machines, [&](const Machine& machine) {
      return machine.place.mark.line == 0 && name_of(machine.name, machine.address) != names.end();
    });
  }

  void instances() {
    tell_of_addresses(
        model_.instances,
        [this](const Instance& instance) {
          const auto service = by_name_.find(instance.service);
          return instance.major.value_or(service == by_name_.end() ? std::uint8_t{1}
                                                                   : service->second->major);
        },
        contradictions_);
    std::vector<Instance> kept;
    using Key = std::tuple<Instance::Role, std::string, std::optional<someip::InstanceId>,
                           std::optional<someip::ServiceId>>;
    std::map<Key, Alike> places;
    for (Instance& instance : model_.instances) {
      Alike& alike = places[Key{instance.role, instance.service, instance.id, instance.service_id}];
      const std::optional<std::size_t> same = alike.first_like(instance);
      if (!same) {
        alike.insert(instance, kept.size());
        kept.push_back(std::move(instance));
        continue;
      }
      Instance& known = kept[*same];
      alike.erase(known, *same);
      add_instance(known, instance, contradictions_);
      alike.insert(known, *same);
    }
    model_.instances = without_unknown_ids(std::move(kept));
  }

  /// An instance that is provided without an id is the only one with an id, if they do not contradict.
  std::vector<Instance> without_unknown_ids(std::vector<Instance> all) {
    using Key = std::pair<std::string, std::optional<someip::ServiceId>>;
    std::map<Key, std::vector<std::size_t>> known;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].id && all[i].role == Instance::Role::provided) {
        known[{all[i].service, all[i].service_id}].push_back(i);
      }
    }
    const auto agree = [](const auto& one, const auto& other) { return !one || !other || *one == *other; };
    std::vector<Instance> kept;
    std::vector<bool> is_gone(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Instance& one = all[i];
      const auto found = known.find({one.service, one.service_id});
      if (one.id || one.role != Instance::Role::provided || found == known.end() ||
          found->second.size() != 1) {
        continue;
      }
      Instance& same = all[found->second.front()];
      if (agree(same.address, one.address) && agree(same.udp_port, one.udp_port) &&
          agree(same.tcp_port, one.tcp_port)) {
        add_instance(same, one, contradictions_);
        is_gone[i] = true;
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!is_gone[i]) {
        kept.push_back(std::move(all[i]));
      }
    }
    return kept;
  }

  void ids() {
    tell([&](documents::Problems& problems) {
      IdFaults faults{model_, problems};
      for (const Service& service : model_.services) {
        faults.tell_same(service);
        faults.tell_reserved(service);
      }
    });
  }

  template <typename Check>
  void tell(const Check& check) {
    documents::Problems problems{documents::Problems::no_limit};
    check(problems);
    for (documents::Problem& problem : problems.take(model_.files)) {
      problems_.push_back(std::move(problem));
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
  /// @return whether they can.
  bool inheritance() {
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
        return false;
      }
    }
    return true;
  }

  void error(const Place& place, std::string text) {
    tell(documents::Problem::Severity::error, place, std::move(text));
  }

  void warning(const Place& place, std::string text) {
    tell(documents::Problem::Severity::warning, place, std::move(text));
  }

  void tell(documents::Problem::Severity severity, const Place& place, std::string text) {
    problems_.push_back({.severity = severity,
                         .file = place.file < model_.files.size() ? model_.files[place.file] : std::string{},
                         .mark = place.mark,
                         .text = std::move(text)});
  }

  Model& model_;
  bool has_errors_;
  Contradictions contradictions_{
      model_, [this](const Place& place, std::string text) { error(place, std::move(text)); },
      [this](const Place& place, std::string text) { warning(place, std::move(text)); }};
  std::map<std::string, const Service*, std::less<>> by_name_{};
  std::map<someip::ServiceId, const Service*> by_id_{};
  std::map<std::pair<someip::ServiceId, std::uint8_t>, const Service*> by_version_{};
  std::map<std::string, std::string, std::less<>> twin_of_{};  ///< full names
  std::size_t twins_compared_ = 0;
  std::size_t heirs_compared_ = 0;
  std::vector<documents::Problem> problems_{};
};

void add_new(std::vector<documents::Problem> more, std::vector<documents::Problem>& told) {
  std::set<std::string> known;
  for (const documents::Problem& problem : told) {
    known.insert(documents::to_string(problem));
  }
  for (documents::Problem& problem : more) {
    if (!known.contains(documents::to_string(problem))) {
      told.push_back(std::move(problem));
    }
  }
}

}  // namespace

std::vector<documents::Problem> join(Model& model) {
  return Joining{model, false}.run();
}

void join_again(Model& model, std::vector<documents::Problem>& told) {
  add_new(join(model), told);
}

void join_with_errors(Model& model, std::vector<documents::Problem>& told) {
  add_new(Joining{model, true}.run(), told);
}

std::string to_string(const Model& model, const Place& place) {
  if (place.file >= model.files.size()) {
    return {};
  }
  const std::string& file = model.files[place.file];
  return place.mark.line == 0 ? file : fmt::format("{}:{}:{}", file, place.mark.line, place.mark.column);
}

}  // namespace trestle::describe
