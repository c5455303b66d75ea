#pragma once
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model.hpp"

/// How a model becomes files: which type is declared where, and under which name.
namespace trestle::describe::fidl_writing {

/// An interface or type collection of a package.
struct Container {
  std::string package{};
  std::string name{};  ///< empty: an anonymous type collection
  const Service* service = nullptr;
  std::optional<std::size_t> base{};  ///< the container of the interface that it extends
  std::vector<TypeIndex> types{};
  std::vector<const Constant*> constants{};
  const TypeCollection* collection = nullptr;   ///< what the model says of it
  std::set<std::string, std::less<>> names{};   ///< that are taken
  std::map<std::string, unsigned> name_uses{};  ///< by wanted name: how often it was given
  [[nodiscard]] std::string full() const { return name.empty() ? package : package + "." + name; }
};

/// How a declared type is written.
struct Declared {
  std::size_t container = 0;
  std::string name{};
  bool renamed = false;  ///< the model's name is another one
};

class Plan {
 public:
  Plan(const Model& model, std::vector<NotCarried>& lost);

  [[nodiscard]] const std::vector<Container>& containers() const noexcept { return containers_; }
  /// Those of one package, in the same order.
  [[nodiscard]] std::vector<const Container*> containers_of(const std::string& package) const;
  /// That of a service by its full name; null: there is none.
  [[nodiscard]] const Container* service(std::string_view full) const;
  [[nodiscard]] std::vector<std::string> packages() const;
  /// The type that a use names: not a variant of it.
  [[nodiscard]] TypeIndex root(TypeIndex type) const;
  /// Null for types without a declaration: basic ones, arrays that are written T[], and those that are left
  /// out.
  [[nodiscard]] const Declared* declared(TypeIndex type) const;
  /// An array that is written T[].
  [[nodiscard]] bool is_inline(TypeIndex type) const;
  /// A type of an interface that others use as well.
  [[nodiscard]] bool is_public(TypeIndex type) const { return public_.contains(type); }
  /// Nothing can be written for it, as for a structure without members.
  [[nodiscard]] bool is_left_out(TypeIndex type) const { return left_out_.contains(root(type)); }
  /// FIDL has no attribute without a value.
  [[nodiscard]] bool is_written(const Field& field) const {
    return field.payload.values.size() == 1 && !is_left_out(field.payload.values.front().type);
  }
  /// "UInt8", "S", "a.b.Types.S": without [].
  [[nodiscard]] std::string reference(TypeIndex type, const Container& from) const;
  /// "a.b.Interface" of "/a/b/Interface"; empty if there is no such service.
  [[nodiscard]] std::string service_name(std::string_view full) const;
  /// Members, enumerators and constants as FIDL calls them: usable(), and each once among its like.
  [[nodiscard]] std::string member_name(TypeIndex type, const std::string& name) const;
  [[nodiscard]] std::string attribute_name(const Service& service, const std::string& name) const;
  /// And so that Franca can tell overloads apart.
  [[nodiscard]] std::string method_name(const Service& service, const Method& method) const;
  [[nodiscard]] std::string broadcast_name(const Service& service, const Event& event) const;
  [[nodiscard]] std::string constant_name(const Constant& constant) const;

 private:
  void place_services();
  void place_types();
  void place_collections();
  void find_public_types();
  void name_members();
  [[nodiscard]] std::string name_of(const void* owner, const std::string& key, const std::string& name) const;
  /// One that neither the container nor an interface that it extends has.
  std::string free_name(Container& container, const std::string& wanted);
  std::size_t container_for(const std::string& scope);
  /// How many interfaces the one of this container extends, one through the other.
  [[nodiscard]] std::size_t depth(std::size_t container) const;
  /// Arrays of which something is a container.
  [[nodiscard]] std::set<TypeIndex> arrays_in_types() const;
  /// What Franca tells overloads apart by: all integers are one type for it.
  [[nodiscard]] std::string signature(const std::vector<Value>& values) const;
  void leave_out_empty_types();
  [[nodiscard]] bool needs_declaration(TypeIndex type) const;

  const Model& model_;
  std::vector<NotCarried>& lost_;
  std::vector<Container> containers_;
  std::map<std::string, std::size_t, std::less<>> by_scope_;  ///< scope of the model
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_package_;
  std::map<std::string, std::size_t, std::less<>> services_;     ///< by full name
  std::map<std::string, std::size_t, std::less<>> collections_;  ///< type collections by full name
  std::map<TypeIndex, Declared> declared_;
  std::set<TypeIndex> left_out_;
  std::set<TypeIndex> public_;
  std::set<TypeIndex> own_errors_;
  std::set<std::string, std::less<>> packages_;
  std::set<std::string, std::less<>> interfaces_;  ///< as they are written, with their packages
  /// Names other than usable(), by what they are in (a type, a service) or are (a constant), and by kind and
  /// name.
  std::map<std::pair<const void*, std::string>, std::string> other_names_;
};

/// Arguments as FIDL calls them, each once in a method: one in `out` with the name of one in `in` gets
/// "_out".
struct ArgumentNames {
  explicit ArgumentNames(const Method& method);
  std::vector<std::string> in{};
  std::vector<std::string> out{};
};
[[nodiscard]] std::vector<std::string> argument_names(const Event& event);

/// The names of members that a service has of the one that it extends.
struct Inherited {
  explicit Inherited(const Container* base) {
    if (base == nullptr || base->service == nullptr) {
      return;
    }
    for (const Field& one : base->service->fields) {
      fields.insert(one.name);
    }
    for (const Method& one : base->service->methods) {
      methods.insert(member_key(one.name, one.selector));
    }
    for (const Event& one : base->service->events) {
      events.insert(member_key(one.name, one.selector));
    }
  }
  std::set<std::string, std::less<>> fields{};
  std::set<std::string, std::less<>> methods{};
  std::set<std::string, std::less<>> events{};
};

/// A name as FIDL and C++ can have it: other characters become '_', and words of C++ get one at their end. Of
/// a type, words of FIDL too; else they are to be escaped.
[[nodiscard]] std::string usable(std::string_view name, bool is_type);
/// The name, or name_, name_2, name_3 …, which is put into `names`.
/// @param uses  by name: how often it was taken; where the search goes on.
[[nodiscard]] std::string free_name(const std::string& wanted, std::set<std::string, std::less<>>& names,
                                    std::map<std::string, unsigned>& uses);
/// With ^ before words of FIDL, or of FDEPL.
[[nodiscard]] std::string escaped(std::string_view name);
[[nodiscard]] std::string escaped_fdepl(std::string_view name);
/// The name of a basic type.
[[nodiscard]] std::string basic_name(const Type& type);
/// FIDL's `undefined`, as its reader has it.
[[nodiscard]] bool is_undefined(const Type& type);
/// A constant's value as FIDL has it; empty if there is no such form.
[[nodiscard]] std::string constant_value(const Model& model, const Plan& plan, const Constant& constant,
                                         const Container& from);

}  // namespace trestle::describe::fidl_writing
