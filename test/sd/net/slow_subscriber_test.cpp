// A subscriber that takes events more slowly than they come costs the others nothing.
#include "someip/net/address_text.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::slow_subscriber_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using test::quick;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr ServiceId service{0x1234};
constexpr MethodId event{0x8001};
constexpr MethodId notifier{0x8002};

/// The slow one has an io_context of its own, which stops to run.
class SlowSubscriberTest : public test::TwoNodes {
 protected:
  static NodeConfig small(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.tcp_send_buffer_bytes = config.tcp_receive_buffer_bytes = 16 << 10;
    config.timing.ttl_s = 3600;
    return config;
  }
  void subscribe_both() {
    const SubscribeSpec wanted{.service = service,
                               .eventgroup = EventgroupId{1},
                               .events = {event, notifier},
                               .udp = false,
                               .tcp = true};
    client.subscribe(wanted, collect());
    slow.subscribe(wanted, [this](const someip::Message& message, const Endpoint&) {
      at_slow.push_back(value(message.header.session));
      newest_at_slow.assign(message.payload.begin(), message.payload.end());
    });
    ASSERT_TRUE(run_until([&] {
      slow_io.poll();
      return server.subscribers(offer, event) == 2;
    }));
  }

  boost::asio::io_context slow_io;
  std::vector<std::uint16_t> at_slow;
  std::vector<std::byte> newest_at_slow;
  std::vector<std::string> warnings;
  Node server{io, small(test::server_address), {}, into(warnings)};
  Node client{io, quick(test::client_address)};
  Node slow{slow_io, small(test::other_address)};
  const OfferHandle offer =
      server.offer({.service = service,
                    .instance = InstanceId{1},
                    .udp_port = {},
                    .tcp_port = 0,
                    .fields = {{.notifier = notifier}},
                    .eventgroups = {{.id = EventgroupId{1}, .events = {event, notifier}}},
                    .waits = {{event, {.most = 2}}, {notifier, {.most = 1}}}});
  const std::vector<std::byte> payload = test::numbers(1'000'000);
  const ByteView slice{payload};
};

TEST_F(SlowSubscriberTest, LosesWhatIsTooMuchForItAndNobodyElseDoes) {
  subscribe_both();
  constexpr std::size_t messages = 10;
  std::size_t overtaken = 0;
  for (std::size_t i = 1; i <= messages; ++i) {
    const Notified sent = server.notify(offer, event, {&slice, 1});
    EXPECT_EQ(sent.subscribers, 2U);
    EXPECT_EQ(sent.dropped, 0U);
    overtaken += sent.overtaken;
    ASSERT_TRUE(run_until([&] { return events.size() == i; })) << i;
    EXPECT_EQ(events.back().payload, payload);
  }
  // It has begun to take the first one, and two wait for it.
  EXPECT_EQ(overtaken, messages - 3);
  EXPECT_EQ(server.counters().overtaken, messages - 3);
  const auto known = server.slow_subscribers();
  ASSERT_EQ(known.size(), 1U);
  EXPECT_EQ(known[0].at.address, test::other_address);
  EXPECT_EQ(known[0].transport, Transport::tcp);
  EXPECT_EQ(known[0].overtaken, messages - 3);
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr(someip::to_string(test::other_address)),
                                          HasSubstr("(TCP) takes events more slowly than they come"),
                                          HasSubstr("0x8001"), HasSubstr(": 1 dropped for it"))))
      << "one line, not one for each";
  EXPECT_TRUE(run_until([&] {
    slow_io.poll();
    return at_slow.size() == 3;
  }));
  EXPECT_THAT(at_slow, ElementsAre(1, messages - 1, messages));
}

// Of a field the newest value is the one that counts.
TEST_F(SlowSubscriberTest, GetsTheNewestValueOfAField) {
  subscribe_both();
  constexpr std::size_t values = 6;
  for (std::size_t i = 1; i <= values; ++i) {
    const std::vector<std::byte> value = test::numbers(1'000'000, i);
    EXPECT_EQ(server.set_field(offer, notifier, value).subscribers, 2U);
    ASSERT_TRUE(run_until([&] { return events.size() == i; })) << i;
    EXPECT_EQ(events.back().payload, value);
  }
  EXPECT_EQ(server.counters().overtaken, values - 2);
  EXPECT_TRUE(run_until([&] {
    slow_io.poll();
    return at_slow.size() == 2;
  }));
  EXPECT_EQ(at_slow.front(), 1);
  EXPECT_EQ(newest_at_slow, test::numbers(1'000'000, values));
}

}  // namespace
}  // namespace trestle::sd::slow_subscriber_test
