#include "bridge/conform/commands/device_options.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <vector>

#include "bridge/cli/option.hpp"
#include "bridge/cli/shell_word.hpp"
#include "bridge/documents/document.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"

namespace trestle::conform {
namespace {

namespace fs = std::filesystem;

IpAddress address_of(const char* name, const std::string& text) {
  const auto address = someip::parse_address(text);
  if (!address) {
    throw CLI::ValidationError{name, "'" + text + "' is no IP address"};
  }
  return *address;
}

void take_device(DeviceOptions& options, const std::string& address) {
  if (!options.device.empty() && options.device != address) {
    throw CLI::ValidationError{"--device", "the device has two addresses on the command line: " +
                                               options.device + " and " + address};
  }
  options.device = address;
}

/// Who reads a number from the text alone takes what is too large for the largest one, and -1 for that, too.
std::string check_seed(const std::string& text) {
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  return error == std::errc{} && end == text.data() + text.size()
             ? ""
             : "'" + text + "' is no seed: a number from 0 to 18446744073709551615";
}

/// A profile, and the address of the device: whichever of them a word is.
void take_dut(DeviceOptions& options, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (someip::parse_address(word)) {
      take_device(options, word);
    } else if (options.profile.empty()) {
      options.profile = word;
    } else {
      throw CLI::ValidationError{"--dut",
                                 "there are two profiles: '" + options.profile + "' and '" + word + "'"};
    }
  }
  if (options.profile.empty()) {
    throw CLI::ValidationError{
        "--dut",
        "names the address of the device, " + options.device +
            ", and not its profile: --dut FILE is needed, too ('trestle conform profile' writes one)"};
  }
}

}  // namespace

void add_device_options(CLI::App& command, DeviceOptions& options) {
  command
      .add_option_function<std::vector<std::string>>(
          "--dut", [&options](const std::vector<std::string>& words) { take_dut(options, words); },
          "The profile of the device, a YAML file; with an IP address, which can be given besides, as "
          "--device")
      ->type_name("FILE")
      ->required()
      ->allow_extra_args(false);
  command.add_option("--tester", options.tester, "Our own address, in place of that in the profile")
      ->type_name("IP");
  command
      .add_option("--interface", options.interface,
                  "Our own address is that of this network interface in the subnet of the device")
      ->type_name("IF")
      ->excludes("--tester");
  cli::option(command, "--seed", options.seed, "N", "Of everything random: the same seed, the same run")
      ->check(check_seed);
  command
      .add_option_function<std::string>(
          "--device", [&options](const std::string& address) { take_device(options, address); },
          "The address of the device, in place of that in the profile")
      ->type_name("IP");
  cli::option(command, "--out", options.folder, "DIR", "The folder for results and captures");
}

std::optional<Profile> profile_of(const DeviceOptions& options, ProfileServices services) {
  const auto text = documents::read_text_file(options.profile);
  if (!text) {
    throw CLI::ValidationError{"--dut", text.error()};
  }
  auto profile = read_profile(*text, options.profile, services);
  if (!profile) {
    for (const documents::Problem& problem : profile.error()) {
      fmt::print(stderr, "{}\n", documents::to_string(problem));
    }
    return std::nullopt;
  }
  if (!options.tester.empty()) {
    profile->tester = address_of("--tester", options.tester);
  }
  if (!options.device.empty()) {
    profile->device = address_of("--device", options.device);
  }
  if (profile->device.v6 != profile->multicast.v6 || profile->tester.v6 != profile->multicast.v6) {
    throw CLI::ValidationError{
        options.device.empty() ? "--tester" : "--device",
        fmt::format(
            "device {}, tester {} and the multicast group of the profile, {}, have to be all of IPv4, "
            "or all of IPv6",
            someip::to_string(profile->device), someip::to_string(profile->tester),
            someip::to_string(profile->multicast))};
  }
  if (!options.interface.empty()) {
    const auto own = someip::address_beside(options.interface, profile->device);
    if (!own) {
      throw CLI::ValidationError{"--interface", "'" + options.interface +
                                                    "' has no address in the subnet of the device, " +
                                                    someip::to_string(profile->device)};
    }
    profile->tester = *own;
  }
  if (profile->tester == profile->device) {
    throw CLI::ValidationError{"--tester", "the device and the tester need two addresses"};
  }
  return *profile;
}

void prepare_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && ::access(folder.c_str(), W_OK | X_OK) != 0) {
    error = std::error_code{errno, std::generic_category()};
  }
  if (error) {
    throw CLI::ValidationError{"--out", "cannot write into '" + folder + "': " + error.message()};
  }
}

std::string programs() {
  return fs::read_symlink("/proc/self/exe").parent_path().string();
}

std::string as_words(const DeviceOptions& options) {
  std::string words = " --dut " + cli::shell_word(options.profile);
  if (!options.tester.empty()) {
    words += " --tester " + cli::shell_word(options.tester);
  }
  if (!options.device.empty()) {
    words += " --device " + cli::shell_word(options.device);
  }
  if (!options.interface.empty()) {
    words += " --interface " + cli::shell_word(options.interface);
  }
  return words + fmt::format(" --seed {}", options.seed);
}

}  // namespace trestle::conform
