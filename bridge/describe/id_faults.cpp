#include "bridge/describe/id_faults.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>

#include "bridge/describe/join.hpp"

namespace trestle::describe {

IdFaults::Uses IdFaults::uses_of(const Service& service, IdSort sort) {
  Uses uses;
  each_id(service, sort,
          [&uses](const std::string& member, std::string_view part, const std::optional<someip::MethodId>& id,
                  const Place& place, const Place& of_id) {
            if (id) {
              uses.push_back({part.empty() ? member : fmt::format("{} ({})", member, part), *id,
                              place_of_id(of_id, place)});
            }
          });
  return uses;
}

void IdFaults::tell_same(const Service& service) {
  tell_same(service, uses_of(service, IdSort::called));
  tell_same(service, uses_of(service, IdSort::sent));
}

void IdFaults::tell_same(const Service& service, const Uses& uses) {
  std::map<someip::MethodId, const IdUse*> first;
  for (const IdUse& use : uses) {
    const auto [other, is_new] = first.try_emplace(use.id, &use);
    if (!is_new && (use.place.mark.line == 0 ||
                    told_.insert({spot_of(use.place), spot_of(other->second->place)}).second)) {
      problems_.error(use.place, fmt::format("{}.{} has the id 0x{:04x} of {}.{}, at {}", service.name,
                                             use.member, someip::value(use.id), service.name,
                                             other->second->member, to_string(model_, other->second->place)));
    }
  }
}

void IdFaults::tell_reserved(const Service& service) {
  if (service.id) {
    tell_reserved_service(service.name, *service.id, place_of_id(service.id_place, service.place), problems_);
  }
  for (const Eventgroup& group : service.eventgroups) {
    if (!someip::names_an_eventgroup(group.id)) {
      problems_.error(
          place_of_id(group.place, service.place),
          fmt::format("service {} has the eventgroup 0x{:04x}, which is {}: give it another id", service.name,
                      someip::value(group.id),
                      group.id == someip::EventgroupId{0} ? "reserved" : "that of all eventgroups"));
    }
  }
  for (const IdSort sort : {IdSort::called, IdSort::sent}) {
    tell_reserved_members(service.name, uses_of(service, sort), sort, problems_);
  }
}

void tell_reserved_service(std::string_view service, someip::ServiceId id, const Place& place,
                           documents::Problems& problems) {
  if (!someip::names_a_service(id)) {
    problems.error(
        place,
        fmt::format("service {} has the id 0x{:04x}, which is {}: give it another one", service,
                    someip::value(id),
                    id == someip::ServiceId{0} ? "reserved" : "that of service discovery and magic cookies"));
  } else if (id == someip::ServiceId{0xfffe}) {
    problems.warning(
        place,
        fmt::format(
            "service {} has the id 0xfffe, by which service discovery announces services of other protocols",
            service));
  }
}

void tell_reserved_members(std::string_view service, const std::vector<IdUse>& uses, IdSort sort,
                           documents::Problems& problems) {
  const bool are_events = sort == IdSort::sent;
  const IdUse* misplaced = nullptr;
  std::size_t others = 0;
  for (const IdUse& use : uses) {
    const std::uint16_t id = someip::value(use.id);
    if ((id & 0x7fffU) == 0 || (id & 0x7fffU) == 0x7fff) {
      problems.warning(use.place,
                       fmt::format("{}.{} has the id 0x{:04x}, which is reserved: other stacks may refuse it",
                                   service, use.member, id));
    } else if ((id >= 0x8000) != are_events) {
      others += misplaced == nullptr ? 0 : 1;
      misplaced = misplaced == nullptr ? &use : misplaced;
    }
  }
  if (misplaced != nullptr) {  // said once: whoever does so does it everywhere
    problems.warning(misplaced->place,
                     fmt::format("{}.{} has the id 0x{:04x}{}: {}", service, misplaced->member,
                                 someip::value(misplaced->id),
                                 others == 0 ? "" : fmt::format(", and {} more like it", others),
                                 are_events ? "events have bit 15, from 0x8001 on"
                                            : "methods have no bit 15, from 0x0001 to 0x7ffe"));
  }
}

}  // namespace trestle::describe
