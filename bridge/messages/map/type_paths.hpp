#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// What a path such as "header.stamp" or "pose.covariance[7]" names.
struct NamedPart {
  const MessageDefinition* holder = nullptr;  ///< the message that has the field
  const Field* field = nullptr;
  FieldType type{};  ///< of the field, or of an element of it
  bool is_element = false;
};

/// The field of a type, or of a message in it, or an element of an array of fixed size.
/// @return why there is none: one line, perhaps with what was meant.
[[nodiscard]] tl::expected<NamedPart, std::string> part_at(const TypeTree& tree, const std::string& path);

/// "uint16[4]", "std_msgs/msg/Header", "string<=8"
[[nodiscard]] std::string type_text(const FieldType& type);

/// Whether a path is in what another one names: "a.b" and "a[0].b" in "a".
[[nodiscard]] constexpr bool is_within(std::string_view path, std::string_view whole) noexcept {
  return path.size() > whole.size() && path.starts_with(whole) &&
         (path[whole.size()] == '.' || path[whole.size()] == '[');
}

/// Whether any of the paths is within another one.
/// @param paths  a sorted set, or a map by path.
template <typename Paths>
[[nodiscard]] bool has_within(const Paths& paths, const std::string& whole) {
  return std::ranges::any_of(std::array{".", "["}, [&](const char* sign) {
    const auto next = paths.lower_bound(whole + sign);
    if (next == paths.end()) {
      return false;
    }
    if constexpr (requires { next->first; }) {
      return is_within(next->first, whole);
    } else {
      return is_within(*next, whole);
    }
  });
}

/// The type of an element.
[[nodiscard]] FieldType element_of(FieldType array);

/// A number, a boolean among them, or an array of them.
[[nodiscard]] inline bool is_number(const FieldType& type) noexcept {
  return type.primitive && width(*type.primitive) != 0;
}
[[nodiscard]] inline bool is_sequence(const FieldType& type) noexcept {
  return type.array == ArrayKind::bounded || type.array == ArrayKind::unbounded;
}
[[nodiscard]] inline bool is_time(const FieldType& type) noexcept {
  return type.message == "builtin_interfaces/msg/Time" && type.array == ArrayKind::none;
}
[[nodiscard]] inline bool is_duration(const FieldType& type) noexcept {
  return type.message == "builtin_interfaces/msg/Duration" && type.array == ArrayKind::none;
}
/// A single message.
[[nodiscard]] inline bool is_message(const FieldType& type) noexcept {
  return !type.primitive && type.array == ArrayKind::none;
}

}  // namespace trestle::messages
