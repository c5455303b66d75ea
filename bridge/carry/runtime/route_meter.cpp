#include "bridge/carry/runtime/route_meter.hpp"

#include <algorithm>
#include <vector>

namespace trestle::carry {
namespace {

// All that it took, and that is known of.
std::chrono::nanoseconds whole(const MessageTimes& times) noexcept {
  return std::max<std::chrono::nanoseconds>(times.source, times.sent - times.came);
}

LatencyPicture picture_of(const statistics::Histogram& histogram) {
  LatencyPicture result{.count = histogram.count(),
                        .min_ns = histogram.min(),
                        .p50_ns = histogram.percentile(50),
                        .p90_ns = histogram.percentile(90),
                        .p99_ns = histogram.percentile(99),
                        .p999_ns = histogram.percentile(99.9),
                        .max_ns = histogram.max(),
                        .sum_ns = histogram.sum(),
                        .buckets = {}};
  for (const statistics::Histogram::Bucket& one : histogram.buckets()) {
    result.buckets.push_back({one.up_to, one.count});
  }
  return result;
}

}  // namespace

void RouteMeter::carried(const MessageTimes& times) {
  carried(times.sent, times.bytes);
  if (!detail_) {
    detail_ = std::make_unique<Detail>();
    detail_->now.start = times.came;
  }
  note(*detail_, times);
}

void RouteMeter::note(Detail& detail, const MessageTimes& times) {
  detail.conversion.add(std::chrono::nanoseconds{times.after - times.before}.count());
  detail.path.add((times.source.count() >= 0 ? times.source : times.sent - times.came).count());
  Slowest& now = detail.now;
  if (times.came - now.start >= slow_for) {
    detail.before = times.came - now.start < 2 * slow_for ? now : Slowest{};
    now.start = times.came;
    now.count = 0;
  }
  if (now.count < most_slow) {
    now.messages.at(now.count++) = times;
    return;
  }
  const auto fastest = std::ranges::min_element(now.messages, {}, whole);
  if (whole(times) > whole(*fastest)) {
    *fastest = times;
  }
}

void RouteMeter::fill(RoutePicture& picture, const RouteClock& clock, RouteClock::TimePoint came) const {
  const RouteClock::TimePoint now = clock.now();
  const auto since_1970 = [&, wall = clock.since_1970()](RouteClock::TimePoint when) -> std::int64_t {
    return when == RouteClock::TimePoint{} ? 0 : std::chrono::nanoseconds{wall - (now - when)}.count();
  };
  const statistics::Rate::Value rate = rate_.at(now);
  picture.per_second = rate.count;
  picture.bytes_per_second = rate.bytes;
  picture.last_ns = since_1970(std::max(came_, came));
  picture.last_carried_ns = since_1970(carried_);
  if (!detail_) {
    return;
  }
  picture.conversion = picture_of(detail_->conversion);
  picture.path = picture_of(detail_->path);
  std::vector<MessageTimes> slow;
  for (const Slowest* const some : {&detail_->now, &detail_->before}) {
    if (now - some->start < 2 * slow_for) {
      slow.insert(slow.end(), some->messages.begin(),
                  some->messages.begin() + static_cast<std::ptrdiff_t>(some->count));
    }
  }
  std::ranges::sort(slow, std::ranges::greater{}, whole);
  slow.resize(std::min(slow.size(), most_slow));
  for (const MessageTimes& one : slow) {
    const auto ns = [](auto time) { return std::chrono::nanoseconds{time}.count(); };
    picture.slowest.push_back({.at_ns = since_1970(one.came),
                               .source_ns = one.source.count() < 0 ? -1 : one.source.count(),
                               .waited_ns = ns(one.before - one.came),
                               .convert_ns = ns(one.after - one.before),
                               .send_ns = ns(one.sent - one.after),
                               .bytes = one.bytes,
                               .session = value(one.session)});
  }
}

}  // namespace trestle::carry
