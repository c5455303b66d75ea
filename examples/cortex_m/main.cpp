// Firmware for Arm's mps2-an385 board, as QEMU emulates it: a SOME/IP device without operating system and
// heap.
#include "clock.hpp"
#include "log.hpp"
#include "net/ip_stack.hpp"
#include "net/lan9118.hpp"
#include "sensor.hpp"

using namespace trestle;
using example::Line;

namespace {

// The board.
constexpr std::uintptr_t controller = 0x4020'0000;

// The device: each device in a network needs its own MAC, address and seed.
constexpr net::Mac mac{0x02, 0x00, 0x00, 0x00, 0x78, 0x02};
constexpr IpAddress address = IpAddress::v4(10, 78, 0, 2);
constexpr std::uint64_t seed = 0x7802;
constexpr std::uint16_t sd_port = 30490;

device::Settings settings() noexcept {
  device::Settings settings;
  settings.discovery.unicast = {address, sd_port};
  settings.discovery.seed = seed;
  settings.services = example::services();
  // The controller has room for three frames that wait for the wire.
  settings.pacing = {.burst = 2, .separation = std::chrono::milliseconds{1}};
  return settings;
}

// All data of the firmware, except its stack.
struct Firmware {
  device::StaticDevice<example::limits> device{settings()};
  example::Sensor sensor{device};
  net::IpStack ip{{.mac = mac, .address = address, .gateway = {}}, seed};
  net::Lan9118 ethernet{controller};
  std::array<std::byte, net::IpStack::max_frame + 6> received{};  // with checksum, in whole words
  std::array<std::byte, net::IpStack::max_frame> sent{};

  bool start() noexcept;
  bool step() noexcept;
  void drain(TimePoint now) noexcept;
  void send(ByteView frame) noexcept;
};

void Firmware::send(ByteView frame) noexcept {
  if (!frame.empty()) {
    ethernet.send(frame);
  }
}

bool Firmware::start() noexcept {
  if (!ethernet.start(mac)) {
    Line{} << "no Ethernet controller";
    return false;
  }
  if (!ip.join(settings().discovery.multicast.address, example::now())) {
    Line{} << "no room for the group";
    return false;
  }
  if (const auto offered = device.offer(0, example::now()); !offered) {
    Line{} << "not offered: " << device::to_string(offered.error());
    return false;
  }
  return true;
}

// Lets the device send and report everything: first send, then take one happening, and so on.
void Firmware::drain(TimePoint now) noexcept {
  const ByteSpan room = std::span{sent}.subspan(net::IpStack::headers);
  for (;;) {
    while (const auto out = device.poll_transmit(room, now)) {
      send(ip.send(out->from_port, out->destination, out->bytes, sent, now));
    }
    const auto happening = device.poll_happening();
    if (!happening) {
      return;
    }
    sensor.on(*happening);
  }
}

// Does all work that is due.
// @return whether more frames may have come: a step takes only some, so that a flood does not stop events
//         from being sent.
bool Firmware::step() noexcept {
  int left = 8;
  for (; left > 0; --left) {
    const auto frame = ethernet.receive(received);
    if (!frame) {
      break;
    }
    const TimePoint now = example::now();
    const net::Arrival arrival = ip.on_frame(*frame, sent, now);
    send(arrival.answer);
    if (arrival.datagram) {
      device.on_datagram(arrival.datagram->payload, arrival.datagram->from, arrival.datagram->to, now);
      drain(now);
    }
  }
  const TimePoint now = example::now();
  device.on_time(now);
  sensor.on_time(now);
  drain(now);
  for (ByteView frame = ip.on_time(sent, now); !frame.empty(); frame = ip.on_time(sent, now)) {
    send(frame);
  }
  return left == 0;
}

}  // namespace

int main() {
  example::start_clock();
  static Firmware firmware;
  if (!firmware.start()) {
    return 1;
  }
  Line{} << "ready at " << Endpoint{address, sd_port} << ", " << sizeof firmware << " bytes of RAM";
  for (;;) {
    if (!firmware.step()) {
      example::wait();
    }
  }
}
