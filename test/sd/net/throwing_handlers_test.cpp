// Handlers that throw: their exceptions come out of the io_context, and the Node goes on as if they had not.
#include <stdexcept>

#include "test/bytes.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::throwing_handlers_test {
namespace {

using test::quick;
using ::testing::ElementsAre;
using namespace std::chrono_literals;

class ThrowingHandlers : public test::TwoNodes {
 protected:
  static constexpr someip::MethodId call{0x0001};
  static constexpr someip::MethodId tell{0x0002};
  static constexpr someip::MethodId event{0x8001};

  ServiceSpec service(std::uint16_t id = 0x1234) {
    const auto note = [this](const someip::Message& request, const Responder&) {
      told.push_back(test::to_hex(request.payload));
      if (told.size() == 1) {
        throw std::runtime_error{"a request"};
      }
    };
    return {.service = ServiceId{id},
            .instance = InstanceId{1},
            .tcp_port = 0,
            .methods = {{call, note}, {tell, note, someip::MethodKind::fire_and_forget}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}};
  }
  static SubscribeSpec wanted(std::uint16_t id = 0x1234) {
    return {.service = ServiceId{id}, .eventgroup = EventgroupId{1}, .events = {event}};
  }
  /// run_until(), as a program would that does not end at exceptions.
  template <typename Condition>
  bool run_on_until(Condition condition) {
    for (;;) {
      try {
        return run_until(condition);
      } catch (const std::runtime_error& error) {
        caught.emplace_back(error.what());
      }
    }
  }
  void run_on_for(std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    run_on_until([end] { return std::chrono::steady_clock::now() >= end; });
  }

  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  std::vector<std::string> caught;
  std::vector<std::string> told;
};

TEST_F(ThrowingHandlers, OfAvailabilityDoNotStopDiscovery) {
  const RequirementId found =
      client.require({.service = ServiceId{0x1234}}, [](const RemoteService&, bool available) {
        throw std::runtime_error{available ? "available" : "gone"};
      });
  const OfferHandle offer = server.offer(service());
  ASSERT_TRUE(run_on_until([&] { return !client.available(found).empty() && !caught.empty(); }));
  EXPECT_THAT(caught, ElementsAre("available"));
  // All of this needs discovery to go on.
  server.offer(service(0x1235));
  const SubscriptionId other = client.subscribe(wanted(0x1235), collect());
  EXPECT_TRUE(run_on_until([&] { return client.subscribed(other); }));
  server.withdraw(offer);
  EXPECT_TRUE(run_on_until([&] { return caught.size() == 2; }));
  EXPECT_THAT(caught, ElementsAre("available", "gone"));
}

TEST_F(ThrowingHandlers, OfEventsDoNotKeepThemFromOthers) {
  const OfferHandle offer = server.offer(service());
  const SubscriptionId first =
      client.subscribe(wanted(), [](const someip::Message& message, const Endpoint&) {
        throw std::runtime_error{test::to_hex(message.payload)};
      });
  client.subscribe(wanted(), collect());
  ASSERT_TRUE(run_on_until([&] { return client.subscribed(first); }));
  for (const std::string payload : {"01", "02", "03"}) {  // which arrive together
    const auto bytes = test::hex(payload);
    const ByteView slice{bytes};
    EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U);
  }
  ASSERT_TRUE(run_on_until([&] { return events.size() == 3 && caught.size() == 3; }));
  EXPECT_THAT(caught, ElementsAre("01", "02", "03"));
}

TEST_F(ThrowingHandlers, OfRequestsAnswerNotOkAndLoseNoneThatFollow) {
  for (const Transport transport : {Transport::tcp, Transport::udp}) {
    told.clear();
    outcomes.clear();
    caught.clear();
    const OfferHandle offer = server.offer(service());
    const RequirementId found = client.require({.service = ServiceId{0x1234}});
    ASSERT_TRUE(run_on_until([&] { return !client.available(found).empty(); }));
    client.call(found, {.method = call, .transport = transport}, {}, note());
    for (const std::string payload : {"01", "02"}) {
      const auto bytes = test::hex(payload);
      const ByteView slice{bytes};
      EXPECT_TRUE(client.send(found, {.method = tell, .transport = transport}, {&slice, 1}));
    }
    ASSERT_TRUE(run_on_until([&] { return told.size() == 3 && outcomes.size() == 1; }));
    EXPECT_THAT(told, ElementsAre("", "01", "02"));
    EXPECT_EQ(outcomes[0].fault, CallFault::error);
    EXPECT_EQ(outcomes[0].code, someip::ReturnCode::not_ok);
    run_on_for(10ms);
    EXPECT_THAT(caught, ElementsAre("a request"));
    // The next round begins when the client knows that this service is gone.
    server.withdraw(offer);
    ASSERT_TRUE(run_on_until([&] { return client.available(found).empty(); }));
    client.release(found);
  }
}

TEST_F(ThrowingHandlers, OfCallsDoNotKeepOthersFromEnding) {
  ServiceSpec silent = service();
  std::vector<Responder> kept;
  silent.methods = {
      {call, [&](const someip::Message&, Responder responder) { kept.push_back(std::move(responder)); }}};
  server.offer(silent);
  const RequirementId found = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_on_until([&] { return !client.available(found).empty(); }));
  for (int i = 0; i < 3; ++i) {
    client.call(found, {.method = call, .timeout = 30ms}, {},
                [](const CallResult& result) { throw std::runtime_error{to_string(result.error().fault)}; });
  }
  client.call(found, {.method = call, .timeout = 60ms}, {}, note());
  ASSERT_TRUE(run_on_until([&] { return outcomes.size() == 1 && caught.size() == 3; }));
  EXPECT_EQ(outcomes[0].fault, CallFault::timed_out);
  EXPECT_THAT(caught, ElementsAre("timed_out", "timed_out", "timed_out"));
}

}  // namespace
}  // namespace trestle::sd::throwing_handlers_test
