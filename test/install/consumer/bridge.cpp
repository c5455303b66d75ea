#include <boost/asio/io_context.hpp>

#include <trestle/bridge/carry/config/load.hpp>
#include <trestle/bridge/carry/runtime/bridge.hpp>
#include <trestle/bridge/messages/types/type_library.hpp>

int main(int argc, char**) {
  const auto loaded = trestle::carry::load_config("missing.yaml");
  if (loaded || argc > 1) {  // never; but all of it is linked
    boost::asio::io_context io{1};
    trestle::messages::TypeLibrary types;
    trestle::carry::Report report;
    const trestle::carry::Bridge bridge{io, loaded->config, types, report};
    return 1;
  }
  return to_string(loaded.error().front()).starts_with("missing.yaml: error: ") ? 0 : 1;
}
