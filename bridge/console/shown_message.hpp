#pragma once
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/map/field_mapping.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/picture/seen_message.hpp"

namespace trestle::console {

/// What a route that maps fields (docs/mapping.md) carries in SOME/IP.
struct ShownMap {
  messages::TypeTree payload;
  messages::FieldMapping mapping;
};

/// The newest message of a route, and what it takes to understand it.
struct ShownMessage {
  std::string route;  ///< its name
  std::string type;   ///< of the topic
  messages::TypeTree tree;
  messages::MessageRules rules;                      ///< of the payload
  std::shared_ptr<const carry::SeenMessage> newest;  ///< null: none has come since somebody looks
  std::optional<ShownMap> map{};                     ///< nothing: the payload is of the same type
};

/// A message in both forms.
struct BothForms {
  std::vector<std::byte> payload;  ///< in SOME/IP
  std::vector<std::byte> sample;   ///< CDR in the host's byte order, with its encapsulation header
};

/// @param shown  has a message. @return or why it is none of the route's type, or cannot be mapped.
[[nodiscard]] tl::expected<BothForms, std::string> both_forms(const ShownMessage& shown);

/// The message as a JSON object: "route", "type", where it is another one "payload_type", and if there is a
/// message "at_ns", "size", "values" (of the topic's type, as YAML, long arrays cut), "layout" (what its
/// bytes are in SOME/IP, at most most_shown_ranges), "more_ranges", and "fault" where it is no message of the
/// type, or cannot be mapped.
[[nodiscard]] std::string message_json(const ShownMessage& shown);

inline constexpr std::size_t most_shown_ranges = 400;

}  // namespace trestle::console
