#include "bridge/inspect/tools/message_text.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "bridge/cli/terminal.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

using Form = cli::PayloadOptions::Form;
using Text = tl::expected<std::string, std::string>;

/// Elements of an array that a terminal shows; as many as `ros2 topic echo`.
constexpr std::size_t shown_on_terminal = 128;

/// The values; nothing when there is no type, or no payload.
Text values_text(ByteView payload, const cli::PayloadOptions& options) {
  if (options.form() == Form::hex || options.values() == nullptr || payload.empty()) {
    return {};
  }
  return options.values()->print(
      payload, options.form() == Form::json ? messages::ValueForm::json : messages::ValueForm::yaml,
      {.longest = cli::is_terminal(STDOUT_FILENO) ? shown_on_terminal : 0});
}

/// The values or the bytes with their key, as a member of a JSON object.
std::string json_member(const std::string& values, ByteView payload) {
  return values.empty() ? fmt::format("\"payload\":\"{}\"", hex_digits(payload))
                        : fmt::format("\"values\":{}", values);
}

}  // namespace

Text answer_text(const someip::Message& answer, const cli::PayloadOptions& options) {
  if (options.form() == Form::hex) {
    return hex_digits(answer.payload) + "\n";
  }
  // The payload of an error does not have the type of the answer.
  const bool good = answer.header.return_code == someip::ReturnCode::ok;
  Text values = good ? values_text(answer.payload, options) : Text{};
  if (!values || options.form() == Form::yaml) {
    return values;
  }
  const someip::Header& header = answer.header;
  return fmt::format("{{\"method\":\"{}\",\"return_code\":{},\"return_code_value\":{},{}}}\n",
                     hex_id(someip::value(header.method)), return_code_name(header.return_code).dump(),
                     static_cast<unsigned>(header.return_code), json_member(*values, answer.payload));
}

Text message_text(const someip::Message& message, const Endpoint* from, const cli::PayloadOptions& options) {
  const std::string id = hex_id(someip::value(message.header.method));
  if (options.form() == Form::hex) {
    return fmt::format("{} {}\n", id, hex_digits(message.payload));
  }
  Text values = values_text(message.payload, options);
  if (!values) {
    return values;
  }
  const unsigned session = someip::value(message.header.session);
  if (options.form() == Form::yaml) {
    return fmt::format("# {} session {}\n{}---\n", id, session, *values);
  }
  const char* const kind = message.header.type == someip::MessageType::notification ? "event" : "method";
  const std::string source = from == nullptr ? "" : fmt::format("\"src\":\"{}\",", someip::to_string(*from));
  return fmt::format("{{\"{}\":\"{}\",\"session\":{},{}{}}}\n", kind, id, session, source,
                     json_member(*values, message.payload));
}

}  // namespace trestle::inspect
