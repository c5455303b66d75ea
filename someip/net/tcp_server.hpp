#pragma once
#include "someip/net/net_error.hpp"
#include "someip/net/tcp_places.hpp"
#include "someip/net/tcp_stream.hpp"

namespace trestle::someip {

struct TcpServerOptions {
  Endpoint local = {};  ///< port 0: any dynamic port that is free
  /// Connections of clients at a time. One more takes the place of one from the address that has the most. If
  /// no address has more than the new one would have, it takes the place of one that has read nothing for a
  /// second of what waits for it; the address of that one takes no place from others in the next ten seconds.
  /// Else it takes the place of one over which nothing has gone for a second: of one that has never spoken if
  /// there is one, then of the one that was silent for longest. That one must not be in use (see
  /// Handlers::in_use) nor wait for an answer, and its address must have more than the new one has, unless it
  /// has never spoken. If there is no such connection, the new one is closed at once.
  std::size_t max_connections = 64;
  /// Of them, from one address: nobody can keep all others out.
  std::size_t max_connections_per_address = 64;
  /// A connection over which no message has gone for so long, in either direction, is closed (at most a
  /// quarter of this time later), unless Handlers::in_use says that it is needed. 0: none is closed.
  Duration idle_timeout{0};
  /// The same for a connection with a request that waits for its answer, see await_answer().
  Duration unanswered_timeout{0};
  /// Whether a connection from there is to be accepted at all; else it is closed at once. Empty: from
  /// anywhere.
  std::function<bool(const IpAddress& from)> accepts = {};
  TcpOptions tcp = {};
};

/// Listens at a TCP port and keeps the connections of its clients. Not thread-safe: use it on the thread that
/// runs the io_context.
class TcpServer {
 public:
  /// What the server is told. Any may destroy it.
  struct Handlers {
    std::function<void(const Message& message, const Endpoint& client)> message;  ///< valid during the call
    /// With TLS: when the handshake is done. If it fails, `refused` is told, and `closed` is not.
    std::function<void(const Endpoint& client)> connected = {};
    std::function<void(const Endpoint& client, const std::string& why)> closed = {};
    /// Whether a connection is needed even if it is idle, as for events. Must not destroy the server.
    std::function<bool(const Endpoint& client)> in_use = {};
    /// A connection of this client was refused, in words. Must not destroy the server.
    std::function<void(const Endpoint& client, const std::string& why)> refused = {};
  };
  using Counters = TcpServerCounters;

  /// @throws NetError when the socket cannot be opened, e.g. because the port is taken.
  TcpServer(boost::asio::io_context& io, const TcpServerOptions& options);
  /// Closes the port and all connections.
  ~TcpServer();
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;

  /// Starts to accept connections. Call once.
  void start(Handlers handlers);

  /// Accepts now whoever has connected: what another socket has brought may speak of it already.
  void accept_waiting();

  /// Sends to the client that is connected from `to`, as TcpStream::send().
  /// @return false also when there is no such client.
  bool send(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive = nullptr);

  /// As those of TcpStream, for the client that is connected from `to`.
  [[nodiscard]] bool is_full_for(const Endpoint& to, std::size_t bytes) const;
  Room make_room(const Endpoint& to, const Header& newer, const WaitRule& rule);

  /// A request of this client will be answered later: until then its connection is not taken for idle.
  void await_answer(const Endpoint& client);
  /// It is answered, or will not be.
  void answered(const Endpoint& client);

  /// Closes the connection of a client, if there is one; Handlers::closed is told `why`.
  void disconnect(const Endpoint& client, const std::string& why);

  /// The same, to make room for another client. Counts it.
  void give_way(const Endpoint& client);

  /// Adds the connections that there are.
  void add_places(std::vector<TcpPlace>& places);
  /// Where it listens, with the port that the system chose.
  [[nodiscard]] const Endpoint& local() const noexcept;
  [[nodiscard]] bool connected(const Endpoint& client) const;
  [[nodiscard]] Counters counters() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
