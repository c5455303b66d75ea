#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Addresses that begin with the same bits: a host, a subnet, or all of one IP version.
struct Subnet {
  IpAddress address{};           ///< bits behind the prefix count for nothing
  std::uint8_t prefix_bits = 0;  ///< 32 (IPv6: 128): `address` alone

  /// Whether the host is one of them.
  [[nodiscard]] bool has(const IpAddress& host) const noexcept;
  friend constexpr bool operator==(const Subnet&, const Subnet&) = default;
};

/// "192.168.1.0/24", "fd00::/8"; "192.168.1.7" is one host. Nothing when `text` is none of these, or when
/// bits behind the prefix are set: then something else was meant.
[[nodiscard]] std::optional<Subnet> parse_subnet(const std::string& text);
/// As parse_subnet() reads it; a host without prefix length.
[[nodiscard]] std::string to_string(const Subnet& subnet);

/// What a peer does to us.
enum class Access : std::uint8_t {
  offer,      ///< it offers a service, which we could use
  subscribe,  ///< it subscribes to an eventgroup of ours
  call,       ///< it calls a method of ours, or the getter or setter of a field
};

/// The access's name as it stands above.
[[nodiscard]] const char* to_string(Access access) noexcept;

/// That some peers may do something. A list that is empty stands for all, except `peers`.
struct AccessRule {
  std::vector<Access> allow{};                         ///< what they may do
  someip::ServiceId first_service{0x0000};             ///< of a range, both ends included
  someip::ServiceId last_service{0xffff};              ///< likewise
  someip::InstanceId instance = someip::any_instance;  ///< of these services
  std::vector<someip::MethodId> methods{};             ///< of calls; other access has none
  std::vector<someip::EventgroupId> eventgroups{};     ///< of subscriptions; other access has none
  std::vector<Subnet> peers{};                         ///< empty: nobody
};

/// Rules of one origin. What one or several rules are about needs one of them that has the peer. What no rule
/// is about is allowed or not as `allow_others` says.
struct AccessPolicy {
  std::vector<AccessRule> rules{};  ///< in any order
  bool allow_others = true;         ///< what no rule is about
};

/// Who may do what. As it is, everybody may do everything.
///
/// The address of a peer is that of its datagrams, or of its end of a TCP connection. Over UDP it may be
/// forged: see docs/security.md.
struct AccessControl {
  /// Who is heard at all; empty: everybody. Discovery, requests, events and TCP connections of others are
  /// dropped without an answer.
  std::vector<Subnet> peers{};
  /// All of them must allow something.
  std::vector<AccessPolicy> policies{};
  /// Whether a request that is not allowed is answered with ReturnCode::not_ok, so that the client need not
  /// wait for nothing; false: it is dropped. The specification has no code of its own for this case.
  bool answer_calls = true;
};

}  // namespace trestle::sd
