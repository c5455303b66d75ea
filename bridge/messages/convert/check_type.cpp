#include "bridge/messages/convert/check_type.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {
namespace {

/// The most bytes that a field can have in SOME/IP; nothing if there is no limit that matters here.
class Most {
 public:
  Most(const TypeTree& tree, const someip::PayloadRules& rules) : tree_{tree}, rules_{rules} {}

  using Bytes = std::optional<std::uint64_t>;

  [[nodiscard]] Bytes message(const MessageDefinition& definition) const {
    // Generators of IDL from .msg files give an empty message a field of one byte.
    Bytes sum = bytes(rules_.struct_length) + (definition.fields.empty() ? 1 : 0);
    for (const Field& field : definition.fields) {
      sum = plus(sum, one(field.type));
    }
    return sum;
  }

  /// The bytes of all elements of an array, without its length field.
  [[nodiscard]] Bytes elements(const FieldType& type) const {
    const Bytes element = single(type);
    return type.array == ArrayKind::unbounded || !element ? std::nullopt
                                                          : limited(*element * type.array_size);
  }

 private:
  // No length field can count more, so all larger sums are alike; the product of two limited numbers does not
  // overflow.
  static Bytes limited(std::uint64_t number) {
    return number > std::numeric_limits<std::uint32_t>::max() ? std::nullopt : Bytes{number};
  }

  static Bytes plus(Bytes left, Bytes right) {
    return left && right ? limited(*left + *right) : std::nullopt;
  }

  [[nodiscard]] Bytes one(const FieldType& type) const {
    // Alignment puts up to this many bytes behind data of variable length.
    const std::uint64_t padding = rules_.alignment - 1U;
    switch (type.array) {
      case ArrayKind::none:
        return plus(single(type), padding);
      case ArrayKind::fixed:
        return plus(elements(type), bytes(rules_.fixed_array_length) + padding);
      case ArrayKind::bounded:
      case ArrayKind::unbounded:
        return plus(elements(type), bytes(rules_.array_length) + padding);
    }
    return std::nullopt;
  }

  [[nodiscard]] Bytes single(const FieldType& type) const {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index]);
    }
    if (width(*type.primitive) != 0) {
      return width(*type.primitive);
    }
    // A character has up to 4 bytes in any encoding, as have a byte order mark and a terminator.
    constexpr std::uint64_t character = 4;
    return type.string_bound == 0
               ? std::nullopt
               : limited(bytes(rules_.string_length) + character * (std::uint64_t{type.string_bound} + 2) +
                         rules_.alignment - 1U);
  }

  const TypeTree& tree_;
  const someip::PayloadRules& rules_;
};

bool is_service(const std::string& type) {
  return type.find("/srv/") != std::string::npos || type.ends_with("_SendGoal") ||
         type.ends_with("_GetResult");
}

bool is_short_length(someip::FieldWidth width) {
  return width == someip::FieldWidth::bits8 || width == someip::FieldWidth::bits16;
}

/// The shortest length field that an array has, in any of the variants of its message.
someip::FieldWidth array_length(const MessageRules& rules, const std::string& message,
                                const std::string& field) {
  std::optional<someip::FieldWidth> shortest;
  bool has_own = false;
  for (const auto& [name, type] : rules.types) {
    if (type_of_rules(name) != message) {
      continue;
    }
    has_own = has_own || name == message;
    const auto use = type.fields.find(field);
    const someip::FieldWidth width = use != type.fields.end() && use->second.array_length
                                         ? *use->second.array_length
                                         : rules.payload.array_length;
    shortest = std::min(width, shortest.value_or(width));
  }
  return has_own ? *shortest
                 : std::min(rules.payload.array_length, shortest.value_or(rules.payload.array_length));
}

std::string check_lengths_of(const TypeTree& tree, const MessageRules& rules);

}  // namespace

std::string check_type(const std::string& type, const TypePlaces& places, const MessageRules& rules) {
  TypeLibrary library = TypeLibrary::in(places);
  if (is_service(type)) {
    const auto types = library.resolve_service(type);
    if (!types) {
      return to_string(types.error());
    }
    const auto plans = compile_service(*types, rules);
    return plans ? std::string{} : plans.error();
  }
  const auto tree = library.resolve(type);
  if (!tree) {
    return to_string(tree.error());
  }
  const auto plan = ConversionPlan::compile(*tree, rules);
  return plan ? std::string{} : plan.error();
}

std::string check_field_service(const std::string& service, const std::string& value_type, FieldAccess access,
                                const TypePlaces& places, const MessageRules& rules) {
  TypeLibrary library = TypeLibrary::in(places);
  const auto types = resolve_field_service(library, service, value_type, access);
  if (!types) {
    return types.error();
  }
  const auto plans = compile_field_service(*types, access, rules);
  return plans ? std::string{} : plans.error();
}

std::string check_lengths(const std::string& type, const TypePlaces& places, const MessageRules& rules) {
  const auto is_short = [](const auto& one) {
    return std::ranges::any_of(one.second.fields, [](const auto& field) {
      return field.second.array_length && is_short_length(*field.second.array_length);
    });
  };
  if (!is_short_length(rules.payload.array_length) && std::ranges::none_of(rules.types, is_short)) {
    return {};
  }
  TypeLibrary library = TypeLibrary::in(places);
  if (is_service(type)) {
    const auto types = library.resolve_service(type);
    if (!types) {
      return {};
    }
    std::string of_request = check_lengths_of(types->request, rules);
    return of_request.empty() ? check_lengths_of(types->response, rules) : of_request;
  }
  const auto tree = library.resolve(type);
  return tree ? check_lengths_of(*tree, rules) : std::string{};
}

namespace {

std::string check_lengths_of(const TypeTree& tree, const MessageRules& rules) {
  std::map<someip::FieldWidth, std::vector<std::string>> names;
  const Most most{tree, rules.payload};
  for (const MessageDefinition& message : tree.messages) {
    for (const Field& field : message.fields) {
      const bool is_optional = field.type.array_size == 1 && rules.types.contains(message.name);
      if (is_optional ||
          (field.type.array != ArrayKind::bounded && field.type.array != ArrayKind::unbounded)) {
        continue;
      }
      const someip::FieldWidth width = array_length(rules, message.name, field.name);
      const std::uint64_t countable = (std::uint64_t{1} << 8 * bytes(width)) - 1;
      if (!is_short_length(width)) {
        continue;
      }
      if (const auto elements = most.elements(field.type); !elements || *elements > countable) {
        names[width].push_back(&message == &tree.root() ? field.name : message.name + "." + field.name);
      }
    }
  }
  std::string text;
  for (const auto& [width, arrays] : names) {
    const std::size_t bits = 8 * bytes(width);
    text += fmt::format(
        "{}with array_length: {}, messages are dropped in which one of these has more than {} bytes: {}",
        text.empty() ? "" : "; ", bits, (std::uint64_t{1} << bits) - 1, fmt::join(arrays, ", "));
  }
  return text;
}

}  // namespace

}  // namespace trestle::messages
