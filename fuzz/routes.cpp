// Property: whatever the bytes of a route file, there are errors, or a model of its interfaces; and of that
// packages and a route file can be written.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bridge/carry/config/describe_routes.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"
#include "bridge/describe/write/routes/write_routes.hpp"

using namespace trestle;

namespace {

/// In a folder of its own: a route file can name files that stand beside it.
const std::string& route_file() {
  static const std::string file = [] {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("fuzz_routes_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    return (folder / "bridge.yaml").string();
  }();
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::ofstream{route_file(), std::ios::binary} << std::string(data, data + size);
  describe::Reading reading = carry::describe_routes(route_file());
  if (!reading.ok()) {
    const bool any_error = std::ranges::any_of(reading.problems, [](const documents::Problem& one) {
      return one.severity == documents::Problem::Severity::error && !one.text.empty();
    });
    if (!any_error) {
      std::abort();
    }
    return 0;
  }
  describe::IdLock lock;
  const describe::System system = make_system(std::move(reading), lock);
  if (system.good) {
    static_cast<void>(write_msg(system.model, system.lowered));
    static_cast<void>(write_routes(system.model, system.lowered, {}));
  }
  return 0;
}
