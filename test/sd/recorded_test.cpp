// Conversations that vsomeip 3.7.4 had with itself, with our machine in the place of one side. The bytes are
// cut from the captures in pcaps/; what we answer has to be what vsomeip answered, byte for byte, but where
// noted.
#include <gmock/gmock.h>

#include <algorithm>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::recorded_test {
namespace {
using namespace test;

constexpr Endpoint vsomeip_server{IpAddress::v4(10, 0, 0, 1), 30490};
constexpr Endpoint vsomeip_client{IpAddress::v4(10, 0, 0, 2), 30490};
constexpr std::array group_4465{Eventgroup{.id = EventgroupId{0x4465}}};
constexpr std::array group_4467{
    Eventgroup{.id = EventgroupId{0x4467}, .multicast = Endpoint{IpAddress::v4(224, 225, 226, 233), 32344}}};

class Recorded : public testing::Test {
 protected:
  // vsomeip does not know the explicit initial data flag; delays play no part here.
  static Settings settings_at(const Endpoint& unicast) {
    Settings settings = fixed_settings();
    settings.unicast = unicast;
    settings.explicit_initial_data = false;
    settings.timing.initial_delay_min = settings.timing.initial_delay_max = 0ms;
    settings.timing.request_response_delay_min = settings.timing.request_response_delay_max = 0ms;
    settings.timing.repetitions_max = 0;
    return settings;
  }

  // All that the machine sends now, as hexadecimal digits.
  static std::string sent_by(Machine<>& machine) {
    std::string digits;
    std::array<std::byte, 1400> room{};
    machine.discovery.on_time(machine.now);
    while (const auto transmit = machine.discovery.poll_transmit(room, machine.now)) {
      digits += to_hex(transmit->bytes);
    }
    return digits;
  }

  static OfferHandle offer_to(Machine<>& machine, std::span<const Eventgroup> eventgroups) {
    const auto handle = machine.discovery.offer({.service = ServiceId{0x1234},
                                                 .instance = InstanceId{0x5678},
                                                 .udp = Endpoint{vsomeip_server.address, 30509},
                                                 .eventgroups = eventgroups},
                                                machine.now);
    EXPECT_TRUE(handle);
    return handle.value_or(OfferHandle{});
  }
};

// sd_offer_find_subscribe_ack_udp.pcap, frames 7 to 13, ours the server.
TEST_F(Recorded, TheServersSideOfASubscription) {
  covers({"feat_req_someipsd_808", "feat_req_someipsd_811"});
  Machine<> machine{settings_at(vsomeip_server)};
  const OfferHandle offer = offer_to(machine, group_4465);
  EXPECT_EQ(sent_by(machine),
            "ffff8100000000300000000101010200c000000000000010010000101234567801000003000000000000000c"
            "000904000a0000010011772d");
  machine.receive(
      hex("ffff8100000000300000000101010200c000000000000010060000101234567801000003000044650000000c"
          "000904000a0000020011e7f1"),
      vsomeip_client, false);
  EXPECT_EQ(sent_by(machine),
            "ffff8100000000240000000101010200c0000000000000100700000012345678010000030000446500000000");
  EXPECT_THAT(machine.events(),
              testing::ElementsAre("added 4465 udp 10.0.0.2:59377 at 10.0.0.2:30490 initial"));
  machine.receive(
      hex("ffff8100000000300000000201010200c000000000000010060000101234567801000003000044650000000c"
          "000904000a0000020011e7f1"),
      vsomeip_client, false);
  EXPECT_EQ(sent_by(machine),
            "ffff8100000000240000000201010200c0000000000000100700000012345678010000030000446500000000");
  // The client stops: its frame 27 of sd_stopoffer_stopsubscribe_reoffer.pcap, with this port.
  machine.receive(
      hex("ffff8100000000300000000601010200c000000000000010060000101234567801000000000044650000000c"
          "000904000a0000020011e7f1"),
      vsomeip_client, false);
  EXPECT_EQ(sent_by(machine), "");
  EXPECT_THAT(machine.events(),
              testing::ElementsAre("removed 4465 udp 10.0.0.2:59377 at 10.0.0.2:30490 stopped"));
  // And the server: frame 34, its second message to the group here.
  machine.discovery.stop_offer(offer, machine.now);
  EXPECT_EQ(sent_by(machine),
            "ffff8100000000300000000201010200c000000000000010010000101234567801000000000000000000000c"
            "000904000a0000010011772d");
}

// sd_multicast_eventgroup.pcap, frames 7 to 13, ours the server and then the client.
TEST_F(Recorded, BothSidesOfAMulticastEventgroup) {
  covers({"feat_req_someipsd_763", "feat_req_someipsd_791"});
  const std::string offer_bytes =
      "ffff8100000000300000000101010200c000000000000010010000101234567801000003000000000000000c"
      "000904000a0000010011772d";
  const std::string subscribe_bytes =
      "ffff8100000000300000000101010200c000000000000010060000101234567801000003000044670000000c"
      "000904000a0000020011917f";
  const std::string ack_bytes =
      "ffff8100000000300000000101010200c000000000000010070000101234567801000003000044670000000c"
      "00091400e0e1e2e900117e58";
  Machine<> server{settings_at(vsomeip_server)};
  offer_to(server, group_4467);
  EXPECT_EQ(sent_by(server), offer_bytes);
  server.receive(hex(subscribe_bytes), vsomeip_client, false);
  EXPECT_EQ(sent_by(server), ack_bytes);

  Machine<> client{settings_at(vsomeip_client)};
  const auto requirement = client.discovery.require(
      {.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .major = 1}, client.now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(client.discovery.subscribe(
      *requirement, {.eventgroup = EventgroupId{0x4467}, .udp = Endpoint{vsomeip_client.address, 0x917f}},
      client.now));
  client.receive(hex(offer_bytes), vsomeip_server, true);
  EXPECT_EQ(sent_by(client), subscribe_bytes);
  client.receive(hex(ack_bytes), vsomeip_server, false);
  EXPECT_THAT(client.events(),
              testing::ElementsAre("available 1234.5678 v1.0 udp 10.0.0.1:30509 at 10.0.0.1:30490",
                                   "subscribed multicast 224.225.226.233:32344"));
}

// reboot_service_kill9.pcap, frames 55 to 76, ours the client: the killed service comes back with session 1.
TEST_F(Recorded, AServerThatIsKilledAndComesBack) {
  covers({"feat_req_someipsd_863", "feat_req_someipsd_871"});
  Machine<> client{settings_at(vsomeip_client)};
  const auto requirement = client.discovery.require(
      {.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .major = 1}, client.now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(client.discovery.subscribe(
      *requirement, {.eventgroup = EventgroupId{0x4465}, .udp = Endpoint{vsomeip_client.address, 0xa28d}},
      client.now));
  const auto offer_of = [](const char* session) {
    return hex(std::string{"ffff8100 00000030 0000"} + session +
               "01010200c000000000000010010000101234567801000003000000000000000c000904000a0000010011772d");
  };
  const auto ack_of = [](const char* session) {
    return hex(std::string{"ffff8100 00000024 0000"} + session +
               "01010200c0000000000000100700000012345678010000030000446500000000");
  };
  client.receive(offer_of("0006"), vsomeip_server, true);
  EXPECT_THAT(sent_by(client), testing::StartsWith("ffff810000000030"));
  client.receive(ack_of("0006"), vsomeip_server, false);
  EXPECT_THAT(client.events(), testing::ElementsAre(testing::StartsWith("available"), "subscribed"));
  client.receive(offer_of("0001"), vsomeip_server, true);
  EXPECT_THAT(client.events(),
              testing::ElementsAre("subscription lost rebooted", "lost 1234.5678 v1 rebooted",
                                   testing::StartsWith("available")));
  // As vsomeip: a StopSubscribe, then a Subscribe; it sent them apart, and from a new port.
  EXPECT_EQ(sent_by(client),
            "ffff8100000000400000000201010200c000000000000020"
            "06000010123456780100000000004465"
            "060000101234567801000003000044650000000c"
            "000904000a0000020011a28d");
  client.receive(ack_of("0001"), vsomeip_server, false);
  EXPECT_THAT(client.events(), testing::ElementsAre("subscribed"));
  client.receive(offer_of("0002"), vsomeip_server, true);
  client.receive(ack_of("0002"), vsomeip_server, false);
  EXPECT_THAT(client.events(), testing::IsEmpty());
  EXPECT_EQ(client.discovery.counters().reboots_detected, 1U);
}

struct Exchange {
  const char* what;
  const char* sent;      // by a raw peer at 10.0.0.2:30490, to the server
  const char* answered;  // by vsomeip, without the session; "" for silence
};

constexpr const char* ack_entry = "c0000000000000100700000012345678010000030000446500000000";
constexpr const char* nack_entry = "c0000000000000100700000012345678010000000000446500000000";

// sd_malformed_raw_peer_vs_vsomeip_service.pcap from frame 11 on, ours the server.
TEST_F(Recorded, AnswersBrokenSubscriptionsAsVsomeipDoes) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_1137", "feat_req_someipsd_1163",
          "feat_req_someipsd_1164", "feat_req_someipsd_1233"});
  Settings settings = settings_at(vsomeip_server);
  settings.own_endpoints_only = false;  // vsomeip sends events wherever it is told to
  Machine<> machine{settings};
  offer_to(machine, group_4465);
  sent_by(machine);
  for (const auto& [what, bytes, answered] : {
           Exchange{"valid",
                    "ffff8100000000300000000301010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a0000020011a028",
                    ack_entry},
           Exchange{"eventgroup",
                    "ffff8100000000300000000401010200c00000000000001006000010123456780100000300009999"
                    "0000000c000904000a0000020011a028",
                    "c0000000000000100700000012345678010000000000999900000000"},
           Exchange{"service",
                    "ffff8100000000300000000501010200c00000000000001006000010432156780100000300004465"
                    "0000000c000904000a0000020011a028",
                    "c0000000000000100700000043215678010000000000446500000000"},
           Exchange{"instance",
                    "ffff8100000000300000000601010200c0000000000000100600001012340bad0100000300004465"
                    "0000000c000904000a0000020011a028",
                    "c0000000000000100700000012340bad010000000000446500000000"},
           Exchange{"major",
                    "ffff8100000000300000000701010200c00000000000001006000010123456780700000300004465"
                    "0000000c000904000a0000020011a028",
                    "c0000000000000100700000012345678070000000000446500000000"},
           Exchange{"no option",
                    "ffff8100000000240000000801010200c00000000000001006000000123456780100000300004465"
                    "00000000",
                    nack_entry},
           Exchange{"index",
                    "ffff8100000000300000000901010200c00000000000001006050010123456780100000300004465"
                    "0000000c000904000a0000020011a028",
                    nack_entry},
           Exchange{"TCP",
                    "ffff8100000000300000000a01010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a0000020006a028",
                    nack_entry},
           Exchange{"0.0.0.0",
                    "ffff8100000000300000000b01010200c00000000000001006000010123456780100000300004465"
                    "0000000c00090400000000000011a028",
                    nack_entry},
           Exchange{"other host",
                    "ffff8100000000300000000c01010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a00004d0011a028",
                    ack_entry},
           Exchange{"port 0",
                    "ffff8100000000300000000d01010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a00000200110000",
                    nack_entry},
           Exchange{"ours",
                    "ffff8100000000300000000e01010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a0000010011a028",
                    nack_entry},
           Exchange{"protocol",
                    "ffff8100000000300000000f01010200c00000000000001006000010123456780100000300004465"
                    "0000000c000904000a0000020099a028",
                    nack_entry},
           Exchange{"conflict",
                    "ffff81000000003c0000001001010200c00000000000001006000020123456780100000300004465"
                    "00000018000904000a0000020011a028000904000a0000020011a029",
                    nack_entry},
           // vsomeip refuses the unknown option; requirement _1142 wants it ignored.
           Exchange{"unknown option",
                    "ffff8100000000380000001101010200c0000000000000100600002012345678010000030000"
                    "446500000014000904000a0000020011a0280005770061626364",
                    ack_entry},
           Exchange{"short option",
                    "ffff8100000000300000001201010200c0000000000000100600001012345678010000030000"
                    "44650000000c000304000a0000020011a028",
                    nack_entry},
           Exchange{"long option",
                    "ffff8100000000300000001301010200c0000000000000100600001012345678010000030000"
                    "44650000000c00c804000a0000020011a028",
                    nack_entry},
           Exchange{"entries length",
                    "ffff8100000000300000001401010200c00000000000000f0600001012345678010000030000"
                    "44650000000c000904000a0000020011a028",
                    ""},
           Exchange{"entries length",
                    "ffff8100000000300000001501010200c0000000000010000600001012345678010000030000"
                    "44650000000c000904000a0000020011a028",
                    ""},
           // vsomeip answers this one with an Ack; requirement _1164 wants it dropped as a whole.
           Exchange{"options length",
                    "ffff8100000000300000001601010200c0000000000000100600001012345678010000030000"
                    "446500000190000904000a0000020011a028",
                    ""},
           Exchange{"no options",
                    "ffff8100000000240000001701010200c0000000000000100600001012345678010000030000"
                    "446500000000",
                    nack_entry},
           Exchange{"entry type",
                    "ffff8100000000300000001801010200c0000000000000103f00001012345678010000030000"
                    "00000000000c000904000a0000020011a028",
                    ""},
           Exchange{"no entries", "ffff8100000000140000001901010200c00000000000000000000000", ""},
           Exchange{"unicast flag",
                    "ffff8100000000300000001a010102008000000000000010060000101234567801000003000044650000"
                    "000c000904000a0000020011a028",
                    ack_entry},
           Exchange{"stop",
                    "ffff8100000000300000001b01010200c00000000000001006000010123456780100000000004465"
                    "0000000c000904000a0000020011a028",
                    ""},
       }) {
    machine.receive(hex(bytes), vsomeip_client, false);
    const std::string sent = sent_by(machine);
    EXPECT_EQ(sent.empty() ? "" : sent.substr(32), answered) << what;
  }
  // The first subscription was stopped; the one that named another host goes on.
  std::vector<Subscriber> left;
  machine.discovery.for_each_subscriber(OfferHandle{0, 1}, EventgroupId{0x4465},
                                        [&](const Subscriber& subscriber) { left.push_back(subscriber); });
  EXPECT_THAT(left, testing::ElementsAre(
                        Subscriber{vsomeip_client, Endpoint{IpAddress::v4(10, 0, 0, 77), 0xa028}, {}}));
  const SdCounters& counters = machine.discovery.counters();
  EXPECT_EQ(counters.dropped_malformed, 3U);
  EXPECT_EQ(counters.ignored_unknown_type, 1U);
  EXPECT_EQ(counters.nacks_sent, 15U);
}

}  // namespace
}  // namespace trestle::sd::recorded_test
