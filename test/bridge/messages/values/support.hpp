#pragma once
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "bridge/messages/values/message_values.hpp"
#include "test/bridge/messages/convert/support.hpp"

namespace trestle::test {

/// The values of a type that a .msg text without nested messages defines.
/// Under rules of any kind.
inline messages::MessageValues values_with(messages::TypeTree tree, const messages::MessageRules& rules) {
  auto values = messages::MessageValues::make(std::move(tree), rules);
  if (!values) {
    throw std::invalid_argument{values.error()};
  }
  return std::move(*values);
}

inline messages::MessageValues values_of(messages::TypeTree tree, const someip::PayloadRules& rules = {}) {
  return values_with(std::move(tree), rules);
}

/// Two messages of two packages: "test_msgs/msg/Test" with the given text, which may use "Part".
inline messages::TypeTree nested_tree(std::string_view part, std::string_view test) {
  messages::TypeTree tree;
  tree.messages.push_back(*messages::parse_msg(part, "test_msgs/msg/Part", "Part.msg"));
  tree.messages.push_back(*messages::parse_msg(test, "test_msgs/msg/Test", "Test.msg"));
  return tree;  // message_index 0 is Part
}

/// The text, or the error.
inline std::string yaml(const messages::MessageValues& values, std::string_view payload,
                        const messages::PrintOptions& options = {}) {
  const auto text = values.print(hex(payload), messages::ValueForm::yaml, options);
  return text ? *text : "error: " + text.error();
}
inline std::string json(const messages::MessageValues& values, std::string_view payload,
                        const messages::PrintOptions& options = {}) {
  const auto text = values.print(hex(payload), messages::ValueForm::json, options);
  return text ? *text : "error: " + text.error();
}

/// The payload in hexadecimal, or the error.
inline std::string from_yaml(const messages::MessageValues& values, std::string_view text) {
  const auto payload = values.parse(text, messages::ValueForm::yaml);
  return payload ? to_hex(*payload) : to_string(payload.error());
}
inline std::string from_json(const messages::MessageValues& values, std::string_view text) {
  const auto payload = values.parse(text, messages::ValueForm::json);
  return payload ? to_hex(*payload) : to_string(payload.error());
}

}  // namespace trestle::test
