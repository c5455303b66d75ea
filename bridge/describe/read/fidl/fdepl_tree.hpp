#pragma once
#include <deque>
#include <string>
#include <variant>
#include <vector>

#include "bridge/describe/read/fidl/cursor.hpp"
#include "bridge/describe/read/fidl/fidl_tree.hpp"

/// What a FDEPL file says, as it says it.
namespace trestle::describe::fidl {

/// Of a key: 5, "text", true, a word, &an.Interface.
struct SettingValue {
  enum class Kind : std::uint8_t { number, text, truth, word, reference };
  Kind kind = Kind::number;
  std::string text{};  ///< as written, without quotes
  std::int64_t number = 0;
  Place place{};
};

/// KEY = VALUE, or KEY = { VALUE, … }
struct Setting {
  Name key{};
  std::vector<SettingValue> values{};
  bool list = false;
};

/// An element with settings: a whole deployment, a method, a field, an overwrite …
struct Node {
  /// "interface", "method", "struct" …; "in" and "out"; of fields, arguments and enumerators "";
  /// of overwrites "#", "#struct" …
  std::string tag{};
  Name target{};         ///< may be empty
  Name alias{};          ///< "as X"
  Name specification{};  ///< of a whole deployment
  std::vector<Name> uses{};
  std::vector<Setting> settings{};
  std::vector<Node> children{};
  Place place{};
  bool within_overwrite = false;
  int version = 2;  ///< of CommonAPI's specification for SOME/IP

  // These need settings and children that are sorted, as those of Names are.
  [[nodiscard]] const Setting* setting(std::string_view key) const;
  [[nodiscard]] const Node* child(std::string_view tag, std::string_view target) const;
  [[nodiscard]] const Node* overwrite() const;
};

/// "specification X extends Y { … }": which keys it declares.
struct SpecificationTree {
  Name name{};
  Name base{};
  std::vector<std::string> keys{};
};

struct FdeplTree {
  std::string package{};
  std::vector<ImportTree> imports{};
  std::vector<SpecificationTree> specifications{};
  std::vector<Node> deployments{};
};

/// Deepest nesting of elements.
inline constexpr int deepest_node = 100;

[[nodiscard]] FdeplTree parse_fdepl(std::string_view text, std::uint32_t file, TokenCount& count,
                                    Problems& findings);

}  // namespace trestle::describe::fidl
