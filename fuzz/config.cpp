#include <cstdlib>

#include "bridge/carry/config/load.hpp"

/// Property: whatever the bytes, the answer is a configuration with routes or methods, or errors whose places
/// lie in the file and whose texts are single printable lines.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trestle;
  const std::string text(data, data + size);
  const auto loaded = carry::parse_config(text, "fuzz.yaml");
  if (loaded) {
    if (loaded->config.routes.empty() && loaded->config.methods.empty() && loaded->config.patterns.empty()) {
      std::abort();
    }
    return 0;
  }
  bool any_error = false;
  for (const documents::Problem& problem : loaded.error()) {
    any_error = any_error || problem.severity == documents::Problem::Severity::error;
    if (problem.mark.line < 0 || problem.mark.line > static_cast<int>(size) + 1 ||
        problem.text.size() > 1000) {
      std::abort();
    }
    for (const char c : problem.text) {
      if (static_cast<unsigned char>(c) < 0x20) {
        std::abort();
      }
    }
  }
  if (!any_error) {
    std::abort();
  }
  return 0;
}
