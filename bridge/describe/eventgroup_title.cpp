#include "bridge/describe/eventgroup_title.hpp"

#include <algorithm>

namespace trestle::describe {
namespace {

std::string what_is_in(const Service& service, someip::EventgroupId eventgroup) {
  constexpr std::size_t most = 4;
  std::size_t count = 0;
  std::string text;
  const auto add = [&](const auto& member) {
    if (std::ranges::find(member.eventgroups, eventgroup) == member.eventgroups.end()) {
      return;
    }
    if (++count <= most) {
      text += (text.empty() ? "" : ", ") + member.name;
    } else if (count == most + 1) {
      text += ", …";
    }
  };
  std::ranges::for_each(service.events, add);
  std::ranges::for_each(service.fields, add);
  return text;
}

}  // namespace

EventgroupTitle title_of(const Service* service, someip::EventgroupId eventgroup) {
  if (service == nullptr) {
    return {};
  }
  const auto found = std::ranges::find(service->eventgroups, eventgroup, &Eventgroup::id);
  if (found != service->eventgroups.end() && !found->name.empty()) {
    return {found->name, true};
  }
  return {what_is_in(*service, eventgroup)};
}

}  // namespace trestle::describe
