#include "sd/wire/option.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "sd/wire/offer_options.hpp"

namespace trestle::sd {
using someip::ByteReader;
using someip::ByteWriter;

namespace {

constexpr std::size_t ipv4_body_bytes = 9;
constexpr std::size_t ipv6_body_bytes = 21;
constexpr std::size_t load_balancing_body_bytes = 5;
constexpr std::size_t mac_groupcast_min_body_bytes = 9;  // reserved byte, address, protocol

// Characters may alias bytes, so this needs no reinterpret_cast.
std::string_view text(ByteView bytes) noexcept {
  return {static_cast<const char*>(static_cast<const void*>(bytes.data())), bytes.size()};
}

ByteView bytes_of(std::string_view characters) noexcept {
  return std::as_bytes(std::span{characters.data(), characters.size()});
}

// Printable ASCII without '=', and not only blanks.  [feat_req_someipsd_162]
TRESTLE_ONCE bool is_key(std::string_view key) noexcept {
  const auto allowed = [](char c) { return c >= 0x20 && c <= 0x7e && c != '='; };
  return std::ranges::all_of(key, allowed) && std::ranges::any_of(key, [](char c) { return c != ' '; });
}

std::optional<EndpointRole> role_of(OptionType type) noexcept {
  switch (type) {
    case OptionType::ipv4_endpoint:
    case OptionType::ipv6_endpoint:
      return EndpointRole::unicast;
    case OptionType::ipv4_multicast:
    case OptionType::ipv6_multicast:
      return EndpointRole::multicast;
    case OptionType::ipv4_sd_endpoint:
    case OptionType::ipv6_sd_endpoint:
      return EndpointRole::sd;
    case OptionType::configuration:
    case OptionType::load_balancing:
    case OptionType::mac_groupcast:
      break;
  }
  return std::nullopt;
}

bool is_v6(OptionType type) noexcept {
  return type == OptionType::ipv6_endpoint || type == OptionType::ipv6_multicast ||
         type == OptionType::ipv6_sd_endpoint;
}

std::optional<WireError> find_fault(const EndpointOption& option) noexcept {
  const bool tcp = option.transport == Transport::tcp;
  const bool udp = option.transport == Transport::udp;
  const bool unicast = option.role == EndpointRole::unicast;
  // Only unicast endpoints may be TCP [feat_req_someipsd_790]; only multicast ones have, and all of them
  // need, a multicast address.  [feat_req_someipsd_102]
  const bool transport_fits = unicast ? tcp || udp : udp;
  const bool address_fits =
      option.endpoint.address.is_multicast() == (option.role == EndpointRole::multicast);
  if (!transport_fits || !address_fits || option.endpoint.port == 0) {
    return WireError::bad_value;
  }
  return std::nullopt;
}

}  // namespace

const char* to_string(OptionType type) noexcept {
  switch (type) {
    case OptionType::configuration:
      return "configuration";
    case OptionType::load_balancing:
      return "load_balancing";
    case OptionType::ipv4_endpoint:
      return "ipv4_endpoint";
    case OptionType::ipv6_endpoint:
      return "ipv6_endpoint";
    case OptionType::ipv4_multicast:
      return "ipv4_multicast";
    case OptionType::mac_groupcast:
      return "mac_groupcast";
    case OptionType::ipv6_multicast:
      return "ipv6_multicast";
    case OptionType::ipv4_sd_endpoint:
      return "ipv4_sd_endpoint";
    case OptionType::ipv6_sd_endpoint:
      return "ipv6_sd_endpoint";
  }
  return "unknown";
}

bool is_known(OptionType type) noexcept {
  bool known = role_of(type) || type == OptionType::configuration;
  for_each_offer_option([&]<typename Kind>() { known = known || type == Kind::option_type; });
  return known;
}

bool operator==(const Option& a, const Option& b) noexcept {
  return a.type == b.type && std::ranges::equal(a.body, b.body);
}

OptionType EndpointOption::type() const noexcept {
  const bool v6 = endpoint.address.v6;
  switch (role) {
    case EndpointRole::unicast:
      return v6 ? OptionType::ipv6_endpoint : OptionType::ipv4_endpoint;
    case EndpointRole::multicast:
      return v6 ? OptionType::ipv6_multicast : OptionType::ipv4_multicast;
    case EndpointRole::sd:
      break;
  }
  return v6 ? OptionType::ipv6_sd_endpoint : OptionType::ipv4_sd_endpoint;
}

OwnedOption EndpointOption::encode() const noexcept {
  OwnedOption option;
  option.type_ = type();
  ByteWriter out{option.body_};
  out.u8(flags);
  const std::size_t address_bytes = endpoint.address.v6 ? 16 : 4;
  out.bytes(std::as_bytes(std::span{endpoint.address.bytes}.first(address_bytes)));
  out.u8(reserved);
  out.u8(static_cast<std::uint8_t>(transport));
  out.u16(endpoint.port);
  option.size_ = static_cast<std::uint8_t>(out.position());
  return option;
}

Result<EndpointOption> EndpointOption::decode(const Option& option) noexcept {
  const auto role = role_of(option.type);
  if (!role) {
    return tl::unexpected{WireError::bad_value};
  }
  const bool v6 = is_v6(option.type);
  if (option.body.size() != (v6 ? ipv6_body_bytes : ipv4_body_bytes)) {
    return tl::unexpected{WireError::bad_option_length};
  }
  ByteReader in{option.body};
  EndpointOption result;
  result.role = *role;
  result.flags = in.u8();
  result.endpoint.address.v6 = v6;
  const ByteView address = in.take(v6 ? 16 : 4);
  std::memcpy(result.endpoint.address.bytes.data(), address.data(), address.size());
  result.reserved = in.u8();
  result.transport = Transport{in.u8()};
  result.endpoint.port = in.u16();
  return result;
}

OwnedOption LoadBalancingOption::encode() const noexcept {
  OwnedOption option;
  option.type_ = option_type;
  ByteWriter out{option.body_};
  out.u8(flags);
  out.u16(priority);
  out.u16(weight);
  option.size_ = static_cast<std::uint8_t>(out.position());
  return option;
}

Result<LoadBalancingOption> LoadBalancingOption::decode(const Option& option) noexcept {
  if (option.type != option_type) {
    return tl::unexpected{WireError::bad_value};
  }
  if (option.body.size() != load_balancing_body_bytes) {
    return tl::unexpected{WireError::bad_option_length};
  }
  ByteReader in{option.body};
  LoadBalancingOption result;
  result.flags = in.u8();
  result.priority = in.u16();
  result.weight = in.u16();
  return result;
}

OwnedOption MacGroupcastOption::encode() const noexcept {
  assert(identifier_bytes <= max_identifier_bytes);
  OwnedOption option;
  option.type_ = option_type;
  ByteWriter out{option.body_};
  out.u8(flags);
  out.bytes(std::as_bytes(std::span{address}));
  out.u16(protocol);
  out.bytes(std::as_bytes(std::span{identifier}.first(identifier_bytes)));
  option.size_ = static_cast<std::uint8_t>(out.position());
  return option;
}

Result<MacGroupcastOption> MacGroupcastOption::decode(const Option& option) noexcept {
  if (option.type != option_type) {
    return tl::unexpected{WireError::bad_value};
  }
  if (option.body.size() < mac_groupcast_min_body_bytes) {
    return tl::unexpected{WireError::bad_option_length};
  }
  ByteReader in{option.body};
  MacGroupcastOption result;
  result.flags = in.u8();
  const ByteView address = in.take(result.address.size());
  std::memcpy(result.address.data(), address.data(), address.size());
  result.protocol = in.u16();
  if (in.rest().size() > max_identifier_bytes) {
    return tl::unexpected{WireError::no_room};
  }
  result.identifier_bytes = static_cast<std::uint8_t>(in.rest().size());
  std::memcpy(result.identifier.data(), in.rest().data(), in.rest().size());
  return result;
}

ConfigurationCursor::ConfigurationCursor(const Option& option) noexcept : body_{option.body} {
  if (body_.empty()) {
    offset_ = 0;
    error_ = WireError::bad_option_length;
  }
}

std::optional<ConfigurationItem> ConfigurationCursor::fail(WireError error) noexcept {
  error_ = error;
  return std::nullopt;
}

std::optional<ConfigurationItem> ConfigurationCursor::next() noexcept {
  if (error_ || ended_) {
    return std::nullopt;
  }
  ByteReader in{body_.subspan(offset_)};
  const std::size_t length = in.u8();
  const ByteView sequence = in.take(length);
  if (in.failed()) {
    return fail(WireError::bad_option_length);
  }
  if (length == 0) {
    if (!in.rest().empty()) {
      return fail(WireError::bad_option_length);  // [feat_req_someipsd_158]
    }
    ended_ = true;
    return std::nullopt;
  }
  const std::string_view characters = text(sequence);
  // Not find() and substr(): they need a C library and code that throws exceptions with formatted texts.
  const auto equals = std::ranges::find(characters, '=');
  ConfigurationItem item{{characters.begin(), equals}, std::nullopt};  // [feat_req_someipsd_160]
  if (equals != characters.end()) {
    item.value = {equals + 1, characters.end()};  // [feat_req_someipsd_157] [feat_req_someipsd_217]
  }
  if (!is_key(item.key)) {
    return fail(WireError::bad_value);
  }
  offset_ += 1 + length;
  return item;
}

Result<Option> encode_configuration(std::span<const ConfigurationItem> items, ByteSpan room) noexcept {
  ByteWriter out{room.first(std::min<std::size_t>(room.size(), 0xffff))};
  out.u8(0);
  for (const ConfigurationItem& item : items) {
    const std::size_t length = item.key.size() + (item.value ? 1 + item.value->size() : 0);
    if (length > 0xff || !is_key(item.key)) {
      return tl::unexpected{WireError::bad_value};
    }
    out.u8(static_cast<std::uint8_t>(length));
    out.bytes(bytes_of(item.key));
    if (item.value) {
      out.u8('=');
      out.bytes(bytes_of(*item.value));
    }
  }
  out.u8(0);
  if (out.failed()) {
    return tl::unexpected{WireError::no_room};
  }
  return Option{OptionType::configuration, out.written()};
}

std::optional<WireError> find_fault(const Option& option) noexcept {
  const auto endpoint = EndpointOption::decode(option);
  if (endpoint) {
    return find_fault(*endpoint);
  }
  if (option.type == OptionType::configuration) {
    ConfigurationCursor cursor{option};
    while (cursor.next()) {
    }
    return cursor.error();
  }
  // Other kinds of options give bad_value, and options for which only we have no room are not wrong.
  std::optional<WireError> fault;
  const auto check = [&](const auto& decoded) {
    if (!decoded && decoded.error() == WireError::bad_option_length) {
      fault = decoded.error();
    }
  };
  check(endpoint);
  for_each_offer_option([&]<typename Kind>() { check(Kind::decode(option)); });
  return fault;
}

}  // namespace trestle::sd
