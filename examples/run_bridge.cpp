// Runs the bridge of a configuration within a program of one's own: what `trestle bridge FILE` does, in
// short.
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdio>

#include <trestle/bridge/carry/config/load.hpp>
#include <trestle/bridge/carry/runtime/bridge.hpp>
#include <trestle/bridge/messages/types/type_library.hpp>

namespace carry = trestle::carry;
namespace messages = trestle::messages;

// run_bridge FILE
int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FILE\n", argv[0]);
    return 2;
  }
  const auto loaded = carry::load_config(argv[1]);
  if (!loaded) {
    for (const auto& problem : loaded.error()) {
      std::fprintf(stderr, "%s\n", to_string(problem).c_str());  // with file, line and column
    }
    return 2;
  }
  const carry::BridgeConfig& config = loaded->config;

  boost::asio::io_context io{1};
  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  stop.async_wait([&](auto, int) { io.stop(); });

  messages::TypeLibrary types = messages::TypeLibrary::in(config.types);
  carry::Report report;
  carry::Bridge bridge{io, config, types, report};
  io.run();
  bridge.stop();
  for (const auto& group : bridge.counters()) {
    std::printf("%s\n", to_string(group).c_str());
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
