#include "bridge/inspect/decode/names_json.hpp"

#include <fmt/format.h>

#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::inspect {
namespace {

using Part = describe::ServiceElement::Part;
using someip::MessageType;

/// A message type without the flag of segments.
MessageType whole(MessageType type) {
  return MessageType{static_cast<std::uint8_t>(static_cast<std::uint8_t>(type) & 0xdfU)};
}

}  // namespace

void add_names(Json& object, const describe::Interfaces& interfaces,
               const describe::ServiceElement& element) {
  object["service_name"] = interfaces.name_of(element.service);
  const char* const key = element.part == Part::event    ? "event_name"
                          : element.part == Part::method ? "method_name"
                                                         : "field_name";
  object[key] = element.member_name;
  if (element.is_field()) {
    object["field_part"] = describe::field_part(element.part);
  }
}

void add_eventgroup_name(Json& object, const describe::Interfaces* interfaces, someip::ServiceId service,
                         someip::EventgroupId eventgroup) {
  const auto title =
      describe::title_of(interfaces == nullptr ? nullptr : interfaces->service(service), eventgroup);
  if (!title.text.empty()) {
    object["eventgroup_name"] = title.text;
  }
}

const describe::Content* content_of(const describe::Interfaces& interfaces,
                                    const describe::ServiceElement& element, const someip::Header& header) {
  switch (whole(header.type)) {
    case MessageType::request:
    case MessageType::request_no_return:
      return element.is_event() ? nullptr : &interfaces.content(element);
    case MessageType::notification:
      return element.is_event() ? &interfaces.content(element) : nullptr;
    case MessageType::response:
      return element.is_event() || header.return_code != someip::ReturnCode::ok ? nullptr
                                                                                : &interfaces.answer(element);
    default:
      return nullptr;
  }
}

std::optional<Misfit> misfit_of(const describe::Content& content, ByteView payload, bool has_header) {
  if (!content.values) {
    return std::nullopt;
  }
  const std::size_t header_bytes = has_header ? content.e2e.bytes : 0;
  std::vector<std::byte> header;
  std::vector<std::byte> rest{payload.begin(), payload.end()};
  if (has_header) {
    rest = content.without_header(payload, &header);
  }
  if (header.size() != header_bytes) {
    return Misfit{payload.size(), "",
                  fmt::format("an E2E header of {} bytes at byte {} wanted, {} bytes there",
                              content.e2e.bytes, content.e2e.at, payload.size())};
  }
  const auto fault = content.values->fault_of(rest);
  if (!fault) {
    return std::nullopt;
  }
  const std::size_t before = fault->offset >= content.e2e.at ? header_bytes : 0;
  return Misfit{
      fault->offset + before, fault->field,
      fmt::format("{}{}{}", to_string(fault->fault), fault->expected.empty() ? "" : ": ", fault->expected)};
}

std::optional<Misfit> add_values(Json& object, const describe::Content& content, ByteView payload) {
  if (content.is_empty && payload.size() >= content.e2e.bytes) {
    object["values"] = Json::object();
  }
  if (!content.values) {
    return std::nullopt;
  }
  if (auto misfit = misfit_of(content, payload)) {
    return misfit;
  }
  std::vector<std::byte> header;
  const auto text =
      content.values->print(content.without_header(payload, &header), messages::ValueForm::json);
  if (!text) {
    return Misfit{0, "", text.error()};
  }
  if (!header.empty()) {
    object["e2e"] = hex_digits(header);
  }
  object["values"] = Json::parse(*text);
  return std::nullopt;
}

std::string members_text(const Json& object) {
  if (object.empty()) {
    return {};
  }
  const std::string text =
      documents::printable_json(object.dump(-1, ' ', false, Json::error_handler_t::replace));
  return text.substr(1, text.size() - 2) + ",";
}

}  // namespace trestle::inspect
