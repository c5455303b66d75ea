#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/device.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// Gets initial events by a subscription, so that it is known that the device has it.
void subscribed(Trial& t, const SdStimulus& stimulus, someip::MethodId event) {
  const std::size_t since = t.now();
  t.acknowledged(stimulus);
  t.event(event, since);
}

std::vector<SeenEntry> multicast_offers(Trial& t, std::size_t since) {
  return t.entries_since(since, [&](const SeenEntry& seen) {
    return Trial::is_offer(t.profile.service())(seen) && seen.packet->to == t.tester.sd_group();
  });
}

/// Waits until there are so many.
std::vector<SeenEntry> await_offers(Trial& t, std::size_t since, std::size_t count, Duration within) {
  std::vector<SeenEntry> all;
  t.tester.receive(within, [&] {
    all = multicast_offers(t, since);
    return all.size() >= count;
  });
  if (all.size() < count) {
    t.fail(fmt::format("{} offers by multicast within {} ms, expected {}", all.size(), within / 1ms, count));
  }
  return all;
}

std::string milliseconds(Duration time) {
  return fmt::format("{:.1f} ms", std::chrono::duration<double, std::milli>(time).count());
}

/// That a gap between two packets, by the kernel's clock, is as it was configured. A busy machine delays a
/// packet, and then the next gap is short: what is tolerated is half the time, and 30 ms.
void require_gap(Trial& t, const SeenEntry& before, const SeenEntry& after, Duration expected) {
  const Duration gap = after.packet->time - before.packet->time;
  const Duration tolerance = expected / 2 + 30ms;
  t.require(gap > expected - expected / 2 - 10ms && gap < expected + tolerance, "time between offers",
            "about " + milliseconds(expected), milliseconds(gap), after.packet);
}

void repetitions(Trial& t) {
  const Duration base = *t.profile.timing.repetitions_base_delay;
  const std::size_t count = *t.profile.timing.repetitions_max;
  const std::size_t since = t.restart();
  Duration total = t.profile.timing.ready_within;
  for (std::size_t repetition = 0; repetition < count; ++repetition) {
    total += base * (1U << repetition) * 2;
  }
  const auto offers = await_offers(t, since, count + 1, total);
  // The last session of the device before may have sent an offer, too: the first with session 1 begins.
  const auto first = std::ranges::find_if(offers, [](const SeenEntry& seen) {
    return seen.header.session == someip::SessionId{1} && seen.message.reboot();
  });
  const auto begin = first == offers.end() ? offers.begin() : first;
  for (std::size_t repetition = 0; repetition < count; ++repetition) {
    const auto before = begin + static_cast<std::ptrdiff_t>(repetition);
    if (before + 1 >= offers.end()) {
      break;
    }
    require_gap(t, *before, before[1], base * (1U << repetition));
  }
}

void cyclic(Trial& t) {
  const Duration cycle = *t.profile.timing.cyclic_offer_delay;
  const std::size_t since = t.now();
  const auto offers = await_offers(t, since, 4, cycle * 6 + 2s);
  for (std::size_t at = 1; at < offers.size(); ++at) {
    require_gap(t, offers[at - 1], offers[at], cycle);
  }
}

void stop_offer(Trial& t) {
  const std::size_t since = t.now();
  t.device.stop();
  const auto seen = t.await_entry(since, t.profile.timing.answer_within, [&](const SeenEntry& one) {
    return one.entry.kind() == sd::EntryKind::stop_offer_service &&
           one.entry.service == t.profile.service().service &&
           one.entry.instance == t.profile.service().instance;
  });
  t.device.start();
  if (!t.await_entry(t.now(), t.profile.timing.ready_within, Trial::is_offer(t.profile.service()))) {
    t.fail("the device does not offer its service after it was started");
  }
  if (!seen) {
    t.fail("no StopOfferService when the device was stopped");
  }
  const ServiceProfile& service = t.profile.service();
  t.equal("major version", service.major, seen->entry.major, seen->packet);
  t.equal("minor version", service.minor, seen->entry.minor(), seen->packet);
}

void no_event(Trial& t, const EventSource& source, const char* why) {
  for (const SeenMessage& seen : t.all_events(source)) {
    t.different("event", std::string{"none, "} + why, "one", seen.packet);
    return;
  }
}

}  // namespace

void add_sd_phase_cases(Cases& cases) {
  const Cases all{
      {.id = "sd.phase.initial",
       .title = "sends its first offer by multicast, soon after its start (timing: ready_within)",
       .requirements = {"feat_req_someipsd_62", "feat_req_someipsd_72", "feat_req_someipsd_429",
                        "feat_req_someipsd_811"},
       .needs = Need::restart,
       .run = [](Trial& t) { await_offers(t, t.restart(), 1, t.profile.timing.ready_within); }},
      {.id = "sd.phase.repetition",
       .title = "doubles the time between the offers of the repetition phase",
       .requirements = {"feat_req_someipsd_67", "feat_req_someipsd_73", "feat_req_someipsd_76",
                        "feat_req_someipsd_66"},
       .tc8 = {"SOMEIPSRV_SD_BEHAVIOR_01"},
       .needs = Need::restart | Need::repetitions,
       .run = repetitions},
      {.id = "sd.phase.cyclic",
       .title = "repeats offers with the cyclic offer delay",
       .requirements = {"feat_req_someipsd_79", "feat_req_someipsd_80", "feat_req_someipsd_81"},
       .tc8 = {"SOMEIPSRV_SD_BEHAVIOR_02"},
       .needs = Need::cyclic_offers,
       .budget = 60s,
       .run = cyclic},
      {.id = "sd.stop-offer",
       .title = "withdraws its offers when it is stopped",
       .requirements = {"feat_req_someipsd_261", "feat_req_someipsd_262", "feat_req_someipsd_821",
                        "feat_req_someipsd_811"},
       .needs = Need::stop,
       .run = stop_offer},
      {.id = "sd.subscription.stop-ends-events",
       .title = "sends no events any more after a StopSubscribe",
       .requirements = {"feat_req_someipsd_1297", "feat_req_someip_807", "feat_req_someipsd_625",
                        "feat_req_someipsd_442"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const EventSource source = t.source();
             const SdStimulus stimulus = t.subscribe(source);
             t.acknowledged(stimulus);
             t.event(source);
             t.unsubscribe(stimulus);
             t.pass();
             no_event(t, source, "as the subscription has ended");
           }},
      {.id = "sd.subscription.ttl-expires",
       .title = "sends no events any more when the TTL of a subscription is over",
       .requirements = {"feat_req_someipsd_445", "feat_req_someip_807", "feat_req_someipsd_625"},
       .tc8 = {"SOMEIP_ETS_095"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const EventSource source = t.source();
             t.acknowledged(t.subscribe(source, 1));
             t.event(source);
             t.tester.receive(1500ms, [] { return false; });
             no_event(t, source, "as the TTL is over");
           }},
      {.id = "sd.reboot.ends-subscriptions",
       .title = "ends the subscriptions of a client that was restarted",
       .requirements = {"feat_req_someipsd_764", "feat_req_someipsd_871", "feat_req_someipsd_863"},
       .tc8 = {"SOMEIP_ETS_094"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const EventSource source = t.source();
             t.acknowledged(t.subscribe(source));
             t.event(source);
             t.sessions.reboot();
             t.pass();
             no_event(t, source, "as the client was restarted");
           }},
      {.id = "sd.reboot.initial-events-again",
       .title = "sends initial events again to a client that was restarted",
       .requirements = {"feat_req_someipsd_871", "feat_req_someipsd_833"},
       .needs = Need::initial_values | Need::udp,
       .run =
           [](Trial& t) {
             const EventgroupProfile& group =
                 t.eventgroup([](const EventgroupProfile& one) { return one.initial_values && !one.tcp; });
             const SdStimulus stimulus = t.subscribe(group);
             subscribed(t, stimulus, group.events.front());
             t.sessions.reboot();
             subscribed(t, stimulus, group.events.front());
           }},
      {.id = "sd.reboot.by-unicast-and-multicast",
       .title = "acknowledges the subscriptions of a client before and after its restart",
       .requirements = {"feat_req_someipsd_765", "feat_req_someipsd_764", "feat_req_someipsd_813"},
       .tc8 = {"SOMEIP_ETS_093"},
       .needs = Need::eventgroup,
       .run =
           [](Trial& t) {
             const SdStimulus stimulus = t.subscribe(t.eventgroup());
             t.acknowledged(stimulus);
             t.acknowledged(stimulus);
             t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             t.sessions.reboot();
             t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             t.acknowledged(stimulus);
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
