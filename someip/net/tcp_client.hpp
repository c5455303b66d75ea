#pragma once
#include "someip/net/tcp_stream.hpp"

namespace trestle::someip {

struct TcpClientOptions {
  IpAddress local = {};  ///< own address; the port is any dynamic one that is free
  Endpoint remote = {};
  TcpOptions tcp = {};
  Duration connect_timeout = std::chrono::seconds{3};
  /// Wait before the second attempt to connect, doubled after each further one up to the maximum. A
  /// connection that has stood for longer than the maximum begins anew.
  Duration retry_min = std::chrono::milliseconds{100};
  Duration retry_max = std::chrono::seconds{5};
};

/// A connection to a server, which is connected to again whenever it is lost.  [feat_req_someip_647]
/// Not thread-safe: use it on the thread that runs the io_context.
class TcpClient {
 public:
  /// What the client is told. Any may destroy it.
  struct Handlers {
    std::function<void(const Message& message)> message;  ///< valid during the call
    /// The connection stands, from the own end `local`.
    std::function<void(const Endpoint& local)> connected = {};
    /// The connection is lost, or an attempt failed; the next one follows. What was waiting to be sent is
    /// dropped: requests that nobody waits for any more must not be carried out later.
    std::function<void(const std::string& why)> disconnected = {};
  };
  using Counters = TcpClientCounters;

  /// Begins to connect.
  TcpClient(boost::asio::io_context& io, const TcpClientOptions& options, Handlers handlers);
  /// Closes the connection.  [feat_req_someip_678]
  ~TcpClient();
  TcpClient(const TcpClient&) = delete;
  TcpClient& operator=(const TcpClient&) = delete;

  /// Sends, as TcpStream::send(). While the connection is being set up messages wait for it.
  /// @return false also when there is no connection and it is not yet time for the next attempt.
  bool send(const Header& header, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive = nullptr);

  /// As MessageSender::is_full_for(). False while there is no connection and none is being set up.
  [[nodiscard]] bool is_full_for(std::size_t bytes) const noexcept;

  /// As TcpStream::probe(), while the connection stands.
  void probe();

  /// The own end of the connection, while it stands.
  [[nodiscard]] std::optional<Endpoint> local() const;
  [[nodiscard]] Counters counters() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
