#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/read/arxml/tree.hpp"

namespace trestle::describe::arxml {

/// Transformation properties: nothing where they do not say.
struct Rules {
  std::optional<someip::FieldWidth> array{};
  std::optional<someip::FieldWidth> string{};
  std::optional<someip::FieldWidth> structure{};
  std::optional<someip::FieldWidth> choice{};
  std::optional<someip::FieldWidth> selector{};
  std::optional<someip::StringEncoding> encoding{};
  std::optional<bool> legacy_strings{};  ///< without BOM and terminator
  std::optional<std::endian> byte_order{};
  std::optional<std::uint8_t> alignment_bytes{};
  std::optional<bool> smallest_length{};  ///< of tagged members
  friend bool operator==(const Rules&, const Rules&) = default;
};

/// What `special` says, else what `general` says.
[[nodiscard]] Rules joined(const Rules& special, const Rules& general);

/// Of AP-SOMEIP-TRANSFORMATION-PROPS, SOMEIP-TRANSFORMATION-PROPS, or
/// SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL and SOMEIP-TRANSFORMATION-DESCRIPTION. Nothing: no rules.
[[nodiscard]] Rules rules_of(const Node* properties, Problems& problems);

/// Other rules for one member deep in a payload, or for the payload's value itself.
struct Override {
  std::vector<const Node*> through{};  ///< members that lead there
  const Node* target = nullptr;
  Rules rules{};
  const Node* representation = nullptr;  ///< NETWORK-REPRESENTATION: another base type
};

/// Adds to `into` what an instance reference names: ROOT…, CONTEXT… and TARGET…. The root, or nothing.
[[nodiscard]] const Node* read_way(const Tree& tree, const Node& instance, Override& into,
                                   Problems& problems);

/// Tags of members and arguments.
using Tags = std::map<const Node*, someip::DataId>;

/// What holds for the payload of one event, method or field.
struct Context {
  Rules rules{};
  std::vector<Override> overrides{};
  std::vector<const Node*> tag_sets{};
};

/// All that is said of payloads, by the event, method, field or argument.
class Contexts {
 public:
  Contexts(const Tree& tree, Problems& problems);
  [[nodiscard]] const Context& of(const Node* prototype) const;
  /// The tag of a member or argument; those of the context's own sets come first.
  [[nodiscard]] std::optional<someip::DataId> tag(const Context& context, const Node* member) const;
  /// Whether members may have tags there.
  [[nodiscard]] bool has_tags(const Context& context) const noexcept {
    return !context.tag_sets.empty() || !all_tags_.empty();
  }
  /// The rules of a payload as a whole.
  void fill(Payload& payload, const Context& context) const;
  [[nodiscard]] const Tags& tags_of(const Node* set) const;
  void add(const Node* prototype, Context context) { contexts_[prototype] = std::move(context); }

 private:
  void read_mapping(const Node& mapping);
  void read_prototype_rules(const Node& properties);

  const Tree& tree_;
  Problems& problems_;
  std::map<const Node*, Context> contexts_{};
  std::map<const Node*, Tags> sets_{};
  Tags all_tags_{};
  Context none_{};
};

/// Of each payload the width of the length fields before its tagged members: a tag of wire type 4 means that
/// of the member's type. A payload with several widths becomes one that is not known, with a warning: the
/// model has one for all.
void find_tagged_lengths(Model& model, Problems& problems);

}  // namespace trestle::describe::arxml
