// Property: whatever the bytes of a capture, `trestle conform replay` ends with one result for each rule:
// none of them names more broken messages than were judged, and nobody is blamed but the host that is asked
// for.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "bridge/conform/replay/replay.hpp"
#include "bridge/traffic/capture_reader.hpp"
#include "pcaps/capture_file.hpp"

using namespace trestle;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

std::vector<conform::CaseResult> results_of(const std::string& path, std::optional<IpAddress> host,
                                            bool twice) {
  conform::Replay judge{host};
  pcaps::CaptureFile file{path};
  traffic::CaptureReader reader{{}, judge};
  pcaps::Traffic traffic{reader};
  judge.begin(
      "", [&](Transport transport, const Endpoint& endpoint) { reader.learn(transport, endpoint); }, twice);
  while (const auto frame = file.next()) {
    traffic.on_frame(*frame);
  }
  traffic.finish();
  reader.finish();
  judge.end();
  return judge.results("fuzz.pcap");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // libpcap reads files.
  static const int file = memfd_create("replay", 0);
  if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  try {
    const auto all = results_of(path, std::nullopt, false);
    require(all.size() == static_cast<std::size_t>(conform::Rule::count));
    const auto of_one = results_of(path, IpAddress::v4(10, 0, 0, 1), (size & 1U) != 0);
    require(of_one.size() == all.size());
    const auto of_nobody = results_of(path, IpAddress::v4(255, 1, 2, 3), false);
    require(std::ranges::none_of(of_nobody, [](const conform::CaseResult& one) {
      return one.outcome.verdict == conform::Verdict::fail && one.outcome.differences.empty();
    }));
  } catch (const std::runtime_error&) {
    // It is no capture.
  }
  return 0;
}
