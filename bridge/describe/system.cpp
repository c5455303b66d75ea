#include "bridge/describe/system.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "bridge/describe/join.hpp"

namespace trestle::describe {
namespace {

template <typename Id>
void set(std::optional<Id>& id, const std::optional<std::uint16_t>& edit) {
  if (edit) {
    id = Id{*edit};
  }
}

void apply(const Edits& edits, Model& model) {
  for (Service& service : model.services) {
    const std::string name = full_name(service.scope, service.name);
    const auto found = edits.find(name);
    if (found == edits.end()) {
      continue;
    }
    const ServiceEdit& edit = found->second;
    set(service.id, edit.id);
    const auto member = [&](const std::string& which) {
      const auto at = edit.members.find(which);
      return at == edit.members.end() ? ServiceEdit::Member{} : at->second;
    };
    for (Method& method : service.methods) {
      set(method.id, member(method.name).id);
    }
    for (Event& event : service.events) {
      set(event.id, member(event.name).id);
    }
    for (Field& field : service.fields) {
      const ServiceEdit::Member ids = member(field.name);
      set(field.getter, ids.getter);
      set(field.setter, ids.setter);
      set(field.notifier, ids.notifier);
    }
    bool has_instance = false;
    for (Instance& instance : model.instances) {
      if (instance.service == name) {
        set(instance.service_id, edit.id);
        // One instance is edited: the first.
        if (!std::exchange(has_instance, true)) {
          set(instance.id, edit.instance);
        }
      }
    }
    if (!has_instance && edit.instance) {
      model.instances.push_back({.service = name,
                                 .service_id = service.id,
                                 .id = someip::InstanceId{*edit.instance},
                                 .place = service.place});
    }
  }
}

}  // namespace

System make_system(Reading reading, IdLock& lock, const SystemOptions& options) {
  System system;
  const bool was_read = reading.ok();
  system.model = std::move(reading.model);
  system.problems = std::move(reading.problems);
  if (!was_read) {
    return system;
  }
  const auto take = [&](std::vector<documents::Problem> problems) {
    system.problems.insert(system.problems.end(), std::make_move_iterator(problems.begin()),
                           std::make_move_iterator(problems.end()));
  };
  apply(options.edits, system.model);
  take(allocate_ids(system.model, lock));
  if (!options.edits.empty()) {
    take(join(system.model));  // ids that are the same now
  }
  system.lowered = lower(system.model, options.lower);
  system.good = std::ranges::none_of(system.problems, [](const documents::Problem& problem) {
    return problem.severity == documents::Problem::Severity::error;
  });
  return system;
}

}  // namespace trestle::describe
