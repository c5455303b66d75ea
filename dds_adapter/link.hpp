#pragma once

/// Definitions that nobody calls but that every program with a participant needs. A linker takes a file from
/// a static library only for something that is asked for; so these are, and do nothing.
namespace trestle::dds::detail {

/// sanitizers.cpp: tells the sanitizers about Fast DDS.
void link_sanitizer_hints() noexcept;

}  // namespace trestle::dds::detail
