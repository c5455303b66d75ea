// pcaps: captures, and what leads from a frame to UDP datagrams and TCP streams.
//
//   capture_file.hpp  reads pcap and pcapng files; live_capture.hpp: frames of an interface (libpcap)
//   link_type.hpp     link layers that are known; pcapng_blocks.hpp: writes captures
//   network.hpp       from a frame to its UDP datagram or TCP segment
//   ip_fragments.hpp  puts IP fragments together; tcp_streams.hpp: TCP segments
//   traffic.hpp       all of this in one object: frames in, payloads out
//   vsomeip/          recorded traffic; its README.md says how each file was made
//
// The files are fixtures of tests, and seeds of the fuzzers.
#pragma once
#include <cstdint>
#include <optional>
#include <tl/expected.hpp>

#include "pcaps/frame.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::pcaps {

/// Why a frame could not be followed down to its UDP datagram or TCP segment.
enum class FrameFault : std::uint8_t {
  link_header,   ///< ends inside its link layer header
  ip_header,     ///< ends inside its IP header, or that contradicts itself
  ip_length,     ///< the IP length field is beyond the frame or below the header
  ip_extension,  ///< an IPv6 extension header ends beyond the packet, or there are too many
  fragment,      ///< an IP fragment beyond 65535 bytes or of a size that cannot be
  udp_header,    ///< ends inside its UDP header
  udp_length,    ///< the UDP length field is beyond the packet or below the header
  tcp_header,    ///< ends inside its TCP header, or that contradicts itself
};

/// The fault's name as it stands above.
[[nodiscard]] const char* to_string(FrameFault fault) noexcept;

/// A fault and where in the frame it was met, in bytes.
struct FrameError {
  FrameFault fault;
  std::size_t offset = 0;
};

template <typename T>
using FrameResult = tl::expected<T, FrameError>;

/// An IP packet, or a fragment of one. `payload` points into the frame.
struct IpPacket {
  struct Fragment {
    std::uint32_t id = 0;
    std::uint32_t offset = 0;  ///< in bytes
    bool more = false;
  };

  IpAddress from;
  IpAddress to;
  std::uint8_t protocol = 0;  ///< 6 is TCP, 17 UDP
  ByteView payload;           ///< behind all IP headers, without padding of the link layer
  std::size_t missing = 0;    ///< bytes that the recorder cut off behind `payload`
  std::size_t offset = 0;     ///< where `payload` begins in the frame
  std::optional<Fragment> fragment;
};

/// Finds the IP packet of a frame, through VLAN tags and extension headers.
/// @return nothing when the frame carries no IP.
[[nodiscard]] FrameResult<std::optional<IpPacket>> find_ip(const Frame& frame) noexcept;

struct UdpDatagram {
  std::uint16_t from_port = 0;
  std::uint16_t to_port = 0;
  ByteView payload;
  std::size_t missing = 0;  ///< bytes that the recorder cut off behind `payload`
};

/// The checksum is not looked at: recorders on the sending host see it before the hardware fills it in.
[[nodiscard]] FrameResult<UdpDatagram> parse_udp(const IpPacket& packet) noexcept;

struct TcpSegment {
  std::uint16_t from_port = 0;
  std::uint16_t to_port = 0;
  std::uint32_t sequence = 0;  ///< of the first payload byte, or of the SYN
  bool syn = false;
  bool fin = false;
  bool rst = false;
  ByteView payload;
};

[[nodiscard]] FrameResult<TcpSegment> parse_tcp(const IpPacket& packet) noexcept;

}  // namespace trestle::pcaps
