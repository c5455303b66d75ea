// Property: a PointCloud2 that is accepted says the same after being encoded anew, with the same checksum,
// and with another one if its data is changed.
#include <algorithm>
#include <cstdlib>

#include "bridge/measure/point_cloud.hpp"

using namespace trestle;
using namespace trestle::measure;

namespace {

std::vector<std::byte> whole(const EncodedCloud& encoded) {
  std::vector<std::byte> bytes = encoded.front;
  bytes.insert(bytes.end(), encoded.data.begin(), encoded.data.end());
  bytes.push_back(encoded.tail);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView input = std::as_bytes(std::span{data, size});
  const auto view = decode(input);
  if (!view) {
    return 0;
  }
  Cloud cloud;
  cloud.height = view->height;
  cloud.width = view->width;
  cloud.fields = view->fields;
  cloud.point_bytes = view->point_bytes;
  cloud.dense = view->dense;
  cloud.data.assign(view->data.begin(), view->data.end());
  const EncodedCloud encoded = encode(cloud, view->stamp_ns, view->frame_id);
  std::vector<std::byte> again = whole(encoded);
  const auto second = decode(again);
  if (!second || second->stamp_ns != view->stamp_ns || second->frame_id != view->frame_id ||
      second->fields != view->fields || !std::ranges::equal(second->data, view->data) ||
      checksum(*second) != checksum(encoded) || checksum(*view) != checksum(encoded)) {
    std::abort();
  }
  if (!cloud.data.empty()) {
    again[again.size() - 2] ^= std::byte{0x40};  // in its last point
    const auto damaged = decode(again);
    if (!damaged || checksum(*damaged) == checksum(encoded)) {
      std::abort();
    }
  }
  return 0;
}
