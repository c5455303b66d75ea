#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/types/type_library.hpp"

/// Type hashes as ROS 2 computes them since Iron (REP-2011): nodes tell each other by them whether they mean
/// the same type. Comments, constants and default values do not count, names of fields do.
namespace trestle::messages {

/// The text that is hashed: the type and all that it is made of, in JSON.
/// @param name  as of type_hash().
[[nodiscard]] tl::expected<std::string, TypeError> hashed_description(TypeLibrary& library,
                                                                      std::string_view name);

/// "RIHS01_" and the SHA-256 of the description in 64 hexadecimal digits.
///
/// @param name  of a message as of TypeLibrary::resolve(), of a service ("pkg/srv/Name", also
///              "pkg/action/Name_SendGoal"), or of an action ("pkg/action/Name"), each of which has a hash of
///              its own. DDS topics carry the hash of their message; graph queries show that of the service.
/// @return the hash, or what is wrong with the type.
[[nodiscard]] tl::expected<std::string, TypeError> type_hash(TypeLibrary& library, std::string_view name);

}  // namespace trestle::messages
