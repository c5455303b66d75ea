// A device to test testers with: it offers the Enhanced Testability Service. See README.md beside this file.
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdio>
#include <map>
#include <string>

#include <trestle/sd/net/handles.hpp>
#include <trestle/someip/net/address_text.hpp>

#include "ets_service.hpp"
#include "faults.hpp"

using namespace std::chrono_literals;

namespace {

constexpr const char* usage =
    "ets_device [--address IP] [--multicast IP] [--sd-port N] [--event-group IP] [--find-answers "
    "unicast|optimised] [--fault NAME | --list-faults | --list-bugs]\n";

/// The options that were given, over the defaults.
std::map<std::string, std::string> options_of(int argc, char** argv) {
  std::map<std::string, std::string> options{
      {"--address", "127.0.0.1"},           {"--multicast", "224.244.224.245"}, {"--sd-port", "30490"},
      {"--event-group", "224.244.224.246"}, {"--find-answers", "unicast"},      {"--fault", ""}};
  for (int at = 1; at < argc; ++at) {
    const std::string name = argv[at];
    const auto known = options.find(name);
    if (known == options.end() || ++at == argc) {
      throw std::runtime_error{"unknown option, or one without a value: " + name + "\n" + usage};
    }
    known->second = argv[at];
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string first = argc == 2 ? argv[1] : "";
  if (first == "--list-faults" || first == "--list-bugs") {
    std::fputs(ets::list_of(first == "--list-bugs" ? ets::bugs() : ets::faults()).c_str(), stdout);
    return 0;
  }
  const auto options = options_of(argc, argv);
  if (const std::string& fault = options.at("--fault"); !fault.empty() && !ets::choose_fault(fault)) {
    throw std::runtime_error{"there is no fault '" + fault + "': see --list-faults and --list-bugs"};
  }
  const auto address = [&](const char* name) {
    return trestle::someip::parse_address(options.at(name)).value();
  };

  boost::asio::io_context io;
  trestle::sd::NodeConfig config{.address = address("--address"),
                                 .multicast = address("--multicast"),
                                 .port = static_cast<std::uint16_t>(std::stoi(options.at("--sd-port"))),
                                 .timing = {.initial_delay_min = 10ms,
                                            .initial_delay_max = 50ms,
                                            .repetitions_base_delay = 50ms,
                                            .repetitions_max = 3,
                                            .cyclic_offer_delay = 500ms,
                                            .ttl_s = 5}};
  if (options.at("--find-answers") == "optimised") {
    config.discovery.find_answer = trestle::sd::FindAnswer::optimised;
  }
  // An eventgroup here has events over UDP and over TCP; a subscriber may want only some of them.
  config.discovery.accept_partial_endpoints = true;
  // A tester asks more often than any peer would.
  config.discovery.max_entries_per_second = 1'000'000;
  config.discovery.max_entries_at_once = 1'000'000;
  config.discovery.max_reboots_at_once = 1000;
  config.unproven_answer_bytes = std::size_t{64} << 20U;
  trestle::sd::Node node{io, config};
  const ets::Places places{.address = config.address, .event_group = address("--event-group")};
  ets::Client client{node};
  const ets::Service service{io, node, places, client};
  const ets::Companions companions{node, places};
  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  stop.async_wait([&](auto, int) {
    node.shutdown();
    io.stop();
  });
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "ets_device: %s\n", error.what());
  return 1;
}
