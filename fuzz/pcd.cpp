// Property: a PCD file that is accepted gives a cloud whose parts agree, and which survives its own encoding.
#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "bridge/measure/demo/pcd.hpp"

using namespace trestle;
using namespace trestle::measure;
using namespace trestle::measure::demo;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const void* text = data;
  const auto cloud = parse_pcd({static_cast<const char*>(text), size}, "fuzz.pcd");
  if (!cloud) {
    if (!cloud.error().starts_with("fuzz.pcd:")) {
      std::abort();
    }
    return 0;
  }
  const EncodedCloud encoded = encode(*cloud, 1, "lidar");
  std::vector<std::byte> bytes = encoded.front;
  bytes.insert(bytes.end(), encoded.data.begin(), encoded.data.end());
  bytes.push_back(encoded.tail);
  const auto decoded = decode(bytes);
  if (!decoded || decoded->fields != cloud->fields || !std::ranges::equal(decoded->data, cloud->data)) {
    std::abort();
  }
  return 0;
}
