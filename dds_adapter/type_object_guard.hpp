#pragma once

namespace trestle::dds::detail {

/// Does nothing. Calling it makes the linker take type_object_guard.cpp, and with it the guard, from the
/// library into the program.
void link_type_object_guard() noexcept;

}  // namespace trestle::dds::detail
