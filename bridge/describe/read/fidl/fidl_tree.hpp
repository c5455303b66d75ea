#pragma once
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/describe/read/fidl/cursor.hpp"

/// What a FIDL file says, as it says it.
namespace trestle::describe::fidl {

/// The use of a type.
struct TypeRef {
  Name name{};  ///< of a basic type, "Integer", or of a declared one
  bool basic = false;
  bool array = false;                     ///< T[]
  std::optional<std::int64_t> minimum{};  ///< of Integer
  std::optional<std::int64_t> maximum{};
};

struct Expression {
  enum class Kind : std::uint8_t { number, real, text, truth, name, unary, binary, compound, bracket };
  Kind kind = Kind::number;
  std::string text{};  ///< number, name, operator …; of a part of a compound its field stands in `names`
  Place place{};
  std::vector<Expression> parts{};  ///< operands; of a bracket: key, value, key, value … if `pairs`
  std::vector<Name> names{};        ///< compound: of each part; of "->": the field
  bool pairs = false;
};

/// A field of a struct or union, or an argument.
struct Variable {
  TypeRef type{};
  Name name{};
  Notes notes{};
  bool is_inout = false;  ///< an argument out: an annotation tells that it is the one of `in` of this name
};

struct EnumeratorTree {
  Name name{};
  std::optional<Expression> value{};
  Notes notes{};
};

struct TypeTree {
  Kind kind = Kind::structure;  ///< array, structure, choice, enumeration, map, alias
  Name name{};
  Name base{};
  bool polymorphic = false;
  /// A struct: an annotation tells that its one field is a union's member, which has a type of its own so.
  bool wraps = false;
  std::vector<Variable> fields{};
  std::vector<EnumeratorTree> enumerators{};
  TypeRef element{};
  TypeRef key{};
  Notes notes{};
};

struct ConstantTree {
  TypeRef type{};
  Name name{};
  Expression value{};
  Notes notes{};
};

struct AttributeTree {
  Variable value{};
  bool readonly = false;
  bool no_read = false;
  bool no_subscriptions = false;
};

struct MethodTree {
  Name name{};
  std::string selector{};
  bool fire_and_forget = false;
  std::vector<Variable> in{};
  std::vector<Variable> out{};
  Name error{};                           ///< an enumeration
  std::unique_ptr<TypeTree> own_error{};  ///< error { … }
  Notes notes{};
};

struct BroadcastTree {
  Name name{};
  std::string selector{};
  bool selective = false;
  std::vector<Variable> out{};
  Notes notes{};
};

/// An interface or a type collection.
struct CollectionTree {
  bool is_interface = false;
  Name name{};  ///< empty: an anonymous type collection
  Name base{};
  std::vector<Name> manages{};
  bool has_version = false;
  std::int64_t major = 1;
  std::int64_t minor = 0;
  std::vector<AttributeTree> attributes{};
  std::vector<MethodTree> methods{};
  std::vector<BroadcastTree> broadcasts{};
  std::deque<TypeTree> types{};  ///< places stay
  std::vector<ConstantTree> constants{};
  Notes notes{};
};

struct ImportTree {
  std::string names{};  ///< "a.b.*"; empty: import model, or of a FDEPL file
  std::string file{};
  Place place{};
};

struct FidlTree {
  std::string package{};
  std::vector<ImportTree> imports{};
  std::deque<CollectionTree> collections{};
};

/// The names of basic types, and what they are; nothing for other names.
[[nodiscard]] std::optional<messages::Primitive> primitive_of(std::string_view name);
[[nodiscard]] bool is_basic(std::string_view name);

/// Deepest nesting of expressions.
inline constexpr int deepest_expression = 100;

/// Parses a file. What is wrong is in `findings`; the rest is there.
[[nodiscard]] FidlTree parse_fidl(std::string_view text, std::uint32_t file, TokenCount& count,
                                  Problems& findings);

}  // namespace trestle::describe::fidl
