// Trestle and vsomeip on IPv6.
#include "test/interop/vsomeip/vsomeip_test.hpp"

namespace trestle::interop {
namespace {

class VsomeipServesOnIpv6 : public VsomeipServes {
 protected:
  VsomeipServesOnIpv6() { v6 = true; }
};

TEST_F(VsomeipServesOnIpv6, MethodsAndEvents) {
  covers({"feat_req_someipsd_852"});
  for (const std::size_t size : {3U, 20'000U}) {
    EXPECT_EQ(call(echo, Transport::udp, pattern(size)).payload, to_bytes(pattern(size))) << size;
    EXPECT_EQ(call(echo, Transport::tcp, pattern(size)).payload, to_bytes(pattern(size))) << size;
  }
  for (const Events& one : {over_udp, over_tcp, by_multicast}) {
    const auto subscription = subscribe(one.group, one.event, one.group == group_tcp);
    ASSERT_TRUE(run_until([&] { return node->subscribed(subscription); }));
    events.clear();
    emit_event(one.event, 40);
    ASSERT_TRUE(run_until([&] { return !events.empty(); })) << one.event;
    EXPECT_EQ(events[0], to_bytes(pattern(40)));
  }
}

class VsomeipUsesOnIpv6 : public VsomeipUses {
 protected:
  VsomeipUsesOnIpv6() { v6 = true; }
};

TEST_F(VsomeipUsesOnIpv6, MethodsAndEvents) {
  covers({"feat_req_someipsd_852"});
  for (const std::size_t size : {3U, 20'000U}) {
    peer->tell("call 1 udp " + std::to_string(size));
    peer->tell("call 1 tcp " + std::to_string(size));
    EXPECT_TRUE(prints(answer(echo, 0, size), 2)) << size;
  }
  for (const Events& events : {over_udp, over_tcp, by_multicast}) {
    subscribe(events.group, events.event, events.how);
    // It opens a multicast group some time after it has been told of it.
    EXPECT_TRUE(run_until([&] {
      notify(events.event, 40);
      return run_until([&] { return peer->count(event(events.event, 40)) > 0; }, 200ms);
    })) << events.event;
  }
}

}  // namespace
}  // namespace trestle::interop
