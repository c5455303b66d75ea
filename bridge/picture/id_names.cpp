#include "bridge/picture/id_names.hpp"

namespace trestle::carry {
namespace {

void name_by(const std::map<std::uint16_t, std::string>& names, std::uint16_t id, std::string& into) {
  if (const auto found = names.find(id); found != names.end()) {
    into = found->second;
  }
}

}  // namespace

void IdNames::add(std::uint16_t id, std::uint32_t major, Service service) {
  services_.try_emplace({id, major}, std::move(service));
}

std::string IdNames::member(std::uint16_t service, std::uint32_t major, std::uint16_t id) const {
  const auto found = services_.find({service, major});
  if (found == services_.end()) {
    return {};
  }
  std::string name;
  name_by(found->second.members, id, name);
  return name.empty() ? name : found->second.name + "." + name;
}

const IdNames::Service* IdNames::any_version(std::uint16_t id) const {
  const auto found = services_.lower_bound({id, 0});
  return found != services_.end() && found->first.first == id ? &found->second : nullptr;
}

std::string IdNames::service(std::uint16_t id) const {
  const Service* const found = any_version(id);
  return found == nullptr ? std::string{} : found->name;
}

std::string IdNames::eventgroup(std::uint16_t service, std::uint16_t id) const {
  std::string name;
  if (const Service* const found = any_version(service)) {
    name_by(found->eventgroups, id, name);
  }
  return name;
}

void IdNames::name(RoutePicture& route) const {
  const auto found = services_.find({route.service, route.major});
  if (found == services_.end()) {
    return;
  }
  const Service& service = found->second;
  route.service_name = service.name;
  route.service_id_is_chosen = service.id_is_chosen;
  route.member_id_is_chosen = service.chosen_members.contains(route.member);
  route.eventgroup_id_is_chosen = service.chosen_eventgroups.contains(route.eventgroup);
  name_by(service.members, route.member, route.member_name);
  name_by(service.eventgroups, route.eventgroup, route.eventgroup_name);
}

}  // namespace trestle::carry
