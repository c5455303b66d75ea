// What a Node refuses to be given: each mistake is named, and changes nothing.
#include <functional>
#include <limits>

#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

constexpr EventgroupId group{1};

/// What the exception says; empty if there was none.
std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

// --- NodeConfig -------------------------------------------------------------------------------------------

struct Nonsense {
  std::string name;
  std::function<void(NodeConfig&)> make;
  std::string says;
};

void PrintTo(const Nonsense& nonsense, std::ostream* out) {
  *out << nonsense.name;
}

class ConfigChecks : public testing::TestWithParam<Nonsense> {};

TEST_P(ConfigChecks, NameTheField) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_773"});
  boost::asio::io_context io;
  NodeConfig config = quick(test::server_address);
  EXPECT_EQ(refusal([&] { Node{io, config}; }), "");
  GetParam().make(config);
  EXPECT_THAT(refusal([&] { Node{io, config}; }), HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    All, ConfigChecks,
    testing::Values(
        Nonsense{"NoAddress", [](NodeConfig& c) { c.address = {}; }, "address: 0.0.0.0 is not"},
        Nonsense{"GroupForAddress", [](NodeConfig& c) { c.address = test::own_group(); }, "address: 239."},
        Nonsense{"AddressForGroup", [](NodeConfig& c) { c.multicast = test::server_address; },
                 "multicast: 127."},
        Nonsense{"GroupOfAnotherVersion",
                 [](NodeConfig& c) {
                   c.multicast = {.bytes = {0xff, 2}, .v6 = true};
                 },
                 "multicast: ff02:: is not a multicast address of the IP version"},
        Nonsense{"NoPort", [](NodeConfig& c) { c.port = 0; }, "port: must be at least 1, is 0"},
        Nonsense{"Dscp", [](NodeConfig& c) { c.dscp = 64; }, "dscp: must be at most 63, is 64"},
        Nonsense{"ReceiveBuffer", [](NodeConfig& c) { c.receive_buffer_bytes = -1; },
                 "receive_buffer_bytes: must be at least 0, is -1"},
        Nonsense{"SendBuffer", [](NodeConfig& c) { c.send_buffer_bytes = -1; },
                 "send_buffer_bytes: must be at least 0, is -1"},
        Nonsense{"InitialDelay", [](NodeConfig& c) { c.timing.initial_delay_min = 6ms; },
                 "timing.initial_delay_min: is longer than initial_delay_max"},
        Nonsense{"NegativeDelay", [](NodeConfig& c) { c.timing.initial_delay_min = -1ms; },
                 "timing.initial_delay_min: a time cannot be negative"},
        Nonsense{"ResponseDelay", [](NodeConfig& c) { c.timing.request_response_delay_min = 2ms; },
                 "timing.request_response_delay_min: is longer than request_response_delay_max"},
        Nonsense{"Repetitions", [](NodeConfig& c) { c.timing.repetitions_base_delay = -1ms; },
                 "timing.repetitions_base_delay: a time"},
        Nonsense{"Cycle", [](NodeConfig& c) { c.timing.cyclic_offer_delay = -1ms; },
                 "timing.cyclic_offer_delay: a time"},
        Nonsense{"NoTtl", [](NodeConfig& c) { c.timing.ttl_s = 0; },
                 "timing.ttl_s: must be at least 1, is 0"},
        Nonsense{"Ttl", [](NodeConfig& c) { c.timing.ttl_s = 0x1000000; },
                 "timing.ttl_s: must be at most 16777215, is 16777216"},
        Nonsense{"Prefix", [](NodeConfig& c) { c.discovery.subnet_prefix_bits = 33; },
                 "discovery.subnet_prefix_bits: must be at most 32, is 33"},
        Nonsense{"SdEndpoint",
                 [](NodeConfig& c) {
                   c.discovery.sd_endpoint = Endpoint{IpAddress{.v6 = true}, 30490};
                 },
                 "discovery.sd_endpoint: is not of the IP version"},
        Nonsense{"NoPeers", [](NodeConfig& c) { c.limits.max_peers = 0; }, "limits.max_peers: must be"},
        Nonsense{"NoEntries", [](NodeConfig& c) { c.limits.max_pending_entries = 0; },
                 "limits.max_pending_entries: must be"},
        Nonsense{"NoEvents", [](NodeConfig& c) { c.limits.max_pending_events = 0; },
                 "limits.max_pending_events: must be"},
        Nonsense{"NoMessage", [](NodeConfig& c) { c.max_message_bytes = 0; }, "max_message_bytes: must be"},
        Nonsense{"EndlessMessage", [](NodeConfig& c) { c.max_message_bytes = 0xfffffff8; },
                 "max_message_bytes: must be at most 4294967287, is 4294967288"},
        Nonsense{"NoQueue", [](NodeConfig& c) { c.max_queued_bytes = 0; }, "max_queued_bytes: must be"},
        Nonsense{"NoReassembly", [](NodeConfig& c) { c.max_reassemblies = 0; }, "max_reassemblies: must be"},
        Nonsense{"NoReassemblyOfASender", [](NodeConfig& c) { c.max_reassemblies_per_sender = 0; },
                 "max_reassemblies_per_sender: must be"},
        Nonsense{"NoCalls", [](NodeConfig& c) { c.max_calls = 0; }, "max_calls: must be at least 1, is 0"},
        Nonsense{"Calls", [](NodeConfig& c) { c.max_calls = 0x8001; }, "max_calls: must be at most 32768"},
        Nonsense{"NoTcpClients", [](NodeConfig& c) { c.max_tcp_clients = 0; }, "max_tcp_clients: must be"},
        Nonsense{"NoTcpClientsOfAnAddress", [](NodeConfig& c) { c.max_tcp_clients_per_address = 0; },
                 "max_tcp_clients_per_address: must be"},
        Nonsense{"MessageTimeout", [](NodeConfig& c) { c.tcp_message_timeout = -1s; },
                 "tcp_message_timeout: a time"},
        Nonsense{"ReassemblyTimeout", [](NodeConfig& c) { c.reassembly_timeout = -1s; },
                 "reassembly_timeout: a time"},
        Nonsense{"TcpReceiveBuffer", [](NodeConfig& c) { c.tcp_receive_buffer_bytes = -1; },
                 "tcp_receive_buffer_bytes: must be"},
        Nonsense{"TcpSendBuffer", [](NodeConfig& c) { c.tcp_send_buffer_bytes = -1; },
                 "tcp_send_buffer_bytes: must be"},
        Nonsense{"RetryOrder", [](NodeConfig& c) { c.tcp_retry_min = 6s; },
                 "tcp_retry_min: is longer than tcp_retry_max"},
        Nonsense{"NoRetryPause", [](NodeConfig& c) { c.tcp_retry_min = 0s; },
                 "tcp_retry_min: must be longer than nothing"},
        Nonsense{"NoTimeToConnect", [](NodeConfig& c) { c.tcp_connect_timeout = 0s; },
                 "tcp_connect_timeout: must be longer than nothing"},
        Nonsense{"ErrorType", [](NodeConfig& c) { c.answers.error_type = someip::MessageType::request; },
                 "answers.error_type: must be RESPONSE or ERROR"},
        Nonsense{"SegmentOf100", [](NodeConfig& c) { c.pacing.segment_bytes = 100; },
                 "pacing.segment_bytes: must be a multiple of 16 from 16 to 1392, is 100"},
        Nonsense{"Burst", [](NodeConfig& c) { c.pacing.burst = 0; }, "pacing.burst: must be at least 1"},
        Nonsense{"Separation", [](NodeConfig& c) { c.pacing.separation = -1us; },
                 "pacing.separation: a time cannot be negative"},
        Nonsense{"CollectFor", [](NodeConfig& c) { c.collect_for = -1us; }, "collect_for: a time"},
        Nonsense{"DeadAtOnce", [](NodeConfig& c) { c.tcp_dead_after = 999ms; },
                 "tcp_dead_after: must be from 1 second to 24 days"},
        Nonsense{"DeadNever", [](NodeConfig& c) { c.tcp_dead_after = 24h * 25; },
                 "tcp_dead_after: must be from 1 second to 24 days"}),
    [](const auto& one) { return one.param.name; });

// --- Descriptions -----------------------------------------------------------------------------------------

class ChecksTest : public test::TwoNodes {
 protected:
  static MethodSpec method(std::uint16_t id) {
    return {MethodId{id}, [](const someip::Message&, const Responder&) {}};
  }
  static ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .methods = {method(0x0001)},
            .eventgroups = {{.id = group, .events = {MethodId{0x8001}}}}};
  }
  Node node{io, quick(test::server_address), into(server_log)};
};

TEST_F(ChecksTest, RefuseSegmentsOfAnImpossibleSize) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_773"});
  const OfferHandle offer = node.offer(spec());
  for (const std::size_t bytes : {0U, 7U, 100U, 1400U, 1408U, 65000U}) {
    EXPECT_EQ(refusal([&] { node.notify(offer, MethodId{0x8001}, {}, nullptr, {.segment_bytes = bytes}); }),
              "pacing.segment_bytes: must be a multiple of 16 from 16 to 1392, is " + std::to_string(bytes));
  }
  EXPECT_EQ(refusal([&] { node.notify(offer, MethodId{0x8001}, {}, nullptr, {.burst = 0}); }),
            "pacing.burst: must be at least 1, is 0");
  EXPECT_THAT(refusal([&] {
                node.notify_some(offer, MethodId{0x8001}, [](const Subscriber&) { return true; }, {}, nullptr,
                                 {.segment_bytes = 24});
              }),
              HasSubstr("segment_bytes"));
  for (const std::size_t bytes : {16U, 1024U, 1392U}) {
    EXPECT_EQ(refusal([&] { node.notify(offer, MethodId{0x8001}, {}, nullptr, {.segment_bytes = bytes}); }),
              "");
  }
}

TEST_F(ChecksTest, RefuseAnIdForAMethodAndAnEvent) {
  covers({"feat_req_someip_625"});
  ServiceSpec twice = spec();
  twice.eventgroups[0].events = {MethodId{0x8001}, MethodId{0x0001}};
  EXPECT_EQ(refusal([&] { node.offer(twice); }),
            "offer of 0x1234.0x0001: id 0x0001 is used twice: for an event and for a method");
  for (const FieldSpec& field :
       {FieldSpec{.getter = MethodId{0x8001}}, FieldSpec{.setter = MethodId{0x8001}}}) {
    ServiceSpec of_field = spec();
    of_field.fields = {field};
    EXPECT_THAT(refusal([&] { node.offer(of_field); }), HasSubstr("id 0x8001 is used twice"));
  }
  ServiceSpec notifier = spec();
  notifier.fields = {{.notifier = MethodId{0x8001}}};
  EXPECT_EQ(refusal([&] { node.offer(notifier); }), "") << "which is the event";
}

TEST_F(ChecksTest, KeepThePortOfDiscoveryForIt) {
  covers({"feat_req_someip_676"});
  ServiceSpec udp = spec();
  udp.udp_port = 30490;
  EXPECT_EQ(refusal([&] { node.offer(udp); }),
            "offer of 0x1234.0x0001: port 30490 is for service discovery alone");
  ServiceSpec tcp = spec();
  tcp.tcp_port = 30490;
  EXPECT_THAT(refusal([&] { node.offer(tcp); }), HasSubstr("port 30490 is for service discovery alone"));
  ServiceSpec multicast = spec();
  multicast.eventgroups[0].multicast = Endpoint{test::own_group(), 30490};
  EXPECT_EQ(refusal([&] { node.offer(multicast); }),
            "offer of 0x1234.0x0001: eventgroup 0x0001: port 30490 is for service discovery alone");
  EXPECT_EQ(refusal([&] {
              node.subscribe({.service = ServiceId{1}, .eventgroup = group, .port = 30490}, collect());
            }),
            "subscription to eventgroup 0x0001 of 0x0001.*: port 30490 is for service discovery alone");

  NodeConfig elsewhere = quick(test::other_address);
  elsewhere.port = 40222;
  Node other{io, elsewhere};
  tcp.tcp_port = 40222;
  EXPECT_THAT(refusal([&] { other.offer(tcp); }), HasSubstr("port 40222 is for service discovery alone"));
  tcp.tcp_port = 40223;
  EXPECT_EQ(refusal([&] { other.offer(tcp); }), "");
}

TEST_F(ChecksTest, SayWhichIdsAreUnusual) {
  covers({"feat_req_someip_60", "feat_req_someip_67", "feat_req_someip_626"});
  node.offer(spec());
  EXPECT_THAT(server_log, Each(Not(HasSubstr("meant for"))));
  ServiceSpec swapped = spec();
  swapped.instance = InstanceId{2};
  swapped.methods = {method(0x8002), method(0x7ffe)};
  swapped.fields = {{.getter = MethodId{0x8003}, .setter = MethodId{0x8004}, .notifier = MethodId{0x0005}}};
  swapped.eventgroups[0].events = {MethodId{0x0005}, MethodId{0x8001}};
  node.offer(swapped);
  const std::string name = "offer of 0x1234.0x0002: ";
  EXPECT_THAT(server_log, Contains(name + "method 0x8002: ids from 0x8000 on are meant for events"));
  EXPECT_THAT(server_log, Contains(name + "method 0x8003: ids from 0x8000 on are meant for events"));
  EXPECT_THAT(server_log, Contains(name + "method 0x8004: ids from 0x8000 on are meant for events"));
  EXPECT_THAT(server_log, Contains(name + "event 0x0005: ids below 0x8000 are meant for methods"));
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("0x7ffe"))));
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("0x8001: "))));
}

}  // namespace
}  // namespace trestle::sd
