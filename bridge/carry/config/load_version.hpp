#pragma once
#include <cstdint>

namespace trestle::documents {
class Section;
}  // namespace trestle::documents

namespace trestle::carry {

/// Reads `major` and `minor` of a service, in the element of a list that names it.
/// @param asked_for  whether somebody else offers it: then `minor` may be any, and is any_minor unless given.
void load_version(documents::Section& section, bool asked_for, std::uint8_t& major, std::uint32_t& minor);

}  // namespace trestle::carry
