#pragma once
#include "test/sd/machine.hpp"

namespace trestle::test {

inline constexpr Endpoint client_sd{IpAddress::v4(10, 0, 0, 2), 30490};
inline constexpr Endpoint client_udp{IpAddress::v4(10, 0, 0, 2), 40000};
inline constexpr Endpoint client_tcp{IpAddress::v4(10, 0, 0, 2), 41000};
inline constexpr Endpoint service_udp{IpAddress::v4(10, 0, 0, 1), 30509};
inline constexpr Endpoint service_tcp{IpAddress::v4(10, 0, 0, 1), 30510};
inline constexpr Endpoint events_multicast{IpAddress::v4(224, 225, 226, 233), 32344};

inline constexpr std::array groups{
    sd::Eventgroup{.id = sd::EventgroupId{1}},
    sd::Eventgroup{.id = sd::EventgroupId{2}, .multicast = events_multicast},
    sd::Eventgroup{.id = sd::EventgroupId{3}, .udp = false, .multicast = events_multicast},
};
inline constexpr std::array tcp_groups{
    sd::Eventgroup{.id = sd::EventgroupId{4}, .udp = false, .tcp = true},
    sd::Eventgroup{.id = sd::EventgroupId{5}, .udp = true, .tcp = true},
};

inline constexpr sd::OfferedService udp_service{.service = sd::ServiceId{0x1234},
                                                .instance = sd::InstanceId{0x5678},
                                                .major = 1,
                                                .minor = 7,
                                                .udp = service_udp,
                                                .eventgroups = groups};
inline constexpr sd::OfferedService tcp_service{.service = sd::ServiceId{0x1234},
                                                .instance = sd::InstanceId{0x5678},
                                                .major = 1,
                                                .udp = service_udp,
                                                .tcp = service_tcp,
                                                .eventgroups = tcp_groups};

class Server : public testing::Test {
 protected:
  // A machine in its main phase that offers `service`.
  void offer(const sd::OfferedService& service) {
    const auto handle = machine.discovery.offer(service, machine.now);
    ASSERT_TRUE(handle);
    offered = *handle;
    machine.run_to(200ms);
  }

  Machine<> machine;
  FakePeer client{client_sd};
  sd::OfferHandle offered;
};

}  // namespace trestle::test
