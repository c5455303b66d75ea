// Who may name endpoints at whose address.
#include "sd/core/receive_buffer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::foreign_endpoints_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr IpAddress liar_address = IpAddress::v4(10, 0, 0, 9);
constexpr Endpoint liar_sd{liar_address, 30490};
constexpr Endpoint liar_udp{liar_address, 40000};
constexpr std::array pairs{ForeignEndpoints{liar_address, client_sd.address}};
constexpr std::span<const ForeignEndpoints> allowed{pairs};

Settings allowing() {
  Settings settings = fixed_settings();
  settings.foreign_endpoints = &allowed;
  return settings;
}

Settings trusting() {
  Settings settings = fixed_settings();
  settings.own_endpoints_only = false;
  return settings;
}

// An empty message of the liar, of its first session, that names the SD endpoint 10.0.0.2:30490.
std::vector<std::byte> named_as_other() {
  return hex("ffff8100 00000020 00000001 01010200 c0000000 00000000 0000000c 000924 00 0a000002 00 11 771a");
}

TEST_F(Client, TakesNobodysWordForTheRebootOfAnother) {
  covers({"feat_req_someipsd_1149", "feat_req_someipsd_1152"});
  subscribed();
  for (int i = 0; i < 3; ++i) {
    machine.receive(named_as_other(), liar_sd, false);
  }
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_foreign_endpoints, 3U);
}

TEST_F(Client, IgnoresOffersOfEndpointsOfOthers) {
  covers({"feat_req_someipsd_1149"});
  require(required);
  FakePeer liar{liar_sd};
  machine.multicast(liar, {offer({udp(server_udp)}), offer({udp(liar_udp), tcp(server_tcp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_foreign_endpoints, 2U);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("udp 10.0.0.2:30509")));
}

TEST_F(Server, SendsNothingToWhoDidNotSubscribe) {
  covers({"feat_req_someipsd_1149", "feat_req_someipsd_1164"});
  offer(udp_service);
  FakePeer liar{liar_sd};
  machine.unicast(liar, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("-> 10.0.0.9:30490 s1 reboot: nack")));
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_foreign_endpoints, 1U);
}

TEST_F(Server, TellsNobodysBufferForThatOfAnother) {
  offer(udp_service);
  FakePeer liar{liar_sd};
  FakePeer::Said said = subscribe(1, {udp(client_udp)});
  const ReceiveBufferOption one_byte{1};
  said.more.push_back(
      {OptionType::configuration, {one_byte.view().body.begin(), one_byte.view().body.end()}});
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.unicast(liar, {said});
  EXPECT_EQ(machine.discovery.receive_buffer_of(client_udp), 0U);
}

TEST(ForeignEndpoints, AreTakenOfWhoMayNameThem) {
  covers({"feat_req_someipsd_1149"});
  for (const Settings& settings : {allowing(), trusting()}) {
    Machine<> machine{settings};
    FakePeer liar{liar_sd};
    ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
    ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x4321}}, machine.now));
    machine.run_to(200ms);
    machine.unicast(liar, {subscribe(1, {udp(client_udp)}), test::offer({udp(server_udp)}, 3, 0x4321)});
    EXPECT_THAT(machine.events(), testing::SizeIs(2));
    machine.sent();
    machine.receive(named_as_other(), liar_sd, false);
    EXPECT_EQ(machine.discovery.counters().ignored_foreign_endpoints, 0U);
  }
}

TEST(ForeignEndpoints, MayBeThoseOfTheSdEndpoint) {
  // What is named at the SD endpoint that the peer may have, its own address aside.
  Machine<> machine{allowing()};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  machine.run_to(200ms);
  machine.receive(hex("ffff8100 0000003c 00000001 01010200 c0000000 00000010"
                      "06010010 12345678 01000003 00000001 00000018"
                      "000924 00 0a000002 00 11 771a 000904000a00000200119c40"),
                  liar_sd, false);
  EXPECT_THAT(machine.sent(), ElementsAre(StartsWith("200ms -> 10.0.0.2:30490 s1 reboot: ack")));
}

}  // namespace
}  // namespace trestle::sd::foreign_endpoints_test
