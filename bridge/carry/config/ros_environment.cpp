#include "bridge/carry/config/ros_environment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "bridge/carry/config/load_dds.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::carry {

Environment process_environment() {
  return [](const char* name) {
    const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
    return value != nullptr ? std::optional<std::string>{value} : std::nullopt;
  };
}

std::string apply_ros_environment(DdsSettings& settings, const Environment& environment) {
  const std::string domain = environment("ROS_DOMAIN_ID").value_or("");
  if (!settings.has_domain && !domain.empty()) {  // ROS 2 ignores an empty one too
    const auto format = domain_id();
    const auto read = format.read(domain);
    if (!read) {
      return fmt::format(
          "ROS_DOMAIN_ID in the environment: expected {}, found {} (dds.domain would override it)",
          format.expected, documents::quote(domain));
    }
    settings.domain = *read;
    settings.has_domain = true;
  }
  if (settings.discovery_servers.empty() && settings.profiles_file.empty()) {  // profiles may have servers
    // If we do not understand the text, Fast DDS reads it itself, or says what is wrong with it.
    const auto servers = discovery_servers().read(environment("ROS_DISCOVERY_SERVER").value_or(""));
    settings.discovery_servers = servers.value_or(settings.discovery_servers);
  }
  const std::string distro = environment("ROS_DISTRO").value_or("");
  if (settings.ros_distro.empty() && is_distro_name(distro)) {
    settings.ros_distro = distro;
  }
  if (settings.security.keystore.empty() && environment("ROS_SECURITY_ENABLE") == "true") {
    // If the keystore or the enclave in it is missing, the bridge reports that when it starts, unless nodes
    // without security are allowed.
    SecuritySettings security{environment("ROS_SECURITY_KEYSTORE").value_or("ROS_SECURITY_KEYSTORE"),
                              environment("ROS_SECURITY_ENCLAVE_OVERRIDE").value_or("/")};
    std::error_code ignored;
    if (environment("ROS_SECURITY_STRATEGY") == "Enforce" ||
        std::filesystem::is_directory(security_folder(security), ignored)) {
      settings.security = std::move(security);
    }
  }
  return {};
}

documents::Format<std::uint32_t> domain_id() {
  return documents::as<std::uint32_t>(documents::whole_number(0, 232));
}

std::string security_folder(const SecuritySettings& settings) {
  if (settings.keystore.empty()) {
    return {};
  }
  return settings.keystore + "/enclaves" + (settings.enclave == "/" ? "" : settings.enclave);
}

bool is_distro_name(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= 'a' && c <= 'z'; });
}

std::size_t gid_bytes(std::string_view ros_distro) {
  constexpr std::array<std::string_view, 8> up_to_humble{"ardent",   "bouncy", "crystal",  "dashing",
                                                         "eloquent", "foxy",   "galactic", "humble"};
  if (ros_distro.empty()) {
    return 0;
  }
  return std::ranges::find(up_to_humble, ros_distro) != up_to_humble.end() ? 24 : 16;
}

}  // namespace trestle::carry
