#include "bridge/describe/join_members.hpp"

#include <algorithm>
#include <map>
#include <type_traits>
#include <utility>

namespace trestle::describe {

void fill(Notes& to, const Notes& from) {
  if (to.description.empty()) {
    to.description = from.description;
  }
  if (to.unit.empty()) {
    to.unit = from.unit;
  }
  to.others.insert(from.others.begin(), from.others.end());
}

void fill(std::vector<someip::EventgroupId>& to, const std::vector<someip::EventgroupId>& from) {
  if (to.empty()) {
    to = from;
  }
}

namespace {

void add_transfer(Transfer& to, const Transfer& from) {
  if (to == Transfer{}) {
    to = from;  // nobody said which transport
    return;
  }
  const auto take = [](auto& known, const auto& other) {
    if (known == std::decay_t<decltype(known)>{}) {
      known = other;
    }
  };
  take(to.segment_bytes, from.segment_bytes);
  take(to.separation, from.separation);
  take(to.debounce, from.debounce);
  take(to.retention, from.retention);
}

void add_protection(Protection& to, const Protection& from) {
  if (to.profile.empty()) {
    to = from;
  }
}

/// What one description knows of the members of another one, by their ids.
class Members {
 public:
  explicit Members(Service& to) : to_{to} {
    for (std::size_t at = 0; at < to.events.size(); ++at) {
      note(events_, to.events[at].id, at);
    }
    for (std::size_t at = 0; at < to.methods.size(); ++at) {
      note(methods_, to.methods[at].id, at);
    }
    for (std::size_t at = 0; at < to.fields.size(); ++at) {
      note(getters_, to.fields[at].getter, at);
      note(setters_, to.fields[at].setter, at);
      note(notifiers_, to.fields[at].notifier, at);
    }
  }

  void add(const Service& from) {
    eventgroups(from);
    for (const Event& event : from.events) {
      if (event.id && !add_event(event)) {
        note(events_, event.id, to_.events.size());
        to_.events.push_back(event);
      }
    }
    for (const Field& field : from.fields) {
      add_field(field);
    }
    for (const Method& method : from.methods) {
      if (method.id && !add_method(method)) {
        note(methods_, method.id, to_.methods.size());
        to_.methods.push_back(method);
      }
    }
  }

 private:
  using Places = std::map<someip::MethodId, std::size_t>;

  static void note(Places& places, const std::optional<someip::MethodId>& id, std::size_t at) {
    if (id) {
      places.try_emplace(*id, at);
    }
  }

  template <typename Element>
  static Element* find(const Places& places, std::vector<Element>& elements,
                       const std::optional<someip::MethodId>& id) {
    const auto found = id ? places.find(*id) : places.end();
    return found == places.end() ? nullptr : &elements[found->second];
  }

  void eventgroups(const Service& from) {
    std::map<someip::EventgroupId, std::size_t> groups;
    for (std::size_t at = 0; at < to_.eventgroups.size(); ++at) {
      groups.try_emplace(to_.eventgroups[at].id, at);
    }
    for (const Eventgroup& eventgroup : from.eventgroups) {
      const auto [at, is_new] = groups.try_emplace(eventgroup.id, to_.eventgroups.size());
      if (is_new) {
        to_.eventgroups.push_back(eventgroup);
      } else if (Eventgroup& known = to_.eventgroups[at->second]; known.name.empty()) {
        known.name = eventgroup.name;
      }
    }
    std::ranges::sort(to_.eventgroups, {}, &Eventgroup::id);
  }

  /// @return false: nobody has this id.
  bool add_event(const Event& event) {
    const auto add_to = [&event](auto& known, Transfer& transfer) {
      add_transfer(transfer, event.transfer);
      fill(known.eventgroups, event.eventgroups);
      add_protection(known.e2e, event.e2e);
      fill(known.cycle, event.cycle);
      fill(known.observed_bytes, event.observed_bytes);
      fill(known.notes, event.notes);
    };
    if (Event* const known = find(events_, to_.events, event.id)) {
      add_to(*known, known->transfer);
      return true;
    }
    if (Field* const known = find(notifiers_, to_.fields, event.id)) {
      add_to(*known, known->notifier_transfer);
      return true;
    }
    return false;
  }

  bool add_method(const Method& method) {
    if (Method* const known = find(methods_, to_.methods, method.id)) {
      add_transfer(known->request_transfer, method.request_transfer);
      add_transfer(known->response_transfer, method.response_transfer);
      add_protection(known->e2e, method.e2e);
      fill(known->timeout, method.timeout);
      fill(known->observed_bytes, method.observed_bytes);
      fill(known->notes, method.notes);
      return true;
    }
    // A getter answers with the value; a setter is asked with it, and answers with it.
    Field* const read = find(getters_, to_.fields, method.id);
    Field* const written = find(setters_, to_.fields, method.id);
    if (read != nullptr) {
      add_transfer(read->getter_transfer, method.response_transfer);
      add_protection(read->getter_e2e, method.e2e);
    }
    if (written != nullptr) {
      add_transfer(written->setter_transfer, method.request_transfer);
      add_protection(written->setter_e2e, method.e2e);
    }
    if (Field* const known = read != nullptr ? read : written) {
      fill(known->observed_bytes, method.observed_bytes);
      fill(known->notes, method.notes);
      return true;
    }
    return false;
  }

  /// Its parts, each as what has the same id.
  void add_field(const Field& field) {
    Field rest = field;
    if (field.has_notifier) {
      rest.has_notifier = field.notifier && !add_event({.name = field.name,
                                                        .id = field.notifier,
                                                        .eventgroups = field.eventgroups,
                                                        .transfer = field.notifier_transfer,
                                                        .cycle = field.cycle,
                                                        .observed_bytes = field.observed_bytes,
                                                        .e2e = field.e2e,
                                                        .notes = field.notes});
    }
    const auto add_part = [&](bool& there, const std::optional<someip::MethodId>& id,
                              const Transfer& transfer, const Protection& e2e) {
      there = there && id &&
              !add_method({.name = field.name,
                           .id = id,
                           .request_transfer = transfer,
                           .response_transfer = transfer,
                           .observed_bytes = field.observed_bytes,
                           .e2e = e2e,
                           .notes = field.notes});
    };
    add_part(rest.has_getter, field.getter, field.getter_transfer, field.getter_e2e);
    add_part(rest.has_setter, field.setter, field.setter_transfer, field.setter_e2e);
    if (!rest.has_notifier && !rest.has_getter && !rest.has_setter) {
      return;
    }
    for (const auto& [there, id] : {std::pair{rest.has_notifier, &rest.notifier},
                                    {rest.has_getter, &rest.getter},
                                    {rest.has_setter, &rest.setter}}) {
      if (!there) {
        id->reset();
      }
    }
    note(notifiers_, rest.notifier, to_.fields.size());
    note(getters_, rest.getter, to_.fields.size());
    note(setters_, rest.setter, to_.fields.size());
    to_.fields.push_back(std::move(rest));
  }

  Service& to_;
  Places events_{};
  Places methods_{};
  Places getters_{};
  Places setters_{};
  Places notifiers_{};
};

}  // namespace

void add_service(Service& to, const Service& from) {
  if (!to.has_version && from.has_version) {
    to.has_version = true;
    to.major = from.major;
    to.minor = from.minor;
  }
  fill(to.notes, from.notes);
  Members{to}.add(from);
}

}  // namespace trestle::describe
