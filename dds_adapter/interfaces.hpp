#pragma once
#include <string>
#include <vector>

namespace trestle::dds::detail {

/// @param interfaces  that DDS is to use, as IPv4 addresses; none: all.
/// @throws DdsError  unless each is an address of this host: names those that there are.
void check_interfaces(const std::vector<std::string>& interfaces);

}  // namespace trestle::dds::detail
