// Property: what is printed of a payload reads back and prints again as the same text, in every form; the
// bytes come back too, as far as converting the payload to CDR and back keeps them, but for NaNs and for
// characters that are none. (They may not fit any more: U+FFFD has more bytes than what it stands for.)
#include "fuzz/values_types.hpp"

using namespace trestle;
using namespace trestle::fuzz;
using messages::BytesForm;
using messages::ValueForm;

namespace {

bool is_exact(std::string_view json) {
  return json.find("\"NaN\"") == std::string_view::npos &&
         json.find("\xef\xbf\xbd") == std::string_view::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteView input = std::as_bytes(std::span{data, size});
  const messages::MessageValues* const values = choose_values(input);
  if (values == nullptr || size > 4096) {
    return 0;
  }
  const auto json = values->print(input, ValueForm::json);
  for (const ValueForm form : {ValueForm::json, ValueForm::yaml}) {
    for (const BytesForm bytes : {BytesForm::list, BytesForm::base64, BytesForm::hex}) {
      const auto text = values->print(input, form, {.bytes = bytes});
      require(text.has_value() == json.has_value());
      require(values->print(input, form, {.bytes = bytes, .longest = 2}).has_value() == json.has_value());
      if (!text) {
        continue;
      }
      const auto sample = values->parse_sample(*text, form);
      require(sample || !is_exact(*json));
      if (!sample) {
        continue;
      }
      require(values->print_sample(*sample, form, {.bytes = bytes}) == text);
      const auto payload = values->parse(*text, form);
      if (payload && is_exact(*json)) {
        const auto again = values->parse_sample(*values->print(*payload, form), form);
        require(again && *again == *sample);
      }
    }
  }
  return 0;
}
