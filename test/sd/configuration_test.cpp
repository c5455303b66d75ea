// Configuration options, and the load-balancing options beside them.
#include <gmock/gmock.h>

#include "test/covers.hpp"
#include "test/sd/configured_fixture.hpp"

namespace trestle::sd::configuration_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST_F(Configured, OffersItsConfigurationAndRankByteForByte) {
  covers({"feat_req_someipsd_857", "feat_req_someipsd_684", "feat_req_someipsd_159", "feat_req_someipsd_160",
          "feat_req_someipsd_217", "feat_req_someipsd_253", "feat_req_someipsd_262", "feat_req_someipsd_946",
          "feat_req_someipsd_809"});
  const std::array<ConfigurationItem, 4> said{{{"b", "2"}, {"a", "1"}, {"flag", std::nullopt}, {"b", ""}}};
  const auto offered = machine.discovery.offer(
      {.service = ServiceId{0x1234},
       .instance = InstanceId{0x5678},
       .udp = own_udp,
       .configuration = said,
       .options = {.load_balancing = LoadBalancingOption{.priority = 1, .weight = 0x200}}},
      machine.now);
  ASSERT_TRUE(offered);
  EXPECT_EQ(next_bytes(machine, start + 10ms),
            to_hex(hex("ffff8100 0000004d 00000001 01010200 e0000000 00000010"
                       "01000030 12345678 01000003 00000000 00000029"
                       "000904 00 0a000001 00 11 9c40"
                       "000502 00 0001 0200"
                       // b=2, a=1, flag, b=
                       "001201 00 03 623d32 03 613d31 04 666c6167 02 623d 00")));
  // What stops it references the same.
  machine.discovery.stop_offer(*offered, machine.now);
  EXPECT_EQ(next_bytes(machine, start + 10ms),
            to_hex(hex("ffff8100 0000004d 00000002 01010200 e0000000 00000010"
                       "01000030 12345678 01000000 00000000 00000029"
                       "000904 00 0a000001 00 11 9c40"
                       "000502 00 0001 0200"
                       "001201 00 03 623d32 03 613d31 04 666c6167 02 623d 00")));
}

TEST_F(Configured, SharesOneOptionAmongOffersThatSayTheSame) {
  covers({"feat_req_someipsd_900"});
  const std::array<ConfigurationItem, 1> said{{{"a", "1"}}};
  for (std::uint16_t id = 1; id <= 2; ++id) {
    ASSERT_TRUE(machine.discovery.offer(
        {.service = ServiceId{id}, .instance = InstanceId{1}, .udp = own_udp, .configuration = said},
        machine.now));
  }
  EXPECT_EQ(next_bytes(machine, start + 10ms),
            to_hex(hex("ffff8100 00000049 00000001 01010200 e0000000 00000020"
                       "01000020 00010001 01000003 00000000"
                       "01000020 00020001 01000003 00000000 00000015"
                       "000904 00 0a000001 00 11 9c40 000601 00 03 613d31 00")));
}

TEST_F(Configured, TakesNoConfigurationThatCannotBe) {
  covers({"feat_req_someipsd_502", "feat_req_someipsd_500", "feat_req_someipsd_1250",
          "feat_req_someipsd_1228", "feat_req_someip_624"});
  const auto error_of = [&](std::uint16_t service, std::vector<ConfigurationItem> said, bool mac = false) {
    OfferedService offered{
        .service = ServiceId{service}, .instance = InstanceId{1}, .udp = own_udp, .configuration = said};
    if (mac) {
      offered.options.mac_groupcast = MacGroupcastOption{.protocol = 0x22f0};
    }
    const auto result = machine.discovery.offer(offered, machine.now);
    return std::string{result ? "taken" : to_string(result.error())};
  };
  const std::string long_value(255, 'x');
  EXPECT_EQ(error_of(1, {{"", "x"}}), "bad argument");
  EXPECT_EQ(error_of(1, {{"a=", "x"}}), "bad argument");
  EXPECT_EQ(error_of(1, {{"a", long_value}}), "bad argument");
  // The room holds 256 bytes: the reserved one, the item with its length, and the end mark.
  EXPECT_EQ(error_of(1, {{"a", std::string_view{long_value}.substr(0, 252)}}), "bad argument");
  EXPECT_EQ(error_of(1, {{"a", std::string_view{long_value}.substr(0, 251)}}), "taken");
  EXPECT_EQ(error_of(2, {{"otherserv", "x"}}), "bad argument");  // a SOME/IP service
  EXPECT_EQ(error_of(2, {{"otherserv", std::nullopt}}), "bad argument");
  EXPECT_EQ(error_of(2, {{"a", "x"}}, true), "bad argument");
  EXPECT_EQ(error_of(2, {{"Otherserv", "x"}}), "taken");
  // What is not SOME/IP has one name, and not an empty one.
  EXPECT_EQ(error_of(0xfffe, {}), "bad argument");
  EXPECT_EQ(error_of(0xfffe, {{"a", "x"}}), "bad argument");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", std::nullopt}}), "bad argument");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", ""}}), "bad argument");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", "x"}, {"otherserv", "y"}}), "bad argument");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", "x"}, {"a", "b"}}), "taken");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", "x"}}), "duplicate");
  EXPECT_EQ(error_of(0xfffe, {{"otherserv", "y"}}, true), "taken");
}

TEST_F(Configured, ReadsAllItemsOfAllConfigurationOptions) {
  covers({"feat_req_someipsd_1146", "feat_req_someipsd_1147", "feat_req_someipsd_684",
          "feat_req_someipsd_857", "feat_req_someipsd_150"});
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  // abc=x, def=1 and abc=y, flag, def=1: two options, with the same keys and even the same item.
  machine.multicast(peer, {with(offer({udp(peer_udp)}),
                                {configuration("00 05 6162633d78 05 6465663d31 00"), rank("00 0007 0064"),
                                 configuration("00 05 6162633d79 04 666c6167 05 6465663d31 00")})});
  auto event = machine.discovery.poll_event();
  ASSERT_TRUE(event);
  EXPECT_EQ(describe(*event),
            "available 1234.5678 v1.0 udp 10.0.0.2:30509 at 10.0.0.2:30490 "
            "priority 7 weight 100");
  const RemoteHandle handle = std::get<ServiceAvailable>(*event).service.handle;
  EXPECT_THAT(items(machine, handle), ElementsAre("abc=x", "def=1", "abc=y", "flag", "def=1"));
  // The same again tells nothing new.
  machine.multicast(peer, {with(offer({udp(peer_udp)}),
                                {configuration("00 05 6162633d78 05 6465663d31 00"), rank("00 0007 0064"),
                                 configuration("00 05 6162633d79 04 666c6167 05 6465663d31 00")})});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.multicast(peer, {offer({udp(peer_udp)}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost")));
  EXPECT_THAT(items(machine, handle), IsEmpty());
  EXPECT_THAT(items(machine, {}), IsEmpty());
}

TEST_F(Configured, TellsOfAChangeWithoutALoss) {
  const auto requirement =
      machine.discovery.require({.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}}, machine.now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(machine.discovery.subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp},
                                          machine.now));
  machine.unicast(peer, {with(offer({udp(peer_udp)}), {configuration("00 03 613d31 00")})});
  const RemoteHandle handle = available(machine);
  EXPECT_THAT(items(machine, handle), ElementsAre("a=1"));
  machine.sent();
  machine.unicast(peer, {ack(1)});
  machine.events();
  machine.unicast(peer, {with(offer({udp(peer_udp)}), {configuration("00 03 613d32 00")})});
  EXPECT_EQ(available(machine), handle);
  EXPECT_THAT(items(machine, handle), ElementsAre("a=2"));
  machine.unicast(peer, {with(offer({udp(peer_udp)}), {rank("00 0001 0002")})});
  EXPECT_THAT(machine.events(), ElementsAre("available 1234.5678 v1.0 udp 10.0.0.2:30509 at 10.0.0.2:30490 "
                                            "priority 1 weight 2"));
  EXPECT_THAT(items(machine, handle), IsEmpty());
  EXPECT_THAT(machine.sent(), ElementsAre(Not(HasSubstr("initial"))));  // one renewal: it goes on
}

TEST_F(Configured, IgnoresOffersWhoseOptionsAreBrokenOrInConflict) {
  covers({"feat_req_someipsd_1144", "feat_req_someipsd_102"});
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  for (const std::vector<FakePeer::Raw>& bad : {
           std::vector{configuration("00 05 6162633d 00")},          // an item beyond the option
           std::vector{configuration("00 03 613d31")},               // no end mark
           std::vector{configuration("00 03 3d6161 00")},            // no key
           std::vector{rank("00 0001 00")},                          // too short
           std::vector{rank("00 0001 0002"), rank("00 0001 0003")},  // two weights
       }) {
    machine.multicast(peer, {with(offer({udp(peer_udp)}), bad)});
    EXPECT_THAT(machine.events(), IsEmpty());
  }
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 5U);
  machine.multicast(peer, {with(offer({udp(peer_udp)}), {rank("00 0001 0002"), rank("00 0001 0002")})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("priority 1 weight 2")));
}

// --- Limits -----------------------------------------------------------------------------------------------

constexpr Limits small{.max_configurations = 2, .max_configuration_bytes = 16};

class LittleRoom : public testing::Test {
 protected:
  // An offer of an instance with the item "i=c".
  static FakePeer::Said offer_of(std::uint16_t instance, char c, std::uint16_t service = 0x1234) {
    FakePeer::Said said = offer({udp(peer_udp)}, 3, service, instance);
    said.more.push_back({OptionType::configuration, hex("00 03 693d00 00")});
    said.more.back().body[4] = static_cast<std::byte>(c);
    return said;
  }
  Machine<small> machine;
  FakePeer peer{peer_sd};
};

TEST_F(LittleRoom, KeepsTheItemsThatFit) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  // 1 + 6 + 9 would leave no place for the end mark; the last fits.
  machine.unicast(peer, {with(offer({udp(peer_udp)}),
                              {configuration("00 05 6162633d31 08 6465663d67686969 04 613d6262 00")})});
  EXPECT_THAT(items(machine, available(machine)), ElementsAre("abc=1", "a=bb"));
  EXPECT_EQ(machine.discovery.counters().configurations_cut, 1U);
  // Just as much as there is room for.
  machine.unicast(peer,
                  {with(offer({udp(peer_udp)}), {configuration("00 05 6162633d31 07 6465663d676869 00")})});
  EXPECT_THAT(items(machine, available(machine)), ElementsAre("abc=1", "def=ghi"));
  EXPECT_EQ(machine.discovery.counters().configurations_cut, 1U);
}

TEST_F(LittleRoom, KnowsAServiceThoughItsConfigurationFindsNoPlace) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  machine.unicast(peer, {offer_of(1, 'a'), offer_of(2, 'b'), offer_of(3, 'b'), offer_of(4, 'c')});
  const std::array handles{available(machine), available(machine), available(machine), available(machine)};
  EXPECT_THAT(items(machine, handles[0]), ElementsAre("i=a"));
  EXPECT_THAT(items(machine, handles[1]), ElementsAre("i=b"));
  EXPECT_THAT(items(machine, handles[2]), ElementsAre("i=b"));  // shared
  EXPECT_THAT(items(machine, handles[3]), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().configurations_cut, 1U);
  // When one is gone, there is a place, and what comes with the next offer is new.
  FakePeer::Said stop = offer_of(1, 'a');
  stop.entry.ttl_s = 0;
  machine.unicast(peer, {stop, offer_of(4, 'c')});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("lost 1234.0001"), HasSubstr("available 1234.0004")));
  EXPECT_THAT(items(machine, handles[3]), ElementsAre("i=c"));
  EXPECT_THAT(items(machine, handles[1]), ElementsAre("i=b"));
}

TEST_F(LittleRoom, PrefersWhatIsNeeded) {
  machine.unicast(peer, {offer_of(1, 'a', 0x1111), offer_of(1, 'b', 0x2222), offer_of(1, 'c', 0x3333)});
  EXPECT_EQ(machine.discovery.counters().configurations_cut, 1U);  // nobody requires the third
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  machine.unicast(peer, {offer_of(1, 'd')});
  EXPECT_THAT(items(machine, available(machine)), ElementsAre("i=d"));
  // An offer of our own takes the next place, one more finds none.
  const std::array<ConfigurationItem, 1> e{{{"i", "e"}}};
  const std::array<ConfigurationItem, 1> f{{{"i", "f"}}};
  const auto offer_with = [&](std::span<const ConfigurationItem> said, std::uint16_t instance) {
    return machine.discovery.offer({.service = ServiceId{0x4444},
                                    .instance = InstanceId{instance},
                                    .udp = own_udp,
                                    .configuration = said},
                                   machine.now);
  };
  const auto first = offer_with(e, 1);
  ASSERT_TRUE(first);
  const auto second = offer_with(f, 2);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error(), SdError::table_full);
  ASSERT_TRUE(offer_with(e, 2));
  // A place is free once its StopOffer has left.
  machine.discovery.stop_offer(*first, machine.now);
  EXPECT_FALSE(offer_with(f, 3));
  const auto error_of = [&](std::string_view name) {
    const auto result =
        machine.discovery.require({.service = other_protocols, .otherserv = name}, machine.now);
    return std::string{result ? "none" : to_string(result.error())};
  };
  EXPECT_EQ(error_of("xyz"), "table full");     // 00 0d "otherserv=xyz" 00 are 16 bytes
  EXPECT_EQ(error_of("wxyz"), "bad argument");  // one more
}

TEST_F(LittleRoom, FreesThePlaceOfAStoppedOfferWhenItsStopHasLeft) {
  const std::array<ConfigurationItem, 1> a{{{"i", "a"}}};
  const std::array<ConfigurationItem, 1> b{{{"i", "b"}}};
  const std::array<ConfigurationItem, 1> c{{{"i", "c"}}};
  const auto offer_with = [&](std::span<const ConfigurationItem> said, std::uint16_t instance) {
    return machine.discovery.offer({.service = ServiceId{0x4444},
                                    .instance = InstanceId{instance},
                                    .udp = own_udp,
                                    .configuration = said},
                                   machine.now);
  };
  const auto first = offer_with(a, 1);
  ASSERT_TRUE(first && offer_with(b, 2));
  machine.discovery.stop_offer(*first, machine.now);
  EXPECT_FALSE(offer_with(c, 3));
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("option 01:0003693d6100")));
  EXPECT_TRUE(offer_with(c, 3));
}

TEST(NoRoomForConfigurations, KnowsServicesWithoutThem) {
  Machine<Limits{.max_configurations = 0, .max_configuration_bytes = 1}> machine;
  FakePeer peer{peer_sd};
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  machine.unicast(peer, {with(offer({udp(peer_udp)}), {configuration("00 03 613d31 00")})});
  EXPECT_THAT(items(machine, available(machine)), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().configurations_cut, 1U);
  const std::array<ConfigurationItem, 1> said{{{"a", "1"}}};
  EXPECT_FALSE(machine.discovery.offer(
      {.service = ServiceId{1}, .instance = InstanceId{1}, .udp = own_udp, .configuration = said},
      machine.now));
}

}  // namespace
}  // namespace trestle::sd::configuration_test
