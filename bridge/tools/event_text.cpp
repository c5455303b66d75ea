#include "bridge/tools/event_text.hpp"

#include <fmt/format.h>

#include "bridge/decode/message_json.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {

tl::expected<std::string, std::string> message_text(const someip::Message& message, const Endpoint& from,
                                                    const PayloadOptions& options, std::size_t longest) {
  using Form = PayloadOptions::Form;
  const std::string event = hex_id(someip::value(message.header.method));
  if (options.form() == Form::hex) {
    return fmt::format("{} {}\n", event, hex_digits(message.payload));
  }
  const bool json = options.form() == Form::json;
  std::string values;
  if (options.values() != nullptr) {
    auto text = options.values()->print(message.payload, json ? ValueForm::json : ValueForm::yaml,
                                        {.longest = longest});
    if (!text) {
      return tl::unexpected{std::move(text.error())};
    }
    values = std::move(*text);
  }
  if (!json) {
    return fmt::format("# {} session {}\n{}---\n", event, someip::value(message.header.session), values);
  }
  const std::string payload = values.empty() ? fmt::format("\"payload\":\"{}\"", hex_digits(message.payload))
                                             : fmt::format("\"values\":{}", values);
  return fmt::format("{{\"event\":\"{}\",\"session\":{},\"src\":\"{}\",{}}}\n", event,
                     someip::value(message.header.session), someip::to_string(from), payload);
}

}  // namespace trestle::bridge
