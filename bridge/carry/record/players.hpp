#pragma once
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/record/replay_source.hpp"
#include "bridge/describe/interfaces.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::carry {

/// Where the messages of a recording go.
class Player {
 public:
  Player() = default;
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  virtual ~Player() = default;

  /// @return whether it was sent; else a counter says why not.
  virtual bool play(const Replayed& one) = 0;
  /// Whether there is a receiver of everything that is to be sent.
  [[nodiscard]] virtual bool has_receivers() const = 0;
  /// What was not sent, by reason.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> not_sent() const = 0;
  /// Ends what others see of it.
  virtual void stop() {}
};

/// Names of topics in place of those of the recording.
using Remaps = std::vector<std::pair<std::string, std::string>>;

/// Writes the topics of a recording to a DDS domain, with their types and quality of service. SOME/IP
/// messages are not for it.
/// @param topics  that are wanted. @param note  told of each topic.
/// @throws std::runtime_error
[[nodiscard]] std::unique_ptr<Player> play_to_topics(const dds::ParticipantConfig& participant,
                                                     const std::vector<const RecordedTopic*>& topics,
                                                     const Remaps& remaps,
                                                     const std::function<void(const std::string&)>& note);

/// Gives recorded events to the routes of a bridge's configuration that go from SOME/IP to DDS, which convert
/// them and write them to their topics. Nothing of SOME/IP is on the network.
/// @param config  is changed: only such routes are left. Outlives the player.
/// @throws std::runtime_error  there are none.
[[nodiscard]] std::unique_ptr<Player> play_to_routes(boost::asio::io_context& io,
                                                     const dds::ParticipantConfig& participant,
                                                     BridgeConfig& config, const Remaps& remaps);

/// Offers the services of a recording, and sends its events to subscribers. Calls are not replayed.
/// @param source      is read to its end once, for what there is, and then begins again.
/// @param interfaces  null: eventgroups are those that somebody subscribed to in the recording.
/// @param note        told of each service, and of what cannot be sent.
/// @throws std::runtime_error  there is no event that can be sent.
[[nodiscard]] std::unique_ptr<Player> play_to_someip(boost::asio::io_context& io,
                                                     const sd::NodeConfig& network, ReplaySource& source,
                                                     const describe::Interfaces* interfaces,
                                                     const std::function<void(const std::string&)>& note);

}  // namespace trestle::carry
