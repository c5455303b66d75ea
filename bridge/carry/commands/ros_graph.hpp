#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// Who writes in a DDS domain, as discovery tells after this time. What ROS 2 leaves in the environment
/// counts, as for `trestle bridge`.
/// @param domain  nothing: ROS_DOMAIN_ID, or 0.
/// @throws std::runtime_error when the domain cannot be joined.
[[nodiscard]] std::vector<dds::FoundWriter> listen_to_ros(std::optional<std::uint32_t> domain,
                                                          double seconds);

}  // namespace trestle::carry
