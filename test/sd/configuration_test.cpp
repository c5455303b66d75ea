// What offers say beyond their endpoints: configuration, load balancing, and services that are not SOME/IP.
#include <gmock/gmock.h>

#include <map>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr Endpoint peer_sd{IpAddress::v4(10, 0, 0, 2), 30490};
constexpr Endpoint peer_udp{IpAddress::v4(10, 0, 0, 2), 30509};
constexpr Endpoint own_udp{IpAddress::v4(10, 0, 0, 1), 40000};
constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}};

FakePeer::Raw configuration(std::string_view bytes) {
  return {OptionType::configuration, hex(bytes)};
}
FakePeer::Raw rank(std::string_view bytes) {
  return {OptionType::load_balancing, hex(bytes)};
}
FakePeer::Said with(FakePeer::Said said, std::vector<FakePeer::Raw> more) {
  said.more = std::move(more);
  return said;
}

template <typename AnyMachine>
std::vector<std::string> items(const AnyMachine& machine, RemoteHandle handle) {
  std::vector<std::string> found;
  ConfigurationCursor cursor = machine.discovery.configuration(handle);
  while (const auto item = cursor.next()) {
    found.push_back(std::string{item->key} + (item->value ? "=" + std::string{*item->value} : ""));
  }
  EXPECT_FALSE(cursor.error());
  return found;
}

// The handle in the next event, which must be ServiceAvailable.
template <typename AnyMachine>
RemoteHandle available(AnyMachine& machine) {
  const auto event = machine.discovery.poll_event();
  const auto* const service = event ? std::get_if<ServiceAvailable>(&*event) : nullptr;
  EXPECT_NE(service, nullptr);
  return service != nullptr ? service->service.handle : RemoteHandle{};
}

class Configured : public testing::Test {
 protected:
  Machine<> machine;
  FakePeer peer{peer_sd};
};

std::string next_bytes(Machine<>& machine, TimePoint now) {
  machine.now = now;
  machine.discovery.on_time(now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, now);
  return transmit ? to_hex(transmit->bytes) : "";
}

TEST_F(Configured, OffersItsConfigurationAndRankByteForByte) {
  covers({"feat_req_someipsd_857", "feat_req_someipsd_684", "feat_req_someipsd_159", "feat_req_someipsd_160",
          "feat_req_someipsd_217", "feat_req_someipsd_253", "feat_req_someipsd_262", "feat_req_someipsd_946",
          "feat_req_someipsd_809"});
  const std::array<ConfigurationItem, 4> said{{{"b", "2"}, {"a", "1"}, {"flag", std::nullopt}, {"b", ""}}};
  const auto offered =
      machine.discovery.offer({.service = ServiceId{0x1234},
                               .instance = InstanceId{0x5678},
                               .udp = own_udp,
                               .configuration = said,
                               .load_balancing = LoadBalancingOption{.priority = 1, .weight = 0x200}},
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
      offered.mac_groupcast = MacGroupcastOption{.protocol = 0x22f0};
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

// --- Load balancing ---------------------------------------------------------------------------------------

class Balanced : public Configured {
 protected:
  void offers(std::uint16_t instance, std::string_view rank_bytes) {
    FakePeer::Said said = offer({udp(peer_udp)}, 3, 0x1234, instance);
    if (!rank_bytes.empty()) {
      said.more.push_back(rank(rank_bytes));
    }
    machine.unicast(peer, {said});
  }
  // How often each instance is chosen in a thousand draws.
  std::map<unsigned, int> draw(RequirementHandle requirement) {
    std::map<unsigned, int> counts;
    for (int i = 0; i < 1000; ++i) {
      const auto chosen = machine.discovery.choose(requirement);
      EXPECT_TRUE(chosen);
      ++counts[chosen ? value(chosen->instance) : 0];
    }
    return counts;
  }
};

TEST_F(Balanced, ChoosesTheLowestPriorityAndThenByWeight) {
  covers({"feat_req_someipsd_146", "feat_req_someipsd_175"});
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  EXPECT_FALSE(machine.discovery.choose(*requirement));
  offers(1, "00 0002 ffff");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{1, 1000}}));
  offers(2, "00 0001 0001");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{2, 1000}}));
  offers(3, "00 0001 0003");
  offers(4, "00 0001 0000");  // not while others have a weight
  offers(5, "");              // without rank: after all others
  const auto counts = draw(*requirement);
  ASSERT_THAT(counts, SizeIs(2));
  EXPECT_NEAR(counts.at(2), 250, 60);
  EXPECT_NEAR(counts.at(3), 750, 60);
}

TEST_F(Balanced, ChoosesEvenlyWithoutWeights) {
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  for (std::uint16_t instance = 1; instance <= 4; ++instance) {
    offers(instance, instance == 4 ? "00 ffff 0000" : "");
  }
  const auto counts = draw(*requirement);
  ASSERT_THAT(counts, SizeIs(4));
  for (const auto& [instance, count] : counts) {
    EXPECT_NEAR(count, 250, 60) << instance;
  }
}

TEST_F(Balanced, ChoosesAmongWhatFitsAlone) {
  const auto requirement =
      machine.discovery.require({.service = ServiceId{0x1234}, .instance = InstanceId{2}}, machine.now);
  const auto other = machine.discovery.require({.service = ServiceId{0x4321}}, machine.now);
  ASSERT_TRUE(requirement && other);
  offers(1, "00 0000 0001");
  offers(2, "00 0009 0001");
  EXPECT_EQ(draw(*requirement), (std::map<unsigned, int>{{2, 1000}}));
  EXPECT_FALSE(machine.discovery.choose(*other));
  EXPECT_FALSE(machine.discovery.choose({}));
}

TEST(BalancedOtherwise, RanksTheUnrankedAsTold) {
  Settings settings = fixed_settings();
  settings.unranked = {.priority = 0, .weight = 1};
  Machine<> machine{settings};
  FakePeer peer{peer_sd};
  const auto requirement = machine.discovery.require({.service = ServiceId{0x1234}}, machine.now);
  ASSERT_TRUE(requirement);
  machine.unicast(peer, {with(offer({udp(peer_udp)}, 3, 0x1234, 1), {rank("00 0001 0001")}),
                         offer({udp(peer_udp)}, 3, 0x1234, 2)});
  const auto chosen = machine.discovery.choose(*requirement);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->instance, InstanceId{2});
}

// --- Services that are not SOME/IP ------------------------------------------------------------------------

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

TEST_F(OtherProtocol, AnnouncesLayer2TrafficWithItsName) {
  covers({"feat_req_someipsd_1250", "feat_req_someipsd_1252", "feat_req_someipsd_1262"});
  const std::array<ConfigurationItem, 1> said{{{"otherserv", "a"}}};
  OfferedService stream{.service = other_protocols, .instance = InstanceId{1}, .configuration = said};
  stream.mac_groupcast = MacGroupcastOption{.address = {0x91, 0xe0, 0xf0, 0x00, 0x0e, 0xfe},
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
  EXPECT_EQ(found->service.mac_groupcast, stream.mac_groupcast);
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
}  // namespace trestle::sd
