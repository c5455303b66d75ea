#pragma once
#include <chrono>
#include <optional>
#include <utility>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/map/field_map.hpp"

namespace trestle::messages {

/// Memory for a MappedPlan, as ConversionScratch.
struct MappedScratch {
  ConversionScratch wire;
  MapScratch map;
};

/// The conversion of a route in its direction: a ConversionPlan, and where the payload is a message of
/// another type than that of the topic, a FieldMap beside it.
class MappedPlan {
 public:
  MappedPlan(ConversionPlan wire) : wire_{std::move(wire)} {}  // NOLINT(*-explicit-*)
  /// @param wire  of the payload's type. It is best compiled to copy all where it comes first.
  /// @param map   for the direction of the route.
  MappedPlan(ConversionPlan wire, FieldMap map) : wire_{std::move(wire)}, map_{std::move(map)} {}

  /// As those of ConversionPlan.
  [[nodiscard]] tl::expected<Gathered, ConversionError> cdr_to_someip(ByteView sample,
                                                                      MappedScratch& scratch);
  /// @param received  when the payload came, since 1970; looked at if needs_time().
  [[nodiscard]] tl::expected<Gathered, ConversionError> someip_to_cdr(ByteView payload,
                                                                      std::chrono::nanoseconds received,
                                                                      MappedScratch& scratch);
  void expect(ByteView message, const MappedScratch& scratch) const noexcept {
    wire_.expect(message, scratch.wire);
  }

  [[nodiscard]] const ConversionPlan& wire() const noexcept { return wire_; }
  [[nodiscard]] bool has_map() const noexcept { return map_.has_value(); }
  [[nodiscard]] bool needs_time() const noexcept { return map_ && map_->needs_time(); }
  /// What the map did to numbers of all messages.
  [[nodiscard]] const MapCounters& counters() const noexcept { return counters_; }

 private:
  ConversionPlan wire_;
  std::optional<FieldMap> map_;
  MapCounters counters_;
};

}  // namespace trestle::messages
