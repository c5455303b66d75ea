#pragma once
#include <unordered_map>

#include "sd/net/node_config.hpp"
#include "sd/net/rare_line.hpp"
#include "sd/net/unproven_receivers.hpp"

namespace trestle::sd {

/// How often something may come from one address, on average in a second and at once. See HashedPlaces.
class PeerRate {
 public:
  /// @param per_second  0: as often as it likes.
  PeerRate(std::uint32_t per_second, std::uint32_t seed);

  /// Whether one more may come now, which then counts.
  /// @param more  of the key, beside the address
  [[nodiscard]] bool take(const IpAddress& from, std::uint64_t more, TimePoint now) noexcept;
  [[nodiscard]] bool is_limited() const noexcept { return free_at_.has_value(); }

 private:
  Duration pause_{0};
  std::optional<HashedPlaces<TimePoint>> free_at_{};  ///< when all would have come, had they come with pauses
};

/// Decides what peers of a Node may do: AccessControl, and the rates that hold for each address. Counts what
/// it refuses, and tells of each kind now and then.
class AccessGuard {
 public:
  /// What access is about.
  struct Subject {
    Access access{};
    someip::ServiceId service{};
    someip::InstanceId instance{};
    std::uint16_t member = 0;  ///< eventgroup or method; of an offer nothing
  };

  AccessGuard(const NodeConfig& config, NodeCounters& counters, DiscoveryLog warn);
  AccessGuard(const AccessGuard&) = delete;
  AccessGuard& operator=(const AccessGuard&) = delete;

  /// Whether datagrams from there are to be looked at.
  [[nodiscard]] bool hears(const IpAddress& from) {
    return control_.peers.empty() || is_peer(from) || not_heard(from);
  }
  /// Whether a TCP connection from there is to be accepted.
  [[nodiscard]] bool accepts(const IpAddress& from);
  /// Whether any entry or request may be refused.
  [[nodiscard]] bool has_policies() const noexcept { return !policies_.empty(); }
  /// Does not tell: it is called where nothing may be thrown; say_what_was_refused() does.
  [[nodiscard]] bool allows(const Subject& subject, const IpAddress& from) noexcept;
  /// Whether one more request may come from there. Over TCP nobody can use up what belongs to others.
  [[nodiscard]] bool takes_request(const IpAddress& from, Transport transport) {
    return !requests_.is_limited() || takes_limited_request(from, transport);
  }
  /// After calls of allows().
  void say_what_was_refused();

 private:
  /// The rules of a policy, where they are found quickly.
  struct Policy {
    std::unordered_map<someip::ServiceId, std::vector<const AccessRule*>> of_service;
    std::vector<const AccessRule*> of_ranges;
    bool allow_others = true;
    [[nodiscard]] bool allows(const Subject& subject, const IpAddress& from) const noexcept;
  };
  /// The last one that was refused in some way, of which no line has told.
  struct Refused {
    Subject subject{};
    IpAddress from{};
    std::uint64_t unsaid = 0;
    RareLine line{};
  };

  [[nodiscard]] bool is_peer(const IpAddress& from) const noexcept;
  bool not_heard(const IpAddress& from);
  [[nodiscard]] bool takes_limited_request(const IpAddress& from, Transport transport);
  [[nodiscard]] std::uint64_t& counter_of(Access access) noexcept;

  const AccessControl& control_;
  NodeCounters& counters_;
  DiscoveryLog warn_;
  std::vector<Policy> policies_;
  std::array<Refused, 3> refused_{};  ///< by Access
  PeerRate requests_;
  PeerRate connections_;
  std::uint32_t max_requests_per_second_;
  std::uint32_t max_tcp_connects_per_second_;
  RareLine not_heard_;
  RareLine too_many_requests_;
  RareLine too_many_connections_;
};

}  // namespace trestle::sd
