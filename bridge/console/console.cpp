#include "bridge/console/console.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <charconv>
#include <exception>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "bridge/console/fresh_text.hpp"
#include "bridge/console/metrics.hpp"
#include "bridge/console/sight.hpp"
#include "bridge/picture/picture_json.hpp"
#include "bridge/web/assets.hpp"
#include "bridge/web/server.hpp"

namespace trestle::console {
namespace {

// Its time says nothing of where two texts differ.
bool are_equal(std::string_view a, std::string_view b) {
  unsigned differs = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    differs |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return differs == 0;
}

// The page tells nothing of the bridge by itself: it asks for that, and for the token.
std::optional<web::Answer> page_answer(std::string_view path) {
  const bool is_ours = path == "/look.css" || path == "/parts.js" || path.starts_with("/console/");
  return path == "/" ? web::asset_answer("/console/index.html")
         : is_ours   ? web::asset_answer(path)
                     : std::nullopt;
}

bool read_number(std::string_view text, std::size_t& into) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), into);
  return error == std::errc{} && end == text.data() + text.size();
}

// Of the calling thread, as Linux has it. Where that is not granted, it is as all others.
void give_way() {
  constexpr int nice = 10;
  [[maybe_unused]] const int result = ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
}

}  // namespace

/// All that can be asked for.
struct Console::Answers {
  boost::asio::io_context& io;
  FreshText prometheus;
  FreshText openmetrics;
  FreshText json;
  FreshText not_ready;
  std::string token;
  Newest newest;
  std::optional<boost::asio::thread_pool> worker{};  ///< from the first message on that somebody looks at

  void answer(const web::Request& request, const web::Server::Reply& reply) {
    if (request.method != "GET" && request.method != "HEAD") {
      return reply({.status = 405, .body = "nothing can be changed here\n"});
    }
    if (auto page = page_answer(request.path)) {
      return reply(std::move(*page));
    }
    // That the process lives anybody may know who can connect.
    if (request.path == "/healthz") {
      return reply({.body = "ok\n"});
    }
    if (!token.empty() && !are_equal(request.authorization, "Bearer " + token)) {
      return reply({.status = 401, .body = "this needs the token: Authorization: Bearer TOKEN\n"});
    }
    if (request.path == "/message" || request.path == "/sight") {
      return answer_later(request, reply);
    }
    reply(text_answer(request));
  }

 private:
  [[nodiscard]] web::Answer text_answer(const web::Request& request) {
    if (request.path == "/readyz") {
      const auto why = not_ready.now();
      return why->empty() ? web::Answer{.body = "ready\n"} : web::Answer{.status = 503, .body = *why + "\n"};
    }
    if (request.path == "/metrics") {
      const bool is_open = request.accept.find("application/openmetrics-text") != std::string::npos;
      return {.type = content_type(is_open ? MetricsForm::openmetrics : MetricsForm::prometheus),
              .body = *(is_open ? openmetrics : prometheus).now()};
    }
    if (request.path == "/status.json") {
      return web::json_answer(*json.now());
    }
    return web::not_found();
  }

  // A message is looked at on another thread, which gives way to all others: the bridge waits for nobody who
  // looks. At most one a connection is under way.
  void answer_later(const web::Request& request, const web::Server::Reply& reply) {
    const auto wanted = request.query.find("route");
    std::size_t route = 0;
    if (wanted == request.query.end() || !read_number(wanted->second, route)) {
      return reply({.status = 400, .body = "expected ?route=N, its place in the list of /status.json\n"});
    }
    auto shown = newest(route);
    if (!shown) {
      return reply({.status = 404, .body = "there is no such route, or its messages cannot be looked at\n"});
    }
    const bool wants_sight = request.path == "/sight";
    if (wants_sight && !is_sight(shown->type)) {
      return reply({.status = 404, .body = "there is nothing to see of this type\n"});
    }
    if (wants_sight && !shown->newest) {
      return reply({.status = 204});
    }
    if (!worker) {
      worker.emplace(1);
      boost::asio::post(*worker, give_way);
    }
    boost::asio::post(*worker, [&to = io, shown = std::move(*shown), wants_sight, reply] {
      web::Answer made;
      try {
        made = wants_sight ? web::Answer{.type = "application/octet-stream", .body = sight(shown)}
                           : web::json_answer(message_json(shown));
      } catch (const std::exception& error) {
        made = {.status = 500, .body = std::string{error.what()} + "\n"};
      }
      boost::asio::post(to, [made = std::move(made), reply]() mutable { reply(std::move(made)); });
    });
  }
};

Console::Console(boost::asio::io_context& io, const ConsoleSettings& settings,
                 const std::function<carry::Picture()>& look, Newest newest)
    : answers_{new Answers{io, FreshText{[look] { return metrics(look(), MetricsForm::prometheus); }},
                           FreshText{[look] { return metrics(look(), MetricsForm::openmetrics); }},
                           FreshText{[look] { return to_json(look()); }},
                           FreshText{[look] { return console::not_ready(look()); }}, settings.token,
                           std::move(newest)}},
      server_{std::make_unique<web::Server>(
          io, settings.at,
          [answers = answers_](const web::Request& request, const web::Server::Reply& reply) {
            answers->answer(request, reply);
          },
          web::ServerLimits{.connections = 16, .body_bytes = 0})} {}

Console::~Console() = default;

std::string Console::url() const {
  return server_->url();
}

std::string not_ready(const carry::Picture& picture) {
  if (picture.stopping) {
    return "the bridge is stopping";
  }
  return picture.someip.other_interface;
}

}  // namespace trestle::console
