#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <set>
#include <tuple>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/tools/beside_bridge.hpp"
#include "bridge/inspect/tools/sighting_text.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "bridge/traffic/live/listener.hpp"
#include "bridge/traffic/network_view.hpp"
#include "sd/net/clock.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

constexpr std::size_t max_services = 10'000;
/// More other instances are not listed.
constexpr std::size_t most_instances = 8;

struct FindArguments {
  cli::NetworkOptions network;
  cli::InterfaceOptions interfaces;
  std::string service;
  double timeout_s = 3;
  std::uint64_t count = 0;
  bool json = false;
};

/// What a bridge tells of a service: all but how long it lives.
traffic::SeenService seen_service(const sd::RemoteService& one) {
  return {.service = one.service,
          .instance = one.instance,
          .major = one.major,
          .minor = one.minor,
          .udp = one.udp,
          .tcp = one.tcp,
          .peer = one.peer};
}

/// As of an offer that was heard, but for its lifetime, which a bridge does not tell.
std::string text_of(const traffic::SeenService& service, const describe::Interfaces* names, bool json) {
  if (json) {
    nlohmann::ordered_json object;
    object["seen"] = "offered";
    add_service(object, service, names);
    object.erase("ttl");
    return object.dump();
  }
  const std::string text = describe(service, names);
  return text.substr(0, text.rfind("  ttl "));
}

bool fits(const cli::ServiceArgument& wanted, const traffic::SeenService& service) {
  return (wanted.service == someip::ServiceId{} || wanted.service == service.service) &&
         (wanted.instance == someip::any_instance || wanted.instance == service.instance);
}

int run(FindArguments& options) {
  options.interfaces.load();
  const describe::Interfaces* const names = options.interfaces.get();
  cli::ServiceArgument wanted;  // service 0: all
  std::uint64_t count = options.count;
  if (!options.service.empty()) {
    const cli::Target target = cli::parse_target(names, options.service, cli::UnnamedInstance::any);
    if (!target.elements.empty()) {
      throw CLI::ValidationError("SERVICE", fmt::format("'{}' is more than a service", options.service));
    }
    wanted = target.service;
    count = count == 0 && wanted.instance != someip::any_instance ? 1 : count;
  }
  const sd::NodeConfig network = options.network.config();
  cli::Session session{options.timeout_s};
  std::uint64_t found = 0;
  std::set<std::string> instances;       // others of the service
  std::unique_ptr<guest::Guest> bridge;  // that has the address
  // Printed, when it may be told twice: by the bridge, and by multicast.
  std::set<std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t, IpAddress>> seen;
  const auto print = [&](const traffic::SeenService& one, const std::string& text) {
    if (!fits(wanted, one) || (count != 0 && found == count) ||
        (!seen.insert({one.service, one.instance, one.major, one.peer.address}).second && bridge)) {
      return;
    }
    session.print(text + "\n");
    if (++found == count) {
      session.finish();
    }
  };
  traffic::NetworkView view{max_services};
  traffic::Listener listener{
      session.io, network, [&](ByteView datagram, const Endpoint& from, const Endpoint& to) {
        std::vector<traffic::Sighting> sightings;
        view.on_datagram(datagram, from, to, sd::now(), sightings);
        for (const traffic::Sighting& one : sightings) {
          const bool is_offered = one.kind == traffic::Sighting::Kind::offered;
          if (is_offered && one.service.service == wanted.service && !fits(wanted, one.service) &&
              instances.size() < most_instances) {
            const std::string id = fmt::format("0x{:04x}", someip::value(one.service.instance));
            instances.insert(options.service.substr(0, options.service.rfind('.') + 1) + id);
          }
          if (is_offered) {
            print(one.service, options.json ? to_json(one, {}, names) : describe(one.service, names));
          }
        }
      }};
  if (!options.service.empty()) {
    if (listener.open_for_finding()) {
      // Asks now, and again for servers that were not listening yet.
      listener.find(wanted.service, wanted.instance);
      session.every(std::chrono::seconds{1}, [&] { listener.find(wanted.service, wanted.instance); });
    } else {
      bridge = bridge_that_has(session, network);
      cli::Session::note(
          bridge ? fmt::format("note: through {}, which has {}", name_of(*bridge),
                               someip::to_string(bridge->host().at))
                 : fmt::format(
                       "note: {}:{} is taken by another SOME/IP stack: listening to offers without asking",
                       someip::to_string(network.address), network.port));
    }
  }
  if (bridge) {
    // When it ends, what is heard by multicast is still printed.
    bridge->listen(
        [&](const guest::Frame& frame) {
          if (const auto* const one = std::get_if<guest::Found>(&frame)) {
            const traffic::SeenService service = seen_service(one->service);
            print(service, text_of(service, names, options.json));
          } else if (const auto* const said = std::get_if<guest::Said>(&frame)) {
            cli::Session::note("note: " + said->text);
          }
        },
        [] {});
    bridge->say(guest::Find{wanted.service, wanted.instance});
  }
  session.run();
  if (found == 0 && !session.timed_out()) {
    return cli::exit_failure;  // somebody ended it
  }
  if (found == 0) {
    const std::string others =
        instances.empty() ? "" : fmt::format("; there is {}", fmt::join(instances, ", "));
    cli::Session::note(options.service.empty() ? "nobody offers a service"
                                               : fmt::format("nobody offers {}{}", options.service, others));
  }
  return found > 0 ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_find_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("find", "Find services: send a FindService, print offers");
  command->footer(
      "Prints a line for each instance that is found. Without SERVICE it only listens, and prints all\n"
      "instances that are offered. With an instance it ends as soon as that one is found.\n"
      "Where a bridge of this host has the address, that asks.\n"
      "Exit status: 0 when something was found, 1 when nothing was, 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle find\n"
      "  trestle find 0x1234\n"
      "  trestle find Door --interfaces Door.fidl Door.fdepl\n"
      "  trestle find 0x1234.0x0001 --address 192.168.1.10 --timeout 10");
  const auto options = std::make_shared<FindArguments>();
  command->add_option(
      "SERVICE", options->service,
      "SERVICE or SERVICE.INSTANCE, such as 0x1234.0x0001; with --interfaces Door or Door.0x0001");
  cli::add_seconds(*command, "--timeout", options->timeout_s, "How long to look");
  cli::add_count(*command, options->count, "End when this many are found");
  command->add_flag("--json", options->json, "Print a JSON object for each");
  options->interfaces.add_to(*command, "find and print by their names");
  options->network.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
