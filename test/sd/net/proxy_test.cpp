#include "sd/net/proxy.hpp"

#include <algorithm>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_future.hpp>
#include <thread>

#include "sd/net/handles.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::proxy_test {
namespace {

using boost::system::error_code;
using someip::MethodId;
using someip::pack;
using someip::ReturnCode;
using someip::unpack;
using test::covers;
using test::hex;
using test::quick;
using test::to_hex;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr MethodId greet{1};
constexpr MethodId silent{2};
constexpr MethodId refuse{3};
constexpr MethodId tell{4};

struct Answer {
  error_code error;
  Response response;
};

class ProxyTest : public test::TwoNodes {
 protected:
  ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .methods = {{greet, answering([this](const std::string& name) {
                           ++greetings;
                           return "Hello, " + name;
                         })},
                        {silent, [this](const someip::Message&,
                                        Responder responder) { waiting.push_back(std::move(responder)); }},
                        {refuse,
                         [](const someip::Message&, Responder responder) {
                           responder.error(ReturnCode{0x21}, pack(std::uint8_t{5}));
                         }},
                        {tell, answering([this](std::uint8_t number) { told.push_back(number); }),
                         someip::MethodKind::fire_and_forget}}};
  }
  auto into_answers() {
    return [this](error_code error, Response response) { answers.push_back({error, std::move(response)}); };
  }
  [[nodiscard]] bool answered(std::size_t times = 1) {
    return run_until([&] { return answers.size() == times; });
  }

  const RequireSpec wanted{.service = ServiceId{0x1234}};
  std::vector<Answer> answers;
  std::vector<Responder> waiting;
  std::vector<int> told;
  int greetings = 0;
};

TEST_F(ProxyTest, CallsAMethodOnceTheServiceIsThere) {
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  proxy.call({.method = greet}, pack("you"), into_answers());
  run_for(30ms);
  EXPECT_THAT(answers, IsEmpty());
  EXPECT_THAT(proxy.available(), IsEmpty());

  Node server{io, quick(test::server_address)};
  const Offer offer{server, spec()};
  ASSERT_TRUE(answered());
  EXPECT_FALSE(answers[0].error) << answers[0].error.message();
  EXPECT_EQ(answers[0].response.header.method, greet);
  EXPECT_EQ(unpack<std::string>(answers[0].response.payload).value_or("?"), "Hello, you");
  EXPECT_EQ(greetings, 1);
  EXPECT_THAT(proxy.available(), SizeIs(1));

  proxy.call({.method = greet}, pack("again"), into_answers());
  EXPECT_THAT(answers, SizeIs(1)) << "called back from within the call";
  ASSERT_TRUE(answered(2));
  EXPECT_TRUE(proxy.send({.method = tell}, pack(std::uint8_t{9})));
  EXPECT_TRUE(run_until([&] { return !told.empty(); }));
  EXPECT_THAT(told, ElementsAre(9));
}

TEST_F(ProxyTest, CallsOverTcpThatIsNotConnectedYet) {
  ServiceSpec tcp = spec();
  tcp.udp_port.reset();
  tcp.tcp_port = 0;
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  proxy.call({.method = greet, .transport = Transport::tcp}, pack("tcp"), into_answers());
  {
    Node server{io, quick(test::server_address)};
    const Offer offer{server, tcp};
    ASSERT_TRUE(answered());
    EXPECT_FALSE(answers[0].error) << answers[0].error.message();
  }
  // Started anew on another port; the withdrawal was not lost, so the client finds out at once.
  ASSERT_TRUE(run_until([&] { return proxy.available().empty(); }));
  proxy.call({.method = greet}, pack("tcp"), into_answers());
  Node server{io, quick(test::server_address)};
  const Offer offer{server, tcp};
  ASSERT_TRUE(answered(2));
  EXPECT_FALSE(answers[1].error) << answers[1].error.message();
}

TEST_F(ProxyTest, SaysWhyThereIsNoResponse) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  proxy.call({.method = greet, .timeout = 20ms}, pack("you"), into_answers());
  ASSERT_TRUE(answered());
  EXPECT_EQ(answers[0].error, CallFault::unavailable);
  EXPECT_EQ(answers[0].error.message(), "nobody offers the service");
  EXPECT_FALSE(proxy.send({.method = tell}, {}));

  const Offer offer{server, spec()};
  ASSERT_TRUE(run_until([&] { return !proxy.available().empty(); }));
  proxy.call({.method = silent, .timeout = 200ms}, {}, into_answers());
  ASSERT_TRUE(answered(2));
  EXPECT_EQ(answers[1].error, CallFault::timed_out);
  EXPECT_EQ(answers[1].error.message(), "no answer in time");

  proxy.call({.method = refuse}, {}, into_answers());
  ASSERT_TRUE(answered(3));
  EXPECT_EQ(answers[2].error, ReturnCode{0x21});
  EXPECT_EQ(answers[2].error.message(), "the answer is error 0x21");
  EXPECT_EQ(to_hex(answers[2].response.payload), "05");
  EXPECT_EQ(answers[2].response.header.return_code, ReturnCode{0x21});

  proxy.call({.method = greet}, hex("000000"), into_answers());
  ASSERT_TRUE(answered(4));
  EXPECT_EQ(answers[3].error, ReturnCode::malformed_message);
  EXPECT_EQ(answers[3].error.message(), "the answer is E_MALFORMED_MESSAGE");
  EXPECT_EQ(greetings, 0);

  // Offered, but not by TCP.
  proxy.call({.method = greet, .timeout = 10ms, .transport = Transport::tcp}, pack("you"), into_answers());
  ASSERT_TRUE(answered(5));
  EXPECT_EQ(answers[4].error, CallFault::unavailable);
}

TEST_F(ProxyTest, LetsOnlySoManyCallsWait) {
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  for (std::size_t i = 0; i <= Proxy::max_waiting_calls; ++i) {
    proxy.call({.method = greet, .timeout = 1h}, pack("you"), into_answers());
  }
  ASSERT_TRUE(answered());
  EXPECT_EQ(answers[0].error, CallFault::too_many_calls);
}

TEST_F(ProxyTest, EndsItsCallsWithItself) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  std::optional<Proxy> proxy{std::in_place, client, wanted};
  proxy->call({.method = silent}, {}, into_answers());
  ASSERT_TRUE(run_until([&] { return waiting.size() == 1; }));
  proxy->call({.method = MethodId{7}, .instance = InstanceId{9}}, {}, into_answers());  // waits
  run_for(10ms);
  proxy.reset();
  EXPECT_THAT(answers, IsEmpty()) << "called back from within the destructor";
  ASSERT_TRUE(answered(2));
  EXPECT_EQ(answers[0].error, boost::asio::error::operation_aborted);
  EXPECT_EQ(answers[1].error, boost::asio::error::operation_aborted);
  waiting.clear();  // answers not_ok, which nobody waits for
  run_for(20ms);
  EXPECT_THAT(answers, SizeIs(2));
}

TEST_F(ProxyTest, MayBeDestroyedByItsHandlers) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  std::optional<Proxy> by_answer{std::in_place, client, wanted};
  by_answer->call({.method = greet}, pack("you"), [&](error_code, const Response&) { by_answer.reset(); });
  EXPECT_TRUE(run_until([&] { return !by_answer; }));
  std::optional<Proxy> by_server;
  by_server.emplace(client, wanted, [&](const RemoteService&, bool) { by_server.reset(); });
  by_server->call({.method = silent}, {}, into_answers());
  EXPECT_TRUE(run_until([&] { return !by_server; }));
  ASSERT_TRUE(answered());
  EXPECT_EQ(answers[0].error, boost::asio::error::operation_aborted);
}

TEST_F(ProxyTest, MovesWithItsCalls) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  Offer first{server, spec()};
  Proxy proxy{client, wanted};
  proxy.call({.method = greet}, pack("you"), into_answers());
  Proxy moved{std::move(proxy)};
  ASSERT_TRUE(answered());
  EXPECT_FALSE(answers[0].error);
  moved.call({.method = silent}, {}, into_answers());
  moved = Proxy{client, {.service = ServiceId{0x4321}}};
  ASSERT_TRUE(answered(2));
  EXPECT_EQ(answers[1].error, boost::asio::error::operation_aborted);

  // Knows the first service, so that it can tell when the withdrawal has come, which is sent after the other
  // offer.
  const Proxy witness{client, wanted};
  ASSERT_TRUE(run_until([&] { return !witness.available().empty(); }));
  Offer second{std::move(first)};
  run_for(30ms);
  EXPECT_THAT(witness.available(), SizeIs(1)) << "withdrawn by the move";
  ServiceSpec other = spec();
  other.service = ServiceId{0x4321};
  second = Offer{server, other};  // withdraws the first
  EXPECT_TRUE(run_until([&] { return witness.available().empty(); }));
  EXPECT_TRUE(run_until([&] { return !moved.available().empty(); }));
}

TEST_F(ProxyTest, GivesFuturesToOtherThreads) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, wanted};
  std::atomic<int> good = 0;
  std::vector<std::jthread> threads;
  threads.reserve(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 50; ++n) {
        const std::string name = std::to_string(n);
        auto answer = proxy.call({.method = greet}, pack(name), boost::asio::use_future);
        good += unpack<std::string>(answer.get().payload).value_or("") == "Hello, " + name ? 1 : 0;
      }
      auto refused = proxy.call({.method = refuse}, {}, boost::asio::use_future);
      try {
        refused.get();
      } catch (const boost::system::system_error& error) {
        good += error.code() == ReturnCode{0x21} ? 1 : 0;
      }
    });
  }
  EXPECT_TRUE(run_until([&] { return good == 4 * 51; }));
}

TEST_F(ProxyTest, FollowsTheRulesOfAsioForHandlers) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, wanted};
  // A handler that cannot be copied.
  proxy.call({.method = greet}, pack("you"),
             [this, only = std::make_unique<int>(5)](error_code error, const Response&) {
               answers.push_back({error, {.header = {}, .payload = {std::byte(*only)}}});
             });
  ASSERT_TRUE(answered());
  EXPECT_EQ(to_hex(answers[0].response.payload), "05");
  // It runs on its own executor, which has work as long as the call is outstanding.
  boost::asio::io_context other;
  std::thread::id ran_on;
  proxy.call({.method = greet}, pack("you"),
             boost::asio::bind_executor(
                 other, [&](error_code, const Response&) { ran_on = std::this_thread::get_id(); }));
  std::jthread runner{[&] { other.run(); }};
  const auto runner_id = runner.get_id();
  run_for(1ms);
  EXPECT_TRUE(run_until([&] { return other.stopped(); }));
  runner.join();
  EXPECT_EQ(ran_on, runner_id);
  // Nothing happens until it is asked for.
  auto deferred = proxy.call({.method = greet}, pack("you"), boost::asio::deferred);
  run_for(20ms);
  EXPECT_EQ(greetings, 2);
  std::move(deferred)(into_answers());
  ASSERT_TRUE(answered(2));
  EXPECT_EQ(greetings, 3);
}

TEST_F(ProxyTest, CancelsACallByItsSlot) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, wanted};
  boost::asio::cancellation_signal stop;
  proxy.call({.method = silent}, {}, boost::asio::bind_cancellation_slot(stop.slot(), into_answers()));
  ASSERT_TRUE(run_until([&] { return waiting.size() == 1; }));
  stop.emit(boost::asio::cancellation_type::terminal);
  ASSERT_TRUE(answered());
  EXPECT_EQ(answers[0].error, boost::asio::error::operation_aborted);
  EXPECT_EQ(client.call_counters().cancelled, 1U);
  stop.emit(boost::asio::cancellation_type::terminal);  // the call has ended
  run_for(10ms);
  EXPECT_THAT(answers, SizeIs(1));
}

// It reaches the thread of the node after that has heard of its end.
TEST_F(ProxyTest, CancelsACallThatAnotherThreadHasMadeMeanwhile) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, wanted};
  boost::asio::cancellation_signal stop;
  boost::asio::post(io, [&] {
    std::jthread{[&] {
      proxy.call({.method = silent}, {}, boost::asio::bind_cancellation_slot(stop.slot(), into_answers()));
    }}.join();
    stop.emit(boost::asio::cancellation_type::terminal);
  });
  ASSERT_TRUE(answered());
  EXPECT_EQ(answers[0].error, boost::asio::error::operation_aborted);
}

// Its own from then on, whether it is sent at once, or waits for the service, or in segments, or for the
// other thread.
TEST_F(ProxyTest, NeedsAViewOfThePayloadOnlyUntilTheCallHasBegun) {
  constexpr MethodId echo{1};
  ServiceSpec echoing{.service = ServiceId{0x1234},
                      .instance = InstanceId{1},
                      .tcp_port = std::uint16_t{0},
                      .methods = {{echo, [](const someip::Message& request, Responder responder) {
                                     responder.respond(request.payload);
                                   }}}};
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  const auto call = [&](std::size_t size, Transport transport) {
    std::vector<std::byte> payload = test::numbers(size);
    proxy.call({.method = echo, .timeout = 1h, .transport = transport}, ByteView{payload}, into_answers());
    std::ranges::fill(payload, std::byte{0xee});
  };
  const auto expect = [&](std::initializer_list<std::size_t> sizes) {
    ASSERT_TRUE(answered(sizes.size()));
    std::ranges::sort(answers, {}, [](const Answer& one) { return one.response.payload.size(); });
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      EXPECT_FALSE(answers[i].error) << answers[i].error.message();
      EXPECT_TRUE(answers[i].response.payload == test::numbers(sizes.begin()[i])) << i;
    }
    answers.clear();
  };
  call(10, Transport::udp);
  call(100'000, Transport::udp);
  call(11, Transport::tcp);
  call(100'001, Transport::tcp);
  boost::asio::post(io, [&] {
    call(12, Transport::udp);
    call(13, Transport::tcp);
    call(100'002, Transport::udp);
    call(100'003, Transport::tcp);
  });
  run_for(10ms);
  Node server{io, quick(test::server_address)};
  const Offer offer{server, std::move(echoing)};
  expect({10, 11, 12, 13, 100'000, 100'001, 100'002, 100'003});
  boost::asio::post(io, [&] {
    for (std::size_t i = 0; i < 3; ++i) {
      call(20 + i, Transport::udp);
      call(200'000 + i, Transport::udp);
      call(30 + i, Transport::tcp);
      call(2'000'000 + i, Transport::tcp);
    }
  });
  expect({20, 21, 22, 30, 31, 32, 200'000, 200'001, 200'002, 2'000'000, 2'000'001, 2'000'002});
  std::jthread{[&] { call(50, Transport::udp); }}.join();
  expect({50});
}

// The payload that a handler may only look at is used again, one that it takes is its own.
TEST_F(ProxyTest, LeavesAResponseToWhoTakesIt) {
  constexpr MethodId fill{9};
  ServiceSpec filling = spec();
  filling.methods.push_back({fill, answering([](std::uint32_t size) {
                               return std::vector<std::uint8_t>(size, static_cast<std::uint8_t>(size));
                             })});
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, filling};
  Proxy proxy{client, wanted};
  std::vector<std::vector<std::uint8_t>> seen;
  const auto look = [&](std::uint32_t size) {
    proxy.call({.method = fill}, pack(size), [&](error_code, const Response& response) {
      seen.push_back(unpack<std::vector<std::uint8_t>>(response.payload).value());
    });
    ASSERT_TRUE(run_until([&] { return !seen.empty() && seen.back().size() == size; }));
  };
  look(300'000);
  proxy.call({.method = fill}, pack(std::uint32_t{5}), into_answers());
  ASSERT_TRUE(answered());
  EXPECT_LT(answers[0].response.payload.capacity(), 10'000U) << "room that nobody needs";
  look(4);
  look(7);
  EXPECT_EQ(to_hex(answers[0].response.payload), "000000050505050505");
  EXPECT_EQ(seen, (std::vector<std::vector<std::uint8_t>>{
                      std::vector<std::uint8_t>(300'000, 0xe0), {4, 4, 4, 4}, {7, 7, 7, 7, 7, 7, 7}}));
}

TEST_F(ProxyTest, SendsWhatHasWaitedInItsOrder) {
  std::string came;
  Node client{io, quick(test::client_address)};
  Proxy proxy{client, wanted};
  boost::asio::cancellation_signal stop;
  const auto call = [&](char letter, auto token) {
    proxy.call({.method = MethodId{9}, .timeout = 1h}, pack(static_cast<std::uint8_t>(letter)), token);
  };
  const auto on_answer = [&](error_code error, const Response&) { EXPECT_FALSE(error) << error.message(); };
  call('a', boost::asio::bind_cancellation_slot(stop.slot(), into_answers()));
  for (const char letter : {'b', 'c', 'd', 'e'}) {
    call(letter, on_answer);
  }
  run_for(5ms);
  stop.emit(boost::asio::cancellation_type::terminal);
  ASSERT_TRUE(answered());
  ServiceSpec noting = spec();
  noting.methods.push_back(
      {MethodId{9}, answering([&](std::uint8_t letter) { came.push_back(static_cast<char>(letter)); })});
  Node server{io, quick(test::server_address)};
  const Offer offer{server, noting};
  ASSERT_TRUE(run_until([&] { return came.size() == 4; }));
  EXPECT_EQ(came, "bcde");
}

// As Node::call() does: the first at once, the others with one system call.
TEST_F(ProxyTest, SendsTogetherWhatOneHandlerCalls) {
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, wanted};
  proxy.call({.method = greet}, pack("you"), into_answers());
  ASSERT_TRUE(answered());
  const std::uint64_t before = client.sender_counters().system_calls;
  boost::asio::post(io, [&] {
    for (int i = 0; i < 10; ++i) {
      proxy.call({.method = greet}, pack("you"), into_answers());
    }
  });
  ASSERT_TRUE(answered(11));
  EXPECT_EQ(client.sender_counters().system_calls - before, 2U);
}

TEST_F(ProxyTest, GoesWithFieldsAndSubscriptions) {
  covers({"feat_req_someip_634"});
  constexpr MethodId get{0x10};
  constexpr MethodId set{0x11};
  constexpr MethodId changed{0x8010};
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{
      server,
      {.service = ServiceId{0x1234},
       .instance = InstanceId{1},
       .fields = {{.getter = get,
                   .setter = set,
                   .notifier = changed,
                   .value = pack(20.0),
                   .on_set = someip::typed([](double celsius) { return std::min(celsius, 30.0); })}},
       .eventgroups = {{.id = EventgroupId{1}, .events = {changed}}}}};
  Proxy proxy{client, wanted};
  std::vector<double> seen;
  std::optional<Subscription> subscription{
      std::in_place, client,
      SubscribeSpec{.service = ServiceId{0x1234}, .eventgroup = EventgroupId{1}, .events = {changed}},
      [&](const someip::Message& event, const Endpoint&) {
        seen.push_back(unpack<double>(event.payload).value_or(0));
      }};
  const auto comes = [&](double celsius) {
    return run_until([&] { return !seen.empty() && seen.back() == celsius; });
  };
  ASSERT_TRUE(comes(20.0));
  EXPECT_TRUE(subscription->active());
  proxy.call({.method = set}, pack(99.0), into_answers());
  ASSERT_TRUE(answered());
  EXPECT_EQ(unpack<double>(answers[0].response.payload).value_or(0), 30.0);
  EXPECT_TRUE(comes(30.0));
  EXPECT_EQ(offer.set(changed, pack(25.0)).subscribers, 1U);
  EXPECT_TRUE(comes(25.0));
  EXPECT_EQ(offer.notify(changed, pack(26.0)).subscribers, 1U);
  EXPECT_TRUE(comes(26.0));
  subscription.reset();
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer.handle(), changed) == 0; }));
}

}  // namespace
}  // namespace trestle::sd::proxy_test
