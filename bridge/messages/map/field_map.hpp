#pragma once
#include <chrono>
#include <cstddef>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/map/map_program.hpp"

namespace trestle::messages {

/// Memory for a FieldMap, one message after another, as ConversionScratch. Made once, for one thread.
struct MapScratch {
  Output output;
  std::vector<Slot> slots;
};

/// Makes a message of one type from a message of another, as a route's `map` says. Both are CDR.
class FieldMap {
 public:
  explicit FieldMap(MapProgram program) : program_{std::move(program)} {}

  /// @param sample    CDR in either byte order, as that of ConversionPlan::cdr_to_someip().
  /// @param received  when it came, since 1970.
  /// @param reference_from  arrays of so many bytes are not copied when they stay as they are.
  /// @return CDR in the host's byte order, which lives as long as the sample and the scratch's next use. An
  ///         error names a field of the sample, but for bounds: then it is one of the message to be made.
  [[nodiscard]] tl::expected<Gathered, ConversionError> convert(ByteView sample,
                                                                std::chrono::nanoseconds received,
                                                                std::size_t reference_from,
                                                                MapScratch& scratch,
                                                                MapCounters& counters) const;

  /// Whether `received` matters.
  [[nodiscard]] bool needs_time() const noexcept { return program_.needs_time; }
  [[nodiscard]] const MapProgram& program() const noexcept { return program_; }

 private:
  MapProgram program_;
};

}  // namespace trestle::messages
