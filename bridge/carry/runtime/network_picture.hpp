#pragma once
#include "bridge/picture/picture.hpp"

namespace trestle::dds {
class Participant;
}
namespace trestle::sd {
class Node;
}

namespace trestle::carry {

/// So many hosts, offers and participants stand in a picture one by one.
inline constexpr std::size_t most_listed = 1024;

/// Fills in who is around in both networks, what was counted for all routes together, and how full the limits
/// are.
void append_networks(Picture& picture, const sd::Node& node, const dds::Participant& participant);

}  // namespace trestle::carry
