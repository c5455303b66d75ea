#pragma once
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/picture/seen_message.hpp"

namespace trestle::console {

/// The newest message of a route, and what it takes to understand it.
struct ShownMessage {
  std::string route;  ///< its name
  std::string type;
  messages::TypeTree tree;
  messages::MessageRules rules;
  std::shared_ptr<const carry::SeenMessage> newest;  ///< null: none has come since somebody looks
};

/// A message in both forms.
struct BothForms {
  std::vector<std::byte> payload;  ///< in SOME/IP
  std::vector<std::byte> sample;   ///< CDR in the host's byte order, with its encapsulation header
};

/// @param shown  has a message. @return or why it is none of the route's type.
[[nodiscard]] tl::expected<BothForms, std::string> both_forms(const ShownMessage& shown);

/// The message as a JSON object: "route", "type", and if there is one "at_ns", "size", "values" (as YAML,
/// long arrays cut), "layout" (what its bytes are in SOME/IP, at most most_shown_ranges), "more_ranges", and
/// "fault" where its bytes are no message of the type.
[[nodiscard]] std::string message_json(const ShownMessage& shown);

inline constexpr std::size_t most_shown_ranges = 400;

}  // namespace trestle::console
