#pragma once
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>

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
};

/// Answers GET of /metrics (Prometheus, OpenMetrics), /healthz, /readyz, /status.json and the page that shows
/// these, from the thread that runs the io_context. Nothing can be changed by it, and texts are not made more
/// often than FreshText says.
class Console {
 public:
  /// @param look  gives the picture of now. @throws boost::system::system_error when nothing can listen
  /// there.
  Console(boost::asio::io_context& io, const ConsoleSettings& settings,
          const std::function<carry::Picture()>& look);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// "http://127.0.0.1:9464/"
  [[nodiscard]] std::string url() const;

 private:
  struct Texts;
  std::shared_ptr<Texts> texts_;
  std::unique_ptr<web::Server> server_;
};

/// Why the bridge is not ready; empty: it is. It is not while it stops, and where its address is that of
/// another network interface than the configured one. Routes without peers do not matter.
[[nodiscard]] std::string not_ready(const carry::Picture& picture);

}  // namespace trestle::console
