#pragma once
#include <trestle/sd/core/device/device.hpp>

namespace trestle::example {

/// The application: a sensor that answers calls and sends events.
/// The README of this folder describes the service.
class Sensor {
 public:
  [[nodiscard]] static std::span<const device::Service> services() noexcept;
  [[nodiscard]] static std::span<const device::Need> needs() noexcept { return {}; }
  static void adjust(sd::Settings& /*discovery*/) noexcept {}
  /// How much the device can hold.
  static constexpr device::Limits limits{.services = 1,
                                         .eventgroups = 3,
                                         .events = 3,
                                         .subscribers = 12,
                                         .peers = 8,
                                         .tp_buffers = 0,
                                         .tp_buffer_bytes = 0};

  explicit Sensor(device::Device& device) noexcept : device_{device} {}

  [[nodiscard]] device::Result<void> start(TimePoint now) noexcept { return device_.offer(0, now); }
  /// Sends the events that are due.
  void on_time(TimePoint now) noexcept;
  void on(const device::Happening& happening, TimePoint now) noexcept;

 private:
  void on_request(const device::Request& request) noexcept;
  void add(const device::Request& request) noexcept;
  void set_period(const device::Request& request) noexcept;
  [[nodiscard]] std::uint32_t period_ms() const noexcept;

  device::Device& device_;
  TimePoint uptime_due_;
  TimePoint scan_due_;
  std::uint32_t scans_ = 0;
  bool scan_is_being_sent_ = false;
  std::array<std::byte, 8192> scan_{};
};

}  // namespace trestle::example
