#include "test/interop/vsomeip/vsomeip_test.hpp"

#include <cstdio>
#include <fstream>

#include "someip/net/address_text.hpp"

namespace trestle::interop {
namespace {

const std::string folder = Namespaces::folder;
const std::string peer_errors = folder + "/vsomeip.log";
const std::string node_errors = folder + "/node.log";

std::string content(const std::string& file) {
  std::ifstream in{file};
  return {std::istreambuf_iterator<char>{in}, {}};
}

/// What `emit` gets.
std::vector<std::uint8_t> emit_request(std::uint16_t event, std::uint32_t size) {
  std::vector<std::uint8_t> request{static_cast<std::uint8_t>(event >> 8U), static_cast<std::uint8_t>(event)};
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    request.push_back(static_cast<std::uint8_t>(size >> shift));
  }
  return request;
}

}  // namespace

std::string described(std::size_t size) {
  const auto bytes = pattern(size);
  return std::to_string(size) + " " + std::to_string(checksum(bytes.data(), bytes.size()));
}

std::string answer(std::uint16_t method, int code, std::size_t size) {
  return "answer " + std::to_string(method) + " " + std::to_string(code) + " " + described(size);
}

std::string event(std::uint16_t id, std::size_t size) {
  return "event " + std::to_string(id) + " " + described(size);
}

void VsomeipTest::SetUpTestSuite() {
  namespaces.make();
}

void VsomeipTest::SetUp() {
  namespaces.expect();
}

void VsomeipTest::TearDown() {
  if (HasFailure()) {
    std::printf("--- our log:\n%s%s%s", log.c_str(), described_counters().c_str(),
                content(node_errors).c_str());
    for (const auto& [whose, process] :
         {std::pair{"our process", node_process.get()}, {"vsomeip", peer.get()}}) {
      std::printf("--- %s:\n", whose);
      for (std::size_t i = 0; process != nullptr && i < process->lines().size(); ++i) {
        std::printf("%s\n", process->lines()[i].c_str());
      }
    }
    std::printf("%s\n", content(peer_errors).c_str());
  }
  node.reset();
  node_process.reset();
  peer.reset();
  std::remove(peer_errors.c_str());
  std::remove(node_errors.c_str());
}

std::string VsomeipTest::peer_config(bool serves) const {
  const std::string own = v6 ? Namespaces::own_v6 : "10.77.0.2";
  const std::string events_group = v6 ? multicast_address_v6 : multicast_address;
  const std::string cycle = std::to_string(peer_cycle.count());
  return R"({"unicast": ")" + (v6 ? std::string{Namespaces::peer_v6} : "10.77.0.1") + R"(",
    "logging": {"level": "info", "console": "true"},
    "applications": [{"name": "peer", "id": "0x1277"}],
    "services": [{"service": "0x4711", "instance": "0x0001", )" +
         (serves ? std::string{} : R"("unicast": ")" + own + R"(", )") + R"("unreliable": "30509",
      "reliable": {"port": "30510", "enable-magic-cookies": "false"},
      "events": [{"event": "0x8001", "is_reliable": "false"}, {"event": "0x8002", "is_reliable": "true"},
                 {"event": "0x8003", "is_reliable": "false"},
                 {"event": "0x8011", "is_field": "true", "is_reliable": "false"}],
      "eventgroups": [{"eventgroup": "0x0001", "events": ["0x8001"]},
                      {"eventgroup": "0x0002", "events": ["0x8002"]},
                      {"eventgroup": "0x0003", "events": ["0x8003"], "threshold": "1",
                       "multicast": {"address": ")" +
         events_group + R"(", "port": "32344"}},
                      {"eventgroup": "0x0004", "events": ["0x8011"]}],
      "someip-tp": {")" +
         (serves ? "service-to-client" : "client-to-service") + R"(": ["0x0001", "0x8001"]}}],
    "routing": "peer",
    "service-discovery": {"enable": "true", "multicast": ")" +
         (v6 ? "ff15::77" : "224.244.224.245") + R"(",
      "port": "30490", "protocol": "udp", "initial_delay_min": "10", "initial_delay_max": "50",
      "repetitions_base_delay": "50", "repetitions_max": "3", "ttl": ")" +
         (peer_cycle > 1s ? "180" : "3") + R"(", "cyclic_offer_delay": ")" + cycle + R"(",
      "request_response_delay": "50"}})";
}

void VsomeipTest::start_peer(const std::string& role) {
  const std::string file = folder + "/vsomeip.json";
  std::ofstream{file} << peer_config(role == "service");
  peer.reset();
  peer = std::make_unique<PeerProcess>(
      namespaces->at_peer({VSOMEIP_PEER, role}),
      std::vector{"VSOMEIP_CONFIGURATION=" + file, std::string{"VSOMEIP_APPLICATION_NAME=peer"},
                  "VSOMEIP_BASE_PATH=" + folder},
      peer_errors);
  ASSERT_TRUE(prints("ready")) << "vsomeip does not start";
}

void VsomeipTest::start_node_process() {
  node_process.reset();
  node_process =
      std::make_unique<PeerProcess>(std::vector<std::string>{NODE_PEER, "10.77.0.2", "224.244.224.245"},
                                    std::vector<std::string>{}, node_errors);
  ASSERT_TRUE(run_until([&] { return node_process->count("ready") == 1; }));
}

sd::NodeConfig VsomeipTest::node_config() const {
  sd::NodeConfig config{.address = Namespaces::own};
  // As a bridge has it: the option in its offers must trouble nobody.
  config.gateway_to = Endpoint{IpAddress::v4(239, 255, 0, 1), 7400};
  if (v6) {
    config.address = someip::parse_address(Namespaces::own_v6).value_or(IpAddress{});
    config.multicast = someip::parse_address("ff15::77").value_or(IpAddress{});
  }
  config.timing.cyclic_offer_delay = our_cycle;
  return config;
}

void VsomeipTest::start_node(const sd::NodeConfig& config) {
  node = std::make_unique<Node>(io, config, [this](const std::string& line) { log += line + "\n"; });
}

/// What discovery received, for those who look into a failure.
std::string VsomeipTest::described_counters() const {
  if (!node) {
    return "";
  }
  const sd::SdCounters& seen = node->discovery_counters();
  std::string text;
  for (const auto& [name, count] : {std::pair{"received", seen.datagrams_received},
                                    {"processed", seen.messages_received},
                                    {"sent", seen.datagrams_sent},
                                    {"dropped_own", seen.dropped_own},
                                    {"dropped_source", seen.dropped_source},
                                    {"dropped_malformed", seen.dropped_malformed},
                                    {"ignored_bad_options", seen.ignored_bad_options},
                                    {"ignored_wrong_transport", seen.ignored_wrong_transport},
                                    {"ignored_conflicting_offer", seen.ignored_conflicting_offer}}) {
    text += std::string{name} + " " + std::to_string(count) + "\n";
  }
  return text;
}

// --- vsomeip serves, Trestle uses -------------------------------------------------------------------------

void VsomeipServes::SetUp() {
  VsomeipTest::SetUp();
  if (!ready()) {
    return;
  }
  start_peer("service");
  start_node();
  require();
}

void VsomeipServes::require() {
  required = node->require({ServiceId{service}, InstanceId{instance}, major_version});
  ASSERT_TRUE(run_until([&] { return !node->available(required).empty(); })) << log;
}

VsomeipServes::Outcome VsomeipServes::call(std::uint16_t method, Transport transport,
                                           const std::vector<std::uint8_t>& payload, Duration timeout) {
  std::optional<Outcome> outcome;
  const ByteView bytes = std::as_bytes(std::span{payload});
  node->call(required, {.method = MethodId{method}, .timeout = timeout, .transport = transport}, {&bytes, 1},
             [&](const sd::CallResult& result) {
               outcome.emplace();
               if (result) {
                 outcome->payload.assign(result->payload.begin(), result->payload.end());
               } else {
                 outcome->fault = result.error().fault;
                 outcome->code = result.error().code;
               }
             });
  EXPECT_TRUE(run_until([&] { return outcome.has_value(); }));
  return outcome.value_or(Outcome{});
}

void VsomeipServes::emit_event(std::uint16_t event, std::uint32_t size) {
  EXPECT_EQ(call(emit, Transport::udp, emit_request(event, size)).fault, std::nullopt);
}

sd::SubscriptionId VsomeipServes::subscribe(std::uint16_t group, std::uint16_t event, bool tcp) {
  return node->subscribe({.service = ServiceId{service},
                          .instance = InstanceId{instance},
                          .major = major_version,
                          .eventgroup = EventgroupId{group},
                          .events = {MethodId{event}},
                          .udp = !tcp,
                          .tcp = tcp},
                         [this](const Message& message, const Endpoint&) {
                           events.emplace_back(message.payload.begin(), message.payload.end());
                         });
}

// --- Trestle serves, vsomeip uses -------------------------------------------------------------------------

void VsomeipUses::SetUp() {
  VsomeipTest::SetUp();
  if (!ready()) {
    return;
  }
  start_node();
  serve();
  start_peer("client");
  ASSERT_TRUE(prints("available"));
}

void VsomeipUses::serve() {
  const auto events_group = someip::parse_address(v6 ? multicast_address_v6 : multicast_address);
  offer = node->offer(
      {.service = ServiceId{service},
       .instance = InstanceId{instance},
       .major = major_version,
       .udp_port = udp_port,
       .tcp_port = tcp_port,
       .methods = {{MethodId{echo}, [](const Message& request,
                                       sd::Responder responder) { responder.respond(request.payload); }},
                   {MethodId{fail},
                    [](const Message& request, sd::Responder responder) {
                      responder.error(static_cast<ReturnCode>(request.payload.size()));
                    }},
                   {MethodId{tell},
                    [this](const Message& request, const sd::Responder&) {
                      node->notify(offer, MethodId{event_udp}, {&request.payload, 1});
                    },
                    someip::MethodKind::fire_and_forget},
                   {MethodId{emit},
                    [this](const Message& request, sd::Responder responder) {
                      responder.respond();
                      const auto at = [&](std::size_t i) {
                        return std::to_integer<std::uint32_t>(request.payload[i]);
                      };
                      notify(static_cast<std::uint16_t>(at(0) << 8U | at(1)),
                             at(2) << 24U | at(3) << 16U | at(4) << 8U | at(5));
                    }}},
       .fields = {{.getter = MethodId{getter},
                   .setter = MethodId{setter},
                   .notifier = MethodId{notifier},
                   .value = to_bytes(pattern(3))}},
       .eventgroups = {{.id = EventgroupId{group_udp}, .events = {MethodId{event_udp}}},
                       {.id = EventgroupId{group_tcp}, .events = {MethodId{event_tcp}}},
                       {.id = EventgroupId{group_multicast},
                        .events = {MethodId{event_multicast}},
                        .multicast = Endpoint{events_group.value_or(IpAddress{}), multicast_port}},
                       {.id = EventgroupId{group_field}, .events = {MethodId{notifier}}}},
       .tcp_events = {MethodId{event_tcp}}});
}

void VsomeipUses::tell_to_subscribe(std::uint16_t group, std::uint16_t event, const std::string& how) {
  peer->tell("subscribe " + std::to_string(group) + " " + std::to_string(event) + " " + how);
}

void VsomeipUses::subscribe(std::uint16_t group, std::uint16_t event, const std::string& how) {
  tell_to_subscribe(group, event, how);
  ASSERT_TRUE(run_until([&] { return node->subscribers(offer, MethodId{event}) == 1; })) << log;
  ASSERT_TRUE(prints("acknowledged " + std::to_string(group) + " 0 "));
}

void VsomeipUses::notify(std::uint16_t event, std::size_t size) {
  const auto bytes = pattern(size);
  const ByteView view = std::as_bytes(std::span{bytes});
  node->notify(offer, MethodId{event}, {&view, 1});
}

}  // namespace trestle::interop
