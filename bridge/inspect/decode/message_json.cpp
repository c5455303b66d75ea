#include "bridge/inspect/decode/message_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "someip/wire/bytes.hpp"
#include "someip/wire/return_code_name.hpp"

namespace trestle::inspect {
namespace {

using someip::ByteReader;
using someip::Header;
using someip::MessageType;
using someip::ReturnCode;

constexpr someip::MethodId client_cookie{0x0000};
constexpr someip::MethodId server_cookie{0x8000};

}  // namespace

void add_error(Json& object, const traffic::Violation& violation) {
  Json& error = object["error"];
  error["name"] = violation.name;
  error["rule"] = *violation.rule != '\0' ? Json(violation.rule) : Json(nullptr);
  error["offset"] = violation.offset;
  if (!violation.field.empty()) {
    error["field"] = violation.field;
  }
  error["detail"] = violation.detail;
}

std::string hex_id(std::uint16_t id) {
  return fmt::format("0x{:04x}", id);
}

std::string hex_digits(ByteView bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string result(2 * bytes.size(), '0');
  auto out = result.begin();
  for (const std::byte byte : bytes) {
    *out++ = digits[std::to_integer<std::size_t>(byte >> 4U)];
    *out++ = digits[std::to_integer<std::size_t>(byte & std::byte{15})];
  }
  return result;
}

Json message_type_name(MessageType type) {
  constexpr std::array<std::pair<std::uint8_t, const char*>, 15> names{{{0x00, "REQUEST"},
                                                                        {0x01, "REQUEST_NO_RETURN"},
                                                                        {0x02, "NOTIFICATION"},
                                                                        {0x20, "TP_REQUEST"},
                                                                        {0x21, "TP_REQUEST_NO_RETURN"},
                                                                        {0x22, "TP_NOTIFICATION"},
                                                                        {0x40, "REQUEST ACK"},
                                                                        {0x41, "REQUEST_NO_RETURN ACK"},
                                                                        {0x42, "NOTIFICATION ACK"},
                                                                        {0x80, "RESPONSE"},
                                                                        {0x81, "EXCEPTION"},
                                                                        {0xa0, "TP_RESPONSE"},
                                                                        {0xa1, "TP_EXCEPTION"},
                                                                        {0xc0, "RESPONSE ACK"},
                                                                        {0xc1, "EXCEPTION ACK"}}};
  const auto* const found =
      std::ranges::find(names, static_cast<std::uint8_t>(type), &decltype(names)::value_type::first);
  return found == names.end() ? Json(nullptr) : Json(found->second);
}

Json return_code_name(ReturnCode code) {
  const std::string_view name = name_of(code);
  return name.empty() ? Json(nullptr) : Json(name);
}

void add_header(Json& object, const Header& header, std::size_t payload_bytes) {
  object["service"] = hex_id(value(header.service));
  object["method"] = hex_id(value(header.method));
  object["length"] = someip::length_covered_header_bytes + payload_bytes;
  object["client"] = hex_id(value(header.client));
  object["session"] = hex_id(value(header.session));
  object["protocol_version"] = header.protocol;
  object["interface_version"] = header.interface_version;
  object["message_type"] = message_type_name(header.type);
  object["message_type_value"] = static_cast<std::uint8_t>(header.type);
  object["return_code"] = return_code_name(header.return_code);
  object["return_code_value"] = static_cast<std::uint8_t>(header.return_code);
}

void add_partial_header(Json& object, ByteView bytes) {
  ByteReader in{bytes};
  const auto add = [&](const char* name, auto number) {
    if (!in.failed()) {
      object[name] = number;
    }
  };
  add("service", hex_id(in.u16()));
  add("method", hex_id(in.u16()));
  add("length", in.u32());
  add("client", hex_id(in.u16()));
  add("session", hex_id(in.u16()));
  add("protocol_version", in.u8());
  add("interface_version", in.u8());
  const std::uint8_t type = in.u8();
  add("message_type", message_type_name(MessageType{type}));
  add("message_type_value", type);
  const std::uint8_t code = in.u8();
  add("return_code", return_code_name(ReturnCode{code}));
  add("return_code_value", code);
}

void add_tp(Json& object, const someip::TpHeader& tp) {
  Json& fields = object["tp"];
  fields["offset"] = tp.offset;
  fields["more_segments"] = tp.more;
  fields["reserved"] = tp.reserved;
}

bool is_magic_cookie(const someip::Message& message) noexcept {
  const Header& header = message.header;
  const bool client = header.method == client_cookie && header.type == MessageType::request_no_return;
  const bool server = header.method == server_cookie && header.type == MessageType::notification;
  return header.service == someip::ServiceId{0xffff} && (client || server) && message.payload.empty() &&
         header.client == someip::ClientId{0xdead} && header.session == someip::SessionId{0xbeef} &&
         header.protocol == 1 && header.interface_version == 1 && header.return_code == ReturnCode::ok;
}

void add_magic_cookie(Json& object, const someip::Message& message) {
  if (is_magic_cookie(message)) {
    object["magic_cookie"] = message.header.method == client_cookie ? "client" : "server";
  }
}

}  // namespace trestle::inspect
