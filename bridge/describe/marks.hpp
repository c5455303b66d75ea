#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/ros_names.hpp"

/// What the marks of messages::Field and messages::MessageDefinition say of those that lower() made of
/// something that ROS has no form for, and by which raise() makes the same again: docs/describe_types.md.
namespace trestle::describe::marks {

inline constexpr std::string_view bytes = "bytes";  ///< a byte buffer
inline constexpr std::string_view map = "map";      ///< of the pairs of the message
/// The message stands for its only field, an array: in an array, or in a choice.
inline constexpr std::string_view array = "array";
/// And a blank and the enumeration's name, if it has one. Its enumerators are the constants that begin with
/// prefix_of().
inline constexpr std::string_view enumeration = "enumeration";
/// The same of Method::error.
inline constexpr std::string_view error = "error";
/// Parts of a mark about names, each with a blank and a name: what a typedef calls the whole field, or the
/// elements of its array, from the outside to the inside, and what the array itself is called.
inline constexpr std::string_view alias = "alias";
inline constexpr std::string_view element_alias = "of";
/// MessageDefinition::mark of a choice. Behind a blank each, its selectors where they are not 1, 2, 3 …
inline constexpr std::string_view choice = "union";

/// Messages::Field::mark in its parts. The views point into it, or into what it is to be made of.
struct FieldMark {
  std::string_view what{};  ///< "map", "enumeration Gear"; empty: nothing else than in ROS
  std::vector<std::string_view> aliases{};
  std::string_view array_name{};
  std::vector<std::string_view> element_aliases{};
};

/// A part that is none of these plays no part.
[[nodiscard]] FieldMark parse(std::string_view mark);
/// "map, alias Seats"
[[nodiscard]] std::string text_of(const FieldMark& mark);

/// What the constants of an enumeration begin with: "GEAR_" of "Gear".
/// @param field  that has the enumeration, whose name holds where the enumeration has none.
[[nodiscard]] inline std::string prefix_of(std::string_view enumeration_name, std::string_view field) {
  return ros_constant_name(enumeration_name.empty() ? field : enumeration_name) + "_";
}

}  // namespace trestle::describe::marks
