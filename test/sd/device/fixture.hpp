#pragma once
#include <functional>
#include <vector>

#include "sd/core/device/device.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::test {

using device::EventgroupId;
using device::Happening;
using device::InstanceId;
using device::MethodId;
using device::ServiceId;

inline constexpr std::uint16_t service_port = 30501;
inline constexpr Endpoint service_at{own.address, service_port};
inline constexpr Endpoint peer_at{IpAddress::v4(10, 0, 0, 2), 30490};
inline constexpr Endpoint peer_udp{peer_at.address, 40001};
inline constexpr Endpoint other_peer_at{IpAddress::v4(10, 0, 0, 3), 30490};
inline constexpr Endpoint other_peer_udp{other_peer_at.address, 40002};

/// The tables of the service that the tests offer: 1234.5678, with eventgroups 1 and 2.
struct Tables {
  static constexpr std::array group_1{EventgroupId{1}};
  static constexpr std::array group_2{EventgroupId{2}};
  static constexpr std::array both_groups{EventgroupId{1}, EventgroupId{2}};
  static constexpr std::array groups{sd::Eventgroup{.id = EventgroupId{1}},
                                     sd::Eventgroup{.id = EventgroupId{2}}};
  static constexpr std::array methods{
      device::Method{.id = MethodId{0x0001}},
      device::Method{.id = MethodId{0x0002}, .kind = someip::MethodKind::fire_and_forget}};
  static constexpr std::array events{device::Event{.id = MethodId{0x8001}, .eventgroups = group_1},
                                     device::Event{.id = MethodId{0x8002}, .eventgroups = both_groups}};

  std::array<std::byte, 4> speed{std::byte{0x00}, std::byte{0x2a}};
  std::array<std::byte, 2> limit{};
  std::array<std::byte, 8000> map{};
  std::array<device::Field, 3> fields{device::Field{.getter = MethodId{0x10},
                                                    .setter = MethodId{0x11},
                                                    .notifier = MethodId{0x8010},
                                                    .eventgroups = group_1,
                                                    .room = speed,
                                                    .initial_bytes = 2},
                                      device::Field{.getter = MethodId{0x20},
                                                    .setter = MethodId{0x21},
                                                    .notifier = MethodId{0x8020},
                                                    .eventgroups = group_2,
                                                    .room = limit,
                                                    .judged = true},
                                      device::Field{.getter = MethodId{0x30},
                                                    .setter = MethodId{0x31},
                                                    .notifier = MethodId{0x8030},
                                                    .eventgroups = group_2,
                                                    .room = map}};
  std::array<device::Service, 1> services{device::Service{.service = ServiceId{0x1234},
                                                          .instance = InstanceId{0x5678},
                                                          .port = service_port,
                                                          .methods = methods,
                                                          .events = events,
                                                          .fields = fields,
                                                          .eventgroups = groups}};
};

/// A datagram that a device sent.
struct Sent {
  std::uint16_t from_port;
  Endpoint to;
  std::vector<std::byte> bytes;
};

/// A device in virtual time, polled as its documentation says.
template <device::Limits limits = device::Limits{}>
class Rig {
 public:
  explicit Rig(const device::Settings& settings)
      : device_{std::make_unique<device::StaticDevice<limits>>(settings)} {}

  [[nodiscard]] device::Device& device() { return *device_; }

  /// Sends and asks until there is nothing left: `happened` gets each happening.
  void poll(const std::function<void(const Happening&)>& happened = {}) {
    for (;;) {
      while (const auto out = device_->poll_transmit(room_, now)) {
        const std::vector<std::byte> bytes{out->bytes.begin(), out->bytes.end()};
        from_ports.push_back(out->from_port);
        (out->from_port == own.port ? discovery : sent).push_back({out->from_port, out->destination, bytes});
      }
      const auto what = device_->poll_happening();
      if (!what) {
        return;
      }
      happenings.push_back(what->index());
      if (happened) {
        happened(*what);
      }
    }
  }

  /// Lets time pass, from deadline to deadline.
  void run_for(Duration time, const std::function<void(const Happening&)>& happened = {}) {
    const TimePoint end = now + time;
    for (int i = 0; i < 100'000; ++i) {
      device_->on_time(now);
      poll(happened);
      const auto deadline = device_->deadline();
      if (!deadline || *deadline > end) {
        now = end;
        return;
      }
      now = std::max(now, *deadline);
    }
    ADD_FAILURE() << "the deadline does not move on";
  }

  void receive(std::vector<std::byte> datagram, const Endpoint& from, const Endpoint& to,
               const std::function<void(const Happening&)>& happened = {}) {
    datagram_ = std::move(datagram);
    device_->on_datagram(datagram_, from, to, now);
    poll(happened);
  }
  /// To the service, from `peer_udp`.
  void receive(std::string_view digits, const std::function<void(const Happening&)>& happened = {}) {
    receive(hex(digits), peer_udp, service_at, happened);
  }

  /// What was sent since the last call, discovery left out: "40001 < 1234 0001 ..." by the receiver's port.
  std::vector<std::string> take_sent() {
    std::vector<std::string> lines;
    for (const Sent& one : std::exchange(sent, {})) {
      lines.push_back(std::to_string(one.to.port) + " < " + to_hex(one.bytes));
    }
    return lines;
  }
  [[nodiscard]] std::vector<std::string> take_discovery() {
    std::vector<std::string> lines;
    for (const Sent& one : std::exchange(discovery, {})) {
      lines.push_back(describe(one.to) + " < " + describe_datagram(one.bytes));
    }
    return lines;
  }

  TimePoint now = start;
  std::vector<Sent> sent;
  std::vector<Sent> discovery;
  std::vector<std::uint16_t> from_ports;  ///< of both, in their order
  std::vector<std::size_t> happenings;    ///< their places in the variant

 private:
  std::unique_ptr<device::StaticDevice<limits>> device_;
  std::vector<std::byte> datagram_;
  std::array<std::byte, device::Device::datagram_bytes> room_{};
};

inline device::Settings device_settings() {
  device::Settings settings;
  settings.discovery = fixed_settings();
  return settings;
}

template <typename What>
constexpr std::size_t place_of() {
  return Happening{What{}}.index();
}

/// The bytes 0, 1, ... 250, 0, ...
inline std::vector<std::byte> pattern(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = static_cast<std::byte>(i % 251);
  }
  return bytes;
}

}  // namespace trestle::test
