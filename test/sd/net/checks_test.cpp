// What a Node refuses to be given: each mistake is named, and changes nothing.
#include <functional>
#include <limits>

#include "sd/net/proxy.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::checks_test {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
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
  covers({"feat_req_someiptp_772", "feat_req_someiptp_773", "feat_req_someipsd_1156"});
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
                 "tcp_retry_min: must be longer than 0"},
        Nonsense{"NoTimeToConnect", [](NodeConfig& c) { c.tcp_connect_timeout = 0s; },
                 "tcp_connect_timeout: must be longer than 0"},
        Nonsense{"ErrorType", [](NodeConfig& c) { c.answers.error_type = someip::MessageType::request; },
                 "answers.error_type: must be RESPONSE or ERROR"},
        Nonsense{"SegmentOf100", [](NodeConfig& c) { c.pacing.segment_bytes = 100; },
                 "pacing.segment_bytes: must be a multiple of 16 from 16 to 1392, is 100"},
        Nonsense{"Burst", [](NodeConfig& c) { c.pacing.burst = 0; }, "pacing.burst: must be at least 1"},
        Nonsense{"Separation", [](NodeConfig& c) { c.pacing.separation = -1us; },
                 "pacing.separation: a time cannot be negative"},
        Nonsense{"UnansweredFor", [](NodeConfig& c) { c.tcp_unanswered_timeout = -1us; },
                 "tcp_unanswered_timeout: a time"},
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

struct WrongService {
  std::string says;
  std::function<void(ServiceSpec&)> make;
};

TEST_F(ChecksTest, NameTheFieldOfAServiceThatCannotBe) {
  covers({"feat_req_someipsd_500", "feat_req_someipsd_1250"});
  const auto name_it = [](ServiceSpec& s, std::vector<ConfigurationText> items) {
    s.service = other_protocols;
    s.configuration = std::move(items);
  };
  const std::string no_item = "configuration[1]: a key is printable ASCII without '=', an item at most 255";
  const std::string no_name = "configuration: service 0xfffe needs one item otherserv=NAME";
  const std::string no_group = "eventgroup 0x0001: multicast: ";
  const std::string no_client = "eventgroup 0x0001: configured_subscribers: ";
  const std::vector<WrongService> all{
      {"service: 0x0000 names none", [](ServiceSpec& s) { s.service = ServiceId{0}; }},
      {"service: 0xffff names none", [](ServiceSpec& s) { s.service = ServiceId{0xffff}; }},
      {"instance: 0x0000 names none", [](ServiceSpec& s) { s.instance = InstanceId{0}; }},
      {"instance: 0xffff names none", [](ServiceSpec& s) { s.instance = someip::any_instance; }},
      {"major: 0xff means any", [](ServiceSpec& s) { s.major = 0xff; }},
      {"neither udp_port nor tcp_port", [](ServiceSpec& s) { s.udp_port.reset(); }},
      {"ttl_s: must be from 1 to 16777215, is 0", [](ServiceSpec& s) { s.ttl_s = 0; }},
      {"ttl_s: must be from 1 to 16777215, is 16777216", [](ServiceSpec& s) { s.ttl_s = 0x1000000; }},
      {"options.mac_groupcast: is for service 0xfffe alone",
       [](ServiceSpec& s) { s.options.mac_groupcast.emplace(); }},
      {"options.mac_groupcast.identifier_bytes: must be at most 12, is 13",
       [&](ServiceSpec& s) {
         name_it(s, {{"otherserv", "x"}});
         s.options.mac_groupcast = MacGroupcastOption{.identifier_bytes = 13};
       }},
      {no_item,
       [](ServiceSpec& s) {
         s.configuration = {{"a", "b"}, {"", "x"}};
       }},
      {no_item,
       [](ServiceSpec& s) {
         s.configuration = {{"a", "b"}, {"c=", "x"}};
       }},
      {no_item,
       [](ServiceSpec& s) {
         s.configuration = {{"a", "b"}, {"\n"}};
       }},
      {no_item,
       [](ServiceSpec& s) {
         s.configuration = {{"a", "b"}, {"c", std::string(254, 'x')}};
       }},
      {"configuration: is longer than limits.max_configuration_bytes, 256",
       [](ServiceSpec& s) {
         s.configuration = {{"a", "b"}, {"c", std::string(249, 'x')}};
       }},
      {"configuration[0]: otherserv is for service 0xfffe alone",
       [](ServiceSpec& s) { s.configuration = {{"otherserv"}}; }},
      {no_name, [&](ServiceSpec& s) { name_it(s, {}); }},
      {no_name,
       [&](ServiceSpec& s) {
         name_it(s, {{"a", "x"}});
       }},
      {no_name,
       [&](ServiceSpec& s) {
         name_it(s, {{"otherserv", ""}});
       }},
      {no_name,
       [&](ServiceSpec& s) {
         name_it(s, {{"otherserv", "x"}, {"otherserv", "y"}});
       }},
      {"eventgroup: 0x0000 names none", [](ServiceSpec& s) { s.eventgroups[0].id = EventgroupId{0}; }},
      {"eventgroup: 0xffff names none", [](ServiceSpec& s) { s.eventgroups[0].id = EventgroupId{0xffff}; }},
      {"eventgroup 0x0001: is there twice", [](ServiceSpec& s) { s.eventgroups.push_back({.id = group}); }},
      {no_group + "127.",
       [](ServiceSpec& s) {
         s.eventgroups[0].multicast = {test::client_address, 40300};
       }},
      {no_group + "ff02::",
       [](ServiceSpec& s) {
         s.eventgroups[0].multicast = {IpAddress{.bytes = {0xff, 2}, .v6 = true}, 40300};
       }},
      {no_group + "the port must not be 0",
       [](ServiceSpec& s) {
         s.eventgroups[0].multicast = {test::own_group(), 0};
       }},
      {no_client + "127.",
       [](ServiceSpec& s) {
         s.eventgroups[0].configured_subscribers = {{test::client_address, 0}};
       }},
      {no_client + "239.",
       [](ServiceSpec& s) {
         s.eventgroups[0].configured_subscribers = {{test::own_group(), 40300}};
       }},
      {no_client + "0.0.0.0",
       [](ServiceSpec& s) {
         s.eventgroups[0].configured_subscribers = {{{}, 40300}};
       }},
      {no_client + "[::]",
       [](ServiceSpec& s) {
         s.eventgroups[0].configured_subscribers = {{IpAddress{.v6 = true}, 40300}};
       }},
      {no_client + "not where events go over TCP",
       [](ServiceSpec& s) {
         s.tcp_port = 0;
         s.tcp_events = {MethodId{0x8001}};
         s.eventgroups[0].configured_subscribers = {{test::client_address, 40300}};
       }},
      {"notifier 0x8002 is in no eventgroup",
       [](ServiceSpec& s) { s.fields = {{.getter = MethodId{2}, .notifier = MethodId{0x8002}}}; }},
      {"answers.error_type: must be RESPONSE or ERROR",
       [](ServiceSpec& s) { s.answers = someip::AnswerRules{.error_type = someip::MessageType::request}; }}};
  for (const WrongService& one : all) {
    ServiceSpec wrong = spec();
    one.make(wrong);
    EXPECT_THAT(refusal([&] { node.offer(wrong); }),
                AllOf(StartsWith("offer of 0x"), HasSubstr(": " + one.says)));
  }
  EXPECT_THAT(server_log, IsEmpty()) << "none of them is offered";
  EXPECT_EQ(refusal([&] { node.offer(spec()); }), "");
}

TEST_F(ChecksTest, NameTheFieldOfANeedThatCannotBe) {
  covers({"feat_req_someipsd_503"});
  const std::string too_long(246, 'x');  // with its key one byte more than an item may have
  const std::vector<std::pair<RequireSpec, std::string>> needs{
      {{.service = ServiceId{0}}, "service: 0x0000 names none"},
      {{.service = ServiceId{0xffff}}, "service: 0xffff names none"},
      {{.service = ServiceId{1}, .instance = InstanceId{0}}, "instance: 0x0000 names none"},
      {{.service = ServiceId{1}, .otherserv = "x"}, "otherserv: is for service 0xfffe alone"},
      {{.service = other_protocols}, "otherserv: service 0xfffe needs a name"},
      {{.service = other_protocols, .otherserv = too_long}, "otherserv: is longer than an item or limits."}};
  for (const auto& [need, says] : needs) {
    EXPECT_THAT(refusal([&, what = &need] { node.require(*what); }),
                AllOf(StartsWith("requirement of 0x"), HasSubstr(": " + says)));
    EXPECT_THAT(refusal([&, what = &need] {
                  node.subscribe({.service = what->service,
                                  .instance = what->instance,
                                  .eventgroup = group,
                                  .otherserv = what->otherserv},
                                 collect());
                }),
                AllOf(StartsWith("subscription to eventgroup 0x0001 of 0x"), HasSubstr(": " + says)));
  }
  const std::vector<std::pair<SubscribeSpec, std::string>> subscriptions{
      {{.service = ServiceId{1}}, "eventgroup: 0x0000 names none"},
      {{.service = ServiceId{1}, .eventgroup = EventgroupId{0xffff}}, "eventgroup: 0xffff names none"},
      {{.service = ServiceId{1}, .eventgroup = group, .udp = false}, "neither UDP nor TCP is asked for"},
      {{.service = ServiceId{1}, .eventgroup = group, .silence_timeout = 0ms},
       "silence_timeout: must be longer than 0"},
      {{.service = ServiceId{1}, .eventgroup = group, .ttl_s = 0}, "ttl_s: must be from 1 to 16777215, is 0"},
      {{.service = ServiceId{1}, .eventgroup = group, .ttl_s = 0x1000000},
       "ttl_s: must be from 1 to 16777215, is 16777216"}};
  for (const auto& [wanted, says] : subscriptions) {
    EXPECT_THAT(refusal([&, what = &wanted] { node.subscribe(*what, collect()); }), EndsWith(": " + says));
  }
  EXPECT_THAT(server_log, IsEmpty()) << "none of them is looked for";
}

TEST_F(ChecksTest, RefuseToCallNobodyBack) {
  const RequirementId service = node.require({.service = ServiceId{0x4321}});
  EXPECT_EQ(refusal([&] { node.call(service, {.method = MethodId{7}}, {}, nullptr); }),
            "call of method 0x0007: handler: missing");
  EXPECT_EQ(refusal([&] { node.subscribe({.service = ServiceId{0x4321}, .eventgroup = group}, nullptr); }),
            "subscription to eventgroup 0x0001 of 0x4321.*: handler: missing");
  EXPECT_NO_THROW(node.subscribe({.service = ServiceId{0x4321}, .eventgroup = group}, collect()))
      << "without events: to be a subscriber is all that is wanted";
}

TEST_F(ChecksTest, RefuseToSendWhatTheServiceHasNot) {
  ServiceSpec with_field = spec();
  with_field.fields = {{.getter = MethodId{2}, .notifier = MethodId{0x8001}}};
  const OfferHandle offer = node.offer(with_field);
  const std::vector<std::byte> value(1);
  EXPECT_EQ(refusal([&] { node.notify(offer, MethodId{0x8002}, {}); }),
            "event 0x8002 of 0x1234.0x0001 is in no eventgroup");
  EXPECT_EQ(
      refusal([&] { node.notify_some(offer, MethodId{0x8002}, [](const Subscriber&) { return true; }, {}); }),
      "event 0x8002 of 0x1234.0x0001 is in no eventgroup");
  EXPECT_EQ(refusal([&] { node.set_field(offer, MethodId{0x0001}, value); }),
            "0x1234.0x0001 has no field 0x0001")
      << "that is a method";
  EXPECT_EQ(refusal([&] { node.set_field(offer, MethodId{0x0002}, value); }), "");
  node.withdraw(offer);
  EXPECT_EQ(refusal([&] {
              node.notify(offer, MethodId{0x8002}, {});
              node.set_field(offer, MethodId{0x0001}, value);
            }),
            "")
      << "it has ended, and nobody is there to be told";
}

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
  const someip::TpPacing wrong{.segment_bytes = 24};
  const std::string why = "segment_bytes: must be a multiple of 16 from 16 to 1392, is 24";
  ServiceSpec with_method = spec();
  with_method.methods[0].pacing = wrong;
  EXPECT_EQ(refusal([&] { node.offer(with_method); }), "offer of 0x1234.0x0001: method.pacing." + why);
  ServiceSpec with_field = spec();
  with_field.fields = {{.getter = MethodId{0x0002}, .pacing = wrong}};
  EXPECT_EQ(refusal([&] { node.offer(with_field); }), "offer of 0x1234.0x0001: field.pacing." + why);
  const RequirementId required = node.require({.service = ServiceId{0x1234}});
  const CallSpec call{.method = MethodId{0x0001}, .pacing = wrong};
  EXPECT_EQ(refusal([&] { node.call(required, call, {}, [](const CallResult&) {}); }), "pacing." + why);
  EXPECT_EQ(refusal([&] { node.send(required, call, {}); }), "pacing." + why);
  Proxy proxy{node, {.service = ServiceId{0x1234}}};
  EXPECT_EQ(refusal([&] { proxy.call(call, {}, [](boost::system::error_code, const Response&) {}); }),
            "pacing." + why);
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

TEST_F(ChecksTest, RefuseUpdateRulesThatMakeNoSense) {
  covers({"feat_req_someip_625", "feat_req_someip_635"});
  const auto with = [](const EventSpec& event) {
    ServiceSpec result = spec();
    result.fields = {{.notifier = MethodId{0x8002}}};
    result.eventgroups[0].events = {MethodId{0x8001}, MethodId{0x8002}};
    result.events = {event};
    return result;
  };
  const std::string name = "offer of 0x1234.0x0001: ";
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8002}})); }), name + "id 0x8002 is used twice");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x0001}})); }), name + "id 0x0001 is used twice");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8000}})); }), name + "id 0x8000 is reserved");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8003}})); }),
            name + "event 0x8003 is in no eventgroup");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8001}, .update = {.on_change = false}})); }),
            name + "event 0x8001 would never be sent: update has neither on_change nor a cycle");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8001}, .update = {.cycle = -1ms}})); }),
            name + "event 0x8001: update.cycle: a time cannot be negative");
  ServiceSpec twice = with({.id = MethodId{0x8001}});
  twice.events.push_back(twice.events[0]);
  EXPECT_EQ(refusal([&] { node.offer(twice); }), name + "id 0x8001 is used twice");
  ServiceSpec field = with({.id = MethodId{0x8001}});
  field.fields[0].update.cycle = -1ms;
  EXPECT_EQ(refusal([&] { node.offer(field); }), name + "a field's update.cycle: a time cannot be negative");
  EXPECT_EQ(refusal([&] { node.offer(with({.id = MethodId{0x8001}})); }), "");
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
}  // namespace trestle::sd::checks_test
