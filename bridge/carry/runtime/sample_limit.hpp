#pragma once
#include <algorithm>
#include <cstddef>

#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// The largest DDS sample of a route. What the configuration limits is the payload; the CDR of one has up to
/// 8 times its bytes: an empty string takes 8 there with its padding, and in a payload as little as one.
[[nodiscard]] inline std::size_t max_sample_bytes(const Route& route) {
  return std::max(dds::default_max_sample_bytes, 8 * route.tp.max_message);
}

}  // namespace trestle::carry
