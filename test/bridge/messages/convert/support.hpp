#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/parsers.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "test/bytes.hpp"

namespace trestle::test {

/// The type that a .msg text without nested messages defines.
inline messages::TypeTree tree_of(std::string_view msg) {
  auto parsed = messages::parse_msg(msg, "test_msgs/msg/Test", "Test.msg");
  if (!parsed) {
    throw std::invalid_argument{to_string(parsed.error())};
  }
  messages::TypeTree tree;
  tree.messages.push_back(std::move(*parsed));
  return tree;
}

inline messages::TypeTree builtin(std::string_view name) {
  messages::TypeLibrary library;
  auto tree = library.resolve(name);
  if (!tree) {
    throw std::invalid_argument{to_string(tree.error())};
  }
  return std::move(*tree);
}

/// Under rules of any kind.
inline messages::ConversionPlan plan_with(
    const messages::TypeTree& tree, const messages::MessageRules& rules,
    std::size_t reference_from = messages::ConversionPlan::default_reference_from,
    messages::ConversionPlan::Execution execution = messages::ConversionPlan::Execution::quick) {
  auto plan = messages::ConversionPlan::compile(tree, rules, reference_from, execution);
  if (!plan) {
    throw std::invalid_argument{plan.error()};
  }
  return std::move(*plan);
}

inline messages::ConversionPlan plan_of(
    const messages::TypeTree& tree, const someip::PayloadRules& rules = {},
    std::size_t reference_from = messages::ConversionPlan::default_reference_from,
    messages::ConversionPlan::Execution execution = messages::ConversionPlan::Execution::quick) {
  return plan_with(tree, rules, reference_from, execution);
}

using Converted = tl::expected<messages::Gathered, messages::ConversionError>;

/// The result in hexadecimal, or the error in words. The input is copied to memory of exactly its size, so
/// that the address sanitizer sees every read beyond it.
inline std::string shown(const Converted& result) {
  return result ? to_hex(joined(*result)) : place_of(result.error());
}
inline std::string to_someip(const messages::ConversionPlan& plan, ByteView cdr) {
  messages::ConversionScratch scratch;
  const std::vector<std::byte> exact{cdr.begin(), cdr.end()};
  return shown(plan.cdr_to_someip(exact, scratch));
}
inline std::string to_someip(const messages::ConversionPlan& plan, std::string_view cdr) {
  return to_someip(plan, hex(cdr));
}
inline std::string to_cdr(const messages::ConversionPlan& plan, ByteView payload) {
  messages::ConversionScratch scratch;
  const std::vector<std::byte> exact{payload.begin(), payload.end()};
  return shown(plan.someip_to_cdr(exact, scratch));
}
inline std::string to_cdr(const messages::ConversionPlan& plan, std::string_view payload) {
  return to_cdr(plan, hex(payload));
}

/// The digits without the blanks that make them readable.
inline std::string compact(std::string_view digits) {
  return to_hex(hex(digits));
}

}  // namespace trestle::test
