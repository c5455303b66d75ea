#pragma once
#include <array>
#include <optional>

#include <trestle/sd/core/random.hpp>
#include <trestle/someip/wire/endpoint.hpp>
#include <trestle/someip/wire/types.hpp>

namespace trestle::net {

using Mac = std::array<std::uint8_t, 6>;

struct IpSettings {
  Mac mac{};
  IpAddress address;              ///< IPv4, as all addresses here
  std::uint8_t prefix_bits = 24;  ///< 1 to 30: how much of the address names the network
  IpAddress gateway;              ///< where other networks are reached; unspecified: nowhere
  std::uint8_t multicast_ttl = 1;
};

/// A received datagram. `payload` points into the frame that it came in.
struct UdpDatagram {
  Endpoint from;
  Endpoint to;  ///< the own address, or a group that was joined
  ByteView payload;
};

/// Why a frame was dropped, or a datagram not sent; IpStack::dropped() counts them.
enum class Drop : std::uint8_t {
  truncated,      ///< ends before its headers do
  not_for_us,     ///< another's address, or a group that was not joined
  other_type,     ///< neither IPv4 nor ARP
  bad_arp,        ///< not Ethernet and IPv4, or from an address that cannot be a sender's
  bad_ip_header,  ///< version, header length or total length
  bad_source,     ///< an address that cannot be a sender's
  bad_checksum,   ///< of IPv4, UDP, ICMP or IGMP
  fragment,       ///< SOME/IP has segments of its own; nothing here is reassembled
  other_protocol,
  bad_udp_length,
  other_icmp,  ///< not an echo request
  bad_igmp,    ///< not a query or report of IGMP 1 to 3
  no_route,    ///< to another network, without a gateway
  too_large,   ///< to be sent: does not fit one frame, or the room for it
  displaced,   ///< to be sent: its receiver had not told its MAC yet, and another datagram took its place
};
inline constexpr std::size_t drop_reasons = 15;

/// What a frame led to. Both may be empty: it was dropped, or taken note of.
struct Arrival {
  std::optional<UdpDatagram> datagram;
  ByteView answer;  ///< a frame to send: an ARP or echo reply, or the datagram that waited for an ARP reply
};

/// As much of IPv4 over Ethernet as a SOME/IP device needs: UDP, ARP, IGMPv2 and the answer to ping. Like the
/// core of Trestle it does no I/O: it is given frames and the time, and gives frames to send. It allocates
/// nothing; all that peers can make it store is in tables of fixed size.
///
/// Not there: fragments, IPv6, DHCP, detection of address conflicts, ICMP errors.
class IpStack {
 public:
  /// Of an Ethernet frame, without its checksum.
  static constexpr std::size_t max_frame = 1514;
  /// Ethernet, IPv4 and UDP header: where a datagram's payload lies in its frame.
  static constexpr std::size_t headers = 14 + 20 + 8;
  static constexpr std::size_t max_payload = max_frame - headers;
  static constexpr std::size_t max_groups = 4;
  /// Addresses of which the MAC is kept; the one not heard of for longest gives way.
  static constexpr std::size_t max_neighbours = 16;

  /// @param seed  of the random delays of IGMP: another one in each device.
  IpStack(const IpSettings& settings, std::uint64_t seed) noexcept;

  /// Takes datagrams to a multicast group from now on, and has on_time() report it.
  /// @return false when the table is full, or when that is no group.
  [[nodiscard]] bool join(const IpAddress& group, TimePoint now) noexcept;

  /// Takes a frame, without its checksum.
  /// @param room  for the answer: of max_frame bytes, else what does not fit is counted and not answered.
  [[nodiscard]] Arrival on_frame(ByteView frame, ByteSpan room, TimePoint now) noexcept;

  /// The frame that sends `payload`. Where the receiver's MAC is not known it is an ARP request, and the
  /// datagram is kept until the reply comes, or until another one has to wait.  [RFC 1122 2.3.2.2]
  /// @param payload  may lie in `room`, behind the first `headers` bytes: then nothing is copied.
  /// @return empty when it cannot be sent: no_route or too_large.
  [[nodiscard]] ByteView send(std::uint16_t from_port, const Endpoint& to, ByteView payload, ByteSpan room,
                              TimePoint now) noexcept;

  /// The next frame that is due: the announcement of the own address, then membership reports. Call until it
  /// is empty, and again at deadline().
  [[nodiscard]] ByteView on_time(ByteSpan room, TimePoint now) noexcept;
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  [[nodiscard]] std::uint32_t dropped(Drop reason) const noexcept {
    return dropped_[static_cast<std::size_t>(reason)];
  }

 private:
  struct Packet;  // an IPv4 packet's header, and where it came from
  struct Neighbour {
    IpAddress address;  // unspecified: free
    Mac mac{};
    TimePoint heard;
  };
  struct Group {
    IpAddress address;  // unspecified: free
    std::optional<TimePoint> report_due;
    std::uint8_t repetitions = 0;  // of the report, without being asked
  };

  Arrival drop(Drop reason) noexcept;
  ByteView refuse(Drop reason) noexcept;
  Arrival on_arp(ByteView packet, ByteSpan room, TimePoint now) noexcept;
  Arrival on_ip(ByteView bytes, const Mac& from, const Mac& to, ByteSpan room, TimePoint now) noexcept;
  Arrival on_udp(const Packet& packet, TimePoint now) noexcept;
  Arrival on_echo_request(const Packet& packet, ByteSpan room) noexcept;
  Arrival on_igmp(const Packet& packet, TimePoint now) noexcept;

  [[nodiscard]] bool is_near(const IpAddress& address) const noexcept;
  [[nodiscard]] bool can_send(const IpAddress& address) const noexcept;
  [[nodiscard]] Group* group_at(const IpAddress& address) noexcept;
  [[nodiscard]] Neighbour* neighbour_at(const IpAddress& address) noexcept;
  void heard_of(const IpAddress& address, const Mac& mac, TimePoint now) noexcept;
  ByteView arp(std::uint16_t operation, const Mac& to_mac, const IpAddress& to, ByteSpan room) noexcept;
  ByteView report(const IpAddress& group, ByteSpan room) noexcept;

  IpSettings settings_;
  sd::Random random_;
  std::array<Neighbour, max_neighbours> neighbours_{};
  std::array<Group, max_groups> groups_{};
  bool announced_ = false;
  std::uint16_t next_id_ = 0;
  // The datagram that waits for the MAC of `waits_for_`: as a frame that lacks only that.
  std::array<std::byte, max_frame> waiting_{};
  std::size_t waiting_size_ = 0;
  IpAddress waits_for_;
  std::array<std::uint32_t, drop_reasons> dropped_{};
};

}  // namespace trestle::net
