#pragma once
#include <string>

#include "bridge/documents/problems.hpp"

namespace trestle::carry {

/// Reads a configuration only to learn which keys its mappings are asked for. What is wrong with it is not
/// told, and nothing is missing from what is heard because of it: an empty mapping is asked for all.
void ask_keys(const std::string& text, const documents::KeyListener& listener);

}  // namespace trestle::carry
