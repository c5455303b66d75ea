#include "bridge/conform/trial.hpp"

#include <algorithm>
#include <utility>

#include "bridge/conform/device.hpp"

// What a trial has seen, what follows from it, and whether the device is there. What it sends and asks:
// trial_asking.cpp.
namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using someip::MessageType;

/// What was asked by multicast is answered after a time that is drawn at random, and must not look like an
/// answer to what the next case asks.
constexpr Duration response_delay = 50ms;

}  // namespace

std::string hex(ByteView bytes) {
  std::string all;
  for (const std::byte one : bytes.first(std::min<std::size_t>(bytes.size(), 32))) {
    all += fmt::format("{}{:02x}", all.empty() ? "" : " ", std::to_integer<unsigned>(one));
  }
  return all + (bytes.size() > 32 ? fmt::format(" ... ({} bytes)", bytes.size()) : "");
}

std::vector<sd::Option> SeenEntry::options() const {
  std::vector<sd::Option> all;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    if (const auto option = message.option_of(entry, position)) {
      all.push_back(*option);
    }
  }
  return all;
}

std::vector<sd::EndpointOption> SeenEntry::endpoints(sd::EndpointRole role) const {
  std::vector<sd::EndpointOption> all;
  for (const sd::Option& option : options()) {
    if (const auto endpoint = sd::EndpointOption::decode(option); endpoint && endpoint->role == role) {
      all.push_back(*endpoint);
    }
  }
  return all;
}

SdSessions::Next SdSessions::next(const Endpoint& to) {
  Relation& relation = relations_[to];
  if (++relation.session == 0) {
    relation.session = 1;
    relation.wrapped = true;
  }
  return {someip::SessionId{relation.session}, !relation.wrapped};
}

Trial::Trial(const Profile& the_profile, Tester& the_tester, Device& the_device, SdSessions& the_sessions)
    : profile{the_profile},
      tester{the_tester},
      sessions{the_sessions},
      device_{the_device},
      requests_{the_profile.service().request && the_profile.service().udp_port} {}

void Trial::begin(std::uint64_t seed, const std::string& id) {
  std::vector<std::uint32_t> numbers(id.begin(), id.end());
  numbers.push_back(static_cast<std::uint32_t>(seed));
  numbers.push_back(static_cast<std::uint32_t>(seed >> 32U));
  std::seed_seq mixed(numbers.begin(), numbers.end());
  random.seed(mixed);
  session_ = static_cast<std::uint16_t>(random());
}

// --- Judging ----------------------------------------------------------------------------------------------

void Trial::comment(Packet* packet, const std::string& text) {
  if (packet != nullptr) {
    packet->comment += (packet->comment.empty() ? "" : "; ") + text;
  }
}

void Trial::different(const std::string& field, const std::string& expected, const std::string& actual,
                      Packet* packet) {
  differences_.push_back({field, expected, actual, packet == nullptr ? 0 : packet->number});
  comment(packet, fmt::format("OFFENDING: {} is {}, expected {}", field, actual, expected));
}

void Trial::fail(const std::string& reason, const std::string& expected, const std::string& actual,
                 Packet* packet) {
  comment(packet, fmt::format("OFFENDING: {}: {}, expected {}", reason, actual, expected));
  throw Ended{Verdict::fail,
              reason,
              {{.field = "message",
                .expected = expected,
                .actual = actual,
                .packet = packet == nullptr ? 0 : packet->number}}};
}

void Trial::missing(const std::string& reason, const std::string& expected) {
  tester.receive_now();
  Packet* packet = stimulus_;
  if (packet != nullptr) {
    const auto waited = std::chrono::system_clock::now() - packet->time;
    comment(packet, fmt::format("OFFENDING: no answer to this within {:.1f} s, expected {}",
                                std::chrono::duration<double>(waited).count(), expected));
  } else if (!tester.packets().empty()) {
    packet = &tester.packets().back();
    comment(packet, fmt::format("OFFENDING: up to here {}, expected {}", reason, expected));
  }
  throw Ended{Verdict::fail,
              reason,
              {{.field = "message",
                .expected = expected,
                .actual = "nothing",
                .packet = packet == nullptr ? 0 : packet->number}}};
}

void Trial::unsupported(const std::string& reason) {
  throw Ended{Verdict::unsupported, reason};
}

void Trial::inconclusive(const std::string& reason) {
  throw Ended{Verdict::inconclusive, reason};
}

Attempt Trial::attempt() const {
  Attempt attempt{
      .differences = differences_, .retries = retries_, .stalled = tester.stalled() > Duration{0}};
  if (retries_ > 0) {
    const char* const which = unanswered_ ? "none" : most_asked_ == 2 ? "the 2nd" : "the 3rd";
    attempt.retried = fmt::format("answered {} of {} requests", which, tries);
  }
  if (!differences_.empty()) {
    const Difference& first = differences_.front();
    attempt.verdict = Verdict::fail;
    attempt.reason = fmt::format("{} is {}, expected {}", first.field, first.actual, first.expected);
  } else if (!nonstrict_.empty()) {
    attempt.verdict = Verdict::pass_nonstrict;
    attempt.reason = nonstrict_;
  }
  return attempt;
}

// --- What was seen ----------------------------------------------------------------------------------------

bool Trial::is_sd(const Packet& packet) const {
  return packet.to == tester.sd() || packet.to == tester.sd_group() ||
         std::ranges::find(sd_endpoints_, packet.to) != sd_endpoints_.end();
}

std::vector<SeenEntry> Trial::entries_since(std::size_t since, const EntryIs& wanted) {
  std::vector<SeenEntry> all;
  for (std::size_t at = since; at < tester.packets().size(); ++at) {
    std::ranges::copy_if(entries_of(tester.packets()[at]), std::back_inserter(all), wanted);
  }
  return all;
}

std::vector<SeenEntry> Trial::entries_of(Packet& packet) const {
  std::vector<SeenEntry> all;
  if (packet.sent || packet.from.address != profile.device || !is_sd(packet)) {
    return all;
  }
  for (someip::MessageCursor cursor{packet.bytes}; const auto message = cursor.next();) {
    // Message ID alone: what else is wrong in the header, a case is to find.
    if (value(message->header.service) != 0xffff || value(message->header.method) != 0x8100) {
      continue;
    }
    const auto decoded = sd::decode(message->payload);
    for (std::size_t index = 0; decoded && index < decoded->entry_count(); ++index) {
      all.push_back({&packet, message->header, *decoded, decoded->entry(index)});
    }
  }
  return all;
}

std::optional<SeenEntry> Trial::await_entry(std::size_t since, Duration within, const EntryIs& wanted) {
  std::vector<SeenEntry> found;
  tester.receive(within, [&] {
    found = entries_since(since, wanted);
    return !found.empty();
  });
  return found.empty() ? std::nullopt : std::optional{found.front()};
}

Trial::EntryIs Trial::is_offer(const ServiceProfile& service) {
  return [&service](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::offer_service && seen.entry.service == service.service &&
           seen.entry.instance == service.instance;
  };
}

Trial::EntryIs Trial::is_find_answer(const ServiceProfile& service) {
  return [this, is_one = is_offer(service)](const SeenEntry& seen) {
    // A cyclic offer at the same moment is no answer.
    return is_one(seen) && (seen.packet->to == tester.sd() ||
                            (profile.policy.multicast_find_answers &&
                             (!profile.timing.cyclic_offer_delay || is_between_cycles(seen))));
  };
}

bool Trial::is_offer_by_multicast(Packet& packet) {
  return !packet.sent && packet.to == tester.sd_group() &&
         std::ranges::any_of(entries_of(packet), is_offer(profile.service()));
}

std::optional<WallTime> Trial::last_offer_by_multicast(WallTime before) {
  auto& packets = tester.packets();
  const auto last = std::find_if(packets.rbegin(), packets.rend(), [&](Packet& one) {
    return one.time < before && is_offer_by_multicast(one);
  });
  return last != packets.rend() ? std::optional{last->time} : std::nullopt;
}

bool Trial::is_between_cycles(const SeenEntry& seen) {
  const auto cycle = profile.timing.cyclic_offer_delay;
  if (!cycle || seen.packet->to != tester.sd_group()) {
    return false;
  }
  const auto before = last_offer_by_multicast(seen.packet->time);
  return before && seen.packet->time - *before < *cycle * 3 / 4;
}

Trial::EntryIs Trial::is_answer_to(const sd::Entry& subscribe) {
  return [subscribe](const SeenEntry& seen) {
    return seen.entry.type == sd::EntryType::subscribe_eventgroup_ack &&
           seen.entry.service == subscribe.service && seen.entry.instance == subscribe.instance &&
           seen.entry.eventgroup() == subscribe.eventgroup();
  };
}

std::vector<SeenMessage> Trial::messages_since(std::size_t since, const MessageIs& wanted) {
  std::vector<SeenMessage> all;
  for (std::size_t at = since; at < tester.packets().size(); ++at) {
    Packet& packet = tester.packets()[at];
    if (packet.sent || packet.from.address != profile.device || is_sd(packet)) {
      continue;
    }
    for (someip::MessageCursor cursor{packet.bytes}; const auto message = cursor.next();) {
      const SeenMessage seen{&packet, *message};
      if (wanted(seen)) {
        all.push_back(seen);
      }
    }
  }
  return all;
}

std::optional<SeenMessage> Trial::await_message(std::size_t since, Duration within, const MessageIs& wanted) {
  std::vector<SeenMessage> found;
  tester.receive(within, [&] {
    found = messages_since(since, wanted);
    return !found.empty();
  });
  return found.empty() ? std::nullopt : std::optional{found.front()};
}

Trial::MessageIs Trial::is_answer_to(const Call& call) {
  return [call](const SeenMessage& seen) {
    const auto type = someip::without_tp(seen.message.header.type);
    return seen.message.header.client == call.client && seen.message.header.session == call.session &&
           (type == MessageType::response || type == MessageType::error);
  };
}

Trial::MessageIs Trial::is_event(someip::MethodId event) const {
  return [event, service = profile.service().service](const SeenMessage& seen) {
    return seen.message.header.service == service && seen.message.header.method == event &&
           someip::without_tp(seen.message.header.type) == MessageType::notification;
  };
}

// --- Whether the device is there --------------------------------------------------------------------------

bool Trial::answers_find() {
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    send_sd({.entries = {find_entry(profile.service())}}, false, check);
    // By an offer of the service: an entry of another type may be a late answer to what a case has sent.
    // Which other fields are right is for the cases.
    if (await_entry(since, profile.timing.answer_within, [this](const SeenEntry& seen) {
          return (seen.packet->to == tester.sd() || profile.policy.multicast_find_answers ||
                  is_between_cycles(seen)) &&
                 seen.entry.kind() == sd::EntryKind::offer_service &&
                 seen.entry.service == profile.service().service;
        })) {
      return true;
    }
  }
  return false;
}

bool Trial::answers_request() {
  // It is no stimulus of a case.
  Packet* const before = stimulus_;
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    Call call = request();
    call.client = someip::ClientId{0x5aff};
    call = send(call);
    tester.packets().back().comment = check;
    stimulus_ = before;
    if (await_message(since, profile.timing.answer_within, [&](const SeenMessage& seen) {
          return seen.message.header.service == call.service || is_answer_to(call)(seen);
        })) {
      return true;
    }
  }
  return false;
}

bool Trial::offers_by_itself() {
  const auto cycle = profile.timing.cyclic_offer_delay;
  return cycle && *cycle > Duration{0} && *cycle <= longest_cycle &&
         await_entry(now(), 3 * *cycle + profile.timing.answer_within, is_offer(profile.service()))
             .has_value();
}

bool Trial::subscribes() {
  const UsedService& used = profile.used_by_itself();
  const SdStimulus offer = offer_of(used, {own_endpoint()});
  Packet* const before = stimulus_;
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    send_sd(offer, true, check);
    const auto seen = await_entry(since, profile.timing.answer_within, [&](const SeenEntry& one) {
      return one.entry.kind() == sd::EntryKind::subscribe_eventgroup && one.entry.service == used.service;
    });
    withdraw(offer);
    stimulus_ = before;
    if (seen) {
      return true;
    }
  }
  return false;
}

bool Trial::is_there() {
  if (profile.services.empty()) {
    return subscribes();
  }
  finds_ = answers_find();
  requests_ = requests_ && answers_request();
  offers_only_ = !finds_ && !requests_ && offers_by_itself();
  return finds_ || requests_ || offers_only_;
}

bool Trial::alive() {
  if (profile.services.empty()) {
    return subscribes();
  }
  return (!finds_ || answers_find()) && (!requests_ || answers_request()) &&
         (!offers_only_ || offers_by_itself());
}

void Trial::close_ports() {
  tester.close_all();
  udp_.reset();
  tcp_.reset();
}

void Trial::clean_up() {
  for (const SdStimulus& subscription : subscriptions_) {
    if (!subscription.length && !subscription.entries_length && !subscription.options_length) {
      unsubscribe(subscription);
    }
  }
  subscriptions_.clear();
  // One is enough, as all are of the same service.
  if (!offers_.empty()) {
    withdraw(offers_.front());
  }
  offers_.clear();
  if (std::exchange(asked_all_, false)) {
    tester.receive(response_delay, [] { return false; });
  }
  close_ports();
}

std::optional<SdSign> Trial::sign_of(Packet& packet) const {
  std::optional<SdSign> sign;
  for (const SeenEntry& seen : entries_of(packet)) {
    sign = sign.value_or(SdSign{.time = packet.time,
                                .multicast = packet.to == tester.sd_group(),
                                .session = seen.header.session,
                                .reboot = seen.message.reboot()});
    sign->offers = sign->offers || is_start()(seen);
  }
  return sign;
}

Trial::EntryIs Trial::is_start() const {
  if (!profile.services.empty()) {
    return is_offer(profile.service());
  }
  return [&used = profile.used_by_itself()](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::find_service && seen.entry.service == used.service;
  };
}

std::size_t Trial::restart(bool at_once) {
  const Duration within = profile.timing.ready_within;
  std::size_t since = now();
  if (!profile.lifecycle.restart.empty() || profile.lifecycle.ask_operator) {
    // What it said before stands in what was received, too: its messages have to tell where they begin anew.
    NewLife life{std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now()),
                 longest_pause(profile.timing)};
    device_.restart(at_once);
    tester.was_elsewhere();
    std::optional<std::size_t> begin;
    std::size_t next = 0;
    tester.receive(within, [&] {
      bool started = false;
      for (; next < tester.packets().size(); ++next) {
        if (const auto sign = sign_of(tester.packets()[next]); sign && next < since) {
          life.before(*sign);
        } else if (sign) {
          begin = !begin && life.begins_with(*sign) ? std::optional{next} : begin;
          started = started || (begin && sign->offers);
        }
      }
      return started;
    });
    // One that shows nothing of it is judged by all that it has said since.
    since = begin.value_or(since);
  } else {
    stop_device(at_once);
    since = now();  // what it said before is of its life before
    start_device();
    (void)await_entry(since, within,
                      [&](const SeenEntry& seen) { return is_start()(seen) && seen.message.reboot(); });
  }
  if (entries_since(since, is_start()).empty()) {
    missing(profile.services.empty()
                ? "the device does not look for the service that it uses after it was started"
                : "the device does not offer its service after it was started",
            profile.services.empty() ? "a FindService" : "an OfferService");
  }
  return since;
}

void Trial::stop_device(bool at_once) {
  device_.stop(at_once);
  tester.was_elsewhere();
}

void Trial::start_device() {
  device_.start();
  tester.was_elsewhere();
}

}  // namespace trestle::conform
