#include "examples/cortex_m/net/ip_stack.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace std::chrono_literals;

/// The network layer of the firmware example, fed with frames: each is a length of two bytes, then that many
/// bytes. Property: nothing is read outside a frame (each is copied to memory of its own size), what is
/// handed over lies within it, what is sent is a whole frame from our MAC, at most one for each frame and as
/// many reports as there are groups, and a datagram can be sent to the sender of one.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const net::Mac mac{2, 0, 0, 0, 0, 2};
  net::IpStack stack{{.mac = mac, .address = IpAddress::v4(10, 0, 0, 2), .gateway = {}}, 1};
  TimePoint now{1h};
  const auto require = [](bool holds) {
    if (!holds) {
      std::abort();
    }
  };
  const auto is_sent = [&](ByteView frame) {
    require(frame.size() >= 14 && frame.size() <= net::IpStack::max_frame);
    require(std::ranges::equal(frame.subspan(6, 6), std::as_bytes(std::span{mac})));
  };
  require(stack.join(IpAddress::v4(224, 244, 224, 245), now));
  std::vector<std::byte> room(net::IpStack::max_frame);
  someip::ByteReader in{std::as_bytes(std::span{data, size})};
  while (!in.rest().empty()) {
    const std::size_t length = std::min<std::size_t>(in.u16(), in.rest().size());
    const ByteView bytes = in.take(length);
    const std::vector<std::byte> frame(bytes.begin(), bytes.end());
    now += 100ms;
    const net::Arrival arrival = stack.on_frame(frame, room, now);
    if (!arrival.answer.empty()) {
      is_sent(arrival.answer);
    }
    if (arrival.datagram) {
      const ByteView payload = arrival.datagram->payload;
      require(payload.data() >= frame.data() &&
              payload.data() + payload.size() <= frame.data() + frame.size());
      const bool fits = payload.size() <= net::IpStack::max_payload;
      const ByteView sent = stack.send(30509, arrival.datagram->from, payload, room, now);
      const std::uint32_t to =
          someip::load<std::uint32_t>(std::as_bytes(std::span{arrival.datagram->from.address.bytes}).data());
      if (fits && to >> 8U == 0x0a0000) {
        is_sent(sent);
        require(sent.size() == net::IpStack::headers + payload.size());
      }
    }
    int reports = 0;
    for (ByteView sent = stack.on_time(room, now); !sent.empty(); sent = stack.on_time(room, now)) {
      is_sent(sent);
      require(++reports <= 2);
    }
  }
  return 0;
}
