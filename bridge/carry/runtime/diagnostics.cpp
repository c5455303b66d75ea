#include "bridge/carry/runtime/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/messages/values/cdr.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

// A state that goes to and fro with every message must not be published as often.
constexpr auto soonest = std::chrono::milliseconds{100};

constexpr std::size_t max_sample = std::size_t{4} << 20U;  // far more than the bridge has to say

void write_text(messages::CdrWriter& out, const std::string& text) {
  out.number(static_cast<std::uint32_t>(text.size() + 1));
  out.bytes(std::as_bytes(std::span{text.c_str(), text.size() + 1}));
}

}  // namespace

std::string event_id(const Route& route) {
  return fmt::format("0x{:04x}.0x{:04x} event 0x{:04x}", value(route.service), value(route.instance),
                     value(route.event));
}

Diagnosis method_state(const CounterGroup& counters, bool is_there, const char* missing,
                       const std::string& at) {
  Diagnosis result{.level = is_there ? Diagnosis::Level::ok : Diagnosis::Level::warn,
                   .name = "trestle: " + counters.name,
                   .message = is_there ? "ready" : missing,
                   .hardware_id = "SOME/IP " + at,
                   .values = {}};
  for (const Counter& counter : counters.counters) {
    result.values.emplace_back(counter.name, std::to_string(counter.count));
  }
  return result;
}

Diagnosis route_state(const CounterGroup& counters, bool is_there, const char* missing, const Route& route) {
  CounterGroup some = counters;
  std::erase_if(some.counters, [](const Counter& one) { return one.says_nothing(); });
  return method_state(some, is_there, missing, event_id(route));
}

std::vector<std::byte> diagnostic_array(std::chrono::nanoseconds stamp, std::span<const Diagnosis> statuses) {
  messages::CdrWriter out{max_sample};
  const auto seconds = std::chrono::floor<std::chrono::seconds>(stamp);
  out.number(static_cast<std::uint32_t>(seconds.count()));
  out.number(static_cast<std::uint32_t>((stamp - seconds).count()));
  write_text(out, "");  // frame_id
  out.number(static_cast<std::uint32_t>(statuses.size()));
  for (const Diagnosis& status : statuses) {
    out.number(static_cast<std::uint8_t>(status.level));
    write_text(out, status.name);
    write_text(out, status.message);
    write_text(out, status.hardware_id);
    out.number(static_cast<std::uint32_t>(status.values.size()));
    for (const auto& [key, value] : status.values) {
      write_text(out, key);
      write_text(out, value);
    }
  }
  return out.take();
}

Diagnostics::Diagnostics(RouteClock& clock, DdsSide& dds, const DiagnosticsSettings& settings,
                         const std::string& user_data, std::function<std::vector<Diagnosis>()> look)
    : period_{settings.period},
      look_{std::move(look)},
      writer_{dds.writer(dds::ros_topic_name(settings.topic), dds::ros_type_name(type), {}, max_sample,
                         {.user_data = user_data})},
      clock_{clock},
      next_look_{clock.timer([this] { this->look(); })},
      due_{clock.now() + period_} {
  next_look_->set(due_);
}

void Diagnostics::changed() {
  has_changed_ = true;
  look_soon();
}

std::function<void()> Diagnostics::asker() {
  return [this, alive = std::weak_ptr{alive_}] {
    if (!alive.expired()) {
      look_soon();
    }
  };
}

void Diagnostics::look_soon() {
  const auto when = std::max(clock_.now(), last_ + soonest);
  if (when < next_look_->armed()) {
    next_look_->set(when);
  }
}

void Diagnostics::look() {
  last_ = clock_.now();
  const std::vector<Diagnosis> found = look_();
  Said now;
  now.reserve(found.size());
  for (const Diagnosis& one : found) {  // a level has a message of its own
    now.emplace_back(one.name, one.message);
  }
  const bool is_other = std::exchange(said_, std::move(now)) != said_;
  if (std::exchange(has_changed_, false) || is_other || last_ >= due_) {
    const auto sample = diagnostic_array(clock_.since_1970(), found);
    const ByteView bytes{sample};
    static_cast<void>(writer_->write({&bytes, 1}));  // with the next one all is said again
    due_ = last_ + period_;
  }
  next_look_->set(due_);
}

}  // namespace trestle::carry
