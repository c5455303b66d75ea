#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// SOME/IP, service discovery and segments as the figures of the Open SOME/IP Specification show them, byte
/// by byte. Slow, and all the more plain. It shares nothing with someip/ and sd/, so that a mistake of theirs
/// cannot hide here.
namespace trestle::fuzz::plain {

using Octets = std::vector<std::uint8_t>;

inline std::uint32_t number(const Octets& from, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    value = value * 256 + from.at(at + i);
  }
  return value;
}
inline Octets part(const Octets& of, std::size_t at, std::size_t count) {
  Octets some;
  for (std::size_t i = 0; i < count; ++i) {
    some.push_back(of.at(at + i));
  }
  return some;
}

// --- Messages ---------------------------------------------------------------------------------------------

struct PlainMessage {
  std::uint32_t service = 0, method = 0, client = 0, session = 0;
  std::uint32_t protocol = 0, interface_version = 0, type = 0, return_code = 0;
  Octets payload;
};

/// The messages of a datagram, and where that ends which could be read.  [feat_req_someip_45]
/// [feat_req_someip_702]
struct PlainDatagram {
  std::vector<PlainMessage> messages;
  std::size_t end = 0;
};

inline PlainDatagram read_datagram(const Octets& all) {
  PlainDatagram datagram;
  while (all.size() - datagram.end >= 16) {
    const std::size_t at = datagram.end;
    // Length counts from the Request ID on.  [feat_req_someip_77]
    const std::uint64_t length = number(all, at + 4, 4);
    if (length < 8 || at + 8 + length > all.size()) {
      break;
    }
    datagram.messages.push_back({.service = number(all, at, 2),
                                 .method = number(all, at + 2, 2),
                                 .client = number(all, at + 8, 2),
                                 .session = number(all, at + 10, 2),
                                 .protocol = number(all, at + 12, 1),
                                 .interface_version = number(all, at + 13, 1),
                                 .type = number(all, at + 14, 1),
                                 .return_code = number(all, at + 15, 1),
                                 .payload = part(all, at + 16, static_cast<std::size_t>(length) - 8)});
    datagram.end = at + 8 + static_cast<std::size_t>(length);
  }
  return datagram;
}

inline bool is_sd(const PlainMessage& message) {
  // [feat_req_someipsd_26]
  return message.service == 0xffff && message.method == 0x8100 && message.protocol == 1 &&
         message.interface_version == 1 && message.type == 2;
}

// --- Segments ---------------------------------------------------------------------------------------------

struct PlainSegment {
  std::uint32_t offset = 0;  ///< in bytes
  bool more = false;
  Octets slice;
};

/// Offset in 28 bits that count 16 bytes each, three reserved bits, More Segments. Where more follow, a
/// segment has a multiple of 16 bytes.  [feat_req_someiptp_766] [feat_req_someiptp_772]
inline std::optional<PlainSegment> read_segment(const PlainMessage& message) {
  const bool has_flag = message.type / 0x20 % 2 == 1;
  if (!has_flag || message.payload.size() < 4) {
    return std::nullopt;
  }
  const std::uint32_t word = number(message.payload, 0, 4);
  if (word % 2 == 1 && (message.payload.size() - 4) % 16 != 0) {
    return std::nullopt;
  }
  return PlainSegment{.offset = word / 16 * 16,
                      .more = word % 2 == 1,
                      .slice = part(message.payload, 4, message.payload.size() - 4)};
}

// --- Service discovery ------------------------------------------------------------------------------------

struct PlainOption {
  std::uint32_t type = 0;
  Octets body;  ///< from the reserved byte on
};

struct PlainEntry {
  std::uint32_t type = 0, first_index = 0, second_index = 0, first_count = 0, second_count = 0;
  std::uint32_t service = 0, instance = 0, major = 0, ttl = 0, tail = 0;
};

struct PlainDiscovery {
  std::uint32_t flags = 0, reserved = 0;
  std::vector<PlainEntry> entries;
  std::vector<PlainOption> options;
  bool options_are_whole = true;  ///< none of them is longer than what is left of the array
  Octets trailing;
};

/// [feat_req_someipsd_44]
inline std::optional<PlainDiscovery> read_discovery(const Octets& payload) {
  if (payload.size() < 8) {
    return std::nullopt;
  }
  PlainDiscovery all{.flags = number(payload, 0, 1), .reserved = number(payload, 1, 3)};
  const std::uint64_t entries_bytes = number(payload, 4, 4);
  if (entries_bytes % 16 != 0 || 8 + entries_bytes + 4 > payload.size()) {
    return std::nullopt;
  }
  for (std::size_t at = 8; at < 8 + entries_bytes; at += 16) {
    all.entries.push_back({.type = number(payload, at, 1),
                           .first_index = number(payload, at + 1, 1),
                           .second_index = number(payload, at + 2, 1),
                           .first_count = number(payload, at + 3, 1) / 16,
                           .second_count = number(payload, at + 3, 1) % 16,
                           .service = number(payload, at + 4, 2),
                           .instance = number(payload, at + 6, 2),
                           .major = number(payload, at + 8, 1),
                           .ttl = number(payload, at + 9, 3),
                           .tail = number(payload, at + 12, 4)});
  }
  std::size_t at = 8 + static_cast<std::size_t>(entries_bytes);
  const std::uint64_t options_bytes = number(payload, at, 4);
  at += 4;
  if (at + options_bytes > payload.size() || options_bytes > 0xffff) {
    return std::nullopt;
  }
  const std::size_t end = at + static_cast<std::size_t>(options_bytes);
  all.trailing = part(payload, end, payload.size() - end);
  while (at < end) {
    // The length does not count itself and the type.  [feat_req_someipsd_133]
    if (end - at < 3 || end - at - 3 < number(payload, at, 2)) {
      all.options_are_whole = false;
      break;
    }
    const std::size_t length = number(payload, at, 2);
    all.options.push_back({.type = number(payload, at + 2, 1), .body = part(payload, at + 3, length)});
    at += 3 + length;
  }
  return all;
}

/// The places of the options that an entry refers to, those of the first run first.  [feat_req_someipsd_342]
inline std::vector<std::size_t> references(const PlainEntry& entry) {
  std::vector<std::size_t> all;
  for (std::uint32_t i = 0; i < entry.first_count; ++i) {
    all.push_back(entry.first_index + i);
  }
  for (std::uint32_t i = 0; i < entry.second_count; ++i) {
    all.push_back(entry.second_index + i);
  }
  return all;
}

/// Key and value; no value: there is no '='.
using PlainItem = std::pair<std::string, std::optional<std::string>>;

/// The items of a configuration option as DNS writes them; nothing: it is none.  [feat_req_someipsd_158]
inline std::optional<std::vector<PlainItem>> read_configuration(const Octets& body) {
  std::vector<PlainItem> items;
  std::size_t at = 1;
  while (at < body.size() && body.at(at) != 0) {
    const std::size_t length = body.at(at);
    if (at + 1 + length > body.size()) {
      return std::nullopt;
    }
    PlainItem item;
    bool is_printable = true;
    bool is_blank = true;
    for (std::size_t i = at + 1; i < at + 1 + length; ++i) {
      const char character = static_cast<char>(body.at(i));
      if (item.second) {
        *item.second += character;
      } else if (character == '=') {
        item.second.emplace();
      } else {
        item.first += character;
        is_printable = is_printable && body.at(i) >= 0x20 && body.at(i) <= 0x7e;
        is_blank = is_blank && character == ' ';
      }
    }
    if (!is_printable || is_blank) {
      return std::nullopt;
    }
    items.push_back(std::move(item));
    at += 1 + length;
  }
  if (at + 1 != body.size()) {
    return std::nullopt;  // without an end mark, or with something behind it
  }
  return items;
}

/// An endpoint, a multicast or an SD endpoint option, over either family.
struct PlainEndpoint {
  Octets address;
  std::uint32_t protocol = 0, port = 0;
  char role = 'u';  ///< unicast, multicast, service discovery
};

inline std::optional<PlainEndpoint> read_endpoint(const PlainOption& option) {
  const std::array<std::pair<std::uint32_t, char>, 6> kinds{
      {{0x04, 'u'}, {0x06, 'u'}, {0x14, 'm'}, {0x16, 'm'}, {0x24, 's'}, {0x26, 's'}}};
  for (const auto& [type, role] : kinds) {
    const std::size_t bytes = type % 16 == 6 ? 16 : 4;
    if (option.type == type && option.body.size() == 1 + bytes + 4) {
      return PlainEndpoint{.address = part(option.body, 1, bytes),
                           .protocol = number(option.body, 1 + bytes + 1, 1),
                           .port = number(option.body, 1 + bytes + 2, 2),
                           .role = role};
    }
  }
  return std::nullopt;
}

/// Whether an option is as the specification has it; what it does not know is.
inline bool is_good(const PlainOption& option) {
  switch (option.type) {
    case 0x01:
      return read_configuration(option.body).has_value();
    case 0x02:
      return option.body.size() == 5;  // [feat_req_someipsd_174]
    case 0x15:
      return option.body.size() >= 9;  // MAC groupcast
    case 0x04:
    case 0x06:
    case 0x14:
    case 0x16:
    case 0x24:
    case 0x26: {
      const auto endpoint = read_endpoint(option);
      if (!endpoint || endpoint->port == 0) {
        return false;
      }
      const std::uint8_t first = endpoint->address.at(0);
      const bool is_group = endpoint->address.size() == 16 ? first == 0xff : first >= 224 && first <= 239;
      const bool is_udp = endpoint->protocol == 0x11;
      const bool is_tcp = endpoint->protocol == 0x06;
      return is_group == (endpoint->role == 'm') && (is_udp || (is_tcp && endpoint->role == 'u'));
    }
    default:
      return true;
  }
}

/// Whether nothing is wrong in a message.
inline bool is_flawless(const PlainDiscovery& all) {
  bool good = all.options_are_whole;
  for (const PlainEntry& entry : all.entries) {
    good = good && (entry.type == 0 || entry.type == 1 || entry.type == 6 || entry.type == 7);
    for (const std::size_t index : references(entry)) {
      good = good && index < all.options.size();
    }
  }
  for (const PlainOption& option : all.options) {
    good = good && is_good(option);
  }
  return good;
}

}  // namespace trestle::fuzz::plain
