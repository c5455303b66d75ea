#include "bridge/conform/replay/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

/// Of each rule.
constexpr std::size_t most_differences = 20;

const char* verb(std::uint64_t count) {
  return count == 1 ? "is" : "are";
}

/// ", packets 13, 27 and 49", of one capture. The first ones, where there are many.
std::string packets_of(const std::vector<Difference>& differences, std::uint64_t count) {
  constexpr std::size_t most = 8;
  std::vector<std::uint64_t> packets;
  for (const Difference& one : differences) {
    if (packets.empty() || packets.back() != one.packet) {
      packets.push_back(one.packet);
    }
  }
  const bool all = packets.size() <= most && count == differences.size();
  packets.resize(std::min(packets.size(), most));
  return fmt::format(", packet{} {}{}", packets.size() == 1 && all ? "" : "s", fmt::join(packets, ", "),
                     all ? "" : ", ...");
}

}  // namespace

void Replay::begin(std::string name, std::function<void(Transport, const Endpoint&)> learn, bool twice) {
  ++captures_;
  copies_.reset();
  if (twice) {
    copies_.emplace();
  }
  name_ = std::move(name);
  learn_ = std::move(learn);
  first_.reset();
  requests_.clear();
  talked_.clear();
  last_session_.clear();
  last_cookie_.clear();
  connections_.clear();
  offers_.clear();
  places_.clear();
  served_.clear();
  served_endpoints_ = 0;
  is_event_.clear();
  event_sessions_.clear();
  segments_.clear();
  sessions_.clear();
  subscriptions_.clear();
  subscriber_ports_.clear();
  subscribers_.clear();
}

bool Replay::message(const traffic::Place& place, std::size_t /*offset*/, const someip::Message& message) {
  if (copies_ && copies_->is_copy(place, message)) {
    return true;
  }
  first_ = first_.value_or(place.time);
  last_ = place.time;
  ++messages_;
  const At at{place, message};
  check(Rule::header_length, at, true, "", "", "");
  judge_header(at);
  if (place.transport == Transport::tcp) {
    judge_cookie(at);
  }
  if (value(message.header.service) == 0xffff) {
    // Magic cookies are nobody's requests.
    if (value(message.header.method) == 0x8100) {
      judge_sd(at);
    }
  } else {
    remember(at);
    judge_connection(at);
    judge_meaning(at);
    judge_version(at);
    judge_source(at);
    if (someip::is_tp(message.header.type)) {
      judge_tp(at);
    } else {
      judge_rpc(at);
    }
  }
  return true;
}

void Replay::undecodable(const traffic::Place& place, std::size_t /*offset*/, ByteView /*bytes*/,
                         const traffic::Violation& violation) {
  // What the recorder cut off or lost says nothing of the sender; nor does a stream that is still going on.
  const bool is_lost = place.missing > 0 || (place.transport == Transport::tcp &&
                                             std::string_view{violation.name} != "bad_length");
  if (!is_lost && is_judged(place)) {
    ++tallies_[static_cast<std::size_t>(Rule::header_length)].judged;
    note_broken(Rule::header_length, place, violation.detail, "message", "a whole message", violation.detail);
  }
}

void Replay::broken_frame(const traffic::Place& /*place*/, const traffic::Violation& /*violation*/) {
  // Below SOME/IP.
}

void Replay::end() {
  for (const auto& [key, one] : subscriptions_) {
    // It is the server that has to answer, and the capture must have gone on for long enough.
    if ((only_host_ && std::get<1>(key) != *only_host_) || last_ - one.time < std::chrono::seconds{2}) {
      continue;
    }
    ++tallies_[static_cast<std::size_t>(Rule::sd_subscribe_answered)].judged;
    if (!one.answered) {
      note_broken(Rule::sd_subscribe_answered,
                  {.frame = one.frame, .time = one.time, .flow = one.flow, .transport = Transport::udp},
                  one.text, "answer", "SubscribeEventgroupAck or Nack", "none in the capture");
    }
  }
}

void Replay::check(Rule rule, const At& at, bool kept, const std::string& field, const std::string& expected,
                   const std::string& actual) {
  if (!is_judged(at.place)) {
    return;
  }
  ++tallies_[static_cast<std::size_t>(rule)].judged;
  if (!kept) {
    note_broken(rule, at.place, message_text(at.message), field, expected, actual);
  }
}

void Replay::note_broken(Rule rule, const traffic::Place& place, const std::string& text,
                         const std::string& field, const std::string& expected, const std::string& actual) {
  Tally& tally = tallies_[static_cast<std::size_t>(rule)];
  ++tally.broken;
  if (tally.differences.size() >= most_differences) {
    ++tally.timeline.left_out;
    return;
  }
  tally.differences.push_back({.field = (name_.empty() ? "" : name_ + ": ") + field,
                               .expected = expected,
                               .actual = actual,
                               .packet = place.frame});
  tally.timeline.lines.push_back(
      {.number = place.frame,
       .since_first = place.time - first_.value_or(place.time),
       .transport = place.transport.value_or(Transport::udp),
       .from = someip::to_string(place.flow.from),
       .to = someip::to_string(place.flow.to),
       .text = text,
       .comment = fmt::format("OFFENDING: {} is {}, expected {}", field, actual, expected)});
}

std::vector<CaseResult> Replay::results(const std::string& evidence) const {
  std::vector<CaseResult> all;
  for (std::size_t at = 0; at < tallies_.size(); ++at) {
    const Tally& tally = tallies_[at];
    CaseResult result{
        .what = &replay_rules()[at], .attempts = 1, .timeline = tally.timeline, .evidence = evidence};
    if (tally.judged == 0) {
      result.outcome = {.verdict = Verdict::unsupported, .reason = "nothing in the capture is about this"};
    } else if (tally.broken > 0) {
      const Difference& first = tally.differences.front();
      result.outcome.verdict = result.what->level == Level::must ? Verdict::fail : Verdict::pass_nonstrict;
      result.outcome.reason = fmt::format(
          "{} is {}, expected {}; {} of {} {} so{}", first.field, first.actual, first.expected, tally.broken,
          tally.judged, verb(tally.broken), captures_ > 1 ? "" : packets_of(tally.differences, tally.broken));
      result.outcome.differences = tally.differences;
    } else {
      result.outcome.reason = fmt::format("{} judged", tally.judged);
    }
    if (at == static_cast<std::size_t>(Rule::sd_session_order) && reboots_ > 0) {
      result.outcome.reason += fmt::format("; {} restarts were seen", reboots_);
    }
    all.push_back(std::move(result));
  }
  return all;
}

}  // namespace trestle::conform
