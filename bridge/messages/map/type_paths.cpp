#include "bridge/messages/map/type_paths.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/documents/problems.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/number_text.hpp"

namespace trestle::messages {
namespace {

/// Names that are compared with one that does not exist.
constexpr std::size_t most_hints = 3000;

void add_paths(const TypeTree& tree, const MessageDefinition& message, const std::string& prefix,
               std::vector<std::string>& into) {
  for (const Field& field : message.fields) {
    if (into.size() >= most_hints) {
      return;
    }
    into.push_back(prefix + field.name);
    if (!field.type.primitive && field.type.array == ArrayKind::none) {
      add_paths(tree, tree.messages[field.type.message_index], prefix + field.name + ".", into);
    }
  }
}

/// A name with numbers in brackets behind it.
struct Step {
  std::string_view name;
  std::optional<std::uint32_t> index;
};

std::optional<Step> step_of(std::string_view text) {
  const std::size_t open = text.find('[');
  if (open == std::string_view::npos) {
    return Step{text, std::nullopt};
  }
  if (!text.ends_with(']')) {
    return std::nullopt;
  }
  const auto index = read_integer<std::uint32_t>(text.substr(open + 1, text.size() - open - 2));
  return index ? std::optional{Step{text.substr(0, open), index}} : std::nullopt;
}

}  // namespace

FieldType element_of(FieldType array) {
  array.array = ArrayKind::none;
  array.array_size = 0;
  return array;
}

std::string type_text(const FieldType& type) {
  std::string text = type.primitive ? to_string(*type.primitive) : type.message;
  text += type.string_bound == 0 ? "" : fmt::format("<={}", type.string_bound);
  switch (type.array) {
    case ArrayKind::none:
      return text;
    case ArrayKind::fixed:
      return fmt::format("{}[{}]", text, type.array_size);
    case ArrayKind::bounded:
      return fmt::format("{}[<={}]", text, type.array_size);
    case ArrayKind::unbounded:
      break;
  }
  return text + "[]";
}

tl::expected<NamedPart, std::string> part_at(const TypeTree& tree, const std::string& path) {
  NamedPart part{.holder = &tree.root()};
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const auto step = step_of(std::string_view{path}.substr(begin, end - begin));
    if (part.field != nullptr) {
      if (part.type.primitive || part.type.array != ArrayKind::none) {
        return tl::unexpected{fmt::format("{} of {} is {}, which has no fields to be named",
                                          documents::quote(path.substr(0, begin - 1)), tree.root().name,
                                          type_text(part.type))};
      }
      part.holder = &tree.messages[part.type.message_index];
    }
    const auto field =
        step ? std::ranges::find(part.holder->fields, step->name, &Field::name) : part.holder->fields.end();
    if (field == part.holder->fields.end()) {
      std::vector<std::string> known;
      add_paths(tree, tree.root(), "", known);
      const std::string likely = documents::nearest(path, known);
      return tl::unexpected{
          fmt::format("{} has no field {}{}", tree.root().name, documents::quote(path),
                      likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?")};
    }
    part.field = &*field;
    part.type = field->type;
    part.is_element = step->index.has_value();
    if (step->index) {
      if (part.type.array != ArrayKind::fixed) {
        return tl::unexpected{fmt::format(
            "{}: only elements of arrays of fixed size have names, and {} is {}", documents::quote(path),
            documents::quote(path.substr(0, begin + step->name.size())), type_text(part.type))};
      }
      if (*step->index >= part.type.array_size) {
        return tl::unexpected{fmt::format("{}: {} has the elements 0 to {}", documents::quote(path),
                                          type_text(part.type), part.type.array_size - 1)};
      }
      part.type = element_of(part.type);
    }
    begin = end + 1;
  }
  return part;
}

}  // namespace trestle::messages
