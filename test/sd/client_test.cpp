// ServiceDiscovery as a client that looks for services, in virtual time, with peers made by hand.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"

namespace trestle::sd::client_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(Client, LooksForAServiceInTwoPhases) {
  covers({"feat_req_someipsd_18", "feat_req_someipsd_72", "feat_req_someipsd_812", "feat_req_someipsd_866",
          "feat_req_someipsd_877", "feat_req_someipcompat_1197", "feat_req_someipcompat_802"});
  require(required);
  EXPECT_THAT(machine.run_to(1h),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.5678 v1.* ttl 3",
                          "40ms -> 224.244.224.245:30490 s2 reboot: find 1234.5678 v1.* ttl 3",
                          "100ms -> 224.244.224.245:30490 s3 reboot: find 1234.5678 v1.* ttl 3"));
}

TEST_F(Client, WritesItsFindByteForByte) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_239", "feat_req_someipcompat_802",
          "feat_req_someipsd_946"});
  require(any_required);
  machine.now += 10ms;
  machine.discovery.on_time(machine.now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 00000024 00000001 01010200 e0000000 00000010"
                                                "00000000 1234ffff ff000003 ffffffff 00000000")));
}

TEST_F(Client, StopsLookingWhenTheServiceIsOffered) {
  covers({"feat_req_someipsd_14", "feat_req_someipsd_238", "feat_req_someipsd_867", "feat_req_someipsd_779",
          "feat_req_someipsd_630"});
  require(required);
  EXPECT_THAT(machine.run_to(30ms), SizeIs(1));
  machine.multicast(server, {offer({udp(server_udp), tcp(server_tcp)})});
  EXPECT_THAT(machine.events(), ElementsAre("available 1234.5678 v1.0 udp 10.0.0.2:30509 tcp 10.0.0.2:30510 "
                                            "at 10.0.0.2:30490"));
  EXPECT_THAT(machine.run_to(3s), IsEmpty());
  machine.multicast(server, {offer({udp(server_udp), tcp(server_tcp)})});
  EXPECT_THAT(machine.events(), IsEmpty());  // nothing new
}

TEST_F(Client, SendsOneFindThoughAnInstanceIsKnown) {
  covers({"feat_req_someipsd_239", "feat_req_someip_636", "feat_req_someip_1079"});
  require(any_required);
  // Another ECU has the second instance, and the third one at a port of its own.
  FakePeer other{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.multicast(other, {offer({udp({IpAddress::v4(10, 0, 0, 3), 30509})}, 3, 0x1234, 0x5679),
                            offer({udp({IpAddress::v4(10, 0, 0, 3), 30510})}, 3, 0x1234, 0x567a)});
  EXPECT_THAT(machine.run_to(1s),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.ffff v*.* ttl 3"));
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678 v1.0 udp 10.0.0.2:30509"),
                                            HasSubstr("available 1234.5679 v1.0 udp 10.0.0.3:30509"),
                                            HasSubstr("available 1234.567a v1.0 udp 10.0.0.3:30510")));
}

TEST_F(Client, KnowsWhatWasOfferedBeforeItAsks) {
  covers({"feat_req_someipsd_17", "feat_req_someipsd_238"});
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  require(required);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678")));
  EXPECT_THAT(machine.run_to(2s), IsEmpty());
}

// Up or down, required or released: whatever the one is, the other may be either.
TEST_F(Client, TellsOfServicesThatAreRequiredAndUp) {
  covers({"feat_req_someipsd_17"});
  const auto go_up = [&] { machine.multicast(server, {offer({udp(server_udp)})}); };
  const auto go_down = [&] { machine.multicast(server, {offer({udp(server_udp)}, 0)}); };
  const auto release = [&] { machine.discovery.release(requirement, machine.now); };
  const auto available = HasSubstr("available 1234.5678");
  const auto lost = HasSubstr("lost 1234.5678");
  go_up();  // released and up
  EXPECT_THAT(machine.events(), IsEmpty());
  require(required);  // required and up
  EXPECT_THAT(machine.events(), ElementsAre(available));
  go_down();  // required and down
  EXPECT_THAT(machine.events(), ElementsAre(lost));
  go_up();
  EXPECT_THAT(machine.events(), ElementsAre(available));
  release();  // released and up
  go_down();  // released and down
  EXPECT_THAT(machine.events(), IsEmpty());
  require(required);  // required and down
  EXPECT_THAT(machine.events(), IsEmpty());
  release();
  go_up();
  EXPECT_THAT(machine.events(), IsEmpty());
  require(required);
  EXPECT_THAT(machine.events(), ElementsAre(available));
}

TEST_F(Client, MatchesVersions) {
  covers({"feat_req_someipcompat_804"});
  require({.service = ServiceId{0x1234}, .major = 2});
  require({.service = ServiceId{0x1234}, .minor = 1});
  require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  machine.multicast(server, {offer({udp(server_udp)})});  // 1234.5678 version 1.0
  EXPECT_THAT(machine.events(), IsEmpty());
  require({.service = ServiceId{0x1234}, .minor = 0});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST_F(Client, AsksForEveryMinorVersionAndComparesItself) {
  covers({"feat_req_someipcompat_1197"});
  require({.service = ServiceId{0x1234}, .major = 1, .minor = 3});
  EXPECT_THAT(machine.run_to(10ms),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.ffff v1.* ttl 3"));
}

struct BadOffer {
  const char* why;
  FakePeer::Said said;
};

TEST_F(Client, IgnoresOffersThatCannotBe) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_681", "feat_req_someipsd_1135",
          "feat_req_someipsd_1145", "feat_req_someipsd_1164", "feat_req_someipsd_1233"});
  require(any_required);
  for (const auto& [why, said] : {
           BadOffer{"no endpoint", offer({})},
           BadOffer{"two UDP ports", offer({udp(server_udp), udp({server_udp.address, 1})})},
           BadOffer{"port 0", offer({udp({server_udp.address, 0})})},
           BadOffer{"our own address", offer({udp(own_udp)})},
           BadOffer{"loopback", offer({udp({IpAddress::v4(127, 0, 0, 1), 30509})})},
           BadOffer{"multicast address", offer({udp({group.address, 30509})})},
           BadOffer{"every instance", offer({udp(server_udp)}, 3, 0x1234, 0xffff)},
       }) {
    machine.multicast(server, {said});
    EXPECT_THAT(machine.events(), IsEmpty()) << why;
  }
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 7U);
}

TEST(ClientOverIpv6, IgnoresOffersOfLoopbackAddresses) {
  covers({"feat_req_someipsd_1135"});
  const auto address = [](std::uint8_t last, std::uint8_t first) {
    IpAddress made{{}, true};
    made.bytes[0] = first;
    made.bytes[15] = last;
    return made;
  };
  Settings settings = fixed_settings();
  settings.unicast = {address(1, 0xfd), 30490};
  settings.multicast = {address(1, 0xff), 30490};
  Machine<> machine{settings};
  ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
  FakePeer server{{address(2, 0xfd), 30490}};
  machine.multicast(server, {offer({udp({address(1, 0), 30509})})});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.multicast(server, {offer({udp({address(2, 0xfd), 30509})})});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST(ClientInASubnet, ChecksItOnlyWhenTold) {
  covers({"feat_req_someipsd_1135", "feat_req_someipsd_1149"});
  for (const bool check : {false, true}) {
    Settings settings = fixed_settings();
    settings.own_endpoints_only = false;
    if (check) {
      settings.subnet_prefix_bits = 24;
    }
    Machine<> machine{settings};
    FakePeer server{server_sd};
    ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
    machine.multicast(server, {offer({udp({IpAddress::v4(10, 0, 1, 2), 30509})})});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    machine.multicast(server, {offer({udp({IpAddress::v4(10, 0, 0, 255), 30509})}, 3, 0x1234, 1)});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    machine.multicast(server, {offer({udp(server_udp)}, 3, 0x1234, 2)});
    EXPECT_THAT(machine.events(), SizeIs(1));
    FakePeer far{{IpAddress::v4(10, 0, 1, 2), 30490}};
    machine.multicast(far, {offer({udp(server_udp)}, 3, 0x1234, 3)});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    EXPECT_EQ(machine.discovery.counters().dropped_source, check ? 1U : 0U);
  }
}

TEST(ClientInASubnet, KnowsPrefixesOfAnyLength) {
  covers({"feat_req_someipsd_1135", "feat_req_someipsd_1149"});
  const auto hears = [](std::uint8_t prefix_bits, const IpAddress& from) {
    Settings settings = fixed_settings();  // of 10.0.0.1
    settings.subnet_prefix_bits = prefix_bits;
    Machine<> machine{settings};
    EXPECT_TRUE(machine.discovery.require(any_required, machine.now));
    FakePeer server{{from, 30490}};
    machine.multicast(server, {offer({udp({from, 30509})})});
    return machine.events().size() == 1;
  };
  EXPECT_TRUE(hears(25, IpAddress::v4(10, 0, 0, 126)));
  EXPECT_FALSE(hears(25, IpAddress::v4(10, 0, 0, 127)));  // broadcast
  EXPECT_FALSE(hears(25, IpAddress::v4(10, 0, 0, 130)));
  EXPECT_TRUE(hears(9, IpAddress::v4(10, 126, 255, 255)));
  EXPECT_FALSE(hears(9, IpAddress::v4(10, 127, 255, 255)));  // broadcast
  EXPECT_FALSE(hears(9, IpAddress::v4(10, 130, 0, 2)));
  EXPECT_TRUE(hears(31, IpAddress::v4(10, 0, 0, 0)));  // has no broadcast address
  EXPECT_FALSE(hears(31, IpAddress::v4(10, 0, 0, 2)));
}

TEST(ClientOnLoopback, HearsOtherLoopbackAddresses) {
  Settings settings = fixed_settings();
  settings.unicast = {IpAddress::v4(127, 0, 0, 1), 30490};
  Machine<> machine{settings};
  FakePeer server{{IpAddress::v4(127, 0, 0, 2), 30490}};
  ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
  machine.multicast(server, {offer({udp({IpAddress::v4(127, 0, 0, 2), 30509})})});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST(ClientBesideLoopback, HearsItsAddressesWhereThatIsNotChecked) {
  covers({"feat_req_someipsd_1149", "feat_req_someipsd_1233"});
  for (const bool check : {true, false}) {
    Settings settings = fixed_settings();  // of 10.0.0.1
    settings.refuse_loopback = check;
    Machine<> machine{settings};
    FakePeer server{{IpAddress::v4(127, 0, 0, 2), 30490}};
    ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
    machine.multicast(server, {offer({udp({IpAddress::v4(127, 0, 0, 2), 30509})})});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    EXPECT_EQ(machine.discovery.counters().dropped_source, check ? 1U : 0U);
  }
}

TEST_F(Client, IgnoresWhatItSentItself) {
  require(any_required);
  FakePeer self{own};
  machine.multicast(self, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().dropped_own, 1U);
}

TEST_F(Client, LosesAServiceWithItsTtlAndLooksAgain) {
  covers({"feat_req_someipsd_253", "feat_req_someipsd_630", "feat_req_someipsd_14"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.run_to(2999ms);
  EXPECT_THAT(machine.events(), SizeIs(1));
  EXPECT_THAT(machine.run_to(3010ms),
              ElementsAre(HasSubstr("3010ms -> 224.244.224.245:30490 s1 reboot: find")));
  EXPECT_THAT(machine.events(), ElementsAre("lost 1234.5678 v1 expired"));
}

TEST_F(Client, DoesNotLookAgainWhileAnotherInstanceIsThere) {
  require(any_required);
  machine.multicast(server, {offer({udp(server_udp)}, 1, 0x1234, 1), offer({udp(server_udp)}, 9, 0x1234, 2)});
  EXPECT_THAT(machine.run_to(500ms), SizeIs(1));
  EXPECT_THAT(machine.run_to(8s), IsEmpty());
  EXPECT_THAT(machine.events(),
              ElementsAre(HasSubstr("1234.0001"), HasSubstr("1234.0002"), "lost 1234.0001 v1 expired"));
  EXPECT_THAT(machine.run_to(9100ms),
              ElementsAre(HasSubstr("9010ms"), HasSubstr("9040ms"), HasSubstr("9100ms")));
}

TEST_F(Client, KeepsAnEndlessOffer) {
  covers({"feat_req_someipsd_253"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.events();
  machine.run_to(1000h);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, WaitsInSilenceAfterAStopOffer) {
  covers({"feat_req_someipsd_261", "feat_req_someipsd_831", "feat_req_someipsd_834", "feat_req_someipsd_14",
          "feat_req_someipsd_630"});
  subscribed();
  machine.multicast(server, {offer({udp(server_udp)}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost stopped", "lost 1234.5678 v1 stopped"));
  EXPECT_THAT(machine.run_to(1h), IsEmpty());
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), SizeIs(1));
  EXPECT_THAT(machine.run_to(1h + 5ms),
              ElementsAre(HasSubstr("subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 initial")));
}

TEST_F(Client, BelievesAStopOfferOnlyOfTheServerItself) {
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.events();
  FakePeer liar{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.multicast(liar, {offer({udp(server_udp)}, 0)});
  machine.multicast(liar, {offer({udp({IpAddress::v4(10, 0, 0, 3), 30509})})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_conflicting_offer, 1U);
}

TEST_F(Client, TakesChangedEndpointsForANewService) {
  covers({"feat_req_someipsd_778"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.events();
  machine.multicast(server, {offer({udp({server_udp.address, 30600})})});
  EXPECT_THAT(machine.events(), ElementsAre("lost 1234.5678 v1 replaced", HasSubstr("udp 10.0.0.2:30600")));
  EXPECT_THAT(machine.run_to(1s), IsEmpty());  // no Find for it
}

TEST_F(Client, LooksAgainForWhatARebootedServerNoLongerOffers) {
  covers({"feat_req_someipsd_871"});
  subscribed();
  server.reboot();
  machine.multicast(server, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", "lost 1234.5678 v1 rebooted"));
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(HasSubstr("210ms -> 224.244.224.245:30490 s4 reboot: find"),
                                                 HasSubstr("240ms"), HasSubstr("300ms")));
}

TEST_F(Client, StartsAnewWhenTheLinkComesBack) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_440", "feat_req_someipsd_14", "feat_req_someipsd_442",
          "feat_req_someipsd_630"});
  subscribed();
  machine.discovery.link_down();
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost link down", "lost 1234.5678 v1 link down"));
  EXPECT_THAT(machine.run_to(1s), IsEmpty());
  machine.discovery.link_up(machine.now);
  EXPECT_THAT(machine.run_to(1010ms),
              ElementsAre(HasSubstr("1010ms -> 224.244.224.245:30490 s4 reboot: find")));
}

TEST_F(Client, ShutsDownBothSides) {
  covers({"feat_req_someipsd_821"});
  subscribed();
  ASSERT_TRUE(machine.discovery.offer(
      {.service = ServiceId{0x4711}, .instance = InstanceId{1}, .udp = own_udp}, machine.now));
  machine.run_to(250ms);
  machine.discovery.shutdown(machine.now);
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("250ms -> 10.0.0.2:30490 s2 reboot: stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 "
                  "udp 10.0.0.1:40000",
                  "250ms -> 224.244.224.245:30490 s6 reboot: stop_offer 4711.0001 v1.0 ttl 0 "
                  "udp 10.0.0.1:40000"));
  EXPECT_FALSE(machine.discovery.deadline());
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST(ClientOfManyAnswers, WrapsItsSessionAndThenClearsTheRebootFlag) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_41", "feat_req_someipsd_765"});
  Settings settings = fixed_settings();
  settings.max_entries_at_once = 0x100000;  // it asks more often at once than a peer usually may
  Machine<> machine{settings};
  FakePeer server{server_sd};
  ASSERT_TRUE(machine.discovery.require(required, machine.now));
  for (unsigned i = 0; i < 0xffff; ++i) {
    // Nothing we have: a Nack each time, by unicast.
    machine.unicast(server, {subscribe(1, {udp(server_udp)})});
    const auto sent = machine.sent();
    ASSERT_THAT(sent, SizeIs(1));
    if (i == 0 || i == 0xfffe) {
      EXPECT_THAT(sent.front(), HasSubstr(i == 0 ? " s1 reboot: " : " s65535 reboot: "));
    }
  }
  machine.unicast(server, {subscribe(1, {udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(" s1: nack")));
  // Multicast counts for itself.
  EXPECT_THAT(machine.run_to(10ms), ElementsAre(HasSubstr(" s1 reboot: find")));
}

}  // namespace
}  // namespace trestle::sd::client_test
