#include "pcaps/network.hpp"

#include <algorithm>

#include "pcaps/link_type.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::pcaps {
namespace {

using someip::ByteReader;

constexpr std::uint16_t ethertype_ipv4 = 0x0800;
constexpr std::uint16_t ethertype_ipv6 = 0x86dd;
constexpr std::size_t max_vlan_tags = 8;
constexpr std::size_t max_extension_headers = 16;

bool is_vlan_tag(std::uint16_t ethertype) noexcept {
  return ethertype == 0x8100 || ethertype == 0x88a8 || ethertype == 0x9100 || ethertype == 0x9200;
}

tl::unexpected<FrameError> fault(FrameFault what, std::size_t offset) noexcept {
  return tl::unexpected{FrameError{what, offset}};
}

std::uint32_t little_endian(ByteReader& in, unsigned bytes) noexcept {
  std::uint32_t number = 0;
  for (unsigned i = 0; i < bytes; ++i) {
    number |= std::uint32_t{in.u8()} << (8 * i);
  }
  return number;
}

/// Skips the headers of an 802.11 frame; returns the ethertype of its content, or 0 if we cannot read that.
std::uint16_t wlan_ethertype(ByteReader& in) noexcept {
  const std::uint8_t kind = in.u8();  // version, type, subtype
  const std::uint8_t flags = in.u8();
  in.skip(20);  // duration, three addresses
  const std::uint32_t sequence = little_endian(in, 2);
  const bool is_data = (kind & 0x0fU) == 0x08U;  // of version 0
  const bool is_empty = (kind & 0x40U) != 0;
  const bool is_qos = (kind & 0x80U) != 0;
  const bool is_piece = (flags & 0x04U) != 0 || (sequence & 0x0fU) != 0;
  const bool is_encrypted = (flags & 0x40U) != 0;
  if (!is_data || is_empty || is_piece || is_encrypted) {
    return 0;
  }
  if ((flags & 0x03U) == 0x03U) {
    in.skip(6);  // a fourth address, between access points
  }
  if (is_qos) {
    const std::uint8_t control = in.u8();
    in.skip((flags & 0x80U) != 0 ? 5 : 1);  // the rest of the QoS control, and the 802.11n control if present
    if ((control & 0x80U) != 0) {
      return 0;  // several packets in one frame
    }
  }
  const std::uint32_t llc = in.u32();
  const std::uint32_t organisation = std::uint32_t{in.u8()} << 8U | in.u8();
  const std::uint16_t ethertype = in.u16();
  return llc == 0xaaaa0300U && (organisation == 0 || organisation == 0xf8U) ? ethertype : std::uint16_t{0};
}

/// Skips the header of Per-Packet Information; returns the link type behind it.
LinkType ppi_link(ByteReader& in) noexcept {
  in.skip(2);  // version, flags
  const std::uint32_t size = little_endian(in, 2);
  const std::uint32_t data_link = little_endian(in, 4);
  constexpr std::uint32_t own_size = 8;
  in.skip(size < own_size ? in.rest().size() + 1 : size - own_size);
  constexpr std::uint32_t raw_ip_in_files = 101;  // libpcap has another number for it
  const LinkType link =
      data_link == raw_ip_in_files ? LinkType::raw_ip : link_type(static_cast<int>(data_link));
  return link == LinkType::ppi ? LinkType::unsupported : link;
}

/// Reads the link header.
/// @return what follows it: an ethertype, or 0.
std::uint16_t ethertype_after(LinkType link, ByteReader& in) noexcept {
  std::uint16_t ethertype = 0;
  switch (link) {
    case LinkType::ethernet:
      in.skip(12);
      return in.u16();
    case LinkType::linux_sll:
      in.skip(14);
      return in.u16();
    case LinkType::linux_sll2:
      ethertype = in.u16();
      in.skip(18);
      return ethertype;
    case LinkType::null_loopback: {
      // The family is in the byte order of the recording host; 2 is IPv4 everywhere, the value for IPv6
      // depends on the system.
      const std::uint32_t family = in.u32();
      const std::uint32_t number = family > 0xffff ? family >> 24U : family;
      return number == 2                                                    ? ethertype_ipv4
             : number == 10 || number == 24 || number == 28 || number == 30 ? ethertype_ipv6
                                                                            : std::uint16_t{0};
    }
    case LinkType::raw_ip:
      return in.rest().empty() || (in.rest()[0] >> 4U) != std::byte{6} ? ethertype_ipv4 : ethertype_ipv6;
    case LinkType::wlan:
      return wlan_ethertype(in);
    case LinkType::ppi: {
      const LinkType inner = ppi_link(in);
      return ethertype_after(inner, in);  // never PPI again
    }
    case LinkType::unsupported:
      break;
  }
  return 0;
}

/// Where the IP header begins; nothing if something other than IP follows.
FrameResult<std::optional<std::size_t>> skip_link_header(const Frame& frame) noexcept {
  ByteReader in{frame.bytes};
  std::uint16_t ethertype = ethertype_after(frame.link, in);
  for (std::size_t tags = 0; is_vlan_tag(ethertype) && tags < max_vlan_tags; ++tags) {
    in.skip(2);
    ethertype = in.u16();
  }
  if (in.failed()) {
    return fault(FrameFault::link_header, in.position());
  }
  if (ethertype != ethertype_ipv4 && ethertype != ethertype_ipv6) {
    return std::nullopt;
  }
  return in.position();
}

/// Sets the packet's payload: from `offset` for as long as IP says. Bytes may be missing only because the
/// recorder cut the frame.
FrameResult<std::optional<IpPacket>> with_payload(IpPacket packet, const Frame& frame, std::size_t offset,
                                                  std::size_t end) noexcept {
  if (end < offset || end > std::max(frame.wire_bytes, frame.bytes.size())) {
    return fault(FrameFault::ip_length, offset);
  }
  const std::size_t recorded_end = std::min(end, frame.bytes.size());
  if (recorded_end < offset) {
    return fault(FrameFault::ip_header, offset);
  }
  packet.payload = frame.bytes.subspan(offset, recorded_end - offset);
  packet.missing = end - recorded_end;
  packet.offset = offset;
  return packet;
}

FrameResult<std::optional<IpPacket>> parse_ipv4(const Frame& frame, std::size_t start) noexcept {
  ByteReader in{frame.bytes.subspan(start)};
  const std::uint8_t version_and_size = in.u8();
  in.skip(1);
  const std::size_t total_bytes = in.u16();
  const std::uint16_t id = in.u16();
  const std::uint16_t flags_and_offset = in.u16();
  in.skip(1);
  IpPacket packet;
  packet.protocol = in.u8();
  in.skip(2);
  const ByteView from = in.take(4);
  const ByteView to = in.take(4);
  const std::size_t header_bytes = std::size_t{4} * (version_and_size & 0x0fU);
  if (in.failed() || version_and_size >> 4U != 4 || header_bytes < 20) {
    return fault(FrameFault::ip_header, start);
  }
  std::ranges::transform(from, packet.from.bytes.begin(),
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  std::ranges::transform(to, packet.to.bytes.begin(),
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  const bool more = (flags_and_offset & 0x2000U) != 0;
  const std::uint32_t fragment_offset = (flags_and_offset & 0x1fffU) * 8U;
  if (more || fragment_offset != 0) {
    packet.fragment = IpPacket::Fragment{id, fragment_offset, more};
  }
  // A sender that leaves segmentation to its hardware is recorded with total length 0.
  const std::size_t end = total_bytes == 0 ? frame.wire_bytes : start + total_bytes;
  return with_payload(packet, frame, start + header_bytes, end);
}

/// Walks over the extension headers; sets `packet.protocol` to the protocol that follows them.
/// @return where that begins.
FrameResult<std::size_t> skip_extensions(IpPacket& packet, const Frame& frame, std::size_t offset) noexcept {
  for (std::size_t count = 0; count <= max_extension_headers; ++count) {
    const bool is_fragment = packet.protocol == 44;
    const bool is_authentication = packet.protocol == 51;
    const bool is_options = packet.protocol == 0 || packet.protocol == 43 || packet.protocol == 60 ||
                            packet.protocol == 135 || packet.protocol == 139 || packet.protocol == 140;
    if (!is_fragment && !is_authentication && !is_options) {
      return offset;
    }
    ByteReader in{frame.bytes.subspan(std::min(offset, frame.bytes.size()))};
    const std::uint8_t next = in.u8();
    const std::size_t size = in.u8();
    const std::uint16_t fragment_offset_and_more = in.u16();
    const std::uint32_t fragment_id = in.u32();
    if (in.failed()) {
      return fault(FrameFault::ip_extension, offset);
    }
    packet.protocol = next;
    if (is_fragment) {
      const IpPacket::Fragment fragment{fragment_id, fragment_offset_and_more & 0xfff8U,
                                        (fragment_offset_and_more & 1U) != 0};
      // A fragment header around a whole packet is allowed and means nothing.
      if (fragment.more || fragment.offset != 0) {
        packet.fragment = fragment;
      }
      offset += 8;
      if (fragment.offset != 0) {
        return offset;  // further extension headers are in the first fragment
      }
    } else {
      offset += is_authentication ? (size + 2) * 4 : (size + 1) * 8;
    }
  }
  return fault(FrameFault::ip_extension, offset);
}

FrameResult<std::optional<IpPacket>> parse_ipv6(const Frame& frame, std::size_t start) noexcept {
  ByteReader in{frame.bytes.subspan(start)};
  const std::uint32_t version_class_flow = in.u32();
  const std::size_t payload_bytes = in.u16();
  IpPacket packet;
  packet.protocol = in.u8();
  in.skip(1);
  const ByteView from = in.take(16);
  const ByteView to = in.take(16);
  if (in.failed() || version_class_flow >> 28U != 6) {
    return fault(FrameFault::ip_header, start);
  }
  packet.from.v6 = packet.to.v6 = true;
  std::ranges::transform(from, packet.from.bytes.begin(),
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  std::ranges::transform(to, packet.to.bytes.begin(),
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  const std::size_t after_header = start + 40;
  const std::size_t end = payload_bytes == 0 ? frame.wire_bytes : after_header + payload_bytes;
  const FrameResult<std::size_t> offset = skip_extensions(packet, frame, after_header);
  if (!offset) {
    return tl::unexpected{offset.error()};
  }
  return with_payload(packet, frame, *offset, end);
}

}  // namespace

const char* to_string(FrameFault fault) noexcept {
  switch (fault) {
    case FrameFault::link_header:
      return "link_header";
    case FrameFault::ip_header:
      return "ip_header";
    case FrameFault::ip_length:
      return "ip_length";
    case FrameFault::ip_extension:
      return "ip_extension";
    case FrameFault::fragment:
      return "fragment";
    case FrameFault::udp_header:
      return "udp_header";
    case FrameFault::udp_length:
      return "udp_length";
    case FrameFault::tcp_header:
      return "tcp_header";
  }
  return "unknown";
}

FrameResult<std::optional<IpPacket>> find_ip(const Frame& frame) noexcept {
  const FrameResult<std::optional<std::size_t>> start = skip_link_header(frame);
  if (!start) {
    return tl::unexpected{start.error()};
  }
  if (!*start) {
    return std::nullopt;
  }
  if (**start >= frame.bytes.size()) {
    return fault(FrameFault::ip_header, **start);
  }
  const bool v6 = (frame.bytes[**start] >> 4U) == std::byte{6};
  return v6 ? parse_ipv6(frame, **start) : parse_ipv4(frame, **start);
}

FrameResult<UdpDatagram> parse_udp(const IpPacket& packet) noexcept {
  ByteReader in{packet.payload};
  UdpDatagram datagram;
  datagram.from_port = in.u16();
  datagram.to_port = in.u16();
  std::size_t size = in.u16();
  in.skip(2);
  if (in.failed()) {
    return fault(FrameFault::udp_header, packet.offset);
  }
  const std::size_t whole = packet.payload.size() + packet.missing;
  // 0 in jumbograms, and in datagrams that a sender leaves to its hardware to segment.
  size = size == 0 ? whole : size;
  if (size < 8 || size > whole) {
    return fault(FrameFault::udp_length, packet.offset + 4);
  }
  const std::size_t recorded = std::min(size, packet.payload.size());
  datagram.payload = packet.payload.subspan(8, recorded - 8);
  datagram.missing = size - recorded;
  return datagram;
}

FrameResult<TcpSegment> parse_tcp(const IpPacket& packet) noexcept {
  ByteReader in{packet.payload};
  TcpSegment segment;
  segment.from_port = in.u16();
  segment.to_port = in.u16();
  segment.sequence = in.u32();
  in.skip(4);
  const std::size_t header_bytes = std::size_t{4} * (in.u8() >> 4U);
  const std::uint8_t flags = in.u8();
  in.skip(6);
  if (in.failed() || header_bytes < 20 || header_bytes > packet.payload.size()) {
    return fault(FrameFault::tcp_header, packet.offset);
  }
  segment.fin = (flags & 0x01U) != 0;
  segment.syn = (flags & 0x02U) != 0;
  segment.rst = (flags & 0x04U) != 0;
  segment.payload = packet.payload.subspan(header_bytes);
  return segment;
}

}  // namespace trestle::pcaps
