// Services that are not SOME/IP, which service discovery tells apart by their names.
#include <gmock/gmock.h>

#include "test/covers.hpp"
#include "test/sd/configured_fixture.hpp"

namespace trestle::sd::other_protocol_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}};

class OtherProtocol : public Configured {
 protected:
  Result<OfferHandle, SdError> offer_named(std::string_view name, std::uint16_t instance = 1) {
    const std::array<ConfigurationItem, 1> said{{{"otherserv", name}}};
    return machine.discovery.offer({.service = other_protocols,
                                    .instance = InstanceId{instance},
                                    .udp = own_udp,
                                    .eventgroups = groups,
                                    .configuration = said},
                                   machine.now);
  }
  Result<RequirementHandle, SdError> require_named(std::string_view name) {
    return machine.discovery.require(
        {.service = other_protocols, .instance = InstanceId{1}, .otherserv = name}, machine.now);
  }
};

// otherserv=a and otherserv=b
constexpr std::string_view named_a = "00 0b 6f74686572736572763d61 00";
constexpr std::string_view named_b = "00 0b 6f74686572736572763d62 00";

FakePeer::Said about_other(FakePeer::Said said, std::vector<FakePeer::Raw> more) {
  said.entry.service = other_protocols;
  said.entry.instance = InstanceId{1};
  said.more = std::move(more);
  return said;
}

TEST_F(OtherProtocol, IsOfferedWithItsName) {
  covers({"feat_req_someip_624", "feat_req_someipsd_500", "feat_req_someipsd_503", "feat_req_someipsd_1227",
          "feat_req_someipsd_1228"});
  Settings settings = fixed_settings();
  settings.unicast.address = IpAddress::v4(192, 168, 0, 1);
  Machine<> other{settings};
  const std::array<ConfigurationItem, 1> said{{{"otherserv", "internaldiag"}}};
  ASSERT_TRUE(other.discovery.offer({.service = other_protocols,
                                     .instance = InstanceId{1},
                                     .major = 1,
                                     .minor = 0x32,
                                     .tcp = Endpoint{settings.unicast.address, 6801},
                                     .configuration = said},
                                    other.now));
  // The offer of the specification's example; its figure writes the last option's length 25 as 0x0025.
  EXPECT_EQ(next_bytes(other, start + 10ms),
            to_hex(hex("ffff8100 0000004c 00000001 01010200 e0000000 00000010"
                       "01000020 fffe0001 01000003 00000032 00000028"
                       "000904 00 c0a80001 00 06 1a91"
                       "001901 00 16 6f74686572736572763d696e7465726e616c64696167 00")));
}

TEST_F(OtherProtocol, IsReadFromTheExampleOfTheSpecification) {
  covers({"feat_req_someip_624", "feat_req_someipsd_500"});
  const auto named = [&](std::string_view name) {
    return machine.discovery.require(
        {.service = other_protocols, .instance = InstanceId{1}, .otherserv = name}, machine.now);
  };
  ASSERT_TRUE(named("internaldiag"));
  ASSERT_TRUE(named("otherdiag"));
  const auto example =
      hex("ffff8100 0000005c 00000001 01010200 80000000 00000020"
          "00000000 1001ffff ff000e10 ffffffff 01000020 fffe0001 01000003 00000032 00000028"
          "000904 00 0a000002 00 06 1a91 001901 00 16 6f74686572736572763d696e7465726e616c64696167 00");
  machine.receive(example, peer_sd, true);
  EXPECT_THAT(machine.events(), ElementsAre("available fffe.0001 v1.50 tcp 10.0.0.2:6801 at 10.0.0.2:30490"));
}

TEST_F(OtherProtocol, HasAnOfferForEachName) {
  covers({"feat_req_someipsd_1227"});
  const auto a = offer_named("a");
  ASSERT_TRUE(a);
  ASSERT_TRUE(offer_named("b"));
  const auto again = offer_named("b");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error(), SdError::duplicate);
  EXPECT_THAT(machine.run_to(10ms), ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: "
                                                "offer fffe.0001 v1.0 ttl 3 udp 10.0.0.1:40000 "
                                                "option 01:000b6f74686572736572763d6100; "
                                                "offer fffe.0001 v1.0 ttl 3 udp 10.0.0.1:40000 "
                                                "option 01:000b6f74686572736572763d6200"));
  // One is stopped while answers for both wait: the other's stays.
  machine.run_to(200ms);
  machine.multicast(
      peer, {about_other(find(0), {configuration(named_a)}), about_other(find(0), {configuration(named_b)})});
  machine.discovery.stop_offer(*a, machine.now);
  EXPECT_THAT(machine.run_to(210ms), ElementsAre(testing::ContainsRegex("stop_offer fffe.* option .*3d6100$"),
                                                 testing::ContainsRegex(": offer fffe.* option .*3d6200$")));
}

TEST_F(OtherProtocol, AnswersFindsOfItsNameAlone) {
  covers({"feat_req_someipsd_503", "feat_req_someipsd_879"});
  ASSERT_TRUE(offer_named("a"));
  machine.run_to(200ms);
  machine.unicast(peer, {about_other(find(0), {}), about_other(find(0), {configuration(named_b)}),
                         about_other(find(0), {configuration("00 09 6f7468657273657276 00")}),
                         about_other(find(0), {configuration(named_a), configuration(named_a)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  machine.unicast(peer, {about_other(find(0), {configuration(named_a)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": offer fffe.0001")));
}

TEST_F(OtherProtocol, IsLookedForByItsName) {
  covers({"feat_req_someipsd_503", "feat_req_someipsd_879"});
  ASSERT_TRUE(require_named("a"));
  EXPECT_EQ(next_bytes(machine, start + 10ms),
            to_hex(hex("ffff8100 00000035 00000001 01010200 e0000000 00000010"
                       "00000010 fffe0001 ff000003 ffffffff 00000011"
                       "000e01 00 0b 6f74686572736572763d61 00")));
  for (const auto& [service, name] : {std::pair<std::uint16_t, std::string_view>{0xfffe, ""},
                                      {0x1234, "a"},
                                      {0xfffe, std::string(300, 'x')}}) {
    const auto result =
        machine.discovery.require({.service = ServiceId{service}, .otherserv = name}, machine.now);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error(), SdError::bad_argument);
  }
}

TEST_F(OtherProtocol, IsToldApartByItsName) {
  covers({"feat_req_someipsd_500", "feat_req_someipsd_1228"});
  const auto a = require_named("a");
  const auto b = require_named("b");
  ASSERT_TRUE(a && b);
  const auto offers = [&](std::vector<FakePeer::Raw> more, std::uint32_t ttl_s = 3) {
    machine.unicast(peer, {about_other(offer({udp(peer_udp)}, ttl_s), std::move(more))});
    return machine.events();
  };
  // Without a name, with an empty one, or with two it names nothing.
  EXPECT_THAT(offers({}), IsEmpty());
  EXPECT_THAT(offers({configuration("00 0a 6f74686572736572763d 00")}), IsEmpty());
  EXPECT_THAT(offers({configuration(named_a), configuration(named_b)}), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 3U);
  EXPECT_THAT(offers({configuration(named_a)}), ElementsAre(HasSubstr("available fffe.0001")));
  EXPECT_TRUE(machine.discovery.choose(*a));
  EXPECT_FALSE(machine.discovery.choose(*b));
  EXPECT_THAT(offers({configuration(named_b)}), ElementsAre(HasSubstr("available fffe.0001")));
  EXPECT_THAT(offers({configuration(named_b)}, 0), ElementsAre(HasSubstr("lost fffe.0001")));
  EXPECT_TRUE(machine.discovery.choose(*a));
  EXPECT_FALSE(machine.discovery.choose(*b));
}

TEST_F(OtherProtocol, HasEventgroupsToo) {
  covers({"feat_req_someipsd_503", "feat_req_someipsd_1177"});
  const auto a = offer_named("a");
  const auto b = offer_named("b");
  ASSERT_TRUE(a && b);
  const auto count = [&](OfferHandle handle) {
    int subscribers = 0;
    machine.discovery.for_each_subscriber(handle, EventgroupId{1}, [&](const Subscriber&) { ++subscribers; });
    return subscribers;
  };
  const auto said = [&](std::vector<FakePeer::Raw> more, std::uint32_t ttl_s = 3) {
    machine.unicast(peer, {about_other(subscribe(1, {udp(peer_udp)}, ttl_s), std::move(more))});
    machine.events();
    const auto sent = machine.sent();
    return sent.empty() ? "" : sent.front();
  };
  EXPECT_THAT(said({configuration(named_b)}), testing::ContainsRegex(": ack fffe.* option .*3d6200$"));
  EXPECT_EQ(count(*a), 0);
  EXPECT_EQ(count(*b), 1);
  EXPECT_THAT(said({configuration("00 0b 6f74686572736572763d63 00")}), HasSubstr(": nack fffe"));
  EXPECT_THAT(said({}), HasSubstr(": ack fffe"));  // the name may be left out: the first of these ids
  EXPECT_EQ(count(*a), 1);
  EXPECT_THAT(said({configuration(named_b)}, 0), IsEmpty());
  EXPECT_EQ(count(*a), 1);
  EXPECT_EQ(count(*b), 0);
}

TEST_F(OtherProtocol, IsSubscribedToByItsName) {
  covers({"feat_req_someipsd_503", "feat_req_someipsd_1177"});
  const auto a = require_named("a");
  const auto b = require_named("b");
  ASSERT_TRUE(a && b);
  const EventgroupRequest request{.eventgroup = EventgroupId{1}, .udp = own_udp};
  const auto to_a = machine.discovery.subscribe(*a, request, machine.now);
  ASSERT_TRUE(to_a);
  ASSERT_TRUE(machine.discovery.subscribe(*b, request, machine.now));
  machine.unicast(peer, {about_other(offer({udp(peer_udp)}), {configuration(named_b)})});
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("0ms -> 10.0.0.2:30490 s1 reboot: subscribe fffe.0001 v1 group 0001 ttl 3 counter 1 "
                  "initial udp 10.0.0.1:40000 option 01:000b6f74686572736572763d6200"));
  machine.unicast(peer, {about_other(offer({udp(peer_udp)}), {configuration(named_a)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("counter 0 initial udp 10.0.0.1:40000 "
                                                    "option 01:000b6f74686572736572763d6100")));
  machine.events();
  // An Ack of another name is none; its name may be left out.
  machine.unicast(peer, {about_other(ack(1), {configuration(named_b)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.unicast(peer, {about_other(ack(1), {configuration(named_a)})});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
  machine.unicast(peer, {about_other(ack(1, {}, 3, 1), {})});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
  machine.discovery.unsubscribe(*to_a, machine.now);
  EXPECT_THAT(machine.sent(),
              ElementsAre(testing::ContainsRegex(": stop_subscribe fffe.* option .*3d6100$")));
}

TEST_F(OtherProtocol, HasAStreamWhoseIdentifierIsAsLongAsCanBe) {
  const std::array<ConfigurationItem, 1> said{{{"otherserv", "a"}}};
  OfferedService stream{.service = other_protocols, .instance = InstanceId{1}, .configuration = said};
  stream.options.mac_groupcast = MacGroupcastOption{.protocol = 0x22f0, .identifier_bytes = 13};
  EXPECT_EQ(machine.discovery.offer(stream, machine.now).error(), SdError::bad_argument);
  stream.options.mac_groupcast->identifier_bytes = 12;
  EXPECT_TRUE(machine.discovery.offer(stream, machine.now));
}

TEST_F(OtherProtocol, AnnouncesLayer2TrafficWithItsName) {
  covers({"feat_req_someipsd_1250", "feat_req_someipsd_1252", "feat_req_someipsd_1262"});
  const std::array<ConfigurationItem, 1> said{{{"otherserv", "a"}}};
  OfferedService stream{.service = other_protocols, .instance = InstanceId{1}, .configuration = said};
  stream.options.mac_groupcast = MacGroupcastOption{.address = {0x91, 0xe0, 0xf0, 0x00, 0x0e, 0xfe},
                                                    .protocol = 0x22f0,
                                                    .identifier = {1, 2, 3, 4, 5, 6, 0, 7},
                                                    .identifier_bytes = 8};
  ASSERT_TRUE(machine.discovery.offer(stream, machine.now));
  const std::string bytes = next_bytes(machine, start + 10ms);
  EXPECT_EQ(bytes, to_hex(hex("ffff8100 00000049 00000001 01010200 e0000000 00000010"
                              "01000020 fffe0001 01000003 00000000 00000025"
                              "001115 00 91e0f0000efe 22f0 0102030405060007"
                              "000e01 00 0b 6f74686572736572763d61 00")));
  // A client sees it, though it names no endpoint.
  Settings settings = fixed_settings();
  settings.unicast = peer_sd;
  Machine<> client{settings};
  ASSERT_TRUE(client.discovery.require({.service = other_protocols, .otherserv = "a"}, client.now));
  client.receive(hex(bytes), own, true);
  const auto event = client.discovery.poll_event();
  ASSERT_TRUE(event);
  const auto* const found = std::get_if<ServiceAvailable>(&*event);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->service.options.mac_groupcast, stream.options.mac_groupcast);
  EXPECT_FALSE(found->service.udp);
  // With another stream it is another service.
  client.receive(hex("ffff8100 00000049 00000002 01010200 e0000000 00000010"
                     "01000020 fffe0001 01000003 00000000 00000025"
                     "001115 00 91e0f0000efe 22f0 0102030405060008"
                     "000e01 00 0b 6f74686572736572763d61 00"),
                 own, true);
  EXPECT_THAT(client.events(), ElementsAre(HasSubstr("replaced"), HasSubstr("available")));
  // Of a SOME/IP service it is no endpoint.
  ASSERT_TRUE(client.discovery.require({.service = ServiceId{0x1234}}, client.now));
  client.receive(hex("ffff8100 00000038 00000003 01010200 e0000000 00000010"
                     "01000010 12340001 01000003 00000000 00000014"
                     "001115 00 91e0f0000efe 22f0 0102030405060008"),
                 own, true);
  EXPECT_THAT(client.events(), IsEmpty());
}

}  // namespace
}  // namespace trestle::sd::other_protocol_test
