#include "sd/core/entry_options.hpp"

#include <algorithm>

#include "sd/core/receive_buffer.hpp"
#include "someip/core/guards.hpp"

namespace trestle::sd {
namespace {

bool same_prefix(const IpAddress& a, const IpAddress& b, std::size_t bits) noexcept {
  for (std::size_t i = 0; i < a.bytes.size() && bits > 0; ++i) {
    const std::size_t here = std::min<std::size_t>(bits, 8);
    const unsigned mask = (0xffU << (8 - here)) & 0xffU;
    if (((a.bytes[i] ^ b.bytes[i]) & mask) != 0) {
      return false;
    }
    bits -= here;
  }
  return true;
}

// The address whose host bits are all one.
TRESTLE_ONCE bool is_subnet_broadcast(const IpAddress& address, std::size_t prefix_bits) noexcept {
  if (address.v6 || prefix_bits >= 31) {
    return false;
  }
  const auto number = someip::load<std::uint32_t>(std::as_bytes(std::span{address.bytes}).data());
  const std::uint32_t host_bits = 0xffff'ffffU >> prefix_bits;
  return (number & host_bits) == host_bits;
}

// Stores `value` in `place`; false when a different value is there already.
template <typename T>
TRESTLE_ONCE bool take(std::optional<T>& place, const T& value) noexcept {
  if (!place) {
    place = value;
  }
  return *place == value;
}

std::optional<OptionFault> take_unicast(EntryOptions& found, const EndpointOption& option,
                                        const OptionRules& rules) noexcept {
  const bool tcp = option.transport == Transport::tcp;
  if ((!tcp && option.transport != Transport::udp) || option.endpoint.port == 0 ||
      !rules.allow(option.endpoint.address)) {
    return OptionFault::endpoint;
  }
  return take(tcp ? found.tcp : found.udp, option.endpoint) ? std::nullopt
                                                            : std::optional{OptionFault::conflict};
}

std::optional<OptionFault> take_multicast(EntryOptions& found, const EndpointOption& option) noexcept {
  if (option.transport != Transport::udp || option.endpoint.port == 0 ||
      !option.endpoint.address.is_multicast()) {
    return OptionFault::endpoint;  // [feat_req_someipsd_790]
  }
  return take(found.multicast, option.endpoint) ? std::nullopt : std::optional{OptionFault::conflict};
}

std::optional<OptionFault> take_endpoint(EntryOptions& found, const Option& option, EntryType type,
                                         const OptionRules& rules) noexcept {
  const auto endpoint = EndpointOption::decode(option);
  if (!endpoint) {  // wrong length, or not an endpoint but an option of unknown type
    return endpoint.error() == WireError::bad_option_length ? std::optional{OptionFault::malformed}
                                                            : std::nullopt;
  }
  if (endpoint->endpoint.address.v6 != rules.v6()) {
    return std::nullopt;
  }
  const bool ack = type == EntryType::subscribe_eventgroup_ack;
  if (endpoint->role == EndpointRole::unicast && !ack) {
    return take_unicast(found, *endpoint, rules);
  }
  if (endpoint->role == EndpointRole::multicast && ack) {
    return take_multicast(found, *endpoint);
  }
  return std::nullopt;
}

// An option of a kind that is decoded as a whole. Options that do not fit here (no_room) are not errors.
template <typename Kind>
std::optional<OptionFault> take_decoded(std::optional<Kind>& place, const Option& option) noexcept {
  const auto decoded = Kind::decode(option);
  if (!decoded) {
    return decoded.error() == WireError::bad_option_length ? std::optional{OptionFault::malformed}
                                                           : std::nullopt;
  }
  return take(place, *decoded) ? std::nullopt : std::optional{OptionFault::conflict};
}

std::optional<OptionFault> take_configuration(EntryOptions& found, const Option& option) noexcept {
  ConfigurationCursor cursor{option};
  while (cursor.next()) {
  }
  if (cursor.error()) {
    return OptionFault::malformed;
  }
  if (found.receive_buffer_bytes == 0) {
    found.receive_buffer_bytes = receive_buffer_in(ConfigurationCursor{option});
  }
  return std::nullopt;
}

std::optional<OptionFault> take(EntryOptions& found, const Option& option, EntryType type,
                                const OptionRules& rules) noexcept {
  if (rules.refuses(option)) {
    return OptionFault::unknown;
  }
  if (option.type == OptionType::configuration) {
    return take_configuration(found, option);
  }
  std::optional<OptionFault> fault = take_endpoint(found, option, type, rules);  // no fault for other types
  OfferOptions::for_each(found.offer, [&](auto& place) {
    if (!fault) {
      fault = take_decoded(place, option);
    }
  });
  return fault;
}

}  // namespace

bool OptionRules::allow_own(const std::optional<Endpoint>& endpoint) const noexcept {
  return !endpoint ||
         (endpoint->port != 0 && endpoint->address.v6 == own().v6 && endpoint->address.is_unicast());
}

bool OptionRules::allow(const IpAddress& address) const noexcept {
  if (address.v6 != own().v6 || address == own() || !address.is_unicast()) {
    return false;
  }
  if (settings_.refuse_loopback && address.is_loopback() && !own().is_loopback()) {
    return false;
  }
  if (is_subnet_broadcast(address, 0)) {  // 255.255.255.255
    return false;
  }
  const auto& prefix_bits = settings_.subnet_prefix_bits;
  return !prefix_bits ||
         (same_prefix(address, own(), *prefix_bits) && !is_subnet_broadcast(address, *prefix_bits));
}

bool OptionRules::may_name(const IpAddress& peer, const IpAddress& named) const noexcept {
  if (!guards || !settings_.own_endpoints_only || peer == named) {
    return true;
  }
  const auto* const allowed = settings_.foreign_endpoints;
  return allowed != nullptr && std::ranges::find(*allowed, ForeignEndpoints{peer, named}) != allowed->end();
}

tl::expected<EntryOptions, OptionFault> read_options(const SdMessage& message, const Entry& entry,
                                                     const OptionRules& rules) noexcept {
  tl::expected<EntryOptions, OptionFault> found;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto option = message.option_of(entry, position);
    const auto fault = option ? take(*found, *option, entry.type, rules) : OptionFault::missing;
    if (fault) {
      found = tl::unexpected{*fault};
      break;
    }
  }
  return found;
}

std::optional<Endpoint> sd_endpoint(const SdMessage& message, const OptionRules& rules) noexcept {
  OptionCursor cursor = message.options();
  while (const auto option = cursor.next()) {
    const auto endpoint = EndpointOption::decode(*option);
    if (!endpoint || endpoint->role != EndpointRole::sd || endpoint->endpoint.address.v6 != rules.v6()) {
      continue;
    }
    const bool usable = endpoint->transport == Transport::udp && endpoint->endpoint.port != 0 &&
                        rules.allow(endpoint->endpoint.address);
    return usable ? std::optional{endpoint->endpoint} : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace trestle::sd
