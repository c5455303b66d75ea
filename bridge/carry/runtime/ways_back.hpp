#pragma once
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/dds_side.hpp"
#include "sd/core/events.hpp"

namespace trestle::carry {

/// Knows when enough is known of a service that another bridge of our DDS domain offers:
/// sd::NodeConfig::is_way_back_known. That is when each of its events and methods that we bring into DDS has
/// its end there found, from which the other bridge takes it. The routes then see for themselves whether they
/// would bring it back: Returns.
class WaysBack {
 public:
  explicit WaysBack(const BridgeConfig& config);

  [[nodiscard]] bool are_known(const DdsSide& dds, const sd::RemoteService& service);

 private:
  /// An event or method, and whether it is a writer in DDS by which a bridge goes on with it.
  using End = std::pair<someip::MethodId, bool>;
  using Service = std::pair<someip::ServiceId, someip::InstanceId>;

  void look(const DdsSide& dds);

  std::map<Service, std::vector<End>> ours_;  ///< what we bring into DDS
  std::set<std::tuple<IpAddress, Service, End>> theirs_;
  std::uint64_t seen_ = 0;  ///< DdsSide::bridge_changes(), of `theirs_`
};

}  // namespace trestle::carry
