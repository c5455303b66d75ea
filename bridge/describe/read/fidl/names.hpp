#pragma once
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/read/fidl/sources.hpp"

namespace trestle::describe::fidl {

/// Where a name is used, which decides what it means.
struct Scope {
  const FidlSource* source = nullptr;
  const CollectionTree* in = nullptr;
  std::string name{};   ///< "org.example.Types"
  std::string model{};  ///< the same with the names that a model has
  std::string inner{};  ///< of an enumerator's value: its enumeration
};

/// A declared type, and what deployment says of it.
struct Declared {
  const TypeTree* tree = nullptr;
  Scope scope{};
  const Node* node = nullptr;    ///< its deployment
  const Node* of_all = nullptr;  ///< that of its interface or type collection
  int version = 2;               ///< whose defaults hold
  enum class State : std::uint8_t { fresh, open, done } state = State::fresh;
  TypeIndex type = no_type;
};

/// An interface or type collection, and what deployment says of it.
struct Collection {
  Scope scope{};
  const Node* node = nullptr;
  int version = 2;
  /// Of an interface: those that it extends, the outermost first, and itself.
  std::vector<const Collection*> line{};
};

/// A constant or an enumerator: what an expression may name.
struct Constantlike {
  const ConstantTree* constant = nullptr;
  Declared* enumeration = nullptr;
  std::size_t enumerator = 0;
  Scope scope{};
};

/// Knows all that is declared and deployed.
class Names {
 public:
  Names(const Sources& sources, Problems& findings);

  [[nodiscard]] std::deque<Collection>& collections() noexcept { return collections_; }
  [[nodiscard]] std::deque<Declared>& types() noexcept { return types_; }
  /// Deployed instances, each with the version of its deployment.
  [[nodiscard]] const std::vector<const Node*>& instances() const noexcept { return instances_; }
  /// Of deployments: that of the first file that has one.
  [[nodiscard]] int version() const noexcept { return version_; }

  /// Null, and an error, if there is none.
  [[nodiscard]] Declared* type(const Name& name, const Scope& scope);
  [[nodiscard]] const Collection* interface(const Name& name, const Scope& scope);
  /// Null if there is none.
  [[nodiscard]] const Constantlike* value(std::string_view name, const Scope& scope) const;
  /// Whether a FDEPL file says how something is carried.
  [[nodiscard]] bool has_deployments() const noexcept { return !deployed_.empty(); }

 private:
  void declare(const FidlSource& source);
  void declare_once(const std::string& name, Place place, const char* what);
  void find_lines();
  void deploy();
  void deploy(const Node& node, const FdeplTree& tree);
  void attach();
  /// "a.b.E2.C" may be an enumerator of what E2 extends. Null if it is not.
  [[nodiscard]] const Constantlike* inherited(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> candidates(std::string_view name, const Scope& scope) const;

  const Sources& sources_;
  Problems& findings_;
  std::deque<Collection> collections_;
  std::deque<Declared> types_;
  std::map<std::string, Declared*, std::less<>> types_by_name_;
  std::map<std::string, Collection*, std::less<>> interfaces_;
  std::set<std::string, std::less<>> interface_names_;
  std::set<std::string, std::less<>> collection_names_;
  std::map<std::string, Place, std::less<>> declared_;
  std::map<std::string, Constantlike, std::less<>> values_;
  std::map<std::string, Node, std::less<>> deployed_;  ///< "interface a.b.C", "typeCollection a.b"
  std::deque<Node> providers_;
  std::vector<const Node*> instances_;
  int version_ = 2;
};

}  // namespace trestle::describe::fidl
