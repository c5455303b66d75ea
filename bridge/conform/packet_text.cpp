#include "bridge/conform/packet_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "someip/net/address_text.hpp"
#include "someip/wire/return_code_name.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::conform {
namespace {

/// Of a packet, in the text and in full.
constexpr std::size_t short_bytes = 16;
constexpr std::size_t most_bytes = 256;
/// Of a case.
constexpr std::size_t most_lines = 250;
/// In one line.
constexpr std::size_t most_messages = 4;

std::string hex_of(ByteView bytes, std::size_t most) {
  std::string all;
  for (const std::byte one : bytes.first(std::min(bytes.size(), most))) {
    all += fmt::format("{}{:02x}", all.empty() ? "" : " ", std::to_integer<unsigned>(one));
  }
  return all + (bytes.size() > most ? fmt::format(" ... ({} bytes)", bytes.size()) : "");
}

const char* name_of(sd::EntryKind kind) {
  switch (kind) {
    case sd::EntryKind::find_service:
      return "Find";
    case sd::EntryKind::offer_service:
      return "Offer";
    case sd::EntryKind::stop_offer_service:
      return "StopOffer";
    case sd::EntryKind::subscribe_eventgroup:
      return "Subscribe";
    case sd::EntryKind::stop_subscribe_eventgroup:
      return "StopSubscribe";
    case sd::EntryKind::subscribe_eventgroup_ack:
      return "SubscribeAck";
    case sd::EntryKind::subscribe_eventgroup_nack:
      return "SubscribeNack";
    case sd::EntryKind::unknown:
      break;
  }
  return "unknown entry";
}

const char* name_of(someip::MessageType type) {
  switch (someip::without_tp(type)) {
    case someip::MessageType::request:
      return "request";
    case someip::MessageType::request_no_return:
      return "request without return";
    case someip::MessageType::notification:
      return "notification";
    case someip::MessageType::response:
      return "response";
    case someip::MessageType::error:
      return "error";
    default:
      return nullptr;
  }
}

std::string option_text(const sd::Option& option) {
  const auto endpoint = sd::EndpointOption::decode(option);
  if (!endpoint) {
    return fmt::format("{} option", sd::to_string(option.type));
  }
  const auto number = static_cast<unsigned>(endpoint->transport);
  const std::string protocol = endpoint->transport == Transport::udp ? "udp"
                               : endpoint->transport == Transport::tcp
                                   ? "tcp"
                                   : fmt::format("protocol {:#04x}", number);
  const char* role = endpoint->role == sd::EndpointRole::unicast     ? ""
                     : endpoint->role == sd::EndpointRole::multicast ? "multicast "
                                                                     : "sd ";
  return fmt::format("{}{} {}", role, protocol, someip::to_string(endpoint->endpoint));
}

std::string sd_text(const someip::Message& message) {
  const auto decoded = sd::decode(message.payload);
  std::string all = fmt::format("SD session {}", value(message.header.session));
  if (!decoded) {
    return all + ", broken: " + someip::to_string(decoded.error().error);
  }
  all += decoded->reboot() ? " reboot:" : ":";
  for (std::size_t index = 0; index < decoded->entry_count(); ++index) {
    if (index == most_messages) {
      return all + fmt::format("; {} more", decoded->entry_count() - index);
    }
    all += (index == 0 ? " " : "; ") + entry_text(*decoded, decoded->entry(index));
  }
  return decoded->entry_count() == 0 ? all + " no entries" : all;
}

}  // namespace

std::string entry_text(const sd::SdMessage& message, const sd::Entry& entry) {
  const sd::EntryKind kind = entry.kind();
  std::string all =
      fmt::format("{} {:#06x}.{:#06x}", name_of(kind), value(entry.service), value(entry.instance));
  if (kind == sd::EntryKind::unknown) {
    all += fmt::format(" type {:#04x}", static_cast<unsigned>(entry.type));
  } else if (entry.type == sd::EntryType::find_service || entry.type == sd::EntryType::offer_service) {
    all += entry.major == sd::any_major ? " any major" : fmt::format(" v{}", entry.major);
    all += entry.minor() == sd::any_minor ? ", any minor" : fmt::format(".{}", entry.minor());
  } else {
    all += fmt::format(" eventgroup {:#06x}", value(entry.eventgroup()));
    all += entry.counter() == 0 ? "" : fmt::format(" counter {}", entry.counter());
  }
  all += fmt::format(" TTL {}", entry.ttl_s);
  std::string options;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto option = message.option_of(entry, position);
    options += (options.empty() ? "" : ", ") + (option ? option_text(*option) : "option that is not there");
  }
  return options.empty() ? all : all + " [" + options + "]";
}

std::string message_text(const someip::Message& message) {
  const someip::Header& header = message.header;
  if (value(header.service) == 0xffff && value(header.method) == 0x8100) {
    return sd_text(message);
  }
  const char* name = name_of(header.type);
  std::string all =
      name == nullptr ? fmt::format("message type {:#04x}", static_cast<unsigned>(header.type)) : name;
  all += fmt::format(" {:#06x}.{:#06x} client {:#06x} session {}", value(header.service),
                     value(header.method), value(header.client), value(header.session));
  if (header.return_code != someip::ReturnCode::ok) {
    const std::string_view code = someip::name_of(header.return_code);
    all += code.empty() ? fmt::format(" code {:#04x}", static_cast<unsigned>(header.return_code))
                        : fmt::format(" {}", code);
  }
  ByteView payload = message.payload;
  if (const auto segment = someip::is_tp(header.type) ? someip::decode_tp(message)
                                                      : tl::unexpected{someip::WireError::bad_tp_flags}) {
    all += fmt::format(" segment at {}{}", segment->header.offset, segment->header.more ? "" : ", the last");
    payload = segment->slice;
  }
  return all + (payload.empty() ? ", no payload" : ": " + hex_of(payload, short_bytes));
}

std::string packet_text(const Packet& packet) {
  if (packet.ends) {
    return "end of the connection";
  }
  std::string all;
  someip::MessageCursor cursor{packet.bytes};
  for (std::size_t count = 0; const auto message = cursor.next(); ++count) {
    if (count == most_messages) {
      return all + " | more messages";
    }
    all += (all.empty() ? "" : " | ") + message_text(*message);
  }
  if (const auto error = cursor.error()) {
    all += fmt::format("{}{} bytes that are no message ({})", all.empty() ? "" : " | ",
                       packet.bytes.size() - cursor.offset(), someip::to_string(*error));
  }
  return all.empty() ? "empty" : all;
}

Timeline timeline(const std::deque<Packet>& packets) {
  Timeline result;
  for (const Packet& one : packets) {
    if (result.lines.size() >= most_lines && (one.comment.empty() || result.lines.size() >= 2 * most_lines)) {
      ++result.left_out;
      continue;
    }
    result.lines.push_back({.number = one.number,
                            .since_first = one.time - packets.front().time,
                            .sent = one.sent,
                            .transport = one.transport,
                            .from = someip::to_string(one.from),
                            .to = someip::to_string(one.to),
                            .text = packet_text(one),
                            .comment = one.comment,
                            .hex = hex_of(one.bytes, most_bytes)});
  }
  return result;
}

}  // namespace trestle::conform
