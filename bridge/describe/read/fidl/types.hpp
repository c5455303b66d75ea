#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/read/copies.hpp"
#include "bridge/describe/read/fidl/names.hpp"

namespace trestle::describe::fidl {

/// Types within types.
inline constexpr int deepest_type = 200;

/// What uses a type; the keys of version 1 that overwrite the type's rules are named after it.
enum class User : std::uint8_t { other, attribute, argument, struct_field, union_field };

/// An element of a deployment that has a say about one use of a type.
struct Layer {
  const Node* node = nullptr;
  User user = User::other;
  bool arrays_taken = false;  ///< its keys for arrays were for what holds this use
  [[nodiscard]] bool overwrites() const noexcept { return node->tag.starts_with('#'); }
};
/// The strongest first.
using Layers = std::vector<Layer>;

/// The layers of an element that uses a type: itself, and what it overwrites. Nothing for null.
[[nodiscard]] Layers layers_of(const Node* node, User user);

/// Makes the types of a model.
class Types {
 public:
  Types(Model& model, Names& names, Problems& findings, std::size_t most_copies)
      : model_{model}, names_{names}, findings_{findings}, copies_{findings, most_copies} {}

  /// Makes all declared types and constants.
  void make_all();
  /// The use of a type. Its type is `no_type` when that has an error.
  [[nodiscard]] Value use(const TypeRef& ref, const Scope& scope, const Layers& layers, int version,
                          int deep = 0);
  [[nodiscard]] Value use(const Variable& variable, const Scope& scope, const Layers& layers, int version,
                          int deep = 0);
  /// A declared type as it is without overwrites.
  [[nodiscard]] TypeIndex type(Declared& declared, int deep = 0);
  /// An enumeration that a method declares in place.
  [[nodiscard]] TypeIndex own_error(const TypeTree& tree, const Scope& scope, int version);
  /// Whether two uses are of one type, with the same rules. Each T[] is a type of its own.
  [[nodiscard]] bool same(const Value& a, const Value& b, int deep = 0) const;
  /// Whether a polymorphic structure is in it: its name; else empty.
  [[nodiscard]] std::string polymorphic_in(TypeIndex type, int deep = 0);

 private:
  [[nodiscard]] TypeIndex variant(Declared& declared, const Layers& layers, int deep);
  [[nodiscard]] Type build(Declared& declared, const Layers& layers, int deep);
  [[nodiscard]] std::vector<const TypeTree*> line_of(const Declared& declared);
  void build_fields(Type& type, Declared& declared, const Layers& layers, int deep);
  [[nodiscard]] Value use_in_union(const Variable& field, const Scope& scope, const Layers& layers,
                                   int version, int deep);
  void build_enumeration(Type& type, Declared& declared, const Layers& layers, int deep);
  [[nodiscard]] TypeIndex basic(const TypeRef& ref, Kind& kind, const Layers& layers, Wire& wire,
                                int version);
  [[nodiscard]] Wire wire(Kind kind, const Layers& layers, int version);
  void sizes(Type& type, const char* stem, const Layers& layers, int version);
  [[nodiscard]] const Setting* find(const Layers& layers, std::string_view key) const;
  [[nodiscard]] std::optional<std::int64_t> number(const Layers& layers, std::string_view key,
                                                   std::int64_t min, std::int64_t max);
  [[nodiscard]] someip::FieldWidth width(const Layers& layers, std::string_view key,
                                         someip::FieldWidth otherwise);
  void constants();
  [[nodiscard]] std::optional<std::int64_t> whole(const Expression& expression, const Scope& scope,
                                                  int deep = 0);
  template <typename Compute>
  auto follow(Place name, const ConstantTree& constant, Compute compute) -> decltype(compute());
  [[nodiscard]] const Constantlike* constant_of(const Expression& expression, const Scope& scope);
  /// An expression and where its names are used.
  struct Used {
    const Expression* expression = nullptr;
    const Scope* scope = nullptr;
  };
  [[nodiscard]] Used meant(const Expression& expression, const Scope& scope, int deep);
  [[nodiscard]] Used part_named(const Expression& expression, const Scope& scope, int deep);
  [[nodiscard]] Used part_of(const Used& whole, std::string_view field, int deep);
  [[nodiscard]] std::optional<double> real(const Expression& expression, const Scope& scope, int deep = 0);
  [[nodiscard]] std::optional<bool> truth(const Expression& expression, const Scope& scope, int deep = 0);
  [[nodiscard]] std::string constant_text(const Expression& expression, const Scope& scope, int deep = 0);
  [[nodiscard]] std::optional<std::int64_t> enumerator(Declared& declared, std::size_t index, int deep);
  [[nodiscard]] TypeIndex add(Type type);
  [[nodiscard]] bool too_deep(Place place, int deep);

  Model& model_;
  Names& names_;
  Problems& findings_;
  Copies copies_;
  std::map<std::string, TypeIndex, std::less<>> basics_;
  std::map<std::string, TypeIndex, std::less<>> variants_;
  std::map<const Declared*, std::vector<std::optional<std::int64_t>>> enumerators_;
  std::map<TypeIndex, std::string> polymorphic_;
  std::deque<Declared> own_errors_;
  std::map<const ConstantTree*, std::optional<std::int64_t>> wholes_;  ///< of constants
  std::vector<const ConstantTree*> open_;  ///< constants that are being computed, each of the one before
  std::set<const ConstantTree*> in_cycles_;
  std::size_t steps_ = 0;
  bool integer_told_ = false;  ///< that Integer is Int32
};

}  // namespace trestle::describe::fidl
