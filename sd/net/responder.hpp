#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "someip/core/request_check.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::sd {

/// The answer that a request waits for: to be given once, now or later, on the thread that runs the
/// io_context. A Responder that is destroyed unused answers ReturnCode::not_ok, so that no caller waits in
/// vain. After the end of the Node, or of the caller's connection, it does nothing.
///
/// For fire and forget there is no answer [feat_req_someip_345]: whatever is given is dropped.
class Responder {
 public:
  /// Sends header and payload to the caller; false when that is not possible.
  using Send = std::function<bool(const someip::Header& header, std::span<const ByteView> payload,
                                  std::shared_ptr<const void> keep_alive)>;

  Responder() = default;
  Responder(const someip::Header& request, const Endpoint& caller, const someip::AnswerRules& rules,
            Send send)
      : request_{request}, caller_{caller}, rules_{rules}, send_{std::move(send)} {}
  ~Responder() { error(someip::ReturnCode::not_ok); }
  Responder(Responder&& other) noexcept;
  Responder& operator=(Responder&& other) noexcept;
  Responder(const Responder&) = delete;
  Responder& operator=(const Responder&) = delete;

  [[nodiscard]] const someip::Header& request() const noexcept { return request_; }
  [[nodiscard]] const Endpoint& caller() const noexcept { return caller_; }
  /// Whether an answer is awaited and has not been given.
  [[nodiscard]] bool pending() const noexcept { return static_cast<bool>(send_); }

  /// Answers with success. `payload` and `keep_alive` as in MessageSender::send(): without `keep_alive` the
  /// payload need only live during the call.
  /// @return false when the answer could not be sent, or was given before.
  bool respond(std::span<const ByteView> payload, std::shared_ptr<const void> keep_alive = nullptr);
  bool respond(ByteView payload = {}) { return respond(std::span{&payload, 1}); }

  /// Answers with an error, not ReturnCode::ok. A payload only where the interface has one for errors.
  bool error(someip::ReturnCode code, ByteView payload = {});

 private:
  bool answer(someip::ReturnCode code, std::span<const ByteView> payload,
              std::shared_ptr<const void> keep_alive);

  someip::Header request_;
  Endpoint caller_;
  someip::AnswerRules rules_;
  Send send_;  ///< empty: nothing to be answered any more
};

}  // namespace trestle::sd
