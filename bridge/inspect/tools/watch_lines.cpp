#include "bridge/inspect/tools/watch_lines.hpp"

#include <utility>

#include "bridge/inspect/tools/picture.hpp"

namespace trestle::inspect {
namespace {

Rate rate_of(std::uint64_t messages, std::uint64_t bytes, Duration time) {
  const double seconds = std::chrono::duration<double>{time}.count();
  return {static_cast<double>(messages) / seconds, static_cast<double>(bytes) / seconds};
}

}  // namespace

void WatchLines::tell(const std::vector<traffic::Sighting>& sightings, TimePoint now) {
  for (const traffic::Sighting& one : sightings) {
    const std::string time = time_text(now);
    line(options_.json ? to_json(one, time, options_.names) : time + "  " + describe(one, options_.names));
  }
}

void WatchLines::tell_rates(const Watcher& seen, TimePoint now, bool at_once) {
  const bool early = last_ && now - *last_ < options_.rates;
  if (options_.rates == Duration{} || (early && !at_once) || now == last_) {
    return;
  }
  const std::optional<TimePoint> before = std::exchange(last_, now);
  if (!before) {
    return;
  }
  const InstanceNames names{seen.network(), options_.names};
  for (const auto& [key, row] : seen.traffic().rows()) {
    Told& told = told_[key];
    const Rate rate = rate_of(row.messages - told.messages, row.bytes - told.bytes, now - *before);
    told = {row.messages, row.bytes};
    if (rate.bytes > 0) {
      tell_rate(row, names, rate, now);
    }
  }
  std::erase_if(told_, [&](const auto& one) { return !seen.traffic().rows().contains(one.first); });
}

void WatchLines::tell_rate(const SeenTraffic& row, const InstanceNames& names, const Rate& rate,
                           TimePoint now) {
  if (options_.json) {
    nlohmann::ordered_json object{{"time", time_text(now)}, {"seen", "traffic"}};
    add_traffic(object, row, names, rate);
    line(object.dump());
  } else {
    line(time_text(now) + "  " + describe(row, names, rate));
  }
}

void WatchLines::line(const std::string& text) {
  if (options_.count != 0 && lines_ == options_.count) {
    return;
  }
  print_(text + "\n");
  if (++lines_ == options_.count) {
    full_();
  }
}

}  // namespace trestle::inspect
