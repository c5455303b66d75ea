#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// The types and constants of a model, found by what they are, so that each is added once. What is added to
/// the model past it is known, too. Types that are there must not change.
class RaisedTypes {
 public:
  explicit RaisedTypes(Model& model) : model_{model} {}

  [[nodiscard]] Model& model() noexcept { return model_; }

  /// The type that is alike, or else this one, added: as a variant where one of its name is there.
  TypeIndex add_once(Type type);
  /// What an enumeration, alias or array is to be called: its name, or the first of Name2, Name3 … that is
  /// free, or that of one with the same enumerators, or of the same type but for its wire rules.
  [[nodiscard]] std::string free_name(const Type& type);
  /// Whether the model has constants of this scope.
  [[nodiscard]] bool has_constants(std::string_view scope);

  /// How many pairs of types were compared so far, and numbers tried for names.
  [[nodiscard]] std::size_t comparisons() const noexcept { return comparisons_; }

 private:
  /// Types of one name that were told apart by a number.
  struct Numbered {
    unsigned next = 1;
    std::map<std::string, unsigned> numbers{};  ///< by what they are
  };
  void catch_up();
  [[nodiscard]] std::string content_of(const Type& type) const;
  [[nodiscard]] std::string content_of(TypeIndex index, std::size_t depth) const;

  Model& model_;
  std::size_t types_known_ = 0;
  std::size_t constants_known_ = 0;
  std::size_t comparisons_ = 0;
  std::unordered_map<std::size_t, std::vector<TypeIndex>> by_content_{};  ///< by their hash
  /// The first of a name: of a ROS type, of whatever kind; else of one kind.
  std::unordered_map<std::string, TypeIndex> by_name_{};
  /// Enumerations, aliases and arrays, by scope, name and kind.
  std::unordered_map<std::string, TypeIndex> named_{};
  std::map<std::string, Numbered> numbered_{};
  std::set<std::string, std::less<>> constant_scopes_{};
};

}  // namespace trestle::describe
