#include "net/ip_stack.hpp"

#include <algorithm>
#include <cstring>

#include <trestle/someip/wire/bytes.hpp>

namespace trestle::net {
namespace {

using namespace std::chrono_literals;
using someip::ByteReader;
using someip::ByteWriter;

constexpr std::uint16_t type_ipv4 = 0x0800;
constexpr std::uint16_t type_arp = 0x0806;
constexpr std::uint16_t arp_request = 1;
constexpr std::uint16_t arp_reply = 2;
constexpr std::uint8_t icmp = 1;
constexpr std::uint8_t igmp = 2;
constexpr std::uint8_t udp = 17;
constexpr std::size_t ip_header = 20;
constexpr std::size_t udp_header = 8;
constexpr Mac broadcast{0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
// How long a MAC is believed without a word from its owner.  [RFC 1122 2.3.2.1]
constexpr Duration neighbour_lifetime = 60s;
// [RFC 2236 8.2, 8.10]
constexpr std::uint8_t igmp_repetitions = 1;
constexpr Duration igmp_repetition = 10s;

IpAddress read_address(ByteReader& in) noexcept {
  IpAddress address;
  std::ranges::generate_n(address.bytes.begin(), 4, [&] { return in.u8(); });
  return address;
}

Mac read_mac(ByteReader& in) noexcept {
  Mac mac{};
  std::ranges::generate(mac, [&] { return in.u8(); });
  return mac;
}

void write(ByteWriter& out, const IpAddress& address) noexcept {
  out.bytes(std::as_bytes(std::span{address.bytes}.first<4>()));
}

void write(ByteWriter& out, const Mac& mac) noexcept {
  out.bytes(std::as_bytes(std::span{mac}));
}

std::uint32_t number(const IpAddress& address) noexcept {
  return someip::load<std::uint32_t>(std::as_bytes(std::span{address.bytes}).data());
}

/// Sums 16-bit words for the checksum of the internet protocols; a last odd byte counts as the upper half.
std::uint32_t sum(ByteView bytes, std::uint32_t from = 0) noexcept {
  std::size_t i = 0;
  for (; i + 1 < bytes.size(); i += 2) {
    from += someip::load<std::uint16_t>(bytes.data() + i);
  }
  return i < bytes.size() ? from + std::to_integer<std::uint32_t>(bytes[i]) * 256U : from;
}

/// The checksum for a sum over at most 64 KB; 0 if these bytes contain a correct checksum.
std::uint16_t checksum(std::uint32_t sum) noexcept {
  sum = (sum >> 16U) + (sum & 0xffffU);
  sum = (sum >> 16U) + (sum & 0xffffU);
  return static_cast<std::uint16_t>(~sum);
}

/// The sum of the fields that UDP protects in addition to its own bytes.
std::uint32_t pseudo_header(const IpAddress& from, const IpAddress& to, std::size_t udp_size) noexcept {
  const auto halves = [](std::uint32_t address) { return (address >> 16U) + (address & 0xffffU); };
  return halves(number(from)) + halves(number(to)) + udp + static_cast<std::uint32_t>(udp_size);
}

bool is_broadcast(const IpAddress& address) noexcept {
  return number(address) == 0xffff'ffffU;
}

/// [RFC 1112 6.4]
Mac mac_of_group(const IpAddress& group) noexcept {
  return {0x01,           0x00,          0x5e, static_cast<std::uint8_t>(group.bytes[1] & 0x7fU),
          group.bytes[2], group.bytes[3]};
}

void write_ethernet(ByteWriter& out, const Mac& to, const Mac& from, std::uint16_t type) noexcept {
  write(out, to);
  write(out, from);
  out.u16(type);
}

struct IpFields {
  std::size_t size = 0;  // with the header
  std::uint16_t id = 0;
  std::uint8_t ttl = 0;
  std::uint8_t protocol = 0;
  IpAddress from;
  IpAddress to;
};

void write_ip_header(ByteWriter& out, const IpFields& fields, ByteView options = {}) noexcept {
  const std::size_t begin = out.position();
  out.u8(static_cast<std::uint8_t>(0x45 + options.size() / 4));
  out.u8(0);
  out.u16(static_cast<std::uint16_t>(fields.size));
  out.u16(fields.id);
  out.u16(0x4000);  // not to be fragmented
  out.u8(fields.ttl);
  out.u8(fields.protocol);
  const ByteSpan sum_place = out.reserve(2);
  if (sum_place.empty()) {
    return;  // no room; the caller checks that at the end
  }
  someip::store(sum_place.data(), std::uint16_t{0});
  write(out, fields.from);
  write(out, fields.to);
  out.bytes(options);
  someip::store(sum_place.data(), checksum(sum(out.written().subspan(begin))));
}

}  // namespace

struct IpStack::Packet {
  Mac from_mac{};
  IpAddress from;
  IpAddress to;
  std::uint8_t protocol = 0;
  ByteView payload;
};

IpStack::IpStack(const IpSettings& settings, std::uint64_t seed) noexcept
    : settings_{settings}, random_{seed} {}

Arrival IpStack::drop(Drop reason) noexcept {
  ++dropped_[static_cast<std::size_t>(reason)];
  return {};
}

ByteView IpStack::refuse(Drop reason) noexcept {
  return drop(reason).answer;
}

bool IpStack::is_near(const IpAddress& address) const noexcept {
  return (number(address) ^ number(settings_.address)) >> (32U - settings_.prefix_bits) == 0;
}

bool IpStack::can_send(const IpAddress& address) const noexcept {
  const std::uint32_t host = number(address) << settings_.prefix_bits >> settings_.prefix_bits;
  const bool all_hosts = is_near(address) && (host == 0 || host == ~0U >> settings_.prefix_bits);
  return !address.is_unspecified() && !address.is_multicast() && !is_broadcast(address) && !all_hosts &&
         address.bytes[0] != 127 && address != settings_.address;
}

IpStack::Group* IpStack::group_at(const IpAddress& address) noexcept {
  const auto found = std::ranges::find(groups_, address, &Group::address);
  return found == groups_.end() ? nullptr : &*found;
}

IpStack::Neighbour* IpStack::neighbour_at(const IpAddress& address) noexcept {
  const auto found = std::ranges::find(neighbours_, address, &Neighbour::address);
  return found == neighbours_.end() ? nullptr : &*found;
}

void IpStack::heard_of(const IpAddress& address, const Mac& mac, TimePoint now) noexcept {
  Neighbour* known = neighbour_at(address);
  if (known == nullptr) {
    const auto before = [](const Neighbour& a, const Neighbour& b) {
      return a.address.is_unspecified() != b.address.is_unspecified() ? a.address.is_unspecified()
                                                                      : a.heard < b.heard;
    };
    known = &*std::ranges::min_element(neighbours_, before);
  }
  *known = {address, mac, now};
}

bool IpStack::join(const IpAddress& group, TimePoint now) noexcept {
  if (!group.is_multicast() || group.v6) {
    return false;
  }
  if (group_at(group) != nullptr) {
    return true;
  }
  Group* const free = group_at({});
  if (free == nullptr) {
    return false;
  }
  *free = {group, now, igmp_repetitions};
  return true;
}

Arrival IpStack::on_frame(ByteView frame, ByteSpan room, TimePoint now) noexcept {
  ByteReader in{frame};
  const Mac to = read_mac(in);
  const Mac from = read_mac(in);
  const std::uint16_t type = in.u16();
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  if ((from[0] & 1U) != 0) {
    return drop(Drop::bad_source);
  }
  if (to != settings_.mac && (to[0] & 1U) == 0) {
    return drop(Drop::not_for_us);  // a controller without a filter
  }
  switch (type) {
    case type_arp:
      return on_arp(in.rest(), room, now);
    case type_ipv4:
      return on_ip(in.rest(), from, to, room, now);
    default:
      return drop(Drop::other_type);
  }
}

// [RFC 826]
Arrival IpStack::on_arp(ByteView packet, ByteSpan room, TimePoint now) noexcept {
  ByteReader in{packet};
  const std::uint16_t hardware = in.u16();
  const std::uint16_t protocol = in.u16();
  const std::uint16_t sizes = in.u16();
  const std::uint16_t operation = in.u16();
  const Mac from_mac = read_mac(in);
  const IpAddress from = read_address(in);
  in.skip(6);
  const IpAddress to = read_address(in);
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  const bool known_form = hardware == 1 && protocol == type_ipv4 && sizes == 0x0604;
  if (!known_form || (from_mac[0] & 1U) != 0) {
    return drop(Drop::bad_arp);
  }
  const bool asks_us = operation == arp_request && to == settings_.address;
  if (asks_us && from.is_unspecified()) {  // a probe whether the address is in use  [RFC 5227 2.1.1]
    return {std::nullopt, arp(arp_reply, from_mac, from, room)};
  }
  if (!can_send(from) || !is_near(from)) {
    return drop(Drop::bad_arp);
  }
  if (to != settings_.address) {  // from packets to others, only take corrections of known neighbours
    if (neighbour_at(from) != nullptr) {
      heard_of(from, from_mac, now);
    }
    return {};
  }
  heard_of(from, from_mac, now);
  if (waiting_size_ != 0 && waits_for_ == from) {
    // One frame answers one frame: if this was also a request, it will be repeated.
    if (room.size() < waiting_size_) {
      return drop(Drop::too_large);
    }
    const ByteSpan frame = room.first(waiting_size_);
    std::memcpy(frame.data(), waiting_.data(), frame.size());
    std::memcpy(frame.data(), from_mac.data(), from_mac.size());
    waiting_size_ = 0;
    return {std::nullopt, frame};
  }
  return asks_us ? Arrival{std::nullopt, arp(arp_reply, from_mac, from, room)} : Arrival{};
}

ByteView IpStack::arp(std::uint16_t operation, const Mac& to_mac, const IpAddress& to,
                      ByteSpan room) noexcept {
  ByteWriter out{room};
  write_ethernet(out, operation == arp_request ? broadcast : to_mac, settings_.mac, type_arp);
  out.u16(1);
  out.u16(type_ipv4);
  out.u16(0x0604);
  out.u16(operation);
  write(out, settings_.mac);
  write(out, settings_.address);
  write(out, to_mac);
  write(out, to);
  return out.failed() ? refuse(Drop::too_large) : out.written();
}

// [RFC 791]
Arrival IpStack::on_ip(ByteView bytes, const Mac& from_mac, const Mac& to_mac, ByteSpan room,
                       TimePoint now) noexcept {
  ByteReader in{bytes};
  const std::uint8_t version_and_words = in.u8();
  in.skip(1);
  const std::size_t size = in.u16();
  in.skip(2);
  const std::uint16_t fragment = in.u16();
  in.skip(1);
  const std::uint8_t protocol = in.u8();
  in.skip(2);
  const IpAddress from = read_address(in);
  const IpAddress to = read_address(in);
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  const std::size_t header = (version_and_words & 15U) * 4U;
  if (version_and_words >> 4U != 4 || header < ip_header || size < header || size > bytes.size()) {
    return drop(Drop::bad_ip_header);
  }
  if (checksum(sum(bytes.first(header))) != 0) {
    return drop(Drop::bad_checksum);
  }
  // The MAC has to fit, so that a broadcast frame cannot make all devices of a network answer at once.
  // [RFC 1122 3.3.6]
  const bool by_multicast = group_at(to) != nullptr || (protocol == igmp && to.is_multicast());
  if (to.is_unspecified() ||
      (by_multicast ? to_mac != mac_of_group(to) : to != settings_.address || to_mac != settings_.mac)) {
    return drop(Drop::not_for_us);
  }
  const bool may_be_unspecified = protocol == igmp;  // queries of switches that have no address
  if (!can_send(from) && !(may_be_unspecified && from.is_unspecified())) {
    return drop(Drop::bad_source);
  }
  if ((fragment & 0x3fffU) != 0) {
    return drop(Drop::fragment);
  }
  const Packet packet{from_mac, from, to, protocol, bytes.first(size).subspan(header)};
  switch (protocol) {
    case udp:
      return on_udp(packet, now);
    case icmp:
      return on_echo_request(packet, room);
    case igmp:
      return on_igmp(packet, now);
    default:
      return drop(Drop::other_protocol);
  }
}

// [RFC 768]
Arrival IpStack::on_udp(const Packet& packet, TimePoint now) noexcept {
  ByteReader in{packet.payload};
  const std::uint16_t from_port = in.u16();
  const std::uint16_t to_port = in.u16();
  const std::size_t size = in.u16();
  const std::uint16_t sent_checksum = in.u16();
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  if (size < udp_header || size > packet.payload.size()) {
    return drop(Drop::bad_udp_length);
  }
  const ByteView datagram = packet.payload.first(size);
  if (sent_checksum != 0 && checksum(sum(datagram, pseudo_header(packet.from, packet.to, size))) != 0) {
    return drop(Drop::bad_checksum);
  }
  if (is_near(packet.from)) {
    heard_of(packet.from, packet.from_mac, now);  // an answer will not need to ask for it
  }
  return {UdpDatagram{{packet.from, from_port}, {packet.to, to_port}, datagram.subspan(udp_header)}, {}};
}

// [RFC 792]
Arrival IpStack::on_echo_request(const Packet& packet, ByteSpan room) noexcept {
  ByteReader in{packet.payload};
  const std::uint16_t type_and_code = in.u16();
  in.skip(2);
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  if (type_and_code != 0x0800 || packet.to != settings_.address) {
    return drop(Drop::other_icmp);
  }
  if (checksum(sum(packet.payload)) != 0) {
    return drop(Drop::bad_checksum);
  }
  ByteWriter out{room};
  write_ethernet(out, packet.from_mac, settings_.mac, type_ipv4);
  write_ip_header(out,
                  {ip_header + packet.payload.size(), next_id_++, 64, icmp, settings_.address, packet.from});
  out.u16(0);
  out.u16(checksum(sum(in.rest())));
  out.bytes(in.rest());
  return out.failed() ? drop(Drop::too_large) : Arrival{std::nullopt, out.written()};
}

// [RFC 2236]
Arrival IpStack::on_igmp(const Packet& packet, TimePoint now) noexcept {
  ByteReader in{packet.payload};
  const std::uint8_t type = in.u8();
  const std::uint8_t max_response = in.u8();  // in tenths of a second
  in.skip(2);
  const IpAddress group = read_address(in);
  if (in.failed()) {
    return drop(Drop::truncated);
  }
  if (checksum(sum(packet.payload)) != 0) {
    return drop(Drop::bad_checksum);
  }
  switch (type) {
    case 0x11: {
      // 0 is a query of IGMPv1, which means 10 s. Values above 127 have an exponent in IGMPv3; we use the
      // smallest of these times.
      const Duration longest = 100ms * (max_response == 0 ? 100 : std::min<int>(max_response, 128));
      for (Group& joined : groups_) {
        if (joined.address.is_unspecified() || (!group.is_unspecified() && group != joined.address)) {
          continue;
        }
        const TimePoint due = now + random_.between({}, longest);
        joined.report_due = std::min(joined.report_due.value_or(due), due);
      }
      return {};
    }
    case 0x12:
    case 0x16:
      if (Group* const joined = group_at(group); joined != nullptr && group.is_multicast()) {
        joined->report_due.reset();  // another member has reported the group
        joined->repetitions = 0;
      }
      return {};
    case 0x17:  // somebody leaves
    case 0x22:  // a report of IGMPv3
      return {};
    default:
      return drop(Drop::bad_igmp);
  }
}

ByteView IpStack::report(const IpAddress& group, ByteSpan room) noexcept {
  constexpr std::array router_alert{std::byte{0x94}, std::byte{4}, std::byte{0}, std::byte{0}};
  std::array<std::byte, 8> message{};
  ByteWriter body{message};
  body.u16(0x1600);
  body.u16(0);
  write(body, group);
  someip::store(message.data() + 2, checksum(sum(message)));

  ByteWriter out{room};
  write_ethernet(out, mac_of_group(group), settings_.mac, type_ipv4);
  write_ip_header(
      out, {ip_header + router_alert.size() + message.size(), next_id_++, 1, igmp, settings_.address, group},
      router_alert);
  out.bytes(message);
  return out.failed() ? refuse(Drop::too_large) : out.written();
}

ByteView IpStack::send(std::uint16_t from_port, const Endpoint& to, ByteView payload, ByteSpan room,
                       TimePoint now) noexcept {
  if (payload.size() > max_payload || room.size() < headers + payload.size()) {
    return refuse(Drop::too_large);
  }
  const bool to_group = to.address.is_multicast();
  const IpAddress next_hop = to_group || is_near(to.address) ? to.address : settings_.gateway;
  if (to.address.v6 || (!to_group && (!can_send(to.address) || next_hop.is_unspecified()))) {
    return refuse(Drop::no_route);
  }
  const Neighbour* const known = to_group ? nullptr : neighbour_at(next_hop);
  const bool reachable = to_group || (known != nullptr && now < known->heard + neighbour_lifetime);

  // The payload first: it may already lie in `room`, behind the headers.
  if (!payload.empty()) {
    std::memmove(room.data() + headers, payload.data(), payload.size());
  }
  const std::size_t udp_size = udp_header + payload.size();
  ByteWriter out{room};
  write_ethernet(out,
                 to_group    ? mac_of_group(to.address)
                 : reachable ? known->mac
                             : Mac{},
                 settings_.mac, type_ipv4);
  const std::uint8_t ttl = to_group ? settings_.multicast_ttl : 64;
  write_ip_header(out, {ip_header + udp_size, next_id_++, ttl, udp, settings_.address, to.address});
  out.u16(from_port);
  out.u16(to.port);
  out.u16(static_cast<std::uint16_t>(udp_size));
  std::byte* const checksum_place = room.data() + out.position();
  out.u16(0);
  const ByteSpan frame = room.first(headers + payload.size());
  const std::uint16_t right =
      checksum(sum(frame.last(udp_size), pseudo_header(settings_.address, to.address, udp_size)));
  someip::store(checksum_place, right == 0 ? std::uint16_t{0xffff} : right);  // 0 would mean: no checksum
  if (reachable) {
    return frame;
  }
  if (waiting_size_ != 0) {
    drop(Drop::displaced);
  }
  std::memcpy(waiting_.data(), frame.data(), frame.size());
  waiting_size_ = frame.size();
  waits_for_ = next_hop;
  return arp(arp_request, Mac{}, next_hop, room);
}

ByteView IpStack::on_time(ByteSpan room, TimePoint now) noexcept {
  if (!announced_) {
    announced_ = true;  // neighbours that knew another device here learn its MAC  [RFC 5227 3]
    return arp(arp_request, Mac{}, settings_.address, room);
  }
  for (Group& group : groups_) {
    if (!group.report_due || now < *group.report_due) {
      continue;
    }
    group.report_due.reset();
    if (group.repetitions > 0) {
      --group.repetitions;
      group.report_due = now + igmp_repetition;
    }
    return report(group.address, room);
  }
  return {};
}

std::optional<TimePoint> IpStack::deadline() const noexcept {
  if (!announced_) {
    return TimePoint{};
  }
  std::optional<TimePoint> first;
  for (const Group& group : groups_) {
    if (group.report_due && (!first || *group.report_due < *first)) {
      first = group.report_due;
    }
  }
  return first;
}

}  // namespace trestle::net
