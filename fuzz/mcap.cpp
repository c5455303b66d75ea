// Property: whatever the bytes of a recording, reading it ends with its messages, or with a fault that has a
// place in it; each message is of a channel that stands before it; and a file without summary has the
// messages that its overview counts.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "bridge/record/mcap_reader.hpp"
#include "bridge/record/offered_qos.hpp"

using namespace trestle::record;

namespace {

/// A chunk decompressed may have bytes that the file has not.
void check(const McapFault& fault, std::size_t size) {
  if (fault.field.empty() || fault.text.empty() || fault.offset > size + 16) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int file = memfd_create("mcap", 0);
  if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  std::optional<McapReader> reader;
  try {
    reader.emplace("/proc/self/fd/" + std::to_string(file));
  } catch (const std::runtime_error&) {
    return 0;
  }
  std::uint64_t messages = 0;
  bool good = true;
  for (;;) {
    const auto one = reader->next();
    if (!one) {
      check(one.error(), size);
      good = false;
      break;
    }
    if (!*one) {
      break;
    }
    const auto channel = reader->channels().find((*one)->channel);
    if (channel == reader->channels().end() ||
        (channel->second.schema != 0 && !reader->schemas().contains(channel->second.schema))) {
      std::abort();
    }
    ++messages;
  }
  for (const auto& [id, channel] : reader->channels()) {
    if (const auto qos = channel.metadata.find("offered_qos_profiles"); qos != channel.metadata.end()) {
      (void)writers_of(qos->second);
    }
  }
  const auto overview = reader->overview();
  if (!overview) {
    check(overview.error(), size);
  } else if (!overview->has_summary && (!good || overview->statistics.messages != messages)) {
    std::abort();
  }
  return 0;
}
