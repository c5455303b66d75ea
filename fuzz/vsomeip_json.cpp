// Property: whatever read_vsomeip() accepts, write_vsomeip() writes so that it is read again without a
// problem.
#include <cstdlib>
#include <string>

#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"

using namespace trestle::describe;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const SourceText source{"f", {reinterpret_cast<const char*>(data), size}};
  const Reading reading = read_vsomeip({&source, 1});
  if (!reading.ok()) {
    return 0;
  }
  for (const TextFile& file : write_vsomeip(reading.model).files) {
    const SourceText written{file.path, file.text};
    if (!read_vsomeip({&written, 1}).problems.empty()) {
      std::abort();
    }
  }
  return 0;
}
