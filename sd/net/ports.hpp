#pragma once
#include <list>
#include <vector>

#include "sd/net/access_guard.hpp"
#include "sd/net/deadline_timer.hpp"
#include "sd/net/node_config.hpp"
#include "someip/net/message_sender.hpp"
#include "someip/net/neighbours.hpp"
#include "someip/net/reassembly.hpp"
#include "someip/net/receive_memory.hpp"
#include "someip/net/send_budget.hpp"
#include "someip/net/tcp_client.hpp"
#include "someip/net/tcp_server.hpp"
#include "someip/net/udp_socket.hpp"

namespace trestle::sd {

/// Where the segments that come to a port are put together. Requests have places of their own: whoever asks
/// cannot take those of the events and answers that we wait for. Made when the first one comes.
struct LargeMessages {
  std::unique_ptr<someip::Reassembly> requests;
  std::unique_ptr<someip::Reassembly> expected;
  std::uint64_t lost = 0;  ///< messages, as limits were reached; as far as was told
};

/// A UDP port that services are offered at, calls are made from, or events arrive at.
struct UdpPort {
  UdpPort(boost::asio::io_context& io, std::uint16_t wanted, const someip::UdpOptions& options,
          std::size_t max_queued_bytes, Duration collect_for)
      : number{wanted}, socket{io, options}, sender{io, socket, max_queued_bytes, collect_for} {}
  std::uint16_t number;  ///< that was asked for; 0: any
  someip::UdpSocket socket;
  someip::MessageSender sender;
  LargeMessages large;
};

/// A TCP port that services are offered at.
struct TcpPort {
  TcpPort(boost::asio::io_context& io, std::uint16_t wanted, const someip::TcpServerOptions& options)
      : number{wanted}, server{io, options} {}
  std::uint16_t number;  ///< that was asked for; 0: any
  someip::TcpServer server;
};

/// A socket that receives the events of a multicast eventgroup.
struct GroupPort {
  GroupPort(boost::asio::io_context& io, const Endpoint& at, const someip::UdpOptions& options)
      : group{at}, socket{io, options} {}
  Endpoint group;
  someip::UdpSocket socket;
  LargeMessages large;
};

/// Where a message came from, and by which port: none for multicast or a connection of our own.
struct Source {
  Endpoint from;
  Transport transport = Transport::udp;
  std::shared_ptr<UdpPort> udp;
  std::shared_ptr<TcpPort> tcp;
};

/// What all UDP sockets of a node have in common.
[[nodiscard]] someip::UdpOptions udp_options(const NodeConfig& config, const Endpoint& local);

/// The sockets of a node but for SD's: each open for as long as somebody holds it, which must end before
/// these Ports do. Hands out whole messages: datagrams are taken apart and segments put together.
class Ports {
 public:
  struct Handlers {
    /// How large a message may be of which this segment came; 0: it is not to be put together. So nobody can
    /// fill the places with what nobody waits for.
    std::function<std::size_t(const someip::Message& segment, const Source&)> wanted;
    std::function<void(const someip::Message&, const Source&)> message;
    /// A client connected to our TCP endpoint `own`, or is gone.
    std::function<void(const Endpoint& own, const Endpoint& client, bool connected)> tcp_client;
    /// Whether a client's connection to `own` is needed although nothing is said.
    std::function<bool(const Endpoint& own, const Endpoint& client)> tcp_needed;
    /// A client was refused a connection, or lost it because a limit of ours was reached. An unspecified
    /// address: one of which no more is known.
    std::function<void(const Endpoint& client, const std::string& why)> tcp_refused;
    /// Large messages were lost because a limit of ours was reached: what happened, with the limit's name.
    /// `from` has sent the last one that came.
    std::function<void(const Endpoint& from, const std::string& what)> large_lost;
    /// A message was dropped because too much waits to be sent: at a UDP port (`to` is its receiver), or over
    /// a connection (null).
    std::function<void(const Endpoint* to)> queue_full;
    /// Datagrams to this UDP endpoint cannot be delivered: no socket or no host is there.
    std::function<void(const Endpoint& receiver)> unreachable;
    /// As Neighbours has it.
    std::function<someip::Neighbours::Answer(const IpAddress& host)> answer_of;
    std::function<someip::Neighbours::Answer(const IpAddress& host)> entry_of;
    /// A message is sent by UDP for which the send buffer is small: the system grants only so many bytes.
    std::function<void(int granted)> send_buffer_is_small;
  };

  Ports(boost::asio::io_context& io, const NodeConfig& config, NodeCounters& counters, AccessGuard& access,
        Handlers handlers);
  Ports(const Ports&) = delete;
  Ports& operator=(const Ports&) = delete;

  /// The port with this number, opened if it is not yet; 0: any.
  /// @param usable  whether it may be shared, if it is open already.
  /// @throws someip::NetError
  std::shared_ptr<UdpPort> udp(
      std::uint16_t number, const std::function<bool(const UdpPort&)>& usable = [](auto&) { return true; });
  std::shared_ptr<TcpPort> tcp(std::uint16_t number, const std::function<bool(const TcpPort&)>& usable);
  /// @throws someip::NetError
  std::shared_ptr<GroupPort> group(const Endpoint& endpoint);
  std::unique_ptr<someip::TcpClient> connect(const Endpoint& remote, someip::TcpClient::Handlers handlers);

  /// Nothing is offered here any more. Stays a while, so that the clients disconnect.  [feat_req_someip_680]
  void leave(std::shared_ptr<TcpPort> port);

  /// Accepts now whoever has connected to our TCP endpoints.
  void accept_waiting();
  /// Closes the connection of a client to our TCP endpoint `own`, if it stands.
  void disconnect(const Endpoint& own, const Endpoint& client, const std::string& why);
  /// Discovery has no place for the connection of this client to `own`: one of those at all ports gives way,
  /// by the rule of who_gives_way(). False if there is none that does.
  bool make_room(const Endpoint& own, const Endpoint& client);
  void follow_interface();
  /// Sends now what waits to leave together with others.
  void flush();

  // What was counted, also by ports that are closed.
  /// Forgets large messages that a host had begun before it was started anew.
  void forget_large(const IpAddress& sender);
  [[nodiscard]] someip::TpCounters reassembly_counters() const;
  [[nodiscard]] someip::MessageSender::Counters sender_counters() const;
  [[nodiscard]] someip::TcpServer::Counters tcp_counters() const;
  /// Calls `visit(name, used, limit)` for the memory that all ports and connections have together.
  template <typename Visit>
  void for_each_limit(Visit visit) const {
    visit("max_udp_receive_bytes", reassembly_budget_->used_bytes(), config_.max_udp_receive_bytes);
    visit("max_tcp_receive_bytes", receive_budget_->used_bytes(), config_.max_tcp_receive_bytes);
    visit("max_tcp_queued_bytes", send_budget_->used_bytes(), config_.max_tcp_queued_bytes);
  }
  /// Datagrams that the system dropped as a receive buffer was full.
  [[nodiscard]] std::uint64_t overflows() const;
  [[nodiscard]] std::uint64_t unreachable_ignored() const;

 private:
  /// @param port  that it came to: no more is handed out once that is closed.
  void on_train(const someip::Train& train, const Source& source, LargeMessages& large,
                const std::weak_ptr<const void>& port);
  /// The place for a message of this type; made if there is none yet.
  someip::Reassembly& reassembly_of(someip::MessageType type, LargeMessages& large);
  /// Tells if messages were lost as limits were reached.
  void tell_losses(LargeMessages& large, const Endpoint& from);
  void on_reassembly_time();
  [[nodiscard]] someip::TcpOptions tcp_options() const;
  /// Its owner's counters outlive it.
  template <typename Port>
  std::shared_ptr<Port> share(std::unique_ptr<Port> port);
  void keep_counters(UdpPort& last);
  void keep_counters(GroupPort& last);
  void keep_counters(TcpPort& last);

  boost::asio::io_context& io_;
  const NodeConfig& config_;
  NodeCounters& counters_;
  AccessGuard& access_;
  Handlers handlers_;
  std::shared_ptr<const someip::TlsContext> tls_;                ///< of all TCP connections; none: plain
  std::shared_ptr<someip::ReceiveBudget> receive_budget_;        ///< likewise
  std::shared_ptr<someip::SendBudget> send_budget_;              ///< likewise
  std::shared_ptr<someip::ReassemblyBudget> reassembly_budget_;  ///< of all UDP ports
  someip::LocalRoom local_room_;
  // Of closed ports.
  someip::MessageSender::Counters past_sent_;
  someip::TcpServer::Counters past_tcp_;
  someip::TpCounters past_reassembly_;
  std::uint64_t past_overflows_ = 0;
  std::uint64_t past_unreachable_ignored_ = 0;
  std::vector<std::weak_ptr<UdpPort>> udp_;
  std::vector<std::weak_ptr<TcpPort>> tcp_;
  std::vector<std::weak_ptr<GroupPort>> groups_;
  std::list<std::pair<DeadlineTimer, std::shared_ptr<TcpPort>>> leaving_;
  DeadlineTimer reassembly_timer_;  ///< of all ports
};

}  // namespace trestle::sd
