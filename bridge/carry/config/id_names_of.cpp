#include "bridge/carry/config/id_names_of.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/describe/member_names.hpp"

namespace trestle::carry {
namespace {

using someip::value;

IdNames::Service names_of(const describe::Service& service, std::string name) {
  IdNames::Service names{
      .name = std::move(name), .members = {}, .eventgroups = {}, .id_is_chosen = service.id_is_chosen};
  for (const someip::MethodId id : service.chosen_ids) {
    names.chosen_members.insert(value(id));
  }
  for (const describe::Eventgroup& group : service.eventgroups) {
    if (group.id_is_chosen) {
      names.chosen_eventgroups.insert(value(group.id));
    }
  }
  const auto add_groups = [&](const std::vector<someip::EventgroupId>& groups) {
    for (const someip::EventgroupId group : groups) {
      names.eventgroups.try_emplace(value(group), describe::title_of(&service, group).text);
    }
  };
  const auto add = [&](const std::optional<someip::MethodId>& id, std::string member) {
    if (id) {
      names.members.try_emplace(value(*id), std::move(member));
    }
  };
  for (const describe::Event& event : service.events) {
    add(event.id, describe::member_key(event.name, event.selector));
    add_groups(event.eventgroups);
  }
  for (const describe::Method& method : service.methods) {
    add(method.id, describe::member_key(method.name, method.selector));
  }
  for (const describe::Field& field : service.fields) {
    add(field.has_getter ? field.getter : std::nullopt, field.name + ".get");
    add(field.has_setter ? field.setter : std::nullopt, field.name + ".set");
    add(field.has_notifier ? field.notifier : std::nullopt, field.name + ".notify");
    add_groups(field.eventgroups);
  }
  return names;
}

}  // namespace

IdNames id_names_of(const describe::Model& model) {
  std::map<std::string, std::size_t, std::less<>> count;
  for (const describe::Service& service : model.services) {
    ++count[service.name];
  }
  IdNames names;
  for (const describe::Service& service : model.services) {
    if (service.id) {
      names.add(
          value(*service.id), service.major,
          names_of(service, count[service.name] == 1 ? service.name
                                                     : describe::full_name(service.scope, service.name)));
    }
  }
  return names;
}

}  // namespace trestle::carry
