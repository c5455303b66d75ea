#pragma once
#include "bridge/carry/config/bridge_config.hpp"
#include "someip/core/tp_pacing.hpp"

namespace trestle::carry {

/// At which pace large messages leave over UDP.
[[nodiscard]] inline someip::TpPacing pacing_of(const TpSettings& settings) {
  return {
      .segment_bytes = settings.segment_bytes, .burst = settings.burst, .separation = settings.separation};
}

}  // namespace trestle::carry
