#pragma once
#include <span>
#include <string>
#include <vector>

#include "bridge/cli/options.hpp"
#include "bridge/describe/model.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::generate {

/// Listens to a SOME/IP network, sends nothing, and tells what was seen: CaptureModel.
/// @param where  an interface, "any", or an own address of the network; empty: where the system sends
/// multicast.
/// @return with an error when nothing can be seen; with a warning when nothing was there.
[[nodiscard]] describe::Reading listen_to_network(const std::string& where, cli::NetworkOptions network,
                                                  double seconds);

/// What services can be made of in a ROS graph: each topic that is written to, each service and each action
/// that is served, by name. What every node has (its parameters, its log) and what only bridges have (it is
/// in SOME/IP already) is left out unless it is named.
/// @param only   names of topics, services and actions; empty: all.
/// @param place  for messages.
[[nodiscard]] std::vector<describe::RosInterface> interfaces_of(std::span<const dds::FoundWriter> graph,
                                                                std::span<const std::string> only,
                                                                const std::string& place);

/// The names of what only bridges have, in their order.
[[nodiscard]] std::vector<std::string> brought_by_bridges(std::span<const dds::FoundWriter> graph);

}  // namespace trestle::generate
