// bridge/web: local pages, served by the program itself.
//
//   server.hpp  a small HTTP server under Asio: requests in, answers out
//   assets.hpp  the files of assets/, compiled in: the look that all pages share
//
// Knows nothing of SOME/IP, DDS or descriptions; who has a page brings a handler.
#pragma once
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::web {

/// What a browser asks for.
struct Request {
  std::string method;  ///< "GET", "POST"
  std::string path;    ///< decoded, begins with "/": "/api/model"
  std::map<std::string, std::string, std::less<>> query{};
  std::string body{};
  std::string accept{};         ///< the header, as it came
  std::string authorization{};  ///< likewise
  std::string protocols{};      ///< likewise, of WebSocket: "a, b"
};

/// What it gets.
struct Answer {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< Content-Type
  std::string body{};
  /// A file name for what is to be saved; empty: shown.
  std::string file_name{};
};

[[nodiscard]] Answer json_answer(std::string json, unsigned status = 200);
[[nodiscard]] Answer html_answer(std::string html);
[[nodiscard]] Answer not_found();

/// A connection that shall speak WebSocket (RFC 6455), and is nobody's now: who gets it has to close it.
struct Upgrade {
  Request request;
  int descriptor = -1;  ///< of the TCP socket
  bool is_v6 = false;
  std::string received{};  ///< all that has come: the request, not answered yet, and perhaps more
};

/// What is done with requests for WebSocket.
struct Upgrades {
  /// Why it gets none; nothing: it is taken. Asked only about what came from `origins` or nowhere.
  std::function<std::optional<Answer>(const Request&)> refuse;
  std::function<void(Upgrade)> take;
  /// Whether a page of this Origin may ask, beside those of this server.
  std::function<bool(const Request&, std::string_view origin)> takes_origin;
};

struct ServerLimits {
  std::size_t connections = 32;  ///< at once; further ones wait in the system's queue
  std::size_t header_bytes = 16U << 10U;
  std::size_t body_bytes = 64U << 20U;
  Duration idle = std::chrono::seconds{30};  ///< until a connection without a request ends
};

/// Answers HTTP/1.1 requests, one handler for all, on the thread of the io_context.
///
/// A page of a stranger must not speak to it through the user's browser. So a request is refused (403) unless
/// its Host is the address that it came to, "localhost", or a name in `names`: a stranger's name that leads
/// to this host is none of these (DNS rebinding). A request other than GET and HEAD is refused unless its
/// Origin, where there is one, is ours (403), and its type is application/json (415), which no form can send.
/// Answers forbid scripts, frames and connections of other origins, and to be used by these.
/// To ask for WebSocket no browser needs leave of the server: there Origin counts as if something were
/// changed.
class Server {
 public:
  /// Gives the answer, now or later, on the thread of the io_context; at most once.
  using Reply = std::function<void(Answer)>;
  /// What it throws becomes an answer with status 500.
  using Handler = std::function<void(const Request&, Reply)>;

  /// @param at  port 0: the system chooses.
  /// @throws boost::system::system_error when nothing can listen there.
  Server(boost::asio::io_context& io, const Endpoint& at, Handler handler, ServerLimits limits = {},
         std::vector<std::string> names = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// From now on. Before, and where it is not called, such a request is answered like any other.
  void take_upgrades(Upgrades upgrades);

  [[nodiscard]] std::uint16_t port() const;
  /// "http://127.0.0.1:8080/"
  [[nodiscard]] std::string url() const;

 private:
  class Implementation;
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace trestle::web
