#pragma once
#include <yaml-cpp/yaml.h>

#include "bridge/documents/problems.hpp"
#include "bridge/messages/convert/message_rules.hpp"

namespace trestle::messages {

/// Reads the `wire` of a route: changes what it speaks of.
void load_wire(const YAML::Node& node, MessageRules& rules, documents::Problems& problems);

}  // namespace trestle::messages
