#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/cases/our_service.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// What is asked of the first Subscribe that an offer brings, to whatever eventgroup.
auto subscription(void (*judge)(Trial& t, const SeenEntry& seen, const UsedService& used)) {
  return [judge](Trial& t) {
    const UsedService& used = used_service(t, false);
    OurService ours{t, used};
    judge(t, ours.subscribed(), used);
  };
}

/// What is asked of the Subscribe to the eventgroup over UDP. Others may come before it.
auto subscription_over_udp(void (*judge)(Trial& t, const SeenEntry& seen, const UsedService& used)) {
  return [judge](Trial& t) {
    const UsedService& used = used_service(t, false);
    OurService ours{t, used};
    judge(t, ours.subscribed(used.udp->id), used);
  };
}

bool asks_for_values(const SeenEntry& seen) {
  return (seen.entry.tail & 0x0080'0000U) != 0;
}

/// What is asked of the FindService that the device sends after its start.
auto found(void (*judge)(Trial& t, const SeenEntry& seen, const UsedService& used)) {
  return [judge](Trial& t) {
    const UsedService& used = used_service(t, false);
    const OurService ours{t, used};
    const std::size_t since = t.restart();
    const auto seen = t.await_entry(since, 2 * t.profile.timing.answer_within, ours.is_find());
    if (!seen) {
      t.missing("no FindService for the service that the device uses", "a FindService");
    }
    Trial::comment(seen->packet, "the Find");
    judge(t, *seen, used);
  };
}

void no_find_since(Trial& t, const OurService& ours, std::size_t since, const char* why) {
  for (const SeenEntry& seen : t.entries_since(since, ours.is_find())) {
    if (seen.entry.instance == someip::any_instance) {
      t.nonstrict("the device looks for further instances");
      continue;
    }
    t.different("FindService", std::string{"none, "} + why, "one", seen.packet);
    return;
  }
}

/// An offer that is wrong in one way, and must bring no subscription.
struct BadOffer {
  const char* name;
  const char* title;
  std::vector<RequirementId> requirements;
  void (*spoil)(SdStimulus& offer);
};

void set_port(SdStimulus& offer, unsigned port) {
  Bytes& option = offer.options.front();
  option[option.size() - 2] = static_cast<std::byte>(port >> 8U);
  option[option.size() - 1] = static_cast<std::byte>(port);
}

Case as_case(const BadOffer& row) {
  return {.id = std::string{"client.ignores."} + row.name,
          .title = row.title,
          .requirements = row.requirements,
          .needs = Need::client,
          .role = Role::client,
          .run = [spoil = row.spoil](Trial& t) {
            OurService ours{t, used_service(t, false)};
            SdStimulus offer = ours.offer_message();
            spoil(offer);
            const std::size_t since = t.now();
            t.offer_ours(offer);
            t.pass();
            if (const auto seen = ours.subscribe_since(since, 200ms)) {
              t.fail("the device subscribes after a wrong offer", "nothing", "a SubscribeEventgroup",
                     seen->packet);
            }
            // And it still knows a right one.
            t.withdraw(offer);
            ours.subscribed();
          }};
}

std::vector<BadOffer> bad_offers() {
  return {
      {"other-service",
       "does not subscribe to another service than it uses",
       {"feat_req_someipsd_431"},
       [](SdStimulus& s) { s.entries.front().service = someip::ServiceId{0x7abc}; }},
      {"other-instance",
       "does not subscribe to another instance than it uses",
       {"feat_req_someipsd_431"},
       [](SdStimulus& s) { s.entries.front().instance = someip::InstanceId{0x7abc}; }},
      {"other-major",
       "does not subscribe to another major version than it uses",
       {"feat_req_someipcompat_804"},
       [](SdStimulus& s) {
         s.entries.front().major = static_cast<std::uint8_t>(s.entries.front().major + 0x70U);
       }},
      {"no-endpoint",
       "does not subscribe after an offer without endpoint",
       {"feat_req_someipsd_102", "feat_req_someipsd_1164"},
       [](SdStimulus& s) { s.entries.front().first_run.count = 0; }},
      {"port-zero",
       "does not subscribe after an offer with port 0",
       {"feat_req_someipsd_102"},
       [](SdStimulus& s) { set_port(s, 0); }},
      {"multicast-endpoint",
       "does not subscribe after an offer with a multicast address as endpoint",
       {"feat_req_someipsd_1233"},
       [](SdStimulus& s) {
         s.options.front()[4] = s.options.front().size() > 12 ? std::byte{0xff} : std::byte{0xe0};
       }},
      {"unspecified-endpoint",
       "does not subscribe after an offer with the address 0.0.0.0",
       {"feat_req_someipsd_1233"},
       [](SdStimulus& s) {
         std::fill(s.options.front().begin() + 4, s.options.front().end() - 3, std::byte{0});
       }},
      {"unknown-protocol",
       "does not subscribe after an offer with a protocol that is neither UDP nor TCP",
       {"feat_req_someipsd_102"},
       [](SdStimulus& s) { s.options.front()[s.options.front().size() - 3] = std::byte{0x63}; }},
      {"two-ports",
       "does not subscribe after an offer with two UDP endpoints",
       {"feat_req_someipsd_1145"},
       [](SdStimulus& s) {
         s.options.push_back(s.options.front());
         s.options.back().back() ^= std::byte{1};
         s.entries.front().first_run.count = 2;
       }},
      {"option-length",
       "does not subscribe after an offer whose endpoint option has Length 4",
       {"feat_req_someipsd_102", "feat_req_someipsd_129"},
       [](SdStimulus& s) { s.options.front()[1] = std::byte{4}; }},
      {"option-unknown",
       "does not subscribe after an offer whose only option is of unknown type",
       {"feat_req_someipsd_1142", "feat_req_someipsd_102"},
       [](SdStimulus& s) { s.options.front()[2] = std::byte{0x77}; }},
      {"too-many-options",
       "does not subscribe after an offer that refers to more options than there are",
       {"feat_req_someipsd_102"},
       [](SdStimulus& s) { s.entries.front().first_run.count = 3; }},
      {"entries-cut",
       "does not subscribe after an offer whose entries array is shorter than an entry",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       [](SdStimulus& s) { s.entries_length = 8; }},
      {"wrong-method",
       "does not subscribe after an offer under a Method ID other than 0x8100",
       {"feat_req_someipsd_26", "feat_req_someipsd_1220"},
       [](SdStimulus& s) { s.method = someip::MethodId{0x8200}; }},
  };
}

}  // namespace

void add_client_cases(Cases& cases) {
  const Need client = Need::client;
  const Need finds = Need::client | Need::restart;
  const Cases all{
      {.id = "client.find.comes",
       .title = "looks for the service that it uses, by multicast",
       .requirements = {"feat_req_someipsd_238", "feat_req_someipsd_812"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.require(seen.packet->to == t.tester.sd_group(), "receiver", "the group", "the tester",
                   seen.packet);
       })},
      {.id = "client.find.instance",
       .title = "looks for the instance that it uses, or for any",
       .requirements = {"feat_req_someipsd_239"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService& used) {
         t.require(seen.entry.instance == used.instance || seen.entry.instance == someip::any_instance,
                   "Instance ID", fmt::format("{:#06x} or 0xffff", value(used.instance)),
                   fmt::format("{:#06x}", value(seen.entry.instance)), seen.packet);
       })},
      {.id = "client.find.major",
       .title = "looks for the major version that it uses, or for any",
       .requirements = {"feat_req_someipcompat_802", "feat_req_someipsd_239"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService& used) {
         t.require(seen.entry.major == used.major || seen.entry.major == sd::any_major, "major version",
                   fmt::format("{} or 255", used.major), std::to_string(seen.entry.major), seen.packet);
       })},
      {.id = "client.find.minor",
       .title = "looks for any minor version",
       .requirements = {"feat_req_someipcompat_1197"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.equal("minor version", std::uint32_t{0xffff'ffff}, seen.entry.minor(), seen.packet);
       })},
      {.id = "client.find.ttl",
       .title = "looks with a TTL that is not 0",
       .requirements = {"feat_req_someipsd_239"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.require(seen.entry.ttl_s != 0, "TTL", "not 0", "0", seen.packet);
       })},
      {.id = "client.find.options",
       .title = "looks without endpoints",
       .requirements = {"feat_req_someipsd_877"},
       .needs = finds,
       .role = Role::client,
       .run = found([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.equal("options of the entry", std::size_t{0}, seen.entry.option_count(), seen.packet);
       })},
      {.id = "client.find.ends-with-offer",
       .title = "looks no more for a service that is offered",
       .requirements = {"feat_req_someipsd_867", "feat_req_someipsd_238"},
       .needs = finds,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             t.restart();
             ours.answer(ours.subscribed());
             const std::size_t since = t.now();
             t.tester.receive(1s, [] { return false; });
             no_find_since(t, ours, since, "as the service is offered");
           }},
      {.id = "client.find.not-in-main-phase",
       .title = "looks no more after the repetition phase",
       .requirements = {"feat_req_someipsd_866", "feat_req_someipsd_75"},
       .needs = finds | Need::repetitions,
       .role = Role::client,
       .run =
           [](Trial& t) {
             const OurService ours{t, used_service(t, false)};
             t.restart();
             // All pauses of the phase together are shorter than this.
             const Duration phase =
                 *t.profile.timing.repetitions_base_delay * (1U << *t.profile.timing.repetitions_max);
             t.tester.receive(t.profile.timing.initial_delay_max.value_or(1s) + 2 * phase + 200ms,
                              [] { return false; });
             const std::size_t since = t.now();
             t.tester.receive(1s + phase, [] { return false; });
             no_find_since(t, ours, since, "in the main phase");
           }},

      {.id = "client.subscribe.comes",
       .title = "subscribes to the service that it uses when that is offered",
       .requirements = {"feat_req_someipsd_431", "feat_req_someipsd_321", "feat_req_someipsd_430",
                        "feat_req_someipsd_428"},
       .needs = client,
       .role = Role::client,
       .run = subscription([](Trial&, const SeenEntry&, const UsedService&) {})},
      {.id = "client.subscribe.any-minor",
       .title = "subscribes whatever minor version is offered",
       .requirements = {"feat_req_someipcompat_1216"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             SdStimulus offer = ours.offer_message();
             offer.entries.front().tail = 0x0102'0304;
             ours.subscribed_to(offer);
           }},
      {.id = "client.subscribe.unicast",
       .title = "subscribes by unicast",
       .requirements = {"feat_req_someipsd_818"},
       .needs = client,
       .role = Role::client,
       .run = subscription([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.require(seen.packet->to == t.tester.sd(), "receiver", "the tester, by unicast", "the group",
                   seen.packet);
       })},
      {.id = "client.subscribe.instance",
       .title = "subscribes to the instance that is offered",
       .requirements = {"feat_req_someipsd_322"},
       .needs = client,
       .role = Role::client,
       .run = subscription([](Trial& t, const SeenEntry& seen, const UsedService& used) {
         t.equal("Instance ID", value(used.instance), value(seen.entry.instance), seen.packet);
       })},
      {.id = "client.subscribe.major",
       .title = "subscribes to the major version that is offered",
       .requirements = {"feat_req_someipsd_322", "feat_req_someipcompat_804"},
       .needs = client,
       .role = Role::client,
       .run = subscription([](Trial& t, const SeenEntry& seen, const UsedService& used) {
         t.equal("major version", used.major, seen.entry.major, seen.packet);
       })},
      {.id = "client.subscribe.eventgroup",
       .title = "subscribes to the eventgroup that it needs",
       .requirements = {"feat_req_someipsd_322"},
       .needs = client,
       .role = Role::client,
       .run = subscription_over_udp([](Trial& t, const SeenEntry& seen, const UsedService& used) {
         t.equal("eventgroup", value(used.udp->id), value(seen.entry.eventgroup()), seen.packet);
       })},
      {.id = "client.subscribe.reserved",
       .title = "subscribes with reserved bits 0",
       .requirements = {"feat_req_someipsd_322"},
       .needs = client,
       .role = Role::client,
       .run = subscription([](Trial& t, const SeenEntry& seen, const UsedService&) {
         t.equal("reserved bits", 0U, seen.entry.tail & 0xff70'0000U, seen.packet);
       })},
      {.id = "client.subscribe.endpoint",
       .title = "names its own UDP endpoint when it subscribes, and only one",
       .requirements = {"feat_req_someipsd_848", "feat_req_someipsd_786", "feat_req_someipsd_798"},
       .needs = client,
       .role = Role::client,
       .run = subscription_over_udp([](Trial& t, const SeenEntry& seen, const UsedService&) {
         std::size_t udp = 0;
         for (const sd::EndpointOption& one : seen.endpoints()) {
           if (one.transport == Transport::udp) {
             ++udp;
             t.require(one.endpoint.address == t.profile.device, "address of the endpoint", "the device's",
                       "another", seen.packet);
             t.require(one.endpoint.port != 0, "port of the endpoint", "not 0", "0", seen.packet);
           }
         }
         t.equal("UDP endpoints", std::size_t{1}, udp, seen.packet);
       })},
      {.id = "client.subscribe.initial-data",
       .title = "asks for initial values with its first subscription, and not when it renews it",
       .requirements = {"feat_req_someipsd_1191", "feat_req_someipsd_1192", "feat_req_someipsd_1188"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             if (!t.profile.policy.explicit_initial_data) {
               t.unsupported("the profile says that explicit initial data is not known");
             }
             OurService ours{t, used_service(t, false)};
             const SeenEntry first = ours.subscribed();
             t.equal("flag of explicit initial data", true,
                     (first.message.flags() & sd::explicit_initial_data_flag) != 0, first.packet);
             t.equal("wish for initial data", true, asks_for_values(first), first.packet);
             ours.answer(first);
             t.pass();
             const SeenEntry renewed = ours.subscribed();
             t.equal("wish for initial data at the renewal", false, asks_for_values(renewed), renewed.packet);
           }},
      {.id = "client.subscribe.each-offer",
       .title = "renews its subscription with each offer",
       .requirements = {"feat_req_someipsd_431", "feat_req_someipsd_631"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             for (int count = 0; count < 3; ++count) {
               ours.answer(ours.subscribed());
               t.pass();
             }
           }},
      {.id = "client.subscribe.only-with-offers",
       .title = "does not renew its subscription by itself",
       .requirements = {"feat_req_someipsd_631"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed());
             t.pass();
             const std::size_t since = t.now();
             if (const auto seen = ours.subscribe_since(since, 1500ms)) {
               t.different("SubscribeEventgroup", "none without an offer", "one", seen->packet);
             }
           }},
      {.id = "client.subscribe.after-nack",
       .title = "subscribes again with the next offer when it was refused",
       .requirements = {"feat_req_someipsd_431", "feat_req_someipsd_812"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed(), false);
             t.pass();
             ours.subscribed();
           }},
      {.id = "client.subscribe.after-no-answer",
       .title = "asks for initial values again when its first subscription was not answered",
       .requirements = {"feat_req_someipsd_844", "feat_req_someipsd_1193"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             // Only what answers an offer by multicast is watched. The first Subscribe after its start a
             // device may send for itself, as the service that it looked for is there.
             ours.answer(ours.subscribed());
             ours.withdraw();
             t.pass();
             ours.subscribed();
             t.pass();
             const std::size_t since = t.now();
             const SeenEntry again = ours.subscribed();
             // Where explicit initial data is not known, the end of the subscription in the same message
             // does.
             const auto ended = t.entries_since(since, [&](const SeenEntry& seen) {
               return seen.packet == again.packet &&
                      seen.entry.kind() == sd::EntryKind::stop_subscribe_eventgroup;
             });
             t.require(asks_for_values(again) || !ended.empty(), "wish for initial data",
                       "yes, or StopSubscribe before the Subscribe", "no", again.packet);
           }},
      {.id = "client.subscribe.after-stop-offer",
       .title = "subscribes anew, and looks no more, when a service comes back that was withdrawn",
       .requirements = {"feat_req_someipsd_831", "feat_req_someipsd_834", "feat_req_someipsd_1193"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed());
             t.pass();
             const std::size_t since = t.now();
             ours.withdraw();
             t.pass();
             t.tester.receive(500ms, [] { return false; });
             no_find_since(t, ours, since, "after StopOfferService");
             const SeenEntry again = ours.subscribed();
             if (t.profile.policy.explicit_initial_data) {
               t.equal("wish for initial data", true, asks_for_values(again), again.packet);
             }
           }},
      {.id = "client.subscribe.after-ttl",
       .title = "subscribes anew when the TTL of an offer was over before the next one",
       .requirements = {"feat_req_someipsd_1191", "feat_req_someipsd_1193"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed_to(ours.offer_message(1)));
             t.tester.receive(1500ms, [] { return false; });
             const SeenEntry again = ours.subscribed();
             if (t.profile.policy.explicit_initial_data) {
               t.equal("wish for initial data", true, asks_for_values(again), again.packet);
             }
           }},
      {.id = "client.subscribe.after-reboot",
       .title = "subscribes anew when the server was restarted",
       .requirements = {"feat_req_someipsd_871", "feat_req_someipsd_764", "feat_req_someipsd_1193",
                        "feat_req_someipsd_863"},
       .needs = client,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed());
             t.pass();
             ours.reboot();
             const SeenEntry again = ours.subscribed();
             if (t.profile.policy.explicit_initial_data) {
               t.equal("wish for initial data", true, asks_for_values(again), again.packet);
             }
           }},
      {.id = "client.stop.comes",
       .title = "ends its subscription when it is stopped",
       .requirements = {"feat_req_someipsd_822", "feat_req_someipsd_433", "feat_req_someipsd_1177"},
       .needs = client | Need::stop,
       .role = Role::client,
       .run =
           [](Trial& t) {
             OurService ours{t, used_service(t, false)};
             ours.answer(ours.subscribed());
             t.pass();
             const std::size_t since = t.now();
             t.stop_device();
             const auto seen =
                 t.await_entry(since, t.profile.timing.answer_within, [&](const SeenEntry& one) {
                   return one.entry.kind() == sd::EntryKind::stop_subscribe_eventgroup &&
                          one.entry.service == ours.used().service;
                 });
             t.start_device();
             if (!t.await_entry(t.now(), t.profile.timing.ready_within, t.is_start())) {
               t.missing("the device says nothing of its service after it was started", "an SD message");
             }
             if (!seen) {
               t.missing("no StopSubscribeEventgroup when the device was stopped",
                         "a StopSubscribeEventgroup");
             }
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
  for (const BadOffer& row : bad_offers()) {
    cases.push_back(as_case(row));
  }
}

}  // namespace trestle::conform
