#include "bridge/generate/page_caller.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/messages/values/byte_text.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::generate {
namespace {

/// How often we try to send a request without answer.
constexpr Duration sending_period = std::chrono::milliseconds{5};

}  // namespace

struct PageCaller::Call {
  Call(sd::Node& node, PageCall call, Done then)
      : what{std::move(call)}, done{std::move(then)}, proxy{node, what.service}, again{node.io()} {
    until = std::chrono::steady_clock::now() + what.call.timeout;
  }
  PageCall what;
  Done done;
  sd::Proxy proxy;
  boost::asio::steady_timer again;
  std::chrono::steady_clock::time_point until{};
};

void PageCaller::call(PageCall call, Done done) {
  std::shared_ptr<Call> started;
  try {
    if (node_ == nullptr) {
      node_ = std::make_unique<sd::Node>(io_, network_(), sd::DiscoveryLog{}, cli::Session::warn);
    }
    started = std::make_shared<Call>(*node_, std::move(call), done);
  } catch (const std::exception& error) {
    done(error_answer(fmt::format("{}; --address and --sd-port choose another place", error.what())));
    return;
  }
  calls_.push_back(started);
  if (started->what.forget) {
    send(started);
    return;
  }
  // calls_ alone keeps it, so that shutdown() can end it while there is a Node.
  const std::weak_ptr<Call> weak = started;
  started->proxy.call(
      started->what.call, std::move(started->what.payload),
      [this, weak](boost::system::error_code error, const sd::Response& response) {
        const auto ended = weak.lock();
        if (!ended) {
          return;
        }
        if (!error) {
          finish(ended, ended->what.show(response));
        } else if (error == sd::CallFault::unavailable) {
          finish(ended, error_answer(fmt::format("nobody offers service 0x{:04x} in major version {}",
                                                 someip::value(ended->what.service.service),
                                                 ended->what.service.major)));
        } else {
          std::string text =
              response.check ? cli::failed_check(*response.check, "the answer") : std::string{};
          text = text.empty() ? error.message() : text;
          if (!ended->what.note.empty()) {
            text += "; it was called " + ended->what.note;
          }
          if (!response.payload.empty()) {
            messages::append_hex(text += ": ", response.payload);
          }
          finish(ended, error_answer(text));
        }
      });
}

void PageCaller::send(const std::shared_ptr<Call>& call) {
  const auto payload = std::make_shared<const std::vector<std::byte>>(call->what.payload);
  if (call->proxy.send(call->what.call, *payload, payload)) {
    const std::string note = call->what.note.empty() ? std::string{} : " " + call->what.note;
    nlohmann::ordered_json json{{"ok", true}, {"text", "sent" + note + "; no response is expected"}};
    finish(call,
           web::json_answer(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)));
    return;
  }
  if (std::chrono::steady_clock::now() >= call->until) {
    finish(call, error_answer("nobody offers the service, or nothing can be sent to it"));
    return;
  }
  call->again.expires_after(sending_period);
  call->again.async_wait([this, weak = std::weak_ptr{call}](boost::system::error_code error) {
    const auto still = weak.lock();
    if (!error && still) {
      send(still);
    }
  });
}

void PageCaller::finish(const std::shared_ptr<Call>& call, web::Answer answer) {
  call->done(std::move(answer));
  std::erase(calls_, call);
  boost::asio::post(io_, [call] {});  // its proxy ends outside of its own handler
}

void PageCaller::shutdown() {
  calls_.clear();
  if (node_ != nullptr) {
    node_->shutdown();
  }
}

}  // namespace trestle::generate
