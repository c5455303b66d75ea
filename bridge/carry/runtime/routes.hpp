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

/// The routes of a bridge while they run, and the services that they offer together: those of the
/// configuration, then those that discovery adds and removes.
class Routes {
 public:
  /// @param config  what cannot be opened is said with its place there. Outlives the joining.
  Routes(std::vector<MadeRoute> routes, const BridgeConfig& config)
      : config_{config}, routes_{std::move(routes)} {}

  /// Offers what they offer, and looks for what they use.  @throws std::runtime_error
  void join_someip(SomeipSide& someip);
  /// Opens their ends in DDS.  @throws std::runtime_error
  void join_dds();
  /// Offers and withdraws, if what the services need has come or gone.
  void update_offers();
  /// Has one more join both sides, now that all others have. No other has its service.
  /// @param what  is the route.  @throws std::runtime_error  then nothing has begun.
  void add(const Route& what, std::shared_ptr<RunningRoute> route, SomeipSide& someip);
  /// Ends such a route and its offer.
  void remove(const Route& what, const RunningRoute& route);
  /// The node is about to withdraw the offers. Nothing is carried any more.
  void stop();

  /// The services that they offer, or would.
  void append_offers(std::vector<OwnOfferPicture>& offers) const;

  [[nodiscard]] auto begin() const noexcept { return routes_.begin(); }
  [[nodiscard]] auto end() const noexcept { return routes_.end(); }

 private:
  const BridgeConfig& config_;
  ServiceOffers offers_;
  std::vector<MadeRoute> routes_;  // which use the offers
};

}  // namespace trestle::carry
