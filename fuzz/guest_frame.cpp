// Property: whatever decode() accepts of what a tool says to a bridge, or a bridge to a tool, encode() writes
// again byte for byte; and it has no more than that.
//
// Input: a frame without its length.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "bridge/guest/frame.hpp"

using namespace trestle;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView input = std::as_bytes(std::span{data, size});
  const auto frame = guest::decode(input);
  if (!frame) {
    return 0;
  }
  if (!std::ranges::equal(ByteView{guest::encode(*frame)}.subspan(guest::length_bytes), input)) {
    std::abort();
  }
  if (const auto* const event = std::get_if<guest::Event>(&*frame)) {
    // The other way to write one, from a message, where it is one.
    const auto message = someip::decode(event->message);
    if (message && message->size() == event->message.size()) {
      std::vector<std::byte> bytes;
      guest::append_event(bytes, *message, event->from, event->lost);
      if (bytes != guest::encode(*frame)) {
        std::abort();
      }
    }
  }
  return 0;
}
