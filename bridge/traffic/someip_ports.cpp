#include "bridge/traffic/someip_ports.hpp"

#include <algorithm>
#include <array>

#include "someip/wire/bytes.hpp"

namespace trestle::traffic {
namespace {

constexpr std::uint16_t sd_port = 30490;  // [feat_req_someip_658]
/// Name services (DNS, NetBIOS, mDNS, LLMNR): some of their messages look like SOME/IP, for example reverse
/// look-ups of IPv6 addresses.
constexpr std::array<std::uint16_t, 4> never_guessed{53, 137, 5353, 5355};
constexpr std::size_t max_learnt = 65536;

}  // namespace

SomeipPorts::SomeipPorts(const std::vector<std::uint16_t>& always) : always_{always.begin(), always.end()} {
  always_.insert(sd_port);
}

bool SomeipPorts::known(Transport transport, const Endpoint& from, const Endpoint& to) const {
  return always_.contains(from.port) || always_.contains(to.port) || learnt_.contains({transport, to}) ||
         learnt_.contains({transport, from});
}

bool SomeipPorts::may_guess(const Endpoint& from, const Endpoint& to) noexcept {
  return std::ranges::none_of(never_guessed,
                              [&](std::uint16_t port) { return from.port == port || to.port == port; });
}

void SomeipPorts::learn(Transport transport, const Endpoint& endpoint) {
  if (learnt_.size() < max_learnt) {
    learnt_.emplace(transport, endpoint);
  }
}

bool looks_like_header(ByteView bytes, std::uint32_t max_length) noexcept {
  if (bytes.size() < someip::header_bytes) {
    return false;
  }
  constexpr std::uint8_t last_return_code = 0x5e;  // the highest code for applications
  const auto length = someip::load<std::uint32_t>(bytes.data() + 4);
  const auto type = someip::without_tp(someip::MessageType{std::to_integer<std::uint8_t>(bytes[14])});
  const bool type_exists = type == someip::MessageType::request ||
                           type == someip::MessageType::request_no_return ||
                           type == someip::MessageType::notification ||
                           type == someip::MessageType::response || type == someip::MessageType::error;
  return std::to_integer<std::uint8_t>(bytes[12]) == someip::protocol_version && type_exists &&
         std::to_integer<std::uint8_t>(bytes[15]) <= last_return_code && length <= max_length;
}

}  // namespace trestle::traffic
