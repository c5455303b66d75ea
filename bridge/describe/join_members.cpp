#include "bridge/describe/join_members.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "bridge/describe/protection.hpp"
#include "bridge/documents/format.hpp"

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

void compare_protections(std::string_view message, const Protection& first, const Place& first_at,
                         const Protection& second, const Place& second_at, Contradictions& contradictions) {
  contradictions.compare(message, "the E2E profile", {first.profile, first_at}, {second.profile, second_at});
  const auto common = [&](const auto& all, const auto& others) {
    for (const auto& [key, value] : all) {
      if (const auto other = others.find(key); other != others.end()) {
        contradictions.compare(message, fmt::format("for E2E the {}", key),
                               {fmt::format("{}", value), first_at},
                               {fmt::format("{}", other->second), second_at});
      }
    }
  };
  common(first.numbers, second.numbers);
  common(first.words, second.words);
}

namespace {

/// Two descriptions of one message: what the first does not say is taken from the second.
class Message {
 public:
  /// @param name  "Door.moved"
  Message(std::string name, const Place& first, const Place& second, Contradictions& contradictions)
      : name_{std::move(name)}, first_{first}, second_{second}, contradictions_{contradictions} {}

  /// The same with other places.
  [[nodiscard]] Message at(Place first, Place second) const {
    return {name_, first, second, contradictions_};
  }

  void transfer(Transfer& to, const Transfer& from) const {
    if (to == Transfer{} && !to.transport_at) {
      to = from;  // nobody said which transport
      return;
    }
    const auto word = [](Transport transport) { return transport == Transport::tcp ? "TCP" : "UDP"; };
    said("the transport", to.transport, to.transport_at, from.transport, from.transport_at, word);
    const auto bytes = [](std::uint32_t count) { return fmt::to_string(count); };
    said("the bytes of a segment", to.segment_bytes, to.segment_bytes_at, from.segment_bytes,
         from.segment_bytes_at, bytes);
    said("the retention time", to.retention, to.retention_at, from.retention, from.retention_at, time_text);
    given("the time between segments", to.separation, from.separation, time_text);
    given("the debounce time", to.debounce, from.debounce, time_text);
  }

  void protection(Protection& to, const Protection& from) const {
    // A description of one host, such as a vsomeip JSON, has that of its instance.
    const auto is_of_an_instance = [](const Protection& one, const Protection& all) {
      return one.of_instances.empty() && std::ranges::any_of(all.of_instances, [&](const auto& its) {
               return first_difference(one, its.second).empty();
             });
    };
    if (to.empty() || is_of_an_instance(to, from)) {
      to = from;
      return;
    }
    if (from.empty() || is_of_an_instance(from, to)) {
      return;
    }
    compare_protections(name_, to, first_, from, second_, contradictions_);
    for (const auto& [instance, its] : from.of_instances) {
      const auto [known, is_new] = to.of_instances.try_emplace(instance, its);
      if (!is_new) {
        compare_protections(name_, known->second, first_, its, second_, contradictions_);
      }
    }
  }

  template <typename Time>
  void time(const char* what, std::optional<Time>& to, const std::optional<Time>& from) const {
    if (to && from) {
      differ(what, time_text(*to), time_text(*from));
    }
    fill(to, from);
  }

  /// A message may be in several.
  void eventgroups(std::vector<someip::EventgroupId>& to,
                   const std::vector<someip::EventgroupId>& from) const {
    const auto is_in = [](const std::vector<someip::EventgroupId>& all) {
      return [&all](someip::EventgroupId one) { return std::ranges::find(all, one) != all.end(); };
    };
    if (!to.empty() && !from.empty() && std::ranges::none_of(from, is_in(to))) {
      const auto text = [](const std::vector<someip::EventgroupId>& all) {
        std::string ids;
        for (const someip::EventgroupId one : all) {
          ids += fmt::format("{}0x{:04x}", ids.empty() ? "" : " and ", someip::value(one));
        }
        return ids;
      };
      differ("the eventgroup", text(to), text(from));
      return;
    }
    std::ranges::remove_copy_if(from, std::back_inserter(to), is_in(std::vector{to}));
  }

 private:
  static std::string time_text(Duration time) { return documents::to_string(time); }

  void differ(std::string_view what, std::string first, std::string second) const {
    contradictions_.compare(name_, what, {std::move(first), first_}, {std::move(second), second_});
  }

  /// A value that may be the default of a language, unless there is a place.
  template <typename T, typename Text>
  void said(std::string_view what, T& to, std::optional<Place>& to_at, const T& from,
            const std::optional<Place>& from_at, const Text& text) const {
    if (to_at && from_at) {
      contradictions_.compare(name_, what, {text(to), *to_at}, {text(from), *from_at});
    } else if (from_at || (!to_at && to == T{} && !std::is_same_v<T, Transport>)) {
      to = from;
      to_at = from_at;
    }
  }

  /// A value that is 0 where nobody says it.
  template <typename T, typename Text>
  void given(std::string_view what, T& to, const T& from, const Text& text) const {
    if (to == T{}) {
      to = from;
    } else if (from != T{}) {
      differ(what, text(to), text(from));
    }
  }

  std::string name_;
  Place first_;
  Place second_;
  Contradictions& contradictions_;
};

/// What one description knows of the members of another one, by their ids.
class Members {
 public:
  Members(Service& to, Contradictions& contradictions) : to_{to}, contradictions_{contradictions} {
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
    const auto add_to = [&](auto& known, Transfer& transfer, const Place& of_id) {
      const Message message = message_of(known, event.place);
      message.transfer(transfer, event.transfer);
      // They are said where the id is.
      message.at(of_id, place_of_id(event.id_place, event.place))
          .eventgroups(known.eventgroups, event.eventgroups);
      message.protection(known.e2e, event.e2e);
      message.time("the cycle", known.cycle, event.cycle);
      fill(known.observed_bytes, event.observed_bytes);
      fill(known.notes, event.notes);
    };
    if (Event* const known = find(events_, to_.events, event.id)) {
      add_to(*known, known->transfer, place_of_id(known->id_place, known->place));
      return true;
    }
    if (Field* const known = find(notifiers_, to_.fields, event.id)) {
      add_to(*known, known->notifier_transfer, place_of_id(known->notifier_place, known->place));
      return true;
    }
    return false;
  }

  bool add_method(const Method& method) {
    if (Method* const known = find(methods_, to_.methods, method.id)) {
      const Message message = message_of(*known, method.place);
      message.transfer(known->request_transfer, method.request_transfer);
      message.transfer(known->response_transfer, method.response_transfer);
      message.protection(known->e2e, method.e2e);
      message.time("the timeout", known->timeout, method.timeout);
      fill(known->observed_bytes, method.observed_bytes);
      fill(known->notes, method.notes);
      return true;
    }
    // A getter answers with the value; a setter is asked with it, and answers with it.
    Field* const read = find(getters_, to_.fields, method.id);
    Field* const written = find(setters_, to_.fields, method.id);
    if (read != nullptr) {
      const Message message = message_of(*read, method.place, " (getter)");
      message.transfer(read->getter_transfer, method.response_transfer);
      message.protection(read->getter_e2e, method.e2e);
    }
    if (written != nullptr) {
      const Message message = message_of(*written, method.place, " (setter)");
      message.transfer(written->setter_transfer, method.request_transfer);
      message.protection(written->setter_e2e, method.e2e);
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
                                                        .notes = field.notes,
                                                        .place = field.place,
                                                        .id_place = field.notifier_place});
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
                           .notes = field.notes,
                           .place = field.place});
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

  template <typename Element>
  [[nodiscard]] Message message_of(const Element& known, const Place& other, const char* part = "") const {
    return {fmt::format("{}.{}{}", to_.name, known.name, part), known.place, other, contradictions_};
  }

  Service& to_;
  Contradictions& contradictions_;
  Places events_{};
  Places methods_{};
  Places getters_{};
  Places setters_{};
  Places notifiers_{};
};

}  // namespace

void add_service(Service& to, const Service& from, Contradictions& contradictions) {
  if (!to.has_version && from.has_version) {
    to.has_version = true;
    to.major = from.major;
    to.minor = from.minor;
  }
  fill(to.notes, from.notes);
  Members{to, contradictions}.add(from);
}

}  // namespace trestle::describe
