#pragma once
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "bridge/describe/read/arxml/rules.hpp"
#include "bridge/describe/read/arxml/tree.hpp"
#include "bridge/describe/read/copies.hpp"

namespace trestle::describe::arxml {

/// Reads data types as payloads use them. A type that is used with other wire rules becomes a variant of the
/// first one.
class Types {
 public:
  Types(const Tree& tree, Problems& problems, const Contexts& contexts, Copies& copies,
        const ArxmlOptions& options, Model& model);

  /// The value of an event, field, argument or data element, by its TYPE-TREF.
  [[nodiscard]] Value value(const Node& prototype, const Context& context);
  /// What write/arxml had to put into a structure, because an event of AUTOSAR has one value; nothing: any
  /// other event.
  [[nodiscard]] std::optional<std::vector<Value>> arguments(const Node& prototype, const Context& context);
  /// All named types of the files with the default rules, those included that no service uses.
  void read_all();

 private:
  struct Frame {
    Rules rules{};  ///< of the value, and of the elements of arrays in it
    Rules base{};   ///< of members
    const Context* context = nullptr;
    std::vector<const Node*>* trail = nullptr;  ///< members on the way here
    const Node* implementation = nullptr;       ///< of an application type
    const Node* representation = nullptr;       ///< NETWORK-REPRESENTATION
    int depth = 0;
  };
  using Key = std::tuple<const Node*, const Node*, std::uint64_t, std::uint64_t, std::size_t>;
  /// Whose name it has, the COMPU-METHOD, and what else makes it another one.
  using EnumerationKey = std::tuple<const Node*, const Node*, messages::Primitive,
                                    std::optional<std::int64_t>, std::optional<std::endian>>;
  /// Types of one element, or without a name, by hash_of(): many rules make many variants.
  using Variants = std::unordered_map<std::size_t, std::vector<TypeIndex>>;
  struct NamedVariants {
    TypeIndex first = no_type;
    Variants all{};
  };

  [[nodiscard]] Value by_reference(const Node& holder, const Node* reference, const Frame& frame);
  [[nodiscard]] Value standard(std::string_view path, const Frame& frame);
  [[nodiscard]] Value build(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_new(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_implementation(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_application(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_value(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_string(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_array(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_map(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_members(const Node& node, const Frame& frame, Kind kind);
  [[nodiscard]] Value build_reference(const Node& node, const Node* reference, const Frame& frame);
  [[nodiscard]] Value build_alias(const Node& node, const Value& target);
  [[nodiscard]] Value named_alias(const Node& node, const Value& target, Notes notes);
  [[nodiscard]] Value build_application_array(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_application_map(const Node& node, const Frame& frame);
  [[nodiscard]] Value build_enumeration(const Node& node, const Node& texts, messages::Primitive primitive,
                                        const Frame& frame);
  [[nodiscard]] Value member(const Node& element, const Frame& frame, const Node* implementation);
  [[nodiscard]] Value element_type(const Node& element, const Frame& frame);
  [[nodiscard]] Value unnamed(Type type, const Frame& frame);
  [[nodiscard]] Value named(const Node& node, Type type, const Frame& frame);
  [[nodiscard]] Value primitive(messages::Primitive primitive, const Frame& frame);
  [[nodiscard]] Value unknown(Place place, const Frame& frame);
  [[nodiscard]] TypeIndex keep(const Node* node, Type type);
  [[nodiscard]] Wire lay_out(const Type& type, const Frame& frame) const;
  [[nodiscard]] std::optional<messages::Primitive> base_type(const Node* base);
  [[nodiscard]] const Node* implementation_of(const Node& application) const;
  [[nodiscard]] const Node* compu_method(const Node& node, const Node* implementation) const;
  [[nodiscard]] Notes notes_of(const Node& node);
  [[nodiscard]] bool may_build_again(const Node& node);
  [[nodiscard]] const Notes& computation_of(const Node& method);
  void add_limits(const Node& node, const Node* implementation, Type& type) const;
  void add_numbers(const Node& node, const Node* implementation, Type& type, Notes& notes);
  [[nodiscard]] Frame inside(const Frame& frame) const;

  const Tree& tree_;
  Problems& problems_;
  const Contexts& contexts_;
  Copies& copies_;
  const ArxmlOptions& options_;
  Model& model_;
  std::map<const Node*, const Node*> implementations_{};  ///< DATA-TYPE-MAPs
  std::map<Key, Value> built_{};
  std::map<std::vector<const Node*>, std::size_t> tag_set_numbers_{};
  std::set<const Node*> active_{};
  std::map<const Node*, NamedVariants> variants_{};
  Variants unnamed_{};
  std::map<EnumerationKey, Value> enumerations_{};
  std::set<const Node*> used_texts_{};           ///< COMPU-METHODs that an enumeration has
  std::map<const Node*, Notes> computations_{};  ///< by COMPU-METHOD
  std::size_t built_count_ = 0;
  bool full_ = false;
};

/// What is written beside an element: DESC, and ANNOTATIONs by their label.
[[nodiscard]] Notes notes_beside(const Node& node);
/// "text" as a name of letters, digits and '_'.
[[nodiscard]] std::string identifier(std::string_view text);

}  // namespace trestle::describe::arxml
