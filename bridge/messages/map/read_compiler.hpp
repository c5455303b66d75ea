#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bridge/messages/map/map_program.hpp"

namespace trestle::messages {

/// The slots that the fields of a message are noted in, those that are wanted.
using SlotsByField = std::map<std::string, std::uint32_t, std::less<>>;

/// Fills `reads` of a program whose types are known: all of the message that is there, in its order.
/// @return false: these are more than max_fields_per_type.
[[nodiscard]] bool compile_reads(MapProgram& program, const SlotsByField& slots);

/// Fields of a type that are neither wanted nor known to be left out. Of a message of which nothing is
/// wanted, it is the message.
[[nodiscard]] std::vector<std::string> unused_fields(const TypeTree& tree, const SlotsByField& slots,
                                                     const std::set<std::string, std::less<>>& known);

}  // namespace trestle::messages
