#pragma once
#include <yaml-cpp/yaml.h>

#include "bridge/messages/convert/message_rules.hpp"

namespace trestle::messages {

/// The `wire` of a route that load_wire() reads as `rules` again: only what differs from the defaults. Null
/// when nothing does.
[[nodiscard]] YAML::Node wire_yaml(const MessageRules& rules);

}  // namespace trestle::messages
