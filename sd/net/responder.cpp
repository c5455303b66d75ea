#include "sd/net/responder.hpp"

#include <utility>

#include "sd/core/service_discovery.hpp"
#include "sd/net/ports.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::sd {

bool ReplyPath::send(const someip::Header& header, std::span<const ByteView> payload,
                     std::shared_ptr<const void> keep_alive) const {
  return protection ? send_protected(header, payload) : send_bytes(header, payload, std::move(keep_alive));
}

bool ReplyPath::send_bytes(const someip::Header& header, std::span<const ByteView> payload,
                           std::shared_ptr<const void> keep_alive) const {
  if (const auto port = tcp.lock()) {
    return port->server.send(to, header, payload, std::move(keep_alive));
  }
  const auto port = udp.lock();
  if (!port) {
    return taker != nullptr && taker->take(header, payload);
  }
  if (!port->sender.greet(to)) {
    ++counters->answers_to_silent;
    if (not_there != nullptr) {
      (*not_there)(to.address);
    }
    return false;
  }
  const std::size_t bytes = size_of(payload);
  const bool large = bytes > someip::max_plain_payload_bytes;
  const bool refused = large && in_segments && may_be_sent != nullptr && !(*may_be_sent)(to, bytes);
  if (refused || (large && !in_segments)) {
    ++(refused ? counters->answers_refused : counters->not_to_be_segmented);
    someip::Header failed = header;
    failed.return_code = someip::ReturnCode::not_ok;
    port->sender.send(to, failed, {});
    return false;
  }
  someip::TpPacing paced = pacing;
  // As the application wants, otherwise as the client can take it, if a subscription of it says that.
  if (large && !paced.burst) {
    paced.burst = someip::burst_into(discovery->receive_buffer_of(to));
  }
  return port->sender.send(to, header, payload, std::move(keep_alive), paced);
}

Responder::Responder(const someip::Header& request, const someip::AnswerRules& rules, ReplyPath path,
                     bool answered)
    : request_{request}, rules_{rules}, path_{std::move(path)}, pending_{answered} {
  if (const auto port = path_.tcp.lock(); port && pending_) {
    port->server.await_answer(path_.to);
  }
}

bool Responder::take_answer() {
  const bool was = std::exchange(pending_, false);
  if (const auto port = path_.tcp.lock(); port && was) {
    port->server.answered(path_.to);
  }
  return was;
}

Responder::Responder(Responder&& other) noexcept
    : request_{other.request_},
      rules_{other.rules_},
      path_{std::move(other.path_)},
      pending_{std::exchange(other.pending_, false)} {}

Responder& Responder::operator=(Responder&& other) noexcept {
  if (this != &other) {
    error(someip::ReturnCode::not_ok);
    request_ = other.request_;
    rules_ = other.rules_;
    path_ = std::move(other.path_);
    pending_ = std::exchange(other.pending_, false);
  }
  return *this;
}

bool Responder::respond(std::span<const ByteView> payload, std::shared_ptr<const void> keep_alive) {
  return answer(someip::ReturnCode::ok, payload, std::move(keep_alive));
}

bool Responder::error(someip::ReturnCode code, ByteView payload) {
  // An error never answers an error.  [feat_req_someip_704]
  if (request_.return_code != someip::ReturnCode::ok) {
    take_answer();
  }
  return answer(code, {&payload, 1}, nullptr);
}

bool Responder::answer(someip::ReturnCode code, std::span<const ByteView> payload,
                       std::shared_ptr<const void> keep_alive) {
  return take_answer() &&
         path_.send(someip::answer_header(request_, code, rules_), payload, std::move(keep_alive));
}

}  // namespace trestle::sd
