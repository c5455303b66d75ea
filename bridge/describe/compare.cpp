#include "bridge/describe/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "bridge/describe/change_log.hpp"
#include "bridge/describe/collecting.hpp"
#include "bridge/describe/compare_bytes.hpp"
#include "bridge/describe/compare_instances.hpp"
#include "bridge/describe/compare_pairs.hpp"
#include "bridge/describe/compare_said.hpp"
#include "bridge/describe/compare_types.hpp"
#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/format.hpp"

namespace trestle::describe {
namespace comparing {
namespace {

/// Method::error as a value.
Value error_of(const Model& model, const Method& method) {
  Value value{.type = method.error, .place = method.place};
  value.wire = is_type(model, method.error) ? model.at(method.error).wire : Wire{};
  return value;
}

class Comparison {
 public:
  Comparison(const Model& before, const Model& after, MissingId missing)
      : before_{before}, after_{after}, missing_{missing}, types_{before, after, log_} {}

  std::vector<Change> run() {
    Pairs services{before_.services, after_.services, spelled_alike,
                   [](const Service& service) {
                     return service.id ? std::optional{std::pair{*service.id, service.major}} : std::nullopt;
                   },
                   [](const Service& service) { return service.id; }};
    pair_without_ids(services.removed, services.added, services.both);
    for (const auto& [old, now] : services.both) {
      compare(*old, *now);
    }
    if (is_of_capture(before_)) {
      services.added.clear();
    }
    if (is_of_capture(after_)) {
      services.removed.clear();
    }
    for (const Service* service : services.added) {
      log_.add("service-added", service->name, {}, text_of(service->id), {}, service->place);
    }
    for (const Service* service : services.removed) {
      log_.add("service-removed", service->name, text_of(service->id), {}, service->place, {});
    }
    if (!is_of_capture(before_) && !is_of_capture(after_)) {
      InstanceComparison instances{before_, after_, log_};
      for (const auto& [old, now] : services.both) {
        instances.compare(*old, *now, can_say_the_same(*old, *now));
      }
      compare_constants(before_, after_, log_);
    }
    return log_.take();
  }

 private:
  using ServiceList = std::vector<const Service*>;

  /// Where one side alone has an id for a service, the other one is found by the last part of its name, else
  /// by what it has in it: a route file knows no packages.
  static void pair_without_ids(ServiceList& removed, ServiceList& added,
                               std::vector<std::pair<const Service*, const Service*>>& both) {
    constexpr std::size_t most = 1'000'000;  // each is compared with each
    const auto pair_where = [&](const auto& is_same) {
      if (added.size() > most / std::max<std::size_t>(removed.size(), 1)) {
        return;
      }
      for (const Service*& old : removed) {
        const auto found = std::ranges::find_if(added, [&](const Service* now) {
          return old->id.has_value() != now->id.has_value() && is_same(*old, *now);
        });
        if (found != added.end()) {
          both.emplace_back(old, *found);
          added.erase(found);
          old = nullptr;
        }
      }
      std::erase(removed, nullptr);
    };
    pair_where([](const Service& old, const Service& now) { return old.name == now.name; });
    pair_where(have_same_members);
  }

  template <typename Id>
  void ids_differ(std::string_view rule, const std::string& element, const std::optional<Id>& before,
                  const std::optional<Id>& after, Place old_place, Place new_place) {
    if ((before && after) || missing_ == MissingId::different) {
      log_.differs(rule, element, text_of(before), text_of(after), old_place, new_place);
    }
  }

  /// Two in one language, so that what one says alone is a difference.
  bool can_say_the_same(const Service& old, const Service& now) const {
    return has_ids_alone(old) == has_ids_alone(now) && old.id.has_value() == now.id.has_value() &&
           language_of(before_, old.place) == language_of(after_, now.place);
  }

  void compare(const Service& old, const Service& now) {
    const Said was{before_, old, now};
    const Said is{after_, now, old};
    known_ = {.names = was.ids_alone == is.ids_alone && was.names && is.names,
              .version = was.version && is.version,
              .old_members = was.members,
              .new_members = is.members,
              .old_events = was.events,
              .new_events = is.events,
              .eventgroups = was.eventgroups && is.eventgroups,
              .transport = was.transport && is.transport};
    // Who has ids alone may have the methods and events of the other one's fields by themselves.
    const bool old_has_less = was.ids_alone && (!is.ids_alone || is_of_capture(old));
    const bool new_has_less = is.ids_alone && (!was.ids_alone || is_of_capture(now));
    one_has_ids_ = old.id.has_value() != now.id.has_value();
    ros_names_ = one_has_ids_ && (is_of_routes(old) || is_of_routes(now));
    log_.take_names_of_ros(ros_names_);
    shared_instances_ = shared_instances(old, now);
    is_strict_ = can_say_the_same(old, now);
    types_.be_strict(is_strict_);
    const std::string& name = is.names ? now.name : old.name;
    const std::size_t left_out = log_.left_out();
    log_.leave_out_deployment(missing_ == MissingId::unknown && is_without_ids(old) != is_without_ids(now));
    compare(name, old_has_less ? with_fields(old, now) : old, new_has_less ? with_fields(now, old) : now);
    log_.leave_out_deployment(false);
    if (log_.left_out() > left_out) {
      log_.add("deployment-missing", name, text_of(old.id), text_of(now.id), old.place, now.place);
    }
  }

  /// The ids of instances that both sides have of a service.
  [[nodiscard]] std::set<someip::InstanceId> shared_instances(const Service& old, const Service& now) const {
    std::set<someip::InstanceId> before;
    for (const Instance* one : old_instances_.of(old)) {
      before.insert(one->id.value_or(someip::any_instance));
    }
    std::set<someip::InstanceId> both;
    for (const Instance* one : new_instances_.of(now)) {
      if (one->id && before.contains(*one->id)) {
        both.insert(*one->id);
      }
    }
    return both;
  }

  /// What can be compared, as both sides say it.
  struct Known {
    bool names = true;
    bool version = true;
    bool old_members = true;  ///< the old side has all methods, and all parts of fields, that there are
    bool new_members = true;
    bool old_events = true;  ///< and all events
    bool new_events = true;
    bool eventgroups = true;
    bool transport = true;
  };

  void compare(const std::string& name, const Service& old, const Service& now) {
    if (known_.names && !has_same_name(old, now) && !(ros_names_ && old.name == now.name)) {
      log_.differs("service-renamed", name, full_name(old.scope, old.name), full_name(now.scope, now.name),
                   old.place, now.place);
    }
    ids_differ("service-id", name, old.id, now.id, old.place, now.place);
    if (known_.version) {
      log_.differs("service-major", name, fmt::to_string(old.major), fmt::to_string(now.major), old.place,
                   now.place);
      log_.differs("service-minor", name, fmt::to_string(old.minor), fmt::to_string(now.minor), old.place,
                   now.place);
    }
    members(name, "method", old.methods, now.methods, [](const Method& method) { return method.id; });
    members(name, "event", old.events, now.events, [](const Event& event) { return event.id; });
    members(name, "field", old.fields, now.fields, [](const Field& field) {
      return field.notifier ? field.notifier : field.getter ? field.getter : field.setter;
    });
  }

  template <typename Member, typename Id>
  void members(const std::string& service, const std::string& kind, const std::vector<Member>& old,
               const std::vector<Member>& now, Id id) {
    Pairs pairs{old, now, [](const Member& member) { return member.name; }, id,
                [this](const Member& member) {
                  return one_has_ids_ ? std::optional{ros_field_name(member.name)} : std::nullopt;
                }};
    for (const auto& [before, after] : pairs.both) {
      const std::string element = service + "." + (known_.names || known_.new_members ? after : before)->name;
      if (known_.names) {
        log_.renamed(kind + "-renamed", element, before->name, after->name, before->place, after->place);
      }
      compare(element, *before, *after);
    }
    // A field without notifier is methods alone.
    const auto is_event = [](const Member* member) {
      if constexpr (requires { member->has_notifier; }) {
        return member->has_notifier;
      } else {
        return !requires {
          member->request;
        };
      }
    };
    std::erase_if(pairs.added, [&](const Member* member) {
      return !(is_event(member) ? known_.old_events : known_.old_members);
    });
    std::erase_if(pairs.removed, [&](const Member* member) {
      return !(is_event(member) ? known_.new_events : known_.new_members);
    });
    for (const Member* member : pairs.added) {
      log_.add(kind + "-added", service + "." + member->name, {}, text_of(id(*member)), {}, member->place);
    }
    for (const Member* member : pairs.removed) {
      log_.add(kind + "-removed", service + "." + member->name, text_of(id(*member)), {}, member->place, {});
    }
  }

  /// What many descriptions do not say: a difference between two in one language, or where both say it.
  void said_by_one(std::string_view id, const std::string& element, std::string before, std::string after,
                   Place old_place, Place new_place) {
    if (is_strict_ || (!before.empty() && !after.empty())) {
      log_.differs(id, element, std::move(before), std::move(after), old_place, new_place);
    }
  }
  template <typename Time>
  static std::string text_of_time(const std::optional<Time>& time) {
    return time ? documents::to_string(Duration{*time}) : std::string{};
  }

  void compare(const std::string& element, const Method& old, const Method& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    ids_differ("method-id", element, old.id, now.id, old.place, now.place);
    const bool both_known =
        is_known(old.request, old.observed_bytes) && is_known(now.request, now.observed_bytes);
    if (both_known && old.fire_and_forget != now.fire_and_forget) {
      const auto word = [](bool forget) {
        return std::string{forget ? "fire and forget" : "with an answer"};
      };
      log_.add("method-fire-and-forget", element, word(old.fire_and_forget), word(now.fire_and_forget),
               old.place, now.place);
    }
    const bool has_answers = !old.fire_and_forget && !now.fire_and_forget;
    transfers(
        element, {old.request_transfer, now.request_transfer},
        has_answers ? std::optional{Transfers{old.response_transfer, now.response_transfer}} : std::nullopt,
        old.place, now.place, both_known);
    said_by_one("method-timeout", element, text_of_time(old.timeout), text_of_time(now.timeout), old.place,
                now.place);
    protection(element, old.e2e, now.e2e, old.place, now.place);
    types_.payloads(element + ".request", old.request, now.request, old.place, now.place);
    if ((old.error == no_type) != (now.error == no_type)) {
      if (old.response.known && now.response.known) {
        log_.add("error-changed", element, name_of(before_, old.error), name_of(after_, now.error), old.place,
                 now.place);
      }
      types_.payloads(element + ".response", response_of(before_, old), response_of(after_, now), old.place,
                      now.place);
      return;
    }
    if (now.error != no_type) {
      types_.types(element + ".error", error_of(before_, old), error_of(after_, now), false);
    }
    types_.payloads(element + ".response", old.response, now.response, old.place, now.place);
  }

  void compare(const std::string& element, const Event& old, const Event& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    ids_differ("event-id", element, old.id, now.id, old.place, now.place);
    groups(element, old, now);
    if (is_strict_ && old.selective != now.selective) {
      const auto word = [](bool selective) {
        return std::string{selective ? "selective: to some subscribers" : "to all subscribers"};
      };
      log_.add("event-selective", element, word(old.selective), word(now.selective), old.place, now.place);
    }
    said_by_one("event-cycle", element, text_of_time(old.cycle), text_of_time(now.cycle), old.place,
                now.place);
    transfers(element, {old.transfer, now.transfer}, {}, old.place, now.place);
    protection(element, old.e2e, now.e2e, old.place, now.place);
    types_.payloads(element, old.payload, now.payload, old.place, now.place);
  }

  void compare(const std::string& element, const Field& old, const Field& now) {
    either_is_seen_ = is_seen(old) || is_seen(now);
    const auto access = [&](const char* part, bool was, const std::optional<someip::MethodId>& before,
                            bool is, const std::optional<someip::MethodId>& after) {
      if (was != is) {
        if (is ? !known_.old_members : !known_.new_members) {
          return;
        }
        log_.add(is ? "field-access-added" : "field-access-removed", element + "." + part, text_of(before),
                 text_of(after), old.place, now.place);
      } else if (is) {
        ids_differ("field-id", element + "." + part, before, after, old.place, now.place);
      }
    };
    access("getter", old.has_getter, old.getter, now.has_getter, now.getter);
    access("setter", old.has_setter, old.setter, now.has_setter, now.setter);
    access("notifier", old.has_notifier, old.notifier, now.has_notifier, now.notifier);
    if (old.has_notifier && now.has_notifier) {
      groups(element, old, now);
      said_by_one("event-cycle", element, text_of_time(old.cycle), text_of_time(now.cycle), old.place,
                  now.place);
    }
    const bool both_known =
        is_known(old.payload, old.observed_bytes) && is_known(now.payload, now.observed_bytes);
    if (old.has_getter && now.has_getter) {
      transfers(element + ".getter", {old.getter_transfer, now.getter_transfer}, {}, old.place, now.place,
                both_known);
      protection(element + ".getter", old.getter_e2e, now.getter_e2e, old.place, now.place);
    }
    if (old.has_setter && now.has_setter) {
      transfers(element + ".setter", {old.setter_transfer, now.setter_transfer}, {}, old.place, now.place,
                both_known);
      protection(element + ".setter", old.setter_e2e, now.setter_e2e, old.place, now.place);
    }
    if (old.has_notifier && now.has_notifier) {
      transfers(element + ".notifier", {old.notifier_transfer, now.notifier_transfer}, {}, old.place,
                now.place);
      protection(element, old.e2e, now.e2e, old.place, now.place);
    }
    types_.payloads(element, old.payload, now.payload, old.place, now.place);
  }

  /// Of events and fields. A capture has the eventgroups of the subscriptions that it shows, and may leave
  /// them open.
  template <typename Member>
  void groups(const std::string& element, const Member& old, const Member& now) {
    using Groups = std::vector<someip::EventgroupId>;
    const auto sorted = [](Groups ids) {
      std::ranges::sort(ids);
      return ids;
    };
    const Groups before = sorted(old.eventgroups);
    const Groups after = sorted(now.eventgroups);
    if ((!known_.eventgroups && missing_ == MissingId::unknown) || (is_seen(old) && is_seen(now))) {
      return;
    }
    if ((is_seen(old) && std::ranges::includes(after, before)) ||
        (is_seen(now) && std::ranges::includes(before, after))) {
      return;
    }
    const auto list = [](const Groups& ids) {
      std::string all;
      for (const someip::EventgroupId id : ids) {
        all += (all.empty() ? "" : ", ") + hex_of(static_cast<std::uint32_t>(id));
      }
      return all;
    };
    const bool has_more = !before.empty() && std::ranges::includes(after, before);
    log_.differs(has_more ? "event-eventgroups-added" : "event-eventgroups", element, list(before),
                 list(after), old.place, now.place);
  }

  /// Whether a capture has it: that has no segments, as it has whole messages, and does not tell what is
  /// protected.
  static bool is_seen(const Payload& payload, const std::optional<std::uint32_t>& observed_bytes) {
    return !payload.known && observed_bytes.has_value();
  }
  template <typename Member>
  static bool is_seen(const Member& member) {
    if constexpr (requires { member.request; }) {
      return is_seen(member.request, member.observed_bytes);
    } else {
      return is_seen(member.payload, member.observed_bytes);
    }
  }

  /// Whether somebody says how a method is carried. vsomeip JSON does not; a capture shows it.
  static bool is_known(const Payload& payload, const std::optional<std::uint32_t>& observed_bytes) {
    return payload.known || observed_bytes.has_value();
  }

  /// Of a kind of message, on both sides.
  struct Transfers {
    const Transfer& old;
    const Transfer& now;
  };
  /// @param answer  of a method: what changes in request and answer alike is told once.
  void transfers(const std::string& element, const Transfers& one, const std::optional<Transfers>& answer,
                 Place old_place, Place new_place, bool are_known = true) {
    // By `tell`, in the words that `word` has for them.
    const auto each = [&](const auto& word, const auto& tell) {
      const std::string before = word(one.old);
      const std::string after = word(one.now);
      if (!answer || (before == word(answer->old) && after == word(answer->now))) {
        tell(element, before, after);
        return;
      }
      tell(element + ".request", before, after);
      tell(element + ".response", word(answer->old), word(answer->now));
    };
    const auto told_as = [&](std::string_view id) {
      return [this, id, old_place, new_place](const std::string& of, const std::string& before,
                                              const std::string& after) {
        log_.differs(id, of, before, after, old_place, new_place);
      };
    };
    if (are_known && known_.transport) {
      each([](const Transfer& of) { return std::string{of.transport == Transport::tcp ? "TCP" : "UDP"}; },
           told_as("transport"));
    }
    if (either_is_seen_) {
      return;
    }
    each(
        [](const Transfer& of) {
          return fmt::format("{} bytes, {} us apart", of.segment_bytes, of.separation.count());
        },
        told_as("segmentation"));
    each(
        [](const Transfer& of) {
          return is_collected(of) ? fmt::format("at least {} us apart, at most {} us for others",
                                                of.debounce.count(), of.retention.count())
                                  : std::string{};
        },
        [&](const std::string& of, const std::string& before, const std::string& after) {
          said_by_one("collecting", of, before, after, old_place, new_place);
        });
  }

  void protection(const std::string& element, const Protection& old, const Protection& now,
                  const Place& old_place, const Place& new_place) {
    if ((old.of_instances.empty() && now.of_instances.empty()) || shared_instances_.empty()) {
      protection_settings(element, old, now, old_place, new_place);
      return;
    }
    for (const someip::InstanceId id : shared_instances_) {
      protection_settings(fmt::format("{} in instance {}", element, text_of(std::optional{id})), old.of(id),
                          now.of(id), old_place, new_place);
    }
  }

  /// Only what is on the wire: what a receiver tolerates is its own affair.
  void protection_settings(const std::string& element, const Protection& old, const Protection& now,
                           Place old_place, Place new_place) {
    const auto before = wire_settings(old);
    const auto after = wire_settings(now);
    const auto word = [](const Protection& e2e) {
      return e2e.profile.empty() ? std::string{"none"} : "profile " + e2e.profile;
    };
    std::string was = word(old);
    std::string is = word(now);
    bool changed = before.profile != after.profile;
    // A parameter that one side does not give is not known; defaults are among the settings.
    for (const auto& [key, value] : before.values) {
      const auto other = after.values.find(key);
      if (other != after.values.end() && other->second != value) {
        was += fmt::format(", {} {}", key, value);
        is += fmt::format(", {} {}", key, other->second);
        changed = true;
      }
    }
    if (changed && !either_is_seen_) {
      log_.add("protection", element, std::move(was), std::move(is), old_place, new_place);
    }
  }

  const Model& before_;
  const Model& after_;
  const MissingId missing_;
  const InstanceIndex old_instances_{before_};
  const InstanceIndex new_instances_{after_};
  ChangeLog log_{};
  PayloadComparison types_;
  Known known_{};
  std::set<someip::InstanceId> shared_instances_{};  ///< of the services that are compared
  bool one_has_ids_ = false;                         ///< of the services that are compared
  bool ros_names_ = false;       ///< and one of them is of a route file, which has the names of ROS
  bool is_strict_ = true;        ///< by can_say_the_same()
  bool either_is_seen_ = false;  ///< of the members that are compared, by is_seen()
};

}  // namespace
}  // namespace comparing

std::vector<Change> compare(const Model& before, const Model& after, MissingId missing) {
  return comparing::Comparison{before, after, missing}.run();
}

}  // namespace trestle::describe
