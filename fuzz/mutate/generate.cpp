#include "fuzz/mutate/generate.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "someip/wire/bytes.hpp"

namespace trestle::fuzz {
namespace {

template <typename T>
void append(Bytes& to, T number) {
  const std::size_t at = to.size();
  to.resize(at + sizeof(T));
  someip::store<T>(to.data() + at, number);
}

void append_bytes(Bytes& to, std::span<const std::byte> more) {
  const std::size_t at = to.size();
  to.resize(at + more.size());
  std::ranges::copy(more, to.data() + at);
}

/// The header of a message, whose Length repair_lengths() sets.
Bytes header(std::uint32_t message_id, std::uint32_t request_id, std::uint32_t last_word) {
  Bytes message;
  append<std::uint32_t>(message, message_id);
  append<std::uint32_t>(message, 8);
  append<std::uint32_t>(message, request_id);
  append<std::uint32_t>(message, last_word);
  return message;
}

Bytes endpoint_option(const Endpoint& endpoint, Transport transport) {
  const bool v6 = endpoint.address.v6;
  Bytes option;
  append<std::uint16_t>(option, v6 ? 21 : 9);
  append<std::uint8_t>(option, v6 ? 0x06 : 0x04);
  append<std::uint8_t>(option, 0);
  append_bytes(option, std::as_bytes(std::span{endpoint.address.bytes}).first(v6 ? 16 : 4));
  append<std::uint8_t>(option, 0);
  append<std::uint8_t>(option, static_cast<std::uint8_t>(transport));
  append<std::uint16_t>(option, endpoint.port);
  return option;
}

/// "\3a=1\0"
Bytes configuration_option(Random& random) {
  Bytes items;
  for (std::size_t count = random.below(4); count > 0; --count) {
    const std::size_t size = 1 + random.below(12);
    append<std::uint8_t>(items, static_cast<std::uint8_t>(size));
    for (std::size_t at = 0; at < size; ++at) {
      append<std::uint8_t>(items,
                           at == 1 ? std::uint8_t{'='} : static_cast<std::uint8_t>('a' + random.below(26)));
    }
  }
  append<std::uint8_t>(items, 0);
  Bytes option;
  append<std::uint16_t>(option, static_cast<std::uint16_t>(items.size() + 1));
  append<std::uint8_t>(option, 0x01);
  append<std::uint8_t>(option, 0);
  append_bytes(option, items);
  return option;
}

struct EntryPlan {
  std::uint8_t type = 0;
  std::uint8_t options = 0;  ///< from the first on
  std::uint32_t ttl_s = 0;
  std::uint32_t tail = 0;
};

Bytes entry_of(const KnownService& service, const EntryPlan& plan) {
  Bytes entry;
  append<std::uint8_t>(entry, plan.type);
  append<std::uint16_t>(entry, 0);
  append<std::uint8_t>(entry, static_cast<std::uint8_t>(plan.options << 4U));
  append<std::uint16_t>(entry, service.service);
  append<std::uint16_t>(entry, service.instance);
  append<std::uint32_t>(entry, std::uint32_t{service.major} << 24U | plan.ttl_s);
  append<std::uint32_t>(entry, plan.tail);
  return entry;
}

Bytes discovery(const std::vector<Bytes>& entries, const std::vector<Bytes>& options, std::uint8_t flags) {
  Bytes message = header(0xffff'8100, 1, 0x0101'0200);
  append<std::uint32_t>(message, std::uint32_t{flags} << 24U);
  for (const std::vector<Bytes>* array : {&entries, &options}) {
    std::size_t size = 0;
    for (const Bytes& one : *array) {
      size += one.size();
    }
    append<std::uint32_t>(message, static_cast<std::uint32_t>(size));
    for (const Bytes& one : *array) {
      append_bytes(message, one);
    }
  }
  repair_lengths(message);
  return message;
}

/// Any bytes: mostly few, as a method's parameters are.
void append_any(Bytes& message, std::size_t max_payload, Random& random) {
  const std::size_t most = random.chance(80) ? std::min<std::size_t>(max_payload, 32) : max_payload;
  for (std::size_t count = random.below(most + 1); count > 0; --count) {
    append<std::uint8_t>(message,
                         static_cast<std::uint8_t>(random.chance(50) ? random.below(16) : random.next()));
  }
}

Bytes header_of(const KnownService& service, std::uint16_t id, std::uint32_t type, Random& random) {
  constexpr std::uint32_t client = 0x5a02;
  const bool is_event = type == 0x02;
  return header(std::uint32_t{service.service} << 16U | id,
                (is_event ? 0 : client << 16U) | static_cast<std::uint16_t>(random.next()),
                0x0100'0000U | std::uint32_t{service.major} << 16U | type << 8U);
}

Bytes message_of(const KnownService& service, std::uint16_t id, std::uint32_t type, std::size_t max_payload,
                 Random& random) {
  Bytes message = header_of(service, id, type, random);
  const auto known = service.payloads.find(id);
  if (known == service.payloads.end() || random.chance(10)) {
    append_any(message, max_payload, random);
  } else {
    append_bytes(message, make_payload(known->second, max_payload, random));
  }
  repair_lengths(message);
  return message;
}

/// One of the ids, most often one whose payload is known; sometimes any from `first` on.
std::uint16_t any_of(const KnownService& service, const std::vector<std::uint16_t>& ids, std::size_t first,
                     Random& random) {
  if (ids.empty() || random.chance(10)) {
    return static_cast<std::uint16_t>(first + random.below(0x100));
  }
  std::uint16_t id = random.pick(ids);
  for (int tries = 0; tries < 3 && !service.payloads.contains(id) && !service.payloads.empty(); ++tries) {
    id = random.pick(ids);
  }
  return id;
}

constexpr std::uint8_t reboot_and_unicast = 0xc0;

}  // namespace

Bytes make_request(const KnownService& service, std::size_t max_payload, Random& random) {
  const std::uint16_t method = any_of(service, service.methods, 0, random);
  return message_of(service, method, random.chance(85) ? 0x00 : 0x01, max_payload, random);
}

std::vector<Bytes> make_spoilt_requests(const KnownService& service, std::size_t max_payload,
                                        Random& random) {
  std::vector<Bytes> all;
  for (const std::uint16_t method : service.methods) {
    const auto known = service.payloads.find(method);
    if (known == service.payloads.end()) {
      continue;
    }
    for (const Bytes& payload : make_spoilt_payloads(known->second, max_payload, random)) {
      Bytes message = header_of(service, method, 0x00, random);
      append_bytes(message, payload);
      repair_lengths(message);
      all.push_back(std::move(message));
    }
  }
  return all;
}

Bytes make_notification(const KnownService& service, std::size_t max_payload, Random& random) {
  const std::uint16_t event = any_of(service, service.events, 0x8000, random);
  return message_of(service, event, 0x02, max_payload, random);
}

bool mutate_typed(Bytes& message, const KnownService& service, std::size_t max_size, Random& random) {
  constexpr std::size_t header_bytes = 16;
  constexpr std::byte segmented{0x20};
  if (message.size() < header_bytes || max_size < header_bytes ||
      someip::load<std::uint16_t>(message.data()) != service.service ||
      (message[14] & segmented) != std::byte{}) {
    return false;
  }
  const auto known = service.payloads.find(someip::load<std::uint16_t>(message.data() + 2));
  if (known == service.payloads.end()) {
    return false;
  }
  Bytes payload{message.begin() + header_bytes, message.end()};
  mutate_payload(payload, known->second, max_size - header_bytes, random);
  message.resize(header_bytes);
  append_bytes(message, payload);
  repair_lengths(message);
  return true;
}

Bytes make_discovery(const KnownService& service, const Endpoint& own, Random& random) {
  constexpr std::array<std::uint32_t, 5> times{0, 1, 3, 30, 0x00ff'ffff};
  std::vector<Bytes> options{endpoint_option(own, random.chance(80) ? Transport::udp : Transport::tcp)};
  if (random.chance(20)) {
    options.push_back(configuration_option(random));
  }
  const auto all_options = static_cast<std::uint8_t>(options.size());
  std::vector<Bytes> entries;
  const std::size_t count = random.chance(75) ? 1 : 1 + random.below(6);
  while (entries.size() < count) {
    const std::uint32_t ttl_s = random.pick(times);
    const auto eventgroup = service.eventgroups.empty() ? std::uint16_t{1} : random.pick(service.eventgroups);
    switch (random.below(8)) {
      case 0:
      case 1:
        entries.push_back(entry_of(service, {.type = 0x00, .ttl_s = ttl_s, .tail = 0xffff'ffff}));
        break;
      case 2:
        entries.push_back(
            entry_of(service, {.type = 0x01, .options = all_options, .ttl_s = ttl_s, .tail = service.minor}));
        break;
      case 3:
        entries.push_back(entry_of(service, {.type = 0x07, .ttl_s = ttl_s, .tail = eventgroup}));
        break;
      default:
        entries.push_back(
            entry_of(service, {.type = 0x06, .options = all_options, .ttl_s = ttl_s, .tail = eventgroup}));
        break;
    }
  }
  return discovery(entries, options, reboot_and_unicast);
}

Bytes make_subscribe(const KnownService& service, std::uint16_t eventgroup, std::uint32_t ttl_s,
                     const Endpoint& own) {
  return discovery({entry_of(service, {.type = 0x06, .options = 1, .ttl_s = ttl_s, .tail = eventgroup})},
                   {endpoint_option(own, Transport::udp)}, reboot_and_unicast);
}

Bytes make_offer(const KnownService& service, std::uint32_t ttl_s, const Endpoint& own) {
  return discovery({entry_of(service, {.type = 0x01, .options = 2, .ttl_s = ttl_s, .tail = service.minor})},
                   {endpoint_option(own, Transport::udp), endpoint_option(own, Transport::tcp)},
                   reboot_and_unicast);
}

std::vector<Bytes> make_segments(const Bytes& request, std::size_t segment) {
  constexpr std::size_t header_bytes = 16;
  const std::size_t step = std::max<std::size_t>(segment / 16 * 16, 16);
  if (request.size() <= header_bytes + step) {
    return {request};
  }
  std::vector<Bytes> segments;
  const std::span payload = std::span{request}.subspan(header_bytes);
  for (std::size_t at = 0; at < payload.size(); at += step) {
    const std::size_t size = std::min(step, payload.size() - at);
    Bytes one{request.begin(), request.begin() + header_bytes};
    one[14] |= std::byte{0x20};
    // The offset counts 16 bytes, and stands four bits to the left: so it is the number of bytes.
    append<std::uint32_t>(one, static_cast<std::uint32_t>(at) | (at + size < payload.size() ? 1U : 0U));
    append_bytes(one, payload.subspan(at, size));
    repair_lengths(one);
    segments.push_back(std::move(one));
  }
  return segments;
}

}  // namespace trestle::fuzz
