#include "bridge/messages/map/mapped_plan.hpp"

#include <limits>

namespace trestle::messages {

tl::expected<Gathered, ConversionError> MappedPlan::cdr_to_someip(ByteView sample, MappedScratch& scratch) {
  if (!map_) {
    return wire_.cdr_to_someip(sample, scratch.wire);
  }
  // In one piece, as the plan wants it; the plan then refers to large arrays in it.
  const auto made =
      map_->convert(sample, {}, std::numeric_limits<std::size_t>::max(), scratch.map, counters_);
  if (!made) {
    return tl::unexpected{made.error()};
  }
  auto payload = wire_.cdr_to_someip(made->slices.front(), scratch.wire);
  if (!payload) {
    payload.error().is_between = true;
  }
  return payload;
}

tl::expected<Gathered, ConversionError> MappedPlan::someip_to_cdr(ByteView payload,
                                                                  std::chrono::nanoseconds received,
                                                                  MappedScratch& scratch) {
  const auto sample = wire_.someip_to_cdr(payload, scratch.wire);
  if (!map_ || !sample) {
    return sample;
  }
  auto made = map_->convert(sample->slices.front(), received, ConversionPlan::default_reference_from,
                            scratch.map, counters_);
  if (!made) {
    made.error().is_between = true;
  }
  return made;
}

}  // namespace trestle::messages
