#pragma once
#include <functional>
#include <memory>
#include <string>

#include "bridge/cli/session.hpp"
#include "bridge/guest/guest.hpp"
#include "sd/net/node.hpp"

namespace trestle::inspect {

/// How a command takes part in SOME/IP: with a Node of its own, or through the bridge of this host that has
/// the address. One of the two is there.
struct Way {
  std::unique_ptr<sd::Node> node{};
  std::unique_ptr<guest::Guest> bridge{};
};

/// @param quiet  it is not said that it is a bridge.
/// @throws someip::NetError  as a Node does, when the address is not a bridge's; with what is known of
///                           bridges.
///         std::runtime_error when it is, and `network` wants TLS, for which the bridge has its own settings.
[[nodiscard]] Way way_into(cli::Session& session, const sd::NodeConfig& network, const sd::DiscoveryLog& log,
                           const sd::DiscoveryLog& warn, bool quiet);

/// The bridge of this host that has the address; null: there is none, or it cannot be asked.
[[nodiscard]] std::unique_ptr<guest::Guest> bridge_that_has(cli::Session& session,
                                                            const sd::NodeConfig& network);
/// "trestle bridge drive.yaml, process 4711"
[[nodiscard]] std::string name_of(const guest::Guest& bridge);

/// For commands that a bridge does nothing for: they need an address of their own.
/// @throws as a Node; says what to do when a bridge has the address.
[[nodiscard]] std::unique_ptr<sd::Node> node_of_our_own(cli::Session& session, const sd::NodeConfig& network,
                                                        const sd::DiscoveryLog& log,
                                                        const sd::DiscoveryLog& warn);

/// Prints what the bridge says, and ends the session when it is the end, or the bridge has gone.
/// @param handler  gets all other frames.
/// @return whether it has ended so; valid when the session has ended, as long as the result lives.
[[nodiscard]] std::shared_ptr<const bool> listen(guest::Guest& bridge, cli::Session& session, bool quiet,
                                                 std::function<void(const guest::Frame& frame)> handler);

/// @throws std::runtime_error  protection needs an address of our own.
void refuse_protection(const guest::Guest& bridge, bool is_protected);

}  // namespace trestle::inspect
