// What a server does with the TCP connections of a client that was started anew.
#include "test/covers.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::reboot_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

class ServerOfRebootedClients : public Server {
 protected:
  void SetUp() override {
    offer(tcp_service);
    machine.sent();
  }
  Endpoint from(std::uint16_t port) const { return {client_sd.address, port}; }
  void connect(std::uint16_t port) { EXPECT_TRUE(machine.discovery.tcp_connected(service_tcp, from(port))); }
};

TEST_F(ServerOfRebootedClients, GivesUpTheirConnections) {
  covers({"feat_req_someipsd_872", "feat_req_someipsd_871"});
  connect(41000);
  connect(41001);  // for calls alone
  const Endpoint other{IpAddress::v4(10, 0, 0, 3), 41000};
  EXPECT_TRUE(machine.discovery.tcp_connected(service_tcp, other));
  machine.unicast(client, {subscribe(4, {tcp(from(41000))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added 0004")));
  machine.sent();
  client.reboot();
  machine.unicast(client, {find(0x9999)});
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre("removed 0004 tcp 10.0.0.2:41000 at 10.0.0.2:30490 rebooted",
                                   "outdated 10.0.0.1:30510 from 10.0.0.2:41000",
                                   "outdated 10.0.0.1:30510 from 10.0.0.2:41001"));
  // Nothing can be subscribed to over them any more, though nobody has said yet that they are closed.
  machine.unicast(client, {subscribe(4, {tcp(from(41000))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack")));
  machine.discovery.tcp_closed(service_tcp, from(41000));
  connect(41002);
  machine.unicast(client, {subscribe(4, {tcp(from(41002))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added 0004 tcp 10.0.0.2:41002")));
}

// A client connects before it says anything: to the offer that came before its first message.
TEST_F(ServerOfRebootedClients, KeepsTheConnectionsOfTheirNewLife) {
  covers({"feat_req_someipsd_872", "feat_req_someipsd_767"});
  connect(41000);
  machine.unicast(client, {subscribe(4, {tcp(from(41000))})});
  machine.sent();
  machine.events();
  client.reboot();
  connect(41001);
  machine.unicast(client, {subscribe(4, {tcp(from(41001))})});
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre("outdated 10.0.0.1:30510 from 10.0.0.2:41000", HasSubstr("rebooted"),
                                   HasSubstr("added 0004 tcp 10.0.0.2:41001")));
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
  // By its next reboot that one is old too.
  client.reboot();
  machine.unicast(client, {find(0x9999)});
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre("outdated 10.0.0.1:30510 from 10.0.0.2:41001", HasSubstr("rebooted")));
}

// As its subscriptions tell: the connection comes from another address than its messages.
TEST(ServerOfRebootedClientsElsewhere, GivesUpConnectionsFromTheirOtherAddresses) {
  covers({"feat_req_someipsd_872"});
  constexpr Endpoint elsewhere{IpAddress::v4(10, 0, 0, 77), 41000};
  static constexpr std::array both{ForeignEndpoints{client_sd.address, elsewhere.address}};
  static constexpr std::span<const ForeignEndpoints> allowed{both};
  Settings settings = fixed_settings();
  settings.foreign_endpoints = &allowed;
  Machine<> machine{settings};
  FakePeer client{client_sd};
  ASSERT_TRUE(machine.discovery.offer(tcp_service, machine.now));
  machine.run_to(200ms);
  machine.unicast(client, {find(0x9999)});
  EXPECT_TRUE(machine.discovery.tcp_connected(service_tcp, elsewhere));
  machine.unicast(client, {subscribe(4, {tcp(elsewhere)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("added 0004")));
  client.reboot();
  machine.unicast(client, {find(0x9999)});
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre("outdated 10.0.0.1:30510 from 10.0.0.77:41000", HasSubstr("rebooted")));
}

TEST_F(ServerOfRebootedClients, GivesUpNothingWithoutAReboot) {
  covers({"feat_req_someipsd_872"});
  connect(41000);
  machine.unicast(client, {find(0x9999)});
  machine.unicast(client, {find(0x9999)});
  EXPECT_THAT(machine.events(), IsEmpty());
}

}  // namespace
}  // namespace trestle::sd::reboot_test
