#include "bridge/inspect/tools/beside_bridge.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "someip/net/address_text.hpp"
#include "someip/net/net_error.hpp"

namespace trestle::inspect {
namespace {

constexpr const char* own_address =
    "give the command an address of its own, which this host has beside that (ip address add ...): --address";

/// The bridge that has the address; else goes on with the error of a Node.
std::unique_ptr<guest::Guest> owner_of(boost::asio::io_context& io, const sd::NodeConfig& network,
                                       const someip::NetError& error) {
  std::vector<std::string> faults;
  auto bridge = guest::Guest::of(io, {network.address, network.port}, faults);
  if (!bridge) {
    std::string text = error.what();
    for (const std::string& fault : faults) {
      text += "\n" + fault;
    }
    throw someip::NetError{text};
  }
  return bridge;
}

}  // namespace

std::string name_of(const guest::Guest& bridge) {
  return fmt::format("trestle bridge {}, process {}", bridge.host().configuration, bridge.host().process);
}

std::unique_ptr<guest::Guest> bridge_that_has(cli::Session& session, const sd::NodeConfig& network) {
  std::vector<std::string> faults;
  return guest::Guest::of(session.io, {network.address, network.port}, faults);
}

Way way_into(cli::Session& session, const sd::NodeConfig& network, const sd::DiscoveryLog& log,
             const sd::DiscoveryLog& warn, bool quiet) {
  try {
    return {.node = std::make_unique<sd::Node>(session.io, network, log, warn)};
  } catch (const someip::NetError& error) {
    Way way{.bridge = owner_of(session.io, network, error)};
    if (network.tls) {
      throw std::runtime_error{fmt::format("{} has {}, and TLS settings of its own: {}", name_of(*way.bridge),
                                           someip::to_string(way.bridge->host().at), own_address)};
    }
    if (!quiet) {
      cli::Session::note(fmt::format("note: through {}, which has {}", name_of(*way.bridge),
                                     someip::to_string(way.bridge->host().at)));
    }
    return way;
  }
}

std::unique_ptr<sd::Node> node_of_our_own(cli::Session& session, const sd::NodeConfig& network,
                                          const sd::DiscoveryLog& log, const sd::DiscoveryLog& warn) {
  try {
    return std::make_unique<sd::Node>(session.io, network, log, warn);
  } catch (const someip::NetError& error) {
    const auto bridge = owner_of(session.io, network, error);
    throw someip::NetError{fmt::format("{} has {}, and offers nothing for others: {}", name_of(*bridge),
                                       someip::to_string(bridge->host().at), own_address)};
  }
}

std::shared_ptr<const bool> listen(guest::Guest& bridge, cli::Session& session, bool quiet,
                                   std::function<void(const guest::Frame&)> handler) {
  auto has_ended = std::make_shared<bool>(false);
  bridge.listen(
      [&session, quiet, has_ended, handler = std::move(handler)](const guest::Frame& frame) {
        const auto* const said = std::get_if<guest::Said>(&frame);
        if (said == nullptr) {
          handler(frame);
        } else if (said->is_end) {
          cli::Session::note("error: " + said->text);
          *has_ended = true;
          session.finish();
        } else if (!quiet) {
          cli::Session::note(said->text);
        }
      },
      [&session, has_ended] {
        if (!std::exchange(*has_ended, true)) {
          cli::Session::note("error: the bridge has ended, or begins anew");
        }
        session.finish();
      });
  return has_ended;
}

void refuse_protection(const guest::Guest& bridge, bool is_protected) {
  if (is_protected) {
    throw std::runtime_error{fmt::format("{} has {}, and does not protect messages end to end for others: {}",
                                         name_of(bridge), someip::to_string(bridge.host().at), own_address)};
  }
}

}  // namespace trestle::inspect
