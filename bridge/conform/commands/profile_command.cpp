#include "bridge/conform/commands/profile_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "bridge/cli/exit_status.hpp"
#include "bridge/conform/commands/profile_writer.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

struct ProfileArguments {
  generate::SourceArguments sources;
  bool from_network = false;
  std::string name;
  std::string device;
  std::string tester;
  std::string file;
};

std::optional<IpAddress> address_argument(const char* option, const std::string& text) {
  if (text.empty()) {
    return std::nullopt;
  }
  const auto address = someip::parse_address(text);
  if (!address) {
    throw CLI::ValidationError{option, "'" + text + "' is no IP address"};
  }
  return address;
}

int profile(ProfileArguments& arguments) {
  if (arguments.from_network) {
    arguments.sources.sources.emplace_back("network");
  }
  if (arguments.sources.sources.empty()) {
    throw CLI::ValidationError{"SOURCE", "is needed, or --from-network"};
  }
  ProfileWishes wishes{.name = arguments.name,
                       .device = address_argument("--device", arguments.device),
                       .tester = address_argument("--tester", arguments.tester)};
  if (wishes.device && wishes.tester && wishes.device->v6 != wishes.tester->v6) {
    throw CLI::ValidationError{"--tester", "and --device must both be IPv4 or both IPv6"};
  }
  if (std::ranges::any_of(arguments.sources.sources, [](const std::string& source) {
        return generate::form_of(source) == generate::SourceForm::network;
      })) {
    const sd::NodeConfig network = arguments.sources.network.config_without_address();
    wishes.discovery = Endpoint{network.multicast, network.port};
  }
  const describe::System system = arguments.sources.read();
  if (!system.good) {
    return cli::exit_usage;
  }
  const WrittenProfile written = write_profile(system.model, wishes);
  if (written.text.empty()) {
    fmt::print(stderr, "error: no service with an id is offered, or subscribed to{}{}\n",
               wishes.device ? " by " + arguments.device : "",
               wishes.discovery
                   ? wishes.discovery->address.v6 ? ", over IPv6" : ", over IPv4 (for IPv6: --multicast)"
                   : "");
    return cli::exit_failure;
  }
  if (!written.others.empty()) {
    fmt::print(stderr, "note: there are other devices, see --device: {}\n", written.others);
  }
  if (arguments.file.empty()) {
    fmt::print("{}", written.text);
    return cli::exit_ok;
  }
  std::ofstream out{arguments.file, std::ios::binary};
  out << written.text;
  if (!out.flush()) {
    throw std::runtime_error{"cannot write " + arguments.file};
  }
  return cli::exit_ok;
}

}  // namespace

void add_profile_command(CLI::App& conform, int& status, const generate::SourceReaders& readers) {
  const auto arguments = std::make_shared<ProfileArguments>();
  arguments->sources = generate::SourceArguments{readers};
  CLI::App* one = conform.add_subcommand(
      "profile", "Write a first profile of a device, from a description, a capture or the network");
  arguments->sources.add_to(*one);
  one->get_option("SOURCE")->required(false);
  one->add_flag("--from-network", arguments->from_network,
                "Listen to service discovery, as SOURCE 'network' ('network:eth0') does; see --for");
  one->add_option("--name", arguments->name, "Of the device, for reports");
  one->add_option("--device", arguments->device,
                  "Of several devices this one; or its address, where no source tells")
      ->type_name("IP");
  one->add_option("--tester", arguments->tester, "Our own address in the device's network")->type_name("IP");
  one->add_option("-o,--output", arguments->file, "The file to write, in place of standard output")
      ->type_name("FILE");
  one->footer(generate::source_forms() +
              "\n\nExamples:\n"
              "  trestle conform profile Door.fidl Door.fdepl --device 192.168.1.10 --tester 192.168.1.20 -o "
              "door.yaml\n"
              "  trestle conform profile --from-network --for 10 -o profile.yaml\n"
              "  trestle conform profile car.arxml --device 192.168.1.10\n"
              "Exit status: 0, or 1 when nothing is offered, or 2 when a source is wrong.");
  one->callback([arguments, &status] { status = profile(*arguments); });
}

}  // namespace trestle::conform
