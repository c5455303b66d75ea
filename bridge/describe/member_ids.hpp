#pragma once
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model.hpp"

/// All ids that the members of a service have or lack, in one order.
namespace trestle::describe {

/// Calls for each id by which something is called: of methods, getters and setters.
/// @param service  a Service, const or not.
/// @param use      is called with the member_key() or the name of the field; "getter", "setter" or ""; the id
///                 that it has or lacks, which it can be given where the service is not const; where the
///                 member stands, and where the id does.
template <typename OfService, typename Use>
void each_called_id(OfService& service, const Use& use) {
  for (auto& method : service.methods) {
    use(member_key(method.name, method.selector), "", method.id, method.place, method.id_place);
  }
  for (auto& field : service.fields) {
    if (field.has_getter) {
      use(field.name, "getter", field.getter, field.place, field.getter_place);
    }
    if (field.has_setter) {
      use(field.name, "setter", field.setter, field.place, field.setter_place);
    }
  }
}

/// And for each by which something is sent: of events, and of notifiers ("notifier").
template <typename OfService, typename Use>
void each_sent_id(OfService& service, const Use& use) {
  for (auto& event : service.events) {
    use(member_key(event.name, event.selector), "", event.id, event.place, event.id_place);
  }
  for (auto& field : service.fields) {
    if (field.has_notifier) {
      use(field.name, "notifier", field.notifier, field.place, field.notifier_place);
    }
  }
}

}  // namespace trestle::describe
