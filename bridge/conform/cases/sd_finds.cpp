#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// A Find of the service, changed, that has to be answered.
auto answered(void (*change)(sd::Entry& find, const ServiceProfile& service), bool multicast) {
  return [change, multicast](Trial& t) {
    const ServiceProfile& service = t.profile.service();
    sd::Entry find = Trial::find_entry(service);
    change(find, service);
    t.answer_to_find(find, multicast, service);
  };
}

/// One that must not be answered.
auto ignored(void (*change)(sd::Entry& find, const ServiceProfile& service)) {
  return [change](Trial& t) {
    const ServiceProfile& service = t.profile.service();
    sd::Entry find = Trial::find_entry(service);
    change(find, service);
    const std::size_t since = t.now();
    t.send_sd({.entries = {find}});
    t.tester.receive(150ms, [] { return false; });
    for (const SeenEntry& seen : t.entries_since(since, [&](const SeenEntry& one) {
           return one.entry.type == sd::EntryType::offer_service && one.packet->to == t.tester.sd();
         })) {
      t.different("answer", "none", "an offer by unicast", seen.packet);
      return;
    }
    t.pass();
  };
}

void nothing(sd::Entry&, const ServiceProfile&) {}

/// A Find by multicast, so long after a cyclic offer, that has to be answered by multicast: before the next
/// cyclic offer, which would look like the answer.
void answered_by_multicast(Trial& t, std::uint8_t flags, Duration after) {
  if (!t.profile.policy.multicast_find_answers) {
    t.unsupported("the profile says that Finds are answered by unicast (policy: multicast_find_answers)");
  }
  const Duration cycle = *t.profile.timing.cyclic_offer_delay;
  const auto is_answer = [&](const SeenEntry& seen) {
    return Trial::is_offer(t.profile.service())(seen) && seen.packet->to == t.tester.sd_group();
  };
  for (int count = 0; count < 3; ++count) {
    // Two with a cycle between them: in the repetition phase the next one may come at any time.
    std::optional<WallTime> last;
    for (bool cyclic = false; !cyclic;) {
      const auto seen = t.await_entry(t.now(), 3 * cycle, is_answer);
      if (!seen) {
        t.missing("no cyclic offer", "an OfferService");
      }
      cyclic = last && seen->packet->time - *last > cycle * 3 / 4;
      last = seen->packet->time;
    }
    t.tester.receive(after, [] { return false; });
    const std::size_t since = t.now();
    t.send_sd({.entries = {Trial::find_entry(t.profile.service())}, .flags = flags}, true, "FindService");
    // Where this machine was busy and the Find late, what comes may be the next cyclic one.
    const auto answer = t.await_entry(since, cycle * 3 / 4 - after, is_answer);
    if (answer && answer->packet->time - *last < cycle * 9 / 10) {
      return;
    }
  }
  t.missing("no offer by multicast between two cyclic ones", "an OfferService by multicast");
}

std::vector<someip::InstanceId> instances_of(const Profile& profile) {
  std::vector<someip::InstanceId> all;
  for (const ServiceProfile& one : profile.services) {
    if (one.service == profile.service().service) {
      all.push_back(one.instance);
    }
  }
  return all;
}

}  // namespace

void add_sd_find_cases(Cases& cases) {
  const Cases all{
      {.id = "sd.find.unicast",
       .title = "answers a Find that came by unicast",
       .requirements = {"feat_req_someipsd_824"},
       .tc8 = {"SOMEIP_ETS_171"},
       .run = answered(nothing, false)},
      {.id = "sd.find.multicast",
       .title = "answers a Find that came by multicast with an offer by unicast",
       .requirements = {"feat_req_someipsd_824", "feat_req_someipsd_811", "feat_req_someipsd_89"},
       .run = answered(nothing, true)},
      {.id = "sd.find.any-major",
       .title = "answers a Find of any instance and any major version",
       .requirements = {"feat_req_someipsd_239"},
       .tc8 = {"SOMEIP_ETS_128"},
       .run = answered([](sd::Entry& find, const ServiceProfile&) { find.instance = someip::any_instance; },
                       true)},
      {.id = "sd.find.exact",
       .title = "answers a Find of exactly its versions",
       .requirements = {"feat_req_someipsd_239"},
       .run = answered(
           [](sd::Entry& find, const ServiceProfile& service) {
             find.major = service.major;
             find.tail = service.minor;
           },
           true)},
      {.id = "sd.find.other-service",
       .title = "does not answer a Find of another service",
       .requirements = {"feat_req_someipsd_824"},
       .run =
           ignored([](sd::Entry& find, const ServiceProfile&) { find.service = someip::ServiceId{0x7abc}; })},
      {.id = "sd.find.other-instance",
       .title = "does not answer a Find of another instance",
       .requirements = {"feat_req_someipsd_824"},
       .run = ignored(
           [](sd::Entry& find, const ServiceProfile&) { find.instance = someip::InstanceId{0x7abc}; })},
      {.id = "sd.find.other-major",
       .title = "does not answer a Find of another major version",
       .requirements = {"feat_req_someipsd_824"},
       .run = ignored([](sd::Entry& find, const ServiceProfile& service) {
         find.major = static_cast<std::uint8_t>(service.major + 7U);
       })},
      {.id = "sd.find.two-instances",
       .title = "answers a Find of any instance with an offer of each",
       .requirements = {"feat_req_someipsd_824", "feat_req_someip_636"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_01"},
       .needs = Need::two_instances,
       .run =
           [](Trial& t) {
             sd::Entry find = Trial::find_entry(t.profile.service());
             find.instance = someip::any_instance;
             for (const someip::InstanceId instance : instances_of(t.profile)) {
               ServiceProfile wanted = t.profile.service();
               wanted.instance = instance;
               t.answer_to_find(find, true, wanted);
             }
           }},
      {.id = "sd.find.one-of-two-instances",
       .title = "answers a Find of one instance with an offer of that one alone",
       .requirements = {"feat_req_someipsd_824", "feat_req_someip_542"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_02"},
       .needs = Need::two_instances,
       .run =
           [](Trial& t) {
             for (const someip::InstanceId instance : instances_of(t.profile)) {
               ServiceProfile wanted = t.profile.service();
               wanted.instance = instance;
               const std::size_t since = t.now();
               t.answer_to_find(Trial::find_entry(wanted), true, wanted);
               for (const SeenEntry& seen : t.entries_since(since, [&](const SeenEntry& one) {
                      return one.entry.kind() == sd::EntryKind::offer_service &&
                             one.packet->to == t.tester.sd() && one.entry.service == wanted.service;
                    })) {
                 t.equal("Instance ID", value(instance), value(seen.entry.instance), seen.packet);
               }
             }
           }},
      {.id = "sd.find.unicast-flag-clear",
       .title = "answers a Find whose sender has the unicast flag clear",
       .requirements = {"feat_req_someipsd_824"},
       .tc8 = {"SOMEIP_ETS_130"},
       .run =
           [](Trial& t) {
             t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service(), 0);
           }},
      {.id = "sd.find.legacy-multicast-answer",
       .title = "answers a Find with the unicast flag clear by multicast",
       .level = tc8,
       .requirements = {"feat_req_someipsd_91"},
       .tc8 = {"SOMEIPSRV_SD_BEHAVIOR_04"},
       .needs = Need::cyclic_offers,
       .run = [](Trial& t) { answered_by_multicast(t, 0, Duration{0}); }},
      {.id = "sd.find.late-multicast-answer",
       .title = "answers a Find by multicast when half a cycle has passed since its last offer",
       .level = tc8,
       .requirements = {"feat_req_someipsd_90"},
       .tc8 = {"SOMEIPSRV_SD_BEHAVIOR_03"},
       .needs = Need::cyclic_offers,
       .run =
           [](Trial& t) {
             answered_by_multicast(t, sd::unicast_flag | sd::explicit_initial_data_flag,
                                   *t.profile.timing.cyclic_offer_delay * 11 / 20);
           }},
      {.id = "sd.find.unreferenced-options",
       .title = "answers a Find in a message with ten options that nothing refers to",
       .requirements = {"feat_req_someipsd_878", "feat_req_someipsd_1141"},
       .tc8 = {"SOMEIP_ETS_118"},
       .run =
           [](Trial& t) {
             const ServiceProfile& service = t.profile.service();
             SdStimulus find{.entries = {Trial::find_entry(service)}};
             for (std::uint16_t port = 40'000; port < 40'010; ++port) {
               find.options.push_back(endpoint_option({t.profile.tester, port}, Transport::udp));
             }
             t.answer_to_find(find, true, service);
           }},
      {.id = "sd.find.referenced-options",
       .title = "answers a Find that refers to an endpoint and a configuration",
       .requirements = {"feat_req_someipsd_106", "feat_req_someipsd_879"},
       .run =
           [](Trial& t) {
             const ServiceProfile& service = t.profile.service();
             SdStimulus find{.entries = {Trial::find_entry(service)}};
             find.options = {endpoint_option({t.profile.tester, 40'000}, Transport::udp),
                             raw_option(6, 1, bytes({0, 3, 'a', '=', 'b', 0}))};
             find.entries.front().first_run.count = 2;
             t.answer_to_find(find, true, service);
           }},
      {.id = "sd.find.burst",
       .title = "answers each of ten Finds in a row",
       .requirements = {"feat_req_someipsd_824"},
       .tc8 = {"SOMEIP_ETS_127"},
       .run =
           [](Trial& t) {
             for (int count = 0; count < 10; ++count) {
               t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             }
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
