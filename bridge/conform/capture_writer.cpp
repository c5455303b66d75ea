#include "bridge/conform/capture_writer.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "pcaps/pcapng_blocks.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::conform {
namespace {

using Block = std::vector<std::byte>;

template <typename T>
void put(Block& out, T number) {
  const std::size_t at = out.size();
  out.resize(at + sizeof(T));
  someip::store<T>(out.data() + at, number);
}

void put_bytes(Block& out, ByteView bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

/// The Internet checksum of some bytes, on top of a sum.
std::uint16_t checksum(ByteView bytes, std::uint32_t sum = 0) {
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    const auto high = std::to_integer<std::uint32_t>(bytes[at]);
    const auto low = at + 1 < bytes.size() ? std::to_integer<std::uint32_t>(bytes[at + 1]) : 0U;
    sum += (high << 8U) + low;
  }
  while (sum > 0xffff) {
    sum = (sum & 0xffffU) + (sum >> 16U);
  }
  return static_cast<std::uint16_t>(~sum);
}

ByteView address_of(const Endpoint& endpoint) {
  return std::as_bytes(std::span{endpoint.address.bytes}).first(endpoint.address.v6 ? 16 : 4);
}

/// What the checksums of UDP and TCP cover: addresses, protocol and length (below 64 KiB), then the segment.
Block with_pseudo_header(const Packet& packet, const Block& segment) {
  Block all;
  put_bytes(all, address_of(packet.from));
  put_bytes(all, address_of(packet.to));
  put(all, static_cast<std::uint16_t>(packet.transport));
  put(all, static_cast<std::uint16_t>(segment.size()));
  put_bytes(all, segment);
  return all;
}

Block udp(const Packet& packet) {
  Block out;
  const auto size = static_cast<std::uint16_t>(std::min<std::size_t>(8 + packet.bytes.size(), 0xffff));
  put(out, packet.from.port);
  put(out, packet.to.port);
  put(out, size);
  put(out, std::uint16_t{0});  // over IPv4: none
  put_bytes(out, packet.bytes);
  if (packet.from.address.v6) {
    const std::uint16_t sum = checksum(with_pseudo_header(packet, out));
    someip::store<std::uint16_t>(out.data() + 6, sum == 0 ? std::uint16_t{0xffff} : sum);
  }
  return out;
}

class TcpNumbers {
 public:
  /// A segment with the bytes, in order.
  Block segment(const Packet& packet) {
    std::uint32_t& next = sent_[{packet.from, packet.to}];
    const std::uint32_t acknowledged = sent_[{packet.to, packet.from}];
    Block out;
    put(out, packet.from.port);
    put(out, packet.to.port);
    put(out, next + 1);
    put(out, acknowledged + 1);
    // 20 bytes of header; ACK and PSH, or ACK and FIN
    put(out, packet.ends ? std::uint16_t{0x5011} : std::uint16_t{0x5018});
    put(out, std::uint16_t{0xffff});
    put(out, std::uint32_t{0});
    put_bytes(out, packet.bytes);
    next += static_cast<std::uint32_t>(packet.bytes.size());
    someip::store<std::uint16_t>(out.data() + 16, checksum(with_pseudo_header(packet, out)));
    return out;
  }

 private:
  std::map<std::pair<Endpoint, Endpoint>, std::uint32_t> sent_;
};

Block ip(const Packet& packet, const Block& contents, std::uint16_t id) {
  Block out;
  if (packet.from.address.v6) {
    put(out, std::uint32_t{0x6000'0000});
    put(out, static_cast<std::uint16_t>(std::min<std::size_t>(contents.size(), 0xffff)));
    put(out, static_cast<std::uint8_t>(packet.transport));
    put(out, std::uint8_t{64});
    put_bytes(out, address_of(packet.from));
    put_bytes(out, address_of(packet.to));
    put_bytes(out, contents);
    return out;
  }
  put(out, std::uint16_t{0x4500});
  put(out, static_cast<std::uint16_t>(std::min<std::size_t>(20 + contents.size(), 0xffff)));
  put(out, id);
  put(out, std::uint16_t{0x4000});
  put(out, std::uint8_t{64});
  put(out, static_cast<std::uint8_t>(packet.transport));
  put(out, std::uint16_t{0});
  put_bytes(out, address_of(packet.from));
  put_bytes(out, address_of(packet.to));
  someip::store<std::uint16_t>(out.data() + 10, checksum(ByteView{out}.first(20)));
  put_bytes(out, contents);
  return out;
}

}  // namespace

std::string pcapng(const std::deque<Packet>& packets, const std::string& title) {
  Block out;
  pcaps::put_pcapng_section(out, title);
  pcaps::put_pcapng_interface(out, pcaps::LinkType::raw_ip);
  TcpNumbers tcp;
  for (const Packet& packet : packets) {
    const Block frame = ip(packet, packet.transport == Transport::tcp ? tcp.segment(packet) : udp(packet),
                           static_cast<std::uint16_t>(packet.number));
    pcaps::put_pcapng_packet(out, packet.time, frame, frame.size(), packet.comment);
  }
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

}  // namespace trestle::conform
