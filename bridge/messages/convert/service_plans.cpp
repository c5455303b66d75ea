#include "bridge/messages/convert/service_plans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "bridge/messages/convert/most_bytes.hpp"

namespace trestle::messages {
namespace {

/// @param rules  the key of rules for a message.
bool contains(const TypeTree& tree, std::string_view rules) {
  return std::ranges::find(tree.messages, type_of_rules(rules), &MessageDefinition::name) !=
         tree.messages.end();
}

tl::expected<CallMessagePlan, std::string> compile_message(const TypeTree& tree, const MessageRules& rules) {
  auto plan = ConversionPlan::compile(tree, rules_for(tree, rules));
  if (!plan) {
    return tl::unexpected{std::move(plan.error())};
  }
  return CallMessagePlan{std::move(*plan), tree.root().fields.empty()};
}

}  // namespace

tl::expected<Gathered, ConversionError> CallMessagePlan::cdr_to_someip(ByteView sample,
                                                                       ConversionScratch& scratch) const {
  return is_empty_ ? Gathered{} : plan_.cdr_to_someip(sample, scratch);
}

tl::expected<Gathered, ConversionError> CallMessagePlan::someip_to_cdr(ByteView payload,
                                                                       ConversionScratch& scratch) const {
  if (!is_empty_) {
    return plan_.someip_to_cdr(payload, scratch);
  }
  static constexpr std::array<std::byte, 5> sample{
      std::byte{0}, std::byte{std::endian::native == std::endian::little ? 1 : 0}};
  static constexpr ByteView whole{sample};
  return Gathered{{&whole, 1}, whole.size()};
}

std::optional<std::size_t> CallMessagePlan::most_bytes() const {
  return is_empty_ ? 0 : most_someip_bytes(plan_.program());
}

MessageRules rules_for(const TypeTree& tree, const MessageRules& rules) {
  MessageRules result = rules;
  std::erase_if(result.types, [&](const auto& type) { return !contains(tree, type.first); });
  // Variants may be those of the other message's fields only.
  const auto is_variant = [](const auto& type) { return type_of_rules(type.first) != type.first; };
  const auto is_taken = [&](const std::string& variant) {
    return std::ranges::any_of(result.types, [&](const auto& type) {
      return std::ranges::any_of(type.second.fields,
                                 [&](const auto& field) { return field.second.variant == variant; });
    });
  };
  while (std::erase_if(result.types,
                       [&](const auto& type) { return is_variant(type) && !is_taken(type.first); }) > 0) {
  }
  return result;
}

tl::expected<ServicePlans, std::string> compile_service(const ServiceTypes& types,
                                                        const MessageRules& rules) {
  for (const auto& [name, own] : rules.types) {
    if (!contains(types.request, name) && !contains(types.response, name)) {
      return tl::unexpected{fmt::format("there are rules for {}, which it does not contain", name)};
    }
  }
  auto request = compile_message(types.request, rules);
  if (!request) {
    return tl::unexpected{"request: " + request.error()};
  }
  auto response = compile_message(types.response, rules);
  if (!response) {
    return tl::unexpected{"response: " + response.error()};
  }
  return ServicePlans{std::move(*request), std::move(*response)};
}

// In CDR a message that is the only member of another one has the same bytes as by itself, so the plans of
// the value can be used.
tl::expected<ServicePlans, std::string> compile_field_service(const FieldServiceTypes& types,
                                                              FieldAccess access, const MessageRules& rules) {
  auto response = ConversionPlan::compile(types.value, rules);
  if (!response) {
    return tl::unexpected{std::move(response.error())};
  }
  auto request = access == FieldAccess::get ? ConversionPlan::compile(types.service.request, {})
                                            : ConversionPlan::compile(types.value, rules);
  if (!request) {
    return tl::unexpected{std::move(request.error())};
  }
  return ServicePlans{{std::move(*request), access == FieldAccess::get}, {std::move(*response), false}};
}

}  // namespace trestle::messages
