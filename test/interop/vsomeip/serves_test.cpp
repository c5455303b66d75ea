// Trestle uses the methods, events and fields of vsomeip.
#include "test/interop/vsomeip/vsomeip_test.hpp"

namespace trestle::interop {
namespace {

TEST_F(VsomeipServes, MethodsOverUdpAndTcp) {
  covers({"feat_req_someip_329", "feat_req_someip_338", "feat_req_someip_585"});
  for (const std::size_t size : {0U, 1U, 100U, 1400U}) {
    EXPECT_EQ(call(echo, Transport::udp, pattern(size)).payload, to_bytes(pattern(size))) << size;
  }
  for (const std::size_t size : {0U, 1U, 1400U, 100'000U, 1U << 20U}) {
    EXPECT_EQ(call(echo, Transport::tcp, pattern(size)).payload, to_bytes(pattern(size))) << size;
  }
}

TEST_F(VsomeipServes, LargeRequestsAndResponsesInSegments) {
  covers({"feat_req_someiptp_760", "feat_req_someiptp_762"});
  for (const std::size_t size : {1401U, 20'000U, 1U << 20U}) {
    EXPECT_EQ(call(echo, Transport::udp, pattern(size)).payload, to_bytes(pattern(size))) << size;
  }
}

TEST_F(VsomeipServes, Errors) {
  covers({"feat_req_someip_107"});
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    for (const std::uint8_t code : some_errors) {
      const Outcome failed = call(fail, transport, pattern(code));
      EXPECT_EQ(failed.fault, CallFault::error);
      EXPECT_EQ(failed.code, ReturnCode{code});
    }
    // A method that has no handler there: vsomeip may leave it without an answer, and goes on all the same.
    EXPECT_NE(call(0x0999, transport, {}, 300ms).fault, std::nullopt);
    EXPECT_EQ(call(echo, transport, {1}).payload, to_bytes({1}));
  }
}

TEST_F(VsomeipServes, EventsOverUdpInSegmentsToo) {
  const auto subscription = subscribe(group_udp, event_udp);
  ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
  for (const std::uint32_t size : {0U, 32U, 1400U, 5000U, 1U << 20U}) {
    events.clear();
    emit_event(event_udp, size);
    ASSERT_TRUE(run_until([&] { return !events.empty(); })) << size;
    EXPECT_EQ(events[0], to_bytes(pattern(size)));
  }
  // Fire and forget comes back as an event.
  events.clear();
  const auto word = pattern(9);
  const ByteView bytes = std::as_bytes(std::span{word});
  EXPECT_TRUE(node->send(required, {.method = MethodId{tell}}, {&bytes, 1}));
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0], to_bytes(word));
}

TEST_F(VsomeipServes, EventsOverTcp) {
  covers({"feat_req_someipsd_767", "feat_req_someipsd_788"});
  const auto subscription = subscribe(group_tcp, event_tcp, true);
  ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
  for (const std::uint32_t size : {48U, 4000U, 1U << 20U}) {
    events.clear();
    emit_event(event_tcp, size);
    ASSERT_TRUE(run_until([&] { return !events.empty(); })) << size;
    EXPECT_EQ(events[0], to_bytes(pattern(size)));
  }
}

TEST_F(VsomeipServes, EventsByMulticast) {
  covers({"feat_req_someipsd_791", "feat_req_someip_814"});
  const auto subscription = subscribe(group_multicast, event_multicast);
  ASSERT_TRUE(
      run_until([&] { return log.find("multicast events come at 224.225.226.233:32344") != log.npos; }));
  EXPECT_TRUE(node->subscribed(subscription));
  emit_event(event_multicast, 77);
  ASSERT_TRUE(run_until([&] { return !events.empty(); }));
  EXPECT_EQ(events[0], to_bytes(pattern(77)));
}

TEST_F(VsomeipServes, Fields) {
  covers({"feat_req_someip_633", "feat_req_someip_634", "feat_req_someip_635"});
  subscribe(group_field, notifier);
  // It comes twice when the subscription meets the first value inside vsomeip.  [docs/interop.md]
  ASSERT_TRUE(run_until([&] { return !events.empty(); })) << "the initial event";
  EXPECT_THAT(events, ::testing::Each(to_bytes({0x2a})));
  EXPECT_EQ(call(getter, Transport::udp, {}).payload, to_bytes({0x2a}));
  EXPECT_EQ(call(setter, Transport::tcp, {0x2b}).payload, to_bytes({0x2b}));
  EXPECT_TRUE(run_until([&] { return events.back() == to_bytes({0x2b}); }));
}

}  // namespace
}  // namespace trestle::interop
