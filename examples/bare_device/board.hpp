// What a board has to supply for main.cpp: a clock, randomness, and UDP sockets at port 30490, which joins
// discovery's group 224.244.224.245, and at the ports of the services.
#pragma once
#include <trestle/sd/core/device/device.hpp>

namespace board {

trestle::TimePoint now();  // of a counter that never goes back
std::uint64_t seed();      // unlike that of other devices, and that of the last start

struct Datagram {
  trestle::ByteView bytes;  // stay as they are until the next call of receive()
  trestle::Endpoint from;
  trestle::Endpoint to;  // the own address or the group, and the port
};
std::optional<Datagram> receive();
void send(const trestle::device::Transmit& datagram);

std::uint8_t pedal();

}  // namespace board
