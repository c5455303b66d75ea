#pragma once
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/read/arxml/vocabulary.hpp"
#include "bridge/describe/read/problems.hpp"

namespace trestle::describe::arxml {

/// An element that was kept. Its text and names live in the tree.
struct Node {
  std::string_view name{};  ///< SHORT-NAME
  std::string_view text{};  ///< trimmed
  Node* parent = nullptr;
  Node* first_child = nullptr;
  Node* last_child = nullptr;
  Node* next = nullptr;
  std::int32_t line = 0;
  std::int32_t column = 0;
  std::uint16_t file = 0;
  Tag tag{};
  bool open_interval = false;  ///< INTERVAL-TYPE="OPEN"
  bool english = false;        ///< L="EN"
  bool formula = false;        ///< BINDING-TIME or the like: a value that is made up later

  [[nodiscard]] Place place() const noexcept { return {file, {line, column}}; }
  /// The first child of that tag, or nothing.
  [[nodiscard]] const Node* child(Tag tag) const noexcept;
  /// The text of the first child of that tag, or "".
  [[nodiscard]] std::string_view child_text(Tag tag) const noexcept;
  /// Down through several: the first of each tag.
  template <typename... Tags>
  [[nodiscard]] const Node* down(Tag first, Tags... further) const noexcept {
    const Node* found = child(first);
    if constexpr (sizeof...(further) > 0) {
      return found == nullptr ? nullptr : found->down(further...);
    } else {
      return found;
    }
  }
  /// The nearest element around it with that tag, itself excepted.
  [[nodiscard]] const Node* above(Tag tag) const noexcept;
};

/// Calls `visit` for each child of `node`, which may be nothing, with that tag.
template <typename Visit>
void each_child(const Node* node, Tag tag, Visit visit) {
  for (const Node* child = node == nullptr ? nullptr : node->first_child; child != nullptr;
       child = child->next) {
    if (child->tag == tag) {
      visit(*child);
    }
  }
}

/// Calls `visit` for each child with `tag` of each child with `list`: EVENTS/VARIABLE-DATA-PROTOTYPE.
template <typename Visit>
void each_in(const Node* node, Tag list, Tag tag, Visit visit) {
  each_child(node, list, [&](const Node& inner) { each_child(&inner, tag, visit); });
}

/// All files as one tree. Packages of the same path are one, and so are other elements of the same path and
/// kind in different files.
class Tree {
 public:
  /// @param model  names the files.
  Tree(const ArxmlOptions& options, const Model& model, Problems& problems)
      : options_{options}, model_{model}, problems_{problems} {}
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  /// Adds a file, the `file`th one. False when it cannot be read: the problems say why.
  bool add(std::istream& stream, std::uint16_t file);
  /// Joins what is split, and makes paths known. Once, after all files.
  void join();

  /// The element that a reference names, or nothing; with a warning when it only can be guessed.
  [[nodiscard]] const Node* resolve(const Node& reference) const;
  /// The same for the first child of that tag, if there is one. Says nothing when there is none.
  [[nodiscard]] const Node* follow(const Node* node, Tag reference) const;
  /// "/a/b/c", of names alone.
  [[nodiscard]] static std::string path(const Node* node);
  /// The path of what an element is in.
  [[nodiscard]] static std::string scope(const Node& node);
  /// All elements of that tag, in the order of the files.
  [[nodiscard]] const std::vector<const Node*>& all(Tag tag) const noexcept {
    return by_tag_[static_cast<std::size_t>(tag)];
  }

 private:
  friend class Handlers;
  [[nodiscard]] const Node* find(const Node* from, std::string_view path) const;
  [[nodiscard]] const Node* find(const Node* from, std::string_view path, int& steps) const;
  [[nodiscard]] const Node* guess(const Node& reference) const;
  struct Siblings;
  static void merge_children(Node& into, Node& from);
  static void absorb(Node& into, Node& child, Siblings& siblings);
  void index(Node& node, Node* named, std::size_t path_bytes);
  std::string_view keep(std::string_view text);

  const ArxmlOptions& options_;
  const Model& model_;
  Problems& problems_;
  std::deque<Node> nodes_{};
  std::deque<std::string> text_{};
  std::size_t text_bytes_ = 0;
  Node root_{};
  std::vector<Node*> tops_{};  ///< AUTOSAR of each file
  struct Key {
    const Node* in;
    std::string_view name;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const noexcept {
      return std::hash<std::string_view>{}(key.name) ^
             (std::hash<const void*>{}(key.in) * 0x9e3779b97f4a7c15ULL);
    }
  };
  std::unordered_map<Key, const Node*, KeyHash> names_{};
  std::unordered_map<Key, std::vector<const Node*>, KeyHash> more_names_{};  ///< of a name the further ones
  std::unordered_map<const Node*, std::string> bases_{};                     ///< BASE of references
  std::unordered_map<const Node*, const Node*> reference_bases_{};           ///< of packages
  mutable std::unordered_map<std::string_view, std::vector<const Node*>> loose_{};  ///< by the name alone
  mutable bool loose_known_ = false;
  std::vector<std::vector<const Node*>> by_tag_{};
};

}  // namespace trestle::describe::arxml
