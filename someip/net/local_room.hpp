#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "someip/net/socket_calls.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// How full the receive buffers of UDP sockets are: of this host, where the system tells of any socket
/// (sock_diag). Of other hosts nobody tells.
class LocalRoom {
 public:
  struct Buffer {
    std::size_t unread = 0;  ///< bytes, as the system counts them
    std::size_t most = 0;    ///< likewise; twice what was asked for as SO_RCVBUF
  };

  /// Of the socket that gets what the socket at `from` sends to `to`, an address of this host. Costs two
  /// system calls.
  /// @param from  there is a socket of ours: so it is found out whether the system tells at all. If it does
  ///              not, it is not asked again.
  [[nodiscard]] std::optional<Buffer> of(const Endpoint& from, const Endpoint& to);

 private:
  enum class Use : std::uint8_t { untried, told, none };

  [[nodiscard]] std::optional<Buffer> ask(const Endpoint& from, const Endpoint& to);

  std::optional<Descriptor> socket_;
  Use use_ = Use::untried;
  std::uint32_t question_ = 0;  ///< number of the last one
};

}  // namespace trestle::someip
