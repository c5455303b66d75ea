#pragma once
#include "clock.hpp"
#include "log.hpp"
#include "net/ip_stack.hpp"
#include "net/lan9118.hpp"

#include <trestle/sd/core/device/device.hpp>

/// What is the same in each firmware for Arm's mps2-an385 board, as QEMU emulates it, whatever service it
/// offers: a SOME/IP device without operating system and heap.
namespace trestle::example {

// The board.
inline constexpr std::uintptr_t controller = 0x4020'0000;

// The device: each device in a network needs its own MAC, address and seed.
inline constexpr net::Mac mac{0x02, 0x00, 0x00, 0x00, 0x78, 0x02};
inline constexpr IpAddress address = IpAddress::v4(10, 78, 0, 2);
inline constexpr std::uint64_t seed = 0x7802;
inline constexpr std::uint16_t sd_port = 30490;

template <typename Application>
device::Settings settings() noexcept {
  device::Settings settings;
  settings.discovery.unicast = {address, sd_port};
  settings.discovery.seed = seed;
  Application::adjust(settings.discovery);
  settings.services = Application::services();
  settings.needs = Application::needs();
  // The controller has room for three frames that wait for the wire.
  settings.pacing = {.burst = 2, .separation = std::chrono::milliseconds{1}};
  return settings;
}

/// All data of a firmware, except its stack, and its work. The Application, made of the device, has
///  - services() and needs(): tables that describe the device, and limits, which say how much it holds
///  - adjust(): changes settings of discovery, where the defaults do not suit
///  - start(): offers what there is
///  - on_time(): is called every few milliseconds at least
///  - on(): takes each happening of the device
template <typename Application>
struct Firmware {
  device::StaticDevice<Application::limits> device{settings<Application>()};
  Application application{device};
  net::IpStack ip{{.mac = mac, .address = address, .gateway = {}}, seed};
  net::Lan9118 ethernet{controller};
  std::array<std::byte, net::IpStack::max_frame + 6> received{};  // with checksum, in whole words
  std::array<std::byte, net::IpStack::max_frame> sent{};

  bool start() noexcept;
  bool step() noexcept;
  void drain(TimePoint now) noexcept;
  void send(ByteView frame) noexcept;
};

template <typename Application>
void Firmware<Application>::send(ByteView frame) noexcept {
  if (!frame.empty()) {
    ethernet.send(frame);
  }
}

template <typename Application>
bool Firmware<Application>::start() noexcept {
  if (!ethernet.start(mac)) {
    Line{} << "no Ethernet controller";
    return false;
  }
  if (!ip.join(settings<Application>().discovery.multicast.address, example::now())) {
    Line{} << "no room for the group";
    return false;
  }
  if (const auto offered = application.start(example::now()); !offered) {
    Line{} << "not offered: " << device::to_string(offered.error());
    return false;
  }
  return true;
}

/// Lets the device send and report everything: first send, then take one happening, and so on.
template <typename Application>
void Firmware<Application>::drain(TimePoint now) noexcept {
  const ByteSpan room = std::span{sent}.subspan(net::IpStack::headers);
  for (;;) {
    while (const auto out = device.poll_transmit(room, now)) {
      send(ip.send(out->from_port, out->destination, out->bytes, sent, now));
    }
    const auto happening = device.poll_happening();
    if (!happening) {
      return;
    }
    application.on(*happening, now);
  }
}

/// Does all work that is due.
/// @return whether more frames may have come: a step takes only some, so that a flood does not stop events
///         from being sent.
template <typename Application>
bool Firmware<Application>::step() noexcept {
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
  application.on_time(now);
  drain(now);
  for (ByteView frame = ip.on_time(sent, now); !frame.empty(); frame = ip.on_time(sent, now)) {
    send(frame);
  }
  return left == 0;
}

/// Starts the device, and works for ever.
/// @return only when it cannot start.
template <typename Application>
int run() noexcept {
  start_clock();
  static Firmware<Application> firmware;
  if (!firmware.start()) {
    return 1;
  }
  Line{} << "ready at " << Endpoint{address, sd_port} << ", " << sizeof firmware << " bytes of RAM";
  for (;;) {
    if (!firmware.step()) {
      wait();
    }
  }
}

}  // namespace trestle::example
