#include "bridge/messages/values/words.hpp"

#include <algorithm>

namespace trestle::messages {

const MessageWords Words::nothing{};

const FieldWords& words_of(const MessageWords& words, std::size_t field) noexcept {
  static const FieldWords none{};
  return field < words.fields.size() ? words.fields[field] : none;
}

const std::string& name_of(const MessageWords& words, const MessageDefinition& type,
                           std::size_t field) noexcept {
  const std::string& name = words_of(words, field).name;
  return name.empty() ? type.fields[field].name : name;
}

Enumerators::Enumerators(std::vector<Pair> all) : all_{std::move(all)} {
  for (std::size_t at = 0; at < all_.size(); ++at) {
    names_.emplace(all_[at].first, at);
    values_.emplace(all_[at].second, at);
  }
}

const Enumerators::Pair* Enumerators::by_value(std::int64_t value) const {
  const auto found = values_.find(value);
  return found == values_.end() ? nullptr : &all_[found->second];
}

const Enumerators::Pair* Enumerators::by_name(const std::string& name) const {
  const auto found = names_.find(name);
  return found == names_.end() ? nullptr : &all_[found->second];
}

const std::string* enumerator_of(const FieldWords& words, std::int64_t value) {
  const Enumerators::Pair* const found = words.enumerators ? words.enumerators->by_value(value) : nullptr;
  return found == nullptr ? nullptr : &found->first;
}

std::string in_words(std::string_view field, const TypeTree& tree, const Words& words) {
  std::string text = words.argument;
  std::size_t message = tree.messages.size() - 1;
  while (!field.empty()) {
    field.remove_prefix(field.front() == '.' ? 1 : 0);
    const std::string_view step = field.substr(0, field.find('.'));
    field.remove_prefix(step.size());
    const MessageDefinition& type = tree.messages[message];
    const std::string_view name = step.substr(0, step.find('['));
    const auto at = std::ranges::find(type.fields, name, &Field::name);
    if (at == type.fields.end()) {
      return text + (text.empty() ? "" : ".") + std::string{step} + std::string{field};  // not a path
    }
    const MessageWords& own = words.of(message);
    const auto index = static_cast<std::size_t>(at - type.fields.begin());
    if (own.form != MessageWords::Form::wrapper) {
      text += (text.empty() ? "" : ".") + name_of(own, type, index);
    }
    const bool is_single =
        own.form == MessageWords::Form::choice || words_of(own, index).form == FieldWords::Form::optional;
    if (!is_single) {  // else the index is that of a T[<=1]
      text += step.substr(name.size());
    }
    if (at->type.primitive) {
      break;
    }
    message = at->type.message_index;
  }
  return text;
}

}  // namespace trestle::messages
