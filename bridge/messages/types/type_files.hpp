#pragma once
#include <set>
#include <string>
#include <vector>

#include "bridge/documents/problem.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Files of folders are read as Windows-1252 where they are not UTF-8 (FolderSource), which somebody should
/// know: their comments are shown, and defaults may be wrong.
/// @param told  files that need not be looked at; the tree's are there afterwards.
/// @return a warning for each file that a message of the tree was read from and that is not UTF-8, at its
///         first such byte.
[[nodiscard]] std::vector<documents::Problem> encoding_warnings(const TypeTree& tree,
                                                                std::set<std::string>& told);

}  // namespace trestle::messages
