// Where the specification leaves a choice, or contradicts itself: both ways of each such setting.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::choices_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr Endpoint peer_sd{IpAddress::v4(10, 0, 0, 2), 30490};
constexpr Endpoint peer_udp{IpAddress::v4(10, 0, 0, 2), 40000};
constexpr Endpoint peer_tcp{IpAddress::v4(10, 0, 0, 2), 41000};
constexpr Endpoint service_udp{IpAddress::v4(10, 0, 0, 1), 30509};
constexpr Endpoint service_tcp{IpAddress::v4(10, 0, 0, 1), 30510};
constexpr Endpoint events_multicast{IpAddress::v4(224, 225, 226, 233), 32344};
constexpr Endpoint more_multicast{IpAddress::v4(224, 225, 226, 234), 32344};

OfferedService service(std::span<const Eventgroup> eventgroups, std::uint16_t id = 0x1234) {
  return {.service = ServiceId{id},
          .instance = InstanceId{0x5678},
          .udp = service_udp,
          .tcp = service_tcp,
          .eventgroups = eventgroups};
}

// The first datagram, sent 10 ms after the start.
std::string first_bytes(const Settings& settings, const OfferedService& offered) {
  Machine<> machine{settings};
  EXPECT_TRUE(machine.discovery.offer(offered, machine.now));
  machine.now += 10ms;
  machine.discovery.on_time(machine.now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  return transmit ? to_hex(transmit->bytes) : "";
}

TEST(SdEndpointOption, IsTheFirstOfEachMessageWhenConfigured) {
  covers({"feat_req_someipsd_1082", "feat_req_someipsd_1156", "feat_req_someipsd_1151",
          "feat_req_someipsd_1114"});
  Settings settings = fixed_settings();
  settings.sd_endpoint = Endpoint{IpAddress::v4(10, 0, 0, 7), 30491};
  const OfferedService udp_only{
      .service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .udp = service_udp};
  // Once, in front, and referenced by no entry: the offer's run begins at index 1.
  EXPECT_EQ(first_bytes(settings, udp_only),
            to_hex(hex("ffff8100 0000003c 00000001 01010200 e0000000 00000010"
                       "01010010 12345678 01000003 00000000 00000018"
                       "000924 00 0a000007 00 11 771b"
                       "000904 00 0a000001 00 11 772d")));
  // By default there is none.
  settings.sd_endpoint.reset();
  EXPECT_EQ(first_bytes(settings, udp_only),
            to_hex(hex("ffff8100 00000030 00000001 01010200 e0000000 00000010"
                       "01000010 12345678 01000003 00000000 0000000c"
                       "000904 00 0a000001 00 11 772d")));
}

TEST(SdEndpointOption, IsOfIpv6OnIpv6) {
  covers({"feat_req_someipsd_1099", "feat_req_someipsd_1155", "feat_req_someipsd_1153",
          "feat_req_someipsd_1113"});
  const auto address = [](std::uint8_t last) {
    return IpAddress{{0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, last}, true};
  };
  Settings settings = fixed_settings();
  settings.unicast = {address(1), 30490};
  settings.multicast = {IpAddress{{0xff, 0x14, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4}, true}, 30490};
  settings.sd_endpoint = Endpoint{address(7), 30491};
  EXPECT_EQ(first_bytes(settings, {.service = ServiceId{0x1234},
                                   .instance = InstanceId{0x5678},
                                   .udp = Endpoint{address(1), 30509}}),
            to_hex(hex("ffff8100 00000054 00000001 01010200 e0000000 00000010"
                       "01010010 12345678 01000003 00000000 00000030"
                       "001526 00 fd000000000000000000000000000007 00 11 771b"
                       "001506 00 fd000000000000000000000000000001 00 11 772d")));
}

TEST(SdEndpointOption, IsInEachOfManyDatagrams) {
  covers({"feat_req_someipsd_1082"});
  Settings settings = fixed_settings();
  settings.sd_endpoint = Endpoint{IpAddress::v4(10, 0, 0, 7), 30491};
  Machine<> machine{settings};
  for (std::uint16_t id = 1; id <= 5; ++id) {
    ASSERT_TRUE(machine.discovery.offer(service({}, id), machine.now));
  }
  machine.room_bytes = 28 + 12 + 2 * 16 + 2 * 12;  // two offers that share their endpoints
  machine.now += 10ms;
  machine.discovery.on_time(machine.now);
  std::vector<std::byte> room(machine.room_bytes);
  std::vector<std::size_t> entries;
  while (const auto transmit = machine.discovery.poll_transmit(room, machine.now)) {
    const auto decoded = someip::decode(transmit->bytes);
    ASSERT_TRUE(decoded);
    const auto message = decode(*decoded);
    ASSERT_TRUE(message);
    std::vector<OptionType> types;
    OptionCursor cursor = message->options();
    while (const auto option = cursor.next()) {
      types.push_back(option->type);
    }
    EXPECT_THAT(types, ElementsAre(OptionType::ipv4_sd_endpoint, OptionType::ipv4_endpoint,
                                   OptionType::ipv4_endpoint));
    entries.push_back(message->entry_count());
  }
  EXPECT_THAT(entries, ElementsAre(2U, 2U, 1U));
  // In a room for the option alone nothing can be said.
  machine.now = start + 40ms;
  machine.discovery.on_time(machine.now);
  EXPECT_FALSE(machine.discovery.poll_transmit(std::span{room}.first(28 + 11), machine.now));
  EXPECT_TRUE(machine.discovery.poll_transmit(room, machine.now));
}

TEST(ClientIdOfSd, HasThePrefixOfTheNode) {
  covers({"feat_req_someipsd_26"});
  Settings settings = fixed_settings();
  settings.client_id_prefix = 0xab;
  EXPECT_THAT(first_bytes(settings, service({})), StartsWith("ffff8100"
                                                             "0000003c"
                                                             "ab000001"));
}

TEST(MulticastInOffers, IsReferencedWhenToldTo) {
  covers({"feat_req_someipsd_855"});
  const std::array groups{Eventgroup{.id = EventgroupId{1}},
                          Eventgroup{.id = EventgroupId{2}, .multicast = events_multicast},
                          Eventgroup{.id = EventgroupId{3}, .multicast = events_multicast}};
  const std::array two{Eventgroup{.id = EventgroupId{1}, .multicast = more_multicast},
                       Eventgroup{.id = EventgroupId{2}, .multicast = events_multicast}};
  Settings settings = fixed_settings();
  // The default follows the table of requirement 946, which allows an offer no multicast option.
  EXPECT_EQ(first_bytes(settings, service(groups)),
            to_hex(hex("ffff8100 0000003c 00000001 01010200 e0000000 00000010"
                       "01000020 12345678 01000003 00000000 00000018"
                       "000904 00 0a000001 00 11 772d 000904 00 0a000001 00 06 772e")));
  settings.multicast_option_in_offers = true;
  EXPECT_EQ(first_bytes(settings, service(groups)),
            to_hex(hex("ffff8100 00000048 00000001 01010200 e0000000 00000010"
                       "01000030 12345678 01000003 00000000 00000024"
                       "000904 00 0a000001 00 11 772d 000904 00 0a000001 00 06 772e"
                       "000914 00 e0e1e2e9 00 11 7e58")));
  // Two would be in conflict, so there is none.
  EXPECT_THAT(first_bytes(settings, service(two)), testing::Not(HasSubstr("000914")));
}

TEST(MulticastInOffers, IsOfTheServiceItself) {
  Settings settings = fixed_settings();
  settings.multicast_option_in_offers = true;
  Machine<> machine{settings};
  const std::array groups{Eventgroup{.id = EventgroupId{1}, .multicast = events_multicast}};
  const std::array others{Eventgroup{.id = EventgroupId{1}, .multicast = more_multicast}};
  ASSERT_TRUE(machine.discovery.offer(service(groups, 1), machine.now));
  ASSERT_TRUE(machine.discovery.offer(service(others, 2), machine.now));
  ASSERT_TRUE(machine.discovery.offer(service({}, 3), machine.now));
  EXPECT_THAT(machine.run_to(10ms),
              ElementsAre(testing::ContainsRegex("offer 0001.* multicast 224.225.226.233:32344; "
                                                 "offer 0002.* multicast 224.225.226.234:32344; "
                                                 "offer 0003.* tcp 10.0.0.1:30510$")));
}

TEST(FindsInTheRepetitionPhase, AreAnsweredUnlessToldNot) {
  covers({"feat_req_someipsd_811"});
  for (const bool answers : {true, false}) {
    Settings settings = fixed_settings();
    settings.answer_finds_in_repetition_phase = answers;
    Machine<> machine{settings};
    FakePeer peer{peer_sd};
    ASSERT_TRUE(machine.discovery.offer(service({}), machine.now));
    machine.run_to(20ms);  // between the first offer and the repetition after 30 ms
    machine.unicast(peer, {find(0x1234)});
    EXPECT_EQ(machine.sent().size(), answers ? 1U : 0U);
    machine.run_to(200ms);  // the main phase
    machine.unicast(peer, {find(0x1234)});
    EXPECT_EQ(machine.sent().size(), 1U);
  }
}

TEST(EventgroupOfBothTransports, TakesASubscriberOfOneWhenToldTo) {
  covers({"feat_req_someipsd_102"});
  const std::array groups{Eventgroup{.id = EventgroupId{1}, .udp = true, .tcp = true}};
  for (const bool partial : {false, true}) {
    SCOPED_TRACE(partial);
    Settings settings = fixed_settings();
    settings.accept_partial_endpoints = partial;
    Machine<> machine{settings};
    FakePeer peer{peer_sd};
    ASSERT_TRUE(machine.discovery.offer(service(groups), machine.now));
    ASSERT_TRUE(machine.discovery.tcp_connected(service_tcp, peer_tcp));
    machine.unicast(peer, {subscribe(1, {udp(peer_udp)}), subscribe(1, {tcp(peer_tcp)}, 3, 1)});
    if (partial) {
      EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial",
                                                "added 0001 tcp 10.0.0.2:41000 at 10.0.0.2:30490 initial"));
    } else {
      EXPECT_THAT(machine.sent(), ElementsAre(testing::ContainsRegex(": nack .*; nack ")));
      EXPECT_THAT(machine.events(), IsEmpty());
    }
    // None at all, and a TCP endpoint without its connection, are never enough.
    machine.unicast(peer, {subscribe(1, {}, 3, 2), subscribe(1, {tcp({peer_tcp.address, 1})}, 3, 3)});
    EXPECT_THAT(machine.events(), IsEmpty());
  }
}

TEST(OptionsOfUnknownType, AreRefusedOnlyWhenToldTo) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_1142"});
  const std::array groups{Eventgroup{.id = EventgroupId{1}}};
  const auto answer = [&](bool refuse, const char* unknown) {
    Settings settings = fixed_settings();
    settings.refuse_unknown_options = refuse;
    Machine<> machine{settings};
    EXPECT_TRUE(machine.discovery.offer(service(groups), machine.now));
    machine.receive(hex(std::string{"ffff8100 00000036 00000001 01010200 c0000000 00000010"
                                    "06000020 12345678 01000003 00000001 00000012"
                                    "000904000a00000200119c40"} +
                        unknown),
                    peer_sd, false);
    const auto sent = machine.sent();
    EXPECT_EQ(sent.size(), 1U);
    return sent.empty() ? "" : sent.front().substr(sent.front().find(": ") + 2, 4);
  };
  EXPECT_EQ(answer(false, "000377 00 dead"), "ack ");
  EXPECT_EQ(answer(false, "000377 80 dead"), "ack ");
  EXPECT_EQ(answer(true, "000377 80 dead"), "ack ");  // marked discardable
  EXPECT_EQ(answer(true, "000377 00 dead"), "nack");
}

TEST(SubscriptionsToWhatIsUnknown, AreRefusedUnlessToldNot) {
  covers({"feat_req_someipsd_1137", "feat_req_someipsd_1164"});
  const std::array groups{Eventgroup{.id = EventgroupId{1}}};
  const auto other = [](auto change) {
    FakePeer::Said said = subscribe(1, {udp(peer_udp)});
    change(said.entry);
    return said;
  };
  for (const bool answer : {true, false}) {
    SCOPED_TRACE(answer);
    Settings settings = fixed_settings();
    settings.answer_unknown_subscriptions = answer;
    Machine<> machine{settings};
    FakePeer peer{peer_sd};
    ASSERT_TRUE(machine.discovery.offer(service(groups), machine.now));
    // The fifth has bad options, too: what is unknown comes first.
    FakePeer::Said nothing_fits = subscribe(1, {udp({peer_udp.address, 0})});
    nothing_fits.entry.service = ServiceId{0x1235};
    for (const FakePeer::Said& unknown :
         {other([](Entry& e) { e.service = ServiceId{0x1235}; }),
          other([](Entry& e) { e.instance = InstanceId{0x5679}; }), other([](Entry& e) { e.major = 2; }),
          subscribe(9, {udp(peer_udp)}), nothing_fits}) {
      machine.unicast(peer, {unknown});
      EXPECT_EQ(machine.sent().size(), answer ? 1U : 0U);
    }
    const SdCounters& counted = machine.discovery.counters();
    EXPECT_EQ(counted.nacks_sent, answer ? 5U : 0U);
    EXPECT_EQ(counted.nacks_by_reason[static_cast<std::size_t>(NackReason::unknown_service)],
              answer ? 2U : 0U);
    EXPECT_EQ(counted.ignored_unknown_subscriptions, answer ? 0U : 5U);
    EXPECT_EQ(counted.ignored_bad_options, 0U);
    // What is known is answered in any case, beside what is not.
    machine.unicast(peer, {subscribe(9, {udp(peer_udp)}), subscribe(1, {})});
    EXPECT_THAT(machine.sent(),
                ElementsAre(testing::ContainsRegex(answer ? ": nack .* group 0009 .*; nack .* group 0001"
                                                          : ": nack .* group 0001")));
    machine.unicast(peer, {subscribe(9, {udp(peer_udp)}), subscribe(1, {udp(peer_udp)})});
    EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("ack 1234.5678 v1 group 0001")));
    EXPECT_THAT(machine.events(), ElementsAre("added 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 initial"));
  }
}

TEST(MessagesFromOtherPorts, AreDroppedOnlyWhenToldTo) {
  const Endpoint elsewhere{peer_sd.address, 30491};
  for (const bool only : {false, true}) {
    Settings settings = fixed_settings();
    settings.only_from_sd_port = only;
    Machine<> machine{settings};
    FakePeer other{elsewhere};
    machine.unicast(other, {subscribe(1, {udp(peer_udp)})});  // of nothing we have: a Nack
    EXPECT_EQ(machine.sent().size(), only ? 0U : 1U);
    EXPECT_EQ(machine.discovery.counters().dropped_source, only ? 1U : 0U);
    FakePeer peer{peer_sd};
    machine.unicast(peer, {subscribe(1, {udp(peer_udp)})});
    EXPECT_EQ(machine.sent().size(), 1U);
  }
}

TEST(InfiniteSubscription, IsRenewedWithEachOfferUnlessToldNot) {
  covers({"feat_req_someipsd_431"});
  for (const bool renew : {true, false}) {
    SCOPED_TRACE(renew);
    Settings settings = fixed_settings();
    settings.renew_infinite_subscriptions = renew;
    Machine<> machine{settings};
    FakePeer server{peer_sd};
    const auto requirement = machine.discovery.require(
        {.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}}, machine.now);
    ASSERT_TRUE(requirement);
    const auto subscribe_for = [&](std::uint16_t eventgroup, std::uint32_t ttl_s) {
      ASSERT_TRUE(machine.discovery.subscribe(
          *requirement,
          {.eventgroup = EventgroupId{eventgroup}, .udp = Endpoint{own.address, 40000}, .ttl_s = ttl_s},
          machine.now));
    };
    subscribe_for(1, infinite_ttl_s);
    subscribe_for(2, 3);
    const auto subscribed_to = [&] {
      machine.unicast(server, {offer({udp(peer_udp)}, infinite_ttl_s)});
      const auto sent = machine.sent();
      const std::string said = sent.empty() ? "" : sent.front();
      return std::string{said.find("group 0001") != std::string::npos ? "1" : ""} +
             (said.find("group 0002") != std::string::npos ? "2" : "");
    };
    EXPECT_EQ(subscribed_to(), "12");
    EXPECT_EQ(subscribed_to(), "12");  // no Ack came
    machine.unicast(server, {ack(1, {}, infinite_ttl_s), ack(2)});
    EXPECT_EQ(subscribed_to(), renew ? "12" : "2");
    server.reboot();
    EXPECT_EQ(subscribed_to(), "12");
    machine.unicast(server, {ack(1, {}, 0), ack(2)});  // refused: tried again
    EXPECT_EQ(subscribed_to(), "12");
  }
}

}  // namespace
}  // namespace trestle::sd::choices_test
