// ServiceDiscovery as a server that is subscribed to, in virtual time, with peers made by hand.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::server_subscription_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(Server, LetsOneClientSubscribeToEverything) {
  covers({"feat_req_someipcompat_1202"});
  OfferedService second = udp_service;
  second.instance = InstanceId{0x5679};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  ASSERT_TRUE(machine.discovery.offer(second, machine.now));
  machine.run_to(200ms);
  for (const std::uint16_t instance : {std::uint16_t{0x5678}, std::uint16_t{0x5679}}) {
    for (std::uint16_t eventgroup = 1; eventgroup <= 3; ++eventgroup) {
      FakePeer::Said said = subscribe(eventgroup, {udp(client_udp)});
      said.entry.instance = InstanceId{instance};
      machine.unicast(client, {said});
    }
  }
  const auto sent = machine.sent();
  ASSERT_THAT(sent, testing::SizeIs(1));
  EXPECT_THAT(sent.front(), testing::Not(testing::HasSubstr("nack")));
  EXPECT_THAT(machine.events(), testing::SizeIs(6));
}

TEST_F(Server, AcknowledgesASubscription) {
  covers({"feat_req_someipsd_432", "feat_req_someipsd_441", "feat_req_someipsd_613", "feat_req_someipsd_614",
          "feat_req_someipsd_625", "feat_req_someipsd_787", "feat_req_someipsd_833", "feat_req_someipsd_204",
          "feat_req_someip_545"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 5, 3)});
  EXPECT_THAT(machine.sent(),
              ElementsAre("200ms -> 10.0.0.2:30490 s1 reboot: ack 1234.5678 v1 group 0001 ttl 5 counter 3"));
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
  std::vector<Subscriber> subscribers;
  machine.discovery.for_each_subscriber(offered, EventgroupId{1},
                                        [&](const Subscriber& s) { subscribers.push_back(s); });
  EXPECT_THAT(subscribers, ElementsAre(Subscriber{client_sd, client_udp, std::nullopt}));
  machine.discovery.for_each_subscriber(offered, EventgroupId{2}, [&](const Subscriber&) { FAIL(); });
}

TEST_F(Server, EchoesReservedBitsInItsAck) {
  covers({"feat_req_someipsd_614"});
  offer(udp_service);
  // As vsomeip sends it, but for session and reserved bits: 00 -> a5, 0x0 -> 0x7.
  machine.receive(hex("ffff8100 00000030 00000001 01010200 c0000000 00000010"
                      "06000010 12345678 01000003 a5750001 0000000c 000904000a00000200119c40"),
                  client_sd, false);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 00000024 00000001 01010200 e0000000 00000010"
                                                "07000000 12345678 01000003 a5750001 00000000")));
}

TEST_F(Server, AnswersAllEntriesOfAMessageInOne) {
  covers({"feat_req_someipsd_836", "feat_req_someipsd_862"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)}), subscribe(9, {udp(client_udp)}),
                           subscribe(2, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(),
              ElementsAre("200ms -> 10.0.0.2:30490 s1 reboot: ack 1234.5678 v1 group 0001 ttl 3 counter 0; "
                          "nack 1234.5678 v1 group 0009 ttl 0 counter 0; "
                          "ack 1234.5678 v1 group 0002 ttl 3 counter 0 multicast 224.225.226.233:32344"));
}

TEST_F(Server, NamesTheMulticastEndpointInItsAck) {
  covers({"feat_req_someipsd_763", "feat_req_someipsd_789", "feat_req_someipsd_854", "feat_req_someipsd_626",
          "feat_req_someipsd_946"});
  offer(udp_service);
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(),
              ElementsAre("200ms -> 10.0.0.2:30490 s1 reboot: ack 1234.5678 v1 group 0002 ttl 3 counter 0 "
                          "multicast 224.225.226.233:32344"));
}

TEST_F(Server, CountsTheSubscribersOfAMulticastEventgroup) {
  covers({"feat_req_someipsd_626"});
  offer(udp_service);
  const Endpoint other_udp{IpAddress::v4(10, 0, 0, 3), 40000};
  FakePeer other{{other_udp.address, 30490}};
  const auto count = [&] {
    int subscribers = 0;
    machine.discovery.for_each_subscriber(offered, EventgroupId{2},
                                          [&](const Subscriber&) { ++subscribers; });
    return subscribers;
  };
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});  // a renewal
  EXPECT_EQ(count(), 1);
  machine.unicast(other, {subscribe(2, {udp(other_udp)}, 9)});
  EXPECT_EQ(count(), 2);
  machine.unicast(client, {subscribe(2, {udp(client_udp)}, 0)});
  EXPECT_EQ(count(), 1) << "stopped, and not the last";
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});
  EXPECT_EQ(count(), 2);
  machine.run_to(3300ms);
  EXPECT_EQ(count(), 1) << "expired, and not the last";
  machine.run_to(9300ms);
  EXPECT_EQ(count(), 0) << "expired, the last";
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});
  machine.unicast(client, {subscribe(2, {udp(client_udp)}, 0)});
  EXPECT_EQ(count(), 0) << "stopped, the last";
  machine.unicast(client, {subscribe(2, {udp(client_udp)})});
  machine.discovery.stop_offer(offered, machine.now);
  EXPECT_EQ(count(), 0) << "the service is down";
}

TEST_F(Server, NeedsNoEndpointForMulticastEventsAlone) {
  covers({"feat_req_someipsd_1179"});
  offer(udp_service);
  machine.unicast(client, {subscribe(3, {})});
  EXPECT_THAT(machine.events(), ElementsAre("added 0003 at 10.0.0.2:30490 initial"));
}

struct Refused {
  const char* why;
  FakePeer::Said said;
  NackReason reason;
};

TEST_F(Server, RefusesWhatItCannotServe) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_618", "feat_req_someipsd_619", "feat_req_someipsd_1137",
          "feat_req_someipsd_1144", "feat_req_someipsd_1145", "feat_req_someipsd_1164",
          "feat_req_someipsd_1233", "feat_req_someip_545"});
  offer(udp_service);
  const auto other = [](auto change) {
    FakePeer::Said said = subscribe(1, {udp(client_udp)});
    change(said.entry);
    return said;
  };
  EndpointOption bad_protocol = udp(client_udp);
  bad_protocol.transport = Transport{0x99};
  std::uint64_t nacks = 0;
  for (const auto& [why, said, reason] : {
           Refused{"unknown service", other([](Entry& e) { e.service = ServiceId{0x1235}; }),
                   NackReason::unknown_service},
           Refused{"unknown instance", other([](Entry& e) { e.instance = InstanceId{0x5679}; }),
                   NackReason::unknown_instance},
           Refused{"any instance", other([](Entry& e) { e.instance = someip::any_instance; }),
                   NackReason::unknown_instance},
           Refused{"unknown major version", other([](Entry& e) { e.major = 2; }), NackReason::unknown_major},
           Refused{"unknown eventgroup", subscribe(9, {udp(client_udp)}), NackReason::unknown_eventgroup},
           Refused{"no endpoint", subscribe(1, {}), NackReason::missing_endpoint},
           Refused{"TCP endpoint alone", subscribe(1, {tcp(client_tcp)}), NackReason::missing_endpoint},
           Refused{"protocol", subscribe(1, {bad_protocol}), NackReason::bad_options},
           Refused{"port 0", subscribe(1, {udp({client_udp.address, 0})}), NackReason::bad_options},
           Refused{"0.0.0.0", subscribe(1, {udp({IpAddress::v4(0, 0, 0, 0), 40000})}),
                   NackReason::bad_options},
           Refused{"own address", subscribe(1, {udp({own.address, 40000})}), NackReason::bad_options},
           Refused{"multicast address", subscribe(1, {udp({IpAddress::v4(224, 0, 0, 1), 40000})}),
                   NackReason::bad_options},
           Refused{"broadcast address", subscribe(1, {udp({IpAddress::v4(255, 255, 255, 255), 40000})}),
                   NackReason::bad_options},
           Refused{"loopback address", subscribe(1, {udp({IpAddress::v4(127, 0, 0, 1), 40000})}),
                   NackReason::bad_options},
           Refused{"conflict", subscribe(1, {udp(client_udp), udp({client_udp.address, 40001})}),
                   NackReason::bad_options},
       }) {
    SCOPED_TRACE(why);
    const std::uint64_t before =
        machine.discovery.counters().nacks_by_reason[static_cast<std::size_t>(reason)];
    machine.unicast(client, {said});
    EXPECT_EQ(machine.discovery.counters().nacks_by_reason[static_cast<std::size_t>(reason)], before + 1);
    EXPECT_EQ(machine.discovery.counters().nacks_sent, ++nacks);
    const auto sent = machine.sent();
    ASSERT_THAT(sent, testing::SizeIs(1));
    EXPECT_THAT(sent.front(), testing::HasSubstr(": nack "));
    EXPECT_THAT(machine.events(), IsEmpty());
  }
  machine.discovery.for_each_subscriber(offered, EventgroupId{1}, [](const Subscriber&) { FAIL(); });
}

// Entries whose references or options are broken in the bytes themselves.
TEST_F(Server, RefusesASubscriptionWithBrokenOptions) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_1164"});
  offer(udp_service);
  const std::string head = "ffff8100 00000030 00000000 01010200 c0000000 00000010";
  for (const char* rest : {
           "06010010 12345678 01000003 00000001 0000000c 000904000a00000200119c40",  // option 1 of 1
           "06000020 12345678 01000003 00000001 0000000c 000904000a00000200119c40",  // a run of 2 of 1
           "06000010 12345678 01000003 00000001 0000000c 000804000a00000200119c40",  // IPv4 option too short
           "06000010 12345678 01000003 00000001 0000000c 000a04000a00000200119c40",  // longer than the array
           "06000010 12345678 01000003 00000001 0000000c 00090100ffffffffffffffff",  // configuration beyond
                                                                                     // its end
       }) {
    machine.receive(hex(head + rest), client_sd, false);
    const auto sent = machine.sent();
    ASSERT_THAT(sent, testing::SizeIs(1)) << rest;
    EXPECT_THAT(sent.front(), testing::HasSubstr(": nack 1234.5678 v1 group 0001 ttl 0")) << rest;
  }
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Server, IgnoresOptionsItHasNoUseFor) {
  covers({"feat_req_someipsd_1141", "feat_req_someipsd_1142", "feat_req_someipsd_347"});
  offer(udp_service);
  const EndpointOption v6{EndpointRole::unicast,
                          {IpAddress{{0x20, 1, 0xd, 0xb8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9}, true}, 1}};
  const EndpointOption multicast{EndpointRole::multicast, events_multicast};
  machine.unicast(client, {subscribe(1, {udp(client_udp), tcp(client_tcp), v6, multicast, udp(client_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
  // An option of unknown type 0x77 between, and an empty second run that begins at 9.
  machine.receive(hex("ffff8100 00000036 00000000 01010200 c0000000 00000010"
                      "06000920 12345678 01000003 00010001 00000012 000377 00dead 000904000a00000200119c40"),
                  client_sd, false);
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
}

TEST_F(Server, IgnoresASubscriptionByMulticast) {
  covers({"feat_req_someipsd_818"});
  offer(udp_service);
  machine.multicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_wrong_transport, 1U);
}

TEST_F(Server, SubscribesTcpEventsOnlyWithAConnection) {
  covers({"feat_req_someipsd_1137", "feat_req_someipsd_788", "feat_req_someipsd_435"});
  offer(tcp_service);
  machine.unicast(client, {subscribe(4, {tcp(client_tcp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::HasSubstr("nack")));
  EXPECT_EQ(
      machine.discovery.counters().nacks_by_reason[static_cast<std::size_t>(NackReason::no_tcp_connection)],
      1U);
  EXPECT_TRUE(machine.discovery.tcp_connected(service_tcp, client_tcp));
  machine.unicast(client, {subscribe(4, {tcp(client_tcp)}), subscribe(5, {tcp(client_tcp)}),
                           subscribe(5, {tcp(client_tcp), udp(client_udp)})});
  EXPECT_THAT(machine.events(),
              ElementsAre("added 0004 tcp 10.0.0.2:41000 at 10.0.0.2:30490 initial",
                          "added 0005 udp 10.0.0.2:40000 tcp 10.0.0.2:41000 at 10.0.0.2:30490 initial"));
  machine.discovery.tcp_closed(service_tcp, client_tcp);
  EXPECT_THAT(
      machine.events(),
      ElementsAre("removed 0004 tcp 10.0.0.2:41000 at 10.0.0.2:30490 unreachable",
                  "removed 0005 udp 10.0.0.2:40000 tcp 10.0.0.2:41000 at 10.0.0.2:30490 unreachable"));
}

// One port of the client's may be connected to several of ours.
TEST_F(Server, EndsTheSubscriptionsOfTheConnectionThatClosedAlone) {
  covers({"feat_req_someipsd_435", "feat_req_someipsd_788"});
  offer(tcp_service);
  OfferedService second = tcp_service;
  second.instance = InstanceId{0x5679};
  second.tcp = Endpoint{service_tcp.address, 30511};
  const auto other = machine.discovery.offer(second, machine.now);
  ASSERT_TRUE(other);
  machine.run_to(400ms);
  ASSERT_TRUE(machine.discovery.tcp_connected(service_tcp, client_tcp));
  ASSERT_TRUE(machine.discovery.tcp_connected(*second.tcp, client_tcp));
  FakePeer::Said to_second = subscribe(4, {tcp(client_tcp)});
  to_second.entry.instance = InstanceId{0x5679};
  machine.unicast(client, {subscribe(4, {tcp(client_tcp)}), to_second});
  EXPECT_THAT(machine.events(), testing::SizeIs(2));
  machine.sent();

  machine.discovery.tcp_closed(service_tcp, client_tcp);
  EXPECT_THAT(machine.events(), ElementsAre("removed 0004 tcp 10.0.0.2:41000 at 10.0.0.2:30490 unreachable"));
  std::size_t left = 0;
  machine.discovery.for_each_subscriber(*other, EventgroupId{4}, [&](const Subscriber&) { ++left; });
  EXPECT_EQ(left, 1U);
  // And the other connection is still known.
  FakePeer::Said more = subscribe(4, {tcp(client_tcp)}, 3, 1);
  more.entry.instance = InstanceId{0x5679};
  machine.unicast(client, {more, subscribe(4, {tcp(client_tcp)}, 3, 1)});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::AllOf(testing::HasSubstr(": ack 1234.5679"),
                                                         testing::HasSubstr("; nack 1234.5678"))));
}

// And several clients to one port of ours.
TEST_F(Server, EndsTheSubscriptionsOfTheClientWhoseConnectionClosedAlone) {
  covers({"feat_req_someipsd_435", "feat_req_someipsd_788"});
  offer(tcp_service);
  const Endpoint other_tcp{client_tcp.address, 41001};
  ASSERT_TRUE(machine.discovery.tcp_connected(service_tcp, client_tcp));
  ASSERT_TRUE(machine.discovery.tcp_connected(service_tcp, other_tcp));
  machine.unicast(client, {subscribe(4, {tcp(client_tcp)}), subscribe(4, {tcp(other_tcp)}, 3, 1)});
  EXPECT_THAT(machine.events(), testing::SizeIs(2));
  machine.sent();

  machine.discovery.tcp_closed(service_tcp, client_tcp);
  EXPECT_THAT(machine.events(), ElementsAre("removed 0004 tcp 10.0.0.2:41000 at 10.0.0.2:30490 unreachable"));
  // The connection of the other is still known, that of this client is not.
  machine.unicast(client, {subscribe(4, {tcp(other_tcp)}, 3, 1), subscribe(4, {tcp(client_tcp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::AllOf(testing::HasSubstr(": ack 1234.5678"),
                                                         testing::HasSubstr("; nack 1234.5678"))));
}

TEST_F(Server, DropsASubscriberThatCannotBeReached) {
  covers({"feat_req_someipsd_435"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.events();
  machine.discovery.unreachable({client_udp.address, 40001});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.discovery.unreachable(client_udp);
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 unreachable"));
}

TEST_F(Server, RenewsWithoutInitialData) {
  covers({"feat_req_someipsd_833", "feat_req_someipsd_1192", "feat_req_someipsd_625"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.events();
  machine.run_to(3100ms);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), testing::SizeIs(1));
  machine.run_to(6000ms);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.run_to(6100ms);
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 expired"));
}

TEST_F(Server, SendsInitialDataToThoseWhoAsk) {
  covers({"feat_req_someipsd_1188", "feat_req_someipsd_1194"});
  offer(udp_service);
  FakePeer asking{client_sd, unicast_flag | explicit_initial_data_flag};
  machine.unicast(asking, {subscribe(1, {udp(client_udp)}, 3, 0, false)});
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490"));
  machine.unicast(asking, {subscribe(1, {udp(client_udp)}, 3, 0, true)});
  EXPECT_THAT(machine.events(), ElementsAre("initial 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490"));
}

TEST_F(Server, IgnoresTheInitialDataFlagOfThoseWhoDoNotKnowIt) {
  covers({"feat_req_someipsd_1188"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 3, 0, true)});
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 3, 0, true)});
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
}

TEST_F(Server, EndsASubscriptionThatIsStopped) {
  covers(
      {"feat_req_someipsd_1297", "feat_req_someipsd_433", "feat_req_someipsd_625", "feat_req_someipsd_442"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.sent();
  machine.events();
  // Another client, another eventgroup, another counter, another port: not this one.
  FakePeer stranger{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.unicast(stranger, {subscribe(1, {udp(client_udp)}, 0)});
  machine.unicast(client, {subscribe(2, {udp(client_udp)}, 0), subscribe(1, {udp(client_udp)}, 0, 1),
                           subscribe(1, {udp({client_udp.address, 40001})}, 0)});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 stopped"));
  EXPECT_THAT(machine.sent(), IsEmpty());  // a stop is never answered
}

TEST_F(Server, StartsAnewOnStopAndSubscribeInOneMessage) {
  covers({"feat_req_someipsd_833", "feat_req_someipsd_862"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.events();
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 0), subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 stopped",
                                            "added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
}

TEST_F(Server, KeepsAnEndlessSubscription) {
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  machine.events();
  machine.run_to(24h);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Server, DropsTheSubscriptionsOfARebootedClient) {
  covers({"feat_req_someipsd_871", "feat_req_someipsd_813"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  machine.multicast(client, {find(0x9999)});
  machine.events();
  machine.multicast(client, {find(0x9999)});  // else its first message would come twice
  client.reboot();
  machine.multicast(client, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 rebooted"));
  // Its first unicast message belongs to the same reboot.
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, infinite_ttl_s)});
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
  EXPECT_EQ(machine.discovery.counters().reboots_detected, 1U);
}

TEST(ServerBehindANat, TakesTheSdEndpointOptionForTheSender) {
  covers(
      {"feat_req_someipsd_1084", "feat_req_someipsd_1152", "feat_req_someipsd_809", "feat_req_someipsd_814"});
  static constexpr std::array behind{ForeignEndpoints{client_sd.address, IpAddress::v4(10, 0, 0, 9)}};
  static constexpr std::span<const ForeignEndpoints> allowed{behind};
  Settings settings = fixed_settings();
  settings.foreign_endpoints = &allowed;
  Machine<> machine{settings};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  machine.run_to(200ms);
  // First option: SD endpoint 10.0.0.9:30490; a second one, 10.0.0.8, does not count.
  machine.receive(hex("ffff8100 00000048 00000001 01010200 c0000000 00000010"
                      "06020010 12345678 01000003 00000001 00000024"
                      "000924000a0000090011771a 000924000a0000080011771a 000904000a00000200119c40"),
                  client_sd, false);
  EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("200ms -> 10.0.0.9:30490 s1 reboot: ack")));
  EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.9:30490 initial"));
}

TEST_F(Server, IgnoresAnSdEndpointThatCannotBe) {
  covers({"feat_req_someipsd_1135"});
  offer(udp_service);
  // 224.0.0.1 as SD endpoint.
  machine.receive(hex("ffff8100 0000003c 00000001 01010200 c0000000 00000010"
                      "06010010 12345678 01000003 00000001 00000018"
                      "000924 00 e0000001 00 11 771a 000904000a00000200119c40"),
                  client_sd, false);
  EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("200ms -> 10.0.0.2:30490 s1 reboot: ack")));
  // 10.0.0.9 with port 0, and with TCP.
  for (const char* const option : {"0a000009 00 11 0000", "0a000009 00 06 771a"}) {
    machine.receive(hex("ffff8100 0000003c 00000000 01010200 c0000000 00000010"
                        "06010010 12345678 01000003 00000001 00000018"
                        "000924 00" +
                        std::string{option} + "000904000a00000200119c40"),
                    client_sd, false);
    EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("200ms -> 10.0.0.2:30490 s")));
  }
}

TEST(ServerOnIpv6, UsesIpv6Options) {
  covers({"feat_req_someipsd_757", "feat_req_someipsd_810", "feat_req_someipsd_851", "feat_req_someipsd_853",
          "feat_req_someipsd_1083", "feat_req_someipsd_1100"});
  const auto address = [](std::uint8_t last) {
    return IpAddress{{0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, last}, true};
  };
  const IpAddress multicast{{0xff, 0x14, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9}, true};
  Settings settings = fixed_settings();
  settings.unicast = {address(1), 30490};
  settings.multicast = {IpAddress{{0xff, 0x14, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4}, true}, 30490};
  settings.subnet_prefix_bits = 64;
  settings.own_endpoints_only = false;
  Machine<> machine{settings};
  const std::array v6_groups{Eventgroup{.id = EventgroupId{1}, .multicast = Endpoint{multicast, 32344}}};
  ASSERT_TRUE(machine.discovery.offer({.service = ServiceId{0x1234},
                                       .instance = InstanceId{0x5678},
                                       .udp = Endpoint{address(1), 30509},
                                       .eventgroups = v6_groups},
                                      machine.now));
  machine.discovery.on_time(start + 10ms);
  std::array<std::byte, 1400> room{};
  auto transmit = machine.discovery.poll_transmit(room, start + 10ms);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(transmit->destination, settings.multicast);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 0000003c 00000001 01010200 e0000000 00000010"
                                                "01000010 12345678 01000003 00000000 00000018"
                                                "001506 00 fd000000000000000000000000000001 00 11 772d")));
  // The peer is 4: so says its SD endpoint option. Its IPv4 option is of no use, its IPv6 one is.
  machine.receive(hex("ffff8100 00000060 00000001 01010200 c0000000 00000010"
                      "06010020 12345678 01000003 00000001 0000003c"
                      "001526 00 fd000000000000000000000000000004 00 11 771a"
                      "000904 00 0a000002 00 11 9c40"
                      "001506 00 fd000000000000000000000000000002 00 11 9c40"),
                  {address(2), 30490}, false);
  transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(transmit->destination, (Endpoint{address(4), 30490}));
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 0000003c 00000001 01010200 e0000000 00000010"
                                                "07000010 12345678 01000003 00000001 00000018"
                                                "001516 00 ff140000000000000000000000000009 00 11 7e58")));
  // From another subnet.
  machine.receive(hex("ffff8100 0000003c 00000002 01010200 c0000000 00000010"
                      "06000010 12345678 01000003 00000001 00000018"
                      "001506 00 fd000000000000010000000000000002 00 11 9c40"),
                  {address(2), 30490}, false);
  EXPECT_THAT(machine.sent(), ElementsAre(testing::HasSubstr("nack")));
}

TEST(ServerOnIpv6, TakesTheFirstSdEndpointOptionAlone) {
  covers({"feat_req_someipsd_1154"});
  const auto address = [](std::uint8_t last) {
    return IpAddress{{0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, last}, true};
  };
  Settings settings = fixed_settings();
  settings.unicast = {address(1), 30490};
  settings.own_endpoints_only = false;
  Machine<> machine{settings};
  // A subscription to nothing we have: its Nack shows where we answer.
  machine.receive(hex("ffff8100 0000006c 00000001 01010200 c0000000 00000010"
                      "06020010 12345678 01000003 00000001 00000048"
                      "001526 00 fd000000000000000000000000000004 00 11 771a"
                      "001526 00 fd000000000000000000000000000005 00 11 771a"
                      "001506 00 fd000000000000000000000000000002 00 11 9c40"),
                  {address(2), 30490}, false);
  EXPECT_THAT(
      machine.sent(),
      ElementsAre(testing::StartsWith("0ms -> [fd000000000000000000000000000004]:30490 s1 reboot: nack")));
}

TEST_F(Server, ServesSubscribersThatBothSidesAreConfiguredWith) {
  covers({"feat_req_someipsd_444"});
  offer(udp_service);
  const auto clients_of = [&](std::uint16_t eventgroup) {
    std::vector<Subscriber> found;
    machine.discovery.for_each_subscriber(offered, EventgroupId{eventgroup},
                                          [&](const Subscriber& s) { found.push_back(s); });
    return found;
  };
  ASSERT_TRUE(machine.discovery.add_subscriber(offered, EventgroupId{1}, client_udp));
  ASSERT_TRUE(machine.discovery.add_subscriber(offered, EventgroupId{3}, client_udp));
  const Subscriber configured{client_udp, client_udp, std::nullopt};
  EXPECT_THAT(clients_of(1), ElementsAre(configured));
  EXPECT_THAT(clients_of(2), IsEmpty());
  EXPECT_THAT(clients_of(3), ElementsAre(Subscriber{client_udp, std::nullopt, std::nullopt}));
  // Nothing is said about it, and nothing ends it: neither time nor link, neither a reboot of its host nor
  // an unreachable port, neither a StopSubscribe of the same endpoint.
  EXPECT_THAT(machine.sent(), IsEmpty());
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(testing::StartsWith("added 0001")));
  EXPECT_THAT(clients_of(1), testing::SizeIs(2));
  machine.unicast(client, {subscribe(1, {udp(client_udp)}, 0)});
  client.reboot();
  machine.unicast(client, {find(0x9999)});
  machine.discovery.unreachable(client_udp);
  machine.discovery.link_down();
  machine.discovery.link_up(machine.now);
  machine.run_to(1h);
  EXPECT_THAT(clients_of(1), ElementsAre(configured));
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 stopped"));
  machine.discovery.stop_offer(offered, machine.now);
  EXPECT_THAT(clients_of(1), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Server, TakesNoImpossibleConfiguredSubscriber) {
  covers({"feat_req_someipsd_444"});
  offer(tcp_service);
  const std::array plain{Eventgroup{.id = EventgroupId{1}}};
  const auto other = machine.discovery.offer(
      {.service = ServiceId{1}, .instance = InstanceId{1}, .udp = service_udp, .eventgroups = plain},
      machine.now);
  ASSERT_TRUE(other);
  const auto error_of = [&](OfferHandle handle, std::uint16_t eventgroup, const Endpoint& endpoint) {
    const auto result = machine.discovery.add_subscriber(handle, EventgroupId{eventgroup}, endpoint);
    return result ? "none" : to_string(result.error());
  };
  EXPECT_STREQ(error_of({}, 1, client_udp), "unknown handle");
  EXPECT_STREQ(error_of(*other, 2, client_udp), "bad argument");
  EXPECT_STREQ(error_of(offered, 4, client_udp), "bad argument");  // with TCP events
  EXPECT_STREQ(error_of(*other, 1, {client_udp.address, 0}), "bad argument");
  EXPECT_STREQ(error_of(*other, 1, events_multicast), "bad argument");
  EXPECT_STREQ(error_of(*other, 1, client_udp), "none");
  EXPECT_STREQ(error_of(*other, 1, client_udp), "duplicate");
  EXPECT_STREQ(error_of(*other, 1, client_sd), "none");
}

}  // namespace
}  // namespace trestle::sd::server_subscription_test
