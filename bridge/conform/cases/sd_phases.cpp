#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

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
    t.missing(
        fmt::format("{} offers by multicast within {} ms, expected {}", all.size(), within / 1ms, count),
        fmt::format("{} OfferServices by multicast", count));
  }
  return all;
}

std::string milliseconds(Duration time) {
  return fmt::format("{:.1f} ms", std::chrono::duration<double, std::milli>(time).count());
}

/// A time between offers, by the kernel's clock.
struct Gap {
  Duration time{};
  Duration expected{};
  Packet* packet = nullptr;  ///< of the later one

  /// A fifth of the time, and for short ones what a system with tasks needs.
  [[nodiscard]] bool is_right() const {
    return time > expected - expected / 5 - 10ms && time < expected + expected / 5 + 30ms;
  }
};

/// A busy machine delays a packet, and then the next gap is short. So offers are looked at up to three times:
/// a device whose times are others shows that each time.
void require_gaps(Trial& t, const std::function<std::vector<Gap>()>& look) {
  for (int round = 1;; ++round) {
    const std::vector<Gap> gaps = look();
    const auto wrong = std::ranges::find_if(gaps, [](const Gap& one) { return !one.is_right(); });
    if (wrong == gaps.end()) {
      return;
    }
    if (round == 3) {
      t.different("time between offers",
                  fmt::format("{}, and a fifth more or less", milliseconds(wrong->expected)),
                  milliseconds(wrong->time), wrong->packet);
      return;
    }
  }
}

std::vector<Gap> repetitions(Trial& t) {
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
  std::vector<Gap> gaps;
  for (std::size_t repetition = 0; repetition < count; ++repetition) {
    const auto before = begin + static_cast<std::ptrdiff_t>(repetition);
    if (before + 1 >= offers.end()) {
      break;
    }
    gaps.push_back(
        {before[1].packet->time - before->packet->time, base * (1U << repetition), before[1].packet});
  }
  return gaps;
}

/// The mean of three.
std::vector<Gap> cyclic(Trial& t) {
  const Duration cycle = *t.profile.timing.cyclic_offer_delay;
  const std::size_t since = t.now();
  const auto offers = await_offers(t, since, 4, cycle * 6 + 2s);
  return {{(offers[3].packet->time - offers[0].packet->time) / 3, cycle, offers[3].packet}};
}

void stop_offer(Trial& t) {
  const std::size_t since = t.now();
  t.stop_device();
  const auto seen = t.await_entry(since, t.profile.timing.answer_within, [&](const SeenEntry& one) {
    return one.entry.kind() == sd::EntryKind::stop_offer_service &&
           one.entry.service == t.profile.service().service &&
           one.entry.instance == t.profile.service().instance;
  });
  t.start_device();
  if (!t.await_entry(t.now(), t.profile.timing.ready_within, Trial::is_offer(t.profile.service()))) {
    t.missing("the device does not offer its service after it was started", "an OfferService");
  }
  if (!seen) {
    t.missing("no StopOfferService when the device was stopped", "a StopOfferService");
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

/// Sessions count for each of the two. Who counts both as one takes the lower number for that of a client
/// which was restarted, and ends its subscriptions.
void separate_channels(Trial& t) {
  const ServiceProfile& service = t.profile.service();
  const sd::Entry find = Trial::find_entry(service);
  // As after a restart: both begin with 1. By multicast first, so that it has been seen there before the
  // subscription; and so often that a device does not take the first one by unicast for one of before, twice.
  t.sessions.reboot();
  for (int count = 0; count < 6; ++count) {
    t.answer_to_find(find, true, service);
  }
  constexpr int ahead = 12;  // more than one by multicast can be repeated
  for (int count = 0; count < ahead; ++count) {
    t.answer_to_find(find, false, service);
  }
  const EventSource source = t.source();
  t.acknowledged(t.subscribe(source));
  t.event(source);
  t.answer_to_find(find, true, service);
  t.pass();
  t.event(source);
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
       .budget = 30s,
       .run = [](Trial& t) { require_gaps(t, [&] { return repetitions(t); }); }},
      {.id = "sd.phase.cyclic",
       .title = "repeats offers with the cyclic offer delay",
       .requirements = {"feat_req_someipsd_79", "feat_req_someipsd_80", "feat_req_someipsd_81"},
       .tc8 = {"SOMEIPSRV_SD_BEHAVIOR_02"},
       .needs = Need::cyclic_offers,
       .budget = 120s,
       .run =
           [](Trial& t) {
             // In the repetition phase, where the device may still be, offers are nearer to each other.
             const TimingProfile& timing = t.profile.timing;
             t.tester.receive(timing.repetitions_base_delay.value_or(Duration{0}) *
                                  (1U << timing.repetitions_max.value_or(0)),
                              [] { return false; });
             require_gaps(t, [&] { return cyclic(t); });
           }},
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
             t.initial_values({group.events.front()}, stimulus);
             t.initial_values({group.events.front()}, [&] {
               t.pass();  // another Session ID than after the last restart
               t.sessions.reboot();
               t.acknowledged(stimulus);
             });
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
      {.id = "sd.reboot.channels",
       .title =
           "keeps a subscription when the sessions of its client by multicast are behind those by unicast",
       .requirements = {"feat_req_someipsd_765", "feat_req_someipsd_764"},
       .needs = Need::event,
       .budget = 60s,
       .run = separate_channels},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
