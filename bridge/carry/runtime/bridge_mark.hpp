#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/dds_side.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::carry {

/// What the end of a bridge in DDS says of itself to other bridges, dds::EndpointExtras::bridge: which event
/// or method it is joined with, and at which address of SOME/IP, where each bridge has one of its own. So
/// what a bridge takes from a topic is known when it comes back from SOME/IP.
struct BridgeMark {
  bool to_someip = false;  ///< else from SOME/IP
  IpAddress address;       ///< of the bridge
  someip::ServiceId service{};
  someip::InstanceId instance{};
  someip::MethodId id{};  ///< event or method
  /// Addresses of other bridges: what they bring in is carried on here, `from_bridges`.
  std::vector<IpAddress> from{};
  friend constexpr bool operator==(const BridgeMark&, const BridgeMark&) = default;
};

/// "out,10.0.0.2,4101.0001.8001"; "in,..." from SOME/IP; then perhaps ",10.0.0.1+10.0.0.5", from where.
[[nodiscard]] std::string to_text(const BridgeMark& mark);
/// Nothing: another version's, or no such text.
[[nodiscard]] std::optional<BridgeMark> parse_bridge_mark(std::string_view text);

[[nodiscard]] BridgeMark mark_of(const IpAddress& address, const Route& route);
[[nodiscard]] BridgeMark mark_of(const IpAddress& address, const MethodRoute& method);

/// Whether these ends of two bridges have to do with each other, as one carries on what the other brings in.
[[nodiscard]] bool goes_on(const BridgeMark& ours, std::string_view theirs);
/// Whether a route with our end carries what this writer publishes.
[[nodiscard]] bool is_carried(const BridgeMark& ours, const dds::FoundWriter& writer);

/// At which addresses bridges are that join a topic with the same event or method the other way round: what
/// comes from there was on this topic, what goes there comes back to it.
class Returns {
 public:
  /// @param topic  on the DDS wire.
  /// @param ours  of the own end.
  Returns(std::string topic, const BridgeMark& ours) : topic_{std::move(topic)}, ours_{ours} {}

  /// Looks again if ends of other bridges have come or gone. Cheap if not.
  /// @return whether the addresses are others than before. Those of bridges that carry on what we bring in
  ///         do not count, nor for none(): as a rule they do so into another network.
  bool update(const DdsSide& dds);
  [[nodiscard]] bool has(const IpAddress& address) const;
  [[nodiscard]] bool none() const noexcept { return unwanted_.empty(); }

 private:
  const std::string topic_;
  const BridgeMark ours_;
  std::uint64_t seen_ = 0;
  std::vector<IpAddress> addresses_;  ///< sorted
  std::vector<IpAddress> unwanted_;   ///< of those, sorted
};

}  // namespace trestle::carry
