#pragma once
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bridge/console/record_process.hpp"
#include "bridge/console/shown_message.hpp"
#include "bridge/console/viewers.hpp"
#include "bridge/picture/picture.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::web {
class Server;
}

namespace trestle::console {

/// Where a bridge is looked at over HTTP.
struct ConsoleSettings {
  Endpoint at;
  /// Not empty: whoever asks has to have this token ("Authorization: Bearer TOKEN").
  std::string token{};
  /// Makes the records that are asked for; null: none may be made.
  RecordProcess* records = nullptr;
};

/// The newest message of a route, by its place in the picture. Nothing: there is no such route, or it carries
/// no events.
using Newest = std::function<std::optional<ShownMessage>(std::size_t route)>;

/// Answers GET of /metrics (Prometheus, OpenMetrics), /healthz, /readyz, /status.json and the page that shows
/// these, from the thread that runs the io_context; and of /message?route=N (message_json()) and
/// /sight?route=N (sight()) from one of its own, as these take a while. Nothing can be changed by it but what
/// POST of /record does, and texts are not made more often than FreshText says. At / it also speaks
/// Foxglove's WebSocket protocol (Viewers).
class Console {
 public:
  /// @param look, newest  are asked on the thread that runs the io_context.
  /// @param sources  for viewers; without its functions there are none.
  /// @throws boost::system::system_error when nothing can listen there.
  Console(boost::asio::io_context& io, const ConsoleSettings& settings,
          const std::function<carry::Picture()>& look, Newest newest, ViewerSources sources = {});
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// "http://127.0.0.1:9464/"
  [[nodiscard]] std::string url() const;

 private:
  struct Answers;
  void take_viewers();
  [[nodiscard]] ViewerCounters viewer_counters() const noexcept;

  std::unique_ptr<Viewers> viewers_;
  std::shared_ptr<Answers> answers_;
  std::unique_ptr<web::Server> server_;
};

/// Why the bridge is not ready; empty: it is. It is not while it stops, and where its address is that of
/// another network interface than the configured one. Routes without peers do not matter.
[[nodiscard]] std::string not_ready(const carry::Picture& picture);

}  // namespace trestle::console
