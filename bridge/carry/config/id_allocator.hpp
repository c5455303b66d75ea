#pragma once
#include <functional>
#include <optional>
#include <string_view>

#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::carry {

/// FNV-1a, 32 bits wide: the same for ever, on every machine.
[[nodiscard]] std::uint32_t fnv1a(std::string_view text) noexcept;

/// The id of a discovered topic's service: the hash of "TOPIC TYPE", folded into the range, or the first one
/// behind it that is free; behind the last one comes the first. So two bridges that discover the same topics
/// choose the same ids unless topics collide. The lock file keeps them for later runs.
/// @param topic  "/sensing/imu"
/// @param type  "sensor_msgs/msg/Imu"
/// @param is_taken  ids that somebody else has.
/// @return nothing: all are taken.
[[nodiscard]] std::optional<someip::ServiceId> choose_service(
    ServiceRange range, std::string_view topic, std::string_view type,
    const std::function<bool(someip::ServiceId)>& is_taken);

}  // namespace trestle::carry
