#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "bridge/messages/types/message_definition.hpp"

/// Constants and default values as `.msg` files write them.
namespace trestle::messages {

/// What is wrong with a literal, in one line; empty: nothing.
using Complaint = std::string;

/// Checks the value of a number, truth or string, which may stand in quotes.
/// @param string_bound  most characters of a string; 0: no bound.
[[nodiscard]] Complaint check_literal(Primitive type, std::uint32_t string_bound, std::string_view text);

/// Checks "[a, b, c]", a value of an array of primitives.
[[nodiscard]] Complaint check_array_literal(const FieldType& type, std::string_view text);

}  // namespace trestle::messages
