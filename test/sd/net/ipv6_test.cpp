// Two nodes on IPv6. Loopback has one address of it only, so the test makes a network of its own.
#include <sched.h>

#include <cstdlib>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd {
namespace {

using someip::Message;
using someip::MethodId;
using test::covers;
using test::quick;
using namespace std::chrono_literals;

IpAddress v6(std::uint8_t first, std::uint8_t second, std::uint8_t last) {
  IpAddress address{.v6 = true};
  address.bytes[0] = first;
  address.bytes[1] = second;
  address.bytes[15] = last;
  return address;
}

class Ipv6Test : public test::TwoNodes {
 protected:
  static void SetUpTestSuite() {
    made = (unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0) &&
           std::system(
               "ip link add v0 type veth peer name v1 && ip link set lo up && ip link set v1 up && "
               "ip link set v0 up && ip addr add fd00::1/64 dev v0 nodad && "
               "ip addr add fd00::2/64 dev v0 nodad && "
               // until it has its carrier
               "timeout 60 sh -c 'until ip link show v0 | grep -q \"state UP\"; do sleep 0.01; done'") ==
               0;  // NOLINT(cert-env33-c)
  }
  void SetUp() override {
    if (!made) {
      GTEST_SKIP() << "cannot make a network of its own";
    }
  }
  static NodeConfig config(std::uint8_t host) {
    NodeConfig result = quick(v6(0xfd, 0, host));
    result.multicast = v6(0xff, 0x15, 0x77);
    return result;
  }
  static inline bool made = false;
};

TEST_F(Ipv6Test, ServesMethodsAndEventsFromTheOfferedEndpoints) {
  covers({"feat_req_someipsd_852"});
  constexpr MethodId echo{1};
  constexpr MethodId over_udp{0x8001};
  constexpr MethodId over_tcp{0x8002};
  constexpr EventgroupId group{1};
  Node server{io, config(1)};
  Node client{io, config(2)};
  const OfferHandle offer =
      server.offer({.service = ServiceId{0x1234},
                    .instance = InstanceId{1},
                    .udp_port = 40240,
                    .tcp_port = 40241,
                    .methods = {{echo, [](const Message& request,
                                          Responder responder) { responder.respond(request.payload); }}},
                    .eventgroups = {{.id = group, .events = {over_udp, over_tcp}}},
                    .tcp_events = {over_tcp}});
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  const SubscriptionId subscription = client.subscribe({.service = ServiceId{0x1234},
                                                        .instance = InstanceId{1},
                                                        .eventgroup = group,
                                                        .events = {over_udp, over_tcp},
                                                        .tcp = true},
                                                       collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  const std::vector<RemoteService> servers = client.available(service);
  ASSERT_EQ(servers.size(), 1U);
  EXPECT_EQ(servers[0].udp, (Endpoint{v6(0xfd, 0, 1), 40240}));
  EXPECT_EQ(servers[0].tcp, (Endpoint{v6(0xfd, 0, 1), 40241}));

  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].from, servers[0].udp);
  EXPECT_EQ(server.notify(offer, over_tcp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[1].from, servers[0].tcp);

  const auto payload = test::numbers(100'000);
  const ByteView slice{payload};
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    outcomes.clear();
    client.call(service, {.method = echo, .transport = transport}, {&slice, 1}, note());
    ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
    EXPECT_EQ(outcomes[0].payload, payload);
  }
}

}  // namespace
}  // namespace trestle::sd
