#include "bridge/measure/demo/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

namespace trestle::measure::demo {
namespace {

// Clouds younger than this may still be under way.
constexpr std::int64_t grace_ns = second_ns;
// The window of the live rate.
constexpr std::int64_t window_ns = 3 * second_ns;
// Messages with the same session id further apart than this are different ones: the id has wrapped.
constexpr std::int64_t same_session_ns = 10 * second_ns;

Figures::Rate rate_of(std::uint64_t clouds, std::uint64_t bytes, std::int64_t span_ns) {
  if (span_ns <= 0) {
    return {};
  }
  const double seconds = static_cast<double>(span_ns) / static_cast<double>(second_ns);
  return {static_cast<double>(clouds) / seconds, static_cast<double>(bytes) / seconds / 1e6};
}

}  // namespace

const char* to_string(Process process) noexcept {
  constexpr std::array names{"publisher", "bridge A", "bridge B", "subscriber"};
  return names[static_cast<std::size_t>(process)];
}

void Figures::on_line(Process from, std::string_view line, std::int64_t now_ns) {
  const Json event = Json::parse(line, nullptr, false);
  try {
    handle(from, event, now_ns);
  } catch (const Json::exception&) {  // no object, or one that lacks what it should have
    ++unreadable_lines_;
  }
}

void Figures::handle(Process from, const Json& event, std::int64_t now_ns) {
  const auto& kind = event.at("event").get_ref<const std::string&>();
  if (kind == "published") {
    on_published(event);
  } else if (kind == "received") {
    on_received(event);
  } else if (kind == "unreadable") {
    count_corrupt(event.at("reason"));
  } else if (kind == "finished" && from == Process::publisher) {
    judge_waiting(std::numeric_limits<std::int64_t>::max());
  } else if (kind == "carried") {
    on_carried(from, event);
  } else if (kind == "refused") {
    on_refused();
  } else if (kind == "matched") {
    on_matched(from, event.at("count"));
  } else if (kind == "discovery") {
    log_.push_back(fmt::format("{}: {}", to_string(from), event.at("text").get_ref<const std::string&>()));
  } else if (kind == "counters") {
    const auto& group_name = event.at("group").get_ref<const std::string&>();
    auto& group = counters_[to_string(from)][group_name];
    for (const auto& [name, value] : event.items()) {
      if (value.is_number_unsigned()) {
        group[name] = value;
      }
    }
  }
  update_discovered(now_ns);
}

void Figures::on_matched(Process from, std::uint64_t count) {
  const bool is_publisher = from == Process::publisher;
  bool& matched = is_publisher ? publisher_matched_ : subscriber_matched_;
  if (matched != (count > 0)) {
    log_.push_back(fmt::format("{}: {} {} over DDS", to_string(from), count > 0 ? "found" : "lost",
                               to_string(is_publisher ? Process::bridge_a : Process::bridge_b)));
  }
  matched = count > 0;
}

void Figures::update_discovered(std::int64_t now_ns) {
  if (!discovered_ns_ && publisher_matched_ && subscribed_ && subscriber_matched_) {
    discovered_ns_ = now_ns;
  }
}

std::string Figures::missing() const {
  std::string text;
  const auto add_if = [&](bool missing, const char* what) {
    text += missing ? (text.empty() ? "" : "; ") + std::string{what} : "";
  };
  add_if(!publisher_matched_, "publisher and bridge A have not found each other over DDS");
  add_if(publisher_matched_ && !subscribed_, "bridge A has no subscriber over SOME/IP");
  add_if(!subscriber_matched_, "subscriber and bridge B have not found each other over DDS");
  return text;
}

void Figures::on_published(const Json& event) {
  const std::int64_t time_ns = event.at("time_ns");
  const bool counts = discovered_ns_ && time_ns >= *discovered_ns_;
  published_[event.at("stamp_ns")] = {.checksum = event.at("checksum"), .time_ns = time_ns, .counts = counts};
  ++(counts ? counts_.sent : counts_.early);
  if (published_.size() > most_published) {
    published_.erase(published_.begin());
  }
  judge_waiting(time_ns);
}

/// A cloud that was received before this publication belongs to an earlier publication, all of which have
/// been reported.
void Figures::judge_waiting(std::int64_t before_ns) {
  for (const Arrival& arrival : std::exchange(waiting_, {})) {
    if (arrival.time_ns < before_ns || published_.contains(arrival.stamp_ns)) {
      judge(arrival);
    } else {
      waiting_.push_back(arrival);
    }
  }
}

void Figures::on_refused() {
  if (discovered_ns_) {
    ++counts_.sent;
    ++counts_.refused;
  }
}

void Figures::on_received(const Json& event) {
  const Arrival arrival{.stamp_ns = event.at("stamp_ns"),
                        .checksum = event.at("checksum"),
                        .bytes = event.at("bytes"),
                        .time_ns = event.at("time_ns")};
  if (published_.contains(arrival.stamp_ns)) {
    judge(arrival);
  } else {
    waiting_.push_back(arrival);
  }
}

void Figures::judge(const Arrival& arrival) {
  const auto found = published_.find(arrival.stamp_ns);
  if (found == published_.end()) {
    return count_corrupt("none with this stamp was sent");
  }
  Published& published = found->second;
  if (published.checksum != arrival.checksum) {
    return count_corrupt("the checksum does not fit the content");
  }
  if (published.arrived) {
    ++counts_.duplicates;
  } else if (published.counts) {
    count_arrival(arrival, published.time_ns);
  }
  published.arrived = true;
}

/// The stamp that identifies the cloud may be damaged too, so no cloud is counted as arrived.
void Figures::count_corrupt(const std::string& reason) {
  ++counts_.corrupt;
  log_.push_back("subscriber: received a damaged cloud: " + reason);
}

void Figures::count_arrival(const Arrival& arrival, std::int64_t published_ns) {
  ++counts_.arrived;
  add(Leg::end_to_end, arrival.time_ns - published_ns);
  if (counts_.arrived == 1) {
    first_arrival_ns_ = arrival.time_ns;
    first_arrival_bytes_ = arrival.bytes;
  }
  last_arrival_ns_ = arrival.time_ns;
  arrived_bytes_ += arrival.bytes;
  recent_.emplace_back(arrival.time_ns, arrival.bytes);
  while (recent_.front().first < arrival.time_ns - window_ns) {
    recent_.pop_front();
  }
}

void Figures::on_carried(Process from, const Json& event) {
  const std::int64_t before = event.at("before_ns");
  const std::int64_t after = event.at("after_ns");
  const std::uint16_t session = event.at("session");
  const bool is_a = from == Process::bridge_a;
  subscribed_ = subscribed_ || is_a;
  if (!discovered_ns_ || before < *discovered_ns_) {
    return;
  }
  add(is_a ? Leg::to_someip : Leg::to_dds, after - before);
  (is_a ? left_a_ : came_b_)[session] = is_a ? after : before;
  const auto left = left_a_.find(session);
  const auto came = came_b_.find(session);
  if (left == left_a_.end() || came == came_b_.end()) {
    return;
  }
  const std::int64_t transport = came->second - left->second;
  if (transport >= 0 && transport < same_session_ns) {
    add(Leg::transport, transport);
    left_a_.erase(left);
    came_b_.erase(came);
  } else if (transport < 0) {
    came_b_.erase(came);  // of an old message whose other line was left out
  } else {
    left_a_.erase(left);
  }
}

std::uint64_t Figures::lost(std::int64_t now_ns) const {
  const auto under_way = std::ranges::count_if(published_, [&](const auto& stamp_and_cloud) {
    const Published& cloud = stamp_and_cloud.second;
    return cloud.counts && !cloud.arrived && cloud.time_ns >= now_ns - grace_ns;
  });
  return outstanding() - static_cast<std::uint64_t>(under_way);
}

Figures::Rate Figures::rate_now(std::int64_t now_ns) const {
  std::uint64_t clouds = 0;
  std::uint64_t bytes = 0;
  for (const auto& [when, size] : recent_) {
    if (when >= now_ns - window_ns) {
      ++clouds;
      bytes += size;
    }
  }
  // In the first seconds the window is not full yet.
  const std::int64_t since_start = now_ns - discovered_ns_.value_or(now_ns);
  return rate_of(clouds, bytes, std::min(window_ns, since_start));
}

Figures::Rate Figures::rate() const {
  if (counts_.arrived < 2) {
    return {};
  }
  // The first arrival only starts the clock.
  return rate_of(counts_.arrived - 1, arrived_bytes_ - first_arrival_bytes_,
                 last_arrival_ns_ - first_arrival_ns_);
}

std::string Figures::fault() const {
  if (!discovered_ns_) {
    return "discovery did not complete: " + missing();
  }
  if (counts_.corrupt > 0) {
    return fmt::format("{} of the clouds that arrived were not what was sent", counts_.corrupt);
  }
  if (counts_.sent == 0) {
    return "no cloud was sent after discovery";
  }
  if (counts_.arrived * 100 < counts_.sent * 95) {
    return fmt::format("only {} of {} clouds arrived, less than 95 %", counts_.arrived, counts_.sent);
  }
  return {};
}

nlohmann::ordered_json Figures::to_json() const {
  nlohmann::ordered_json latency;
  constexpr std::array names{"dds_to_someip_conversion", "someip_transport", "someip_to_dds_conversion",
                             "publish_to_receive"};
  for (std::size_t i = 0; i < leg_count; ++i) {
    const statistics::Histogram& samples = legs_[i];
    latency[names[i]] = {{"count", samples.count()},
                         {"p50", samples.percentile(50)},
                         {"p99", samples.percentile(99)},
                         {"max", samples.max()}};
  }
  return {{"ok", fault().empty()},
          {"fault", fault()},
          {"clouds",
           {{"before_discovery", counts_.early},
            {"sent", counts_.sent},
            {"refused", counts_.refused},
            {"arrived", counts_.arrived},
            {"lost", outstanding()},
            {"corrupt", counts_.corrupt},
            {"duplicates", counts_.duplicates}}},
          {"clouds_per_second", rate().clouds_per_second},
          {"megabytes_per_second", rate().megabytes_per_second},
          {"latency_ns", latency},
          {"counters", counters_},
          {"unreadable_lines", unreadable_lines_}};
}

}  // namespace trestle::measure::demo
