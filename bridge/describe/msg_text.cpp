#include <fmt/format.h>

#include <algorithm>

#include "bridge/describe/lower.hpp"
#include "bridge/messages/types/msg_comments.hpp"

namespace trestle::describe {
namespace {

using messages::ArrayKind;

void add_comment(std::string& text, std::string_view comment) {
  while (!comment.empty()) {
    const std::size_t end = comment.find_first_of("\r\n");
    const std::string_view line = comment.substr(0, end);
    if (!line.empty()) {
      text += fmt::format("# {}\n", line);
    }
    comment = end == std::string_view::npos ? std::string_view{} : comment.substr(end + 1);
  }
}

std::string notes_text(const Lowered& lowered, const std::string& name) {
  std::string text;
  if (const auto notes = lowered.notes.find(name); notes != lowered.notes.end()) {
    add_comment(text, messages::comment_lines(notes->second.description, notes->second.unit));
  }
  return text;
}

/// Of a message or service, where brackets are no unit. What stands directly above a field is about the
/// field.
std::string head_text(const Lowered& lowered, const std::string& name, std::string_view mark = {}) {
  std::string text;
  if (const auto notes = lowered.notes.find(name); notes != lowered.notes.end()) {
    add_comment(text, notes->second.description);
    add_comment(text, notes->second.unit.empty() ? "" : "unit: " + notes->second.unit);
  }
  text += mark.empty() ? "" : fmt::format("{}{}\n", messages::mark_comment, mark);
  text += text.empty() ? "" : "\n";
  return text;
}

std::string type_text(const messages::FieldType& type, std::string_view package) {
  std::string text;
  if (type.primitive) {
    text = messages::to_string(*type.primitive);
    text += type.string_bound == 0 ? "" : fmt::format("<={}", type.string_bound);
  } else {
    const std::string_view full = type.message;
    const std::string_view of = full.substr(0, full.find('/'));
    const std::string_view name = full.substr(full.rfind('/') + 1);
    // A Header without a package may be that of std_msgs.
    text = of == package && name != "Header" ? std::string{name} : fmt::format("{}/{}", of, name);
  }
  switch (type.array) {
    case ArrayKind::none:
      return text;
    case ArrayKind::fixed:
      return text + fmt::format("[{}]", type.array_size);
    case ArrayKind::bounded:
      return text + fmt::format("[<={}]", type.array_size);
    case ArrayKind::unbounded:
      return text + "[]";
  }
  return text;
}

/// A message, or a part of a service.
std::string part_text(const Lowered& lowered, const messages::MessageDefinition& definition) {
  std::string text = head_text(lowered, definition.name, definition.mark);
  for (const messages::Constant& constant : definition.constants) {
    text += notes_text(lowered, definition.name + "." + constant.name);
    text += fmt::format("{} {}={}\n", messages::to_string(constant.type), constant.name, constant.value);
  }
  const std::string_view package = std::string_view{definition.name}.substr(0, definition.name.find('/'));
  for (const messages::Field& field : definition.fields) {
    text += notes_text(lowered, definition.name + "." + field.name);
    text += fmt::format("{} {}{}{}", type_text(field.type, package), field.name,
                        field.default_value.empty() ? "" : " ", field.default_value);
    text += field.mark.empty() ? "\n" : fmt::format("  {}{}\n", messages::mark_comment, field.mark);
  }
  return text;
}

}  // namespace

std::string msg_text(const Lowered& lowered, const messages::MessageDefinition& definition) {
  std::string text = part_text(lowered, definition);
  // What begins on the first line is about the message.
  const bool has_head = !head_text(lowered, definition.name, definition.mark).empty();
  return !has_head && text.starts_with('#') ? "\n" + text : text;
}

std::string srv_text(const Lowered& lowered, std::string_view service) {
  const auto* const request = lowered.definition(std::string{service} + "_Request");
  const auto* const response = lowered.definition(std::string{service} + "_Response");
  if (request == nullptr || response == nullptr) {
    return {};
  }
  // rosidl 4.6 takes a constant that both messages have for two of the request, and what it generates does
  // not compile.
  messages::MessageDefinition answer = *response;
  std::erase_if(answer.constants, [&](const messages::Constant& constant) {
    return std::ranges::any_of(request->constants, [&](const messages::Constant& other) {
      return other.name == constant.name && other.type == constant.type && other.value == constant.value;
    });
  });
  return head_text(lowered, std::string{service}) + part_text(lowered, *request) + "---\n" +
         part_text(lowered, answer);
}

}  // namespace trestle::describe
