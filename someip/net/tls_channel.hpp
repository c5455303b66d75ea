#pragma once
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/uio.h>

#include <memory>
#include <span>

#include "someip/core/magic_cookie.hpp"
#include "someip/net/tls.hpp"

namespace trestle::someip {

/// TLS over one connected socket that does not block. Functions that send and receive are like the system's:
/// -1 and errno when they fail, EAGAIN when they have to wait.
class TlsChannel {
 public:
  TlsChannel() = default;
  TlsChannel(const TlsChannel&) = delete;
  TlsChannel& operator=(const TlsChannel&) = delete;
  /// Tells the peer that nothing more comes, if that can be sent now.
  virtual ~TlsChannel() = default;

  /// What the handshake waits for.
  enum class Step : std::uint8_t { done, to_receive, to_send, failed };
  /// Goes on with the handshake. Nothing else may be called before it is done.
  [[nodiscard]] virtual Step handshake() = 0;
  /// Why the handshake or the last call failed, in words.
  [[nodiscard]] virtual std::string error() const = 0;

  /// As readv(). Reads on until nothing more is there, or the places are full.
  [[nodiscard]] virtual ssize_t receive(std::span<const iovec> places) = 0;
  /// Takes bytes and sends them: what it took is not to be sent again, even if some of it still waits here.
  [[nodiscard]] virtual ssize_t send(std::span<const iovec> parts) = 0;
  /// Sends what waits here. True: nothing does any more; else errno tells why.
  [[nodiscard]] virtual bool flush() = 0;
  /// Whether something is to be sent when the socket has room, even if nobody calls send().
  [[nodiscard]] virtual bool waits_to_send() const noexcept = 0;
  /// Whether there is something to receive that the socket does not tell of.
  [[nodiscard]] virtual bool has_unread() const noexcept = 0;
};

/// What the TLS of several connections has in common: keys and trust.
class TlsContext {
 public:
  explicit TlsContext(Duration handshake_timeout) : handshake_timeout_{handshake_timeout} {}
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;
  virtual ~TlsContext() = default;

  /// @param fd   outlives the result.
  /// @param own  which end of the connection we are.
  /// @throws std::bad_alloc
  [[nodiscard]] virtual std::unique_ptr<TlsChannel> open(int fd, StreamEnd own) const = 0;
  [[nodiscard]] Duration handshake_timeout() const noexcept { return handshake_timeout_; }

 private:
  Duration handshake_timeout_;
};

/// Reads the keys.
/// @throws std::invalid_argument  in words: what is wrong with the settings or a file, or that this build has
///                                no TLS.
[[nodiscard]] std::shared_ptr<const TlsContext> make_tls_context(const TlsSettings& settings);

}  // namespace trestle::someip
