// What a route's `qos` asks for is what its reader and its writer have, seen from the other end of DDS.
#include <gtest/gtest.h>

#include "test/bridge/end_to_end/bridge_test.hpp"

namespace trestle::test::route_qos_test {
namespace {

class RouteQos : public BridgeTest {
 protected:
  void start(const char* direction, const std::string& qos) {
    start_bridge(
        "routes:\n  - {topic: /text, type: std_msgs/msg/String, service: 0x1234, instance: 1, "
        "eventgroup: 1, event: 0x8001, direction: " +
        std::string{direction} + ", qos: {" + qos + "}}\n");
  }
  bool comes(const char* counter) {
    return until([&] { return bridge_->counter("route /text", counter) > 0; });
  }
  /// Writes until the route has a sample: its reader may know the writer later than the writer knows it.
  bool arrives(dds::Writer& from) {
    return until([&] {
      static_cast<void>(from.write(hello_cdr));
      return bridge_->counter("route /text", "received") > 0;
    });
  }
};

TEST_F(RouteQos, NoticesAPublisherThatMissesItsDeadline) {
  start("dds_to_someip, port: 40001", "deadline: 200 ms");
  dds::Writer late = writer("/text", string_type, {.deadline = 100ms});
  ASSERT_TRUE(arrives(late));
  EXPECT_TRUE(comes("dds_deadlines_missed"));
  // One that promises less than the route asks for does not go with it.
  const dds::Writer slow = writer("/text", string_type, {.deadline = 300ms});
  EXPECT_TRUE(comes("dds_incompatible_qos"));
  EXPECT_EQ(slow.matched(), 0U);
}

TEST_F(RouteQos, NoticesAPublisherThatDoesNotShowItself) {
  start("dds_to_someip, port: 40001", "liveliness: manual_by_topic, liveliness_lease: 300 ms");
  dds::Writer silent = writer("/text", string_type, {.manual_liveliness = true, .liveliness_lease = 200ms});
  ASSERT_TRUE(arrives(silent));
  EXPECT_TRUE(comes("dds_liveliness_lost"));
  const dds::Writer automatic = writer("/text", string_type, {.liveliness_lease = 200ms});
  EXPECT_TRUE(comes("dds_incompatible_qos"));
  EXPECT_EQ(automatic.matched(), 0U);
}

TEST_F(RouteQos, IsPromisedToSubscribers) {
  start("someip_to_dds", "deadline: 200 ms, liveliness_lease: 300 ms");
  Inbox<Bytes> inbox;
  const dds::Reader content =
      reader("/text", string_type, inbox, {.deadline = 200ms, .liveliness_lease = 300ms});
  ASSERT_TRUE(until([&] { return content.matched() == 1; }));
  std::uint64_t refused = 0;
  for (const dds::Qos& more : {dds::Qos{.deadline = 100ms}, dds::Qos{.liveliness_lease = 200ms}}) {
    const dds::Reader demanding = reader("/text", string_type, inbox, more);
    EXPECT_TRUE(until_counter("route /text", "dds_incompatible_qos", ++refused));
    EXPECT_EQ(demanding.matched(), 0U);
  }
  // The promise is not kept by a SOME/IP service that says something once.
  sd::Node node{io_, peer_config()};
  constexpr someip::MethodId event{0x8001};
  const sd::Offer offer{node,
                        {.service = someip::ServiceId{0x1234},
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = someip::EventgroupId{1}, .events = {event}}}}};
  ASSERT_TRUE(until([&] { return node.subscribers(offer.handle(), event) == 1; }));
  offer.notify(event, hello);
  EXPECT_TRUE(comes("dds_deadlines_missed"));
  EXPECT_EQ(inbox.size(), 1U);
}

}  // namespace
}  // namespace trestle::test::route_qos_test
