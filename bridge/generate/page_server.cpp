#include "bridge/generate/page_server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/system/system_error.hpp>
#include <charconv>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/generate/page_caller.hpp"
#include "bridge/web/assets.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::generate {
namespace {

/// A browser has six connections; a second one and a script of somebody find room, too.
constexpr web::ServerLimits limits{.connections = 16, .body_bytes = std::size_t{64} << 20U};

bool is_loopback(const IpAddress& address) {
  const std::string text = someip::to_string(address);
  return text.starts_with("127.") || text == "::1";
}

/// Joins the page, which reads and writes on a thread of its own, with the server and the network, so that a
/// large file does not keep them waiting.
class PageServer {
 public:
  PageServer(cli::Session& session, const Endpoint& at, Page::Settings settings,
             std::function<sd::NodeConfig()> network)
      : io_{session.io},
        page_{std::move(settings)},
        caller_{session.io, std::move(network)},
        server_{session.io, at,
                [this](const web::Request& request, const web::Server::Reply& reply) {
                  on_request(request, reply);
                },
                limits, names(at)} {}
  ~PageServer() {
    caller_.shutdown();
    worker_.stop();  // what waits is not begun
    worker_.join();
  }
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] std::string url() const { return server_.url(); }

 private:
  /// What this host may be called, where others may come.
  static std::vector<std::string> names(const Endpoint& at) {
    std::array<char, 256> name{};
    if (is_loopback(at.address) || gethostname(name.data(), name.size() - 1) != 0) {
      return {};
    }
    return {name.data()};
  }

  void on_request(const web::Request& request, const web::Server::Reply& reply) {
    if (request.method == "GET" || request.method == "HEAD") {
      const std::string path = request.path == "/" ? "/generate/index.html" : request.path;
      if (auto asset = web::asset_answer(path)) {
        reply(std::move(*asset));
        return;
      }
    }
    if (!request.path.starts_with("/api/")) {
      reply(web::not_found());
      return;
    }
    boost::asio::post(worker_, [this, request, reply] { work(request, reply); });
  }

  /// On the worker's thread.
  void work(const web::Request& request, const web::Server::Reply& reply) {
    const auto later = [&](auto task) { boost::asio::post(io_, std::move(task)); };
    try {
      if (request.method == "POST" && request.path == "/api/call") {
        auto call = page_.call(request);
        if (call) {
          later([this, what = std::move(*call), reply]() mutable { caller_.call(std::move(what), reply); });
        } else {
          later([reply, answer = std::move(call.error())] { reply(answer); });
        }
        return;
      }
      later([reply, answer = page_.answer(request)] { reply(answer); });
    } catch (const std::exception& error) {
      later([reply, text = std::string{error.what()}] { reply({.status = 500, .body = text + "\n"}); });
    }
  }

  boost::asio::io_context& io_;
  Page page_;  ///< of the worker
  PageCaller caller_;
  boost::asio::thread_pool worker_{1};
  web::Server server_;
};

}  // namespace

std::optional<Endpoint> parse_page_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string address = colon == std::string::npos ? "127.0.0.1" : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (address.starts_with('[') && address.ends_with(']')) {
    address = address.substr(1, address.size() - 2);
  } else if (address.find(':') != std::string::npos) {
    return std::nullopt;
  }
  Endpoint at;
  const auto ip = someip::parse_address(address);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), at.port);
  if (!ip || error != std::errc{} || end != port.data() + port.size()) {
    return std::nullopt;
  }
  at.address = *ip;
  return at;
}

int serve_page(const Endpoint& at, Page::Settings settings, std::function<sd::NodeConfig()> network) {
  cli::Session session{0};
  try {
    PageServer server{session, at, std::move(settings), std::move(network)};
    if (!is_loopback(at.address)) {
      cli::Session::warn(
          "everybody who can reach this address can read the files that the page was started with, and call "
          "services from here");
    }
    session.print(fmt::format("{} (Ctrl-C ends it)\n", server.url()));
    session.run();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error{fmt::format("cannot listen at {}: {}; --listen chooses another address",
                                         someip::to_string(at), error.code().message())};
  }
  return cli::exit_ok;
}

}  // namespace trestle::generate
