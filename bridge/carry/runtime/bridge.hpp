// bridge/carry/runtime: a running bridge.
//
//   bridge.hpp              start here: joins SOME/IP and DDS, has all routes, gives their counters
//   running_route.hpp       what a route is while it runs
//   make_routes.hpp         makes them of a configuration; each kind has a file named by its direction:
//                           X_to_Y.cpp
//   someip_side.hpp         all that routes see of SOME/IP
//   dds_side.hpp            all that routes see of DDS
//   route_clock.hpp         all that routes see of time
//   discovered_routes.hpp   routes of patterns, made when topics appear
//   report.hpp              what a bridge reports about itself
//   counters.hpp            counts what was carried and what was lost
//   diagnostics.hpp         tells its state as ROS diagnostics
//   onlookers.hpp           shows messages of a route to those who look
//   surroundings.hpp        what is around the routes, and pictures of it; route_meter.hpp: rates
//                           and latencies
//   silence_watch.hpp       says why nothing comes on a route
//   loop_guard.hpp          keeps messages from going round in a ring of bridges
//   loop_check.hpp, suspected_loop.hpp   find such rings
//   shared_subscription.hpp what tools subscribe to beside the routes
//   bridge_mark.hpp         what ends of bridges say of themselves to other bridges
//   ways_back.hpp           when services of other bridges may be used
//
// One thread runs all of it, except that DDS may use its own threads to receive.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/report.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/picture/id_names.hpp"
#include "bridge/picture/picture.hpp"
#include "bridge/picture/seen_message.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::sd {
class Node;
struct SubscribeSpec;
}  // namespace trestle::sd

namespace trestle::messages {
class TypeLibrary;
}  // namespace trestle::messages

namespace trestle::carry {

/// A route at whose messages somebody looks.
struct LookedAt {
  std::string name;  ///< as in its picture
  std::string type;
  messages::MessageRules rules;
  std::optional<messages::FieldMapping> mapping;
  std::shared_ptr<const SeenMessage> newest;  ///< null: none has come since somebody looks
};

/// A running bridge: all routes of one configuration. Logs discovery to spdlog's default logger.
/// Not thread-safe: use it on the thread that runs the io_context.
class Bridge {
 public:
  /// Compiles the conversions, then opens all sockets and DDS endpoints. Nothing is offered or subscribed to
  /// unless everything could be opened.
  /// @param report  outlives the bridge.
  /// @param names   of its routes, for pictures and the log.
  /// @throws std::runtime_error  what() says what could not be opened and what to do.
  Bridge(boost::asio::io_context& io, const BridgeConfig& config, messages::TypeLibrary& types,
         Report& report, IdNames names = {});
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Withdraws all offers and subscriptions. Carries nothing afterwards.
  void stop();

  /// Everything that was received, sent and lost: routes first, then SOME/IP and SD.
  [[nodiscard]] std::vector<CounterGroup> counters() const;
  /// All of it at this moment: what status, console and metrics show. Costs some microseconds a route.
  /// Without the version of the program.
  [[nodiscard]] Picture picture() const;
  /// The newest message of a route, which is kept from the first question until some seconds after the last
  /// one.
  /// @param route  its place in the picture.
  /// @return nothing: there is no such route, or it carries no events.
  [[nodiscard]] std::optional<LookedAt> look_at(std::size_t route);
  /// What it takes part in SOME/IP with, until it ends: for others who use its address.
  [[nodiscard]] sd::Node& node() noexcept;
  /// Makes what they want to subscribe to one with the subscriptions of the routes.
  /// @return why that cannot be; empty: it can.
  [[nodiscard]] std::string share_with_routes(sd::SubscribeSpec& wish) const;

  /// The routes whose messages can be followed, now.
  [[nodiscard]] std::vector<RouteTitle> titles();
  /// What such a route is; null: it has ended.
  [[nodiscard]] const Route* route(std::uint64_t id) const;
  /// Shows a copy of each message to `sink` from now on, until what is returned ends. Null: the route has
  /// ended.
  [[nodiscard]] std::shared_ptr<void> follow(std::uint64_t id, MessageSink sink);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trestle::carry
