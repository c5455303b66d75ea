#include <fmt/format.h>

#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/other_versions.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"

namespace trestle::inspect {
namespace {

struct SubscribeArguments {
  cli::NetworkOptions network;
  cli::PayloadOptions payload;
  cli::TransportOptions transport;
  std::string service;
  std::string eventgroup;
  std::vector<std::string> events;
  unsigned major = 1;
  double timeout_s = 0;
  std::uint64_t count = 0;
  bool quiet = false;
};

/// The wanted events; all possible ids when none is named, because Node needs a list.
std::vector<someip::MethodId> events_of(const std::vector<std::string>& names) {
  std::vector<someip::MethodId> events;
  events.reserve(names.empty() ? 0xfffe : names.size());
  for (const std::string& name : names) {
    events.push_back(someip::MethodId{cli::parse_id("EVENT", name)});
  }
  for (std::uint16_t id = 1; names.empty() && id < 0xffff; ++id) {
    if (const someip::MethodId event{id}; !sd::is_reserved(event)) {
      events.push_back(event);
    }
  }
  return events;
}

int run(SubscribeArguments& options) {
  const cli::ServiceArgument service = cli::parse_service(options.service, false);
  const someip::EventgroupId eventgroup{cli::parse_id("EVENTGROUP", options.eventgroup)};
  std::vector<someip::MethodId> events = events_of(options.events);
  options.payload.resolve();
  const sd::NodeConfig network = options.network.config();
  cli::Session session{options.timeout_s};
  sd::Node node{session.io, network, cli::Session::log(options.quiet), cli::Session::warn};
  std::uint64_t received = 0;
  std::uint64_t unprintable = 0;
  node.subscribe({.service = service.service,
                  .instance = service.instance,
                  .major = static_cast<std::uint8_t>(options.major),
                  .eventgroup = eventgroup,
                  .events = std::move(events),
                  .udp = options.transport.udp(),
                  .tcp = options.transport.tcp()},
                 [&](const someip::Message& message, const Endpoint& from) {
                   if (options.count != 0 && received == options.count) {
                     return;
                   }
                   const auto text = message_text(message, &from, options.payload);
                   if (text) {
                     session.print(*text);
                   } else {
                     ++unprintable;
                     cli::Session::warn(text.error());
                   }
                   if (++received == options.count) {
                     session.finish();
                   }
                 });
  const OtherVersions others{node, service, options.major, options.quiet};
  session.run();
  node.shutdown();
  const bool enough = options.count == 0 ? received > 0 || !session.timed_out() : received == options.count;
  return enough && unprintable == 0 ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_subscribe_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("subscribe", "Subscribe to an eventgroup and print its events");
  command->footer(
      "Runs until Ctrl-C, --count or --timeout. It reports discovery on standard error. On a terminal it\n"
      "prints at most 128 elements of an array, otherwise all.\n"
      "Exit status: 0; 1 when too few events came in time, or when one was no message of the type; 2 for a\n"
      "wrong command line.\n\n"
      "Examples:\n"
      "  trestle subscribe 0x1234.0x0001 0x0001\n"
      "  trestle subscribe 0x1234.0x0001 0x0001 0x8001 --type geometry_msgs/msg/Point --count 1\n"
      "  trestle subscribe 0x1234.1 1 --tcp\n"
      "  trestle subscribe 0x1234.1 1 --type sensor_msgs/msg/Imu --json | jq .values.linear_acceleration.x");
  const auto options = std::make_shared<SubscribeArguments>();
  command->add_option("SERVICE.INSTANCE", options->service, "Such as 0x1234.0x0001")->required();
  command->add_option("EVENTGROUP", options->eventgroup, "Its id")->required();
  command->add_option("EVENT", options->events, "Ids of the events to print (default: all)");
  cli::add_major(*command, options->major);
  cli::add_count(*command, options->count, "End after this many events");
  cli::add_seconds(*command, "--timeout", options->timeout_s, "End after this time");
  cli::add_quiet(*command, options->quiet);
  options->transport.add_to(*command, "Events come");
  options->payload.add_to(*command);
  options->network.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
