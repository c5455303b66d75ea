#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// How long a device may take to come to itself again after a burst: so many times the time for an answer.
constexpr int recovery = 5;
/// It has said everything when it said nothing for so long.
constexpr Duration quiet = 200ms;
constexpr Duration patience = 10s;

/// That the device answers as before. What was lost in a burst is nobody's fault. What a slow device still
/// says to it is waited for, as later it would look like the answer to something else.
void recovers(Trial& t) {
  for (int count = 0; count < recovery; ++count) {
    if (t.alive()) {
      const auto to_us = [&](const SeenEntry& seen) { return seen.packet->to == t.tester.sd(); };
      std::optional<WallTime> began;
      while (const auto seen = t.await_entry(t.now(), quiet, to_us)) {
        began = began.value_or(seen->packet->time);
        if (seen->packet->time - *began > patience) {
          break;
        }
      }
      return;
    }
  }
  t.missing("the device does not answer any more after this",
            "an answer to a Find, and to the request of the profile");
}

void burst_of_requests(Trial& t) {
  constexpr std::uint16_t many = 500;
  t.udp();
  const std::size_t since = t.now();
  Call call = t.request();
  call.client = someip::ClientId{0x5a51};
  for (std::uint16_t session = 1; session <= many; ++session) {
    call.session = someip::SessionId{session};
    t.send(call);
  }
  recovers(t);
  std::vector<int> answers(many + 1U);
  for (const SeenMessage& seen : t.messages_since(since, [&](const SeenMessage& one) {
         return one.message.header.client == call.client && value(one.message.header.session) <= many;
       })) {
    if (++answers[value(seen.message.header.session)] == 2) {
      t.different("answers to one request", "1 at most", "2", seen.packet);
      return;
    }
  }
}

void burst_of_finds(Trial& t) {
  for (int count = 0; count < 500; ++count) {
    t.send_sd({.entries = {Trial::find_entry(t.profile.service())}}, count % 2 == 0, "FindService");
  }
  recovers(t);
}

/// One message with as many Subscribes as fit, all of eventgroups that are not there.
void flood_of_entries(Trial& t) {
  SdStimulus stimulus = t.subscribe(t.eventgroup());
  sd::Entry entry = stimulus.entries.front();
  stimulus.entries.clear();
  for (std::uint16_t number = 0; number < 80; ++number) {
    entry.tail = sd::Entry::eventgroup_tail(someip::EventgroupId{static_cast<std::uint16_t>(0x7000 + number)},
                                            0, false);
    stimulus.entries.push_back(entry);
  }
  for (int count = 0; count < 20; ++count) {
    t.send_sd(stimulus);
  }
  recovers(t);
  // The device may still be refusing what was sent before: only an answer to this Subscribe counts.
  const SdStimulus good = t.subscribe(t.eventgroup());
  const std::size_t since = t.now();
  for (int count = 0; count < recovery; ++count) {
    t.send_sd(good);
    if (const auto seen =
            t.await_entry(since, t.profile.timing.answer_within, Trial::is_answer_to(good.entries.front()))) {
      t.unsubscribe(good);
      if (seen->entry.ttl_s == 0) {
        t.fail("the subscription is refused (SubscribeEventgroupNack)", "a SubscribeEventgroupAck",
               "a SubscribeEventgroupNack", seen->packet);
      }
      return;
    }
  }
  t.missing("no answer to SubscribeEventgroup", "a SubscribeEventgroupAck");
}

/// Datagrams whose bytes mean nothing; every other one begins like a message.
void garbage(Trial& t, const std::function<void(ByteView datagram)>& send, const Bytes& beginning) {
  for (int count = 0; count < 300; ++count) {
    Bytes datagram = count % 2 == 0 ? beginning : Bytes{};
    const std::size_t size = t.random() % 400;
    for (std::size_t at = 0; at < size; ++at) {
      append_u8(datagram, static_cast<std::uint8_t>(t.random()));
    }
    if (!datagram.empty()) {
      send(datagram);
    }
  }
  recovers(t);
}

/// Large messages that begin, and never end: to a method that takes segments, where there is one. Who knows
/// none has to survive them, too.
void unfinished(Trial& t) {
  const auto large = large_request(t.profile);
  Call call = t.request();
  call.method = large ? large->method : call.method;
  call.client = someip::ClientId{0x5a52};
  call.type = someip::MessageType::tp_request;
  for (std::uint16_t session = 1; session <= 200; ++session) {
    call.session = someip::SessionId{session};
    call.payload.clear();
    append_u32(call.payload, someip::to_word({.offset = 0, .more = true}));
    call.payload.resize(call.payload.size() + 1392);
    t.send(call);
  }
  recovers(t);
}

/// More than most devices have room for, each at a port of its own. Those that are accepted have to be
/// served.
void many_subscribers(Trial& t) {
  constexpr int many = 100;
  const EventSource source = t.source();
  std::vector<Endpoint> accepted;
  for (int count = 0; count < many; ++count) {
    const Endpoint own = t.tester.local(count == 0 ? t.udp() : t.tester.open_udp());
    const SdStimulus stimulus =
        t.subscribe(t.profile.service(), source.group, {endpoint_option(own, Transport::udp)});
    if (t.answer_to(stimulus).entry.ttl_s != 0) {
      accepted.push_back(own);
    }
  }
  if (accepted.empty()) {
    t.missing("none of the subscribers is accepted", "a SubscribeEventgroupAck");
  }
  const std::size_t since = t.now();
  const auto events = [&] { return t.messages_since(since, t.is_event(source.event)); };
  const auto served = [&] {
    const auto seen = events();
    return std::ranges::count_if(accepted, [&](const Endpoint& one) {
      return std::ranges::any_of(seen, [&](const SeenMessage& event) { return event.packet->to == one; });
    });
  };
  const auto all = static_cast<std::ptrdiff_t>(accepted.size());
  std::size_t asked = 0;
  const auto ask = [&] {
    ++asked;
    t.ask_for(source);
  };
  const auto are_served = [&] { return served() == all; };
  (void)(source.trigger ? t.ask(ask, are_served) : t.ask_for(source, are_served));
  t.pass();
  t.equal("subscribers that got the event", all, served(), nullptr);
  std::size_t others = 0;
  for (const SeenMessage& seen : events()) {
    others += std::ranges::count(accepted, seen.packet->to) == 0 ? 1U : 0U;
  }
  t.equal("events to subscribers that were refused", std::size_t{0}, others, nullptr);
  if (source.trigger) {
    t.require(events().size() <= asked * accepted.size(), "events",
              fmt::format("{} at most", asked * accepted.size()), std::to_string(events().size()), nullptr);
  }
}

/// @param bytes   what is sent on each of the connections.
/// @param closed  and then our half of it is closed.
void many_connections(Trial& t, int count, ByteView bytes, bool closed = false) {
  std::vector<PortId> open;
  for (int number = 0; number < count; ++number) {
    if (const auto one = t.tester.connect(t.tcp_of(t.profile.service()), t.profile.timing.answer_within)) {
      open.push_back(*one);
      if (!bytes.empty()) {
        t.tester.send(*one, bytes);
      }
      if (closed) {
        t.tester.close_half(*one);
      }
    }
  }
  if (open.empty()) {
    t.missing("no TCP connection to the offered port", "a TCP connection");
  }
  recovers(t);
  for (const PortId one : open) {
    t.tester.close(one);
  }
  // The device needs not take any more while these are open, but afterwards.
  Call call = t.request();
  call.transport = Transport::tcp;
  for (int tries = 0; tries < recovery; ++tries) {
    const auto again = t.tester.connect(t.tcp_of(t.profile.service()), t.profile.timing.answer_within);
    if (!again) {
      continue;
    }
    const std::size_t since = t.now();
    const Call sent = t.send(call, t.tcp_of(t.profile.service()), *again);
    if (t.await_message(since, t.profile.timing.answer_within, Trial::is_answer_to(sent))) {
      return;
    }
    t.tester.close(*again);
  }
  t.missing("no answer over TCP after the other connections have ended", "a response");
}

}  // namespace

void add_load_cases(Cases& cases) {
  const Need call = Need::udp | Need::request;
  const Cases all{
      {.id = "load.burst.requests",
       .title = "survives 500 requests at once, and answers none of them twice",
       .requirements = {"feat_req_someip_80", "feat_req_someip_83"},
       .needs = call,
       .budget = 30s,
       .run = burst_of_requests},
      {.id = "load.burst.finds",
       .title = "survives 500 Finds at once",
       .requirements = {"feat_req_someipsd_824", "feat_req_someipsd_1163"},
       .budget = 30s,
       .run = burst_of_finds},
      {.id = "load.flood.entries",
       .title = "survives messages full of Subscribes of what is not there, and serves others afterwards",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_1164"},
       .needs = Need::eventgroup,
       .budget = 30s,
       .run = flood_of_entries},
      {.id = "load.flood.discovery-garbage",
       .title = "survives datagrams to service discovery that mean nothing",
       .requirements = {"feat_req_someipsd_1163", "feat_req_someipsd_1220"},
       .budget = 30s,
       .run =
           [](Trial& t) {
             garbage(
                 t,
                 [&](ByteView datagram) {
                   t.tester.send_sd(datagram, {t.profile.device, t.profile.sd_port});
                 },
                 bytes({0xff, 0xff, 0x81, 0x00, 0, 0, 0, 0x80, 0, 0, 0, 1, 1, 1, 2, 0}));
           }},
      {.id = "load.flood.service-garbage",
       .title = "survives datagrams to its service that mean nothing",
       .requirements = {"feat_req_someip_798", "feat_req_someip_718"},
       .needs = Need::udp,
       .budget = 30s,
       .run =
           [](Trial& t) {
             Bytes beginning = t.request().encode();
             beginning.resize(12);
             garbage(
                 t, [&](ByteView datagram) { t.send_bytes(datagram); }, beginning);
           }},
      {.id = "load.flood.segments",
       .title = "survives 200 large requests of which only the first segment comes",
       .requirements = {"feat_req_someiptp_793"},
       .needs = Need::udp,
       .budget = 30s,
       .run = unfinished},
      {.id = "load.peers.subscribers",
       .title = "acknowledges or refuses each of 100 subscribers, at 100 ports of one host, and serves those "
                "that it acknowledged",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_618"},
       .needs = Need::event | Need::eventgroup,
       .budget = 60s,
       .run = many_subscribers},
      {.id = "load.peers.connections",
       .title = "survives 100 TCP connections at once, and serves another one when they have ended",
       .requirements = {"feat_req_someip_644"},
       .needs = Need::tcp | Need::request,
       .budget = 60s,
       .run = [](Trial& t) { many_connections(t, 100, {}); }},
      {.id = "load.half-open.header",
       .title = "survives established TCP connections on which half a header comes and no more",
       .requirements = {"feat_req_someip_644", "feat_req_someip_585"},
       .needs = Need::tcp | Need::request,
       .budget = 60s,
       .run =
           [](Trial& t) {
             const Bytes whole = t.request().encode();
             many_connections(t, 10, ByteView{whole}.first(8));
           }},
      {.id = "load.half-open.closed",
       .title = "survives TCP connections of which the other half is closed before a message is whole",
       .requirements = {"feat_req_someip_644", "feat_req_someip_585"},
       .needs = Need::tcp | Need::request,
       .budget = 60s,
       .run =
           [](Trial& t) {
             const Bytes whole = t.request().encode();
             many_connections(t, 10, ByteView{whole}.first(whole.size() - 1), true);
           }},
      {.id = "load.half-open.message",
       .title =
           "survives established TCP connections on which the beginning of a large message comes and no more",
       .requirements = {"feat_req_someip_644", "feat_req_someip_585"},
       .needs = Need::tcp | Need::request,
       .budget = 60s,
       .run =
           [](Trial& t) {
             Call large = t.request();
             large.length = 0x0100'0000;
             large.payload.resize(1000);
             many_connections(t, 10, large.encode());
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
