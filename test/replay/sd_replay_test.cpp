// The service discovery of every recorded conversation, with our machine in the place of either side: what it
// sends has to be what vsomeip sent then, or to differ for a reason that is listed here.
#include "test/replay/sd_replay.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "test/covers.hpp"
#include "test/sd/describe.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::sd_replay_test {

void PrintTo(const Said& said, std::ostream* out) {
  *out << fmt::format("{:.1f} ms -> {}: {}", std::chrono::duration<double, std::milli>(said.time).count(),
                      describe(said.to), said.text);
}

namespace {
using namespace std::chrono_literals;
using sd::EntryKind;

/// Why an entry was sent by one of the two sides only. Each says who is right, and by which requirement.
enum class Reason {
  /// The offers of the main phase. Ours come CYCLIC_OFFER_DELAY after the last repetition and after each
  /// other [feat_req_someipsd_80] [feat_req_someipsd_81], and explain() checks just that. vsomeip doubles the
  /// repetition delay once more first, and then sends all offers by one timer that runs since its start.
  cyclic_offer,
  /// A Find answered before the first Offer. The specification has no messages in the initial wait phase
  /// [feat_req_someipsd_62]; vsomeip answers.
  answer_in_initial_wait,
  /// A Find in the main phase answered by multicast, at the times of the optional optimisation
  /// [feat_req_someipsd_826]. Ours answers each by unicast  [feat_req_someipsd_824].
  answer_by_multicast,
  /// vsomeip's StopOffer names one of the two endpoints; it has to equal the Offer  [feat_req_someipsd_262].
  stop_offer_options,
  /// vsomeip refuses a subscription that refers to an option of unknown type too; that has to be ignored
  /// [feat_req_someipsd_1142].
  nack_for_unknown_option,
  /// vsomeip accepts a subscription from a message whose options array is longer than the message; that has
  /// to be dropped  [feat_req_someipsd_1164].
  ack_of_broken_message,
  /// The same Subscribe twice within 10 ms, without another Offer: vsomeip tells its network side once when
  /// the service comes and once when the application asked.
  asked_twice,
  /// vsomeip stops looking when the service is offered in another major version than the one it looks for.
  /// It has not found what it looks for, so ours goes on  [feat_req_someipsd_238].
  find_after_other_version,
  /// After a Nack vsomeip sends a StopSubscribe before each Subscribe. That is for a missing answer
  /// [feat_req_someipsd_844]; a Nack is one.
  stop_subscribe_after_nack,
  /// The service's TTL ran out. vsomeip looks every half second or so whether one has, says StopSubscribe to
  /// a server that is gone, and looks for the service then; ours does at once.
  late_expiry,
  /// vsomeip opens another port after it lost the service; counted for each entry that names it. Ports are
  /// the application's affair, ours keeps its one.
  new_port,
  /// No reason is known: the test fails.
  unexplained,
};

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::cyclic_offer:
      return "cyclic_offer";
    case Reason::answer_in_initial_wait:
      return "answer_in_initial_wait";
    case Reason::answer_by_multicast:
      return "answer_by_multicast";
    case Reason::stop_offer_options:
      return "stop_offer_options";
    case Reason::nack_for_unknown_option:
      return "nack_for_unknown_option";
    case Reason::ack_of_broken_message:
      return "ack_of_broken_message";
    case Reason::asked_twice:
      return "asked_twice";
    case Reason::find_after_other_version:
      return "find_after_other_version";
    case Reason::stop_subscribe_after_nack:
      return "stop_subscribe_after_nack";
    case Reason::late_expiry:
      return "late_expiry";
    case Reason::new_port:
      return "new_port";
    case Reason::unexplained:
      break;
  }
  return "unexplained";
}

void PrintTo(Reason reason, std::ostream* out) {
  *out << to_string(reason);
}

/// How many entries of each side have a reason to be missing on the other.
struct Count {
  std::size_t theirs = 0;
  std::size_t ours = 0;
  friend bool operator==(const Count&, const Count&) = default;
};
void PrintTo(const Count& count, std::ostream* out) {
  *out << "{" << count.theirs << ", " << count.ours << "}";
}
using Counts = std::map<Reason, Count>;

bool near(Duration a, Duration b) {
  return a - b <= replay_tolerance && b - a <= replay_tolerance;
}

bool near_any(Duration time, const std::vector<Duration>& times) {
  return std::any_of(times.begin(), times.end(), [time](Duration other) { return near(time, other); });
}

/// Finds the reason of one difference.
class Judge {
 public:
  Judge(const Recording& recording, const ReplayTiming& timing, const ReplayResult& result)
      : recording_{recording}, timing_{timing}, result_{result} {}

  [[nodiscard]] Reason explain(const Said& said, bool ours) const {
    switch (said.kind) {
      case EntryKind::offer_service:
        return explain_offer(said, ours);
      case EntryKind::stop_offer_service:
        return explain_stop_offer(said, ours);
      case EntryKind::subscribe_eventgroup:
        return ours ? Reason::unexplained : explain_subscribe(said);
      case EntryKind::stop_subscribe_eventgroup:
        return ours ? Reason::unexplained : explain_stop_subscribe(said);
      case EntryKind::find_service:
        return explain_find(said, ours);
      case EntryKind::subscribe_eventgroup_ack:
      case EntryKind::subscribe_eventgroup_nack:
        return explain_answer(said, ours);
      default:
        return Reason::unexplained;
    }
  }

 private:
  [[nodiscard]] Reason explain_offer(const Said& said, bool ours) const {
    const ReplayContext& context = result_.context;
    const bool multicast = said.to.address.is_multicast();
    const auto begin = std::find_if(context.offered.rbegin(), context.offered.rend(),
                                    [&](Duration first) { return first <= said.time; });
    if (begin == context.offered.rend()) {
      return !ours && !multicast && near_any(said.time, context.finds_received)
                 ? Reason::answer_in_initial_wait
                 : Reason::unexplained;
    }
    const auto& others = ours ? result_.only_theirs : result_.only_ours;
    if (near_any(said.time, context.finds_received) && multicast != ours &&
        has(others, [&](const Said& other) {
          return near(other.time, said.time) && other.text == said.text && other.to != said.to;
        })) {
      return Reason::answer_by_multicast;
    }
    const Duration main_phase = *begin + 7 * timing_.repetitions_base_delay;
    if (!multicast || said.time <= main_phase + replay_tolerance) {
      return Reason::unexplained;
    }
    const Duration cycles = said.time - main_phase;
    const bool in_step = cycles % timing_.cyclic_offer_delay == 0ms;
    return !ours || in_step ? Reason::cyclic_offer : Reason::unexplained;
  }

  [[nodiscard]] Reason explain_stop_offer(const Said& said, bool ours) const {
    // Apart from the options, the other side sent the same then.
    const std::string bare = said.text.substr(0, said.text.find(" ttl"));
    return has(ours ? result_.only_theirs : result_.only_ours,
               [&](const Said& other) {
                 return near(other.time, said.time) && other.text.starts_with(bare) &&
                        (ours ? said.text.size() > other.text.size() : said.text.size() < other.text.size());
               })
               ? Reason::stop_offer_options
               : Reason::unexplained;
  }

  // Another one like it was sent just before, and matched.
  [[nodiscard]] Reason explain_subscribe(const Said& said) const {
    return near_any(said.time, result_.context.offers_received) ? Reason::asked_twice : Reason::unexplained;
  }

  [[nodiscard]] Reason explain_stop_subscribe(const Said& said) const {
    if (received(said.time - 8s, said.time, EntryKind::subscribe_eventgroup_nack)) {
      return Reason::stop_subscribe_after_nack;
    }
    return expired(said.time) ? Reason::late_expiry : Reason::unexplained;
  }

  [[nodiscard]] Reason explain_find(const Said& said, bool ours) const {
    if (expired(said.time) || expired(said.time - 2s)) {
      return Reason::late_expiry;
    }
    const bool offered = received(said.time - 1s, said.time, EntryKind::offer_service);
    return ours && offered ? Reason::find_after_other_version : Reason::unexplained;
  }

  [[nodiscard]] Reason explain_answer(const Said& said, bool ours) const {
    const std::string question = question_before(said.time);
    const bool ack = said.kind == EntryKind::subscribe_eventgroup_ack;
    if (question.find("option 77") != std::string::npos && ack == ours) {
      return Reason::nack_for_unknown_option;
    }
    return question == "malformed" && ack && !ours ? Reason::ack_of_broken_message : Reason::unexplained;
  }

  template <typename Matches>
  [[nodiscard]] static bool has(const std::vector<Said>& said, Matches matches) {
    return std::any_of(said.begin(), said.end(), matches);
  }

  /// Whether the last offer that the client heard is older than its TTL of 3 s, and not yet 2 s longer.
  [[nodiscard]] bool expired(Duration time) const {
    const auto& offers = result_.context.offers_received;
    const auto last =
        std::find_if(offers.rbegin(), offers.rend(), [&](Duration offer) { return offer <= time; });
    return last != offers.rend() && time - *last >= 3s && time - *last < 5s;
  }

  [[nodiscard]] bool received(Duration from, Duration to, EntryKind kind) const {
    return std::any_of(recording_.datagrams.begin(), recording_.datagrams.end(),
                       [&](const RecordedBytes& datagram) {
                         const auto message = someip::decode(datagram.bytes);
                         if (!message || datagram.time < from || datagram.time > to) {
                           return false;
                         }
                         const auto sd = sd::decode(*message);
                         return sd && sd->entry_count() > 0 && sd->entry(0).kind() == kind;
                       });
  }

  /// The datagram that was sent to the server last before `time`, in words.
  [[nodiscard]] std::string question_before(Duration time) const {
    std::string last;
    for (const RecordedBytes& datagram : recording_.datagrams) {
      if (datagram.time <= time && datagram.from.address == IpAddress::v4(10, 0, 0, 2)) {
        const auto message = someip::decode(datagram.bytes);
        const bool good = message && sd::decode(*message);
        last = good ? describe_datagram(datagram.bytes) : "malformed";
      }
    }
    return last;
  }

  const Recording& recording_;
  const ReplayTiming& timing_;
  const ReplayResult& result_;
};

enum class Side { server, client };

struct Scenario {
  const char* file;
  Side side;
  std::size_t same;  ///< entries that both sent
  Counts differences{};
};

constexpr ReplayTiming usual_timing{.repetitions_base_delay = 200ms, .cyclic_offer_delay = 2s};
constexpr ReplayTiming faster_timing{.repetitions_base_delay = 200ms, .cyclic_offer_delay = 1s};
constexpr ReplayTiming slower_timing{.repetitions_base_delay = 200ms, .cyclic_offer_delay = 4s};
constexpr ReplayTiming default_timing{.repetitions_base_delay = 10ms, .cyclic_offer_delay = 1s};

ReplayTiming timing_of(const std::string& file) {
  return file.starts_with("sd_default")     ? default_timing
         : file.starts_with("sd_malformed") ? slower_timing
         : file.starts_with("reboot")       ? faster_timing
                                            : usual_timing;
}

std::string path_of(const std::string& file) {
  return test::source_dir() + "/pcaps/vsomeip/" + file + ".pcap";
}

void PrintTo(const Scenario& scenario, std::ostream* out) {
  *out << scenario.file << (scenario.side == Side::server ? ", server" : ", client");
}

/// Replays one side and judges what differs.
void check(const Recording& recording, const IpAddress& who, const ReplayTiming& timing,
           const Scenario& scenario) {
  const ReplayResult result = replay(recording, who, timing);
  EXPECT_THAT(result.broken, testing::IsEmpty());
  EXPECT_EQ(result.same, scenario.same);
  const Judge judge{recording, timing, result};
  Counts differences;
  std::vector<Said> unexplained_theirs;
  std::vector<Said> unexplained_ours;
  for (const bool ours : {false, true}) {
    for (const Said& said : ours ? result.only_ours : result.only_theirs) {
      const Reason reason = judge.explain(said, ours);
      if (reason == Reason::unexplained) {
        (ours ? unexplained_ours : unexplained_theirs).push_back(said);
      } else {
        ++(ours ? differences[reason].ours : differences[reason].theirs);
      }
    }
  }
  if (result.new_ports > 0) {
    differences[Reason::new_port].theirs = result.new_ports;
  }
  EXPECT_THAT(unexplained_theirs, testing::IsEmpty());
  EXPECT_THAT(unexplained_ours, testing::IsEmpty());
  EXPECT_EQ(differences, scenario.differences);
}

class RecordedDiscovery : public testing::TestWithParam<Scenario> {};

TEST_P(RecordedDiscovery, IsWhatOurMachineSaysInItsPlace) {
  covers({"feat_req_someipsd_68", "feat_req_someipsd_76", "feat_req_someipsd_79", "feat_req_someipsd_80",
          "feat_req_someipsd_81", "feat_req_someipsd_238", "feat_req_someipsd_262", "feat_req_someipsd_428",
          "feat_req_someipsd_431", "feat_req_someipsd_811", "feat_req_someipsd_820", "feat_req_someipsd_824",
          "feat_req_someipsd_867"});
  const Scenario& scenario = GetParam();
  check(read_recording(path_of(scenario.file)),
        IpAddress::v4(10, 0, 0, scenario.side == Side::server ? 1 : 2), timing_of(scenario.file), scenario);
}

// A recording by others that is not kept here: its client is started ten times.
TEST(PublicRecordedDiscovery, IsWhatOurMachineSaysInItsPlace) {
  const char* const folder = std::getenv("TRESTLE_SHARED_PCAPS");
  const std::string path = (folder != nullptr ? folder : test::source_dir() + "/../shared/pcaps/public") +
                           "/someip-llm-fuzzer/playground_seed.pcapng";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is not there";
  }
  const Recording recording = read_recording(path);
  check(recording, IpAddress::v4(192, 168, 40, 134), default_timing, {"server", Side::server, 41});
  check(recording, IpAddress::v4(192, 168, 40, 135), default_timing, {"client", Side::client, 23});
}

using enum Reason;
INSTANTIATE_TEST_SUITE_P(
    Vsomeip, RecordedDiscovery,
    testing::Values(
        Scenario{"e2e_events_p01_p04_p05_p07_crc32", Side::server, 10, {{cyclic_offer, {1, 1}}}},
        Scenario{"e2e_events_p01_p04_p05_p07_crc32", Side::client, 8, {}},
        Scenario{"errors_raw_client_vs_vsomeip_service",
                 Side::server,
                 4,
                 {{cyclic_offer, {10, 10}}, {stop_offer_options, {1, 1}}}},
        Scenario{"field_getter_setter_notifier",
                 Side::server,
                 18,
                 {{cyclic_offer, {2, 2}}, {stop_offer_options, {1, 1}}}},
        Scenario{"field_getter_setter_notifier", Side::client, 17, {{asked_twice, {1, 0}}}},
        Scenario{"fire_and_forget_udp_tcp",
                 Side::server,
                 4,
                 {{cyclic_offer, {1, 1}}, {stop_offer_options, {1, 1}}}},
        Scenario{"fire_and_forget_udp_tcp", Side::client, 3, {}},
        Scenario{"npdu_several_messages_per_datagram", Side::server, 12, {{cyclic_offer, {2, 2}}}},
        Scenario{"npdu_several_messages_per_datagram", Side::client, 9, {{asked_twice, {1, 0}}}},
        Scenario{"reboot_client_kill9",
                 Side::server,
                 19,
                 {{cyclic_offer, {10, 10}}, {answer_in_initial_wait, {1, 0}}, {answer_by_multicast, {1, 1}}}},
        Scenario{"reboot_client_kill9", Side::client, 19, {{late_expiry, {5, 4}}}},
        Scenario{"reboot_service_kill9", Side::server, 22, {{cyclic_offer, {5, 6}}}},
        Scenario{"reboot_service_kill9", Side::client, 16, {{new_port, {7, 0}}}},
        Scenario{"rr_tcp", Side::server, 5, {{cyclic_offer, {2, 2}}}},
        Scenario{"rr_tcp", Side::client, 3, {}},
        Scenario{"rr_tcp_magic_cookies", Side::server, 5, {{cyclic_offer, {2, 2}}}},
        Scenario{"rr_tcp_magic_cookies", Side::client, 3, {}},
        Scenario{"rr_udp", Side::server, 5, {{cyclic_offer, {2, 2}}}},
        Scenario{"rr_udp", Side::client, 3, {}},
        Scenario{"sd_default_timing",
                 Side::server,
                 17,
                 {{cyclic_offer, {7, 7}}, {answer_in_initial_wait, {1, 0}}}},
        Scenario{"sd_default_timing", Side::client, 13, {}},
        Scenario{"sd_find_wrong_major_version", Side::server, 5, {{cyclic_offer, {2, 2}}}},
        Scenario{"sd_find_wrong_major_version", Side::client, 3, {{find_after_other_version, {0, 1}}}},
        Scenario{"sd_malformed_raw_peer_vs_vsomeip_service",
                 Side::server,
                 24,
                 {{cyclic_offer, {6, 5}},
                  {answer_by_multicast, {2, 2}},
                  {nack_for_unknown_option, {1, 1}},
                  {ack_of_broken_message, {1, 0}}}},
        Scenario{"sd_many_services_many_entries", Side::server, 229, {{cyclic_offer, {48, 48}}}},
        Scenario{"sd_many_services_many_entries", Side::client, 216, {{asked_twice, {12, 0}}}},
        Scenario{"sd_multicast_eventgroup", Side::server, 10, {{cyclic_offer, {2, 3}}}},
        Scenario{"sd_multicast_eventgroup", Side::client, 9, {}},
        Scenario{"sd_offer_find_subscribe_ack_udp", Side::server, 10, {{cyclic_offer, {2, 2}}}},
        Scenario{"sd_offer_find_subscribe_ack_udp", Side::client, 9, {}},
        Scenario{"sd_service_first_client_late",
                 Side::server,
                 10,
                 {{cyclic_offer, {3, 3}}, {stop_offer_options, {1, 1}}}},
        Scenario{"sd_service_first_client_late", Side::client, 5, {{asked_twice, {1, 0}}}},
        Scenario{"sd_stopoffer_stopsubscribe_reoffer", Side::server, 21, {{cyclic_offer, {2, 3}}}},
        Scenario{"sd_stopoffer_stopsubscribe_reoffer", Side::client, 15, {{new_port, {5, 0}}}},
        Scenario{"sd_subscribe_nack_unknown_eventgroup", Side::server, 10, {{cyclic_offer, {3, 3}}}},
        Scenario{
            "sd_subscribe_nack_unknown_eventgroup", Side::client, 8, {{stop_subscribe_after_nack, {5, 0}}}},
        Scenario{"sd_subscribe_tcp_events", Side::server, 10, {{cyclic_offer, {2, 2}}}},
        Scenario{"sd_subscribe_tcp_events", Side::client, 9, {}},
        Scenario{"sd_subscribe_udp_and_tcp_same_eventgroup",
                 Side::server,
                 9,
                 {{cyclic_offer, {2, 2}}, {stop_offer_options, {1, 1}}}},
        Scenario{"sd_subscribe_udp_and_tcp_same_eventgroup", Side::client, 9, {}},
        Scenario{"tp_event_1mib_plus", Side::server, 11, {{cyclic_offer, {2, 2}}}},
        Scenario{"tp_event_1mib_plus", Side::client, 9, {}},
        Scenario{"tp_event_multicast", Side::server, 10, {{cyclic_offer, {1, 1}}}},
        Scenario{"tp_event_multicast", Side::client, 8, {}},
        Scenario{"tp_event_small_to_256k", Side::server, 10, {{cyclic_offer, {1, 2}}}},
        Scenario{"tp_event_small_to_256k", Side::client, 8, {}},
        Scenario{"tp_request_response", Side::server, 5, {{cyclic_offer, {3, 3}}}},
        Scenario{"tp_request_response", Side::client, 3, {}},
        Scenario{"tp_separation_time_and_short_segments", Side::server, 11, {{cyclic_offer, {2, 2}}}},
        Scenario{"tp_separation_time_and_short_segments", Side::client, 9, {}}),
    [](const auto& scenario) {
      return std::string{scenario.param.file} + (scenario.param.side == Side::server ? "_server" : "_client");
    });

}  // namespace
}  // namespace trestle::test::sd_replay_test
