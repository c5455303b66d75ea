// Property: whatever the bytes of a capture, reading it ends with a model or an error; and what is in the
// model is a system: no id is there twice, and it can be written as JSON.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/generate/capture_model.hpp"

using namespace trestle;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // libpcap reads files.
  static const int file = memfd_create("capture", 0);
  if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  describe::Reading reading = generate::read_capture("/proc/self/fd/" + std::to_string(file));
  if (!reading.ok()) {
    if (std::ranges::all_of(reading.problems, [](const auto& one) { return one.text.empty(); })) {
      std::abort();
    }
    reading.problems.clear();  // what came before the fault is there
  }
  describe::IdLock lock;
  const describe::System system = make_system(std::move(reading), lock);
  if (!system.good || describe::to_json_text(system.model).empty()) {
    std::abort();
  }
  return 0;
}
