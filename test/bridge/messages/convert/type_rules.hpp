#pragma once
#include <algorithm>
#include <stdexcept>

#include "test/bridge/messages/convert/support.hpp"

/// Nested types and rules for them.
namespace trestle::test {

/// Types of the package test_msgs, each with its text; what they use stands before them. The last is the
/// root.
inline messages::TypeTree trees(std::initializer_list<std::pair<const char*, const char*>> messages) {
  messages::TypeTree tree;
  for (const auto& [name, text] : messages) {
    auto parsed = messages::parse_msg(text, std::string{"test_msgs/msg/"} + name, name);
    if (!parsed) {
      throw std::invalid_argument{to_string(parsed.error())};
    }
    for (messages::Field& field : parsed->fields) {
      const auto of_field = [&](const messages::MessageDefinition& other) {
        return other.name == field.type.message;
      };
      field.type.message_index =
          static_cast<std::size_t>(std::ranges::find_if(tree.messages, of_field) - tree.messages.begin());
    }
    tree.messages.push_back(std::move(*parsed));
  }
  return tree;
}

inline messages::ConversionPlan plan(const messages::TypeTree& tree, const messages::MessageRules& rules) {
  auto compiled = messages::ConversionPlan::compile(tree, rules);
  if (!compiled) {
    throw std::invalid_argument{compiled.error()};
  }
  return std::move(*compiled);
}

inline std::string compile_error(const messages::TypeTree& tree, const messages::MessageRules& rules) {
  const auto compiled = messages::ConversionPlan::compile(tree, rules);
  return compiled ? "no error" : compiled.error();
}

inline void expect_both_ways(const messages::ConversionPlan& plan, std::string_view cdr,
                             std::string_view payload) {
  EXPECT_EQ(to_someip(plan, cdr), compact(payload));
  EXPECT_EQ(to_cdr(plan, payload), compact(cdr));
}

}  // namespace trestle::test
