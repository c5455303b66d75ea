#pragma once
#include <string>

#include "bridge/cli/terminal.hpp"
#include "bridge/tools/network_view.hpp"

namespace trestle::bridge {

struct TableSize {
  std::size_t rows = 24;
  std::size_t columns = 120;
};

/// The whole screen of `trestle watch`, with the escape sequences that put it over the one before.
/// @param where  the network, for the title.
[[nodiscard]] std::string screen_of(const NetworkView& view, const std::string& where, TimePoint now,
                                    TableSize size, const Colours& colours);

}  // namespace trestle::bridge
