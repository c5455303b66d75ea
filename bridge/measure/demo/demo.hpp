// bridge/measure/demo: `trestle demo`: lidar clouds through two bridges.
//
//   demo.hpp         starts four processes, shows what they report, ends them
//   child.hpp        one of these processes
//   figures.hpp      what they report, put together; screen.hpp: shown to people
//   endpoints.hpp    the processes at both ends
//   browser.hpp      opens the console of a bridge
//   lidar_scene.hpp  a made-up street; pcd.hpp: clouds from files
//
// docs/demo.md describes what it shows.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trestle::measure::demo {

/// What `trestle demo` shows and how long.
struct DemoOptions {
  /// How long to show live clouds, from the completion of discovery on; none: until SIGINT or SIGTERM.
  std::optional<std::chrono::seconds> duration;
  double rate_hz = 10;
  std::vector<std::string> inputs;  ///< PCD files; empty: a synthetic scene
  std::string json_file;            ///< where the figures go; empty: nowhere
  bool console = false;             ///< bridge A has one, and it is opened in the browser
  /// The program that the four processes run; it takes the arguments that `trestle` takes.
  std::string program = "/proc/self/exe";
  /// How long discovery may take.
  std::chrono::milliseconds discovery_limit{20'000};
  /// How long a process may take to end when it is asked to.
  std::chrono::milliseconds stop_limit{5'000};
};

/// Shows live clouds crossing two bridges: a DDS publisher, bridge A (DDS to SOME/IP), bridge B (SOME/IP to
/// DDS) and a DDS subscriber that checks them, each a process of its own, all on loopback.
///
/// Prints to standard output. Blocks SIGINT, SIGTERM and SIGCHLD in the calling thread, which must be the
/// only one. When it returns no process of the demo is left.
/// @return an exit status: exit_ok when at least 95 % of the clouds that were sent after discovery have
///         arrived, each of them intact; otherwise exit_failure.
[[nodiscard]] int run_demo(const DemoOptions& options);

/// The configurations of the two bridges.
struct DemoNetwork {
  std::uint32_t domain_a = 0;  ///< of publisher and bridge A
  std::uint32_t domain_b = 0;  ///< of bridge B and subscriber
  /// Of the bridges, on loopback.
  std::string address_a = "127.0.0.1";
  std::string address_b = "127.0.0.2";
  std::uint16_t instance = 1;  ///< of the service: not that of another demo on this host
  std::uint16_t port = 0;      ///< of the offered service
  std::uint16_t console = 0;   ///< TCP port of the console of bridge A, on 127.0.0.1
};
/// The configuration files of bridge A (DDS to SOME/IP) and bridge B (SOME/IP to DDS).
[[nodiscard]] std::string bridge_a_yaml(const DemoNetwork& network);
[[nodiscard]] std::string bridge_b_yaml(const DemoNetwork& network);

}  // namespace trestle::measure::demo
