#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Errors of a file that are told.
inline constexpr std::size_t max_type_faults = 20;

/// What is wrong in the text of a `.msg`, `.srv`, `.action` or `.idl` file: that of which the parsers tell
/// the first alone. Empty: they take it.
///
/// @param name  of the interface that it defines.
/// @param file  the file's name; it ends in ".idl" if the text is IDL.
[[nodiscard]] std::vector<TypeError> faults_of(std::string_view text, const InterfaceName& name,
                                               const std::string& file);

/// Those of one language.
[[nodiscard]] std::vector<TypeError> faults_of_msg(std::string_view text, const InterfaceName& name,
                                                   const std::string& file);
[[nodiscard]] std::vector<TypeError> faults_of_idl(std::string_view text, const InterfaceName& name,
                                                   const std::string& file);

}  // namespace trestle::messages
