#include "bridge/inspect/tools/message_text.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "bridge/cli/protection.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/inspect/decode/left_over.hpp"
#include "bridge/inspect/decode/names_json.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

using Form = cli::PayloadOptions::Form;

/// Elements of an array that a terminal shows; as many as `ros2 topic echo`.
constexpr std::size_t shown_on_terminal = 128;

/// A payload as the options want it.
struct Shown {
  std::string values{};  ///< empty: there is no type, or no payload
  std::string fault{};
  std::string e2e{};     ///< hexadecimal digits of the E2E header, of one that was not checked
  std::string check{};   ///< JSON members: what the E2E check found
  std::string misfit{};  ///< JSON of where it does not fit its description
  std::optional<LeftOver> left_over{};
};

/// The content that the description gives it; null: none does, or --type says something else.
const describe::Content* content_of(const cli::PayloadOptions& options) {
  const auto* const described = options.described();
  if (described == nullptr) {
    return nullptr;
  }
  const describe::Content& content = *described->content;
  return options.values() == nullptr || (content.values && options.values() == &*content.values) ? &content
                                                                                                 : nullptr;
}

/// @param message  one with a check has no E2E header in its payload.
Shown shown(const someip::Message& message, const cli::PayloadOptions& options) {
  using Status = someip::e2e::CheckStatus;
  const ByteView payload = message.payload;
  const bool is_checked = message.check != nullptr;
  const bool is_bad = is_checked && message.check->status == Status::error;
  Shown result;
  if (is_checked) {
    result.check = fmt::format("\"e2e_check\":\"{}\",", to_string(message.check->status));
    result.check += is_bad ? fmt::format("\"e2e_fault\":\"{}\",", to_string(message.check->fault)) : "";
  }
  const describe::Content* const content = content_of(options);
  if (options.form() == Form::hex || is_bad || (payload.empty() && content == nullptr)) {
    return result;
  }
  std::vector<std::byte> without_header;
  ByteView rest = payload;
  if (content != nullptr) {
    if (const auto misfit = misfit_of(*content, payload, !is_checked)) {
      result.fault = fmt::format("{}: {} at byte {}{}: {}", options.described()->element->name,
                                 misfit->detail, misfit->offset,
                                 misfit->field.empty() ? "" : " in " + misfit->field, hex_digits(payload));
      Json error;
      error["offset"] = misfit->offset;
      error["field"] = misfit->field;
      error["detail"] = misfit->detail;
      result.misfit = error.dump();
      return result;
    }
    const auto& described = *options.described();
    result.left_over = left_over(*described.interfaces, *described.element, *content, payload, !is_checked);
    if (!is_checked) {
      std::vector<std::byte> header;
      without_header = content->without_header(payload, &header);
      rest = without_header;
      result.e2e = hex_digits(header);
    }
  }
  if (options.values() == nullptr) {
    return result;
  }
  auto text = options.values()->print(
      rest, options.form() == Form::json ? messages::ValueForm::json : messages::ValueForm::yaml,
      {.longest = cli::is_terminal(STDOUT_FILENO) ? shown_on_terminal : 0});
  (text ? result.values : result.fault) = text ? std::move(*text) : std::move(text.error());
  return result;
}

/// The values or the bytes with their key, as members of a JSON object.
std::string json_members(const Shown& shown, ByteView payload) {
  const std::string e2e = shown.e2e.empty() ? "" : fmt::format("\"e2e\":\"{}\",", shown.e2e);
  const std::string error = shown.misfit.empty() ? "" : fmt::format(",\"error\":{}", shown.misfit);
  const std::string left_over =
      shown.left_over ? fmt::format(",\"left_over\":{}", to_json(*shown.left_over).dump()) : "";
  return e2e + shown.check +
         (shown.values.empty() ? fmt::format("\"payload\":\"{}\"{}", hex_digits(payload), error)
                               : fmt::format("\"values\":{}", shown.values)) +
         left_over;
}

/// The values as YAML, and a comment where they are not all of the payload.
std::string yaml_of(const Shown& shown) {
  return shown.values + (shown.left_over ? "# " + to_string(*shown.left_over) + "\n" : "");
}

std::string names_of(const cli::PayloadOptions& options) {
  const auto* const described = options.described();
  Json names;
  if (described != nullptr) {
    add_names(names, *described->interfaces, *described->element);
  }
  return members_text(names);
}

}  // namespace

PayloadText answer_text(const someip::Message& answer, const cli::PayloadOptions& options) {
  if (options.form() == Form::hex) {
    return {hex_digits(answer.payload) + "\n", {}};
  }
  // The payload of an error does not have the type of the answer.
  const bool good = answer.header.return_code == someip::ReturnCode::ok;
  Shown values = good ? shown(answer, options) : Shown{};
  if (options.form() == Form::yaml || (!values.fault.empty() && values.misfit.empty())) {
    return {yaml_of(values), std::move(values.fault)};
  }
  const someip::Header& header = answer.header;
  return {fmt::format("{{\"method\":\"{}\",{}\"return_code\":{},\"return_code_value\":{},{}}}\n",
                      hex_id(someip::value(header.method)), names_of(options),
                      return_code_name(header.return_code).dump(), static_cast<unsigned>(header.return_code),
                      json_members(values, answer.payload)),
          std::move(values.fault)};
}

PayloadText message_text(const someip::Message& message, const Endpoint* from,
                         const cli::PayloadOptions& options) {
  const std::string id = hex_id(someip::value(message.header.method));
  const std::string name = options.described() != nullptr ? options.described()->element->name : id;
  std::string failed = message.check == nullptr ? "" : cli::failed_check(*message.check, name);
  if (options.form() == Form::hex) {
    return {fmt::format("{} {}\n", name, hex_digits(message.payload)), {}, std::move(failed)};
  }
  Shown values = shown(message, options);
  if (!values.fault.empty() && values.misfit.empty()) {
    return {{}, std::move(values.fault), std::move(failed)};
  }
  const unsigned session = someip::value(message.header.session);
  if (options.form() == Form::yaml) {
    const bool is_bad = message.check != nullptr && message.check->status == someip::e2e::CheckStatus::error;
    if (!values.fault.empty() || is_bad) {
      return {{},
              std::move(values.fault),
              is_bad ? fmt::format("{}: {}", failed, hex_digits(message.payload)) : std::move(failed)};
    }
    return {fmt::format("# {} session {}\n{}---\n", name, session, yaml_of(values)), {}, std::move(failed)};
  }
  const char* const kind = message.header.type == someip::MessageType::notification ? "event" : "method";
  const std::string source = from == nullptr ? "" : fmt::format("\"src\":\"{}\",", someip::to_string(*from));
  return {fmt::format("{{\"{}\":\"{}\",{}\"session\":{},{}{}}}\n", kind, id, names_of(options), session,
                      source, json_members(values, message.payload)),
          std::move(values.fault), std::move(failed)};
}

}  // namespace trestle::inspect
