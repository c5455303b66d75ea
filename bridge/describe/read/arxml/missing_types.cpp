#include "bridge/describe/read/arxml/missing_types.hpp"

#include "bridge/describe/read/arxml/type_facts.hpp"

namespace trestle::describe::arxml {
namespace {

/// Deeper types are refused where they are built.
constexpr int max_depth = 64;

/// The type or element that a reference belongs to.
[[nodiscard]] const Node& holder_of(const Node& node, const Node& type) noexcept {
  const Node* holder = &node;
  while (holder != &type && holder->name.empty()) {
    holder = holder->parent;
  }
  return *holder;
}

/// The next element within `type`, in the order of the file; nothing at its end.
[[nodiscard]] const Node* next_in(const Node* node, const Node& type) noexcept {
  if (node->first_child != nullptr) {
    return node->first_child;
  }
  while (node != &type && node->next == nullptr) {
    node = node->parent;
  }
  return node == &type ? nullptr : node->next;
}

}  // namespace

const Node* MissingTypes::in(const Node& type) {
  const auto [found, is_new] = known_.emplace(&type, nullptr);  // for now: a type may contain itself
  if (!is_new || depth_ >= max_depth) {
    return found->second;
  }
  ++depth_;
  const Node* missing = nullptr;
  for (const Node* node = type.first_child; node != nullptr && missing == nullptr;
       node = next_in(node, type)) {
    missing = behind(*node, type);
  }
  --depth_;
  return known_[&type] = missing;
}

const Node* MissingTypes::behind(const Node& node, const Node& type) {
  const bool is_base = node.tag == "BASE-TYPE-REF"_tag;
  if (!is_base && node.tag != "TYPE-TREF"_tag && node.tag != "IMPLEMENTATION-DATA-TYPE-REF"_tag &&
      node.tag != "TYPE-REFERENCE-REF"_tag && node.tag != "TEMPLATE-TYPE-REF"_tag) {
    return nullptr;
  }
  if (const Node* const target = tree_.resolve(node); target != nullptr) {
    return is_base ? nullptr : in(*target);
  }
  if (!is_base) {
    return is_standard(node.text) ? nullptr : &node;
  }
  const Node& holder = holder_of(node, type);
  const bool is_known = standard_primitive(last_name(node.text)) || standard_primitive(holder.name) ||
                        standard_primitive(holder.child_text("CATEGORY"_tag));
  return is_known ? nullptr : &node;
}

}  // namespace trestle::describe::arxml
