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

void IdNames::name(RoutePicture& route) const {
  const auto found = services_.find({route.service, route.major});
  if (found == services_.end()) {
    return;
  }
  const Service& service = found->second;
  route.service_name = service.name;
  name_by(service.members, route.member, route.member_name);
  name_by(service.eventgroups, route.eventgroup, route.eventgroup_name);
}

}  // namespace trestle::carry
