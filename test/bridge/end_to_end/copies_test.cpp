// How often a payload is copied in user space on its way, counted: every memcpy and memmove of this program
// and of the libraries that it uses, and those of ours that swap bytes. docs/performance.md tells the
// numbers.
#include "test/copies.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "dds_adapter/ros_names.hpp"
#include "sd/net/proxy.hpp"
#include "test/bridge/end_to_end/samples.hpp"
#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::test::copies_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;

using namespace std::chrono_literals;

constexpr std::size_t messages = 5;

const auto transport_name = [](const auto& over) {
  return std::string{over.param == Transport::tcp ? "Tcp" : "Udp"};
};

// The whole copies of one payload: ours that were made of most, and the fewest of others, as Fast DDS sends
// again what is not confirmed in time, on a busy machine most.
Copies of_most(const std::vector<Copies>& counts, std::size_t bytes) {
  std::vector<std::size_t> ours;
  std::vector<std::size_t> others;
  for (std::size_t i = 1; i < counts.size(); ++i) {
    ours.push_back(times(counts[i].ours - counts[i - 1].ours, bytes));
    others.push_back(times(counts[i].others - counts[i - 1].others, bytes));
  }
  std::ranges::sort(ours);
  std::ranges::sort(others);
  return {ours[ours.size() / 2], others.front()};
}

class DdsCopies : public TwoBridges {
 protected:
  // What it takes to carry a cloud from a writer at `from` to a reader at `to`.
  Copies carry(dds::Participant& from, dds::Participant& to, const TestRoute& route, const Sample& probe,
               const Sample& large) {
    const dds::Qos qos{.reliable = true, .transient_local = latched_, .depth = 10};
    const std::string topic = dds::ros_topic_name(route.topic);
    const std::string type = dds::ros_type_name(route.type);
    dds::Writer writer = from.create_writer(topic, type, qos);
    Inbox<bool> probes;
    Inbox<bool> arrived;
    const dds::Reader reader = to.create_reader(topic, type, qos, [&](const dds::Sample& sample) {
      constexpr std::size_t front = 32;  // in which their numbers are
      const bool is_large = std::ranges::equal(sample.cdr().first(front), ByteView{large}.first(front));
      (is_large ? arrived : probes).put(true);
    });
    EXPECT_TRUE(eventually([&] {
      static_cast<void>(writer.write(probe));
      usleep(50'000);
      return probes.size() > 0;
    }));
    // Behind it no probe is under way.
    EXPECT_TRUE(writer.write(large));
    EXPECT_TRUE(arrived.wait_for_count(1));
    static_cast<void>(arrived.take());

    std::vector<Copies> counts{copies()};
    for (std::size_t i = 1; i <= messages; ++i) {
      EXPECT_TRUE(writer.write(large));
      EXPECT_TRUE(arrived.wait_for_count(i));
      counts.push_back(copies());
    }
    return of_most(counts, large.size());
  }

  /// @param more  copies on the way, beside those that every route needs.
  void carry_through_two_bridges(const TestRoute& route, const Sample& probe, const Sample& large,
                                 std::size_t more = 0) {
    dds::Participant other_at_a = participant(domain_.id());
    const Copies hop = carry(at_a_, other_at_a, route, probe, large);
    EXPECT_EQ(hop.ours, 1U) << "the writer copies what it is given into the memory of DDS";
    EXPECT_GE(hop.others, 1U) << "Fast DDS is not seen at all";
    EXPECT_LE(hop.others, 3U);

    start({route});
    const Copies path = carry(at_a_, at_b_, route, probe, large);
    // The writer of the test, as above; from DDS to SOME/IP none; from SOME/IP to DDS two: the segments are
    // put together, and the writer of the bridge copies that into the memory of DDS.
    EXPECT_EQ(path.ours, 3U + more);
    EXPECT_EQ(path.others, 2 * hop.others) << "Fast DDS has two hops to do, and no more";
    RecordProperty("copies_by_fast_dds_in_a_hop", std::to_string(hop.others));
  }

  bool latched_ = false;
};

TEST_F(DdsCopies, OfAPointCloudAreThreeOfOursThroughTwoBridges) {
  carry_through_two_bridges({.topic = "/cloud", .type = "sensor_msgs/msg/PointCloud2"}, point_cloud(1, 10),
                            point_cloud(2, 60'000));
}

// Small enough to be sent by the thread that writes it.
TEST_F(DdsCopies, OfASmallPointCloudAreThreeOfOursThroughTwoBridges) {
  carry_through_two_bridges({.topic = "/cloud", .type = "sensor_msgs/msg/PointCloud2"}, point_cloud(1, 10),
                            point_cloud(2, 2'500));
}

TEST_F(DdsCopies, OfAnImageAreThreeOfOursThroughTwoBridges) {
  carry_through_two_bridges({.topic = "/image", .type = "sensor_msgs/msg/Image"}, image(1), image(2));
}

// SOME/IP has them big endian.
TEST_F(DdsCopies, OfNumbersThatAreSwappedAreOneMoreEachWay) {
  carry_through_two_bridges({.topic = "/floats", .type = "std_msgs/msg/Float32MultiArray"}, floats(1, 10),
                            floats(2, 250'000), 2);
}

// The field keeps its value for those who come later.
TEST_F(DdsCopies, OfALatchedTopicAreOneMore) {
  latched_ = true;
  carry_through_two_bridges({.topic = "/latched_image",
                             .type = "sensor_msgs/msg/Image",
                             .settings = "    qos: {durability: transient_local}\n"},
                            image(1), image(2), 1);
}

// What protects it goes in front of the payload, or into it.
TEST_F(DdsCopies, OfAProtectedTopicAreOneMore) {
  carry_through_two_bridges({.topic = "/protected_image",
                             .type = "sensor_msgs/msg/Image",
                             .settings = "    e2e: {profile: 7, data_id: 0x0100002d}\n"},
                            image(1), image(2), 1);
}

class SomeIpCopies : public TwoNodes, public testing::WithParamInterface<Transport> {
 protected:
  const ServiceId service{0x1234};
  const MethodId event{0x8001};
  const MethodId method{0x0001};
  const MethodId sink{0x0002};
  const EventgroupId group{1};
  const std::shared_ptr<const std::vector<std::byte>> payload =
      std::make_shared<const std::vector<std::byte>>(numbers(1'000'000));
  const ByteView bytes{*payload};
  std::size_t came = 0;  // of the last request, to the sink

  sd::Node server{io, quick(server_address)};
  sd::Node client{io, quick(client_address)};
  // Answers a request of any payload with the large one.
  const sd::OfferHandle
      offer = server.offer({.service = service,
                            .instance = InstanceId{1},
                            .udp_port = is_tcp() ? std::nullopt : std::optional<std::uint16_t>{0},
                            .tcp_port = is_tcp() ? std::optional<std::uint16_t>{0} : std::nullopt,
                            .methods = {{method,
                                         [this](const someip::Message&, sd::Responder responder) {
                                           EXPECT_TRUE(responder.respond({&bytes, 1}, payload));
                                         }},
                                        {sink,
                                         [this](const someip::Message& request, sd::Responder responder) {
                                           came = request.payload.size();
                                           EXPECT_TRUE(responder.respond());
                                         }}},
                            .eventgroups = {{.id = group, .events = {event}}}});

  [[nodiscard]] static bool is_tcp() { return GetParam() == Transport::tcp; }

  /// Segments come from the socket in trains and go to their places; of TCP's stream the system puts the
  /// payload there.
  [[nodiscard]] static std::size_t expected() { return is_tcp() ? 0 : 1; }

  // What each takes of the payload; one goes ahead, for which memory is made.
  template <typename Transfer>
  Copies of_each(const Transfer& transfer) {
    return of_each(transfer, payload->size());
  }
  template <typename Transfer>
  Copies of_each(const Transfer& transfer, std::size_t size) {
    transfer();
    std::vector<Copies> counts{copies()};
    for (std::size_t i = 0; i < messages; ++i) {
      transfer();
      counts.push_back(copies());
    }
    return of_most(counts, size);
  }

  void request(sd::RequirementId required, ByteView what, const sd::CallSpec& spec) {
    bool done = false;
    client.call(required, spec, {&what, 1}, [&](const sd::CallResult& result) {
      EXPECT_TRUE(result);
      done = true;
    });
    ASSERT_TRUE(run_until([&] { return done; }));
    EXPECT_EQ(came, what.size());
  }
};

// Together with the above: all of them are made by the receiver.
TEST_P(SomeIpCopies, OfAnEventAreOneByTheReceiverAtMost) {
  std::size_t arrived = 0;
  client.subscribe(
      {.service = service, .eventgroup = group, .events = {event}, .udp = !is_tcp(), .tcp = is_tcp()},
      [&](const someip::Message&, const Endpoint&) { ++arrived; });
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer, event) == 1; }));
  const Copies seen = of_each([&] {
    const std::size_t before = arrived;
    EXPECT_EQ(server.notify(offer, event, {&bytes, 1}, payload).subscribers, 1U);
    ASSERT_TRUE(run_until([&] { return arrived > before; }));
  });
  EXPECT_EQ(seen.ours, expected());
  EXPECT_EQ(seen.others, 0U);
}

TEST_P(SomeIpCopies, OfAnAnswerAreOneByTheReceiverAtMost) {
  const sd::RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  const Copies seen = of_each([&] {
    std::size_t size = 0;
    client.call(required, {.method = method}, {},
                [&](const sd::CallResult& result) { size = result ? result->payload.size() : 1; });
    ASSERT_TRUE(run_until([&] { return size != 0; }));
    EXPECT_EQ(size, bytes.size());
  });
  EXPECT_EQ(seen.ours, expected());
  EXPECT_EQ(seen.others, 0U);
}

// Its response owns the payload.
TEST_P(SomeIpCopies, OfAnAnswerToAProxyAreOneMore) {
  sd::Proxy proxy{client, {.service = service}};
  const Copies seen = of_each([&] {
    std::size_t size = 0;
    proxy.call({.method = method}, {},
               [&](const boost::system::error_code& error, const sd::Response& response) {
                 size = error ? 1 : response.payload.size();
               });
    ASSERT_TRUE(run_until([&] { return size != 0; }));
    EXPECT_EQ(size, bytes.size());
  });
  EXPECT_EQ(seen.ours, expected() + 1);
  EXPECT_EQ(seen.others, 0U);
}

// The client may not keep what it is given, but it leaves at once.
TEST_P(SomeIpCopies, OfARequestThatABurstTakesAreOneByTheReceiverAtMost) {
  const sd::RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  const ByteView what = bytes.first(20'000);
  const Copies seen = of_each(
      [&] {
        run_for(1ms);  // a burst of its own
        request(required, what, {.method = sink});
      },
      what.size());
  EXPECT_EQ(seen.ours, expected());
  EXPECT_EQ(seen.others, 0U);
}

// Over UDP the half of it leaves at once, the other half has to wait and is copied.
TEST_P(SomeIpCopies, OfARequestAreOneByTheReceiverAndOneByTheSenderOfWhatWaits) {
  const sd::RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  ASSERT_TRUE(run_until([&] { return !client.available(required).empty(); }));
  const someip::TpPacing pacing{.burst = 360, .separation = 1ms};  // of 719 segments
  const Copies halves = of_each(
      [&] {
        run_for(2ms);
        request(required, bytes, {.method = sink, .pacing = pacing});
      },
      bytes.size() / 2);
  EXPECT_EQ(halves.ours, is_tcp() ? 0 : 2 + 1);
  EXPECT_EQ(halves.others, 0U);
}

INSTANTIATE_TEST_SUITE_P(Over, SomeIpCopies, testing::Values(Transport::udp, Transport::tcp), transport_name);

/// Calls through a bridge, with a request or an answer that is large.
class MethodCopies : public ServicesEndToEnd, public testing::WithParamInterface<Transport> {
 protected:
  static constexpr std::size_t bytes = 1'000'000;
  const ServiceId service{0x1234};
  const MethodId method{0x0021};

  MethodCopies() {
    spdlog::set_level(spdlog::level::warn);
    std::filesystem::create_directories(folder_ + "/test_msgs/srv");
    std::ofstream{folder_ + "/test_msgs/srv/Blob.srv"} << "uint8[] data\n---\nuint8[] data\n";
  }
  ~MethodCopies() override { std::filesystem::remove_all(folder_); }

  void start(const std::string& server) {
    start_bridge("types: {paths: [" + folder_ +
                 "]}\n"
                 "methods:\n  - {ros_service: /blob, type: test_msgs/srv/Blob, service: 0x1234, instance: 1, "
                 "method: 0x21, server: " +
                 server + ", transport: " + (is_tcp() ? "tcp" : "udp") + "}\n");
  }

  [[nodiscard]] static bool is_tcp() { return GetParam() == Transport::tcp; }
  /// By the receiver of SOME/IP.
  [[nodiscard]] static std::size_t received() { return is_tcp() ? 0 : 1; }
  /// Of an array of that many bytes.
  static Bytes cdr(std::size_t size) { return message(hex("00010000"), size, std::endian::little); }
  static Bytes payload(std::size_t size) { return message({}, size, std::endian::big); }

  // What each takes, of calls that begin with `call` and end with an answer.
  template <typename Call>
  std::size_t of_each(const Call& call) {
    std::size_t answered = 0;
    std::vector<Copies> counts;
    for (std::size_t i = 0; i <= messages; ++i) {  // one goes ahead, for which memory is made
      call(answered);
      EXPECT_TRUE(until([&] { return answered == i + 1; }));
      counts.push_back(copies());
    }
    return of_most(counts, bytes).ours;
  }
  void call_method(sd::Proxy& proxy, Bytes request, std::size_t& answered) {
    proxy.call({.method = method, .timeout = patience}, std::move(request),
               [&answered](boost::system::error_code error, const sd::Response& response) {
                 EXPECT_FALSE(error);
                 answered += response.payload.size() > 4 ? 1 : 0;
               });
  }
  static void call_ros(dds::ServiceClient& client, const Bytes& request, std::size_t& answered) {
    const ByteView whole = request;
    client.call({&whole, 1}, patience, std::chrono::steady_clock::now(),
                [&answered](const tl::expected<dds::ServiceMessage, dds::CallFault>& reply) {
                  answered += reply.value().cdr().size() > 8 ? 1 : 0;
                });
  }

 private:
  static Bytes message(Bytes front, std::size_t size, std::endian order) {
    const std::size_t begin = front.size();
    front.resize(begin + 4 + size);
    someip::store(&front[begin], static_cast<std::uint32_t>(size), order);
    return front;
  }

  std::string folder_ = testing::TempDir() + "copies_test_" + std::to_string(getpid());
};

TEST_P(MethodCopies, OfARequestToARosServiceAreTwoByTheBridgeAtMost) {
  start("ros, port: 40001");
  std::size_t came = 0;
  const Bytes small = cdr(1);
  answering(ros("/blob", "test_msgs/srv/Blob"), [&](const dds::ServiceMessage& request) {
    came = request.cdr().size();
    return small;
  });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  const Bytes large = payload(bytes);
  const std::size_t ours =
      of_each([&](std::size_t& answered) { call_method(proxy, Bytes{large}, answered); });
  EXPECT_GT(came, bytes);
  // By the test, for the call; by the bridge, as it receives, and into the memory of DDS.
  EXPECT_EQ(ours, 1 + received() + 1);
}

TEST_P(MethodCopies, OfAnAnswerOfARosServiceAreNoneByTheBridge) {
  start("ros, port: 40001");
  const Bytes large = cdr(bytes);
  dds::ServiceServer* server = nullptr;
  server = &driver_.server(ros_, ros("/blob", "test_msgs/srv/Blob"),
                           [&](const dds::RequestId& id, const dds::ServiceMessage&) {
                             const ByteView whole = large;
                             server->reply(id, {&whole, 1}, std::chrono::steady_clock::now());
                           });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  const std::size_t ours = of_each([&](std::size_t& answered) { call_method(proxy, payload(1), answered); });
  // By the writer of the test, by its node as that receives, and by its Proxy.
  EXPECT_EQ(ours, 1 + received() + 1);
}

TEST_P(MethodCopies, OfARequestOfARosClientAreOneByTheBridge) {
  start("someip");
  sd::Node node{io_, node_config()};
  std::size_t came = 0;
  const Bytes small = payload(1);
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = InstanceId{1},
                         .tcp_port = 0,
                         .methods = {{method, [&](const someip::Message& request, sd::Responder responder) {
                                        came = request.payload.size();
                                        const ByteView whole = small;
                                        EXPECT_TRUE(responder.respond({&whole, 1}));
                                      }}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/blob", "test_msgs/srv/Blob"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  const Bytes large = cdr(bytes);
  const std::size_t ours = of_each([&](std::size_t& answered) { call_ros(client, large, answered); });
  EXPECT_GT(came, bytes);
  // By the writer of the test; by the bridge, as the Proxy keeps requests; by the node of the test.
  EXPECT_EQ(ours, 1 + 1 + received());
}

TEST_P(MethodCopies, OfAnAnswerToARosClientAreThreeByTheBridgeAtMost) {
  start("someip");
  sd::Node node{io_, node_config()};
  const auto large = std::make_shared<const Bytes>(payload(bytes));
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = InstanceId{1},
                         .tcp_port = 0,
                         .methods = {{method, [&](const someip::Message&, sd::Responder responder) {
                                        const ByteView whole = *large;
                                        EXPECT_TRUE(responder.respond({&whole, 1}, large));
                                      }}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/blob", "test_msgs/srv/Blob"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  const std::size_t ours = of_each([&](std::size_t& answered) { call_ros(client, cdr(1), answered); });
  // By the bridge, as it receives, by its Proxy, and into the memory of DDS.
  EXPECT_EQ(ours, received() + 1 + 1);
}

INSTANTIATE_TEST_SUITE_P(Over, MethodCopies, testing::Values(Transport::udp, Transport::tcp), transport_name);

}  // namespace
}  // namespace trestle::test::copies_test
