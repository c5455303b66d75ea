#include "bridge/inspect/tools/traffic_view.hpp"

#include <algorithm>

#include "bridge/inspect/decode/message_json.hpp"

namespace trestle::inspect {
namespace {

using someip::MessageType;
using someip::SessionId;

std::int64_t second_of(TimePoint time) {
  return std::chrono::floor<std::chrono::seconds>(time).time_since_epoch().count();
}

/// How far `session` is ahead of `last` in the cycle from 1 to 0xffff; 0 means the same session.
std::uint32_t steps(SessionId last, SessionId session) {
  constexpr std::uint32_t all = 0xffff;
  return (value(session) + all - value(last)) % all;
}

/// A larger step forward is not taken for lost messages ...
constexpr std::uint32_t farthest_ahead = 1000;
/// ... but for a late message if it is at most this far back, otherwise for a restart of the server.
constexpr std::uint32_t farthest_back = 64;
constexpr SessionId first_session{1};

/// Whether the message is whole, or the last segment of one.
/// @return nothing for a segment that contradicts itself.
std::optional<bool> completes(const someip::Message& message) {
  if (!is_tp(message.header.type)) {
    return true;
  }
  const auto segment = someip::decode_tp(message);
  return segment ? std::optional{!segment->header.more} : std::nullopt;
}

}  // namespace

void RecentRate::add(TimePoint now, std::uint64_t messages, std::uint64_t bytes) {
  const std::int64_t second = second_of(now);
  first_ = first_.value_or(second);
  Bucket& bucket = buckets_[static_cast<std::size_t>(second) % buckets_.size()];
  if (bucket.second != second) {
    bucket = {.second = second};
  }
  bucket.messages += messages;
  bucket.bytes += bytes;
}

Rate RecentRate::per_second(TimePoint now) const {
  const std::int64_t second = second_of(now);
  const std::int64_t whole = first_ ? std::min(window_s, second - *first_) : 0;
  Rate rate;
  if (whole <= 0) {
    return rate;
  }
  for (const Bucket& bucket : buckets_) {
    if (bucket.second >= second - whole && bucket.second < second) {
      rate.messages += static_cast<double>(bucket.messages) / static_cast<double>(whole);
      rate.bytes += static_cast<double>(bucket.bytes) / static_cast<double>(whole);
    }
  }
  return rate;
}

Rate SeenTraffic::mean() const {
  const double time = std::chrono::duration<double>{last_seen - first_seen}.count();
  if (messages < 2 || time <= 0) {
    return {};
  }
  // Of n messages only n - 1 lie in the time between them.
  const double share = static_cast<double>(messages - 1) / static_cast<double>(messages);
  return {static_cast<double>(messages - 1) / time, static_cast<double>(bytes) * share / time};
}

std::optional<Duration> SeenTraffic::median_latency() const {
  if (latencies_.empty()) {
    return std::nullopt;
  }
  std::vector<Duration> sorted = latencies_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
  std::ranges::nth_element(sorted, middle);
  return *middle;
}

void SeenTraffic::add_latency(Duration latency) {
  if (latencies_.size() < kept_latencies) {
    latencies_.push_back(latency);
    return;
  }
  latencies_[oldest_] = latency;
  oldest_ = (oldest_ + 1) % kept_latencies;
}

void TrafficView::on_message(const someip::Message& message, const traffic::Flow& flow, Transport transport,
                             TimePoint now) {
  if (is_magic_cookie(message)) {
    return;
  }
  const std::optional<bool> complete = completes(message);
  const MessageType type = someip::without_tp(message.header.type);
  const bool event = type == MessageType::notification;
  const bool request = type == MessageType::request || type == MessageType::request_no_return;
  const bool answer = type == MessageType::response || type == MessageType::error;
  if (!complete || (!event && !request && !answer)) {
    ++counters_.strange;
    return;
  }
  counters_.messages += *complete ? 1U : 0U;
  recent_.add(now, *complete ? 1 : 0, message.size());
  SeenTraffic* row = row_of(message.header, request ? flow.to : flow.from, transport, event, now);
  if (row == nullptr) {
    ++counters_.not_kept;
    return;
  }
  row->last_seen = now;
  row->bytes += message.size();
  const bool counts = *complete && !answer;
  row->messages += counts ? 1U : 0U;
  row->recent.add(now, counts ? 1 : 0, message.size());
  if (!*complete) {
    return;
  }
  if (event) {
    on_session(*row, message.header.session);
  } else if (type == MessageType::request) {
    on_request(message.header, flow, now);
  } else if (answer) {
    on_answer(*row, message.header, flow, now);
  }
}

SeenTraffic* TrafficView::row_of(const someip::Header& header, const Endpoint& server, Transport transport,
                                 bool event, TimePoint now) {
  const Key key{header.service, header.method, server, transport, event};
  if (const auto found = rows_.find(key); found != rows_.end()) {
    return &found->second;
  }
  if (rows_.size() >= limits_.max_rows) {
    return nullptr;
  }
  SeenTraffic& row = rows_[key];
  row.service = header.service;
  row.method = header.method;
  row.server = server;
  row.transport = transport;
  row.event = event;
  row.first_seen = now;
  return &row;
}

void TrafficView::on_session(SeenTraffic& row, SessionId session) {
  if (session == SessionId{}) {
    return;  // the sender does not count messages  [feat_req_someip_700]
  }
  // How far the session is ahead of the last one; it becomes the last one, unless it was overtaken. A copy
  // for another receiver is not ahead.
  const auto ahead = [&](const SessionKey& key) -> std::optional<std::uint32_t> {
    const auto [last, is_new] = sessions_.try_emplace(key, session);
    if (is_new) {
      return std::nullopt;
    }
    const std::uint32_t by = steps(last->second, session);
    const bool overtaken = by > farthest_ahead && steps(session, last->second) <= farthest_back;
    last->second = overtaken ? last->second : session;
    return by <= farthest_ahead && session != first_session ? by : 0;
  };
  const auto of_event = ahead({row.service, row.method, row.server});
  const auto of_service = ahead({row.service, someip::MethodId{}, {row.server.address, 0}});
  // The server may count per event or for the whole service; in both cases the smaller step is right.
  if (of_event && of_service && std::min(*of_event, *of_service) > 1) {
    row.skipped += std::min(*of_event, *of_service) - 1;
  }
}

void TrafficView::on_request(const someip::Header& header, const traffic::Flow& flow, TimePoint now) {
  const CallKey key{flow, header.service, header.method,
                    static_cast<std::uint32_t>(value(header.client)) << 16U | value(header.session)};
  if (call_order_.size() >= limits_.max_calls) {
    calls_.erase(call_order_.front());
    call_order_.pop_front();
  }
  calls_[key] = now;
  call_order_.push_back(key);
}

void TrafficView::on_answer(SeenTraffic& row, const someip::Header& header, const traffic::Flow& flow,
                            TimePoint now) {
  ++row.answers;
  row.errors +=
      someip::without_tp(header.type) == MessageType::error || header.return_code != someip::ReturnCode::ok
          ? 1U
          : 0U;
  const auto call =
      calls_.find({{flow.to, flow.from},
                   header.service,
                   header.method,
                   static_cast<std::uint32_t>(value(header.client)) << 16U | value(header.session)});
  if (call != calls_.end()) {
    row.add_latency(now - call->second);
    calls_.erase(call);
  }
}

void TrafficView::forget_idle(TimePoint since) {
  std::erase_if(rows_, [&](const auto& one) { return one.second.last_seen < since; });
  std::erase_if(sessions_, [&](const auto& one) {
    const auto& [service, method, server] = one.first;
    const auto next = rows_.lower_bound({service, method, server, Transport{}, false});
    const bool of_service = method == someip::MethodId{};
    return next == rows_.end() || next->second.service != service ||
           (!of_service && (next->second.method != method || next->second.server != server));
  });
}

}  // namespace trestle::inspect
