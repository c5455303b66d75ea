#pragma once
#include <vector>

#include "bridge/carry/runtime/counters.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {

/// What all routes share in SOME/IP: its messages over UDP and TCP, their segments, and discovery.
void append_counters(std::vector<CounterGroup>& groups, const sd::Node& node);

}  // namespace trestle::carry
