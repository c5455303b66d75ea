// Types that cannot be built, because what they consist of is in none of the files.
#pragma once
#include <map>

#include "bridge/describe/read/arxml/tree.hpp"

namespace trestle::describe::arxml {

class MissingTypes {
 public:
  explicit MissingTypes(const Tree& tree) : tree_{tree} {}

  /// The first reference in `type`, or in what it consists of, that leads nowhere; or nothing.
  [[nodiscard]] const Node* in(const Node& type);

 private:
  [[nodiscard]] const Node* behind(const Node& node, const Node& type);

  const Tree& tree_;
  std::map<const Node*, const Node*> known_{};
  int depth_ = 0;
};

}  // namespace trestle::describe::arxml
