#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

Call over_tcp(Call call) {
  call.transport = Transport::tcp;
  return call;
}

/// So many requests as one piece of stream.
Bytes requests(Trial& t, unsigned count) {
  Bytes stream;
  for (unsigned number = 1; number <= count; ++number) {
    Call call = t.request();
    call.client = someip::ClientId{0x5a41};
    call.session = someip::SessionId{static_cast<std::uint16_t>(number)};
    append(stream, call.encode());
  }
  return stream;
}

void expect_answers(Trial& t, std::size_t since, std::size_t count) {
  const auto answers = [&] {
    return t.messages_since(since, [](const SeenMessage& seen) {
      return seen.message.header.client == someip::ClientId{0x5a41};
    });
  };
  t.tester.receive(t.profile.timing.answer_within, [&] { return answers().size() >= count; });
  if (answers().size() < count) {
    t.must_be_open(since);
    t.missing(fmt::format("{} answers on the connection, expected {}", answers().size(), count),
              fmt::format("{} responses", count));
  }
  t.equal("answers", count, answers().size(), answers().back().packet);
}

/// That the device either goes on with the stream or has closed the connection; in both cases it serves a new
/// one.
void still_serves(Trial& t) {
  t.good_answer_to(over_tcp(t.request()));
}

/// As a client sends it.
Bytes magic_cookie() {
  return Call{.service = someip::ServiceId{0xffff},
              .method = someip::MethodId{0x0000},
              .interface_version = 1,
              .type = someip::MessageType::request_no_return,
              .client = someip::ClientId{0xdead},
              .session = someip::SessionId{0xbeef}}
      .encode();
}

/// A request behind a Magic Cookie, a header whose Length is too small, and the same again.
void resynchronises(Trial& t) {
  const PortId connection = t.tcp();
  Bytes good = magic_cookie();
  append(good, requests(t, 1));
  std::size_t since = t.now();
  t.send_bytes(connection, good);
  expect_answers(t, since, 1);
  Call broken = t.request();
  broken.length = 3;
  Bytes stream = broken.encode();
  append(stream, good);
  since = t.now();
  t.send_bytes(connection, stream);
  const auto answered = [&] {
    return !t.messages_since(since, [](const SeenMessage& seen) {
               return seen.message.header.client == someip::ClientId{0x5a41};
             }).empty();
  };
  t.tester.receive(t.profile.timing.answer_within,
                   [&] { return answered() || t.tester.is_closed(connection); });
  if (answered()) {
    return;
  }
  if (!t.tester.is_closed(connection)) {
    t.missing("no answer after a Magic Cookie, and the connection is still there",
              "a response, or the end of the connection");
  }
  t.nonstrict("the device closes the connection, and does not look for the next Magic Cookie");
  still_serves(t);
}

/// Events of the first service and of another one at the same port, for subscriptions with one connection.
void events_of_two(Trial& t) {
  const ServiceProfile& first = t.profile.service();
  const auto second = std::ranges::find_if(t.profile.services, [&](const ServiceProfile& one) {
    return one.service != first.service && one.tcp_port == first.tcp_port && tcp_event_source(one);
  });
  if (second == t.profile.services.end()) {
    t.unsupported(
        "no second service at the TCP port of the first has an event over TCP that can be waited for");
  }
  const EventSource own = tcp_event_source(t.profile).value_or(EventSource{});
  const EventSource other = tcp_event_source(*second).value_or(EventSource{});
  const PortId connection = t.tcp();
  const Bytes endpoint = endpoint_option(t.tester.local(connection), Transport::tcp);
  t.acknowledged(t.subscribe(first, own.group, {endpoint}));
  t.acknowledged(t.subscribe(*second, other.group, {endpoint}));
  t.event(own, t.tester.local(connection));
  const std::size_t since = t.now();
  const auto trigger = [&] {
    Call call = t.request(*second);
    call.method = other.trigger.value_or(someip::MethodId{});
    call.payload.clear();
    call.type = someip::MessageType::request_no_return;
    t.send(call, t.udp_of(*second), t.udp());
  };
  const auto has_come = [&] {
    return !t.messages_since(since, [&](const SeenMessage& seen) {
               return seen.message.header.service == second->service &&
                      seen.message.header.method == other.event &&
                      seen.packet->to == t.tester.local(connection);
             }).empty();
  };
  if (!(other.trigger ? t.ask(trigger, has_come)
                      : t.tester.receive(2 * other.cycle + 2 * t.profile.timing.answer_within, has_come))) {
    t.missing("no event of the second service comes on the connection", "an event of each of two services");
  }
}

}  // namespace

void add_tcp_cases(Cases& cases) {
  const Need call = Need::tcp | Need::request;
  const Cases all{
      {.id = "tcp.request",
       .title = "answers a request over TCP on the same connection",
       .requirements = {"feat_req_someip_49", "feat_req_someip_644"},
       .needs = call,
       .run = [](Trial& t) { t.good_answer_to(over_tcp(t.request())); }},
      {.id = "tcp.echo",
       .title = "echoes a byte over TCP",
       .requirements = {"feat_req_someip_644"},
       .tc8 = {"SOMEIP_ETS_035"},
       .needs = Need::tcp | Need::ets,
       .run =
           [](Trial& t) {
             const SeenMessage seen =
                 t.good_answer_to(over_tcp(t.call(someip::MethodId{0x0a}, bytes({0x7e}))));
             t.equal("payload", std::string{"7e"}, hex(seen.message.payload), seen.packet);
           }},
      {.id = "tcp.several.at-once",
       .title = "answers three requests back to back in a stream",
       .requirements = {"feat_req_someip_664", "feat_req_someip_702", "feat_req_someip_585"},
       .tc8 = {"SOMEIP_ETS_068"},
       .needs = call,
       .run =
           [](Trial& t) {
             t.tcp();
             const std::size_t since = t.now();
             t.send_bytes(t.tcp(), requests(t, 3));
             expect_answers(t, since, 3);
           }},
      {.id = "tcp.split.byte-by-byte",
       .title = "answers requests that come byte by byte",
       .requirements = {"feat_req_someip_585", "feat_req_someip_664"},
       .needs = call,
       .run =
           [](Trial& t) {
             const Bytes stream = requests(t, 2);
             const PortId connection = t.tcp();
             const std::size_t since = t.now();
             for (const std::byte& one : stream) {
               t.send_bytes(connection, ByteView{&one, 1});
             }
             expect_answers(t, since, 2);
           }},
      {.id = "tcp.split.across-messages",
       .title = "answers requests whose borders are not those of the TCP segments",
       .requirements = {"feat_req_someip_664"},
       .needs = call,
       .run =
           [](Trial& t) {
             const Bytes stream = requests(t, 4);
             const PortId connection = t.tcp();
             const std::size_t since = t.now();
             for (ByteView rest{stream}; !rest.empty();
                  rest = rest.subspan(std::min<std::size_t>(rest.size(), 11))) {
               t.send_bytes(connection, rest.first(std::min<std::size_t>(rest.size(), 11)));
             }
             expect_answers(t, since, 4);
           }},
      {.id = "tcp.two-connections",
       .title = "serves two connections at a time",
       .level = should,  // A client needs one alone for all its calls.
       .requirements = {"feat_req_someip_644"},
       .needs = call,
       .run =
           [](Trial& t) {
             const auto second =
                 t.tester.connect(t.tcp_of(t.profile.service()), t.profile.timing.answer_within);
             if (!second) {
               t.missing("no second TCP connection", "a TCP connection");
             }
             t.good_answer_to(over_tcp(t.request()));
             const std::size_t since = t.now();
             t.send_bytes(*second, requests(t, 1));
             expect_answers(t, since, 1);
           }},
      {.id = "tcp.services.one-connection",
       .title = "answers requests to a second service on the same connection",
       .requirements = {"feat_req_someip_645"},
       .needs = call | Need::two_services,
       .run =
           [](Trial& t) {
             for (const ServiceProfile& one : t.profile.services) {
               if (one.service != t.profile.service().service && one.request &&
                   one.tcp_port == t.profile.service().tcp_port) {
                 t.good_answer_to(over_tcp(t.request()));
                 t.good_answer_to(over_tcp(t.request(one)));
                 return;
               }
             }
             t.unsupported("no two services share a TCP port");
           }},
      {.id = "tcp.services.events-of-two",
       .title = "sends events of two services on one connection",
       .requirements = {"feat_req_someip_645", "feat_req_someipsd_788"},
       .tc8 = {"SOMEIPSRV_RPC_02"},
       .needs = Need::tcp_event | Need::tcp | Need::two_services,
       .run = events_of_two},
      {.id = "tcp.instances.own-ports",
       .title = "serves each instance at its own TCP port",
       .requirements = {"feat_req_someip_644", "feat_req_someip_445"},
       .tc8 = {"SOMEIPSRV_RPC_17"},
       .needs = call | Need::two_instances,
       .run =
           [](Trial& t) {
             for (const ServiceProfile& one : t.profile.services) {
               if (one.service != t.profile.service().service || !one.request || !one.tcp_port) {
                 continue;
               }
               const auto connection = t.tester.connect(t.tcp_of(one), t.profile.timing.answer_within);
               if (!connection) {
                 t.missing(fmt::format("no TCP connection to instance {:#06x}", value(one.instance)),
                           "a TCP connection");
               }
               const std::size_t since = t.now();
               const Call sent = t.send(over_tcp(t.request(one)), t.tcp_of(one), *connection);
               const auto seen =
                   t.await_message(since, t.profile.timing.answer_within, Trial::is_answer_to(sent));
               if (!seen) {
                 t.missing(fmt::format("no answer over TCP from instance {:#06x}", value(one.instance)),
                           "a response");
               }
               t.equal("TCP source port", *one.tcp_port, seen->packet->from.port, seen->packet);
             }
           }},
      {.id = "tcp.magic-cookie",
       .title = "passes over a magic cookie between two requests",
       .requirements = {"feat_req_someip_586", "feat_req_someip_609"},
       .needs = call,
       .run =
           [](Trial& t) {
             Bytes stream = magic_cookie();
             append(stream, requests(t, 1));
             const PortId connection = t.tcp();
             const std::size_t since = t.now();
             t.send_bytes(connection, stream);
             expect_answers(t, since, 1);
             for (const SeenMessage& seen : t.messages_since(since, [](const SeenMessage& one) {
                    return one.message.header.client == someip::ClientId{0xdead} &&
                           one.message.header.method == someip::MethodId{0x0000};
                  })) {
               t.different("answer to the cookie", "none", "one", seen.packet);
             }
           }},
      {.id = "tcp.resynchronisation",
       .title = "finds its step again at the next Magic Cookie, on the same connection",
       .level = should,
       .requirements = {"feat_req_someip_586"},
       .needs = call,
       .run = resynchronises},
      {.id = "tcp.survives.garbage",
       .title = "serves a new connection after garbage came on another one",
       .requirements = {"feat_req_someip_586"},
       .needs = call,
       .run =
           [](Trial& t) {
             t.send_bytes(t.tcp(), Bytes(64, std::byte{0xff}));
             t.tester.receive(50ms, [] { return false; });
             t.close_ports();
             const auto fresh =
                 t.tester.connect(t.tcp_of(t.profile.service()), t.profile.timing.answer_within);
             if (!fresh) {
               t.missing("no new TCP connection", "a TCP connection");
             }
             const std::size_t since = t.now();
             t.send_bytes(*fresh, requests(t, 1));
             expect_answers(t, since, 1);
           }},
      {.id = "tcp.survives.half-a-message",
       .title = "serves a new connection while half a request waits on another one",
       .requirements = {"feat_req_someip_644"},
       .needs = call,
       .run =
           [](Trial& t) {
             const auto half =
                 t.tester.connect(t.tcp_of(t.profile.service()), t.profile.timing.answer_within);
             if (!half) {
               t.missing("no TCP connection", "a TCP connection");
             }
             t.send_bytes(*half, ByteView{requests(t, 1)}.first(9));
             still_serves(t);
           }},
      {.id = "tcp.subscribe",
       .title = "acknowledges a Subscribe over TCP, and sends its events on the connection",
       .requirements = {"feat_req_someipsd_788", "feat_req_someipsd_767"},
       .tc8 = {"SOMEIP_ETS_108", "SOMEIP_ETS_151"},
       .needs = Need::tcp | Need::tcp_event,
       .run =
           [](Trial& t) {
             const EventSource source = tcp_event_source(t.profile).value_or(EventSource{});
             const PortId connection = t.tcp();
             t.acknowledged(t.subscribe(t.profile.service(), source.group,
                                        {endpoint_option(t.tester.local(connection), Transport::tcp)}));
             const SeenMessage seen = t.event(source);
             t.equal("transport", Transport::tcp, seen.packet->transport, seen.packet);
           }},
      {.id = "tcp.subscribe.anew",
       .title = "keeps the connection when a subscription over it ends and begins anew in one message",
       .requirements = {"feat_req_someipsd_1170", "feat_req_someipsd_1171"},
       .needs = Need::tcp | Need::tcp_event,
       .run =
           [](Trial& t) {
             const EventSource source = tcp_event_source(t.profile).value_or(EventSource{});
             const PortId connection = t.tcp();
             SdStimulus both = t.subscribe(t.profile.service(), source.group,
                                           {endpoint_option(t.tester.local(connection), Transport::tcp)});
             t.acknowledged(both);
             t.event(source);
             both.entries.insert(both.entries.begin(), both.entries.front());
             both.entries.front().ttl_s = 0;
             t.send_sd(both);
             t.pass();
             const SeenMessage seen = t.event(source);
             t.equal("transport", Transport::tcp, seen.packet->transport, seen.packet);
             t.equal("connection", std::string{"open"},
                     std::string{t.tester.is_closed(connection) ? "closed by the device" : "open"}, nullptr);
           }},
      {.id = "tcp.field",
       .title = "gets and sets a field over TCP",
       .requirements = {"feat_req_someip_633", "feat_req_someip_634"},
       .tc8 = {"SOMEIP_ETS_168"},
       .needs = Need::tcp | Need::field,
       .run =
           [](Trial& t) {
             FieldProfile field = *t.profile.service().field;
             if (t.profile.ets) {
               field = {.getter = someip::MethodId{0x2a},
                        .setter = someip::MethodId{0x2b},
                        .value = bytes({0x33})};
             }
             t.good_answer_to(over_tcp(t.call(field.getter)));
             t.good_answer_to(over_tcp(t.call(field.setter, field.value)));
             const SeenMessage seen = t.good_answer_to(over_tcp(t.call(field.getter)));
             t.equal("value", hex(field.value), hex(seen.message.payload), seen.packet);
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
