// Property: whatever arrives at a device, in whatever order and at whatever time, it neither crashes nor
// reads out of bounds; it sends nothing larger than a datagram, every round of polling ends, and what a large
// event needs is free again.
//
// Input: steps of a byte that says where a datagram comes from and goes to, one that says how much time
// passes, one that tells its length, and the datagram.
#include <cstdlib>

#include "test/sd/device/two_devices.hpp"

namespace {
using namespace trestle;
using namespace std::chrono_literals;

constexpr device::Limits limits{.services = 1,
                                .eventgroups = 1,
                                .events = 2,
                                .subscribers = 3,
                                .peers = 2,
                                .needs = 1,
                                .subscriptions = 1,
                                .remote_services = 1,
                                .calls = 2,
                                .tp_buffer_bytes = 256};

void check(bool good) {
  if (!good) {
    std::abort();
  }
}

class Firmware {
 public:
  explicit Firmware(const device::Settings& settings) : device_{settings} {
    check(device_.offer(0, now_).has_value());
    check(device_.require(0, now_).has_value());
  }

  void receive(std::uint8_t way, std::uint8_t wait, ByteView datagram) {
    now_ += 5ms * wait;
    const IpAddress own = test::TwoDevices::server_sd.address;
    constexpr std::array<std::uint16_t, 4> ports{30490, 30501, 30600, 1};
    const std::uint16_t port = ports[way & 3U];
    const bool group = (way & 4U) != 0;
    const IpAddress from = IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(2 + (way >> 3U & 3U)));
    device_.on_time(now_);
    poll();
    device_.on_datagram(datagram, {from, static_cast<std::uint16_t>((way & 0x40U) != 0 ? 30501 : 30490)},
                        {group ? IpAddress::v4(224, 244, 224, 245) : own, port}, now_);
    poll();
    if ((way & 0x80U) != 0) {
      act();
    }
    poll();
  }

  void end() {
    device_.shutdown(now_);
    poll();
    check(waiting_ == 0);
    check(!device_.deadline() || *device_.deadline() > TimePoint{});
  }

 private:
  void act() {
    if (waiting_ == 0 && device_.subscribers(0, test::TwoDevices::event) > 0 &&
        device_.notify(0, test::TwoDevices::event, large_)) {
      ++waiting_;
    }
    static_cast<void>(device_.call(0, test::TwoDevices::echo, ByteView{large_}.first(3), 1s, now_));
    static_cast<void>(device_.set_field(
        0, 0, ByteView{large_}.first(static_cast<std::size_t>(now_.time_since_epoch().count()) % 5)));
  }

  void poll() {
    for (int i = 0; i < 1000; ++i) {
      for (int sent = 0; const auto out = device_.poll_transmit(room_, now_); ++sent) {
        check(sent < 10'000 && out->bytes.size() <= room_.size());
      }
      const auto what = device_.poll_happening();
      if (!what) {
        return;
      }
      if (const auto* request = std::get_if<device::Request>(&*what)) {
        static_cast<void>(
            device_.respond(*request, request->payload.first(std::min<std::size_t>(
                                          request->payload.size(), device_.max_copied_bytes()))));
      } else if (std::holds_alternative<device::SendFinished>(*what)) {
        --waiting_;
      }
    }
    std::abort();
  }

  TimePoint now_{1000s};
  device::StaticDevice<limits> device_;
  std::array<std::byte, device::Device::datagram_bytes> room_{};
  std::array<std::byte, 3000> large_{};
  int waiting_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const trestle::test::TwoDevices tables;
  trestle::device::Settings settings = tables.server_settings(1);
  static constexpr std::array events{trestle::someip::MethodId{0x8001}};
  static constexpr std::array subscriptions{
      trestle::device::Subscription{.eventgroup = trestle::sd::EventgroupId{1}, .events = events}};
  static constexpr std::array needs{trestle::device::Need{.service = trestle::sd::ServiceId{0x2222},
                                                          .instance = trestle::sd::InstanceId{1},
                                                          .port = 30600,
                                                          .subscriptions = subscriptions}};
  settings.needs = needs;
  Firmware firmware{settings};
  trestle::ByteView input = std::as_bytes(std::span{data, size});
  while (input.size() >= 3) {
    const auto number = [&](std::size_t i) { return std::to_integer<std::uint8_t>(input[i]); };
    const std::size_t length = std::min<std::size_t>(number(2), input.size() - 3);
    firmware.receive(number(0), number(1), input.subspan(3, length));
    input = input.subspan(3 + length);
  }
  firmware.end();
  return 0;
}
