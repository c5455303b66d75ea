#pragma once
#include <optional>

#include "sd/wire/option.hpp"

namespace trestle::sd {

/// What an offer says by options of a fixed size, besides its endpoints. Servers (OfferedService,
/// ServiceSpec), clients (RemoteService) and all between them use this struct: a new option of this kind is a
/// struct with `option_type`, encode() and decode(), a member here, and its line in for_each(). The
/// configuration option has no fixed size and is kept apart: ConfigurationPool.
struct OfferOptions {
  /// How clients rank it among instances, see ServiceDiscovery::choose().  [feat_req_someipsd_174]
  std::optional<LoadBalancingOption> load_balancing{};
  /// Of other_protocols alone, which then needs no endpoint.  [feat_req_someipsd_1250]
  std::optional<MacGroupcastOption> mac_groupcast{};

  /// Calls `visit(member)` for each, in the order in which they are sent.
  template <typename Options, typename Visit>
  static constexpr void for_each(Options& options, Visit visit) {
    visit(options.mac_groupcast);
    visit(options.load_balancing);
  }

  friend constexpr bool operator==(const OfferOptions&, const OfferOptions&) = default;
};

/// Calls `visit.operator()<Kind>()` for each kind of option of OfferOptions.
template <typename Visit>
constexpr void for_each_offer_option(Visit visit) {
  constexpr OfferOptions none;
  OfferOptions::for_each(
      none, [&]<typename Kind>(const std::optional<Kind>&) { visit.template operator()<Kind>(); });
}

/// How many kinds there are.
inline constexpr std::size_t offer_option_kinds = [] {
  std::size_t kinds = 0;
  for_each_offer_option([&]<typename Kind>() { ++kinds; });
  return kinds;
}();

}  // namespace trestle::sd
