// Property: whatever MessageCursor accepts, encode() writes again byte for byte, and the cursor accounts for
// every byte of the datagram.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "someip/wire/header.hpp"

using namespace trestle;
using namespace trestle::someip;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::array<std::byte, 1U << 20U> room;  // at least the -max_len of this target
  const ByteView input = std::as_bytes(std::span{data, size});
  MessageCursor cursor{input};
  for (std::size_t begin = 0; auto message = cursor.next(); begin = cursor.offset()) {
    const auto again = encode(message->header, message->payload, room);
    if (!again || !std::ranges::equal(*again, input.subspan(begin, cursor.offset() - begin))) {
      std::abort();
    }
  }
  if (!cursor.error() && cursor.offset() != input.size()) {
    std::abort();
  }
  return 0;
}
