#pragma once
#include "bridge/describe/interfaces.hpp"
#include "bridge/inspect/decode/message_json.hpp"

/// What interface descriptions say of messages. docs/decode.md documents the fields.
namespace trestle::inspect {

/// Adds "service_name", and "method_name", "event_name" or "field_name"; a field also has "field_part".
void add_names(Json& object, const describe::Interfaces& interfaces, const describe::ServiceElement& element);

/// Adds "eventgroup_name": its name, or where the description has none the events in it, "moved, level".
void add_eventgroup_name(Json& object, const describe::Interfaces* interfaces, someip::ServiceId service,
                         someip::EventgroupId eventgroup);

/// The content of a message of an element; null: messages of this kind carry something else, errors.
[[nodiscard]] const describe::Content* content_of(const describe::Interfaces& interfaces,
                                                  const describe::ServiceElement& element,
                                                  const someip::Header& header);

/// Where a payload does not fit its description.
struct Misfit {
  std::size_t offset = 0;  ///< in the payload
  std::string field{};     ///< "obstacles[1].name"; empty: as a whole
  std::string detail{};
};
/// Nothing: it fits, or the description does not say what it is.
/// @param has_header  its E2E header, if the description has one, is in the payload.
[[nodiscard]] std::optional<Misfit> misfit_of(const describe::Content& content, ByteView payload,
                                              bool has_header = true);
/// Adds "values", and "e2e" where there is a header; nothing of these for payloads that are not known.
[[nodiscard]] std::optional<Misfit> add_values(Json& object, const describe::Content& content,
                                               ByteView payload);

/// The members of an object, without its braces: "" or `"a":1,`.
[[nodiscard]] std::string members_text(const Json& object);

}  // namespace trestle::inspect
