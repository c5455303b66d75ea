#pragma once
#include <string>
#include <tl/expected.hpp>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Compiles a type and the rules of its messages; or says in one line why the type cannot be carried by them.
[[nodiscard]] tl::expected<Program, std::string> compile_program(const TypeTree& tree,
                                                                 const MessageRules& rules);

}  // namespace trestle::messages
