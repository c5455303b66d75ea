#include "bridge/describe/compare_instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/compare_bytes.hpp"
#include "bridge/describe/compare_pairs.hpp"
#include "bridge/describe/compare_said.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/format.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe::comparing {
namespace {

using InstanceList = std::vector<const Instance*>;

bool is_provided(const Instance& instance) {
  return instance.role == Instance::Role::provided;
}

/// "Door instance 0x0001", "Door client of any instance"
std::string name_of(const Service& service, const Instance& instance) {
  const std::string which = instance.id             ? text_of(instance.id)
                            : is_provided(instance) ? instance.name
                                                    : std::string{"any instance"};
  return fmt::format("{} {}{}{}", service.name, is_provided(instance) ? "instance" : "client of",
                     which.empty() ? "" : " ", which);
}

template <typename Number>
std::string number_text(const std::optional<Number>& number) {
  return number ? fmt::to_string(*number) : std::string{};
}

std::string address_text(const Instance& instance) {
  return instance.address ? someip::to_string(*instance.address) : std::string{};
}

/// "0x0001 at 239.1.1.1:40001 from 3 on, …"
std::string multicast_text(const Instance& instance) {
  std::vector<std::string> all;
  for (const Multicast& one : instance.multicast) {
    all.push_back(fmt::format("{} at {} from {} on", hex_of(someip::value(one.eventgroup)),
                              someip::to_string(one.group), one.threshold));
  }
  std::ranges::sort(all);
  return fmt::format("{}", fmt::join(all, ", "));
}

std::string timing_text(const Instance& instance) {
  if (!instance.timing) {
    return {};
  }
  const sd::Timing& timing = *instance.timing;
  const auto text = [](Duration time) { return documents::to_string(time); };
  return fmt::format(
      "initial delay {} to {}, {} repetitions from {} on, offers each {}, answers after {} to {}, ttl {} s",
      text(timing.initial_delay_min), text(timing.initial_delay_max), timing.repetitions_max,
      text(timing.repetitions_base_delay), text(timing.cyclic_offer_delay),
      text(timing.request_response_delay_min), text(timing.request_response_delay_max), timing.ttl_s);
}

std::string eventgroups_text(const Instance& instance) {
  std::vector<std::string> all;
  for (const someip::EventgroupId id : instance.eventgroups) {
    all.push_back(hex_of(someip::value(id)));
  }
  std::ranges::sort(all);
  return fmt::format("{}", fmt::join(all, ", "));
}

std::string options_text(const Instance& instance) {
  std::vector<std::string> all;
  for (const auto& [key, value] : instance.configuration) {
    all.push_back(fmt::format("{}={}", key, value));
  }
  return fmt::format("{}", fmt::join(all, ", "));
}

/// Those of one role; of both, where what is a server in one language is a client in the other.
InstanceList of_role(const InstanceList& all, Instance::Role role) {
  InstanceList some;
  std::ranges::copy_if(all, std::back_inserter(some), [&](const Instance* one) { return one->role == role; });
  return some;
}

/// The kinds of files that a model was read from.
std::set<std::string> languages_of(const Model& model) {
  std::set<std::string> all;
  for (std::size_t i = 0; i < model.files.size(); ++i) {
    all.insert(language_of(model, {static_cast<std::uint32_t>(i), {1, 1}}));
  }
  return all;
}

/// "uint16 500"
std::string value_text(const Model& model, const Constant& constant) {
  const std::string type =
      is_type(model, constant.type) && resolved(model, constant.type).kind == Kind::primitive
          ? std::string{messages::to_string(on_wire(resolved(model, constant.type).primitive))} + " "
          : std::string{};
  return type + constant.value;
}

}  // namespace

void InstanceComparison::compare(const Service& old, const Service& now, bool is_strict) {
  if (before_.instances.empty() || after_.instances.empty()) {
    return;
  }
  const InstanceList before = old_.of(old);
  const InstanceList after = new_.of(now);
  const auto pair = [&](const InstanceList& olds, const InstanceList& news) {
    Pairs pairs{
        olds, news, [](const Instance* one) { return one->id; },
        [](const Instance* one) { return one->name.empty() ? std::nullopt : std::optional{one->name}; },
        [&](const Instance*) {
          return olds.size() == 1 && news.size() == 1 ? std::optional{0} : std::nullopt;
        }};
    for (const auto& [was, is] : pairs.both) {
      compare(now, **was, **is, is_strict);
    }
    if (!is_strict) {
      return;
    }
    for (const Instance* const* one : pairs.added) {
      log_.add(is_provided(**one) ? "instance-added" : "client-added", name_of(now, **one), {},
               text_of((*one)->id), {}, (*one)->place);
    }
    for (const Instance* const* one : pairs.removed) {
      log_.add(is_provided(**one) ? "instance-removed" : "client-removed", name_of(old, **one),
               text_of((*one)->id), {}, (*one)->place, {});
    }
  };
  if (is_strict) {
    for (const Instance::Role role : {Instance::Role::provided, Instance::Role::required}) {
      pair(of_role(before, role), of_role(after, role));
    }
  } else {
    pair(before, after);
  }
}

void InstanceComparison::compare(const Service& service, const Instance& old, const Instance& now,
                                 bool is_strict) {
  const std::string element = name_of(service, now);
  const auto differs = [&](std::string_view rule, std::string_view what, const std::string& before,
                           const std::string& after) {
    if (before != after && (is_strict || (!before.empty() && !after.empty()))) {
      const auto with_name = [&](const std::string& value) {
        return value.empty() ? value : fmt::format("{}{}", what, value);
      };
      log_.add(rule, element, with_name(before), with_name(after), old.place, now.place);
    }
  };
  differs("instance-id", "", text_of(old.id), text_of(now.id));
  differs("instance-endpoint", "", address_text(old), address_text(now));
  differs("instance-endpoint", "UDP port ", number_text(old.udp_port), number_text(now.udp_port));
  differs("instance-endpoint", "TCP port ", number_text(old.tcp_port), number_text(now.tcp_port));
  differs("instance-multicast", "", multicast_text(old), multicast_text(now));
  differs("instance-timing", "", timing_text(old), timing_text(now));
  differs("instance-settings", "major version ", number_text(old.major), number_text(now.major));
  differs("instance-settings", "minor version ", number_text(old.minor), number_text(now.minor));
  differs("instance-settings", "eventgroups ", eventgroups_text(old), eventgroups_text(now));
  differs("instance-settings", "priority ", number_text(old.priority), number_text(now.priority));
  differs("instance-settings", "weight ", number_text(old.weight), number_text(now.weight));
  differs("instance-settings", "options ", options_text(old), options_text(now));
}

void compare_constants(const Model& before, const Model& after, ChangeLog& log) {
  const bool is_one_language = languages_of(before) == languages_of(after);
  const bool is_said = !before.constants.empty() && !after.constants.empty();
  if (!is_said && (!is_one_language || before.files.empty())) {
    return;
  }
  const auto full = [](const Constant& one) { return dotted(full_name(one.scope, one.name)); };
  Pairs pairs{before.constants, after.constants, full,
              [](const Constant& one) { return std::optional{ros_constant_name(one.name)}; }};
  for (const auto& [old, now] : pairs.both) {
    const std::string element = full(*now);
    if (is_one_language) {
      log.differs("constant-renamed", element, full(*old), element, old->place, now->place);
    }
    if (old->value != now->value || is_one_language) {
      log.differs("constant-value", element, value_text(before, *old), value_text(after, *now), old->place,
                  now->place);
    }
  }
  if (!is_one_language) {
    return;
  }
  for (const Constant* one : pairs.added) {
    log.add("constant-added", full(*one), {}, value_text(after, *one), {}, one->place);
  }
  for (const Constant* one : pairs.removed) {
    log.add("constant-removed", full(*one), value_text(before, *one), {}, one->place, {});
  }
}

}  // namespace trestle::describe::comparing
