#pragma once
#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace trestle::dds::detail {

/// UDP sockets that no thread of DDS reads, but whoever calls receive(). All may be called from any thread.
class SampleSockets {
 public:
  /// Takes a datagram, which is valid during the call. Within it no socket may be opened or closed.
  using Taker = std::function<void(std::span<const std::byte> datagram, const sockaddr_in& from)>;

  /// @throws DdsError  when the system has no descriptor left.
  SampleSockets();
  ~SampleSockets();
  SampleSockets(const SampleSockets&) = delete;
  SampleSockets& operator=(const SampleSockets&) = delete;

  /// Opens one at this port of each address.
  /// @param addresses     IPv4; none: all of this host.
  /// @param buffer_bytes  to ask for; the system may grant less. 0: its default.
  /// @return false: not to be had, and nothing was opened.
  [[nodiscard]] bool open(std::uint16_t port, const std::vector<std::string>& addresses,
                          std::uint32_t buffer_bytes, Taker taker);
  [[nodiscard]] bool is_open(std::uint16_t port) const;
  /// After this nothing of that port is being taken.
  /// @return false: it was not open.
  bool close(std::uint16_t port);

  /// A descriptor that is readable when something has come.
  [[nodiscard]] int incoming() const noexcept { return epoll_; }
  /// Takes what has come, but not so much that others wait for long.
  void receive();

 private:
  struct Socket {
    int descriptor = -1;
    std::uint16_t port = 0;
    Taker taker;
  };
  static void close_all(const std::vector<Socket>& sockets) noexcept;

  const int epoll_;
  mutable std::mutex mutex_;  ///< held while a datagram is taken, so that closing waits for it
  std::vector<Socket> sockets_;
  std::vector<std::byte> datagram_;
};

}  // namespace trestle::dds::detail
