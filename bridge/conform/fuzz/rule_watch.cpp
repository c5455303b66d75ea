#include "bridge/conform/fuzz/rule_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "bridge/conform/replay/replay.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::conform {
namespace {

constexpr std::size_t request_id_at = 8;

/// Rules that hold whatever was sent. What the others say depends on that: an acknowledgement repeats ids and
/// reserved bits, for example.  [feat_req_someipsd_614]
constexpr std::array holding_always{Rule::header_length,      Rule::header_protocol,
                                    Rule::header_type,        Rule::header_code,
                                    Rule::udp_size,           Rule::sd_header,
                                    Rule::sd_session,         Rule::sd_reboot_flag,
                                    Rule::sd_unicast_flag,    Rule::sd_reserved,
                                    Rule::sd_arrays,          Rule::sd_entry_type,
                                    Rule::sd_empty_run,       Rule::sd_run,
                                    Rule::sd_option_layout,   Rule::sd_option_reserved,
                                    Rule::sd_option_protocol, Rule::sd_multicast_address,
                                    Rule::sd_offer_endpoint,  Rule::tp_length,
                                    Rule::tp_reserved,        Rule::tp_header};

/// How often the message that begins with these bytes stands in others.
std::size_t count_in(ByteView bytes, ByteView wanted) {
  std::size_t count = 0;
  for (auto at = bytes.begin();
       (at = std::search(at, bytes.end(), wanted.begin(), wanted.end())) != bytes.end(); ++at) {
    ++count;
  }
  return count;
}

/// The same in all datagrams that were sent.
std::size_t times_sent(const std::deque<Packet>& packets, ByteView wanted) {
  std::size_t count = 0;
  for (const Packet& packet : packets) {
    count += packet.sent && packet.transport == Transport::udp ? count_in(packet.bytes, wanted) : 0;
  }
  return count;
}

/// A request over UDP that got more answers than it was sent. It is known by its Request ID, as everything
/// else of it may be wrong. A stream over TCP may have begun in an earlier sequence.
std::optional<BrokenRule> answered_too_often(const std::deque<Packet>& packets) {
  std::map<std::uint32_t, std::size_t> answers;
  for (const Packet& packet : packets) {
    const auto message = packet.sent ? std::nullopt : std::optional{someip::decode(packet.bytes)};
    if (message && *message && packet.transport == Transport::udp && !sd::is_sd((*message)->header) &&
        ((*message)->header.type == someip::MessageType::response ||
         (*message)->header.type == someip::MessageType::error)) {
      ++answers[someip::load<std::uint32_t>(packet.bytes.data() + request_id_at)];
    }
  }
  for (const auto& [request, count] : answers) {
    if (count < 2) {
      continue;
    }
    std::array<std::byte, 4> id{};
    someip::store<std::uint32_t>(id.data(), request);
    const std::size_t sent = times_sent(packets, id);
    if (count > sent) {
      return BrokenRule{answered_once, fmt::format("Request ID {:#010x} was sent {} times and answered {} "
                                                   "times",
                                                   request, sent, count)};
    }
  }
  return std::nullopt;
}

/// Who is sent more than a message may have over UDP, and echoes it, has only been led to that.
bool was_sent_too_much(const std::deque<Packet>& packets) {
  return std::ranges::any_of(packets, [](const Packet& one) {
    return one.sent && one.transport == Transport::udp &&
           one.bytes.size() > someip::header_bytes + someip::max_plain_payload_bytes;
  });
}

}  // namespace

std::vector<BrokenRule> broken_rules(const std::deque<Packet>& packets, const IpAddress& device) {
  Replay judge{device};
  judge.begin({}, [](Transport, const Endpoint&) {});
  for (const Packet& packet : packets) {
    // A message that was cut off because the fuzzer closed the connection breaks no rule.
    const bool is_cut = packet.transport == Transport::tcp &&
                        someip::decode(packet.bytes) == tl::unexpected{someip::WireError::truncated};
    if (!packet.sent && !is_cut) {
      judge.datagram({.frame = packet.number,
                      .time = packet.time,
                      .flow = {packet.from, packet.to},
                      .transport = packet.transport},
                     packet.bytes);
    }
  }
  judge.end();
  const std::vector<CaseResult> results = judge.results({});
  const bool large = was_sent_too_much(packets);
  std::vector<BrokenRule> broken;
  for (std::size_t at = 0; at < results.size(); ++at) {
    const CaseResult& one = results[at];
    const auto rule = static_cast<Rule>(at);
    if (one.outcome.verdict != Verdict::fail || (rule == Rule::udp_size && large) ||
        std::ranges::find(holding_always, rule) == holding_always.end()) {
      continue;
    }
    std::string what = one.what->title;
    if (!one.outcome.differences.empty()) {
      const Difference& first = one.outcome.differences.front();
      what += fmt::format(": {} is {}, expected {}", first.field, first.actual, first.expected);
    }
    broken.push_back({one.what->id, std::move(what)});
  }
  if (auto rule = answered_too_often(packets)) {
    broken.push_back(std::move(*rule));
  }
  return broken;
}

}  // namespace trestle::conform
