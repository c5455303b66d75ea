#include "bridge/describe/compare_said.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bridge/describe/ros_names.hpp"

namespace trestle::describe::comparing {
namespace {

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

bool is_unknown(const Method& method) {
  return !method.request.known && !method.response.known;
}

bool has_events(const Service& service) {
  return !service.events.empty() || !service.fields.empty();
}

bool has_eventgroups(const Service& service) {
  const auto is_in_some = [](const auto& member) { return !member.eventgroups.empty(); };
  return std::ranges::any_of(service.events, is_in_some) || std::ranges::any_of(service.fields, is_in_some);
}

/// vsomeip carries what has no port within one host, by neither transport.
bool has_port(const Model& model, const Service& service) {
  return std::ranges::any_of(model.instances, [&](const Instance& instance) {
    return instance.service_id == service.id && (instance.udp_port || instance.tcp_port);
  });
}

}  // namespace

/// "a.b.C" of "/a/b/C".
std::string dotted(std::string name) {
  std::ranges::replace(name, '/', '.');
  return name.starts_with('.') ? name.substr(1) : name;
}

std::string spelled_alike(const Service& service) {
  return service.namespaces.empty() ? dotted(full_name(service.scope, service.name))
                                    : fmt::format("{}.{}", fmt::join(service.namespaces, "."), service.name);
}

bool has_same_name(const Service& old, const Service& now) {
  return spelled_alike(old) == spelled_alike(now) ||
         dotted(full_name(old.scope, old.name)) == dotted(full_name(now.scope, now.name));
}

bool have_same_members(const Service& old, const Service& now) {
  const std::set<std::string> before = names_of_members(old);
  const std::set<std::string> after = names_of_members(now);
  const auto common = static_cast<std::size_t>(
      std::ranges::count_if(before, [&](const std::string& name) { return after.contains(name); }));
  return common > 0 && 2 * common > std::max(before.size(), after.size());
}

bool is_of_routes(const Service& service) {
  const auto has_ros_name = [](const auto& member) { return !member.ros_name.empty(); };
  return !service.from_ros && (std::ranges::any_of(service.methods, has_ros_name) ||
                               std::ranges::any_of(service.events, has_ros_name) ||
                               std::ranges::any_of(service.fields, has_ros_name));
}

bool has_ids_alone(const Service& service) {
  return std::ranges::all_of(service.methods, is_unknown) &&
         std::ranges::none_of(service.events, &Payload::known, &Event::payload) &&
         std::ranges::none_of(service.fields, &Payload::known, &Field::payload) &&
         (has_made_name(service) || !service.methods.empty() || !service.events.empty() ||
          !service.fields.empty());
}

bool is_without_ids(const Service& service) {
  return !service.id &&
         std::ranges::none_of(service.methods, [](const Method& one) { return one.id.has_value(); }) &&
         std::ranges::none_of(service.events, [](const Event& one) { return one.id.has_value(); }) &&
         std::ranges::none_of(service.fields,
                              [](const Field& one) { return one.getter || one.setter || one.notifier; });
}

bool is_of_capture(const Service& service) {
  const auto is_seen = [](const auto& one) { return one.observed_bytes.has_value(); };
  return std::ranges::any_of(service.methods, is_seen) || std::ranges::any_of(service.events, is_seen) ||
         (has_made_name(service) && service.methods.empty() && !has_events(service) &&
          service.place.mark.line == 0);
}

bool is_of_capture(const Model& model) {
  return !model.services.empty() && std::ranges::all_of(model.services, [](const Service& service) {
    return has_made_name(service) && has_ids_alone(service) && is_of_capture(service);
  });
}

std::string language_of(const Model& model, const Place& place) {
  if (place.file >= model.files.size() || place.mark.line == 0) {
    return {};
  }
  const std::string& file = model.files[place.file];
  const std::size_t dot = file.rfind('.');
  std::string end =
      dot == std::string::npos || file.find('/', dot) != std::string::npos ? std::string{} : file.substr(dot);
  std::ranges::transform(end, end.begin(), [](char one) {
    return one >= 'A' && one <= 'Z' ? static_cast<char>(one - 'A' + 'a') : one;
  });
  return end;
}

Said::Said(const Model& model, const Service& service, const Service& other)
    : ids_alone{has_ids_alone(service)},
      names{!ids_alone || !has_made_name(service)},
      version{!ids_alone || service.has_version},
      members{!ids_alone || (names && has_ids_alone(other))},
      // An application of vsomeip may offer events that its configuration does not have.
      events{!ids_alone || (!is_of_capture(service) && (names || has_events(service)))},
      eventgroups{is_of_capture(service) || has_eventgroups(service)},
      transport{names || is_of_capture(service) || has_port(model, service)} {}

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

}  // namespace trestle::describe::comparing
