#include "bridge/conform/fuzz/campaign.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <deque>
#include <fstream>
#include <set>

#include "bridge/conform/capture_writer.hpp"
#include "bridge/conform/device.hpp"
#include "bridge/conform/fuzz/behaviour.hpp"
#include "bridge/conform/fuzz/coverage_map.hpp"
#include "bridge/conform/fuzz/player.hpp"
#include "bridge/conform/fuzz/process_watch.hpp"
#include "bridge/conform/fuzz/rule_watch.hpp"
#include "bridge/conform/fuzz/sequences.hpp"
#include "bridge/conform/tester.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Answers to what was sent last may still come for so long.
constexpr Duration settling = 2ms;
/// What a device that is started anew may have been led to by: the last sequences before a finding.
constexpr std::size_t most_recent = 64;
constexpr std::size_t most_kept = 1'000;
constexpr std::size_t most_wanted = 64;
constexpr std::size_t most_tries = 60;
constexpr int crash_attempts = 3;
/// No try begins later than this: where a device is silent, each takes seconds.
constexpr Duration most_time_for_tries = 20s;
constexpr std::size_t most_times = 4'096;
/// An answer is slow when it takes longer than this, and ten times as long as usual.
constexpr Duration slow = 250ms;
/// So many sequences are sent before memory and descriptors are looked at first, and then each time.
constexpr std::uint64_t warm_up = 256;
constexpr std::uint64_t between_looks = 64;

struct Cancelled {};
struct DeviceEnded {
  std::string how;
};

/// What is wrong after a sequence.
struct Sign {
  FindingKind kind{};
  std::string key;
  std::string what;
};

class Campaign {
 public:
  Campaign(const Profile& profile, const FuzzOptions& options)
      : profile_{profile},
        options_{options},
        tester_{profile.tester, profile.multicast, profile.sd_port},
        coverage_{options.folder + "/coverage.map"},
        device_{profile_, options.programs, options.folder + "/device.log", options.fault},
        player_{profile_, tester_, sessions_},
        trial_{profile_, tester_, device_, sessions_},
        sequences_{targets_of(profile), wanted_services(profile), player_.own(), options.interfaces},
        random_{options.seed} {
    tester_.watch([this] { check(); });
  }

  FuzzResult run();
  std::vector<Finding> replay(const Sequence& sequence);

 private:
  void check() const {
    if (options_.cancelled && options_.cancelled()) {
      throw Cancelled{};
    }
    if (watching_) {
      if (const auto how = device_.ended()) {
        throw DeviceEnded{*how};
      }
    }
  }

  [[nodiscard]] bool can_restart() const {
    return !profile_.lifecycle.start.empty() || !profile_.lifecycle.restart.empty();
  }
  [[nodiscard]] std::chrono::milliseconds elapsed() const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began_);
  }
  [[nodiscard]] bool is_over() const {
    return elapsed() >= options_.time ||
           (options_.max_sequences != 0 && result_.done.sequences >= options_.max_sequences);
  }

  /// Not of others in the group.
  [[nodiscard]] bool is_of_device(const Packet& packet) const {
    return !packet.sent && packet.from.address == profile_.device;
  }

  bool await_device();
  bool start_anew();
  void stop_device();
  void learn_offers();
  void learn_offer(const SeenEntry& seen);
  void learn_services();
  void learn_wishes();
  Sequence next_sequence();
  std::vector<Sign> play(const Sequence& sequence);
  std::optional<Sign> ask();
  std::optional<Sign> restart_sign();
  void keep_if_new(const Sequence& sequence);
  void look_at_process();
  void on_sign(const Sign& sign, const Sequence& sequence);
  void add_finding(Finding finding);
  bool shows(const Sequence& sequence, const std::string& key);
  void shorten(Finding& finding);
  void write_evidence(Finding& finding);
  void tell_progress();

  Profile profile_;  ///< with the services that the device was seen to offer, where it had none
  const FuzzOptions& options_;
  Tester tester_;
  CoverageMap coverage_;
  mutable Device device_;
  SdSessions sessions_;
  Player player_;
  Trial trial_;  ///< asks the device whether it is there
  Sequences sequences_;
  fuzz::Random random_;
  FuzzResult result_;
  Clock::time_point began_ = Clock::now();
  Clock::time_point told_ = began_;
  bool watching_ = false;  ///< the device runs, so that its end is a finding
  bool thorough_ = false;  ///< Finds are asked, too, not only each 32nd time

  std::deque<Sequence> first_;  ///< what is tried before all else
  std::vector<Sequence> kept_;
  std::deque<Sequence> recent_;  ///< since the device was started last
  std::set<std::uint64_t> behaviours_;
  std::vector<std::chrono::microseconds> times_;  ///< of answers
  std::optional<ProcessMeans> means_before_;
  struct Sessions {
    std::uint16_t last = 0;
    bool reboot = false;
  };
  std::map<Endpoint, Sessions> device_sessions_;  ///< by where its messages go to
};

bool Campaign::await_device() {
  const Clock::time_point until = Clock::now() + profile_.timing.ready_within;
  while (profile_.services.empty() && std::ranges::all_of(profile_.uses, &UsedService::by_ets) &&
         Clock::now() < until) {
    learn_services();
  }
  bool there = trial_.is_there();
  while (!there && Clock::now() < until) {
    there = trial_.is_there();
  }
  return there;
}

/// A device as it was at the beginning, where that can be had.
bool Campaign::start_anew() {
  watching_ = false;
  player_.close_connections();
  recent_.clear();
  device_sessions_.clear();
  means_before_.reset();
  if (can_restart()) {
    ++result_.restarts;
    device_.restart(true);
  }
  try {
    watching_ = true;
    const bool there = await_device();
    tester_.forget();
    return there;
  } catch (const DeviceEnded&) {
    return false;
  }
}

/// Services that the device offers, though the profile does not name them.
void Campaign::learn_offers() {
  const std::size_t since = trial_.now();
  trial_.send_sd({.entries = {{.type = sd::EntryType::find_service,
                               .service = someip::ServiceId{0xffff},
                               .instance = someip::InstanceId{0xffff},
                               .major = sd::any_major,
                               .ttl_s = 3,
                               .tail = sd::any_minor}}},
                 true, "FindService");
  tester_.receive(std::min<Duration>(profile_.timing.cyclic_offer_delay.value_or(1s) + 100ms, 3s),
                  [] { return false; });
  for (const SeenEntry& seen : trial_.entries_since(
           since, [](const SeenEntry& one) { return one.entry.kind() == sd::EntryKind::offer_service; })) {
    learn_offer(seen);
  }
  learn_wishes();
}

void Campaign::learn_offer(const SeenEntry& seen) {
  const bool known = std::ranges::any_of(sequences_.targets(), [&](const Target& one) {
    return one.service.service == value(seen.entry.service) &&
           one.service.instance == value(seen.entry.instance) && one.service.major == seen.entry.major;
  });
  if (known) {
    return;
  }
  Target target{.service = {.service = value(seen.entry.service),
                            .instance = value(seen.entry.instance),
                            .major = seen.entry.major,
                            .minor = seen.entry.minor()}};
  for (const sd::EndpointOption& endpoint : seen.endpoints()) {
    (endpoint.transport == Transport::tcp ? target.tcp_port : target.udp_port) = endpoint.endpoint.port;
  }
  sequences_.add(std::move(target));
}

/// Of a device whose profile has no services: what it offers takes their place.
void Campaign::learn_services() {
  learn_offers();
  for (const Target& one : sequences_.targets()) {
    ServiceProfile service{.service = someip::ServiceId{one.service.service},
                           .instance = someip::InstanceId{one.service.instance},
                           .major = one.service.major,
                           .minor = one.service.minor};
    if (one.udp_port != 0) {
      service.udp_port = one.udp_port;
    }
    if (one.tcp_port != 0) {
      service.tcp_port = one.tcp_port;
    }
    profile_.services.push_back(std::move(service));
  }
}

/// Services that the device looks for, and where it wants the events of those that it uses.
void Campaign::learn_wishes() {
  for (const SeenEntry& seen : trial_.entries_since(0, [](const SeenEntry& one) {
         return one.entry.kind() == sd::EntryKind::find_service ||
                one.entry.kind() == sd::EntryKind::subscribe_eventgroup;
       })) {
    const std::uint16_t service = value(seen.entry.service);
    const bool known = std::ranges::find(sequences_.wanted(), service, &fuzz::KnownService::service) !=
                       sequences_.wanted().end();
    if (!known && service != 0xffff && sequences_.wanted().size() < most_wanted) {
      const bool any_instance = seen.entry.instance == someip::any_instance;
      sequences_.add_wanted(
          {.service = service,
           .instance = any_instance ? std::uint16_t{1} : value(seen.entry.instance),
           .major = seen.entry.major == sd::any_major ? std::uint8_t{1} : seen.entry.major});
    }
    for (const sd::EndpointOption& endpoint : seen.endpoints()) {
      if (endpoint.transport == Transport::udp && endpoint.endpoint.address == profile_.device) {
        sequences_.subscribed(service, endpoint.endpoint.port);
      }
    }
  }
}

Sequence Campaign::next_sequence() {
  if (!first_.empty()) {
    Sequence one = std::move(first_.front());
    first_.pop_front();
    return one;
  }
  if (kept_.empty() || random_.chance(50)) {
    return sequences_.make(random_);
  }
  return sequences_.changed(random_.pick(kept_), random_.pick(kept_), random_);
}

/// Whether the device is there, and how quickly it says so.
std::optional<Sign> Campaign::ask() {
  const Clock::time_point asked = Clock::now();
  const bool quick = profile_.service().request && profile_.service().udp_port;
  if (quick && !trial_.answer_if_any(trial_.request())) {
    // It may be that this method alone has no answer any more.
    const bool there = trial_.alive();
    return Sign{FindingKind::silent, there ? "silence request" : "silence",
                there ? "the request of the profile is not answered any more, though Finds are"
                      : "the device does not answer any more"};
  }
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - asked);
  bool there = (quick && !thorough_ && result_.done.sequences % 32 != 0) || trial_.alive();
  // Who believes only so many restarts of a peer in a row does not hear it for some seconds after that.
  for (int again = 0; again < 3 && quick && !there; ++again) {
    there = trial_.alive();
  }
  if (!there) {
    return quick ? Sign{FindingKind::silent, "silence finds",
                        "Finds are not answered any more, though the request of the profile is"}
                 : Sign{FindingKind::silent, "silence", "the device does not answer any more"};
  }
  if (!quick) {
    return std::nullopt;
  }
  if (times_.size() < most_times) {
    times_.push_back(took);
  } else {
    times_[random_.below(most_times)] = took;
  }
  result_.answer_longest = std::max(result_.answer_longest, took);
  if (took > slow && times_.size() > 64 && tester_.stalled() == Duration{0}) {
    std::vector<std::chrono::microseconds> sorted = times_;
    std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
    if (took > 10 * sorted[sorted.size() / 2]) {
      return Sign{FindingKind::slow, "slowness",
                  fmt::format("an answer took {} ms; half of all take less than {} us", took / 1ms,
                              sorted[sorted.size() / 2].count())};
    }
  }
  return std::nullopt;
}

/// The device's own messages of service discovery say that it was started anew. [feat_req_someipsd_764]
std::optional<Sign> Campaign::restart_sign() {
  std::optional<Sign> sign;
  for (const Packet& packet : tester_.packets()) {
    const auto message = someip::decode(packet.bytes);
    if (!is_of_device(packet) || !message || !sd::is_sd(message->header) || message->payload.empty()) {
      continue;
    }
    const auto session = static_cast<std::uint16_t>(value(message->header.session));
    const bool reboot = (message->payload.front() & std::byte{sd::reboot_flag}) != std::byte{};
    auto [known, is_new] = device_sessions_.try_emplace(packet.to, Sessions{session, reboot});
    Sessions& before = known->second;
    if (!is_new && reboot && (!before.reboot || session <= before.last)) {
      sign = Sign{
          FindingKind::restarted, "restart",
          fmt::format("the Reboot flag is set with Session ID {:#06x} after {:#06x}", session, before.last)};
    }
    before = {session, reboot};
  }
  return sign;
}

/// Sends a sequence, and says what is wrong then.
std::vector<Sign> Campaign::play(const Sequence& sequence) {
  tester_.forget();
  std::vector<Sign> signs;
  try {
    if (sequence.state == Sequences::after_reboot) {
      player_.reboot();
    }
    player_.play(sequence);
    tester_.receive(settling, [] { return false; });
    const std::size_t sent = sequence.steps.size();
    ++result_.done.sequences;
    result_.done.messages += sent;
    learn_wishes();
    auto lack = ask();
    // Where this program stood still, the device may have, too.
    for (int again = 0; again < 3 && lack && lack->kind == FindingKind::silent && tester_.stalled() > 0ms;
         ++again) {
      lack = ask();
    }
    if (lack) {
      signs.push_back(std::move(*lack));
    }
    for (BrokenRule& rule : broken_rules(tester_.packets(), profile_.device)) {
      signs.push_back({FindingKind::breaks_rule, "rule " + rule.id, rule.id + ": " + rule.what});
    }
    if (auto sign = restart_sign()) {
      signs.push_back(std::move(*sign));
    }
  } catch (const DeviceEnded& ended) {
    signs.assign(1, {FindingKind::ended, "crash " + ended.how, "the device " + ended.how});
  }
  return signs;
}

void Campaign::keep_if_new(const Sequence& sequence) {
  bool is_new = coverage_.grown();
  for (const Packet& packet : tester_.packets()) {
    is_new = (is_of_device(packet) && !packet.ends &&
              behaviours_.insert(behaviour(sequence.state, packet)).second) ||
             is_new;
  }
  result_.done.behaviours = behaviours_.size();
  result_.done.places = coverage_.count();
  if (!is_new) {
    return;
  }
  ++result_.kept;
  if (kept_.size() < most_kept) {
    kept_.push_back(sequence);
  } else {
    kept_[random_.below(most_kept)] = sequence;
  }
}

void Campaign::look_at_process() {
  const auto process = options_.process       ? options_.process
                       : device_.group() != 0 ? largest_of_group(device_.group())
                                              : std::nullopt;
  if (!process) {
    return;
  }
  player_.close_connections();
  tester_.receive(20ms, [] { return false; });
  const auto means = means_of(*process);
  if (!means) {
    return;
  }
  if (!means_before_) {
    means_before_ = means;
    if (result_.memory_before == 0) {
      result_.memory_before = means->memory;
      result_.descriptors_before = means->descriptors;
    }
  }
  result_.memory_after = means->memory;
  result_.descriptors_after = means->descriptors;
  const Sequence all{.state = "since the device was started", .steps = {}};
  if (means->memory > means_before_->memory + options_.max_memory_growth) {
    on_sign({FindingKind::grows, "memory",
             fmt::format("the device's memory grew from {} to {} kB", means_before_->memory / 1024,
                         means->memory / 1024)},
            all);
  }
  if (means->descriptors > means_before_->descriptors + options_.max_descriptor_growth) {
    on_sign({FindingKind::leaks, "descriptors",
             fmt::format("the device had {} file descriptors, and has {}", means_before_->descriptors,
                         means->descriptors)},
            all);
  }
}

/// Whether a device that is started anew shows the same after this sequence.
bool Campaign::shows(const Sequence& sequence, const std::string& key) {
  if (!start_anew()) {
    return false;
  }
  thorough_ = true;
  const std::vector<Sign> signs = play(sequence);
  thorough_ = false;
  return std::ranges::any_of(signs, [&](const Sign& sign) { return sign.key == key; });
}

/// The shortest sequence that shows it, where the device can be started anew for each try.
void Campaign::shorten(Finding& finding) {
  finding.steps_found = finding.sequence.steps.size();
  if (!can_restart() || finding.sequence.steps.empty()) {
    return;
  }
  // What led to it may have come before.
  std::vector<Sequence> candidates{finding.sequence};
  for (const std::size_t count : {std::size_t{4}, most_recent}) {
    Sequence longer{.state = recent_.empty() ? "" : recent_.front().state, .steps = {}};
    for (std::size_t at = recent_.size() - std::min(count, recent_.size()); at < recent_.size(); ++at) {
      longer.steps.insert(longer.steps.end(), recent_[at].steps.begin(), recent_[at].steps.end());
    }
    candidates.push_back(std::move(longer));
  }
  // With threads in the device a crash may take its luck. Silence is not tried as often: each try takes
  // seconds.
  const int attempts = finding.kind == FindingKind::ended ? crash_attempts : 1;
  for (const Sequence& candidate : candidates) {
    bool shown = false;
    for (int attempt = 0; attempt < attempts && !shown; ++attempt) {
      shown = shows(candidate, finding.key);
    }
    if (shown) {
      finding.confirmed = true;
      finding.steps_found = candidate.steps.size();
      const Clock::time_point until = Clock::now() + most_time_for_tries;
      finding.sequence = minimised(candidate, most_tries, [&](const Sequence& one) {
        return Clock::now() < until && shows(one, finding.key);
      });
      return;
    }
  }
  finding.sequence = candidates.back();
}

/// A capture of the sequence and of what the device sends.
void Campaign::write_evidence(Finding& finding) {
  if (!finding.sequence.steps.empty() && can_restart()) {
    (void)shows(finding.sequence, finding.key);
  }
  if (!tester_.packets().empty()) {
    std::deque<Packet>& packets = tester_.packets();
    const auto last =
        std::find_if(packets.rbegin(), packets.rend(), [](const Packet& one) { return one.sent; });
    if (last != packets.rend()) {
      Trial::comment(&*last, "OFFENDING: " + finding.what);
    }
  }
  finding.evidence =
      fmt::format("finding-{:03}-{}.pcapng", result_.findings.size() + 1, to_string(finding.kind));
  std::ofstream{options_.folder + "/" + finding.evidence, std::ios::binary}
      << pcapng(tester_.packets(), finding.what);
}

void Campaign::add_finding(Finding finding) {
  write_evidence(finding);
  result_.findings.push_back(std::move(finding));
  ++result_.done.findings;
  if (options_.on_finding) {
    options_.on_finding(result_.findings.back());
  }
}

void Campaign::on_sign(const Sign& sign, const Sequence& sequence) {
  const auto known = std::ranges::find(result_.findings, sign.key, &Finding::key);
  const bool is_over = sign.kind == FindingKind::ended || sign.kind == FindingKind::silent ||
                       sign.kind == FindingKind::grows || sign.kind == FindingKind::leaks;
  if (known != result_.findings.end()) {
    ++known->seen;
  } else {
    Finding finding{
        .kind = sign.kind, .key = sign.key, .what = sign.what, .sequence = sequence, .after = elapsed()};
    const bool needs_proof = sign.kind == FindingKind::slow || sign.kind == FindingKind::restarted ||
                             sign.key == std::string{"rule "} + answered_once;
    shorten(finding);
    // A machine that is busy with other things is slow, too.
    if (needs_proof && can_restart() && !finding.confirmed) {
      ++result_.unconfirmed[finding.key];
    } else {
      add_finding(std::move(finding));
    }
  }
  if (is_over && can_restart() && !start_anew()) {
    result_.gave_up = "the device does not come back after a restart";
  }
}

void Campaign::tell_progress() {
  result_.done.since_begin = elapsed();
  if (options_.on_progress && Clock::now() - told_ > 200ms) {
    told_ = Clock::now();
    options_.on_progress(result_.done);
  }
}

/// A device that cannot be stopped takes no findings along.
void Campaign::stop_device() {
  try {
    device_.stop();
  } catch (const std::runtime_error& error) {
    result_.gave_up += (result_.gave_up.empty() ? "" : "; ") + std::string{error.what()};
  }
}

FuzzResult Campaign::run() {
  result_.started = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  device_.start();
  try {
    watching_ = true;
    if (!await_device()) {
      result_.gave_up =
          "the device does not answer after its start; look at the addresses in the profile, at "
          "firewalls and routes, and at device.log";
      stop_device();
      return result_;
    }
    learn_offers();
    std::ranges::move(sequences_.make_spoilt(random_), std::back_inserter(first_));
    if (sequences_.targets().empty() && sequences_.wanted().empty()) {
      result_.gave_up = "the device offers no service, and looks for none";
    }
    for (std::size_t silent = 0; !is_over() && result_.gave_up.empty();) {
      const Sequence sequence = next_sequence();
      ++result_.states[sequence.state];
      const std::vector<Sign> signs = play(sequence);
      keep_if_new(sequence);
      recent_.push_back(sequence);
      if (recent_.size() > most_recent) {
        recent_.pop_front();
      }
      for (const Sign& sign : signs) {
        on_sign(sign, sequence);
      }
      const bool is_silent =
          std::ranges::any_of(signs, [](const Sign& sign) { return sign.kind == FindingKind::silent; });
      silent = is_silent ? silent + 1 : 0;
      if (!can_restart() && silent >= 3) {
        result_.gave_up = "the device is silent, and the profile has no command that starts it anew";
      }
      if (result_.findings.size() >= options_.max_findings) {
        result_.gave_up = fmt::format("there are {} findings", result_.findings.size());
      }
      if (result_.done.sequences % between_looks == 0 && result_.done.sequences >= warm_up) {
        look_at_process();
      }
      tell_progress();
    }
  } catch (const DeviceEnded& ended) {
    result_.gave_up = "the device " + ended.how + " right after its start; see device.log";
  } catch (const Cancelled&) {
    result_.cancelled = true;
  } catch (const TesterError&) {
    throw;
  } catch (const std::runtime_error& error) {
    // Of a command, or a person, that was to start the device anew. What was found until then is there.
    result_.gave_up = error.what();
  }
  watching_ = false;
  tester_.watch([] {});
  stop_device();
  result_.done.since_begin = elapsed();
  if (!times_.empty()) {
    std::ranges::nth_element(times_, times_.begin() + static_cast<std::ptrdiff_t>(times_.size() / 2));
    result_.answer_median = times_[times_.size() / 2];
  }
  return result_;
}

std::vector<Finding> Campaign::replay(const Sequence& sequence) {
  device_.start();
  watching_ = true;
  thorough_ = true;
  std::vector<Finding> findings;
  try {
    if (!await_device()) {
      throw std::runtime_error{"the device does not answer after its start"};
    }
    for (const Sign& sign : play(sequence)) {
      Finding finding{.kind = sign.kind, .key = sign.key, .what = sign.what, .confirmed = true};
      findings.push_back(std::move(finding));
    }
  } catch (const DeviceEnded& ended) {
    throw std::runtime_error{"the device " + ended.how + " right after its start"};
  } catch (const Cancelled&) {
  }
  std::ofstream{options_.folder + "/replay.pcapng", std::ios::binary}
      << pcapng(tester_.packets(), findings.empty() ? "nothing was found" : findings.front().what);
  watching_ = false;
  tester_.watch([] {});
  device_.stop();
  return findings;
}

}  // namespace

FuzzResult fuzz_device(const Profile& profile, const FuzzOptions& options) {
  return Campaign{profile, options}.run();
}

std::vector<Finding> replay_sequence(const Profile& profile, const Sequence& sequence,
                                     const FuzzOptions& options) {
  return Campaign{profile, options}.replay(sequence);
}

}  // namespace trestle::conform
