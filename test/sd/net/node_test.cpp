#include "sd/net/node.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "someip/net/address_text.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/covers.hpp"
#include "test/loopback.hpp"

namespace trestle::sd::node_test {
namespace {

using someip::Header;
using someip::Message;
using someip::MessageType;
using someip::MethodId;
using someip::NetError;
using someip::ReturnCode;
using someip::SessionId;
using someip::UdpSocket;
using test::covers;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

const IpAddress server_address = test::own_address(1);
const IpAddress client_address = test::own_address(2);

constexpr MethodId small{0x8001};
constexpr MethodId large{0x8002};

NodeConfig config(const IpAddress& address) {
  // Quick, so that a test is; but what expires does not because the machine stalls.
  return {.address = address,
          .multicast = test::own_group(),
          .timing = {.initial_delay_min = 0ms,
                     .initial_delay_max = 5ms,
                     .repetitions_base_delay = 5ms,
                     .cyclic_offer_delay = 50ms,
                     .request_response_delay_max = 1ms,
                     .ttl_s = 600}};
}

const ServiceSpec service{.service = ServiceId{0x1234},
                          .instance = InstanceId{1},
                          .major = 2,
                          .minor = 7,
                          .eventgroups = {{.id = EventgroupId{1}, .events = {small, large}},
                                          {.id = EventgroupId{2}, .events = {small}}}};

const SubscribeSpec wanted{.service = ServiceId{0x1234},
                           .instance = InstanceId{1},
                           .major = 2,
                           .eventgroup = EventgroupId{1},
                           .events = {small, large}};

std::vector<std::byte> numbers(std::size_t bytes) {
  std::vector<std::byte> result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    result[i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  return result;
}

struct Received {
  Header header;
  std::vector<std::byte> payload;
};

class NodeTest : public ::testing::Test {
 protected:
  DiscoveryLog into(std::vector<std::string>& log) {
    return [&log](const std::string& line) { log.push_back(line); };
  }
  Node::EventHandler collect() {
    return [this](const Message& message, const Endpoint&) {
      received.push_back({message.header, {message.payload.begin(), message.payload.end()}});
    };
  }
  template <typename Condition>
  [[nodiscard]] bool run_until(Condition condition, std::chrono::milliseconds limit = 60s) {
    using Clock = std::chrono::steady_clock;
    constexpr Clock::duration step = 5ms;
    // Time in which the machine stalls does not count: what came meanwhile is still to be worked off.
    for (Clock::duration left = limit; left > 0s;) {
      if (condition()) {
        return true;
      }
      const Clock::time_point before = Clock::now();
      io.run_one_for(std::min(left, step));
      longest_stall = std::max(longest_stall, Clock::now() - before);
      left -= std::min(Clock::now() - before, step);
    }
    return condition();
  }
  void run_for(std::chrono::milliseconds time) {
    static_cast<void>(run_until([] { return false; }, time));
  }

  boost::asio::io_context io;
  Duration longest_stall{};
  std::vector<std::string> server_log;
  std::vector<std::string> client_log;
  std::vector<Received> received;
};

TEST_F(NodeTest, CarriesEventsFromAnOfferToASubscriber) {
  covers({"feat_req_someip_361", "feat_req_someipsd_27", "feat_req_someip_144", "feat_req_someip_92"});
  Node server{io, config(server_address), into(server_log)};
  Node client{io, config(client_address), into(client_log)};
  const OfferHandle offer = server.offer(service);
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  EXPECT_EQ(server.subscribers(offer, small), 0U);
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(server.subscribers(offer, small), 1U);

  const auto little = numbers(5);
  const ByteView slice{little};
  const auto notified = server.notify(offer, small, {&slice, 1});
  EXPECT_EQ(notified.subscribers, 1U);
  EXPECT_EQ(notified.session, SessionId{1});
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  EXPECT_EQ(received[0].header, (Header{.service = ServiceId{0x1234},
                                        .method = small,
                                        .session = SessionId{1},
                                        .interface_version = 2,
                                        .type = MessageType::notification}));
  EXPECT_EQ(received[0].payload, little);
  EXPECT_THAT(client_log, Contains(AllOf(HasSubstr("0x1234.0x0001 version 2.7 is offered"),
                                         HasSubstr(someip::to_string(server_address)))));
  EXPECT_THAT(server_log, Contains(HasSubstr("subscribed to eventgroup 0x0001 of 0x1234.0x0001")));
}

TEST_F(NodeTest, SendsEventsFromTheOfferedEndpoint) {
  covers({"feat_req_someipsd_758", "feat_req_someipsd_781", "feat_req_someipsd_797", "feat_req_someipsd_850",
          "feat_req_someipsd_858", "feat_req_someipsd_752"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  ServiceSpec at_port = service;
  at_port.udp_port = 40125;
  const OfferHandle offer = server.offer(at_port);
  std::vector<Endpoint> senders;
  const SubscriptionId subscription =
      client.subscribe(wanted, [&](const Message&, const Endpoint& from) { senders.push_back(from); });
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  const auto payload = numbers(5000);
  const ByteView slice{payload};
  server.notify(offer, small, {});
  server.notify(offer, large, {&slice, 1});
  ASSERT_TRUE(run_until([&] { return senders.size() == 2; }));
  const Endpoint offered{server_address, 40125};
  EXPECT_THAT(senders, ElementsAre(offered, offered));
}

TEST_F(NodeTest, SendsNothingToThoseWhoDidNotSubscribe) {
  covers({"feat_req_someip_807", "feat_req_someipsd_204"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  SubscribeSpec other_group = wanted;
  other_group.eventgroup = EventgroupId{2};
  const SubscriptionId subscription = client.subscribe(other_group, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(server.notify(offer, large, {}).subscribers, 0U);  // not in group 2
  EXPECT_EQ(server.sender_counters().datagrams, 0U);
  EXPECT_EQ(server.notify(offer, small, {}).subscribers, 1U);
  EXPECT_EQ(server.sender_counters().datagrams, 1U);
  client.unsubscribe(subscription);
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer, small) == 0; }));
  EXPECT_EQ(server.notify(offer, small, {}).subscribers, 0U);
  EXPECT_EQ(server.sender_counters().datagrams, 1U);
}

TEST_F(NodeTest, HasItsPortOpenBeforeItSubscribes) {
  covers({"feat_req_someipsd_1182"});
  Node client{io, config(client_address)};
  SubscribeSpec here = wanted;
  here.port = 40126;
  client.subscribe(here, collect());
  // Nobody has offered the service yet, and the port is taken already.
  EXPECT_THROW((UdpSocket{io, {.local = {client_address, 40126}}}), NetError);
}

TEST_F(NodeTest, CarriesMessagesOfMegabytesInSegments) {
  covers({"feat_req_someiptp_760", "feat_req_someiptp_762"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  const auto payload = std::make_shared<std::vector<std::byte>>(numbers(4 << 20));
  const std::array<ByteView, 2> halves{ByteView{*payload}.first(1'000'001),
                                       ByteView{*payload}.subspan(1'000'001)};
  const auto notified = server.notify(offer, large, halves, payload);
  EXPECT_EQ(notified.subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  EXPECT_EQ(received[0].header.type, MessageType::notification);
  EXPECT_EQ(received[0].header.session, notified.session);
  EXPECT_EQ(received[0].payload, *payload);
  EXPECT_EQ(payload.use_count(), 1);
}

TEST_F(NodeTest, FindsAServiceThatIsOfferedLater) {
  Node client{io, config(client_address)};
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  run_for(100ms);
  EXPECT_FALSE(client.subscribed(subscription));
  Node server{io, config(server_address)};
  server.offer(service);
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription); }));
}

TEST_F(NodeTest, StaysSubscribedBeyondTheTtlAndSubscribesAgainAfterAWithdrawal) {
  NodeConfig brief_client = config(client_address);
  brief_client.timing.ttl_s = 1;
  Node server{io, config(server_address), into(server_log)};
  Node client{io, brief_client, into(client_log)};
  OfferHandle offer = server.offer(service);
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  for (int tries = 0; tries < 8; ++tries) {  // until the machine lets us renew it in time
    longest_stall = {};
    server_log.clear();
    run_for(1200ms);
    if (longest_stall < 500ms) {
      EXPECT_THAT(server_log, Not(Contains(HasSubstr("no longer subscribed"))));
      EXPECT_EQ(server.subscribers(offer, small), 1U);
      break;
    }
  }
  server.withdraw(offer);
  EXPECT_TRUE(run_until([&] { return !client.subscribed(subscription); }));
  EXPECT_TRUE(run_until([&] {  // later, if the subscription had expired before
    return std::ranges::any_of(
        client_log, [](const std::string& line) { return line.find("is gone: stopped") != line.npos; });
  }));
  offer = server.offer(service);
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription); }));
}

TEST_F(NodeTest, WithdrawsEverythingOnShutdown) {
  Node server{io, config(server_address)};
  auto client = std::make_unique<Node>(io, config(client_address));
  const OfferHandle offer = server.offer(service);
  const SubscriptionId subscription = client->subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client->subscribed(subscription); }));
  client->shutdown();
  client.reset();
  EXPECT_TRUE(run_until([&] { return server.subscribers(offer, small) == 0; })) << "no StopSubscribe";
}

TEST_F(NodeTest, SharesOneSubscriptionAmongListeners) {
  covers({"feat_req_someip_354"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  std::vector<std::string> calls;
  SubscriptionId first{};
  first = client.subscribe(wanted, [&](const Message&, const Endpoint&) {
    calls.emplace_back("first");
    client.unsubscribe(first);
  });
  SubscribeSpec only_large = wanted;
  only_large.events = {large};
  client.subscribe(wanted, [&](const Message&, const Endpoint&) { calls.emplace_back("second"); });
  client.subscribe(only_large, [&](const Message&, const Endpoint&) { calls.emplace_back("third"); });
  ASSERT_TRUE(run_until([&] { return client.subscribed(first); }));
  EXPECT_EQ(server.subscribers(offer, small), 1U);
  server.notify(offer, small, {});
  server.notify(offer, large, {});
  ASSERT_TRUE(run_until([&] { return calls.size() >= 4; }));
  EXPECT_THAT(calls, ElementsAre("first", "second", "second", "third"));
}

TEST_F(NodeTest, SendsAnEventOnceToAnEndpointThatSubscribedToTwoEventgroupsWithIt) {
  covers({"feat_req_someipsd_1168"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  SubscribeSpec second_group = wanted;
  second_group.eventgroup = EventgroupId{2};
  second_group.events = {};
  const SubscriptionId one = client.subscribe(wanted, collect());
  const SubscriptionId two = client.subscribe(second_group, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(one) && client.subscribed(two); }));
  EXPECT_EQ(server.notify(offer, small, {}).subscribers, 1U);
}

TEST_F(NodeTest, DropsAndCountsEventsThatItDidNotAskForOrThatOthersForge) {
  covers({"feat_req_someipcompat_1201"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  SubscribeSpec here = wanted;
  here.port = 40123;
  const SubscriptionId subscription = client.subscribe(here, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));

  UdpSocket stranger{io, {.local = {server_address, 0}}};
  const Endpoint to{client_address, 40123};
  const auto send = [&](UdpSocket& from, Header header) {
    std::array<std::byte, 16> room{};
    const ByteView bytes = *encode(header, {}, room);
    from.send(to, {&bytes, 1});
  };
  Header header{.service = ServiceId{0x1234},
                .method = small,
                .session = SessionId{1},
                .interface_version = 2,
                .type = MessageType::notification};
  send(stranger, header);
  ASSERT_TRUE(run_until([&] { return client.counters().unknown_sender == 1; }));
  header.method = MethodId{0x8003};
  send(stranger, header);
  ASSERT_TRUE(run_until([&] { return client.counters().unexpected == 1; }));
  const std::array<std::byte, 9> broken{};
  const ByteView malformed{broken};
  stranger.send(to, {&malformed, 1});
  ASSERT_TRUE(run_until([&] { return client.counters().malformed == 1; }));
  EXPECT_TRUE(received.empty());

  // And the right one still arrives.
  server.notify(offer, small, {});
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  EXPECT_EQ(client.counters().events, 1U);
}

TEST_F(NodeTest, SaysOnceThatItCannotReachItsGroup) {
  // The kernel takes such a sender's multicast for unreachable.
  NodeConfig nowhere = config(*someip::parse_address("::1"));
  nowhere.multicast = *someip::parse_address("ff05::1234");
  std::unique_ptr<Node> node;
  try {
    node = std::make_unique<Node>(io, nowhere, into(server_log));
  } catch (const NetError& error) {
    GTEST_SKIP() << error.what();
  }
  ServiceSpec there = service;
  there.udp_port = 0;
  node->offer(there);
  run_for(200ms);
  if (node->counters().discovery_not_sent == 0) {
    GTEST_SKIP() << "this host can send multicast over IPv6 loopback";
  }
  EXPECT_TRUE(run_until([&] { return node->counters().discovery_not_sent > 1; }));
  EXPECT_THAT(server_log,
              Contains(HasSubstr("discovery cannot send to its group [ff05::1234]:30490: ")).Times(1));
}

TEST_F(NodeTest, PutsTogetherOnlyWhatItWaitsFor) {
  covers({"feat_req_someiptp_794"});
  Node server{io, config(server_address)};
  Node client{io, config(client_address)};
  const OfferHandle offer = server.offer(service);
  SubscribeSpec here = wanted;
  here.port = 40127;
  const SubscriptionId subscription = client.subscribe(here, collect());
  ServiceSpec own = service;
  own.service = ServiceId{0x4321};
  own.udp_port = 40128;
  client.offer(own);
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));

  // First segments that nothing follows, each of another message: more than there are places.
  UdpSocket stranger{io, {.local = {server_address, 0}}};
  std::uint64_t sent = 0;
  const auto flood = [&](std::uint16_t port, Header header) {
    std::array<std::byte, 64> room{};
    std::array<std::byte, 20> segment{};
    segment[3] = std::byte{1};  // offset 0, more segments
    for (std::uint16_t i = 0; i < 40; ++i) {
      header.client = someip::ClientId{i};
      const ByteView bytes = *encode(header, segment, room);
      stranger.send({client_address, port}, {&bytes, 1});
      ++sent;
    }
    const auto refused = [&] {
      const NodeCounters counters = client.counters();
      return counters.unexpected + counters.unknown_sender + counters.requests_answered;
    };
    ASSERT_TRUE(run_until([&] { return refused() == sent; })) << refused();
  };
  Header header{.service = ServiceId{0x1234},
                .method = large,
                .session = SessionId{1},
                .interface_version = 2,
                .type = static_cast<MessageType>(0x22)};
  flood(40127, header);  // the right event from the wrong endpoint
  header.service = ServiceId{0x7777};
  flood(40127, header);  // an event that nobody asked for
  header.type = static_cast<MessageType>(0xa0);
  flood(40127, header);  // a response to nothing
  header.type = static_cast<MessageType>(0x20);
  flood(40128, header);  // a request to a service that is not offered
  EXPECT_EQ(client.reassembly_counters().segments, 0U);

  const auto payload = numbers(5000);
  const ByteView slice{payload};
  server.notify(offer, large, {&slice, 1});
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  EXPECT_EQ(received[0].payload, payload);
  EXPECT_EQ(client.reassembly_counters().segments, 4U);
}

TEST_F(NodeTest, AnswersCallsWithAnErrorSinceItHasNoMethods) {
  covers({"feat_req_someip_655", "feat_req_someip_654", "feat_req_someip_538", "feat_req_someip_816",
          "feat_req_someip_348", "feat_req_someip_49"});
  Node server{io, config(server_address)};
  ServiceSpec at_port = service;
  at_port.udp_port = 40124;
  server.offer(at_port);
  UdpSocket caller{io, {.local = {client_address, 0}}};
  std::vector<Header> answers;
  caller.receive([&](ByteView datagram, const Endpoint& from) {
    answers.push_back(someip::decode(datagram)->header);
    EXPECT_EQ(from, (Endpoint{server_address, 40124}));
  });
  const Header request{.service = ServiceId{0x1234},
                       .method = MethodId{0x0001},
                       .client = someip::ClientId{7},
                       .session = SessionId{8},
                       .interface_version = 2,
                       .type = MessageType::request};
  const auto call = [&](Header header) {
    std::array<std::byte, 16> room{};
    const ByteView bytes = *encode(header, {}, room);
    caller.send({server_address, 40124}, {&bytes, 1});
  };
  Header header = request;
  header.type = MessageType::request_no_return;
  call(header);  // gets none
  call(request);
  header = request;
  header.service = ServiceId{0x4321};
  call(header);
  header = request;
  header.interface_version = 9;
  call(header);
  ASSERT_TRUE(run_until([&] { return answers.size() == 3; }));
  EXPECT_EQ(answers[0].return_code, ReturnCode::unknown_method);
  EXPECT_EQ(answers[0].session, SessionId{8});
  EXPECT_EQ(answers[1].return_code, ReturnCode::unknown_service);
  EXPECT_EQ(answers[2].return_code, ReturnCode::wrong_interface_version);
  EXPECT_EQ(server.counters().requests_answered, 3U);
}

TEST_F(NodeTest, NamesThePortAndTheRemedyWhenAnotherStackHasTheAddress) {
  Node first{io, config(server_address)};
  try {
    Node second{io, config(server_address)};
    FAIL() << "two nodes on one address";
  } catch (const NetError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(someip::to_string(server_address) + ":30490"),
                                    HasSubstr("ss -ulpn"), HasSubstr("another address")));
  }
}

TEST_F(NodeTest, SaysWhyAnOfferIsRefused) {
  Node server{io, config(server_address)};
  server.offer(service);
  try {
    server.offer(service);
    FAIL() << "offered twice";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("0x1234.0x0001"), HasSubstr("duplicate")));
  }
}

TEST_F(NodeTest, CanBeDestroyedAtAnyTime) {
  auto server = std::make_unique<Node>(io, config(server_address));
  const OfferHandle offer = server->offer(service);
  auto client = std::make_unique<Node>(io, config(client_address));
  const SubscriptionId subscription = client->subscribe(wanted, collect());
  ASSERT_TRUE(run_until([&] { return client->subscribed(subscription); }));
  const auto payload = std::make_shared<std::vector<std::byte>>(numbers(1 << 20));
  const ByteView slice{*payload};
  server->notify(offer, large, {&slice, 1}, payload);
  server.reset();
  EXPECT_EQ(payload.use_count(), 1);
  client.reset();
  run_for(50ms);
  EXPECT_TRUE(received.empty());
}

}  // namespace
}  // namespace trestle::sd::node_test
