#pragma once
#include "test/sd/machine.hpp"

namespace trestle::test {

inline constexpr Endpoint server_sd{IpAddress::v4(10, 0, 0, 2), 30490};
inline constexpr Endpoint server_udp{IpAddress::v4(10, 0, 0, 2), 30509};
inline constexpr Endpoint server_tcp{IpAddress::v4(10, 0, 0, 2), 30510};
inline constexpr Endpoint own_tcp{IpAddress::v4(10, 0, 0, 1), 41000};
inline constexpr sd::RequiredService required{
    .service = sd::ServiceId{0x1234}, .instance = sd::InstanceId{0x5678}, .major = 1};
inline constexpr sd::RequiredService any_required{.service = sd::ServiceId{0x1234}};

class Client : public testing::Test {
 protected:
  void require(const sd::RequiredService& service) {
    const auto handle = machine.discovery.require(service, machine.now);
    ASSERT_TRUE(handle);
    requirement = *handle;
  }
  sd::SubscriptionHandle subscribe_to(const sd::EventgroupRequest& request) {
    const auto handle = machine.discovery.subscribe(requirement, request, machine.now);
    EXPECT_TRUE(handle);
    return handle.value_or(sd::SubscriptionHandle{});
  }
  // A machine that is subscribed to eventgroup 1, at 200 ms, with nothing left to send or tell.
  sd::SubscriptionHandle subscribed() {
    require(required);
    const sd::SubscriptionHandle subscription =
        subscribe_to({.eventgroup = sd::EventgroupId{1}, .udp = own_udp});
    machine.run_to(195ms);
    machine.multicast(server, {offer({udp(server_udp)})});
    machine.run_to(200ms);
    machine.unicast(server, {ack(1)});
    EXPECT_THAT(machine.events(), testing::ElementsAre(testing::HasSubstr("available"), "subscribed"));
    return subscription;
  }

  Machine<> machine;
  FakePeer server{server_sd};
  sd::RequirementHandle requirement;
};

}  // namespace trestle::test
