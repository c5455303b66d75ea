#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model.hpp"

/// All ids that the members of a service have or lack, in one order.
namespace trestle::describe {

/// What a client calls, and what it is sent: each has ids of its own in a service.
enum class IdSort : std::uint8_t {
  called,  ///< of methods, getters and setters
  sent,    ///< of events and notifiers
};

/// A part of a field that has an id of its own.
struct FieldPart {
  const char* name;
  IdSort sort;
  bool Field::*is_there;
  std::optional<someip::MethodId> Field::*id;
  Place Field::*id_place;
};

inline constexpr std::array field_parts{
    FieldPart{"getter", IdSort::called, &Field::has_getter, &Field::getter, &Field::getter_place},
    FieldPart{"setter", IdSort::called, &Field::has_setter, &Field::setter, &Field::setter_place},
    FieldPart{"notifier", IdSort::sent, &Field::has_notifier, &Field::notifier, &Field::notifier_place},
};

/// Calls for each id of a sort.
/// @param service  a Service, const or not.
/// @param use      is called with the member_key() or the name of the field; the FieldPart::name or ""; the
///                 id that it has or lacks, which it can be given where the service is not const; where the
///                 member stands, and where the id does.
template <typename OfService, typename Use>
void each_id(OfService& service, IdSort sort, const Use& use) {
  const auto each_whole = [&use](auto& members) {
    for (auto& member : members) {
      use(member_key(member.name, member.selector), "", member.id, member.place, member.id_place);
    }
  };
  if (sort == IdSort::called) {
    each_whole(service.methods);
  } else {
    each_whole(service.events);
  }
  for (auto& field : service.fields) {
    for (const FieldPart& part : field_parts) {
      if (part.sort == sort && field.*part.is_there) {
        use(field.name, part.name, field.*part.id, field.place, field.*part.id_place);
      }
    }
  }
}

}  // namespace trestle::describe
