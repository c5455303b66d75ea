#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/documents/problems.hpp"

namespace trestle::describe {

/// JSON with the place of each value.
struct JsonNode {
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  std::string text{};  ///< "true", "12", or the characters of a string
  std::vector<JsonNode> elements{};
  std::vector<JsonNode> members{};  ///< in the order of the file; one name may be there twice
  documents::Mark mark{};
  std::string name{};  ///< of a member of an object
  documents::Mark name_mark{};

  /// A boolean, number or string.
  [[nodiscard]] bool is_scalar() const noexcept {
    return kind == Kind::boolean || kind == Kind::number || kind == Kind::string;
  }
  /// The first member of that name, or nullptr.
  [[nodiscard]] const JsonNode* find(std::string_view wanted) const noexcept;
};

/// How deep values may be in each other, and how many there may be.
inline constexpr int max_json_depth = 64;
inline constexpr std::size_t max_json_values = 2'000'000;

/// Reads a JSON text. Comments, and commas before a closing bracket, are taken with a warning, as people have
/// such files. Nothing, and one error, where it is not JSON.
[[nodiscard]] std::optional<JsonNode> parse_json(std::string_view text, documents::Problems& problems);

/// The names of the members of the outermost object, as far as the text is JSON: it may be broken. Nothing:
/// it does not begin with an object.
[[nodiscard]] std::optional<std::vector<std::string_view>> names_of_root(std::string_view text);

/// "an object", "the text 'abc'": what is there, for a message.
[[nodiscard]] std::string what_it_is(const JsonNode& node);

}  // namespace trestle::describe
