#pragma once
#include <functional>
#include <map>
#include <optional>
#include <tuple>

#include "bridge/carry/runtime/dds_side.hpp"
#include "bridge/carry/runtime/publisher_watch.hpp"
#include "bridge/carry/runtime/report.hpp"
#include "bridge/carry/runtime/route_clock.hpp"
#include "bridge/carry/runtime/someip_side.hpp"
#include "bridge/carry/runtime/topic_watch.hpp"

namespace trestle::carry {

/// Tells the values of a field from one route of a bridge to another: from a notifier to the setter beside
/// it.
class FieldValues {
 public:
  /// Told of each value, and of nothing when it is not known any more whether that is still the value.
  using Told = std::function<void(std::optional<ByteView> value)>;

  void tell(someip::ServiceId service, someip::InstanceId instance, someip::MethodId notifier,
            const Told& told) {
    told_.try_emplace({service, instance, notifier}, told);
  }
  /// Empty: nobody wants to know.
  [[nodiscard]] Told of(someip::ServiceId service, someip::InstanceId instance,
                        someip::MethodId notifier) const {
    const auto told = told_.find({service, instance, notifier});
    return told == told_.end() ? Told{} : told->second;
  }

 private:
  std::map<std::tuple<someip::ServiceId, someip::InstanceId, someip::MethodId>, Told> told_;
};

/// What all routes of a bridge work with. Outlives them.
struct RouteContext {
  boost::asio::io_context& io;
  RouteClock& clock;
  Report& report;
  IpAddress address;              ///< of the bridge in SOME/IP
  SomeipSide* someip = nullptr;   ///< there from join_someip() on
  DdsSide* dds = nullptr;         ///< there from join_dds() on
  FieldValues* values = nullptr;  ///< filled while routes are made
  /// They tell that others on a topic have come or gone, and what they offer. Null: the maker of the route
  /// does that.
  TopicWatch* watch = nullptr;
  PublisherWatch* publishers = nullptr;
};

}  // namespace trestle::carry
