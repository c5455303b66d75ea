#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/documents/format.hpp"

/// What ROS 2's tools leave in the environment, and what follows from it.
namespace trestle::carry {

/// The value of a variable; nothing when it is not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;

/// The environment of the process.
[[nodiscard]] Environment process_environment();

/// Takes from the environment what the configuration leaves open: ROS_DOMAIN_ID, ROS_DISTRO,
/// ROS_SECURITY_KEYSTORE with ROS_SECURITY_ENCLAVE_OVERRIDE where ROS_SECURITY_ENABLE is "true", and, unless
/// there are profiles, ROS_DISCOVERY_SERVER, of which Fast DDS would make a mere client.
/// @return what is wrong with a variable, naming it; empty: nothing.
[[nodiscard]] std::string apply_ros_environment(DdsSettings& settings, const Environment& environment);

/// The folder of the enclave; empty: no security.
[[nodiscard]] std::string security_folder(const SecuritySettings& settings);

[[nodiscard]] documents::Format<std::uint32_t> domain_id();

/// Whether a distribution could have this name: lower-case letters.
[[nodiscard]] bool is_distro_name(std::string_view text);

/// Bytes of an id in the graph messages of a distribution: 24 up to Humble, then 16. Of none, 0: to be
/// detected.
[[nodiscard]] std::size_t gid_bytes(std::string_view ros_distro);

}  // namespace trestle::carry
