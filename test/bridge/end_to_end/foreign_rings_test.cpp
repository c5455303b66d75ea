// Rings that somebody else closes, gateways on purpose, and bridges of older versions.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <fstream>

#include "someip/net/address_text.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"
#include "test/bridge/end_to_end/rings.hpp"

namespace trestle::test::rings_test {
namespace {

using testing::HasSubstr;

/// Somebody copies events of one service to another, as a gateway of another maker in a ring.
class ForeignRings : public Rings {
 protected:
  /// In the place of what was offered before, at the same address.
  void offer(int service) {
    subscription_.reset();
    offer_.reset();
    node_.reset();
    node_ = std::make_unique<sd::Node>(io_, node_config());
    sd::ServiceSpec spec{.service = someip::ServiceId{static_cast<std::uint16_t>(service)},
                         .instance = someip::InstanceId{1}};
    spec.udp_port = 0;
    spec.eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8001}}}};
    offer_.emplace(*node_, spec);
  }
  void relay(int from, int to) {
    offer(to);
    subscription_.emplace(
        *node_,
        sd::SubscribeSpec{.service = someip::ServiceId{static_cast<std::uint16_t>(from)},
                          .eventgroup = someip::EventgroupId{1},
                          .events = {someip::MethodId{0x8001}}},
        [this](const someip::Message& event, const Endpoint&) {
          node_->notify(offer_->handle(), someip::MethodId{0x8001}, std::span{&event.payload, 1});
        });
  }
  std::unique_ptr<sd::Node> node_;
  std::optional<sd::Offer> offer_;
  std::optional<sd::Subscription> subscription_;
};

TEST_F(ForeignRings, BringAMessageBackOnce) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1));
  RunningBridge& back = add("routes:\n" + in("/chatter", 2));
  relay(1, 2);
  const auto reader = read("/chatter");
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(until([&] { return subscription_->active(); }));
  ASSERT_TRUE(subscribed(back, "/chatter") && knows(back, "/chatter", 1) && knows(there, "/chatter", 1));
  const std::size_t written = write_until_bridged(writer, there, "/chatter");
  EXPECT_TRUE(counts(there, "route /chatter", "carried", written));
  run_for(a_while);
  EXPECT_LE(seen_.take().size(), 2 * written);
  EXPECT_EQ(there.counter("route /chatter", "carried"), written);
}

/// Something in DDS that is no bridge of ours closes the ring.
TEST_F(ForeignRings, AreKeptFromGoingRoundForLong) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1));
  node_ = std::make_unique<sd::Node>(io_, node_config());
  auto foreign = BridgeTest::writer("/chatter");
  std::uint64_t rounds = 0;
  subscription_.emplace(*node_,
                        sd::SubscribeSpec{.service = someip::ServiceId{1},
                                          .eventgroup = someip::EventgroupId{1},
                                          .events = {someip::MethodId{0x8001}}},
                        [&](const someip::Message&, const Endpoint&) {
                          ++rounds;
                          static_cast<void>(foreign.write(hello_cdr));
                        });
  auto writer = listener_.create_writer(dds::ros_topic_name("/chatter"), dds::ros_type_name(string_type), {});
  ASSERT_TRUE(
      until([&] { return subscription_->active() && foreign.matched() == 1 && writer.matched() == 1; }));
  const Rounds may;
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(until([&] { return there.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  const std::uint64_t before = rounds;
  EXPECT_LE(before, may.before_found(110));
  run_for(a_while);
  EXPECT_EQ(rounds, before);
}

/// Two bridges that carry from one SOME/IP network to another through a DDS domain. (Here it is one network
/// with two services.)
class Gateways : public ForeignRings {
 protected:
  // Of the bridge that is added first.
  const std::string from_first_ = ", from_bridges: [" + someip::to_string(own_address(3)) + "]";

  void notify() {
    const ByteView payload{hello};
    node_->notify(offer_->handle(), someip::MethodId{0x8001}, {&payload, 1});
  }
  void subscribe(int service) {
    subscription_.emplace(*node_,
                          sd::SubscribeSpec{.service = someip::ServiceId{static_cast<std::uint16_t>(service)},
                                            .eventgroup = someip::EventgroupId{1},
                                            .events = {someip::MethodId{0x8001}}},
                          [this](const someip::Message&, const Endpoint&) { ++came_; });
  }
  std::uint64_t came_ = 0;
};

TEST_F(Gateways, CarryWhatTheBridgesBringInThatTheyName) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1, ", subscribe: while_read"));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_ + ", offer: while_published"));
  RunningBridge& third = add("routes:\n" + out("/chatter", 3));
  offer(1);
  subscribe(2);
  ASSERT_TRUE(subscribed(first, "/chatter")) << "the second one reads it";
  ASSERT_TRUE(until([&] { return subscription_->active(); })) << "the second one has a publisher";
  ASSERT_TRUE(knows(third, "/chatter", 2));
  // Some may be written before the first one's writer has found the reader of the third.
  std::uint64_t notified = 0;
  ASSERT_TRUE(until([&] {
    notify();
    ++notified;
    run_for(50ms);
    return third.counter("route /chatter", "dds_from_bridge") > 0;
  }));
  ASSERT_TRUE(until([&] { return came_ == notified; }));
  run_for(a_while);
  EXPECT_EQ(came_, notified);
  EXPECT_EQ(first.counter("route /chatter", "readers"), 1U);
  EXPECT_EQ(second.counter("route /chatter", "dds_from_bridge"), 0U);
  EXPECT_EQ(third.counter("route /chatter", "publishers"), 0U) << "it names none";
  EXPECT_EQ(third.counter("route /chatter", "carried"), 0U);
}

TEST_F(Gateways, CarryLatchedTopicsByPatterns) {
  const std::string file = testing::TempDir() + "trestle-gateways-" + std::to_string(getpid()) + ".lock";
  std::ofstream{file} << "version: 1\ntopics:\n  - {service: 0x6001, topic: /chatter, type: "
                         "std_msgs/msg/String}\n";
  RunningBridge& first =
      add("routes:\n" + in("/chatter", 1, ", qos: {durability: transient_local, depth: 1}"));
  offer(1);
  ASSERT_TRUE(subscribed(first, "/chatter"));
  notify();
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "carried") == 1; }));
  RunningBridge& second = add("lock_file: " + file +
                              "\npatterns:\n  - {topics: /**, direction: dds_to_someip, services: "
                              "0x6000-0x6fff, port: 40060" +
                              from_first_ + "}\n");
  ASSERT_TRUE(until([&] { return second.counter("pattern /**", "routes") == 1; }));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter to SOME/IP", "kept") == 1; }));
  subscribe(0x6001);
  EXPECT_TRUE(until([&] { return came_ == 1; }));
  bridges_.clear();
  std::filesystem::remove(file);
}

TEST_F(Gateways, CarryCalls) {
  RunningBridge& first = add("methods:\n" + method("someip", 1));
  std::string second = method("ros", 2);
  second.insert(second.rfind('}'), from_first_);
  add("methods:\n" + second);
  int asked = 0;
  sd::Node node{io_, node_config()};
  const sd::Offer offered{node,
                          {.service = someip::ServiceId{1},
                           .instance = someip::InstanceId{1},
                           .methods = {{someip::MethodId{1}, [&](const someip::Message&, sd::Responder to) {
                                          ++asked;
                                          to.respond(hex("01 00000004 efbbbf 00"));
                                        }}}}};
  sd::Proxy proxy{node, {.service = someip::ServiceId{2}}};
  ASSERT_TRUE(until([&] { return !proxy.available().empty(); }));
  std::vector<Answer> answers;
  call(proxy, someip::MethodId{1}, hex("01"), answers);
  ASSERT_TRUE(until([&] { return !answers.empty(); }));
  EXPECT_FALSE(answers[0].error) << answers[0].error.message();
  EXPECT_EQ(to_hex(answers[0].payload), "0100000004efbbbf00");
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(first.counter("ROS service of method /actuate", "dds_from_bridge"), 0U);
}

// One message of one sender, which comes from the first bridge each time.
TEST_F(Gateways, AreKeptFromClosingARing) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_));
  relay(2, 1);
  ASSERT_TRUE(until([&] { return subscription_->active(); }));
  ASSERT_TRUE(subscribed(first, "/chatter"));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "publishers") == 1; }));
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "readers") == 1; }));
  const Rounds may;
  notify();
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  const std::uint64_t before = second.counter("route /chatter", "carried");
  EXPECT_LE(before, may.before_found(110));
  run_for(a_while);
  EXPECT_EQ(second.counter("route /chatter", "carried"), before);
}

/// Beside somebody who has readers, writers, services and events as a bridge has, and says nothing of it: an
/// older bridge. All that comes back into our bridge comes from him.
class OldBridges : public Gateways {
 protected:
  OldBridges() { spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_)); }
  ~OldBridges() override {
    bridges_.clear();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("after"));
  }

  /// The bridge under test, which carries a service's event to a topic of this name, and the service;
  /// somebody at its host reads the topic.
  RunningBridge& event_to(const std::string& topic, int service, dds::OnSample on_sample) {
    RunningBridge& route = add("routes:\n" + in(topic, service));
    offer(service);
    reader_ = listener_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(string_type), {},
                                      std::move(on_sample));
    EXPECT_TRUE(subscribed(route, topic));
    EXPECT_TRUE(until([&] { return route.counter("route " + topic, "readers") == 1; }));
    return route;
  }
  /// Sends an event so many times, four each millisecond, or as often as the machine can.
  void notify_often(int times) {
    for (int i = 0; i < times; ++i) {
      notify();
      if (i % 4 == 3) {
        run_for(1ms);
      }
    }
  }
  /// What is said of a ring goes through these.
  void expect_told(const std::string& route, const std::string& through) {
    ASSERT_TRUE(until([&] { return log_->has("seems to loop"); })) << log_->str();
    EXPECT_THAT(log_->str(), HasSubstr(route + ": this route seems to loop through the DDS participant '"));
    EXPECT_THAT(log_->str(), HasSubstr(through + someip::to_string(own_address(2))));
  }

  // Messages in a ring at once, so that also on a slow machine it is quick enough to be found.
  static constexpr std::uint64_t several_ = 10;
  const std::shared_ptr<LogSink> log_ = std::make_shared<LogSink>();
  std::optional<dds::Reader> reader_;
};

TEST_F(OldBridges, AreKeptFromClosingARingWithARoute) {
  std::uint64_t rounds = 0;
  RunningBridge& route = event_to("/chatter", 1, [&](const dds::Sample&) {
    boost::asio::post(io_, [&] {
      ++rounds;
      notify();
    });
  });
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(until([&] { return writer.matched() == 1; }));
  const Rounds may;
  for (std::uint64_t i = 0; i < several_; ++i) {
    ASSERT_TRUE(writer.write(hello_cdr));
  }
  ASSERT_TRUE(until([&] { return route.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  EXPECT_LE(rounds, may.before_found(101 + 2 * several_));
  const std::uint64_t before = rounds;
  const Rounds more;
  expect_told("/chatter", "who reads the topic, and the SOME/IP service at ");
  run_for(a_while);
  EXPECT_LE(rounds, before + more.after_found());
  for (int i = 0; i < 20; ++i) {  // more of it comes in, and is bounded
    ASSERT_TRUE(writer.write(hello_cdr));
    run_for(50ms);
  }
  EXPECT_LE(rounds, before + 20 + 110 + more.after_found());
}

// Whether a trial takes an honest event for a ring depends on how the machine keeps time; what it makes of
// one that comes in time is in loop_check_test.cpp.
TEST_F(OldBridges, AreNotWhoSaysTheSameOften) {
  bool goes_on = false;
  for (int attempt = 1; attempt <= 5 && !goes_on; ++attempt) {
    const std::string topic = fmt::format("/chatter{}", attempt);
    RunningBridge& route = event_to(topic, attempt, [](const dds::Sample&) {});
    const auto counted = [&](const char* name) { return route.counter("route " + topic, name); };
    for (int i = 0; i < 100 && counted("looped") == 0; ++i) {
      notify_often(80);
    }
    ASSERT_GT(counted("looped"), 0U) << "it is put on trial";
    notify_often(4400);  // longer than any trial
    const std::uint64_t looped = counted("looped");
    const std::uint64_t carried = counted("carried");
    notify_often(1000);
    goes_on = looped <= 400 && counted("looped") == looped && counted("carried") > carried;
  }
  EXPECT_TRUE(goes_on) << log_->str();
}

// Who reads here says that he is a bridge.
TEST_F(OldBridges, AreNotThoseWhoSayWhatTheyAre) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_));
  offer(1);
  ASSERT_TRUE(subscribed(first, "/chatter"));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "publishers") == 1; }));
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "readers") == 1; }));
  notify_often(500);
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "received") == 500; }));
  EXPECT_EQ(first.counter("route /chatter", "carried"), 500U);
  EXPECT_EQ(first.counter("route /chatter", "looped"), 0U);
}

// He answers a ROS service by a method of ours, which calls that ROS service.
TEST_F(OldBridges, AreKeptFromClosingARingWithAMethod) {
  RunningBridge& ours = add("methods:\n" + method("ros", 1));
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = someip::ServiceId{1}}};
  std::uint64_t asked = 0;
  std::vector<Answer> answers;
  dds::ServiceServer* server = nullptr;
  server = &driver_.server(listener_, ros("/actuate", "std_srvs/srv/SetBool"),
                           [&](const dds::RequestId& id, const dds::ServiceMessage&) {
                             ++asked;
                             call(proxy, someip::MethodId{1}, hex("01"), answers);
                             const Bytes yes = hex("00010000 01000000 01000000 00");
                             const dds::ByteView bytes = yes;
                             server->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
                           });
  const std::string group = "method of ROS service /actuate";
  ASSERT_TRUE(until([&] { return ours.counter(group, "ready") == 1 && !proxy.available().empty(); }));
  const Rounds may;
  for (std::uint64_t i = 0; i < several_; ++i) {
    call(proxy, someip::MethodId{1}, hex("01"), answers);
  }
  ASSERT_TRUE(until([&] { return ours.counter(group, "looped") > 0; }));
  run_for(a_while);
  EXPECT_LE(asked, may.before_found(301 + 2 * several_));
  const std::uint64_t before = asked;
  const Rounds more;
  expect_told("/actuate", "which has a server of it, and the SOME/IP client at ");
  run_for(a_while);
  EXPECT_LE(asked, before + more.after_found());
}

// He calls a ROS service for a method of his, which we call for that ROS service.
TEST_F(OldBridges, AreKeptFromClosingARingWithAService) {
  RunningBridge& ours = add("methods:\n" + method("someip", 1));
  std::uint64_t asked = 0;
  answering(ros("/actuate", "std_srvs/srv/SetBool"), [&](const dds::ServiceMessage&) {
    ++asked;
    return hex("00010000 01000000 01000000 00");
  });
  dds::ServiceClient& client = driver_.client(listener_, ros("/actuate", "std_srvs/srv/SetBool"));
  const Bytes bytes = hex("00010000 01");
  const dds::ByteView request = bytes;
  std::vector<Answer> answers;
  sd::Node node{io_, node_config()};
  int called = 0;
  const sd::Offer offered{
      node,
      {.service = someip::ServiceId{1},
       .instance = someip::InstanceId{1},
       .methods = {{someip::MethodId{1}, [&](const someip::Message&, sd::Responder to) {
                      ++called;
                      const auto waiting = std::make_shared<sd::Responder>(std::move(to));
                      client.call({&request, 1}, patience, std::chrono::steady_clock::now(),
                                  [waiting](const auto&) { waiting->respond(hex("01 00000004 efbbbf 00")); });
                    }}}}};
  const std::string group = "ROS service of method /actuate";
  ASSERT_TRUE(until([&] { return ours.counter(group, "ready") == 1 && client.ready(); }));
  ASSERT_TRUE(until([&] {  // he may have found the other server only
    ros_call(client, bytes, answers);
    run_for(20ms);
    return called > 0;
  }));
  for (std::uint64_t i = 0; i < several_; ++i) {
    ros_call(client, bytes, answers);
  }
  ASSERT_TRUE(until([&] { return ours.counter(group, "looped") > 0; }));
  run_for(a_while);
  const std::uint64_t before = asked;
  const Rounds more;
  expect_told("/actuate", "which calls it, and the SOME/IP service at ");
  run_for(a_while);
  EXPECT_LE(asked, before + more.after_found());
}

}  // namespace
}  // namespace trestle::test::rings_test
