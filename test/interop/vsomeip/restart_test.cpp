// Trestle and vsomeip go on after either of them was killed, and started again: at once, so that a reboot is
// what the other sees, or when what it said has expired.
#include "test/bytes.hpp"
#include "test/interop/vsomeip/vsomeip_test.hpp"

namespace trestle::interop {
namespace {

// --- vsomeip is killed ------------------------------------------------------------------------------------

TEST_F(VsomeipServes, AndIsUsedAgainAfterItWasKilled) {
  covers({"feat_req_someipsd_872", "feat_req_someip_647"});
  const auto udp = subscribe(group_udp, event_udp);
  const auto tcp = subscribe(group_tcp, event_tcp, true);
  ASSERT_TRUE(run_until([&] { return node->subscribed(udp) && node->subscribed(tcp); }));
  peer->kill();
  start_peer("service");
  EXPECT_TRUE(run_until([&] { return node->discovery_counters().reboots_detected == 1; }));
  // Whether we still believe in the old subscriptions does not matter: events have to come.
  for (const std::uint16_t event : {event_udp, event_tcp}) {
    events.clear();
    EXPECT_TRUE(run_until([&] {
      if (!node->available(required).empty()) {
        emit_event(event, 10);
      }
      static_cast<void>(run_until([&] { return !events.empty(); }, 200ms));
      return !events.empty();
    })) << event;
  }
  EXPECT_EQ(call(echo, Transport::tcp, {1}).payload, to_bytes({1}));
}

TEST_F(VsomeipServes, AndIsUsedAgainAfterItWasGoneForLong) {
  covers({"feat_req_someipsd_431"});
  const auto udp = subscribe(group_udp, event_udp);
  const auto tcp = subscribe(group_tcp, event_tcp, true);
  ASSERT_TRUE(run_until([&] { return node->subscribed(udp) && node->subscribed(tcp); }));
  peer->kill();
  ASSERT_TRUE(run_until([&] { return node->available(required).empty(); })) << "its TTL has run out";
  EXPECT_FALSE(node->subscribed(udp) || node->subscribed(tcp));
  start_peer("service");
  ASSERT_TRUE(run_until([&] { return node->subscribed(udp) && node->subscribed(tcp); }));
  for (const std::uint16_t event : {event_udp, event_tcp}) {
    events.clear();
    emit_event(event, 10);
    EXPECT_TRUE(run_until([&] { return !events.empty(); })) << event;
  }
  EXPECT_EQ(call(echo, Transport::tcp, {1}).payload, to_bytes({1}));
}

class VsomeipUsesAgain : public VsomeipUses {
 protected:
  /// vsomeip, which has been started again, subscribes, and gets what we send.
  void subscribe_again() {
    ASSERT_TRUE(prints("available"));
    for (const Events& events : {over_udp, over_tcp}) {
      tell_to_subscribe(events.group, events.event, events.how);
      ASSERT_TRUE(prints("acknowledged " + std::to_string(events.group) + " 0 "));
      EXPECT_TRUE(run_until([&] {
        notify(events.event, 12);
        return run_until([&] { return peer->count(event(events.event, 12)) > 0; }, 300ms);
      }));
      EXPECT_EQ(node->subscribers(offer, MethodId{events.event}), 1U) << "but not who was killed";
    }
    peer->tell("call 1 tcp 7");
    EXPECT_TRUE(prints(answer(echo, 0, 7)));
  }
};

TEST_F(VsomeipUsesAgain, AfterItWasKilled) {
  covers({"feat_req_someipsd_872"});
  subscribe(group_udp, event_udp, "udp event");
  subscribe(group_tcp, event_tcp, "tcp event");
  peer->kill();
  start_peer("client");
  subscribe_again();
}

TEST_F(VsomeipUsesAgain, AfterItWasGoneForLong) {
  covers({"feat_req_someipsd_431"});
  subscribe(group_udp, event_udp, "udp event");
  subscribe(group_tcp, event_tcp, "tcp event");
  peer->kill();
  ASSERT_TRUE(run_until([&] {
    return node->subscribers(offer, MethodId{event_udp}) + node->subscribers(offer, MethodId{event_tcp}) == 0;
  })) << "the TTL of its subscriptions has run out";
  start_peer("client");
  subscribe_again();
}

// --- Trestle is killed ------------------------------------------------------------------------------------

class VsomeipAndOurProcess : public VsomeipTest {
 protected:
  /// Our service, over "udp" or "both".
  void start_server(const std::string& transports) {
    start_node_process();
    node_process->tell("offer 0x4711 1 " + transports);
  }
  /// Sends an event of our service until vsomeip has got it.
  void expect_event_at_peer(std::uint16_t id, std::size_t size) {
    const auto bytes = pattern(size);
    EXPECT_TRUE(run_until([&] {
      node_process->tell("notify " + std::to_string(id) + " " +
                         test::to_hex(std::as_bytes(std::span{bytes})));
      return run_until([&] { return peer->count(event(id, size)) > 0; }, 300ms);
    })) << id;
  }
  void peer_subscribes(std::uint16_t group, std::uint16_t id, const std::string& transport) {
    peer->tell("subscribe " + std::to_string(group) + " " + std::to_string(id) + " " + transport + " event");
    expect_event_at_peer(id, 20);
  }

  /// Starts our client, and waits until vsomeip has its subscriptions.
  void start_client() {
    const std::size_t before_udp = peer->count("subscribed 1");
    const std::size_t before_tcp = peer->count("subscribed 2");
    start_node_process();
    node_process->tell("require 0x4711 1 1");
    node_process->tell("subscribe 0x4711 1 1 1 0x8001 udp");
    node_process->tell("subscribe 0x4711 1 1 2 0x8002 tcp");
    ASSERT_TRUE(prints("subscribed 1", before_udp + 1));
    ASSERT_TRUE(prints("subscribed 2", before_tcp + 1));
    ASSERT_TRUE(run_until([&] { return node_process->count("available") == 1; }));
    node_process->tell("call 1 tcp cafe");
    EXPECT_TRUE(run_until([&] { return node_process->count("response 0001 cafe") == 1; }));
    // Each event comes once, whatever was subscribed before.
    node_process->tell("call 4 udp 800100000003");
    node_process->tell("call 4 udp 800200000003");
    EXPECT_TRUE(run_until(
        [&] { return node_process->count("event 8001") == 1 && node_process->count("event 8002") == 1; }));
    EXPECT_FALSE(run_until(
        [&] { return node_process->count("event 8001") > 1 || node_process->count("event 8002") > 1; },
        100ms));
  }
};

TEST_F(VsomeipAndOurProcess, OurServerIsUsedAgainAfterItWasKilled) {
  covers({"feat_req_someipsd_764"});
  start_server("both");
  start_peer("client");
  ASSERT_TRUE(prints("available"));
  peer_subscribes(group_udp, event_udp, "udp");
  peer_subscribes(group_tcp, event_tcp, "tcp");
  node_process->kill();
  start_server("both");
  expect_event_at_peer(event_udp, 21);
  expect_event_at_peer(event_tcp, 21);
  for (const std::string transport : {"udp", "tcp"}) {
    peer->tell("call 1 " + transport + " 700");
  }
  EXPECT_TRUE(prints(answer(echo, 0, 700), 2));
}

// vsomeip takes a server for gone at once when its TCP connection breaks, so there is none. [docs/interop.md]
TEST_F(VsomeipAndOurProcess, OurServerIsUsedAgainAfterItWasGoneForLong) {
  start_server("udp");
  start_peer("client");
  ASSERT_TRUE(prints("available"));
  peer_subscribes(group_udp, event_udp, "udp");
  const auto begin = std::chrono::steady_clock::now();
  node_process->kill();
  EXPECT_TRUE(!run_until([&] { return peer->count("gone") > 0; }, 1s) ||
              std::chrono::steady_clock::now() - begin >= 2s)
      << "it has offered a second ago at the most";
  ASSERT_TRUE(prints("gone")) << "our TTL has run out";
  start_server("udp");
  ASSERT_TRUE(prints("available", 2));
  expect_event_at_peer(event_udp, 21);
  peer->tell("call 1 udp 700");
  EXPECT_TRUE(prints(answer(echo, 0, 700)));
}

TEST_F(VsomeipAndOurProcess, OurClientIsServedAgainAfterItWasKilled) {
  covers({"feat_req_someipsd_764"});
  start_peer("service");
  start_client();
  node_process->kill();
  start_client();
}

TEST_F(VsomeipAndOurProcess, OurClientIsServedAgainAfterItWasGoneForLong) {
  start_peer("service");
  start_client();
  node_process->kill();
  ASSERT_TRUE(prints("unsubscribed 1")) << "our TTL has run out";
  ASSERT_TRUE(prints("unsubscribed 2"));
  start_client();
}

}  // namespace
}  // namespace trestle::interop
