// Topics and services of Cyclone DDS through a bridge, with a SOME/IP Node on the other side.
#include "test/dds_adapter/cyclone_peer.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <optional>

#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/dds_adapter/cyclone_service_peer.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::cyclone_test {
namespace {

using someip::MethodId;
using someip::ServiceId;
using Role = CycloneServicePeer::Role;

constexpr ServiceId service{0x1234};
constexpr MethodId event{0x8001};
constexpr MethodId method{0x0021};
constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 8};

class CycloneThroughBridge : public ServicesEndToEnd {
 protected:
  void start(const std::string& lists) {
    start_bridge("types: {paths: [" + test::source_dir() + "/test/dds_adapter]}\n" + lists);
  }
  void start_route(const std::string& keys) {
    start(
        "routes:\n  - {topic: /blobs, type: test_msgs/msg/Blob, service: 0x1234, instance: 1, eventgroup: 1, "
        "event: 0x8001, " +
        keys + "}\n");
  }
  /// `ros_form` is left out: whose form it is, the bridge finds out.
  void start_method(const std::string& keys) {
    start(
        "methods:\n  - {ros_service: /add, type: test_msgs/srv/Add, service: 0x1234, instance: 1, method: "
        "0x21, " +
        keys + "}\n");
  }
  /// A blob of 100 000 bytes, and the same as a payload.
  static Blob large() { return {7, "abc", make_sample(100'000, 7)}; }
  static std::string payload_of_large() {
    return "00000007 00000007 efbbbf 61626300 000186a0" + to_hex(large().data);
  }
  static std::string plain(const std::string& text) { return to_hex(hex(text)); }
  /// As payloads: a and b, or a sum.
  static Bytes numbers_payload(std::initializer_list<std::uint64_t> values) {
    Bytes bytes;
    for (const std::uint64_t value : values) {
      for (unsigned shift = 64; shift > 0; shift -= 8) {
        bytes.push_back(static_cast<std::byte>(value >> (shift - 8)));
      }
    }
    return bytes;
  }
  /// Answers what Cyclone's server has been asked.
  static void serve(CycloneServicePeer& server) {
    while (const auto request = server.take()) {
      server.send({.client = request->client, .number = request->number, .a = request->a + request->b});
    }
  }
};

TEST_F(CycloneThroughBridge, WhatItPublishesIsAnEvent) {
  start_route(
      "direction: dds_to_someip, port: 40001, qos: {durability: transient_local, depth: 8}, offer: "
      "while_published");
  sd::Node node{io_, node_config()};
  std::vector<std::string> came;
  const sd::Subscription subscription{
      node,
      {.service = service, .eventgroup = someip::EventgroupId{1}, .events = {event}},
      [&](const someip::Message& message, const Endpoint&) { came.push_back(to_hex(message.payload)); }};
  CyclonePeer peer{domain_.id()};
  peer.open_writer(latched);
  ASSERT_TRUE(until([&] { return peer.readers_matched() == 1 && subscription.active(); }));
  peer.write({42, "abc", hex("010203")});
  ASSERT_TRUE(until([&] { return came.size() == 1; }));
  EXPECT_EQ(came[0], plain("0000002a 00000007 efbbbf 61626300 00000003 010203"));
  peer.write(large());
  ASSERT_TRUE(until([&] { return came.size() == 2; }));
  EXPECT_TRUE(came[1] == plain(payload_of_large()));
  EXPECT_EQ(bridge_->counter("route /blobs", "received"), 2U);
}

TEST_F(CycloneThroughBridge, ReadsEvents) {
  start_route("direction: someip_to_dds, qos: {durability: transient_local, depth: 8}");
  sd::Node node{io_, node_config()};
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = someip::EventgroupId{1}, .events = {event}}}}};
  CyclonePeer peer{domain_.id()};
  peer.open_reader(latched);
  ASSERT_TRUE(until(
      [&] { return peer.writers_matched() == 1 && bridge_->counter("route /blobs", "subscribed") == 1; }));
  const auto next = [&]() -> std::optional<Blob> {
    std::optional<Blob> blob;
    until([&] {
      blob = peer.take();
      return blob.has_value();
    });
    return blob;
  };
  offer.notify(event, hex("0000002a 00000007 efbbbf 61626300 00000003 010203"));
  EXPECT_EQ(next(), (Blob{42, "abc", hex("010203")}));
  offer.notify(event, hex(payload_of_large()));
  EXPECT_TRUE(next() == large());
}

TEST_F(CycloneThroughBridge, ItsServiceIsAMethod) {
  if (!dds::sees_readers_begin()) {
    GTEST_SKIP() << "Cyclone DDS's readers may miss what this Fast DDS writes first";
  }
  start_method("server: ros, port: 40001");
  sd::Node node{io_, node_config()};
  std::vector<bool> seen;
  sd::Proxy proxy{node, {.service = service}, [&](const sd::RemoteService&, bool available) {
                    seen.push_back(available);
                  }};
  {
    CycloneServicePeer server{domain_.id(), Role::server};
    std::array<std::vector<Answer>, 10> answers;
    for (std::size_t i = 0; i < answers.size(); ++i) {
      call(proxy, method, numbers_payload({i, 1000}), answers[i]);
    }
    ASSERT_TRUE(until([&] {
      serve(server);
      return std::ranges::all_of(answers, [](const auto& one) { return one.size() == 1; });
    }));
    for (std::size_t i = 0; i < answers.size(); ++i) {
      EXPECT_FALSE(answers[i][0].error) << answers[i][0].error.message();
      EXPECT_EQ(answers[i][0].payload, numbers_payload({i + 1000})) << i;
    }
    EXPECT_EQ(bridge_->counter("method of ROS service /add", "answered"), answers.size());
  }
  // It has gone, which Fast DDS takes from Cyclone DDS's lease of 10 s, and the offer with it.
  EXPECT_TRUE(until([&] { return seen == (std::vector{true, false}); }));
}

TEST_F(CycloneThroughBridge, ItsClientCallsAMethodBesideAClientOfTheOtherForm) {
  start_method("server: someip");
  sd::Node node{io_, node_config()};
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .methods = {{method, [](const someip::Message& request, sd::Responder responder) {
                                        // of numbers below 256
                                        const auto low = [&](std::size_t at) {
                                          return std::to_integer<std::uint64_t>(request.payload[at + 7]);
                                        };
                                        responder.respond(request.payload.size() == 16
                                                              ? numbers_payload({low(0) + low(8)})
                                                              : Bytes{});
                                      }}}}};
  dds::ServiceClient& fast = driver_.client(ros_);
  ASSERT_TRUE(until([&] { return fast.ready(); }));
  CycloneServicePeer client{domain_.id(), Role::client};
  ASSERT_TRUE(until([&] { return client.matched(); }));
  std::vector<Sum> sums;
  for (std::int64_t i = 0; i < 10; ++i) {
    client.send({.client = 0xfedc'ba98'7654'3210, .number = i, .a = i, .b = 100});
    ServiceDriver::add(fast, i, 200, sums);
  }
  std::vector<CycloneAdd> replies;
  ASSERT_TRUE(until([&] {
    while (const auto reply = client.take()) {
      if (reply->client == 0xfedc'ba98'7654'3210) {  // the others are the fast client's
        replies.push_back(*reply);
      }
    }
    return replies.size() == 10 && sums.size() == 10;
  }));
  std::ranges::sort(replies, {}, &CycloneAdd::number);
  std::ranges::sort(sums, {}, [](const Sum& sum) { return sum.value_or(-1); });
  for (std::int64_t i = 0; i < 10; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(replies[at], (CycloneAdd{.client = 0xfedc'ba98'7654'3210, .number = i, .a = i + 100}));
    EXPECT_EQ(sums[at], i + 200);
  }
  EXPECT_EQ(bridge_->counter("ROS service of method /add", "answered"), 20U);
}

}  // namespace
}  // namespace trestle::test::cyclone_test
