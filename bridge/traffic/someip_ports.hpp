#pragma once
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::traffic {

/// Decides which traffic of a capture is SOME/IP. docs/decode.md states the rule for users; in short: what
/// uses a port that is known to carry it, and what looks like it.
class SomeipPorts {
 public:
  /// @param always  ports that carry SOME/IP whatever it looks like, besides that of SD.
  explicit SomeipPorts(const std::vector<std::uint16_t>& always);

  /// Whether everything between these two is SOME/IP, however broken it looks.
  [[nodiscard]] bool known(Transport transport, const Endpoint& from, const Endpoint& to) const;
  /// Whether bytes between these two may be judged by what they look like.
  [[nodiscard]] static bool may_guess(const Endpoint& from, const Endpoint& to) noexcept;
  /// From now on `endpoint` is known. Endpoints beyond a fixed number are not remembered.
  void learn(Transport transport, const Endpoint& endpoint);

 private:
  std::set<std::uint16_t> always_;
  std::set<std::pair<Transport, Endpoint>> learnt_;
};

/// Whether a SOME/IP header seems to be at the front of `bytes`: the protocol version, a message type and a
/// return code that exist, and a Length of at most `max_length`, which may still be wrong.
[[nodiscard]] bool looks_like_header(ByteView bytes, std::uint32_t max_length) noexcept;

}  // namespace trestle::traffic
