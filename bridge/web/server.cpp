#include "bridge/web/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/version.hpp>
#include <exception>
#include <optional>
#include <sstream>
#include <utility>

#include "someip/net/address_text.hpp"

namespace trestle::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;

int hex_digit(char digit) {
  return digit >= '0' && digit <= '9'   ? digit - '0'
         : digit >= 'a' && digit <= 'f' ? digit - 'a' + 10
         : digit >= 'A' && digit <= 'F' ? digit - 'A' + 10
                                        : -1;
}

/// Undoes %20 and, in a query, '+'. Nothing: it is not encoded so.
std::optional<std::string> decode(std::string_view text, bool query) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%') {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) {
        return std::nullopt;
      }
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      decoded += query && text[i] == '+' ? ' ' : text[i];
    }
  }
  return decoded;
}

/// Splits "/path?a=1&b=2". Nothing: it is badly encoded.
std::optional<Request> to_request(std::string_view target) {
  Request request;
  const std::size_t mark = target.find('?');
  const auto path = decode(target.substr(0, mark), false);
  if (!path || path->empty() || path->front() != '/') {
    return std::nullopt;
  }
  request.path = *path;
  std::string_view rest = mark == std::string_view::npos ? std::string_view{} : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const auto key = decode(pair.substr(0, equals), true);
    const auto value = decode(pair.substr(std::min(pair.size(), equals + 1)), true);
    if (!key || !value) {
      return std::nullopt;
    }
    request.query[*key] = *value;
  }
  return request;
}

/// A name without quotes, line ends or folders.
std::string safe_name(std::string_view name) {
  std::string safe;
  for (const char character : name) {
    const bool good = (character >= 'a' && character <= 'z') || (character >= 'A' && character <= 'Z') ||
                      (character >= '0' && character <= '9') || character == '.' || character == '-';
    safe += good ? character : '_';
  }
  return safe;
}

/// The address as URLs have it.
std::string host_text(const asio::ip::address& address) {
  return address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
}

}  // namespace

class Server::Implementation : public std::enable_shared_from_this<Implementation> {
 public:
  Implementation(asio::io_context& io, const Endpoint& at, Handler handler, ServerLimits limits,
                 std::vector<std::string> names)
      : io_{io}, acceptor_{io}, handler_{std::move(handler)}, limits_{limits}, hosts_{std::move(names)} {
    const asio::ip::tcp::endpoint endpoint{asio::ip::make_address(someip::to_string(at.address)), at.port};
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(asio::ip::tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
    hosts_.emplace_back("localhost");
    own_origin_ = "http://" + host_text(acceptor_.local_endpoint().address()) + ":" + fmt::to_string(port());
  }

  void start() { accept(); }
  void take_upgrades(Upgrades upgrades) { upgrades_ = std::move(upgrades); }
  void stop() {
    error_code ignored;
    acceptor_.close(ignored);
    wait_.cancel();
    for (const auto& connection : connections_) {
      if (const auto still = connection.lock()) {
        still->stop();
      }
    }
  }
  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  [[nodiscard]] std::string url() const { return own_origin_ + "/"; }

 private:
  /// One browser's connection: requests one after another.
  class Connection : public std::enable_shared_from_this<Connection> {
   public:
    Connection(asio::ip::tcp::socket socket, std::shared_ptr<Implementation> server)
        : stream_{std::move(socket)}, limits_{server->limits_}, server_{server} {}
    ~Connection() {
      if (const auto server = server_.lock()) {
        server->ended();
      }
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void read() {
      parser_.emplace();
      parser_->header_limit(static_cast<std::uint32_t>(limits_.header_bytes));
      parser_->body_limit(limits_.body_bytes);
      stream_.expires_after(std::chrono::duration_cast<std::chrono::milliseconds>(limits_.idle));
      http::async_read(stream_, buffer_, *parser_,
                       [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
    }
    void stop() { stream_.cancel(); }

   private:
    void on_read(error_code error) {
      asked_ = true;
      if (error == http::error::body_limit) {
        answer({.status = 413, .body = "too large\n"}, false);
      } else if (error == http::error::header_limit) {
        answer({.status = 431, .body = "the header is too large\n"}, false);
      } else if (error.category() == make_error_code(http::error::bad_method).category() &&
                 error != http::error::end_of_stream && error != http::error::partial_message) {
        answer({.status = 400, .body = "this is no HTTP request: " + error.message() + "\n"}, false);
      } else if (!error) {
        const bool keep_alive = parser_->get().keep_alive();
        if (const auto server = server_.lock()) {
          error_code ignored;
          const auto local = stream_.socket().local_endpoint(ignored);
          if (server->is_upgrade(parser_->get())) {
            return upgrade(*server, host_text(local.address()));
          }
          server->respond(parser_->get(), host_text(local.address()),
                          [self = shared_from_this(), keep_alive](Answer answer) {
                            self->answer(std::move(answer), keep_alive);
                          });
        } else {
          close();
        }
      } else {
        close();
      }
    }

    void upgrade(const Implementation& server, const std::string& own) {
      Upgrade made;
      if (auto refusal = server.refusal_of(parser_->get(), own, made.request)) {
        return answer(std::move(*refusal), false);
      }
      std::ostringstream head;
      head << parser_->get().base();
      made.received = head.str() + beast::buffers_to_string(buffer_.data());
      error_code error;
      made.is_v6 = stream_.socket().local_endpoint(error).address().is_v6();
      made.descriptor = stream_.release_socket().release(error);
      if (!error) {
        server.upgrades_->take(std::move(made));
      }
    }

    void answer(Answer answer, bool keep_alive) {
      if (!std::exchange(asked_, false)) {
        return;
      }
      response_.emplace();
      response_->version(11);
      response_->result(answer.status);
      response_->set(http::field::content_type, answer.type);
      response_->set(http::field::cache_control, "no-store");
      response_->set("X-Content-Type-Options", "nosniff");
      response_->set("Referrer-Policy", "no-referrer");
      response_->set("Cross-Origin-Resource-Policy", "same-origin");
      response_->set("Cross-Origin-Opener-Policy", "same-origin");
      response_->set("Content-Security-Policy",
                     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
                     "connect-src 'self'; form-action 'none'; frame-ancestors 'none'; base-uri 'none'");
      if (!answer.file_name.empty()) {
        response_->set(http::field::content_disposition,
                       "attachment; filename=\"" + safe_name(answer.file_name) + "\"");
      }
      response_->keep_alive(keep_alive);
      const bool head = parser_ && parser_->is_header_done() && parser_->get().method() == http::verb::head;
      const std::size_t bytes = answer.body.size();
      if (!head) {
        response_->body() = std::move(answer.body);
      }
      response_->content_length(bytes);
      // Anew: the answer may have taken longer than that.
      stream_.expires_after(std::chrono::duration_cast<std::chrono::milliseconds>(limits_.idle));
      http::async_write(stream_, *response_,
                        [self = shared_from_this(), keep_alive](error_code error, std::size_t) {
                          if (error || !keep_alive) {
                            self->close();
                          } else {
                            self->read();
                          }
                        });
    }

    void close() {
      error_code ignored;
      stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
      stream_.close();
    }

    beast::tcp_stream stream_;
    ServerLimits limits_;
    std::weak_ptr<Implementation> server_;  ///< what waits in the io_context may outlive it
    beast::flat_buffer buffer_{};
    bool asked_ = false;  ///< and not answered yet
    std::optional<http::request_parser<http::string_body>> parser_{};
    std::optional<http::response<http::string_body>> response_{};
  };

  void accept() {
    if (open_ >= limits_.connections || accepting_ || !acceptor_.is_open()) {
      return;
    }
    accepting_ = true;
    acceptor_.async_accept([weak = weak_from_this()](error_code error, asio::ip::tcp::socket socket) {
      const auto self = weak.lock();
      if (!self) {
        return;
      }
      self->accepting_ = false;
      if (!self->acceptor_.is_open()) {
        return;
      }
      if (!error) {
        ++self->open_;
        auto connection = std::make_shared<Connection>(std::move(socket), self);
        std::erase_if(self->connections_, [](const auto& one) { return one.expired(); });
        self->connections_.push_back(connection);
        connection->read();
        self->accept();
      } else {
        self->wait_.expires_after(std::chrono::milliseconds{100});  // no descriptor is free, for instance
        self->wait_.async_wait([weak](error_code) {
          if (const auto still = weak.lock()) {
            still->accept();
          }
        });
      }
    });
  }
  void ended() {
    --open_;
    accept_later();
  }
  /// Not within the end of a connection, which may be that of the server.
  void accept_later() {
    asio::post(io_, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) {
        self->accept();
      }
    });
  }

  /// "host:port" or "host": one that is meant for us.
  /// @param own  the address that the request came to; a name that somebody made point there is not it.
  [[nodiscard]] bool is_ours(std::string_view host, std::string_view own) const {
    const std::string suffix = fmt::format(":{}", port());
    if (host.ends_with(suffix)) {
      host.remove_suffix(suffix.size());
    }
    return host == own || std::ranges::find(hosts_, host) != hosts_.end();
  }

  static std::string_view text(beast::string_view view) { return {view.data(), view.size()}; }

  [[nodiscard]] bool is_upgrade(const http::request<http::string_body>& message) const {
    return upgrades_ && message.method() == http::verb::get &&
           beast::iequals(message[http::field::upgrade], "websocket");
  }

  /// Why a connection is not handed over; nothing: it is, with this request.
  [[nodiscard]] std::optional<Answer> refusal_of(const http::request<http::string_body>& message,
                                                 const std::string& own, Request& into) const {
    if (!is_ours(text(message[http::field::host]), own)) {
      return Answer{.status = 403, .body = "this is served for " + url() + " only\n"};
    }
    std::optional<Request> request = to_request(text(message.target()));
    if (!request) {
      return Answer{.status = 400, .body = "the address is badly encoded\n"};
    }
    into = std::move(*request);
    read_fields(message, into);
    const std::string_view origin = text(message[http::field::origin]);
    if (!origin.empty() && !(origin.starts_with("http://") && is_ours(origin.substr(7), own)) &&
        !upgrades_->takes_origin(into, origin)) {
      return Answer{.status = 403, .body = "a page of another origin may not do this\n"};
    }
    return upgrades_->refuse(into);
  }

  static void read_fields(const http::request<http::string_body>& message, Request& into) {
    into.method = text(message.method_string());
    into.accept = text(message[http::field::accept]);
    into.authorization = text(message[http::field::authorization]);
    into.protocols = text(message[http::field::sec_websocket_protocol]);
  }

  void respond(const http::request<http::string_body>& message, const std::string& own,
               const Reply& reply) const {
    if (!is_ours(text(message[http::field::host]), own)) {
      return reply({.status = 403, .body = "this page is served for " + url() + " only\n"});
    }
    const bool reads = message.method() == http::verb::get || message.method() == http::verb::head;
    const std::string_view origin = text(message[http::field::origin]);
    if (!reads && !origin.empty() && (!origin.starts_with("http://") || !is_ours(origin.substr(7), own))) {
      return reply({.status = 403, .body = "a page of another origin may not do this\n"});
    }
    // A form of a stranger's page has none of this type, and a script that sets it is asked about first.
    if (!reads && !text(message[http::field::content_type]).starts_with("application/json")) {
      return reply({.status = 415, .body = "expected application/json\n"});
    }
    std::optional<Request> request = to_request(text(message.target()));
    if (!request) {
      return reply({.status = 400, .body = "the address is badly encoded\n"});
    }
    read_fields(message, *request);
    request->body = message.body();
    try {
      handler_(*request, reply);
    } catch (const std::exception& error) {
      reply({.status = 500, .body = std::string{error.what()} + "\n"});
    }
  }

  asio::io_context& io_;
  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer wait_{io_};
  Handler handler_;
  std::optional<Upgrades> upgrades_{};
  ServerLimits limits_;
  std::vector<std::string> hosts_;
  std::string own_origin_{};
  std::size_t open_ = 0;
  bool accepting_ = false;
  std::vector<std::weak_ptr<Connection>> connections_{};
};

Server::Server(asio::io_context& io, const Endpoint& at, Handler handler, ServerLimits limits,
               std::vector<std::string> names)
    : implementation_{
          std::make_shared<Implementation>(io, at, std::move(handler), limits, std::move(names))} {
  implementation_->start();
}

Server::~Server() {
  implementation_->stop();
}

void Server::take_upgrades(Upgrades upgrades) {
  implementation_->take_upgrades(std::move(upgrades));
}

std::uint16_t Server::port() const {
  return implementation_->port();
}

std::string Server::url() const {
  return implementation_->url();
}

Answer json_answer(std::string json, unsigned status) {
  return {.status = status, .type = "application/json; charset=utf-8", .body = std::move(json)};
}

Answer html_answer(std::string html) {
  return {.type = "text/html; charset=utf-8", .body = std::move(html)};
}

Answer not_found() {
  return {.status = 404, .body = "there is no such page\n"};
}

}  // namespace trestle::web
