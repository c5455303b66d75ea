#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "someip/core/request_check.hpp"
#include "someip/core/tp_pacing.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::sd {

struct E2eReply;
struct NodeCounters;
class ServiceDiscovery;
struct TcpPort;
struct UdpPort;

/// Takes answers where there is no port: for a caller whose requests did not come by a network.
class AnswerTaker {
 public:
  virtual bool take(const someip::Header& header, std::span<const ByteView> payload) = 0;

 protected:
  ~AnswerTaker() = default;
};

/// The way back to the sender of a request.
struct ReplyPath {
  Endpoint to{};
  // The port that the request came to; none: there is no answer.
  std::weak_ptr<UdpPort> udp{};
  std::weak_ptr<TcpPort> tcp{};
  AnswerTaker* taker = nullptr;      ///< in place of a port; outlives the request
  bool in_segments = true;           ///< whether a large answer may go over UDP  [feat_req_someiptp_788]
  someip::TpPacing pacing{};         ///< of a large answer over UDP
  NodeCounters* counters = nullptr;  ///< of the node, which no port outlives
  const ServiceDiscovery* discovery = nullptr;  ///< likewise
  /// Likewise: whether so large an answer may go there over UDP; none: it may.
  const std::function<bool(const Endpoint& to, std::size_t bytes)>* may_be_sent = nullptr;
  /// Likewise: told of each host that does not get its answer because it may not be there; none: nobody is.
  const std::function<void(const IpAddress& to)>* not_there = nullptr;
  std::shared_ptr<const E2eReply> protection{};  ///< none: without end-to-end protection

  /// Sends header and payload; false when that is not possible. What must not be sent in segments becomes an
  /// error, so that the caller need not wait in vain.
  bool send(const someip::Header& header, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive) const;
  bool send_protected(const someip::Header& header, std::span<const ByteView> payload) const;
  bool send_bytes(const someip::Header& header, std::span<const ByteView> payload,
                  std::shared_ptr<const void> keep_alive) const;
};

/// The answer that a request waits for: to be given once, now or later, on the thread that runs the
/// io_context. A Responder that is destroyed unused answers ReturnCode::not_ok, so that no caller waits in
/// vain. After the end of the Node, or of the caller's connection, it does nothing.
///
/// For fire and forget there is no answer [feat_req_someip_345]: whatever is given is dropped.
class Responder {
 public:
  Responder() = default;
  /// @param answered  false for fire and forget.
  Responder(const someip::Header& request, const someip::AnswerRules& rules, ReplyPath path, bool answered);
  ~Responder() { error(someip::ReturnCode::not_ok); }
  Responder(Responder&& other) noexcept;
  Responder& operator=(Responder&& other) noexcept;
  Responder(const Responder&) = delete;
  Responder& operator=(const Responder&) = delete;

  [[nodiscard]] const someip::Header& request() const noexcept { return request_; }
  [[nodiscard]] const Endpoint& caller() const noexcept { return path_.to; }
  /// Whether an answer is awaited and has not been given.
  [[nodiscard]] bool pending() const noexcept { return pending_; }

  /// Answers with success. Without `keep_alive` the payload need only live during the call; with it, as long
  /// as that does.
  /// @return false when the answer could not be sent, or was given before.
  bool respond(std::span<const ByteView> payload, std::shared_ptr<const void> keep_alive = nullptr);
  bool respond(ByteView payload = {}) { return respond(std::span{&payload, 1}); }

  /// Answers with an error, not ReturnCode::ok. A payload only where the interface has one for errors.
  bool error(someip::ReturnCode code, ByteView payload = {});

 private:
  /// Whether it was pending; it is no more.
  bool take_answer();
  bool answer(someip::ReturnCode code, std::span<const ByteView> payload,
              std::shared_ptr<const void> keep_alive);

  someip::Header request_;
  someip::AnswerRules rules_;
  ReplyPath path_;
  bool pending_ = false;
};

}  // namespace trestle::sd
