#include "sd/net/responder.hpp"

#include <utility>

namespace trestle::sd {

Responder::Responder(Responder&& other) noexcept
    : request_{other.request_},
      caller_{other.caller_},
      rules_{other.rules_},
      send_{std::exchange(other.send_, nullptr)} {}

Responder& Responder::operator=(Responder&& other) noexcept {
  if (this != &other) {
    error(someip::ReturnCode::not_ok);
    request_ = other.request_;
    caller_ = other.caller_;
    rules_ = other.rules_;
    send_ = std::exchange(other.send_, nullptr);
  }
  return *this;
}

bool Responder::respond(std::span<const ByteView> payload, std::shared_ptr<const void> keep_alive) {
  return answer(someip::ReturnCode::ok, payload, std::move(keep_alive));
}

bool Responder::error(someip::ReturnCode code, ByteView payload) {
  // An error never answers an error.  [feat_req_someip_704]
  if (request_.return_code != someip::ReturnCode::ok) {
    send_ = nullptr;
  }
  return answer(code, {&payload, 1}, nullptr);
}

bool Responder::answer(someip::ReturnCode code, std::span<const ByteView> payload,
                       std::shared_ptr<const void> keep_alive) {
  const Send send = std::exchange(send_, nullptr);
  return send && send(someip::answer_header(request_, code, rules_), payload, std::move(keep_alive));
}

}  // namespace trestle::sd
