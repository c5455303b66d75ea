#include "bridge/carry/runtime/failure_reply.hpp"

#include <algorithm>

#include "bridge/messages/values/sample_builder.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t max_reason = 1024;
constexpr std::size_t max_reply = std::size_t{1} << 20U;  // of defaults

const messages::Field* member(const messages::TypeTree& type, std::string_view name,
                              messages::Primitive primitive) {
  const auto& fields = type.root().fields;
  const auto found = std::ranges::find(fields, name, &messages::Field::name);
  return found != fields.end() && found->type.primitive == primitive &&
                 found->type.array == messages::ArrayKind::none
             ? &*found
             : nullptr;
}

messages::TextValue element(const std::string& key, messages::TextValue::Kind kind, std::string text) {
  messages::TextValue value;
  value.kind = kind;
  value.key = key;
  value.text = std::move(text);
  return value;
}

}  // namespace

std::optional<FailureReply> FailureReply::of(std::string_view service, const messages::TypeTree& response) {
  FailureReply reply{response};
  if (service == "action_msgs/srv/CancelGoal") {
    reply.code_member_ = "return_code";
    reply.only_when_certain_ = true;
    return reply;
  }
  // A goal that is not accepted; a result of a goal that nobody knows. Both are the defaults.
  if (service.find("/action/") != std::string_view::npos) {
    reply.only_when_certain_ = true;
    return reply;
  }
  if (member(response, "success", messages::Primitive::boolean) == nullptr) {
    return std::nullopt;
  }
  for (const char* name : {"message", "error_message", "status_message"}) {
    if (const messages::Field* const reason = member(response, name, messages::Primitive::string);
        reason != nullptr && reply.reason_member_.empty()) {
      reply.reason_member_ = name;
      const std::size_t bound = reason->type.string_bound;
      reply.longest_reason_ = bound == 0 ? max_reason : std::min(bound, max_reason);
    }
  }
  return reply;
}

std::optional<std::vector<std::byte>> FailureReply::sample(std::string_view reason, bool is_certain) const {
  if (only_when_certain_ && !is_certain) {
    return std::nullopt;
  }
  messages::TextValue text;
  text.kind = messages::TextValue::Kind::mapping;
  if (member(response_, "success", messages::Primitive::boolean) != nullptr) {  // its default may be another
    text.elements.push_back(element("success", messages::TextValue::Kind::literal, "false"));
  }
  if (!reason_member_.empty()) {
    text.elements.push_back(element(reason_member_, messages::TextValue::Kind::quoted,
                                    std::string{reason.substr(0, longest_reason_)}));
  }
  if (!code_member_.empty()) {
    text.elements.push_back(
        element(code_member_, messages::TextValue::Kind::literal, "1"));  // ERROR_REJECTED
  }
  auto sample = messages::build_sample(text, response_, max_reply);
  return sample ? std::optional{std::move(*sample)} : std::nullopt;
}

}  // namespace trestle::carry
