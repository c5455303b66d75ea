#include "bridge/messages/types/parsers.hpp"

#include <utility>

namespace trestle::messages {
namespace {

Field field_of(std::string name, std::string message) {
  return {.name = std::move(name), .type = {.message = std::move(message)}, .default_value = {}};
}

Field field_of(std::string name, Primitive primitive) {
  return {.name = std::move(name), .type = {.primitive = primitive}, .default_value = {}};
}

Field at_most_one(Field field) {
  field.type.array = ArrayKind::bounded;
  field.type.array_size = 1;
  return field;
}

void add_service_event(std::vector<MessageDefinition>& messages, const std::string& service,
                       const std::string& file) {
  messages.push_back({service + "_Event",
                      file,
                      {field_of("info", "service_msgs/msg/ServiceEventInfo"),
                       at_most_one(field_of("request", service + "_Request")),
                       at_most_one(field_of("response", service + "_Response"))},
                      {}});
}

void add_action_messages(std::vector<MessageDefinition>& messages, const std::string& action,
                         const std::string& file) {
  const Field goal_id = field_of("goal_id", "unique_identifier_msgs/msg/UUID");
  messages.push_back({action + "_SendGoal_Request", file, {goal_id, field_of("goal", action + "_Goal")}, {}});
  messages.push_back(
      {action + "_SendGoal_Response",
       file,
       {field_of("accepted", Primitive::boolean), field_of("stamp", "builtin_interfaces/msg/Time")},
       {}});
  add_service_event(messages, action + "_SendGoal", file);
  messages.push_back({action + "_GetResult_Request", file, {goal_id}, {}});
  messages.push_back({action + "_GetResult_Response",
                      file,
                      {field_of("status", Primitive::int8), field_of("result", action + "_Result")},
                      {}});
  add_service_event(messages, action + "_GetResult", file);
  messages.push_back(
      {action + "_FeedbackMessage", file, {goal_id, field_of("feedback", action + "_Feedback")}, {}});
}

}  // namespace

void add_generated_messages(std::vector<MessageDefinition>& messages, const InterfaceName& name,
                            const std::string& file) {
  if (name.kind == InterfaceKind::service) {
    add_service_event(messages, name.full(), file);
  } else if (name.kind == InterfaceKind::action) {
    add_action_messages(messages, name.full(), file);
  }
}

std::vector<std::string> message_names(const InterfaceName& name) {
  const std::string full = name.full();
  switch (name.kind) {
    case InterfaceKind::message:
      break;
    case InterfaceKind::service:
      return {full + "_Request", full + "_Response"};
    case InterfaceKind::action:
      return {full + "_Goal", full + "_Result", full + "_Feedback"};
  }
  return {full};
}

tl::expected<std::vector<MessageDefinition>, TypeError> parse_interface(std::string_view text,
                                                                        const InterfaceName& name,
                                                                        const std::string& file) {
  auto messages = parse_parts(text, message_names(name), file);
  if (messages) {
    add_generated_messages(*messages, name, file);
  }
  return messages;
}

}  // namespace trestle::messages
