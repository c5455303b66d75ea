// Who notifies or calls faster than may leave is told when there is room again.
#include "sd/net/room.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/use_future.hpp>
#include <thread>

#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"
#include "sd/net/room_watch.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::room_test {
namespace {

using boost::system::error_code;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using test::quick;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

constexpr ServiceId service{0x1234};
constexpr MethodId event{0x8001};
constexpr MethodId method{1};
constexpr TimePoint start{1000s};

class RoomWatchTest : public testing::Test {
 protected:
  void add(int number) {
    watch.add([this, number] { return full.at(number); }, [this, number] { told.push_back(number); }, now);
  }
  void pass(Duration time) {
    const TimePoint end = now + time;
    while (watch.deadline() && *watch.deadline() <= end) {
      now = *watch.deadline();
      ++looks;
      for (const auto& tell : watch.on_time(now)) {
        tell();
      }
    }
    now = end;
  }

  RoomWatch watch;
  TimePoint now = start;
  std::map<int, bool> full{{1, true}, {2, true}, {3, false}};
  std::vector<int> told;
  int looks = 0;
};

TEST_F(RoomWatchTest, TellsOnceWhenThereIsRoom) {
  EXPECT_FALSE(watch.deadline());
  add(1);
  add(2);
  pass(10ms);
  EXPECT_THAT(told, IsEmpty());
  full = {{1, false}, {2, false}};
  pass(16ms);
  EXPECT_THAT(told, ElementsAre(1, 2));
  EXPECT_FALSE(watch.deadline()) << "nobody waits any more";
}

TEST_F(RoomWatchTest, TellsAtOnceIfThereIsRoomAlready) {
  add(3);
  EXPECT_THAT(told, IsEmpty()) << "not from within the call";
  pass({});
  EXPECT_THAT(told, ElementsAre(3));
}

TEST_F(RoomWatchTest, LooksLessOftenWhereItTakesLong) {
  add(1);
  pass(31ms);  // at 0, 1, 3, 7, 15, 31
  EXPECT_EQ(looks, 6);
  pass(1600ms);
  EXPECT_EQ(looks, 106);
  add(3);
  pass({});
  EXPECT_THAT(told, ElementsAre(3)) << "who comes later does not wait for that";
}

class RoomTest : public test::TwoNodes {
 protected:
  static NodeConfig narrow(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.max_queued_bytes = 1 << 20;
    return config;
  }
  ServiceSpec spec() {
    return {.service = service,
            .instance = InstanceId{1},
            .methods = {{method, [](const someip::Message&, Responder responder) { responder.respond(); }}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}};
  }
  auto into_ends() {
    return [this](error_code error) { ends.push_back(error); };
  }

  // So that one message of it fits into what may wait, and needs several bursts.
  const std::vector<std::byte> payload = test::numbers(600'000);
  const ByteView slice{payload};
  std::vector<error_code> ends;
};

TEST_F(RoomTest, IsToldOfToWhoNotifiesFasterThanMayLeave) {
  Node server{io, narrow(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  client.subscribe({.service = service, .eventgroup = EventgroupId{1}, .events = {event}}, collect());
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer.handle(), event) == 1; }));
  const someip::TpPacing slow{.burst = 40, .separation = 1ms};
  const auto notify = [&] { return server.notify(offer.handle(), event, {&slice, 1}, nullptr, slow); };
  EXPECT_EQ(notify().no_room, 0U);
  const Notified refused = notify();
  EXPECT_EQ(refused.subscribers, 0U);
  EXPECT_EQ(refused.dropped, 1U);
  EXPECT_EQ(refused.no_room, 1U);
  offer.room(event, payload.size(), into_ends());
  EXPECT_THAT(ends, IsEmpty()) << "called back from within the call";
  // Each is sent when there is room for it, so that none is lost.
  std::size_t lost = 0;
  ASSERT_TRUE(run_until([&] {
    if (!ends.empty() && events.size() < 5) {
      ends.clear();
      lost += notify().no_room;
      offer.room(event, payload.size(), into_ends());
    }
    return events.size() == 5;
  }));
  EXPECT_EQ(lost, 0U);
  EXPECT_EQ(events.back().payload, payload);
  // What never fits is no matter of room.
  const std::vector<std::byte> huge(2 << 20);
  const ByteView all{huge};
  const Notified too_large = server.notify(offer.handle(), event, {&all, 1});
  EXPECT_EQ(too_large.dropped, 1U);
  EXPECT_EQ(too_large.no_room, 0U);
  EXPECT_THROW(server.when_room(offer.handle(), event, 1, {}), std::invalid_argument);
}

TEST_F(RoomTest, IsThereWhenASlowSubscriberOrTheOfferEnds) {
  NodeConfig config = narrow(test::server_address);
  config.tcp_send_buffer_bytes = 16 << 10;
  Node server{io, config};
  boost::asio::io_context deaf;  // stops to run
  NodeConfig small = quick(test::client_address);
  small.tcp_receive_buffer_bytes = 16 << 10;
  std::optional<Node> client{std::in_place, deaf, small};
  ServiceSpec by_tcp = spec();
  by_tcp.udp_port.reset();
  by_tcp.tcp_port = 0;
  const OfferHandle offer = server.offer(by_tcp);
  client->subscribe(
      {.service = service, .eventgroup = EventgroupId{1}, .events = {event}, .udp = false, .tcp = true},
      collect());
  ASSERT_TRUE(run_until([&] {
    deaf.poll();
    return server.subscribers(offer, event) == 1;
  }));
  while (server.notify(offer, event, {&slice, 1}).no_room == 0) {
  }
  int told = 0;
  server.when_room(offer, event, payload.size(), [&] { ++told; });
  run_for(30ms);
  EXPECT_EQ(told, 0);
  client.reset();
  EXPECT_TRUE(run_until([&] { return told == 1; }));
  server.withdraw(offer);
  server.when_room(offer, event, payload.size(), [&] { ++told; });
  EXPECT_TRUE(run_until([&] { return told == 2; }));
}

TEST_F(RoomTest, IsToldOfToWhoCallsFasterThanMayLeave) {
  Node server{io, quick(test::server_address)};
  Node client{io, narrow(test::client_address)};
  const Offer offer{server, spec()};
  Proxy proxy{client, {.service = service}};
  ASSERT_TRUE(run_until([&] { return !proxy.available().empty(); }));
  const CallSpec call{
      .method = method, .timeout = 60s, .pacing = someip::TpPacing{.burst = 40, .separation = 1ms}};
  std::vector<error_code> answers;
  const auto into_answers = [&](error_code error, const Response&) { answers.push_back(error); };
  proxy.call(call, payload, into_answers);
  proxy.call(call, payload, into_answers);
  ASSERT_TRUE(run_until([&] { return answers.size() == 1; }));
  EXPECT_EQ(answers[0], CallFault::not_sent);
  proxy.room(call, payload.size(), into_ends());
  ASSERT_TRUE(run_until([&] { return !ends.empty(); }));
  EXPECT_FALSE(ends[0]);
  proxy.call(call, payload, into_answers);
  ASSERT_TRUE(run_until([&] { return answers.size() == 3; }));
  EXPECT_THAT(answers, ElementsAre(make_error_code(CallFault::not_sent), error_code{}, error_code{}));
}

TEST_F(RoomTest, CanBeWaitedForOnAnotherThreadAndCancelled) {
  Node server{io, narrow(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server, spec()};
  client.subscribe({.service = service, .eventgroup = EventgroupId{1}, .events = {event}}, collect());
  ASSERT_TRUE(run_until([&] { return server.subscribers(offer.handle(), event) == 1; }));
  const someip::TpPacing never{.burst = 1, .separation = 1h};
  while (server.notify(offer.handle(), event, {&slice, 1}, nullptr, never).no_room == 0) {
  }
  boost::asio::cancellation_signal stop;
  offer.room(event, payload.size(), boost::asio::bind_cancellation_slot(stop.slot(), into_ends()));
  run_for(5ms);
  EXPECT_THAT(ends, IsEmpty());
  stop.emit(boost::asio::cancellation_type::terminal);
  ASSERT_TRUE(run_until([&] { return !ends.empty(); }));
  EXPECT_THAT(ends, ElementsAre(error_code{boost::asio::error::operation_aborted}));
  bool waited = false;
  std::thread waiting{[&] {
    offer.room(event, 1000, boost::asio::use_future).get();  // there is room for so little
    boost::asio::post(io, [&] { waited = true; });
  }};
  EXPECT_TRUE(run_until([&] { return waited; }));
  waiting.join();
}

}  // namespace
}  // namespace trestle::sd::room_test
