// Property: whatever sd::decode() accepts, sd::encode() writes again byte for byte, unless its options array
// breaks off; reading any entry, option or configuration item of it stays in bounds; and an option that can
// be decoded is encoded again byte for byte.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "sd/wire/message.hpp"
#include "sd/wire/offer_options.hpp"

using namespace trestle;
using namespace trestle::sd;

namespace {

template <typename Kind>
void require_same_bytes(const Option& option) {
  const auto decoded = Kind::decode(option);
  if (decoded && !(decoded->encode().view() == option)) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::array<std::byte, 1U << 20U> room;  // at least the -max_len of this target
  const ByteView input = std::as_bytes(std::span{data, size});
  const auto message = decode(input);
  if (!message) {
    if (message.error().offset > input.size()) {
      std::abort();
    }
    return 0;
  }
  for (std::size_t i = 0; i < message->entry_count(); ++i) {
    const Entry entry = message->entry(i);
    for (std::size_t position = 0; position < entry.option_count(); ++position) {
      if (const auto option = message->option_of(entry, position)) {
        static_cast<void>(find_fault(*option));
      }
    }
  }
  if (const auto fault = find_fault(*message); fault && fault->offset > input.size()) {
    std::abort();
  }
  OptionCursor cursor = message->options();
  while (const auto option = cursor.next()) {
    require_same_bytes<EndpointOption>(*option);
    for_each_offer_option([&]<typename Kind>() { require_same_bytes<Kind>(*option); });
  }
  const auto again = encode(*message, room);
  if (again.has_value() == cursor.error().has_value() || (again && !std::ranges::equal(*again, input))) {
    std::abort();
  }
  return 0;
}
