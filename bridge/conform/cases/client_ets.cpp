#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/cases/our_service.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// How the Enhanced Testability Service is told what the device's client is to do.
void order(Trial& t, std::uint16_t method) {
  Call call = t.call(someip::MethodId{method});
  call.type = someip::MessageType::request_no_return;
  t.send(call);
  t.pass();
}

/// Ends what a case began, however the case ends: an order to be sent while the trial goes on.
class Activated {
 public:
  Activated(Trial& t, std::uint16_t method) : t_{t} { order(t, method); }
  ~Activated() {
    try {
      order(t_, 0x30);
    } catch (...) {  // NOLINT(bugprone-empty-catch): the case has ended already, and says why
    }
  }
  Activated(const Activated&) = delete;
  Activated& operator=(const Activated&) = delete;

 private:
  Trial& t_;
};

constexpr std::uint16_t client_activate = 0x2f;
constexpr std::uint16_t client_subscribe = 0x32;

void need_tcp(Trial& t) {
  if (!used_service(t, true).tcp) {
    t.unsupported("the profile names no eventgroup over TCP that the device uses");
  }
}

enum class Over : std::uint8_t { udp, tcp };

/// A case with a service of ours, which the device has been told to look for or to subscribe to.
/// @param over  TCP: it is offered there, too.
auto told(std::uint16_t method, void (*judge)(Trial& t, OurService& ours), Over over = Over::udp) {
  return [=](Trial& t) {
    if (over == Over::tcp) {
      need_tcp(t);
    }
    OurService ours{t, used_service(t, true), over == Over::tcp};
    const Activated activated{t, method};
    judge(t, ours);
  };
}

std::size_t wanted_groups(const UsedService& used, bool with_tcp) {
  return 1U + (used.multicast ? 1U : 0U) + (used.tcp && with_tcp ? 1U : 0U);
}

/// A service that the device has subscribed to, as it was told to.
void subscribed_all(Trial& t, OurService& ours, bool with_tcp, std::optional<Endpoint> group = {}) {
  const std::size_t since = t.now();
  ours.offer();
  ours.acknowledge_all(since, wanted_groups(ours.used(), with_tcp), group);
  t.pass();
}

Endpoint receiver(Trial& t, OurService& ours) {
  const SeenEntry seen = ours.subscribed(ours.used().udp->id);
  for (const sd::EndpointOption& one : seen.endpoints()) {
    if (one.transport == Transport::udp) {
      return one.endpoint;
    }
  }
  t.fail("the subscription has no UDP endpoint", "a Subscribe with a UDP endpoint", "one without",
         seen.packet);
}

/// Sends an event up to three times, until the device says that its value was the last one. For that it is
/// asked again and again.
void expect_last_value(Trial& t, std::uint16_t getter, unsigned expected,
                       const std::function<void()>& notify) {
  const std::string wanted = fmt::format("{:02x}", expected);
  std::string seen;
  Packet* packet = nullptr;
  const auto notify_and_look = [&] {
    notify();
    for (int count = 0; count < 10 && seen != wanted; ++count) {
      const SeenMessage answer = t.good_answer_to(t.call(someip::MethodId{getter}));
      seen = hex(answer.message.payload);
      packet = answer.packet;
      t.tester.receive(seen == wanted ? Duration{0} : t.profile.timing.answer_within / 20,
                       [] { return false; });
    }
  };
  if (!t.ask(notify_and_look, Duration{0}, [&] { return seen == wanted; })) {
    t.equal("last value", wanted, seen, packet);
  }
}

/// The connection that the device has made; ends the case when there is none.
PortId connection(Trial& t, OurService& ours, std::size_t count) {
  if (!t.tester.receive(2 * t.profile.timing.answer_within,
                        [&] { return t.tester.accepted(ours.listening()).size() >= count; })) {
    t.missing("the device does not connect to the offered TCP port", "a TCP connection");
  }
  return t.tester.accepted(ours.listening()).back();
}

void expect_closed(Trial& t, PortId made) {
  if (!t.tester.receive(2 * t.profile.timing.answer_within, [&] { return t.tester.is_closed(made); })) {
    t.different("connection", "closed by the device", "open", nullptr);
  }
}

void no_find(Trial& t, const OurService& ours, std::size_t since, const char* why) {
  for (const SeenEntry& seen : t.entries_since(since, ours.is_find())) {
    t.different("FindService", std::string{"none, "} + why, "one", seen.packet);
    return;
  }
}

}  // namespace

void add_ets_client_cases(Cases& cases) {
  const Need client = Need::ets_client | Need::udp;
  const Cases all{
      {.id = "client.ets.not-by-itself",
       .title = "does not subscribe without being told to",
       .requirements = {"feat_req_someipsd_431"},
       .tc8 = {"SOMEIP_ETS_098"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, true)};
             const std::size_t since = t.now();
             ours.offer();
             t.pass();
             if (const auto seen = ours.subscribe_since(since, 200ms)) {
               t.different("SubscribeEventgroup", "none", "one", seen->packet);
             }
           }},
      {.id = "client.ets.finds",
       .title = "looks for the service when it is told to, and offers its own as before",
       .requirements = {"feat_req_someipsd_238", "feat_req_someipsd_68", "feat_req_someipsd_18"},
       .tc8 = {"SOMEIP_ETS_099"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             const OurService ours{t, used_service(t, true)};
             const std::size_t since = t.now();
             const Activated activated{t, client_activate};
             if (!t.await_entry(since, 2 * t.profile.timing.answer_within, ours.is_find())) {
               t.missing("no FindService for the service", "a FindService");
             }
             t.offer();
           }},
      {.id = "client.ets.finds-end",
       .title = "looks for the service only at first",
       .requirements = {"feat_req_someipsd_866"},
       .tc8 = {"SOMEIP_ETS_100"},
       .needs = client | Need::repetitions,
       .role = Role::client,
       .run = told(client_activate,
                   [](Trial& t, OurService& ours) {
                     const Duration phase =
                         *t.profile.timing.repetitions_base_delay * (1U << *t.profile.timing.repetitions_max);
                     t.tester.receive(t.profile.timing.initial_delay_max.value_or(1s) + 2 * phase + 200ms,
                                      [] { return false; });
                     const std::size_t since = t.now();
                     t.tester.receive(1s + phase, [] { return false; });
                     no_find(t, ours, since, "in the main phase");
                   })},
      {.id = "client.ets.stop-offer",
       .title = "looks no more for a service that was withdrawn",
       .requirements = {"feat_req_someipsd_834"},
       .tc8 = {"SOMEIP_ETS_101"},
       .needs = client,
       .role = Role::client,
       .run = told(client_activate,
                   [](Trial& t, OurService& ours) {
                     ours.offer();
                     t.pass();
                     ours.withdraw();
                     t.pass();
                     const std::size_t since = t.now();
                     t.tester.receive(1s, [] { return false; });
                     no_find(t, ours, since, "after StopOfferService");
                   })},
      {.id = "client.ets.subscribes",
       .title = "subscribes when it is told to and the service is offered",
       .requirements = {"feat_req_someipsd_431", "feat_req_someipsd_321"},
       .tc8 = {"SOMEIP_ETS_106"},
       .needs = client,
       .role = Role::client,
       .run = told(client_subscribe, [](Trial&, OurService& ours) { ours.answer(ours.subscribed()); })},
      {.id = "client.ets.stops",
       .title = "ends its subscription when it is told to",
       .requirements = {"feat_req_someipsd_332", "feat_req_someipsd_433", "feat_req_someipsd_822",
                        "feat_req_someipsd_18"},
       .tc8 = {"SOMEIP_ETS_084"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, true)};
             std::size_t since = 0;
             {
               const Activated activated{t, client_subscribe};
               subscribed_all(t, ours, false);
               since = t.now();
             }
             const auto seen =
                 t.await_entry(since, t.profile.timing.answer_within, [&](const SeenEntry& one) {
                   return one.entry.kind() == sd::EntryKind::stop_subscribe_eventgroup &&
                          one.entry.service == ours.used().service;
                 });
             if (!seen) {
               t.missing("no StopSubscribeEventgroup after clientServiceDeactivate",
                         "a StopSubscribeEventgroup");
             }
           }},
      {.id = "client.ets.event.udp",
       .title = "receives events over UDP",
       .requirements = {"feat_req_someipsd_1182", "feat_req_someipsd_848"},
       .tc8 = {"SOMEIP_ETS_105"},
       .needs = client,
       .role = Role::client,
       .run = told(client_subscribe,
                   [](Trial& t, OurService& ours) {
                     subscribed_all(t, ours, false);
                     const Endpoint to = receiver(t, ours);
                     for (const std::uint8_t value : {std::uint8_t{0x35}, std::uint8_t{0x53}}) {
                       expect_last_value(t, 0x3c, value,
                                         [&] { ours.notify(ours.used().udp->event, value, to); });
                     }
                   })},
      {.id = "client.ets.event.multicast",
       .title = "receives events over multicast",
       .requirements = {"feat_req_someip_811", "feat_req_someipsd_749", "feat_req_someip_814",
                        "feat_req_someipsd_791"},
       .tc8 = {"SOMEIP_ETS_104"},
       .needs = client | Need::multicast_events,
       .role = Role::client,
       .run = told(client_subscribe,
                   [](Trial& t, OurService& ours) {
                     if (!ours.used().multicast) {
                       t.unsupported("the profile names no eventgroup over multicast that the device uses");
                     }
                     Endpoint group = *t.eventgroup([](const EventgroupProfile& one) {
                                          return one.multicast.has_value();
                                        }).multicast;
                     group.port = static_cast<std::uint16_t>(group.port + 100);
                     subscribed_all(t, ours, false, group);
                     for (const std::uint8_t value : {std::uint8_t{0x36}, std::uint8_t{0x63}}) {
                       expect_last_value(t, 0x3d, value,
                                         [&] { ours.notify(ours.used().multicast->event, value, group); });
                     }
                   })},
      {.id = "client.ets.event.tcp",
       .title = "connects before it subscribes to events over TCP, and receives them",
       .requirements = {"feat_req_someipsd_767", "feat_req_someip_660", "feat_req_someip_646",
                        "feat_req_someipsd_762"},
       .tc8 = {"SOMEIP_ETS_103"},
       .needs = client,
       .role = Role::client,
       .run = told(
           client_subscribe,
           [](Trial& t, OurService& ours) {
             const SeenEntry seen = ours.subscribed(ours.used().tcp->id);
             t.require(!t.tester.accepted(ours.listening()).empty(), "TCP connections before the Subscribe",
                       "1", "0", seen.packet);
             const PortId made = connection(t, ours, 1);
             ours.answer(seen);
             t.pass();
             for (const std::uint8_t value : {std::uint8_t{0x37}, std::uint8_t{0x73}}) {
               expect_last_value(t, 0x3b, value, [&] { ours.notify(ours.used().tcp->event, value, made); });
             }
           },
           Over::tcp)},
      {.id = "client.ets.tcp-again",
       .title = "connects with a later offer when the first connection was not taken",
       .requirements = {"feat_req_someipsd_767", "feat_req_someipsd_431", "feat_req_someip_647"},
       .tc8 = {"SOMEIP_ETS_097"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             need_tcp(t);
             const UsedService& used = used_service(t, true);
             const Activated activated{t, client_subscribe};
             {
               // A port that nobody listens at any more.
               OurService refusing{t, used, true};
               const SdStimulus offer = refusing.offer_message();
               t.tester.close(refusing.listening());
               t.offer_ours(offer);
               t.pass();
             }
             OurService ours{t, used, true};
             ours.subscribed(used.tcp->id);
             connection(t, ours, 1);
           }},
      {.id = "client.ets.tcp-closed.when-told",
       .title = "closes its connection when it is told to use the service no more",
       .requirements = {"feat_req_someip_678"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             need_tcp(t);
             OurService ours{t, used_service(t, true), true};
             PortId made{};
             {
               const Activated activated{t, client_subscribe};
               ours.answer(ours.subscribed(ours.used().tcp->id));
               made = connection(t, ours, 1);
             }
             expect_closed(t, made);
           }},
      {.id = "client.ets.tcp-closed.stop-offer",
       .title = "closes its connection when the service is withdrawn",
       .requirements = {"feat_req_someip_679"},
       .needs = client,
       .role = Role::client,
       .run = told(
           client_subscribe,
           [](Trial& t, OurService& ours) {
             ours.answer(ours.subscribed(ours.used().tcp->id));
             const PortId made = connection(t, ours, 1);
             ours.withdraw();
             expect_closed(t, made);
           },
           Over::tcp)},
      {.id = "client.ets.reboot.udp",
       .title = "subscribes again at a new UDP port of a server that was restarted",
       .requirements = {"feat_req_someipsd_871", "feat_req_someipsd_764", "feat_req_someipsd_778",
                        "feat_req_someipsd_779"},
       .tc8 = {"SOMEIP_ETS_082"},
       .needs = client,
       .role = Role::client,
       .run = told(client_subscribe,
                   [](Trial& t, OurService& ours) {
                     subscribed_all(t, ours, false);
                     ours.reboot();
                     ours.move();
                     subscribed_all(t, ours, false);
                     const Endpoint to = receiver(t, ours);
                     expect_last_value(t, 0x3c, 0x2b, [&] { ours.notify(ours.used().udp->event, 0x2b, to); });
                   })},
      {.id = "client.ets.reboot.tcp",
       .title = "connects and subscribes again to a server that was restarted",
       .requirements = {"feat_req_someipsd_871", "feat_req_someipsd_764", "feat_req_someipsd_872"},
       .tc8 = {"SOMEIP_ETS_081"},
       .needs = client,
       .role = Role::client,
       .run = told(
           client_subscribe,
           [](Trial& t, OurService& ours) {
             ours.answer(ours.subscribed(ours.used().tcp->id));
             connection(t, ours, 1);
             t.pass();
             ours.reboot();
             ours.subscribed(ours.used().tcp->id);
             connection(t, ours, 2);
           },
           Over::tcp)},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
