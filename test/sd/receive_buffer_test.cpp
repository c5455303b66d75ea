// The item by which a subscriber tells how much its socket has room for.
#include "sd/core/receive_buffer.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::receive_buffer_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Reserved byte, length, "trestle.rcvbuf=212992", end mark.
const std::string told_212992 =
    "0015"
    "74726573746c652e726376627566"
    "3d"
    "323132393932"
    "00";

TEST(ReceiveBufferOption, IsAConfigurationOptionWithOneItem) {
  covers({"feat_req_someipsd_152", "feat_req_someipsd_946"});
  const ReceiveBufferOption option{212'992};
  EXPECT_EQ(option.view().type, OptionType::configuration);
  EXPECT_EQ(to_hex(option.view().body), told_212992);
  EXPECT_EQ(to_hex(ReceiveBufferOption{0xffff'ffff}.view().body),
            "001974726573746c652e7263766275663d3432393439363732393500");
  EXPECT_FALSE(find_fault(option.view()));
}

/// One configuration option with these items.
std::vector<std::byte> configuration(const std::vector<std::string>& items) {
  std::vector<std::byte> body{std::byte{0}};
  for (const std::string& item : items) {
    body.push_back(static_cast<std::byte>(item.size()));
    for (const char character : item) {
      body.push_back(static_cast<std::byte>(character));
    }
  }
  body.push_back(std::byte{0});
  return body;
}

std::uint32_t read(const std::vector<std::string>& items) {
  const auto body = configuration(items);
  return receive_buffer_in(ConfigurationCursor{{OptionType::configuration, body}});
}

TEST(ReceiveBufferOption, IsReadAmongOtherItems) {
  covers({"feat_req_someipsd_1147"});
  EXPECT_EQ(read({"trestle.rcvbuf=212992"}), 212'992U);
  EXPECT_EQ(read({"a=1", "b", "trestle.rcvbuf=5", "c="}), 5U);
  EXPECT_EQ(read({"trestle.rcvbuf=5", "trestle.rcvbuf=7"}), 5U) << "the first counts";
  EXPECT_EQ(read({"trestle.rcvbuf=4294967295"}), 0xffff'ffffU);
  EXPECT_EQ(read({"trestle.rcvbuf=4294967296"}), 0xffff'ffffU) << "as much as can be told";
  EXPECT_EQ(read({"trestle.rcvbuf=" + std::string(230, '9')}), 0xffff'ffffU);
}

TEST(ReceiveBufferOption, TellsNothingWhenItIsMalformed) {
  for (const std::string item :
       {"trestle.rcvbuf", "trestle.rcvbuf=", "trestle.rcvbuf=0", "trestle.rcvbuf=12k", "trestle.rcvbuf=-1",
        "trestle.rcvbuf= 1", "trestle.rcvbuf=+1", "trestle.rcvbuf=0x10", "trestle.rcvbuf2=9", "rcvbuf=9",
        "x=trestle.rcvbuf=9"}) {
    EXPECT_EQ(read({item}), 0U) << item;
  }
  EXPECT_EQ(read({}), 0U);
  EXPECT_EQ(receive_buffer_in(ConfigurationCursor{{OptionType::configuration, {}}}), 0U)
      << "no reserved byte";
  auto cut = configuration({"trestle.rcvbuf=212992"});
  cut.resize(10);
  EXPECT_EQ(receive_buffer_in(ConfigurationCursor{{OptionType::configuration, cut}}), 0U)
      << "the item is longer than the option";
}

// --- The client -------------------------------------------------------------------------------------------

class ClientThatTells : public Client {
 protected:
  ClientThatTells() { server = FakePeer{server_sd, unicast_flag | explicit_initial_data_flag}; }
};

TEST_F(ClientThatTells, TellsItInSubscribeRenewalAndStopSubscribe) {
  covers({"feat_req_someipsd_946", "feat_req_someipsd_1177"});
  require(required);
  const SubscriptionHandle subscription =
      subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 212'992});
  const std::string options = " udp 10.0.0.1:40000 option 01:" + told_212992;
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("0ms -> 10.0.0.2:30490 s1 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "initial" +
                  options));
  machine.unicast(server, {ack(1)});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("ttl 3 counter 0" + options)));
  machine.discovery.unsubscribe(subscription, machine.now);
  EXPECT_THAT(machine.sent(),
              ElementsAre(HasSubstr("stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0" + options)));
}

TEST_F(ClientThatTells, SharesTheOptionAmongTheEntriesOfAMessage) {
  covers({"feat_req_someipsd_900"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 212'992});
  subscribe_to(
      {.eventgroup = EventgroupId{2}, .udp = own_udp, .tcp = own_tcp, .receive_buffer_bytes = 212'992});
  machine.unicast(server, {offer({udp(server_udp)})});
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  // The second entry finds the configuration there, and has its endpoints behind it.
  EXPECT_EQ(to_hex(transmit->bytes.subspan(20)), to_hex(hex("00000020"
                                                            "06000020 12345678 01000003 00800001"
                                                            "06020121 12345678 01000003 00800002"
                                                            "0000003f"
                                                            "0009 04 00 0a000001 00 11 9c40"
                                                            "0018 01" +
                                                            told_212992 +
                                                            "0009 04 00 0a000001 00 11 9c40"
                                                            "0009 04 00 0a000001 00 06 a028")));
}

TEST_F(ClientThatTells, DoesNotTellWhatItNeedNot) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 0});
  subscribe_to({.eventgroup = EventgroupId{2}, .tcp = own_tcp, .receive_buffer_bytes = 212'992});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(Not(HasSubstr("option"))));
}

// Of which some cannot bear it.
TEST_F(ClientThatTells, DoesNotTellServersFromBeforeExplicitInitialData) {
  server = FakePeer{server_sd, unicast_flag};
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 212'992});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::EndsWith("initial udp 10.0.0.1:40000")));
}

TEST(ClientThatDoesNotTell, LeavesTheOptionOut) {
  Settings settings = fixed_settings();
  EXPECT_TRUE(settings.tell_receive_buffer);
  settings.tell_receive_buffer = false;
  Machine<> machine{settings};
  FakePeer server{server_sd, unicast_flag | explicit_initial_data_flag};
  const auto requirement = machine.discovery.require(required, machine.now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(machine.discovery.subscribe(
      *requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 212'992},
      machine.now));
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::EndsWith("initial udp 10.0.0.1:40000")));
}

// At most one configuration option may be there, and what is not SOME/IP has its name in it.
TEST_F(ClientThatTells, LeavesTheNameOfOtherProtocolsAlone) {
  covers({"feat_req_someipsd_946", "feat_req_someipsd_503"});
  require({.service = other_protocols, .instance = InstanceId{0x5678}, .major = 1, .otherserv = "x"});
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .receive_buffer_bytes = 212'992});
  FakePeer::Said said = test::offer({udp(server_udp)});
  said.entry.service = other_protocols;
  said.more.push_back({OptionType::configuration, configuration({"otherserv=x"})});
  machine.unicast(server, {said});
  // "otherserv=x"
  EXPECT_THAT(machine.sent(),
              ElementsAre(testing::EndsWith(" udp 10.0.0.1:40000 option 01:000b6f74686572736572763d7800")));
}

// --- The server -------------------------------------------------------------------------------------------

class ServerThatIsTold : public Server {
 protected:
  std::vector<std::uint32_t> told(std::uint16_t eventgroup = 1) {
    std::vector<std::uint32_t> all;
    machine.discovery.for_each_subscriber(offered, EventgroupId{eventgroup}, [&](const Subscriber& one) {
      all.push_back(one.receive_buffer_bytes);
    });
    return all;
  }
  static FakePeer::Said telling(std::uint16_t eventgroup, const std::vector<std::string>& items,
                                std::vector<EndpointOption> options = {udp(client_udp)}) {
    FakePeer::Said said = subscribe(eventgroup, std::move(options));
    said.more.push_back({OptionType::configuration, configuration(items)});
    return said;
  }
};

TEST_F(ServerThatIsTold, KeepsItWithTheSubscriber) {
  covers({"feat_req_someipsd_946", "feat_req_someipsd_900"});
  offer(udp_service);
  machine.unicast(client, {telling(1, {"trestle.rcvbuf=212992"}), telling(2, {"trestle.rcvbuf=212992"}),
                           telling(3, {"trestle.rcvbuf=7"})});
  EXPECT_THAT(machine.sent(), ElementsAre(Not(HasSubstr("nack"))));
  EXPECT_THAT(told(1), ElementsAre(212'992));
  EXPECT_THAT(told(2), ElementsAre(212'992));
  EXPECT_THAT(told(3), ElementsAre(7)) << "all its events are multicast";
}

// The bytes of a Subscribe whose first run is the configuration, and the second one the endpoint.
TEST_F(ServerThatIsTold, ReadsBothRuns) {
  covers({"feat_req_someipsd_342"});
  offer(udp_service);
  for (const char* const runs : {"00 01 11", "01 00 11"}) {
    machine.discovery.on_datagram(hex("ffff8100 0000004b 00000001 01010200 40000000 00000010"
                                      "06" +
                                      std::string{runs} +
                                      "12345678 01000003 00000001"
                                      "00000027"
                                      "0018 01" +
                                      told_212992 + "0009 04 00 0a000002 00 11 9c40"),
                                  client_sd, false, machine.now);
    EXPECT_THAT(machine.sent(), ElementsAre(Not(HasSubstr("nack"))));
    EXPECT_THAT(told(), ElementsAre(212'992));
  }
}

TEST_F(ServerThatIsTold, TakesWhatTheLastRenewalTells) {
  offer(udp_service);
  machine.unicast(client, {telling(1, {"trestle.rcvbuf=100"})});
  machine.unicast(client, {telling(1, {"trestle.rcvbuf=200"})});
  EXPECT_THAT(told(), ElementsAre(200)) << "no second subscription";
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(told(), ElementsAre(0));
  EXPECT_THAT(machine.events(), testing::SizeIs(1));
}

TEST_F(ServerThatIsTold, EndsASubscriptionWhateverTheStopSubscribeTells) {
  covers({"feat_req_someipsd_1177"});
  offer(udp_service);
  machine.unicast(client, {telling(1, {"trestle.rcvbuf=100"})});
  FakePeer::Said stop = telling(1, {"trestle.rcvbuf=200"});
  stop.entry.ttl_s = 0;
  machine.unicast(client, {stop});
  EXPECT_THAT(told(), IsEmpty());
}

TEST_F(ServerThatIsTold, AcceptsWhatItDoesNotUnderstand) {
  covers({"feat_req_someipsd_1142"});
  offer(udp_service);
  machine.unicast(client, {telling(1, {"trestle.rcvbuf=many", "colour=blue"})});
  EXPECT_THAT(machine.sent(), ElementsAre(Not(HasSubstr("nack"))));
  EXPECT_THAT(told(), ElementsAre(0));
}

TEST_F(ServerThatIsTold, HasNoUseForItWithoutEventsByUdp) {
  offer(tcp_service);
  ASSERT_TRUE(machine.discovery.tcp_connected(service_tcp, client_tcp));
  machine.unicast(client, {telling(4, {"trestle.rcvbuf=100"}, {udp(client_udp), tcp(client_tcp)}),
                           telling(5, {"trestle.rcvbuf=100"}, {udp(client_udp), tcp(client_tcp)})});
  EXPECT_THAT(told(4), ElementsAre(0));
  EXPECT_THAT(told(5), ElementsAre(100));
}

}  // namespace
}  // namespace trestle::sd::receive_buffer_test
