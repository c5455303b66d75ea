// Two devices of the C interface that talk with each other: every happening, every function, and what they
// carry.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include "trestle.h"

namespace {

#define SERVER_LIMITS 1, 2, 4, 2, 2, 0, 0, 0, 0, 4, 4, 4, 256, 1, 4096, 2
#define CLIENT_LIMITS 0, 0, 0, 0, 2, 2, 3, 2, 4, 8, 8, 4, 256, 1, 4096, 0

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t ms = 1'000'000;

struct Sent {
  trestle_endpoint from{};
  trestle_endpoint to{};
  Bytes bytes;
};

struct Happened {
  trestle_happening what{};
  Bytes payload;
};

bool same(const trestle_endpoint& a, const trestle_endpoint& b) {
  return a.port == b.port && a.v6 == b.v6 && std::equal(a.address, a.address + 4, b.address);
}

/// One of them, and all that happened to it.
struct Party {
  trestle_settings settings{};
  trestle_device* device = nullptr;
  std::vector<Happened> happened;

  void poll(std::uint64_t now, std::deque<Sent>& network) {
    std::uint64_t deadline = 0;
    if (trestle_deadline(device, &deadline) && deadline <= now) {
      trestle_on_time(device, now);
    }
    bool more = true;
    while (more) {
      std::array<std::uint8_t, TRESTLE_DATAGRAM_BYTES> room{};
      trestle_transmit out{};
      while (trestle_poll_transmit(device, room.data(), room.size(), now, &out)) {
        trestle_endpoint from = settings.own;
        from.port = out.from_port;
        network.push_back({from, out.to, Bytes(out.bytes, out.bytes + out.size)});
      }
      trestle_happening what{};
      more = trestle_poll_happening(device, &what);
      if (more) {
        const bool sized = what.kind != TRESTLE_SEND_FINISHED && what.size != 0;
        happened.push_back({what, sized ? Bytes(what.payload, what.payload + what.size) : Bytes{}});
      }
    }
  }
  /// The happenings of that kind, which are forgotten.
  std::vector<Happened> take(trestle_happening_kind kind) {
    std::vector<Happened> taken;
    std::erase_if(happened, [&](const Happened& one) {
      if (one.what.kind == kind) {
        taken.push_back(one);
      }
      return one.what.kind == kind;
    });
    return taken;
  }
};

class TrestleCConversation : public testing::Test {
 protected:
  TrestleCConversation() {
    trestle_default_settings(&server.settings);
    trestle_default_settings(&client.settings);
    server.settings.own.address[0] = client.settings.own.address[0] = 10;
    server.settings.own.address[3] = 1;
    client.settings.own.address[3] = 2;
    client.settings.client = 0x0102;
    service.service = 0x1234;
    service.instance = 7;
    service.major = 3;
    service.port = 30501;
    service.methods = methods.data();
    service.method_count = methods.size();
    service.events = events.data();
    service.event_count = events.size();
    fields[0] = {0, 0x0010, 0x8010, {1}, plain.data(), plain.size(), true, 2, false};
    fields[1] = {0x0021, 0x0020, 0x8020, {1}, judged.data(), judged.size(), false, 0, true};
    service.fields = fields.data();
    service.field_count = fields.size();
    service.eventgroups = offered_groups.data();
    service.eventgroup_count = offered_groups.size();
    server.settings.services = &service;
    server.settings.service_count = 1;
    needs[0] = {0x9999, 1, 1, 30600, 0, wanted_groups.data(), 1};
    needs[1] = {0x1234, 7, 3, 30601, 0, wanted_groups.data(), wanted_groups.size()};
    client.settings.needs = needs.data();
    client.settings.need_count = needs.size();
    EXPECT_EQ(trestle_init(server_memory.data(), sizeof server_memory, &server_limits, &server.settings,
                           &server.device),
              TRESTLE_OK);
    EXPECT_EQ(trestle_init(client_memory.data(), sizeof client_memory, &client_limits, &client.settings,
                           &client.device),
              TRESTLE_OK);
  }

  /// Lets so much time pass, in steps of a millisecond.
  void pass(unsigned milliseconds) {
    for (unsigned i = 0; i <= milliseconds; ++i, now += ms) {
      std::deque<Sent> network;
      do {
        server.poll(now, network);
        client.poll(now, network);
        for (; !network.empty(); network.pop_front()) {
          const Sent& datagram = network.front();
          for (Party* const to : {&server, &client}) {
            const bool is_for_all = datagram.to.address[0] >= 224;
            if (is_for_all ? !same(datagram.from, to->settings.own)
                           : datagram.to.address[3] == to->settings.own.address[3]) {
              trestle_on_datagram(to->device, datagram.bytes.data(), datagram.bytes.size(), &datagram.from,
                                  &datagram.to, now);
            }
          }
          server.poll(now, network);
          client.poll(now, network);
        }
      } while (!network.empty());
    }
  }
  /// The server offers, and the client has found it and subscribed.
  void meet() {
    ASSERT_EQ(trestle_offer(server.device, 0, now), TRESTLE_OK);
    ASSERT_EQ(trestle_require(client.device, 1, now), TRESTLE_OK);
    pass(500);
    ASSERT_TRUE(trestle_available(client.device, 1));
  }
  std::uint32_t call(std::uint16_t method, const Bytes& payload) {
    std::uint32_t number = 0;
    EXPECT_EQ(trestle_call(client.device, 1, method, payload.data(), payload.size(), 100 * ms, now, &number),
              TRESTLE_OK);
    pass(0);
    return number;
  }
  trestle_endpoint at(std::uint8_t host, std::uint16_t port) const {
    trestle_endpoint endpoint = server.settings.own;
    endpoint.address[3] = host;
    endpoint.port = port;
    return endpoint;
  }

  const std::array<std::uint16_t, 2> offered_groups{1, 3};
  const std::array<std::uint16_t, 2> wanted_groups{1, 2};
  const std::array<trestle_method, 2> methods{
      {{0x0001, TRESTLE_REQUEST_RESPONSE}, {0x0002, TRESTLE_FIRE_AND_FORGET}}};
  const std::array<trestle_event, 2> events{{{0x8001, {1}}, {0x8002, {3}}}};
  std::array<std::uint8_t, 4> plain{0x11, 0x22};
  std::array<std::uint8_t, 4> judged{};
  std::array<trestle_field, 2> fields{};
  trestle_service service{};
  std::array<trestle_need, 2> needs{};
  const trestle_limits server_limits{SERVER_LIMITS};
  const trestle_limits client_limits{CLIENT_LIMITS};
  std::array<std::uint64_t, TRESTLE_MEMORY_BYTES(SERVER_LIMITS) / 8> server_memory{};
  std::array<std::uint64_t, TRESTLE_MEMORY_BYTES(CLIENT_LIMITS) / 8> client_memory{};
  Party server;
  Party client;
  std::uint64_t now = 1'000 * ms;
};

TEST_F(TrestleCConversation, FindsAndSubscribes) {
  std::uint32_t number = 0;
  ASSERT_EQ(trestle_require(client.device, 1, now), TRESTLE_OK);
  EXPECT_EQ(trestle_require(client.device, 1, now), TRESTLE_DUPLICATE);
  EXPECT_EQ(trestle_call(client.device, 1, 0x0001, nullptr, 0, 100 * ms, now, &number), TRESTLE_UNAVAILABLE);
  EXPECT_EQ(trestle_tell(client.device, 1, 0x0002, nullptr, 0), TRESTLE_UNAVAILABLE);
  EXPECT_FALSE(trestle_available(client.device, 1));
  ASSERT_EQ(trestle_offer(server.device, 0, now), TRESTLE_OK);
  pass(500);
  EXPECT_TRUE(trestle_available(client.device, 1));
  EXPECT_FALSE(trestle_available(client.device, 0));

  const auto found = client.take(TRESTLE_SERVICE_AVAILABLE);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].what.index, 1U);
  EXPECT_TRUE(same(found[0].what.peer, at(1, 30501)));
  const auto subscribed = client.take(TRESTLE_SUBSCRIBED);
  ASSERT_EQ(subscribed.size(), 1U);
  EXPECT_EQ(subscribed[0].what.index, 1U);
  EXPECT_EQ(subscribed[0].what.part, 0U);
  EXPECT_EQ(subscribed[0].what.peer.port, 0);
  const auto refused = client.take(TRESTLE_SUBSCRIPTION_REFUSED);  // of the eventgroup that there is none of
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0].what.index, 1U);
  EXPECT_EQ(refused[0].what.part, 1U);
  const auto subscriber = server.take(TRESTLE_SUBSCRIBER_ADDED);
  ASSERT_EQ(subscriber.size(), 1U);
  EXPECT_EQ(subscriber[0].what.index, 0U);
  EXPECT_EQ(subscriber[0].what.eventgroup, 1);
  EXPECT_TRUE(same(subscriber[0].what.peer, at(2, 30601)));
  EXPECT_EQ(trestle_subscribers(server.device, 0, 0x8001), 1U);
  EXPECT_EQ(trestle_subscribers(server.device, 0, 0x8002), 0U);  // of another eventgroup

  const auto initial = client.take(TRESTLE_EVENT);  // of the field that has a value
  ASSERT_EQ(initial.size(), 1U);
  EXPECT_EQ(initial[0].what.index, 1U);
  EXPECT_EQ(initial[0].what.part, 0U);
  EXPECT_EQ(initial[0].what.method, 0x8010);
  EXPECT_EQ(initial[0].payload, (Bytes{0x11, 0x22}));
}

TEST_F(TrestleCConversation, Calls) {
  meet();
  const std::uint32_t first = call(0x0001, {1, 2, 3});
  const std::uint32_t second = call(0x0001, {4});
  EXPECT_NE(first, 0U);
  EXPECT_NE(first, second);
  const auto requests = server.take(TRESTLE_REQUEST);
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests[0].what.method, 0x0001);
  EXPECT_EQ(requests[0].what.request.service, 0U);
  EXPECT_EQ(requests[0].what.request.service_id, 0x1234);
  EXPECT_EQ(requests[0].what.request.client, 0x0102);
  EXPECT_EQ(requests[0].what.request.interface_version, 3);
  EXPECT_TRUE(same(requests[0].what.request.from, at(2, 30601)));
  EXPECT_EQ(requests[0].payload, (Bytes{1, 2, 3}));
  const Bytes answer{9, 8};
  EXPECT_EQ(trestle_respond_error(server.device, &requests[1].what.request, 0x21), TRESTLE_OK);
  EXPECT_EQ(trestle_respond(server.device, &requests[0].what.request, answer.data(), answer.size()),
            TRESTLE_OK);
  pass(0);
  const auto ended = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(ended.size(), 2U);
  EXPECT_EQ(ended[0].what.call, second);
  EXPECT_TRUE(ended[0].what.answered);
  EXPECT_EQ(ended[0].what.return_code, 0x21);
  EXPECT_EQ(ended[1].what.call, first);
  EXPECT_TRUE(ended[1].what.answered);
  EXPECT_EQ(ended[1].what.return_code, TRESTLE_E_OK);
  EXPECT_EQ(ended[1].payload, answer);

  const std::uint32_t cancelled = call(0x0001, {});
  const std::uint32_t late = call(0x0001, {});
  EXPECT_TRUE(trestle_cancel(client.device, cancelled));
  EXPECT_FALSE(trestle_cancel(client.device, cancelled));
  pass(98);
  EXPECT_TRUE(client.take(TRESTLE_CALL_ENDED).empty());
  pass(2);
  const auto timed_out = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(timed_out.size(), 1U);
  EXPECT_EQ(timed_out[0].what.call, late);
  EXPECT_FALSE(timed_out[0].what.answered);
  EXPECT_EQ(timed_out[0].what.return_code, TRESTLE_E_TIMEOUT);

  server.happened.clear();
  const Bytes told{5};
  EXPECT_EQ(trestle_tell(client.device, 1, 0x0002, told.data(), told.size()), TRESTLE_OK);
  pass(0);
  const auto heard = server.take(TRESTLE_REQUEST);
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(heard[0].what.method, 0x0002);
  EXPECT_EQ(heard[0].payload, told);
}

TEST_F(TrestleCConversation, SetsFields) {
  meet();
  client.happened.clear();
  const std::uint32_t set = call(0x0010, {0x33});
  const auto at_server = server.take(TRESTLE_FIELD_SET);
  ASSERT_EQ(at_server.size(), 1U);
  EXPECT_EQ(at_server[0].what.index, 0U);
  EXPECT_EQ(at_server[0].what.part, 0U);
  EXPECT_EQ(at_server[0].payload, Bytes{0x33});
  auto ended = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended[0].what.call, set);
  EXPECT_EQ(ended[0].payload, Bytes{0x33});
  auto notified = client.take(TRESTLE_EVENT);
  ASSERT_EQ(notified.size(), 1U);
  EXPECT_EQ(notified[0].what.method, 0x8010);
  EXPECT_EQ(notified[0].payload, Bytes{0x33});

  call(0x0020, {0x44, 0x45});  // which the application judges
  const auto wish = server.take(TRESTLE_REQUEST);
  ASSERT_EQ(wish.size(), 1U);
  EXPECT_EQ(wish[0].what.method, 0x0020);
  EXPECT_EQ(wish[0].payload, (Bytes{0x44, 0x45}));
  const Bytes decided{0x46};
  EXPECT_EQ(trestle_accept(server.device, &wish[0].what.request, decided.data(), decided.size()), TRESTLE_OK);
  pass(0);
  ended = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended[0].payload, decided);
  notified = client.take(TRESTLE_EVENT);
  ASSERT_EQ(notified.size(), 1U);
  EXPECT_EQ(notified[0].what.method, 0x8020);
  EXPECT_EQ(notified[0].payload, decided);

  const Bytes own{0x47, 0x48, 0x49, 0x4a};
  EXPECT_EQ(trestle_set_field(server.device, 0, 1, own.data(), own.size()), TRESTLE_OK);
  EXPECT_EQ(trestle_set_field(server.device, 0, 1, own.data(), 5), TRESTLE_TOO_LARGE);
  EXPECT_EQ(trestle_set_field(server.device, 0, 2, own.data(), 4), TRESTLE_BAD_ARGUMENT);
  call(0x0021, {});
  ended = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended[0].payload, own);
}

TEST_F(TrestleCConversation, SendsWhatIsLargeFromWhereItStands) {
  meet();
  client.happened.clear();
  Bytes small(trestle_max_copied_bytes(server.device), 0x5a);
  ASSERT_EQ(trestle_notify(server.device, 0, 0x8001, small.data(), small.size()), TRESTLE_OK);
  small.assign(small.size(), 0);
  Bytes large(4096);
  for (std::size_t i = 0; i < large.size(); ++i) {
    large[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  }
  ASSERT_EQ(trestle_notify(server.device, 0, 0x8001, large.data(), large.size()), TRESTLE_OK);
  pass(50);
  const auto received = client.take(TRESTLE_EVENT);
  ASSERT_EQ(received.size(), 2U);
  EXPECT_EQ(received[0].payload, Bytes(small.size(), 0x5a));
  EXPECT_EQ(received[1].what.method, 0x8001);
  EXPECT_EQ(received[1].payload, large);
  const auto finished = server.take(TRESTLE_SEND_FINISHED);
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_EQ(finished[0].what.payload, large.data());

  call(0x0001, {});
  const auto request = server.take(TRESTLE_REQUEST);
  ASSERT_EQ(request.size(), 1U);
  ASSERT_EQ(trestle_respond(server.device, &request[0].what.request, large.data(), large.size()), TRESTLE_OK);
  pass(50);
  const auto ended = client.take(TRESTLE_CALL_ENDED);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_TRUE(ended[0].what.answered);
  EXPECT_EQ(ended[0].payload, large);
}

TEST_F(TrestleCConversation, LosesEachOther) {
  meet();
  trestle_withdraw(server.device, 0, now);
  pass(1);
  const auto lost = client.take(TRESTLE_SERVICE_LOST);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].what.index, 1U);
  EXPECT_TRUE(same(lost[0].what.peer, at(1, 30501)));
  EXPECT_TRUE(server.take(TRESTLE_SUBSCRIBER_REMOVED).empty());  // it has removed them itself
  EXPECT_EQ(trestle_notify(server.device, 0, 0x8001, nullptr, 0), TRESTLE_NOT_OFFERED);

  ASSERT_EQ(trestle_offer(server.device, 0, now), TRESTLE_OK);
  pass(3'000);
  ASSERT_EQ(trestle_subscribers(server.device, 0, 0x8001), 1U);
  server.happened.clear();
  const trestle_endpoint receiver = at(2, 30601);
  trestle_unreachable(server.device, &receiver);
  pass(0);
  const auto removed = server.take(TRESTLE_SUBSCRIBER_REMOVED);
  ASSERT_EQ(removed.size(), 1U);
  EXPECT_EQ(removed[0].what.eventgroup, 1);
  EXPECT_TRUE(same(removed[0].what.peer, receiver));

  trestle_link_down(client.device);
  pass(0);
  EXPECT_EQ(client.take(TRESTLE_SERVICE_LOST).size(), 1U);
  trestle_link_up(client.device, now);
  pass(3'000);
  EXPECT_TRUE(trestle_available(client.device, 1));

  trestle_release(client.device, 1, now);
  pass(1);
  EXPECT_FALSE(trestle_available(client.device, 1));
  EXPECT_EQ(trestle_subscribers(server.device, 0, 0x8001), 0U);

  ASSERT_EQ(trestle_require(client.device, 1, now), TRESTLE_OK);
  pass(3'000);
  ASSERT_TRUE(trestle_available(client.device, 1));
  trestle_shutdown(server.device, now);
  pass(1);
  EXPECT_FALSE(trestle_available(client.device, 1));
}

TEST_F(TrestleCConversation, Counts) {
  meet();
  trestle_counters before{};
  trestle_get_counters(client.device, &before);
  call(0x0001, {1});
  const auto request = server.take(TRESTLE_REQUEST);
  ASSERT_EQ(request.size(), 1U);
  ASSERT_EQ(trestle_respond(server.device, &request[0].what.request, nullptr, 0), TRESTLE_OK);
  ASSERT_EQ(trestle_notify(server.device, 0, 0x8001, nullptr, 0), TRESTLE_OK);
  pass(0);
  const std::array<std::uint8_t, 3> rubbish{1, 2, 3};
  const trestle_endpoint from = at(1, 30501);
  const trestle_endpoint to = at(2, 30601);
  trestle_on_datagram(client.device, rubbish.data(), rubbish.size(), &from, &to, now);
  pass(0);
  trestle_counters after{};
  trestle_get_counters(client.device, &after);
  EXPECT_EQ(after.datagrams_sent - before.datagrams_sent, 1U);
  EXPECT_EQ(after.datagrams_received - before.datagrams_received, 3U);
  EXPECT_EQ(after.events - before.events, 1U);
  EXPECT_EQ(after.malformed - before.malformed, 1U);
  EXPECT_EQ(after.unexpected, 0U);
  trestle_get_counters(server.device, &after);
  EXPECT_EQ(after.requests, 1U);
}

}  // namespace
