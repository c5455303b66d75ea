#include "bridge/messages/values/left_out.hpp"

#include <algorithm>

namespace trestle::messages {

std::vector<std::string> left_out(const MessageValues& values, std::string_view text, ValueForm form) {
  const auto value = form == ValueForm::json ? parse_json_text(text) : parse_yaml_text(text);
  const Words* const words = values.words();
  const MessageWords& own = words == nullptr ? Words::nothing : words->of(values.tree().messages.size() - 1);
  if (!value || value->kind != TextValue::Kind::mapping || own.form != MessageWords::Form::structure) {
    return {};
  }
  const std::vector<TextValue>* given = &value->elements;
  if (words != nullptr && given->size() == 1 && given->front().key == words->argument) {
    if (given->front().kind != TextValue::Kind::mapping) {
      return {};
    }
    given = &given->front().elements;
  }
  const MessageDefinition& type = values.tree().root();
  std::vector<std::string> names;
  for (std::size_t at = 0; at < type.fields.size(); ++at) {
    const std::string& name = name_of(own, type, at);
    // ROS puts this into what would have no field.
    const bool needs_none =
        words_of(own, at).form == FieldWords::Form::optional || name == "structure_needs_at_least_one_member";
    if (!needs_none && std::ranges::find(*given, name, &TextValue::key) == given->end()) {
      names.push_back(name);
    }
  }
  return names;
}

}  // namespace trestle::messages
