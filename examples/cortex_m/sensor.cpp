#include "sensor.hpp"

#include <trestle/someip/wire/bytes.hpp>
#include <trestle/someip/wire/payload_reader.hpp>
#include <trestle/someip/wire/payload_writer.hpp>

#include "log.hpp"

namespace trestle::example {
namespace {

using namespace std::chrono_literals;
using device::EventgroupId;
using device::MethodId;

constexpr MethodId add_method{0x0001};
constexpr MethodId get_period{0x0010};
constexpr MethodId set_period_method{0x0011};
constexpr MethodId period_changed{0x8010};
constexpr MethodId uptime_event{0x8001};
constexpr MethodId scan_event{0x8002};
constexpr std::size_t period_field = 0;
constexpr std::uint32_t shortest_period_ms = 10;
constexpr std::uint32_t longest_period_ms = 10'000;
constexpr Duration scan_period = 500ms;

// The value of the field: 100 ms. Only the device writes it.
constinit std::array<std::byte, 4> period{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{100}};

// With their types written out: GCC 12 puts constants of a deduced type into RAM.
constexpr std::array<EventgroupId, 1> uptime_group{EventgroupId{1}};
constexpr std::array<EventgroupId, 1> scan_group{EventgroupId{2}};
constexpr std::array<EventgroupId, 1> period_group{EventgroupId{3}};
constexpr std::array<sd::Eventgroup, 3> groups{sd::Eventgroup{.id = uptime_group[0]},
                                               sd::Eventgroup{.id = scan_group[0]},
                                               sd::Eventgroup{.id = period_group[0]}};
constexpr std::array<device::Method, 1> methods{device::Method{.id = add_method}};
constexpr std::array<device::Event, 2> events{device::Event{.id = uptime_event, .eventgroups = uptime_group},
                                              device::Event{.id = scan_event, .eventgroups = scan_group}};
constexpr std::array<device::Field, 1> fields{device::Field{.getter = get_period,
                                                            .setter = set_period_method,
                                                            .notifier = period_changed,
                                                            .eventgroups = period_group,
                                                            .room = period,
                                                            .initial_bytes = period.size(),
                                                            .judged = true}};
constexpr std::array<device::Service, 1> table{device::Service{.service = device::ServiceId{0x6001},
                                                               .instance = device::InstanceId{1},
                                                               .major = 1,
                                                               .minor = 0,
                                                               .port = 30509,
                                                               .methods = methods,
                                                               .events = events,
                                                               .fields = fields,
                                                               .eventgroups = groups}};

}  // namespace

std::span<const device::Service> Sensor::services() noexcept {
  return table;
}

std::uint32_t Sensor::period_ms() const noexcept {
  const auto value = device_.field(0, period_field);
  return value && value->size() == period.size() ? someip::load<std::uint32_t>(value->data())
                                                 : longest_period_ms;
}

void Sensor::on_time(TimePoint now) noexcept {
  if (now >= uptime_due_) {
    // As builtin_interfaces/msg/Time: seconds and nanoseconds.
    std::array<std::byte, 8> uptime{};
    const auto since_start = now.time_since_epoch();
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since_start);
    someip::store(uptime.data(), static_cast<std::uint32_t>(seconds.count()));
    someip::store(uptime.data() + 4, static_cast<std::uint32_t>((since_start - seconds).count()));
    static_cast<void>(device_.notify(0, uptime_event, uptime));  // if there is no room, this one is left out
    uptime_due_ = now + std::chrono::milliseconds{period_ms()};
  }
  if (now >= scan_due_ && !scan_is_being_sent_ && device_.subscribers(0, scan_event) > 0) {
    someip::store(scan_.data(), ++scans_);
    for (std::size_t i = 4; i < scan_.size(); ++i) {
      scan_[i] = static_cast<std::byte>((7 * i + scans_) & 0xffU);
    }
    scan_is_being_sent_ = device_.notify(0, scan_event, scan_).has_value();
    scan_due_ = now + scan_period;
  }
}

void Sensor::on(const device::Happening& happening, TimePoint /*now*/) noexcept {
  if (const auto* request = std::get_if<device::Request>(&happening)) {
    on_request(*request);
  } else if (std::holds_alternative<device::SendFinished>(happening)) {
    scan_is_being_sent_ = false;  // only the scan is so large that it is not copied
  } else if (const auto* added = std::get_if<device::SubscriberAdded>(&happening)) {
    Line{} << "subscribed to eventgroup " << someip::value(added->eventgroup) << ": " << added->subscriber;
  } else if (const auto* removed = std::get_if<device::SubscriberRemoved>(&happening)) {
    Line{} << "left eventgroup " << someip::value(removed->eventgroup) << ": " << removed->subscriber << ", "
           << sd::to_string(removed->reason);
  }
}

void Sensor::on_request(const device::Request& request) noexcept {
  if (request.header.method == add_method) {
    add(request);
  } else {
    set_period(request);
  }
}

void Sensor::add(const device::Request& request) noexcept {
  someip::PayloadReader in{request.payload};
  const std::uint32_t a = in.u32();
  const std::uint32_t b = in.u32();
  if (in.error() || !in.at_end()) {
    static_cast<void>(device_.respond_error(request, someip::ReturnCode::malformed_message));
    return;
  }
  std::array<std::byte, 4> sum{};
  someip::store(sum.data(), a + b);
  static_cast<void>(device_.respond(request, sum));
}

void Sensor::set_period(const device::Request& request) noexcept {
  someip::PayloadReader in{request.payload};
  const std::uint32_t wanted = in.u32();
  if (in.error() || !in.at_end()) {
    static_cast<void>(device_.respond_error(request, someip::ReturnCode::malformed_message));
    return;
  }
  if (wanted < shortest_period_ms || wanted > longest_period_ms) {
    static_cast<void>(device_.respond_error(request, someip::ReturnCode::not_ok));
    return;
  }
  if (device_.accept(request, request.payload)) {
    uptime_due_ = {};  // at once, then in the new rhythm
  }
}

}  // namespace trestle::example
