#include "pcaps/traffic.hpp"

namespace trestle::pcaps {
namespace {

constexpr std::uint8_t protocol_tcp = 6;
constexpr std::uint8_t protocol_udp = 17;

}  // namespace

void Traffic::on_frame(const Frame& frame) {
  ++counters_.frames;
  origin_ = {frame.number, frame.time, {}, {}};
  const FrameResult<std::optional<IpPacket>> packet = find_ip(frame);
  if (!packet) {
    on_error(packet.error());
  } else if (!*packet) {
    ++counters_.other;
  } else if (!(*packet)->fragment) {
    on_packet(**packet);
  } else {
    ++counters_.fragments;
    const FrameResult<std::optional<IpPacket>> whole = fragments_.add(**packet, frame.time);
    if (!whole) {
      on_error(whole.error());
    } else if (*whole) {
      on_packet(**whole);
    }
  }
}

void Traffic::finish() {
  streams_.finish([this](const Endpoint& from, const Endpoint& to, const StreamBytes& bytes) {
    sink_.on_stream({origin_.frame, origin_.time, from, to}, bytes);
  });
}

void Traffic::on_packet(const IpPacket& packet) {
  if (packet.protocol == protocol_udp) {
    on_udp(packet);
  } else if (packet.protocol == protocol_tcp) {
    on_tcp(packet);
  } else {
    ++counters_.other;
  }
}

void Traffic::on_udp(const IpPacket& packet) {
  const FrameResult<UdpDatagram> datagram = parse_udp(packet);
  if (!datagram) {
    return on_error(datagram.error());
  }
  ++counters_.datagrams;
  const Origin origin{
      origin_.frame, origin_.time, {packet.from, datagram->from_port}, {packet.to, datagram->to_port}};
  sink_.on_datagram(origin, datagram->payload, datagram->missing);
}

void Traffic::on_tcp(const IpPacket& packet) {
  const FrameResult<TcpSegment> segment = parse_tcp(packet);
  if (!segment) {
    return on_error(segment.error());
  }
  ++counters_.segments;
  streams_.add(
      Endpoint{packet.from, segment->from_port}, Endpoint{packet.to, segment->to_port}, *segment,
      [this](const Endpoint& from, const Endpoint& to, const StreamBytes& bytes) {
        sink_.on_stream({origin_.frame, origin_.time, from, to}, bytes);
      },
      [this](const Endpoint& from, const Endpoint& to) {
        sink_.on_stream_closed({origin_.frame, origin_.time, from, to});
      });
}

void Traffic::on_error(const FrameError& error) {
  ++counters_.broken;
  sink_.on_broken_frame(origin_, error);
}

}  // namespace trestle::pcaps
