#include "bridge/conform/stimulus.hpp"

#include <array>

#include "someip/wire/bytes.hpp"

namespace trestle::conform {

Bytes bytes(std::initializer_list<unsigned> numbers) {
  Bytes all;
  for (const unsigned number : numbers) {
    all.push_back(static_cast<std::byte>(number));
  }
  return all;
}

void append(Bytes& to, ByteView more) {
  to.insert(to.end(), more.begin(), more.end());
}

namespace {
template <typename T>
void append_number(Bytes& to, T number) {
  std::array<std::byte, sizeof(T)> room{};
  someip::store<T>(room.data(), number);
  append(to, room);
}
}  // namespace

void append_u8(Bytes& to, std::uint8_t number) {
  append_number(to, number);
}
void append_u16(Bytes& to, std::uint16_t number) {
  append_number(to, number);
}
void append_u32(Bytes& to, std::uint32_t number) {
  append_number(to, number);
}

Bytes endpoint_option(const Endpoint& endpoint, Transport transport) {
  const bool v6 = endpoint.address.v6;
  Bytes body = bytes({0});
  append(body, std::as_bytes(std::span{endpoint.address.bytes}).first(v6 ? 16 : 4));
  append_u8(body, 0);
  append_u8(body, static_cast<std::uint8_t>(transport));
  append_u16(body, endpoint.port);
  const auto type = v6 ? sd::OptionType::ipv6_endpoint : sd::OptionType::ipv4_endpoint;
  return raw_option(static_cast<std::uint16_t>(body.size()), static_cast<std::uint8_t>(type), body);
}

Bytes raw_option(std::uint16_t length, std::uint8_t type, ByteView body) {
  Bytes option;
  append_u16(option, length);
  append_u8(option, type);
  append(option, body);
  return option;
}

Bytes SdStimulus::encode(someip::SessionId session, bool reboot) const {
  Bytes payload;
  append_u32(payload, (std::uint32_t{flags} | (reboot ? sd::reboot_flag : 0U)) << 24U | reserved);
  append_u32(payload, entries_length.value_or(static_cast<std::uint32_t>(entries.size() * sd::entry_bytes)));
  for (const sd::Entry& entry : entries) {
    std::array<std::byte, sd::entry_bytes> room{};
    sd::encode(entry, room);
    append(payload, room);
  }
  Bytes array;
  for (const Bytes& option : options) {
    append(array, option);
  }
  append_u32(payload, options_length.value_or(static_cast<std::uint32_t>(array.size())));
  append(payload, array);
  append(payload, counted_tail);
  const Call whole{.service = someip::ServiceId{0xffff},
                   .method = method,
                   .payload = payload,
                   .interface_version = 1,
                   .type = someip::MessageType::notification,
                   .client = {},
                   .session = session,
                   .length = length};
  Bytes message = whole.encode();
  append(message, uncounted_tail);
  return message;
}

Bytes Call::encode() const {
  Bytes message;
  append_u16(message, value(service));
  append_u16(message, value(method));
  append_u32(message, length.value_or(static_cast<std::uint32_t>(8 + payload.size())));
  append_u16(message, value(client));
  append_u16(message, value(session));
  append_u8(message, protocol);
  append_u8(message, interface_version);
  append_u8(message, static_cast<std::uint8_t>(type));
  append_u8(message, static_cast<std::uint8_t>(code));
  append(message, payload);
  return message;
}

}  // namespace trestle::conform
