// End-to-end protection of events and fields, and what a configuration must not say. The bytes were computed
// by a program of its own: a bitwise CRC after AUTOSAR's parameters, tried on the examples of AUTOSAR's E2E
// Protocol Specification. A Node without protection shows and makes the bytes as they are on the wire.
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::e2e_test {
namespace {

namespace e2e = someip::e2e;
using someip::Message;
using someip::MethodId;
using test::covers;
using test::hex;
using test::numbers;
using test::quick;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr MethodId event{0x8001};
constexpr MethodId notifier{0x8002};
constexpr MethodId getter{0x0001};
constexpr MethodId tell{0x0002};
constexpr EventgroupId group{1};
constexpr std::uint32_t id = 0x0a0b0c0d;

class E2eTest : public test::TwoNodes {
 protected:
  static ServiceSpec spec(std::vector<E2eSpec> protection, Transport transport = Transport::udp) {
    ServiceSpec result{.service = ServiceId{0x1234},
                       .instance = InstanceId{1},
                       .eventgroups = {{.id = group, .events = {event, notifier}}},
                       .e2e = std::move(protection)};
    if (transport == Transport::tcp) {
      result.udp_port = {};
      result.tcp_port = 0;
    }
    return result;
  }
  static SubscribeSpec wanted(std::vector<E2eSpec> protection, Transport transport = Transport::udp) {
    return {.service = ServiceId{0x1234},
            .eventgroup = group,
            .events = {event, notifier},
            .udp = transport == Transport::udp,
            .tcp = transport == Transport::tcp,
            .e2e = std::move(protection)};
  }
  /// Notes each event as its payload and, if it was checked, the result.
  static EventHandler into_lines(std::vector<std::string>& lines) {
    return [&lines](const Message& message, const Endpoint&) {
      std::string line = test::to_hex(message.payload);
      if (const e2e::CheckResult* const check = message.check) {
        line += std::string{" "} + to_string(check->status) + " " + to_string(check->state);
        line += check->fault == e2e::Fault::none ? "" : std::string{": "} + to_string(check->fault);
      }
      lines.push_back(line);
    };
  }
  void subscribe(Node& client, const SubscribeSpec& what, const EventHandler& handler) {
    const SubscriptionId subscription = client.subscribe(what, handler);
    ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  }
  static void notify(Node& server, OfferHandle offer, const std::string& payload) {
    const auto bytes = hex(payload);
    const ByteView slice{bytes};
    EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U);
  }

  std::vector<std::string> lines;
  std::vector<std::string> other_lines;
};

// --- Events -----------------------------------------------------------------------------------------------

TEST_F(E2eTest, ProtectsAnEvent) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer(spec({{.id = event, .protect = e2e::Profile4{.data_id = id}}}));
  subscribe(client, wanted({}), into_lines(lines));
  subscribe(client, wanted({{.id = event, .check = e2e::Profile4{.data_id = id}}}), into_lines(other_lines));
  notify(server, offer, "cafe01");
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return lines.size() == 2 && other_lines.size() == 2; }));
  EXPECT_THAT(lines, ElementsAre("001700000a0b0c0d40899371cafe01", "001700010a0b0c0d40c0f6a0cafe01"));
  EXPECT_THAT(other_lines, ElementsAre("cafe01 ok init", "cafe01 ok init"));
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return other_lines.size() == 3; }));
  EXPECT_EQ(other_lines.back(), "cafe01 ok valid");
}

TEST_F(E2eTest, PutsTheHeaderWhereTheOffsetSays) {
  covers({"feat_req_someip_102"});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile4 behind_two_bytes{.data_id = id, .offset_bits = 80};
  const OfferHandle offer = server.offer(spec({{.id = event, .protect = behind_two_bytes}}));
  subscribe(client, wanted({}), into_lines(lines));
  subscribe(client, wanted({{.id = event, .check = behind_two_bytes}}), into_lines(other_lines));
  notify(server, offer, "cafe0102");
  notify(server, offer, "cafe0102");
  ASSERT_TRUE(run_until([&] { return lines.size() == 2 && other_lines.size() == 2; }));
  EXPECT_THAT(lines, ElementsAre("cafe001800000a0b0c0de76514f40102", "cafe001800010a0b0c0d160e64a80102"));
  EXPECT_THAT(other_lines, ElementsAre("cafe0102 ok init", "cafe0102 ok init"));
}

TEST_F(E2eTest, LeavesTheSomeIpHeaderOutIfToldSo) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile1 like_vsomeip{.data_id = 0x123,
                                   .data_id_mode = e2e::DataIdMode::nibble,
                                   .data_bits = 40,
                                   .crc_offset_bits = 0,
                                   .counter_offset_bits = 8,
                                   .data_id_nibble_offset_bits = 12};
  const OfferHandle offer =
      server.offer(spec({{.id = event, .protect = like_vsomeip, .payload_only = true}}));
  subscribe(client, wanted({}), into_lines(lines));
  subscribe(client, wanted({{.id = event, .check = like_vsomeip, .pass_failed = true, .payload_only = true}}),
            into_lines(other_lines));
  notify(server, offer, "cafe01");
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return lines.size() == 2 && other_lines.size() == 2; }));
  EXPECT_THAT(lines, ElementsAre("7810cafe01", "e511cafe01"));
  EXPECT_THAT(other_lines, ElementsAre("cafe01 wrong_sequence init", "cafe01 ok init"))
      << "profile 1 begins so";
}

/// Messages as a network that loses, repeats and spoils them leaves them. Sessions 1 to 8.
constexpr std::array disturbed = {
    "001700000a0b0c0d40899371cafe01",  // counter 0
    "001700010a0b0c0d40c0f6a0cafe01",  // 1
    "001700010a0b0c0d10827c3ccafe01",  // 1 again
    "001700030a0b0c0d40523d02cafe01",  // 3
    "001700090a0b0c0d338339a0cafe01",  // 9
    "0017000a0a0b0c0d4369c2c4cafe00",  // 10, but for a bit of the payload
    "0017000a0a0b0c0d132b4858cafe01",  // 10
    "0017000a0a0b0c",                  // too short
};

class E2eOver : public E2eTest, public testing::WithParamInterface<Transport> {};
INSTANTIATE_TEST_SUITE_P(Transports, E2eOver, testing::Values(Transport::udp, Transport::tcp),
                         [](const auto& one) { return one.param == Transport::udp ? "Udp" : "Tcp"; });

TEST_P(E2eOver, HandsOverOnlyGoodEvents) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const OfferHandle offer = server.offer(spec({}, GetParam()));
  const e2e::Profile4 profile{.data_id = id, .max_delta_counter = 2};
  subscribe(client, wanted({{.id = event, .check = profile}}, GetParam()), into_lines(lines));
  subscribe(client, wanted({{.id = event, .check = profile, .pass_failed = true}}, GetParam()),
            into_lines(other_lines));
  for (const char* const message : disturbed) {
    notify(server, offer, message);
  }
  ASSERT_TRUE(run_until([&] { return other_lines.size() == disturbed.size(); }));
  EXPECT_THAT(
      lines, ElementsAre("cafe01 ok init", "cafe01 ok init", "cafe01 ok_some_lost valid", "cafe01 ok valid"));
  EXPECT_EQ(client.counters().e2e_failed, 4U);
  EXPECT_THAT(other_lines,
              ElementsAre("cafe01 ok init", "cafe01 ok init", "cafe01 repeated init",
                          "cafe01 ok_some_lost valid", "cafe01 wrong_sequence valid",
                          "cafe00 error valid: crc", "cafe01 ok valid", " error valid: data_length"));
}

TEST_P(E2eOver, ProtectsEventsOfAnySize) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile7 profile{.data_id = id};
  const OfferHandle offer = server.offer(spec({{.id = event, .protect = profile}}, GetParam()));
  std::vector<std::string> good;
  subscribe(client, wanted({{.id = event, .check = profile}}, GetParam()),
            [&](const Message& message, const Endpoint& from) {
              good.emplace_back(to_string(message.check->status));
              collect()(message, from);
            });
  const std::vector<std::vector<std::byte>> payloads{{}, numbers(1380), numbers(1381), numbers(300'000, 7)};
  for (const auto& payload : payloads) {
    const ByteView slice{payload};
    EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U);
  }
  ASSERT_TRUE(run_until([&] { return events.size() == payloads.size(); }));
  for (const auto& payload : payloads) {  // in segments they may be overtaken
    EXPECT_THAT(events, Contains(testing::Field(&test::Received::payload, payload)));
  }
  EXPECT_THAT(good, Each("ok"));
}

TEST_F(E2eTest, SendsOneCounterToAllByMulticast) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  Node other{io, quick(test::other_address)};
  const e2e::Profile5 profile{.data_id = 0x1234, .data_bits = 112};
  ServiceSpec by_multicast = spec({{.id = event, .protect = profile}});
  by_multicast.eventgroups[0].multicast =
      Endpoint{IpAddress::v4(239, 253, test::own_group().bytes[2], test::own_group().bytes[3]), 40230};
  const OfferHandle offer = server.offer(by_multicast);
  subscribe(client, wanted({{.id = event, .check = profile}}), into_lines(lines));
  subscribe(other, wanted({}), into_lines(other_lines));
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return lines.size() == 1 && other_lines.size() == 1; }));
  EXPECT_THAT(lines, ElementsAre("cafe01 ok init"));
  EXPECT_THAT(other_lines, ElementsAre("f0fe00cafe01"));
}

TEST_F(E2eTest, DoesNotSendWhatTheProfileHasNoLengthFor) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const e2e::Profile5 three_bytes{.data_id = 0x1234, .data_bits = 112};
  const OfferHandle offer = server.offer(spec({{.id = event, .protect = three_bytes}}));
  subscribe(client, wanted({{.id = event, .check = three_bytes}}), into_lines(lines));
  const auto payload = hex("cafe0102");
  const ByteView slice{payload};
  const Notified notified = server.notify(offer, event, {&slice, 1});
  EXPECT_EQ(notified.subscribers, 0U);
  EXPECT_EQ(notified.dropped, 1U);
  EXPECT_EQ(server.counters().e2e_not_protected, 1U);
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return !lines.empty(); }));
  EXPECT_THAT(lines, ElementsAre("cafe01 ok init")) << "no counter was lost";
  EXPECT_THROW(server.notify_some(offer, event, [](const Subscriber&) { return true; }, {&slice, 1}),
               std::invalid_argument);
}

TEST_F(E2eTest, BeginsAnewWithAnotherServer) {
  auto server = std::make_unique<Node>(io, quick(test::server_address));
  Node client{io, quick(test::client_address)};
  const std::vector<E2eSpec> protection{{.id = event, .protect = e2e::Profile4{.data_id = id}}};
  ServiceSpec at_one_port = spec(protection);
  at_one_port.udp_port = 40250;  // nothing but discovery tells the servers apart
  OfferHandle offer = server->offer(at_one_port);
  const SubscriptionId subscription =
      client.subscribe(wanted({{.id = event, .check = e2e::Profile4{.data_id = id}}}), into_lines(lines));
  for (int round = 1; round <= 2; ++round) {
    ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
    for (std::size_t i = 1; i <= 3; ++i) {
      notify(*server, offer, "cafe01");
    }
    ASSERT_TRUE(run_until([&] { return lines.size() == 3; }));
    EXPECT_THAT(lines, ElementsAre("cafe01 ok init", "cafe01 ok init", "cafe01 ok valid"));
    lines.clear();
    server->shutdown();
    ASSERT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
    server.reset();
    server = std::make_unique<Node>(io, quick(test::server_address));
    offer = server->offer(at_one_port);
  }
}

// --- Fields -----------------------------------------------------------------------------------------------

TEST_F(E2eTest, TellsAFieldToNewSubscribersWithoutALossForTheOthers) {
  Node server{io, test::calm(test::server_address)};
  Node client{io, quick(test::client_address)};
  Node other{io, quick(test::other_address)};
  const e2e::Profile4 profile{.data_id = id};
  ServiceSpec with_field = spec({{.id = notifier, .protect = profile}});
  with_field.fields = {{.notifier = notifier, .value = hex("01")}};
  const OfferHandle offer = server.offer(with_field);
  const E2eSpec all{.id = notifier, .check = profile, .pass_failed = true};
  subscribe(client, wanted({all}), into_lines(lines));
  ASSERT_TRUE(run_until([&] { return !lines.empty(); })) << "the initial event";
  EXPECT_EQ(lines[0], "01 ok init");
  run_for(std::chrono::milliseconds{20});
  lines.clear();
  server.set_field(offer, notifier, hex("02"));
  subscribe(other, wanted({all}), into_lines(other_lines));
  ASSERT_TRUE(run_until([&] { return !other_lines.empty(); }));
  EXPECT_EQ(other_lines[0], "02 wrong_sequence init") << "joins in the middle";
  run_for(std::chrono::milliseconds{20});
  other_lines.clear();
  server.set_field(offer, notifier, hex("03"));
  ASSERT_TRUE(run_until([&] { return lines.size() == 2 && other_lines.size() == 1; }));
  EXPECT_THAT(lines, ElementsAre("02 ok init", "03 ok valid"));
  EXPECT_THAT(other_lines, ElementsAre("03 ok init"));
}

TEST_F(E2eTest, CountsTheRepetitionsOfAnEvent) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  ServiceSpec cyclic = spec({{.id = event, .protect = e2e::Profile4{.data_id = id}}});
  cyclic.events = {{.id = event, .update = {.on_change = false, .cycle = std::chrono::milliseconds{20}}}};
  const OfferHandle offer = server.offer(cyclic);
  subscribe(client, wanted({{.id = event, .check = e2e::Profile4{.data_id = id}}}), into_lines(lines));
  notify(server, offer, "cafe01");
  ASSERT_TRUE(run_until([&] { return lines.size() >= 4; }));
  lines.resize(4);
  EXPECT_THAT(lines, ElementsAre("cafe01 ok init", "cafe01 ok init", "cafe01 ok valid", "cafe01 ok valid"));
}

// --- Configuration ----------------------------------------------------------------------------------------

template <typename Function>
std::string refusal(Function function) {
  try {
    function();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST_F(E2eTest, RefusesWhatCannotBeOffered) {
  Node node{io, quick(test::server_address)};
  const e2e::Profile4 good{.data_id = id};
  const auto offer = [&](std::vector<E2eSpec> protection) {
    ServiceSpec with = spec(std::move(protection));
    with.methods = {{tell, [](const Message&, const Responder&) {}, someip::MethodKind::fire_and_forget}};
    with.fields = {{.getter = getter}};
    return refusal([&] { node.offer(with); });
  };
  const std::string name = "offer of 0x1234.0x0001: e2e of 0x8001: ";
  EXPECT_EQ(offer({{.id = event}}), name + "an event is sent: it has protect, not check");
  EXPECT_EQ(offer({{.id = event, .protect = good, .check = good}}),
            name + "an event is sent: it has protect, not check");
  EXPECT_EQ(offer({{.id = event, .protect = good}, {.id = event, .protect = good}}),
            name + "there is more than one");
  EXPECT_EQ(offer({{.id = event, .protect = e2e::Profile4{.max_delta_counter = 0}}}),
            name + "protect.max_delta_counter must be: at least 1 and below the largest counter");
  EXPECT_EQ(offer({{.id = event, .protect = e2e::Profile4{.offset_bits = 56}}}),
            name + "protect.offset_bits must be: at least 64, behind the SOME/IP header");
  EXPECT_EQ(offer({{.id = event, .protect = e2e::Profile1{.data_bits = 128, .counter_offset_bits = 96}}}),
            name +
                "protect.crc_offset_bits, counter_offset_bits and data_id_nibble_offset_bits must be: "
                "neighbours");
  EXPECT_EQ(offer({{.id = event, .protect = good, .source_id = 0x10000000}}),
            name + "source_id must be: of 28 bits");
  EXPECT_EQ(offer({{.id = event, .protect = good, .max_peers = 0}}), name + "max_peers must be: at least 1");
  EXPECT_EQ(offer({{.id = MethodId{0x0009}, .protect = good}}),
            "offer of 0x1234.0x0001: e2e of 0x0009: there is no such method or event");
  EXPECT_EQ(offer({{.id = tell, .protect = good}}),
            "offer of 0x1234.0x0001: e2e of 0x0002: the method has no response to protect");
  EXPECT_EQ(offer({{.id = getter}}),
            "offer of 0x1234.0x0001: e2e of 0x0001: there is neither protect nor check");
  EXPECT_EQ(offer({{.id = getter, .check = good, .pass_failed = true}}),
            "offer of 0x1234.0x0001: e2e of 0x0001: pass_failed must be: false for a getter or setter");
  EXPECT_THAT(offer({{.id = getter, .check = good, .state_machine = {.window_size_init = 0}}}),
              HasSubstr("e2e of 0x0001: state_machine.window_size_init must be: "));
  EXPECT_EQ(offer({{.id = event, .protect = good}, {.id = tell, .check = good}}), "none");
}

TEST_F(E2eTest, RefusesWhatCannotBeSubscribedToOrRequired) {
  Node node{io, quick(test::server_address)};
  const e2e::Profile4 good{.data_id = id};
  const auto subscription = [&](std::vector<E2eSpec> protection) {
    return refusal([&] { node.subscribe(wanted(std::move(protection)), into_lines(lines)); });
  };
  const std::string name = "subscription to eventgroup 0x0001 of 0x1234.*: e2e of 0x8001: ";
  EXPECT_EQ(subscription({{.id = event, .protect = good}}),
            name + "an event is received: it has check, not protect");
  EXPECT_EQ(subscription({{.id = event, .check = e2e::Profile7{.min_data_bits = 8}}}),
            name +
                "check.min_data_bits must be: a multiple of 8, and 0 or long enough for the E2E header at "
                "its offset");
  EXPECT_EQ(subscription({{.id = event, .check = good}, {.id = event, .check = good}}),
            name + "there is more than one");
  EXPECT_THAT(subscription({{.id = MethodId{0x8009}, .check = good}}),
              HasSubstr("e2e of 0x8009: it is not among the events"));

  const auto requirement = [&](std::vector<E2eSpec> protection) {
    return refusal([&] { node.require({.service = ServiceId{0x1234}, .e2e = std::move(protection)}); });
  };
  EXPECT_EQ(requirement({{.id = MethodId{0}, .check = good}}),
            "requirement of 0x1234.*: e2e of 0x0000: the id is reserved");
  EXPECT_EQ(requirement({{.id = getter, .check = good}, {.id = getter, .protect = good}}),
            "requirement of 0x1234.*: e2e of 0x0001: there is more than one");
  EXPECT_EQ(requirement({{.id = getter}}),
            "requirement of 0x1234.*: e2e of 0x0001: there is neither protect nor check");
  EXPECT_EQ(requirement({{.id = getter, .protect = good}}), "none");
  EXPECT_EQ(requirement({{.id = getter, .protect = good}}), "none") << "the same";
  EXPECT_EQ(requirement({{.id = getter, .protect = e2e::Profile4{.data_id = id + 1}}}),
            "requirement of 0x1234.*: e2e of 0x0001: another requirement of the service has another");

  // Two instances are two servers.
  const auto of_instance = [&](std::uint16_t instance, std::uint32_t data_id) {
    return refusal([&] {
      node.require({.service = ServiceId{0x1235},
                    .instance = InstanceId{instance},
                    .e2e = {{.id = getter, .protect = e2e::Profile4{.data_id = data_id}}}});
    });
  };
  EXPECT_EQ(of_instance(1, 7), "none");
  EXPECT_EQ(of_instance(2, 8), "none");
  const std::string another = "another requirement of the service has another";
  EXPECT_THAT(of_instance(2, 7), HasSubstr(another));
  EXPECT_THAT(of_instance(0xffff, 7), HasSubstr(another)) << "of instance 2 as well";
}

}  // namespace
}  // namespace trestle::sd::e2e_test
