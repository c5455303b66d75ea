#pragma once
#include <array>
#include <optional>

#include <trestle/sd/core/device/device.hpp>
#include <trestle/someip/core/e2e/checker.hpp>
#include <trestle/someip/core/e2e/protector.hpp>

#include "ets/schedule.hpp"

namespace trestle::example {

/// The application: the Enhanced Testability Service, its companions, and the client that it drives, as far
/// as that goes over UDP by unicast. The README of this folder says what there is.
class EtsApplication {
 public:
  [[nodiscard]] static std::span<const device::Service> services() noexcept;
  [[nodiscard]] static std::span<const device::Need> needs() noexcept;
  /// A tester asks more often than any peer would, and begins anew with each case.
  static void adjust(sd::Settings& discovery) noexcept {
    discovery.max_entries_per_second = 1'000'000;
    discovery.max_entries_at_once = 1'000'000;
    discovery.max_reboots_at_once = 1000;
  }
  /// How much the device can hold.
  static constexpr device::Limits limits{.services = 5,
                                         .eventgroups = 2,
                                         .events = 7,
                                         .subscribers = 16,
                                         .peers = 8,
                                         .needs = 3,
                                         .subscriptions = 2,
                                         .remote_services = 3,
                                         .pending_entries = 16,
                                         .tp_buffers = 2,
                                         .tp_buffer_bytes = 8192};

  explicit EtsApplication(device::Device& device) noexcept : device_{device} {}

  [[nodiscard]] device::Result<void> start(TimePoint now) noexcept;
  /// Sends the events that are due, and offers the service again after it was suspended.
  void on_time(TimePoint now) noexcept;
  void on(const device::Happening& happening, TimePoint now) noexcept;

 private:
  /// In UTF-8, of a string in UTF-16. Longer ones are refused.
  static constexpr std::size_t text_bytes = 384;
  /// Up to this size an answer is copied, so that it need not stay.
  static constexpr std::size_t small_answer_bytes = limits.send_bytes;

  /// An answer: what is too large to be copied stays here until it is sent.
  struct Answer {
    std::array<std::byte, limits.tp_buffer_bytes> bytes{};
    bool is_being_sent = false;
  };
  /// The end-to-end protection of one method, for the client that has called it last: whoever comes then
  /// begins anew.
  struct Protection {
    std::optional<someip::e2e::Checker> checker;
    Endpoint client;
    someip::ClientId client_id{};
  };

  void on_request(const device::Request& request, TimePoint now) noexcept;
  void echo(const device::Request& request) noexcept;
  void echo_large(const device::Request& request) noexcept;
  [[nodiscard]] bool echo(const device::Request& request, ByteSpan room) noexcept;
  void protected_echo(const device::Request& request) noexcept;
  [[nodiscard]] someip::e2e::CheckResult check(const device::Request& request) noexcept;
  void refuse(const device::Request& request, someip::ReturnCode code) noexcept;
  device::Result<void> reset_fields() noexcept;

  device::Device& device_;
  ets::Schedule schedule_;
  std::optional<TimePoint> offered_again_;  ///< when it is; nothing: it is not suspended
  std::uint8_t last_value_ = 0;             ///< of the event of the service that the client was told to use
  std::array<Protection, ets::protected_echoes.size()> protections_{};
  std::array<Answer, 2> answers_{};
};

}  // namespace trestle::example
