#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/conform/profile.hpp"

namespace CLI {
class App;
}

namespace trestle::conform {

/// What every command that talks to a device is told of it.
struct DeviceOptions {
  std::string profile{};
  std::string tester{};
  std::string device{};
  std::string interface {};
  std::uint64_t seed = 1;
  std::string folder = "conform-results";
};

/// Adds --dut, --tester, --interface, --device, --seed and --out. The defaults are those in `options`.
void add_device_options(CLI::App& command, DeviceOptions& options);

/// The profile, with the addresses of the command line in place of its own.
/// @param services  whether it has to name any.
/// @return nothing, after it has said why, when the profile cannot be used.
/// @throws CLI::ValidationError when an option is wrong.
[[nodiscard]] std::optional<Profile> profile_of(const DeviceOptions& options,
                                                ProfileServices services = ProfileServices::needed);

/// Makes the folder for results.
/// @throws CLI::ValidationError when nothing can be written there.
void prepare_folder(const std::string& folder);

/// The folder of the running program.
[[nodiscard]] std::string programs();

/// The options as they were given, but for --out, as words of a shell: " --dut ecu.yaml --seed 1".
[[nodiscard]] std::string as_words(const DeviceOptions& options);

}  // namespace trestle::conform
