#include "bridge/describe/edits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "bridge/describe/member_names.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe {
namespace {

template <typename Id, typename Value>
void set(std::optional<Id>& into, const std::optional<Value>& edit) {
  if (edit) {
    into = Id{*edit};
  }
}

std::string key_of(const Method& method) {
  return member_key(method.name, method.selector);
}
std::string key_of(const Event& event) {
  return member_key(event.name, event.selector);
}
std::string key_of(const Field& field) {
  return field.name;
}

/// An id that is edited stands nowhere.
template <typename Id, typename Value>
void set_id(std::optional<Id>& into, Place& place, const std::optional<Value>& edit) {
  if (edit) {
    into = Id{*edit};
    place = {};
  }
}

void apply(const MemberEdit& edit, Method& method) {
  set_id(method.id, method.id_place, edit.id);
  if (edit.transport) {
    method.request_transfer.transport = method.response_transfer.transport = *edit.transport;
  }
}
void apply(const MemberEdit& edit, Event& event) {
  set_id(event.id, event.id_place, edit.id);
  event.transfer.transport = edit.transport.value_or(event.transfer.transport);
}
void apply(const MemberEdit& edit, Field& field) {
  set_id(field.getter, field.getter_place, edit.getter);
  set_id(field.setter, field.setter_place, edit.setter);
  set_id(field.notifier, field.notifier_place, edit.notifier);
  if (edit.transport) {
    field.getter_transfer.transport = field.setter_transfer.transport = field.notifier_transfer.transport =
        *edit.transport;
  }
}

class Editing {
 public:
  Editing(const Edits& edits, Model& model) : edits_{edits}, model_{model} {
    for (const Service& service : model.services) {
      names_.insert(full_name(service.scope, service.name));
    }
  }

  Edited run() {
    for (Service& service : model_.services) {
      const auto found = edits_.find(full_name(service.scope, service.name));
      if (found != edits_.end()) {
        this->service(service, found->first, found->second);
      }
    }
    edited_.problems = problems_.take(model_.files);
    return std::move(edited_);
  }

 private:
  void service(Service& service, const std::string& name, const ServiceEdit& edit) {
    const std::uint8_t major = service.major;
    set_id(service.id, service.id_place, edit.id);
    if (edit.major || edit.minor) {
      service.has_version = true;
      service.major = edit.major.value_or(service.major);
      service.minor = edit.minor.value_or(service.minor);
    }
    instances(service, name, edit, major);
    const std::string now = renamed(service, name, edit);
    groups_.clear();
    for (const Eventgroup& group : service.eventgroups) {
      groups_.insert(group.id);
    }
    members(service, now + " methods ", edit.methods, service.methods);
    members(service, now + " events ", edit.events, service.events);
    members(service, now + " fields ", edit.fields, service.fields);
    std::ranges::sort(service.eventgroups, {}, &Eventgroup::id);
  }

  void instances(Service& service, const std::string& name, const ServiceEdit& edit, std::uint8_t major) {
    const auto first = [&](Instance& instance) {
      const auto before = instance.id;
      set(instance.id, edit.instance);
      take_protections(service, name, before, instance.id);
      set(instance.udp_port, edit.udp_port);
      set(instance.tcp_port, edit.tcp_port);
    };
    bool has_instance = false;
    for (Instance& instance : model_.instances) {
      if (instance.service != name) {
        continue;
      }
      set(instance.service_id, edit.id);
      if (edit.major && instance.major == major) {
        instance.major = edit.major;
      }
      // One instance is edited: the first.
      if (!std::exchange(has_instance, true)) {
        first(instance);
      }
    }
    if (!has_instance && (edit.instance || edit.udp_port || edit.tcp_port)) {
      model_.instances.push_back({.service = name, .service_id = service.id, .place = service.place});
      first(model_.instances.back());
    }
  }

  /// What is protected otherwise in an instance is so under its new id, too.
  void take_protections(Service& service, const std::string& name, std::optional<someip::InstanceId> before,
                        std::optional<someip::InstanceId> now) const {
    if (!before || !now || before == now) {
      return;
    }
    const bool has_others = std::ranges::any_of(
        model_.instances, [&](const Instance& one) { return one.service == name && one.id == before; });
    const auto take = [&](Protection& e2e) {
      const auto own = e2e.of_instances.find(*before);
      if (own == e2e.of_instances.end()) {
        return;
      }
      e2e.of_instances.insert_or_assign(*now, own->second);
      if (!has_others) {
        e2e.of_instances.erase(own);
      }
    };
    for (Event& one : service.events) {
      take(one.e2e);
    }
    for (Method& one : service.methods) {
      take(one.e2e);
    }
    for (Field& one : service.fields) {
      take(one.e2e);
      take(one.getter_e2e);
      take(one.setter_e2e);
    }
  }

  /// Renames the service, and what refers to it.
  /// @return the full name that it has then.
  std::string renamed(Service& service, const std::string& name, const ServiceEdit& edit) {
    if (!edit.name || *edit.name == service.name) {
      return name;
    }
    const std::string wanted = full_name(service.scope, *edit.name);
    if (!names_.insert(wanted).second) {
      problems_.error(service.place,
                      fmt::format("{} cannot be renamed: there is a service {}", name, wanted));
      return name;
    }
    names_.erase(name);
    for (Instance& instance : model_.instances) {
      if (instance.service == name) {
        instance.service = wanted;
      }
    }
    for (Service& other : model_.services) {
      for (std::string& managed : other.manages) {
        managed = managed == name ? wanted : managed;
      }
      other.base = other.base == name ? wanted : other.base;
    }
    service.name = *edit.name;
    edited_.renamed[wanted] = name;
    return wanted;
  }

  template <typename Member>
  void members(Service& service, const std::string& label, const ServiceEdit::Members& edits,
               std::vector<Member>& all) {
    if (edits.empty()) {
      return;
    }
    std::set<std::string> keys;
    for (const Member& member : all) {
      keys.insert(key_of(member));
    }
    for (Member& member : all) {
      const std::string key = key_of(member);
      const auto found = edits.find(key);
      if (found == edits.end()) {
        continue;
      }
      const MemberEdit& edit = found->second;
      apply(edit, member);
      if constexpr (requires { member.eventgroups; }) {
        groups(service, edit, member.eventgroups);
      }
      if (!edit.name || *edit.name == member.name) {
        continue;
      }
      const std::string before = std::exchange(member.name, *edit.name);
      if (!keys.insert(key_of(member)).second) {
        problems_.error(member.place, fmt::format("{}.{} cannot be renamed: there is a {} already",
                                                  service.name, key, key_of(member)));
        member.name = before;
        continue;
      }
      keys.erase(key);
      edited_.renamed[label + key_of(member)] = key;
    }
  }

  void groups(Service& service, const MemberEdit& edit, std::vector<someip::EventgroupId>& into) {
    if (!edit.eventgroups) {
      return;
    }
    into = *edit.eventgroups;
    for (const someip::EventgroupId id : into) {
      if (groups_.insert(id).second) {
        service.eventgroups.push_back({.id = id, .place = service.place});
      }
    }
  }

  const Edits& edits_;
  Model& model_;
  std::set<std::string> names_{};            ///< of all services
  std::set<someip::EventgroupId> groups_{};  ///< of the service that is edited
  documents::Problems problems_{documents::Problems::no_limit};
  Edited edited_{};
};

}  // namespace

Edited apply_edits(const Edits& edits, Model& model) {
  return edits.empty() ? Edited{} : Editing{edits, model}.run();
}

}  // namespace trestle::describe
