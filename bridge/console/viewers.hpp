#pragma once
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bridge/console/route_forms.hpp"
#include "bridge/console/viewer_counters.hpp"
#include "bridge/picture/seen_message.hpp"

namespace trestle::web {
struct Upgrade;
}

namespace trestle::console {

/// What viewers see of a bridge. All of it is asked on the thread that runs the bridge.
struct ViewerSources {
  /// The routes whose messages can be followed, now.
  std::function<std::vector<carry::RouteTitle>()> titles;
  /// Nothing: it has ended, or cannot be shown.
  std::function<std::optional<RouteView>(const carry::RouteTitle& route)> view;
  /// Each message comes to `sink`, on the thread that runs the bridge, until what is returned ends. Null: the
  /// route has ended.
  std::function<std::shared_ptr<void>(std::uint64_t route, carry::MessageSink sink)> follow;
};

/// Clients of Foxglove's WebSocket protocol: Foxglove, Lichtblick. Each route is a channel with its topic, as
/// CDR, and one "/someip/0x1234/0x8001" with the values of its SOME/IP payload, as JSON.
///
/// All work is done by a thread of its own, which begins with the first viewer and gives way to all others.
/// The bridge's thread copies the messages of routes that somebody has subscribed to, and waits for nobody.
class Viewers {
 public:
  static constexpr std::size_t most = 4;  ///< at once
  /// Texts of clients are at most so long.
  static constexpr std::size_t most_text_bytes = std::size_t{256} << 10U;

  /// @param bridge  runs the bridge; this is used on its thread, and ends before it.
  Viewers(boost::asio::io_context& bridge, ViewerSources sources);
  ~Viewers();
  Viewers(const Viewers&) = delete;
  Viewers& operator=(const Viewers&) = delete;

  [[nodiscard]] bool has_room() const noexcept { return counters().viewers < most; }
  /// @param upgrade  offers one of foxglove::subprotocols.
  void take(web::Upgrade upgrade);
  [[nodiscard]] ViewerCounters counters() const noexcept;

 private:
  class State;
  struct Feed;
  std::shared_ptr<Feed> feed_;
  std::unique_ptr<State> state_;
};

}  // namespace trestle::console
