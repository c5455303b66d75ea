#include "bridge/conform/commands/profile_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

using describe::Instance;
using describe::Service;

constexpr std::uint16_t last_method = 0x7fff;

/// In double quotes; what could end or break them is left out.
std::string quoted(const std::string& text) {
  std::string all = "\"";
  for (const char c : text) {
    all += c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return all + "\"";
}

/// For a comment, which ends with its line.
std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, '?');
  return text;
}

/// For YAML, in which the colons of IPv6 may mean something.
std::string yaml(IpAddress address) {
  return address.v6 ? quoted(someip::to_string(address)) : someip::to_string(address);
}

std::string hex(unsigned number) {
  return fmt::format("{:#06x}", number);
}

std::optional<IpAddress> address_of(const describe::Model& model, const Instance& instance) {
  if (instance.address) {
    return instance.address;
  }
  const auto machine = std::ranges::find(model.machines, instance.machine, &describe::Machine::name);
  return machine == model.machines.end() ? std::nullopt : machine->address;
}

struct Group {
  std::set<std::uint16_t> events{};
  bool has_field = false;
  bool udp = false;  ///< has an event over UDP
};

std::map<std::uint16_t, Group> groups_of(const Service& service) {
  std::map<std::uint16_t, Group> groups;
  for (const describe::Eventgroup& one : service.eventgroups) {
    groups[value(one.id)];
  }
  const auto add = [&](const auto& event, std::optional<someip::MethodId> id, Transport transport,
                       bool field) {
    for (const someip::EventgroupId group : event.eventgroups) {
      Group& into = groups[value(group)];
      into.has_field = into.has_field || field;
      into.udp = into.udp || transport == Transport::udp;
      if (id) {
        into.events.insert(value(*id));
      }
    }
  };
  for (const describe::Event& one : service.events) {
    add(one, one.id, one.transfer.transport, false);
  }
  for (const describe::Field& one : service.fields) {
    if (one.has_notifier) {
      add(one, one.notifier, one.notifier_transfer.transport, true);
    }
  }
  std::erase_if(
      groups, [](const auto& one) { return !someip::names_an_eventgroup(someip::EventgroupId{one.first}); });
  return groups;
}

std::string eventgroup_lines(const Service& service, const Instance& instance, bool v6) {
  std::string all;
  for (const auto& [id, group] : groups_of(service)) {
    all += fmt::format("      - {{id: {}", id);
    std::string events;
    for (const std::uint16_t event : group.events) {
      events += event == 0 || event == 0xffff ? "" : (events.empty() ? "" : ", ") + hex(event);
    }
    all += events.empty() ? "" : ", events: [" + events + "]";
    all += group.has_field ? ", initial_values: true" : "";
    all += group.events.empty() || group.udp ? "" : ", tcp: true";
    for (const describe::Multicast& one : instance.multicast) {
      if (value(one.eventgroup) == id && one.threshold > 0 && one.group.address.v6 == v6 &&
          one.group.port != 0 && one.group.address.is_multicast()) {
        all += fmt::format(", multicast: {{address: {}, port: {}}}", yaml(one.group.address), one.group.port);
        all += one.threshold > 1 ? fmt::format(", multicast_threshold: {}", one.threshold) : "";
        break;
      }
    }
    all += "}\n";
  }
  return all.empty() ? all : "    eventgroups:\n" + all;
}

bool is_method_id(const std::optional<someip::MethodId>& id) {
  return id && value(*id) > 0 && value(*id) <= last_method;
}

/// What answers to a request without a payload; below it what a person has to decide on.
std::string method_lines(const Service& service) {
  std::string all;
  const auto request = [&](std::uint16_t id, const std::string& name) {
    all += fmt::format("    request: {{method: {}}}  # {}\n", hex(id), one_line(name));
  };
  const auto getter = std::ranges::find_if(
      service.fields, [](const describe::Field& one) { return one.has_getter && is_method_id(one.getter); });
  const auto plain = std::ranges::find_if(service.methods, [](const describe::Method& one) {
    return !one.fire_and_forget && one.request.known && one.request.values.empty() && is_method_id(one.id);
  });
  const auto any = std::ranges::find_if(service.methods, [](const describe::Method& one) {
    return !one.fire_and_forget && is_method_id(one.id);
  });
  if (getter != service.fields.end()) {
    request(value(*getter->getter), "the getter of " + getter->name);
  } else if (plain != service.methods.end()) {
    request(value(*plain->id), plain->name);
  } else if (any != service.methods.end()) {
    all +=
        fmt::format("    # request: {{method: {}, payload: \"00\"}}  # {}: which payload does it answer?\n",
                    hex(value(*any->id)), one_line(any->name));
  }
  for (const describe::Method& one : service.methods) {
    if (one.fire_and_forget && is_method_id(one.id)) {
      all += fmt::format("    # fire_and_forget: {}  # {}: does it do no harm?\n", hex(value(*one.id)),
                         one_line(one.name));
      break;
    }
  }
  for (const describe::Field& one : service.fields) {
    if (one.has_getter && one.has_setter && is_method_id(one.getter) && is_method_id(one.setter) &&
        !one.eventgroups.empty()) {
      all += fmt::format(
          "    # field: {{getter: {}, setter: {}, value: \"00\", eventgroup: {}}}  # {}: which value may be "
          "set?\n",
          hex(value(*one.getter)), hex(value(*one.setter)), value(one.eventgroups.front()),
          one_line(one.name));
      break;
    }
  }
  return all;
}

/// Where nothing tells of methods and eventgroups, as offers alone do not, what most cases need is to be
/// added.
std::string missing_lines(const Service& service) {
  return !groups_of(service).empty() || !method_lines(service).empty()
             ? std::string{}
             : "    # Add what most cases need, with the ids that this service has:\n"
               "    # request: {method: 0x0001, payload: \"00\"}\n"
               "    # eventgroups: [{id: 1, events: [0x8001]}]\n";
}

std::string service_lines(const Service& service, const Instance& instance, std::uint16_t own_port, bool v6) {
  std::string all = fmt::format("  - id: {}  # {}\n    instance: {}\n", hex(value(*service.id)),
                                one_line(describe::full_name(service.scope, service.name)),
                                instance.id ? value(*instance.id) : 1);
  all += fmt::format("    major: {}\n", std::min<unsigned>(instance.major.value_or(service.major), 254));
  all += fmt::format("    minor: {}\n",
                     std::min<std::uint32_t>(instance.minor.value_or(service.minor), 0xffff'fffe));
  const std::uint32_t ttl_s = instance.timing ? instance.timing->ttl_s : instance.observed_ttl_s.value_or(0);
  if (ttl_s > 0) {
    all += fmt::format("    ttl: {}\n", std::min<std::uint32_t>(ttl_s, sd::infinite_ttl_s));
  }
  if (instance.udp_port.value_or(0) != 0) {
    all += fmt::format("    udp: {}\n", *instance.udp_port);
  }
  if (instance.tcp_port.value_or(0) != 0) {
    all += fmt::format("    tcp: {}\n", *instance.tcp_port);
  }
  if (instance.udp_port.value_or(0) == 0 && instance.tcp_port.value_or(0) == 0) {
    all += fmt::format("    udp: {}  # a guess: the description has no port\n", own_port);
  }
  return all + eventgroup_lines(service, instance, v6) + method_lines(service);
}

std::string timing_lines(const sd::Timing& timing) {
  const auto ms = [](Duration time) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
  };
  return fmt::format(
      "timing:\n  initial_delay_max: {} ms\n  repetitions_base_delay: {} ms\n  repetitions_max: {}\n"
      "  cyclic_offer_delay: {} ms\n",
      ms(timing.initial_delay_max), ms(timing.repetitions_base_delay),
      std::min<unsigned>(timing.repetitions_max, 20), ms(timing.cyclic_offer_delay));
}

/// What was seen is never quite what is configured: two digits of it are.
std::int64_t rounded_ms(Duration time) {
  const std::int64_t ms = std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
  std::int64_t step = 1;
  while (ms / step >= 100) {
    step *= 10;
  }
  return (ms + step / 2) / step * step;
}

/// A service that the device uses, and eventgroups of it.
struct Used {
  someip::InstanceId instance{};
  std::uint8_t major = 1;
  std::optional<someip::EventgroupId> udp{};
  std::optional<someip::EventgroupId> tcp{};
  std::optional<someip::EventgroupId> multicast{};
};
using Uses = std::map<someip::ServiceId, Used>;

/// By client. The first instance and eventgroup of each service that it subscribes to.
std::map<IpAddress, Uses> uses_of(const describe::Model& model) {
  std::map<IpAddress, Uses> all;
  for (const describe::ObservedUse& one : model.observed_uses) {
    if (someip::names_an_instance(one.instance) && someip::names_an_eventgroup(one.eventgroup)) {
      Used& used = all[one.client].try_emplace(one.service, Used{one.instance, one.major}).first->second;
      std::optional<someip::EventgroupId>& place = one.multicast ? used.multicast
                                                   : one.udp     ? used.udp
                                                                 : used.tcp;
      place = place.value_or(one.eventgroup);
    }
  }
  for (auto& [client, uses] : all) {
    // Each needs one over UDP; events by multicast come over UDP, too.
    for (auto& [service, used] : uses) {
      if (!used.udp) {
        used.udp = std::exchange(used.multicast, std::nullopt);
      }
    }
    std::erase_if(uses, [](const auto& one) { return !one.second.udp; });
  }
  std::erase_if(all, [](const auto& one) { return one.second.empty(); });
  return all;
}

/// An event of the eventgroup; nothing: none is known.
std::optional<someip::MethodId> event_of(const describe::Model& model, someip::ServiceId id,
                                         someip::EventgroupId group) {
  const auto service = std::ranges::find(model.services, std::optional{id}, &Service::id);
  if (service != model.services.end()) {
    for (const describe::Event& one : service->events) {
      if (one.id && std::ranges::find(one.eventgroups, group) != one.eventgroups.end()) {
        return one.id;
      }
    }
  }
  return std::nullopt;
}

std::string use_lines(const describe::Model& model, const Uses& uses) {
  std::string all = uses.empty() ? "" : "uses:\n";
  for (const auto& [id, used] : uses) {
    bool guessed = false;
    const auto wanted = [&, service = id](const char* key, const std::optional<someip::EventgroupId>& group) {
      if (!group) {
        return std::string{};
      }
      const auto event = event_of(model, service, *group);
      guessed = guessed || !event;
      return fmt::format(", {}: {{eventgroup: {}, event: {}}}", key, value(*group),
                         hex(event ? value(*event) : 0x8001));
    };
    all += fmt::format("  - {{id: {}, instance: {}, major: {}", hex(value(id)), value(used.instance),
                       std::min<unsigned>(used.major, 254));
    all += wanted("udp", used.udp) + wanted("tcp", used.tcp) + wanted("multicast", used.multicast) + "}";
    all += guessed ? "  # which events it needs is a guess\n" : "\n";
  }
  return all;
}

/// Another one in the same subnet, most probably.
IpAddress beside(IpAddress address) {
  std::uint8_t& last = address.bytes[address.v6 ? 15 : 3];
  last = static_cast<std::uint8_t>(last >= 254 ? 1 : last + 1);
  return address;
}

/// A profile is all of IPv4 or all of IPv6: whether a device at this address can be written of.
bool fits(const std::optional<IpAddress>& address, const ProfileWishes& wishes) {
  return !address || ((!wishes.tester || wishes.tester->v6 == address->v6) &&
                      (!wishes.discovery || wishes.discovery->address.v6 == address->v6));
}

/// Of documentation (RFC 5737, RFC 3849).
IpAddress example_address(const ProfileWishes& wishes) {
  const bool v6 = wishes.tester ? wishes.tester->v6 : wishes.discovery && wishes.discovery->address.v6;
  return v6 ? IpAddress{{0x20, 0x01, 0x0d, 0xb8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, true}
            : IpAddress::v4(192, 0, 2, 1);
}

/// Of IPv6 there is no group that everybody uses.
std::string group_line(const std::optional<IpAddress>& group, bool v6) {
  if (group && group->v6 == v6 && group->is_multicast()) {
    return fmt::format("  multicast: {}\n", yaml(*group));
  }
  return v6 ? "  multicast: \"ff15::1\"  # a guess: the group of service discovery is not known\n" : "";
}

}  // namespace

WrittenProfile write_profile(const describe::Model& model, const ProfileWishes& wishes) {
  struct Offered {
    const Service* service;
    const Instance* instance;
  };
  // Those without an address belong to whatever device is asked for.
  std::map<std::optional<IpAddress>, std::vector<Offered>> devices;
  for (const Instance& instance : model.instances) {
    const auto service = std::ranges::find_if(
        model.services, [&](const Service& one) { return one.id && describe::is_of(instance, one); });
    const auto address = address_of(model, instance);
    if (instance.role == Instance::Role::provided && service != model.services.end() &&
        someip::names_a_service(*service->id) && fits(address, wishes)) {
      devices[address].push_back({&*service, &instance});
    }
  }
  // Who offers nothing may use something.
  const std::map<IpAddress, Uses> uses = uses_of(model);
  for (const auto& [client, used] : uses) {
    if (fits(client, wishes)) {
      devices[client];
    }
  }
  if (devices.empty()) {
    return {};
  }
  auto chosen = std::ranges::max_element(devices, {}, [&](const auto& one) {
    return std::pair{one.second.size(), one.first && uses.contains(*one.first) ? 1 : 0};
  });
  if (wishes.device) {
    chosen = devices.find(wishes.device);
    chosen = chosen == devices.end() ? devices.find(std::nullopt) : chosen;
    if (chosen == devices.end()) {
      return {};
    }
  }
  WrittenProfile written;
  for (const auto& [address, offered] : devices) {
    if (address && address != chosen->first) {
      written.others += (written.others.empty() ? "" : ", ") + someip::to_string(*address);
    }
  }
  const std::optional<IpAddress> known = wishes.device ? wishes.device : chosen->first;
  const IpAddress device = known.value_or(example_address(wishes));
  const Instance nothing{};
  const Instance& first = chosen->second.empty() ? nothing : *chosen->second.front().instance;
  const auto machine = std::ranges::find_if(model.machines, [&](const describe::Machine& one) {
    return (!first.machine.empty() && one.name == first.machine) ||
           (one.address && one.address == chosen->first);
  });
  const bool has_machine = machine != model.machines.end();
  std::string& all = written.text;
  all = "# A first profile, made by 'trestle conform profile'. docs/conform.md explains the keys.\n";
  all += "name: " +
         quoted(!wishes.name.empty()                    ? wishes.name
                : has_machine && !machine->name.empty() ? machine->name
                                                        : "Device") +
         "\n";
  all += "network:\n";
  all += fmt::format("  device: {}{}\n", yaml(device), known ? "" : "  # a guess: its address is not known");
  all += fmt::format("  tester: {}{}\n", yaml(wishes.tester.value_or(beside(device))),
                     wishes.tester ? "" : "  # a guess: an address of this host in the device's network");
  std::optional<IpAddress> group;
  std::optional<std::uint16_t> port;
  if (wishes.discovery) {
    group = wishes.discovery->address;
    port = wishes.discovery->port;
  } else if (has_machine) {
    group = machine->sd_multicast;
    port = machine->sd_port;
  }
  all += group_line(group, device.v6);
  if (port.value_or(0) != 0) {
    all += fmt::format("  sd_port: {}\n", *port);
  }
  if (!chosen->second.empty()) {
    all +=
        "# The first service is what most cases talk to: best one with methods and eventgroups.\nservices:\n";
  }
  std::uint16_t guessed_port = 30501;
  for (const Offered& one : chosen->second) {
    all += service_lines(*one.service, *one.instance, guessed_port++, device.v6);
    all += &one == &chosen->second.front() ? missing_lines(*one.service) : "";
  }
  if (const auto own = known ? uses.find(*known) : uses.end(); own != uses.end()) {
    all += use_lines(model, own->second);
  }
  if (first.timing) {
    all += timing_lines(*first.timing);
  } else if (first.observed_cycle) {
    all +=
        fmt::format("timing:\n  cyclic_offer_delay: {} ms  # as seen\n", rounded_ms(*first.observed_cycle));
  }
  all +=
      "# Where the specification leaves a choice, what the device is meant to do, such as:\n"
      "# policy:\n#   answers_unknown_method: false\n#   refuses_unknown_subscriptions: false\n"
      "#   sd_endpoint_option: false\n";
  all +=
      "# How to start and stop it; without, cases that restart it are left out.\n"
      "# lifecycle:\n#   ask_operator: true\n";
  return written;
}

}  // namespace trestle::conform
