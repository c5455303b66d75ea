// Property: any text either is refused, with a place within it, or becomes a payload that prints as a text
// which becomes the same payload. The third byte chooses between YAML and JSON.
#include <algorithm>

#include "fuzz/values_types.hpp"

using namespace trestle;
using namespace trestle::fuzz;
using messages::ValueForm;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteView input = std::as_bytes(std::span{data, size});
  const messages::MessageValues* const values = choose_values(input);
  if (values == nullptr || input.empty() || size > 4096) {
    return 0;
  }
  const ValueForm form = (input[0] & std::byte{1}) == std::byte{0} ? ValueForm::yaml : ValueForm::json;
  const std::string text{reinterpret_cast<const char*>(input.data()) + 1, input.size() - 1};
  const auto payload = values->parse(text, form);
  if (!payload) {
    require(!payload.error().text.empty());
    require(payload.error().place.line <=
            std::ranges::count(text, '\n') + std::ranges::count(text, '\r') + 1);
    return 0;
  }
  const auto printed = values->print(*payload, form);
  require(printed.has_value());
  const auto again = values->parse(*printed, form);
  require(again.has_value() && *again == *payload);
  return 0;
}
