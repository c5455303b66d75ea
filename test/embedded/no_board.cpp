// The board of examples/bare_device, to link it and see how large it is: what it is told comes from, and what
// it has to say goes to, variables that the compiler knows nothing of.
#include "examples/bare_device/board.hpp"

namespace {
volatile std::int64_t clock_ns;
volatile std::uint8_t pedal_now;
volatile std::size_t received_bytes;
volatile std::size_t sent_bytes;
std::array<std::byte, 1500> received;
}  // namespace

namespace board {

trestle::TimePoint now() {
  return trestle::TimePoint{std::chrono::nanoseconds{clock_ns}};
}

std::uint64_t seed() {
  return static_cast<std::uint64_t>(clock_ns);
}

std::optional<Datagram> receive() {
  const std::size_t bytes = received_bytes;
  if (bytes == 0) {
    return std::nullopt;
  }
  return Datagram{trestle::ByteView{received}.first(bytes), {}, {}};
}

void send(const trestle::device::Transmit& datagram) {
  sent_bytes = sent_bytes + datagram.bytes.size();
}

std::uint8_t pedal() {
  return pedal_now;
}

}  // namespace board
