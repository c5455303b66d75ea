#include "bridge/console/console.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <charconv>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "bridge/console/foxglove.hpp"
#include "bridge/console/fresh_text.hpp"
#include "bridge/console/give_way.hpp"
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

// Pages of this very machine, and those of people who know what a console is for. Their desktop programs are
// pages of files.
bool is_viewer(std::string_view origin) {
  constexpr std::array<std::string_view, 2> known{"file://", "https://app.foxglove.dev"};
  constexpr std::array<std::string_view, 3> here{"localhost", "127.0.0.1", "[::1]"};
  const std::size_t scheme = origin.find("://");
  if (std::ranges::find(known, origin) != known.end() || scheme == std::string_view::npos) {
    return scheme != std::string_view::npos;
  }
  std::string_view host = origin.substr(scheme + 3);
  host = host.substr(0, host.find(':', host.starts_with('[') ? host.find(']') : 0));
  return std::ranges::find(here, host) != here.end();
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
  RecordProcess* records;
  std::optional<boost::asio::thread_pool> worker{};  ///< from the first message on that somebody looks at

  void answer(const web::Request& request, const web::Server::Reply& reply) {
    const bool reads = request.method == "GET" || request.method == "HEAD";
    if (!reads && (request.path != "/record" || request.method != "POST")) {
      return reply({.status = 405, .body = "nothing can be changed here\n"});
    }
    if (auto page = page_answer(request.path)) {
      return reply(std::move(*page));
    }
    // That the process lives anybody may know who can connect.
    if (request.path == "/healthz") {
      return reply({.body = "ok\n"});
    }
    if (!has_token(request)) {
      return reply({.status = 401, .body = "this needs the token: Authorization: Bearer TOKEN\n"});
    }
    if (request.path == "/record") {
      return reply(reads ? record_state() : change_record(request.body));
    }
    if (request.path == "/message" || request.path == "/sight") {
      return answer_later(request, reply);
    }
    reply(text_answer(request));
  }

  [[nodiscard]] bool has_token(const web::Request& request) const {
    return token.empty() || are_equal(request.authorization, "Bearer " + token);
  }
  /// Browsers let a script give WebSocket no header of its own, and viewers know nothing but an address: they
  /// may have the token in that.
  [[nodiscard]] bool has_token_in_address(const web::Request& request) const {
    const auto given = request.query.find("token");
    return !token.empty() && given != request.query.end() && are_equal(given->second, token);
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

  [[nodiscard]] web::Answer record_state() const {
    return web::json_answer(records != nullptr ? records->state_json() : RecordProcess::none_json());
  }
  [[nodiscard]] web::Answer change_record(const std::string& body) const {
    if (records == nullptr || !records->is_allowed()) {
      return {.status = 403,
              .body = "no record may be made: the configuration has no `console: {records: FOLDER}`\n"};
    }
    const auto wanted = nlohmann::json::parse(body, nullptr, false);
    const auto word = wanted.is_object() ? wanted.find("do") : wanted.end();
    const bool starts = word != wanted.end() && *word == "start";
    if (!starts && (word == wanted.end() || *word != "stop")) {
      return {.status = 400, .body = "expected {\"do\": \"start\"} or {\"do\": \"stop\"}\n"};
    }
    const std::string refusal = starts ? records->start() : records->stop();
    return refusal.empty() ? record_state() : web::Answer{.status = 409, .body = refusal + "\n"};
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
                 const std::function<carry::Picture()>& look, Newest newest, ViewerSources sources)
    : viewers_{sources.titles ? std::make_unique<Viewers>(io, std::move(sources)) : nullptr},
      answers_{new Answers{
          io, FreshText{[this, look] { return metrics(look(), MetricsForm::prometheus, viewer_counters()); }},
          FreshText{[this, look] { return metrics(look(), MetricsForm::openmetrics, viewer_counters()); }},
          FreshText{[look] { return to_json(look()); }},
          FreshText{[look] { return console::not_ready(look()); }}, settings.token, std::move(newest),
          settings.records}},
      server_{std::make_unique<web::Server>(
          io, settings.at,
          [answers = answers_](const web::Request& request, const web::Server::Reply& reply) {
            answers->answer(request, reply);
          },
          web::ServerLimits{.connections = 16, .body_bytes = 1024})} {
  if (viewers_) {
    take_viewers();
  }
}

void Console::take_viewers() {
  server_->take_upgrades(
      {.refuse = [this](const web::Request& request) -> std::optional<web::Answer> {
         if (request.path != "/") {
           return web::not_found();
         }
         if (!answers_->has_token(request) && !answers_->has_token_in_address(request)) {
           return web::Answer{.status = 401, .body = "this needs the token: ws://HOST:PORT/?token=TOKEN\n"};
         }
         if (foxglove::chosen_of(request.protocols).empty()) {
           return web::Answer{.status = 400, .body = "expected the subprotocol foxglove.sdk.v1\n"};
         }
         if (!viewers_->has_room()) {
           return web::Answer{.status = 503, .body = "there are as many viewers as may be\n"};
         }
         return std::nullopt;
       },
       .take = [this](web::Upgrade upgrade) { viewers_->take(std::move(upgrade)); },
       // Who has the token may be anybody's page: only the user can have given it.
       .takes_origin =
           [this](const web::Request& request, std::string_view origin) {
             return is_viewer(origin) || answers_->has_token_in_address(request);
           }});
}

Console::~Console() = default;

ViewerCounters Console::viewer_counters() const noexcept {
  return viewers_ ? viewers_->counters() : ViewerCounters{};
}

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
