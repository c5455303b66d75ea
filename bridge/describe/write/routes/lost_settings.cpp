#include "bridge/describe/write/routes/lost_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "bridge/describe/collecting.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

/// "192.168.7.9, UDP port 30511, TCP port 30510"; empty: nobody says it.
std::string place_of(const Instance& instance, bool with_ports) {
  std::vector<std::string> words;
  if (instance.address) {
    words.push_back(someip::to_string(*instance.address));
  }
  if (with_ports && instance.udp_port) {
    words.push_back(fmt::format("UDP port {}", *instance.udp_port));
  }
  if (with_ports && instance.tcp_port) {
    words.push_back(fmt::format("TCP port {}", *instance.tcp_port));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// "0x0001 at 239.1.1.1:40001 from 3 subscribers on, …"
std::string groups_of(const std::vector<const Multicast*>& all) {
  constexpr std::size_t most = 20;  // in one line
  std::string text;
  for (std::size_t i = 0; i < all.size() && i < most; ++i) {
    text += fmt::format("{}{:#06x} at {} from {} on", i == 0 ? "" : ", ", someip::value(all[i]->eventgroup),
                        someip::to_string(all[i]->group), all[i]->threshold);
  }
  return all.size() > most ? text + fmt::format(" and {} more", all.size() - most) : text;
}

bool has_usual_times(const Service& service) {
  return std::ranges::any_of(service.events, is_usual_collecting, &Event::transfer) ||
         std::ranges::any_of(service.methods,
                             [](const Method& one) {
                               return is_usual_collecting(one.request_transfer) ||
                                      is_usual_collecting(one.response_transfer);
                             }) ||
         std::ranges::any_of(service.fields, [](const Field& one) {
           return (one.has_getter && is_usual_collecting(one.getter_transfer)) ||
                  (one.has_setter && is_usual_collecting(one.setter_transfer)) ||
                  (one.has_notifier && is_usual_collecting(one.notifier_transfer));
         });
}

}  // namespace

void tell_of_settings(const Model& model, const std::vector<RouteEntry>& entries, const RouteOptions& options,
                      std::vector<NotCarried>& not_carried) {
  std::set<std::string> services;
  std::set<std::pair<std::string, someip::InstanceId>> instances;
  for (const RouteEntry& entry : entries) {
    services.insert(entry.service);
    instances.emplace(entry.service, entry.instance);
  }
  std::set<std::string> from_ros;
  for (const Service& service : model.services) {
    const std::string name = full_name(service.scope, service.name);
    if (service.from_ros) {
      from_ros.insert(name);
    }
    if (services.contains(name) && has_usual_times(service)) {
      not_carried.push_back({service.name, std::string{usual_collecting}, service.place});
    }
  }
  for (const Instance& instance : model.instances) {
    if (!instance.id || !instances.contains({instance.service, *instance.id})) {
      continue;
    }
    const bool is_theirs = instance.role == Instance::Role::provided && !from_ros.contains(instance.service);
    const bool is_client = options.side.value_or(is_theirs ? Side::client : Side::server) == Side::client;
    const auto lacks = [&](const char* what, const std::string& value) {
      if (!value.empty()) {
        not_carried.push_back({label_of(instance), what + value, instance.place});
      }
    };
    // The bridge offers at its own address, and at the port of the instance.
    const bool has_port = !is_client && instance.role == Instance::Role::provided;
    lacks(is_client ? "where it is, which service discovery tells a client: "
                    : "where it is: the bridge has its own address: ",
          place_of(instance, !has_port));
    std::vector<const Multicast*> groups;
    for (const Multicast& one : instance.multicast) {
      if (is_client || one.threshold == 0) {
        groups.push_back(&one);
      }
    }
    lacks(is_client ? "its multicast groups, which the server tells a client: "
                    : "its multicast groups that nothing is sent to: ",
          groups_of(groups));
    if (!instance.eventgroups.empty()) {
      lacks("that it uses some eventgroups alone: ", fmt::format("{}", instance.eventgroups.size()));
    }
  }
}

}  // namespace trestle::describe
