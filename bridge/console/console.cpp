#include "bridge/console/console.hpp"

#include <optional>
#include <string_view>
#include <utility>

#include "bridge/console/fresh_text.hpp"
#include "bridge/console/metrics.hpp"
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

}  // namespace

/// All that can be asked for.
struct Console::Texts {
  FreshText prometheus;
  FreshText openmetrics;
  FreshText json;
  FreshText not_ready;
  std::string token;

  [[nodiscard]] web::Answer answer(const web::Request& request) {
    if (request.method != "GET" && request.method != "HEAD") {
      return {.status = 405, .body = "nothing can be changed here\n"};
    }
    if (auto page = page_answer(request.path)) {
      return std::move(*page);
    }
    // That the process lives anybody may know who can connect.
    if (request.path == "/healthz") {
      return {.body = "ok\n"};
    }
    if (!token.empty() && !are_equal(request.authorization, "Bearer " + token)) {
      return {.status = 401, .body = "this needs the token: Authorization: Bearer TOKEN\n"};
    }
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
};

Console::Console(boost::asio::io_context& io, const ConsoleSettings& settings,
                 const std::function<carry::Picture()>& look)
    : texts_{std::make_shared<Texts>(
          Texts{FreshText{[look] { return metrics(look(), MetricsForm::prometheus); }},
                FreshText{[look] { return metrics(look(), MetricsForm::openmetrics); }},
                FreshText{[look] { return to_json(look()); }},
                FreshText{[look] { return console::not_ready(look()); }}, settings.token})},
      server_{std::make_unique<web::Server>(
          io, settings.at,
          [texts = texts_](const web::Request& request, const web::Server::Reply& reply) {
            reply(texts->answer(request));
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
