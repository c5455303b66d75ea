#include "bridge/describe/eventgroup_members.hpp"

#include <algorithm>

namespace trestle::describe {

std::string members_of(const Service& service, someip::EventgroupId eventgroup) {
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

}  // namespace trestle::describe
