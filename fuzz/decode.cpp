// Property: whatever a datagram holds, the objects that `trestle decode` prints about it are valid JSON and
// account for each of its bytes once, in order: messages by their length and their payload, the rest by
// "bytes".
#include <cstdlib>
#include <string_view>

#include "bridge/inspect/decode/message_decoder.hpp"

using namespace trestle;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// Whether `digits` are those of the bytes that end at `end`.
bool ends_at(ByteView input, std::size_t end, std::string_view digits) {
  const std::size_t size = digits.size() / 2;
  return end <= input.size() && size <= end && digits == inspect::hex_digits(input.subspan(end - size, size));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView input = std::as_bytes(std::span{data, size});
  std::size_t accounted = 0;
  bool ended = false;
  bool any_error = false;
  inspect::MessageDecoder decoder{
      false,
      {[&](const inspect::Json& object) {
         require(!ended && object["offset"] == accounted);
         const inspect::Json again =
             inspect::Json::parse(object.dump(-1, ' ', false, inspect::Json::error_handler_t::replace));
         require(again["offset"] == accounted);
         if (object.contains("error")) {
           any_error = true;
           require(object["error"]["offset"].get<std::size_t>() <= size);
         }
         if (object.contains("payload")) {
           accounted += 8 + object["length"].get<std::size_t>();
           require(ends_at(input, accounted, object["payload"].get<std::string>()));
         } else {
           require(object.contains("error"));
           require(object["bytes"] == inspect::hex_digits(input.subspan(accounted)));
           ended = true;
         }
       },
       {}}};
  const bool well_formed = decoder.datagram({}, input);
  require(ended || accounted == size);
  require(well_formed == !any_error);
  return 0;
}
