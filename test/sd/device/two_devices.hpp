#pragma once
#include "sd/core/device/device.hpp"

namespace trestle::test {

/// Tables of a server with a method, an event and a field, and of a client of it.
struct TwoDevices {
  static constexpr Endpoint server_sd{IpAddress::v4(10, 0, 0, 1), 30490};
  static constexpr Endpoint client_sd{IpAddress::v4(10, 0, 0, 2), 30490};
  static constexpr someip::MethodId echo{0x0001};
  static constexpr someip::MethodId event{0x8001};
  static constexpr someip::MethodId notifier{0x8002};

  static constexpr std::array groups{sd::Eventgroup{.id = sd::EventgroupId{1}}};
  static constexpr std::array group_ids{sd::EventgroupId{1}};
  static constexpr std::array methods{device::Method{.id = echo}};
  static constexpr std::array events{device::Event{.id = event, .eventgroups = group_ids}};
  static constexpr std::array subscriptions{device::Subscription{.eventgroup = sd::EventgroupId{1}}};
  static constexpr std::array needs{device::Need{.service = sd::ServiceId{0x1234},
                                                 .instance = sd::InstanceId{1},
                                                 .port = 30600,
                                                 .subscriptions = subscriptions}};
  static constexpr device::Limits server_limits{
      .services = 1, .eventgroups = 1, .events = 2, .subscribers = 2};
  static constexpr device::Limits client_limits{
      .services = 0, .eventgroups = 0, .needs = 1, .subscriptions = 1, .remote_services = 1, .calls = 4};

  std::array<std::byte, 4> value{};
  std::array<device::Field, 1> fields{
      device::Field{.notifier = notifier, .eventgroups = group_ids, .room = value, .initial_bytes = 4}};
  std::array<device::Service, 1> services{device::Service{.service = sd::ServiceId{0x1234},
                                                          .instance = sd::InstanceId{1},
                                                          .port = 30501,
                                                          .methods = methods,
                                                          .events = events,
                                                          .fields = fields,
                                                          .eventgroups = groups}};

  [[nodiscard]] device::Settings server_settings(std::uint64_t seed) const {
    device::Settings settings;
    settings.discovery.unicast = server_sd;
    settings.discovery.seed = seed;
    settings.services = services;
    return settings;
  }
  [[nodiscard]] static device::Settings client_settings(std::uint64_t seed) {
    device::Settings settings;
    settings.discovery.unicast = client_sd;
    settings.discovery.seed = seed;
    settings.needs = needs;
    return settings;
  }
};

}  // namespace trestle::test
