// Property: a PointCloud2 that is accepted says the same after being encoded anew, and checking a tag never
// calls a message intact that is changed in any byte of its data.
#include <algorithm>
#include <cstdlib>

#include "bridge/demo/tagged_cloud.hpp"

using namespace trestle;
using namespace trestle::bridge::demo;

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
  (void)check_tagged(input);
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
  const std::vector<std::byte> again = whole(encode(cloud, view->stamp_ns, view->frame_id));
  const auto second = decode(again);
  if (!second || second->stamp_ns != view->stamp_ns || second->frame_id != view->frame_id ||
      second->fields != view->fields || !std::ranges::equal(second->data, view->data)) {
    std::abort();
  }
  std::vector<std::byte> tagged = whole(encode_tagged(cloud, 1, view->stamp_ns));
  const auto intact = check_tagged(tagged);
  if (!intact || !intact->intact) {
    std::abort();
  }
  if (!cloud.data.empty()) {
    tagged[tagged.size() - 2] ^= std::byte{0x40};  // in its last point
    const auto damaged = check_tagged(tagged);
    if (damaged && damaged->intact) {
      std::abort();
    }
  }
  return 0;
}
