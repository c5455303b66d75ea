// Calls and events need no memory from the heap once they are under way: all memory that this program asks
// for is counted, on both sides. Who takes the payload of a Proxy's response takes a vector, and nothing
// else.
#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <limits>
#include <semaphore>
#include <thread>

#include "sd/net/proxy.hpp"
#include "test/allocations.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::no_allocation_test {
namespace {

using namespace std::chrono_literals;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;

constexpr ServiceId service{0x1234};
constexpr MethodId echo{1};
constexpr MethodId udp_event{0x8001};
constexpr MethodId tcp_event{0x8002};
constexpr std::size_t warm_up = 500;
constexpr std::size_t most_rows = 5;

NodeConfig config_for(const IpAddress& address, Duration collect_for = Duration::zero()) {
  NodeConfig config = test::calm(address);  // discovery has its say before, and after
  config.collect_for = collect_for;
  config.tcp_send_buffer_bytes = 65'536;  // so that large messages have to wait
  config.timing.ttl_s = 10'000;
  return config;
}

class NoAllocationTest : public test::TwoNodes {
 public:
  explicit NoAllocationTest(Duration collect_for = Duration::zero()) : collects_for{collect_for} {}
  void SetUp() override {
    offer =
        server.offer({.service = service,
                      .instance = InstanceId{1},
                      .tcp_port = std::uint16_t{0},
                      .methods = {{echo, [](const someip::Message& request,
                                            Responder responder) { responder.respond(request.payload); }}},
                      .eventgroups = {{.id = EventgroupId{1}, .events = {udp_event, tcp_event}}},
                      .tcp_events = {tcp_event}});
    requirement = client.require({.service = service});
    const SubscriptionId subscription = client.subscribe(
        {.service = service, .eventgroup = EventgroupId{1}, .events = {udp_event, tcp_event}, .tcp = true},
        [this](const someip::Message& message, const Endpoint&) {
          if (both_sizes) {
            done(&NoAllocationTest::notify_of_both_sizes);
            return;
          }
          EXPECT_EQ(message.payload.size(), bytes);
          done(&NoAllocationTest::notify);
        });
    ASSERT_TRUE(run_until([&] {
      return client.subscribed(subscription) && !client.available(requirement).empty() &&
             server.subscribers(offer, tcp_event) == 1;
    }));
    run_for(50ms);  // discovery's delays of up to 5 ms are over
  }

  void enlarge(std::size_t to) {
    large = std::make_shared<const std::vector<std::byte>>(to, std::byte{7});
    bytes = to;
  }

  void call() {
    const ByteView payload{large->data(), bytes};
    client.call(requirement, {.method = echo, .transport = transport}, {&payload, 1},
                [this](const CallResult& result) {
                  ASSERT_TRUE(result);
                  EXPECT_EQ(result->payload.size(), bytes);
                  done(&NoAllocationTest::call);
                });
  }
  void notify() {
    const ByteView payload{large->data(), bytes};
    const Notified notified =
        server.notify(offer, event, {&payload, 1}, keep ? large : nullptr, {.separation = separation});
    EXPECT_EQ(notified.subscribers, 1U);
  }
  void notify_of_both_sizes() {
    both_sizes = true;
    bytes = ++begun % 3 == 0 ? large->size() : 64;
    notify();
  }
  void done(void (NoAllocationTest::*again)()) {
    if (++count == warm_up) {
      before = test::allocations();
    } else if (count == warm_up + wanted) {
      fewest = std::min(fewest, test::allocations() - before);
      if (fewest == 0 || ++rows == most_rows) {
        io.stop();
      } else {
        count = warm_up;
        before = test::allocations();
      }
    }
    (this->*again)();
  }
  // How many allocations there are while `wanted` of them are done, `at_once` under way at a time. Of several
  // such rows, the fewest: what grows with the longest that ever had to wait, on a busy machine, grows once.
  std::size_t allocations_of(void (NoAllocationTest::*one)(), std::size_t at_once, std::size_t number) {
    wanted = number;
    boost::asio::steady_timer limit{io, 100s};
    limit.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        io.stop();
      }
    });
    boost::asio::post(io, [this, one, at_once] {
      for (std::size_t i = 0; i < at_once; ++i) {
        (this->*one)();
      }
    });
    io.restart();
    io.run();  // not run_one(): Asio keeps the memory of handlers for as long as this runs
    EXPECT_GE(count, warm_up + wanted);
    return fewest;
  }

  const Duration collects_for;
  Node server{io, config_for(test::server_address, collects_for)};
  Node client{io, config_for(test::client_address)};
  OfferHandle offer;
  RequirementId requirement{};
  std::shared_ptr<const std::vector<std::byte>> large =
      std::make_shared<const std::vector<std::byte>>(60'000, std::byte{7});
  std::size_t bytes = 64;
  Transport transport = Transport::udp;
  MethodId event = udp_event;
  bool keep = false;
  std::chrono::microseconds separation{0};
  bool both_sizes = false;
  std::size_t begun = 0;
  std::size_t wanted = 0;
  std::size_t count = 0;
  std::size_t before = 0;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  std::size_t rows = 0;
};

TEST_F(NoAllocationTest, HappensInCallsOverUdp) {
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 1, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInManyCallsAtATimeOverUdp) {
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 32, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInCallsOverTcp) {
  transport = Transport::tcp;
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 1, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInManyCallsAtATimeOverTcp) {
  transport = Transport::tcp;
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 32, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInLargeCallsOverUdp) {
  enlarge(200'000);
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 1, 500), 0U);
}

TEST_F(NoAllocationTest, HappensInLargeCallsOverTcp) {
  transport = Transport::tcp;
  enlarge(200'000);
  EXPECT_EQ(allocations_of(&NoAllocationTest::call, 1, 2'000), 0U);
}

TEST_F(NoAllocationTest, HappensInEventsOverUdp) {
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 1, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInEventsOverTcp) {
  event = tcp_event;
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 1, 10'000), 0U);
}

TEST_F(NoAllocationTest, HappensInEventsInSegments) {
  bytes = large->size();
  keep = true;
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 1, 2'000), 0U);
}

// As many wait from the beginning as ever will.
TEST_F(NoAllocationTest, HappensInManyLargeEventsAtATimeOverUdp) {
  enlarge(200'000);
  separation = 100us;
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 8, 2'000), 0U);
}

TEST_F(NoAllocationTest, HappensInManyLargeEventsAtATimeOverTcp) {
  event = tcp_event;
  enlarge(200'000);
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 8, 2'000), 0U);
}

class ProxyAllocationTest : public NoAllocationTest {
 public:
  // Its request's payload is what the response before had.
  void call_by_proxy() {
    proxy.call({.method = echo, .transport = transport}, std::move(next),
               [this](const boost::system::error_code& error, Response response) {
                 ASSERT_FALSE(error) << error.message();
                 EXPECT_EQ(response.payload.size(), bytes);
                 next = std::move(response.payload);
                 done(static_cast<void (NoAllocationTest::*)()>(&ProxyAllocationTest::call_by_proxy));
               });
  }
  // With what the handler captures, this is too much for a std::function without memory.
  void call_by_proxy_and_look() {
    proxy.call(
        {.method = echo, .transport = transport}, ByteView{large->data(), bytes},
        [this, captured = std::array<std::size_t, 20>{bytes}](const boost::system::error_code& error,
                                                              const Response& response) {
          ASSERT_FALSE(error) << error.message();
          EXPECT_EQ(response.payload.size(), captured[0]);
          done(static_cast<void (NoAllocationTest::*)()>(&ProxyAllocationTest::call_by_proxy_and_look));
        });
  }
  void expect_none(std::size_t at_once, std::size_t number) {
    EXPECT_EQ(allocations_of(
                  static_cast<void (NoAllocationTest::*)()>(&ProxyAllocationTest::call_by_proxy_and_look),
                  at_once, number),
              0U);
  }
  // One payload for each response.
  void expect_one_for_each_call() {
    next.assign(bytes, std::byte{7});
    EXPECT_EQ(allocations_of(static_cast<void (NoAllocationTest::*)()>(&ProxyAllocationTest::call_by_proxy),
                             1, 10'000),
              10'000U);
  }

  Proxy proxy{client, {.service = service}};
  std::vector<std::byte> next;
};

TEST_F(ProxyAllocationTest, IsOfTheResponseOverUdp) {
  expect_one_for_each_call();
}

TEST_F(ProxyAllocationTest, IsOfTheResponseOverTcp) {
  transport = Transport::tcp;
  expect_one_for_each_call();
}

TEST_F(ProxyAllocationTest, IsOfTheResponseOverTcpToALargeRequest) {
  transport = Transport::tcp;
  bytes = large->size();
  expect_one_for_each_call();
}

TEST_F(ProxyAllocationTest, DoesNotHappenWithoutAPayload) {
  bytes = 0;
  EXPECT_EQ(allocations_of(static_cast<void (NoAllocationTest::*)()>(&ProxyAllocationTest::call_by_proxy), 32,
                           10'000),
            0U);
}

TEST_F(ProxyAllocationTest, DoesNotHappenWhereTheResponseIsOnlyLookedAt) {
  expect_none(1, 10'000);
}

TEST_F(ProxyAllocationTest, DoesNotHappenInManyCallsAtATime) {
  expect_none(32, 10'000);
}

TEST_F(ProxyAllocationTest, DoesNotHappenInManyCallsAtATimeOverTcp) {
  transport = Transport::tcp;
  expect_none(32, 10'000);
}

TEST_F(ProxyAllocationTest, DoesNotHappenInLargeCallsOverUdp) {
  enlarge(200'000);
  expect_none(1, 500);
}

TEST_F(ProxyAllocationTest, DoesNotHappenInLargeCallsOverTcp) {
  transport = Transport::tcp;
  enlarge(200'000);
  expect_none(1, 2'000);
}

// Neither in the thread that calls, nor in that of the node.
TEST_F(ProxyAllocationTest, IsOfTheResponseAlsoForAnotherThread) {
  constexpr std::size_t calls = 5'000;
  std::size_t of_caller = 1;
  std::size_t of_node = 1;
  const std::jthread caller{[&] {
    std::binary_semaphore answered{0};
    std::vector<std::byte> payload(bytes);
    std::size_t caller_before = 0;
    std::size_t node_before = 0;
    for (std::size_t i = 0; i < warm_up + calls; ++i) {
      if (i == warm_up) {
        caller_before = test::allocations();
        node_before = of_node;
      }
      proxy.call({.method = echo}, std::move(payload),
                 [&](const boost::system::error_code& error, Response response) {
                   EXPECT_FALSE(error) << error.message();
                   payload = std::move(response.payload);
                   of_node = test::allocations();
                   answered.release();
                 });
      answered.acquire();
    }
    of_caller = test::allocations() - caller_before;
    of_node -= node_before;
    io.stop();
  }};
  io.restart();
  io.run();
  EXPECT_EQ(of_caller, 0U);
  EXPECT_EQ(of_node, calls);
}

class CollectingTest : public NoAllocationTest {
 public:
  CollectingTest() : NoAllocationTest{100us} {}
};

// More at a time than a datagram takes.
TEST_F(CollectingTest, AllocatesNothing) {
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify, 50, 10'000), 0U);
  EXPECT_LT(client.counters().datagrams, count / 5);
}

// What is collected leaves before a message in segments, and both begin anew.
TEST_F(CollectingTest, AllocatesNothingBesideLargeMessages) {
  keep = true;
  EXPECT_EQ(allocations_of(&NoAllocationTest::notify_of_both_sizes, 10, 2'000), 0U);
  EXPECT_GT(client.reassembly_counters().messages, 500U);
}

}  // namespace
}  // namespace trestle::sd::no_allocation_test
