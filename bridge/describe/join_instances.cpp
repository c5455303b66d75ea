#include "bridge/describe/join_instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "bridge/describe/join_members.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

Place said_place(const Instance& instance, std::string_view setting) {
  const auto found = instance.said_at.find(setting);
  return found == instance.said_at.end() ? instance.place : found->second;
}

/// Of an instance with an address.
SaidValue said_address(const Instance& instance) {
  return {someip::to_string(*instance.address), said_place(instance, "address")};
}

/// "instance 0x0001 of car.Door"
std::string name_of_instance(const Instance& instance) {
  const std::string service =
      !instance.service.empty()
          ? instance.service
          : fmt::format("0x{:04x}", instance.service_id ? someip::value(*instance.service_id) : 0);
  const std::string which = instance.id
                                ? fmt::format("0x{:04x}", someip::value(*instance.id))
                                : (instance.name.empty() ? "without an id" : documents::quote(instance.name));
  return fmt::format("instance {} of {}", which, service);
}

/// A time of service discovery, or what is set with these.
struct SdSetting {
  std::string_view name;  ///< as in Instance::said_at
  std::string (*text)(const sd::Timing& timing);
  void (*copy)(sd::Timing& to, const sd::Timing& from);
};

template <auto Member>
constexpr SdSetting sd_setting(std::string_view name) {
  return {name,
          [](const sd::Timing& timing) {
            if constexpr (std::is_same_v<std::decay_t<decltype(timing.*Member)>, Duration>) {
              return documents::to_string(timing.*Member);
            } else {
              return fmt::to_string(timing.*Member);
            }
          },
          [](sd::Timing& to, const sd::Timing& from) { to.*Member = from.*Member; }};
}

constexpr std::array sd_settings{
    sd_setting<&sd::Timing::initial_delay_min>("initial_delay_min"),
    sd_setting<&sd::Timing::initial_delay_max>("initial_delay_max"),
    sd_setting<&sd::Timing::repetitions_base_delay>("repetitions_base_delay"),
    sd_setting<&sd::Timing::repetitions_max>("repetitions_max"),
    sd_setting<&sd::Timing::cyclic_offer_delay>("cyclic_offer_delay"),
    sd_setting<&sd::Timing::request_response_delay_min>("request_response_delay_min"),
    sd_setting<&sd::Timing::request_response_delay_max>("request_response_delay_max"),
    sd_setting<&sd::Timing::ttl_s>("ttl"),
};

class InstanceJoin {
 public:
  InstanceJoin(Instance& to, const Instance& from, Contradictions& contradictions)
      : to_{to}, from_{from}, contradictions_{contradictions} {}

  void run() {
    fill(to_.service_id, from_.service_id);
    address();
    number("udp_port", "the UDP port", to_.udp_port, from_.udp_port);
    number("tcp_port", "the TCP port", to_.tcp_port, from_.tcp_port);
    number("major", "the major version", to_.major, from_.major);
    number("minor", "the minor version", to_.minor, from_.minor);
    number("priority", "the priority", to_.priority, from_.priority);
    number("weight", "the weight", to_.weight, from_.weight);
    times();
    for (const Multicast& group : from_.multicast) {
      multicast(group);
    }
    fill(to_.eventgroups, from_.eventgroups);
    for (const auto& [key, value] : from_.configuration) {
      const auto [known, is_new] = to_.configuration.emplace(key, value);
      if (known->second != value) {
        tell(fmt::format("the configuration option {} as", documents::quote(key)), "configuration",
             documents::quote(known->second), documents::quote(value));
      }
    }
    if (to_.machine.empty()) {
      to_.machine = from_.machine;
    }
    // Names of one language alone have to be the same: others have names of their own for things.
    if (to_.said_at.contains("name") && from_.said_at.contains("name") && to_.name != from_.name) {
      tell("the InstanceId", "name", documents::quote(to_.name), documents::quote(from_.name));
    }
    if (to_.name.empty()) {
      to_.name = from_.name;
      take_place("name");
    }
    fill(to_.notes, from_.notes);
  }

  void address() {
    if (!to_.address || !from_.address) {
      fill(to_.address, from_.address);
      take_place("address");  // and no other: tell_of_addresses() asks who says one
    } else if (*to_.address != *from_.address &&
               tell("the address", said_address(to_), said_address(from_))) {
      to_.address = from_.address;
      hold("address");
    }
  }

 private:
  void take_place(std::string_view setting) {
    if (const auto found = from_.said_at.find(setting); found != from_.said_at.end()) {
      to_.said_at.insert(*found);
    }
  }

  /// @return whether the other value holds.
  bool tell(std::string_view what, std::string_view setting, const std::string& known,
            const std::string& other) {
    return tell(what, {known, said_place(to_, setting)}, {other, said_place(from_, setting)});
  }
  bool tell(std::string_view what, const SaidValue& known, const SaidValue& other) {
    // Of several clients each may have its own.
    return to_.role != Instance::Role::required &&
           contradictions_.settle(name_of_instance(to_), what, known, other);
  }
  void hold(std::string_view setting) { to_.said_at.insert_or_assign(setting, said_place(from_, setting)); }

  template <typename T, typename Text>
  void take(std::string_view setting, std::string_view what, std::optional<T>& to,
            const std::optional<T>& from, const Text& text) {
    if (to && from) {
      if (*to == *from || !tell(what, setting, text(*to), text(*from))) {
        return;
      }
    } else if (!from) {
      return;
    }
    to = from;
    hold(setting);
  }

  template <typename Number>
  void number(std::string_view setting, std::string_view what, std::optional<Number>& to,
              const std::optional<Number>& from) {
    take(setting, what, to, from, [](Number value) { return fmt::to_string(value); });
  }

  void times() {
    if (!from_.timing) {
      return;
    }
    const bool had_none = !to_.timing;
    if (had_none) {
      to_.timing = from_.timing;
    }
    for (const SdSetting& one : sd_settings) {
      const bool is_known = to_.said_at.contains(one.name);
      if (!from_.said_at.contains(one.name)) {
        continue;
      }
      if (is_known && !had_none) {
        const std::string known = one.text(*to_.timing);
        const std::string other = one.text(*from_.timing);
        if (known != other && tell(fmt::format("the {}", one.name), one.name, known, other)) {
          one.copy(*to_.timing, *from_.timing);
          hold(one.name);
        }
      } else {
        one.copy(*to_.timing, *from_.timing);
        take_place(one.name);
      }
    }
  }

  void multicast(const Multicast& group) {
    const auto known = std::ranges::find(to_.multicast, group.eventgroup, &Multicast::eventgroup);
    if (known == to_.multicast.end()) {
      to_.multicast.push_back(group);
      return;
    }
    const auto compare = [&](const char* what, std::string first, const std::optional<Place>& first_at,
                             std::string second, const std::optional<Place>& second_at) {
      return first != second &&
             tell(fmt::format("for eventgroup 0x{:04x} {}", someip::value(group.eventgroup), what),
                  {std::move(first), first_at.value_or(to_.place)},
                  {std::move(second), second_at.value_or(from_.place)});
    };
    const auto takes_group = [&] {
      if (known->group.address != group.group.address) {
        return compare("the multicast address", someip::to_string(known->group.address), known->group_at,
                       someip::to_string(group.group.address), group.group_at);
      }
      return !group.has_usual_port &&
             (known->has_usual_port ||
              compare("the multicast port", fmt::to_string(known->group.port), known->group_at,
                      fmt::to_string(group.group.port), group.group_at));
    };
    if (takes_group()) {
      known->group = group.group;
      known->group_at = group.group_at;
      known->has_usual_port = group.has_usual_port;
    }
    const bool takes_threshold =
        known->threshold_at && group.threshold_at
            ? compare("the threshold", fmt::to_string(known->threshold), known->threshold_at,
                      fmt::to_string(group.threshold), group.threshold_at)
            : group.threshold_at || (!known->threshold_at && known->threshold == 0);
    if (takes_threshold) {
      known->threshold = group.threshold;
      known->threshold_at = group.threshold_at;
    }
  }

  Instance& to_;
  const Instance& from_;
  Contradictions& contradictions_;
};

bool at_one_address_alone(const Instance& one, const Instance& other) {
  // FDEPL and vsomeip JSON say one address; ARXML and captures know of several hosts.
  const bool one_says = one.said_at.contains("address");
  const bool other_says = other.said_at.contains("address");
  return one.place.file == other.place.file
             ? one_says && other_says
             : one_says || other_says || one.machine.empty() || other.machine.empty();
}

}  // namespace

void add_instance(Instance& to, const Instance& from, Contradictions& contradictions) {
  InstanceJoin{to, from, contradictions}.run();
}

void tell_of_addresses(std::span<Instance> instances,
                       const std::function<std::uint8_t(const Instance&)>& major_of,
                       Contradictions& contradictions) {
  constexpr std::size_t most = 100;  // each is compared with those before; and so many are told
  using Key = std::tuple<std::string, std::optional<someip::ServiceId>, std::optional<someip::InstanceId>,
                         std::uint8_t>;
  std::map<Key, std::vector<Instance*>> same;
  for (Instance& one : instances) {
    // vsomeip does not offer on the network what has no port.
    const bool is_local = !one.udp_port && !one.tcp_port && contradictions.is_configuration(one.place);
    if (!one.address || !one.id || one.role != Instance::Role::provided || is_local) {
      continue;
    }
    std::vector<Instance*>& others = same[{one.service, one.service_id, one.id, major_of(one)}];
    if (others.size() < most) {
      others.push_back(&one);
    }
  }
  for (const auto& [key, all] : same) {
    const auto is_at = [&all = all](std::uint32_t file, const std::optional<IpAddress>& address) {
      return std::ranges::any_of(
          all, [&](const Instance* one) { return one->place.file == file && one->address == address; });
    };
    for (std::size_t i = 1; i < all.size() && contradictions.count() < most; ++i) {
      Instance& one = *all[i];
      const auto other = std::find_if(
          all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i), [&](const Instance* before) {
            return before->address != one.address && at_one_address_alone(*before, one) &&
                   !is_at(before->place.file, one.address) && !is_at(one.place.file, before->address);
          });
      if (other == all.begin() + static_cast<std::ptrdiff_t>(i)) {
        continue;
      }
      const SaidValue first = said_address(**other);
      const SaidValue second = said_address(one);
      const bool first_is_configured = contradictions.is_configuration(first.place);
      const bool second_is_configured = contradictions.is_configuration(second.place);
      if (first_is_configured && second_is_configured) {
        contradictions.warn_of_two_hosts(name_of_instance(one), first, second);
      } else if (!contradictions.are_alike(first.place, second.place)) {
        InstanceJoin{**other, one, contradictions}.address();
        one.address = (*other)->address;
        one.said_at.insert_or_assign("address", said_place(**other, "address"));
      } else {
        Instance known = **other;  // all that they say differently is told at once
        add_instance(known, one, contradictions);
      }
    }
  }
}

}  // namespace trestle::describe
