#include "test/bench/floor_sd.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace trestle::floor {
namespace {

constexpr std::uint16_t sd_service = 0xffff;
constexpr std::uint16_t sd_method = 0x8100;
constexpr std::uint16_t sd_port = 30490;
constexpr const char* group = "224.244.224.245";
constexpr std::uint8_t find_entry = 0x00;
constexpr std::uint8_t offer_entry = 0x01;
constexpr std::uint8_t subscribe_entry = 0x06;
constexpr std::uint8_t acknowledge_entry = 0x07;
constexpr std::uint8_t ipv4_endpoint = 0x04;
constexpr std::uint8_t udp = 0x11;
constexpr std::uint8_t notification = 0x02;
constexpr std::size_t entry_bytes = 16;
constexpr std::size_t first_entry = someip_header_bytes + 8;
constexpr unsigned tries = 50;  ///< one each 100 ms

std::vector<std::byte> message(std::uint16_t service, std::uint16_t method, std::uint16_t session,
                               std::uint8_t interface, std::uint8_t type,
                               std::span<const std::byte> payload) {
  std::vector<std::byte> bytes;
  put(bytes, service, 2);
  put(bytes, method, 2);
  put(bytes, payload.size() + 8, 4);
  put(bytes, 0, 2);  // client
  put(bytes, session, 2);
  put(bytes, 1, 1);  // protocol
  put(bytes, interface, 1);
  put(bytes, type, 1);
  put(bytes, 0, 1);  // return code
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

/// Of UDP, in the options from `options` on: from the one with this number so many.
std::optional<sockaddr_in> endpoint_in(std::span<const std::byte> options, std::size_t first,
                                       std::size_t count) {
  std::size_t at = 0;
  for (std::size_t number = 0; at + 12 <= options.size() && number < first + count; ++number) {
    if (number >= first && number_at(options, at + 2, 1) == ipv4_endpoint &&
        number_at(options, at + 9, 1) == udp) {
      sockaddr_in found{};
      found.sin_family = AF_INET;
      found.sin_addr.s_addr = htonl(static_cast<std::uint32_t>(number_at(options, at + 4, 4)));
      found.sin_port = htons(static_cast<std::uint16_t>(number_at(options, at + 10, 2)));
      return found;
    }
    at += 3 + number_at(options, at, 2);
  }
  return std::nullopt;
}

}  // namespace

void put(std::vector<std::byte>& bytes, std::uint64_t number, unsigned count) {
  for (unsigned i = count; i > 0; --i) {
    bytes.push_back(static_cast<std::byte>(number >> (8 * (i - 1))));
  }
}

std::uint64_t number_at(std::span<const std::byte> bytes, std::size_t at, unsigned count) {
  std::uint64_t result = 0;
  for (unsigned i = 0; i < count; ++i) {
    result = result << 8U | std::to_integer<std::uint64_t>(bytes[at + i]);
  }
  return result;
}

std::vector<std::byte> someip_message(const RemoteService& service, std::uint16_t method, std::uint8_t type,
                                      std::span<const std::byte> payload) {
  return message(perf_service, method, 1, service.major, type, payload);
}

Discovery::Discovery(const sockaddr_in& own, const sockaddr_in& server) : server_{server} {
  sockaddr_in at = own;
  at.sin_port = htons(sd_port);
  server_.sin_port = htons(sd_port);
  socket_.bind(at);
  socket_.receive_timeout(100);
  check(setsockopt(socket_.fd(), IPPROTO_IP, IP_MULTICAST_IF, &own.sin_addr, sizeof own.sin_addr),
        "setsockopt");
}

RemoteService Discovery::find() {
  sockaddr_in all{};
  all.sin_family = AF_INET;
  all.sin_port = htons(sd_port);
  inet_pton(AF_INET, group, &all.sin_addr);
  constexpr std::uint16_t any_instance = 0xffff;
  constexpr std::uint8_t any_major = 0xff;
  constexpr std::uint32_t any_minor = 0xffffffff;
  for (unsigned i = 0; i < tries; ++i) {
    send({.type = find_entry, .instance = any_instance, .major = any_major, .ttl_s = 3, .more = any_minor},
         all);
    if (const auto offer = receive(offer_entry); offer && offer->endpoint && offer->ttl_s > 0) {
      return {*offer->endpoint, offer->instance, offer->major};
    }
  }
  std::fputs("trestle_floor: the service is not offered\n", stderr);
  std::_Exit(1);
}

void Discovery::subscribe(const RemoteService& service, std::uint16_t eventgroup,
                          const sockaddr_in& receiver) {
  constexpr std::uint32_t long_enough_s = 600;
  subscribed_ = {.type = subscribe_entry,
                 .instance = service.instance,
                 .major = service.major,
                 .ttl_s = long_enough_s,
                 .more = eventgroup,
                 .endpoint = receiver};
  for (unsigned i = 0; i < tries; ++i) {
    send(*subscribed_, server_);
    if (const auto answer = receive(acknowledge_entry); answer && answer->ttl_s > 0) {
      return;
    }
  }
  std::fputs("trestle_floor: the subscription is not acknowledged\n", stderr);
  std::_Exit(1);
}

void Discovery::unsubscribe() {
  subscribed_->ttl_s = 0;
  send(*subscribed_, server_);
}

void Discovery::send(const Entry& entry, const sockaddr_in& to) {
  std::vector<std::byte> payload;
  put(payload, 0xc0, 1);  // flags: reboot, unicast
  put(payload, 0, 3);
  put(payload, entry_bytes, 4);
  put(payload, entry.type, 1);
  put(payload, 0, 2);                               // first options
  put(payload, entry.endpoint ? 0x10U : 0x00U, 1);  // and how many of them
  put(payload, perf_service, 2);
  put(payload, entry.instance, 2);
  put(payload, entry.major, 1);
  put(payload, entry.ttl_s, 3);
  put(payload, entry.more, 4);
  if (entry.endpoint) {
    put(payload, 12, 4);
    put(payload, 9, 2);
    put(payload, ipv4_endpoint, 1);
    put(payload, 0, 1);
    put(payload, ntohl(entry.endpoint->sin_addr.s_addr), 4);
    put(payload, 0, 1);
    put(payload, udp, 1);
    put(payload, ntohs(entry.endpoint->sin_port), 2);
  } else {
    put(payload, 0, 4);
  }
  const auto bytes = message(sd_service, sd_method, ++session_, 1, notification, payload);
  check(
      sendto(socket_.fd(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
      "sendto");
}

std::optional<Discovery::Entry> Discovery::receive(std::uint8_t type) {
  std::array<std::byte, 65536> room;
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const auto got =
        recvfrom(socket_.fd(), room.data(), room.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (got < 0) {
      return std::nullopt;
    }
    const std::span<const std::byte> bytes{room.data(), static_cast<std::size_t>(got)};
    if (from.sin_addr.s_addr != server_.sin_addr.s_addr || bytes.size() < first_entry + 4) {
      continue;
    }
    const std::size_t end = first_entry + number_at(bytes, first_entry - 4, 4);
    if (end + 4 > bytes.size()) {
      continue;
    }
    for (std::size_t at = first_entry; at + entry_bytes <= end; at += entry_bytes) {
      if (number_at(bytes, at, 1) == type && number_at(bytes, at + 4, 2) == perf_service) {
        return Entry{.type = type,
                     .instance = static_cast<std::uint16_t>(number_at(bytes, at + 6, 2)),
                     .major = static_cast<std::uint8_t>(number_at(bytes, at + 8, 1)),
                     .ttl_s = static_cast<std::uint32_t>(number_at(bytes, at + 9, 3)),
                     .more = static_cast<std::uint32_t>(number_at(bytes, at + 12, 4)),
                     .endpoint = endpoint_in(bytes.subspan(end + 4), number_at(bytes, at + 1, 1),
                                             number_at(bytes, at + 3, 1) >> 4U)};
      }
    }
  }
}

}  // namespace trestle::floor
