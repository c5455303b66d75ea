#pragma once
#include <memory>
#include <vector>

#include "bridge/carry/runtime/running_route.hpp"

namespace trestle::carry {

/// A route, and where it begins in the configuration.
struct MadeRoute {
  documents::Mark mark;
  std::shared_ptr<RunningRoute> route;
};

/// Routes that run, and the services that they offer together: all those of a configuration, or one that was
/// discovered.
class Routes {
 public:
  /// @param config  what cannot be opened is said with its place there; nothing: without. Outlives the
  /// joining.
  explicit Routes(std::vector<MadeRoute> routes, const BridgeConfig* config = nullptr)
      : config_{config}, routes_{std::move(routes)} {}

  /// Offers what they offer, and looks for what they use.  @throws std::runtime_error
  void join_someip(SomeipSide& someip);
  /// Opens their ends in DDS.  @throws std::runtime_error
  void join_dds();
  /// Offers and withdraws, if what the services need has come or gone.
  void update_offers();
  /// Ends the offers now: before the end of routes that end before the node.
  void withdraw();
  /// The node is about to withdraw the offers. Nothing is carried any more.
  void stop();

  [[nodiscard]] auto begin() const noexcept { return routes_.begin(); }
  [[nodiscard]] auto end() const noexcept { return routes_.end(); }

 private:
  const BridgeConfig* config_;
  ServiceOffers offers_;
  std::vector<MadeRoute> routes_;  // which use the offers
};

}  // namespace trestle::carry
