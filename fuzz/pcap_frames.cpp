// Property: whatever frames a capture holds, each is accounted for, and each direction of a TCP connection
// comes out as one sequence of bytes with its gaps counted; and the decoder above takes whatever comes.
//
// The input is a list of records of 4 bytes and their frame:
//   0    bits 0-2 kind, 3-4 ports, 5 SYN or more fragments, 6 the recorder cut 16 bytes off, 7 a minute
//   passes
//        kinds 0 to 4: a frame as recorded, of the link type of that number; the other kinds wrap their bytes
//        in IPv4 and 5: UDP, 6: TCP, 7: a fragment
//   1    6: sequence number in 8 bytes; 7: offset in 8 bytes
//   2-3  size of what follows
#include <algorithm>
#include <cstdlib>
#include <map>

#include "bridge/inspect/decode/capture_decoder.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace trestle::pcaps;

namespace {

constexpr Traffic::Limits limits{
    .fragments = {.max_packets = 2},
    .streams = {.max_streams = 3, .max_pending_bytes = 512, .max_pending_segments = 4}};
constexpr std::size_t record_bytes = 4;
constexpr std::size_t ipv4_bytes = 20;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// Checks what Traffic delivers, and hands it on to a decoder.
class Checker : public TrafficSink {
 public:
  void on_datagram(const Origin& origin, ByteView payload, std::size_t missing) override {
    ++delivered;
    require(payload.size() + missing <= 65527);
    decoder.on_datagram(origin, payload, missing);
  }
  void on_stream(const Origin& origin, const StreamBytes& stream) override {
    std::uint64_t& next = next_offset_[{origin.from, origin.to}];
    require(!stream.bytes.empty() && stream.offset == next + stream.lost_before);
    next = stream.offset + stream.bytes.size();
    lost += stream.lost_before;
    decoder.on_stream(origin, stream);
  }
  void on_stream_closed(const Origin& origin) override {
    next_offset_.erase({origin.from, origin.to});
    decoder.on_stream_closed(origin);
  }
  void on_broken_frame(const Origin& origin, const FrameError& error) override {
    ++broken;
    decoder.on_broken_frame(origin, error);
  }

  inspect::CaptureDecoder decoder{
      {}, [](const inspect::Json& object) {
        static_cast<void>(object.dump(-1, ' ', false, inspect::Json::error_handler_t::replace));
      }};
  std::uint64_t delivered = 0;
  std::uint64_t broken = 0;
  std::uint64_t lost = 0;

 private:
  std::map<std::pair<Endpoint, Endpoint>, std::uint64_t> next_offset_;
};

/// Writes an IPv4 packet around `body`.
std::vector<std::byte> ipv4(std::uint8_t protocol, std::uint16_t flags_and_offset, ByteView head,
                            ByteView body) {
  std::vector<std::byte> packet(ipv4_bytes);
  someip::ByteWriter out{packet};
  out.u16(0x4500);
  out.u16(static_cast<std::uint16_t>(ipv4_bytes + head.size() + body.size()));
  out.u16(7);
  out.u16(flags_and_offset);
  out.u16(static_cast<std::uint16_t>(0x4000U | protocol));
  out.u16(0);
  out.u32(0x0a000001);
  out.u32(0x0a000002);
  packet.insert(packet.end(), head.begin(), head.end());
  packet.insert(packet.end(), body.begin(), body.end());
  return packet;
}

std::vector<std::byte> wrap(unsigned kind, std::uint16_t port, bool flag, std::uint8_t argument,
                            ByteView body) {
  std::array<std::byte, 20> head{};
  someip::ByteWriter out{head};
  out.u16(40000);
  out.u16(port);
  switch (kind) {
    case 5:
      out.u16(static_cast<std::uint16_t>(8 + body.size()));
      return ipv4(17, 0, ByteView{head}.first(8), body);
    case 6:
      out.u32(0xffff'ff00U + argument * 8U);  // the sequence number wraps soon
      out.u32(0);
      out.u16(flag ? 0x5002 : 0x5010);
      return ipv4(6, 0, head, body);
    default:
      return ipv4(17, static_cast<std::uint16_t>((flag ? 0x2000U : 0U) | argument), {}, body);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Checker checker;
  Traffic traffic{checker, limits};
  ByteView input = std::as_bytes(std::span{data, size});
  Frame frame;
  while (input.size() >= record_bytes) {
    const auto first = std::to_integer<unsigned>(input[0]);
    const auto argument = std::to_integer<std::uint8_t>(input[1]);
    const std::size_t body_bytes =
        std::min<std::size_t>(someip::load<std::uint16_t>(input.data() + 2), input.size() - record_bytes);
    const ByteView body = input.subspan(record_bytes, std::min<std::size_t>(body_bytes, 65000));
    input = input.subspan(record_bytes + body_bytes);
    const unsigned kind = first & 7U;
    // 30490 is always taken for SOME/IP, others when they look like it.
    const auto port = static_cast<std::uint16_t>(30490 + ((first >> 3U) & 3U));
    std::vector<std::byte> wrapped;
    if (kind > 4) {
      wrapped = wrap(kind, port, (first & 0x20U) != 0, argument, body);
    }
    ++frame.number;
    frame.time += (first & 0x80U) != 0 ? std::chrono::minutes{1} : std::chrono::minutes{0};
    frame.link = kind > 4 ? LinkType::raw_ip : static_cast<LinkType>(kind);
    frame.bytes = kind > 4 ? ByteView{wrapped} : body;
    frame.wire_bytes = frame.bytes.size();
    if ((first & 0x40U) != 0) {
      frame.bytes = frame.bytes.first(frame.bytes.size() - std::min<std::size_t>(16, frame.bytes.size()));
    }
    traffic.on_frame(frame);
    require(traffic.fragments().incomplete() <= limits.fragments.max_packets);
  }
  traffic.finish();
  checker.decoder.finish();
  const Traffic::Counters& counters = traffic.counters();
  require(counters.frames == frame.number && counters.datagrams == checker.delivered);
  require(counters.broken == checker.broken && traffic.streams().lost_bytes() == checker.lost);
  // Each frame is one of these; a fragment may complete a datagram or segment, be broken, or neither.
  const std::uint64_t sum = counters.datagrams + counters.segments + counters.other + counters.broken;
  require(sum <= counters.frames && counters.frames <= sum + counters.fragments);
  return 0;
}
