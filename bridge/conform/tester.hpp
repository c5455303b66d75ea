#pragma once
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bridge/conform/packet.hpp"

/// The tester's own sockets. It knows the wire format only: no session is counted, no request is answered,
/// nothing is sent that a case did not ask for.
namespace trestle::conform {

/// A UDP port, or one end of a TCP connection.
enum class PortId : std::uint32_t {};

/// The tester cannot use its own addresses: what() says why, and what to do.
class TesterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Tester {
 public:
  /// Opens the two sockets of service discovery.
  /// @throws TesterError when that is not possible.
  Tester(const IpAddress& own, const IpAddress& group, std::uint16_t sd_port);
  ~Tester();
  Tester(const Tester&) = delete;
  Tester& operator=(const Tester&) = delete;

  /// Whether this host has the address.
  [[nodiscard]] static bool is_ours(const IpAddress& address);

  [[nodiscard]] Endpoint sd() const noexcept { return {own_, sd_port_}; }
  [[nodiscard]] Endpoint sd_group() const noexcept { return {group_, sd_port_}; }

  /// A UDP port of its own, which the system chooses; for a multicast group: joined, at that port.
  PortId open_udp(std::optional<Endpoint> group = {});
  /// The same, at a port that the caller chooses.
  /// @throws TesterError when it is not free.
  PortId open_udp_at(std::uint16_t port);
  /// Connects within the time; nothing: it was refused, or nobody answered.
  std::optional<PortId> connect(const Endpoint& to, Duration within);
  /// Waits for connections at a port that the system chooses; those that come get ids of their own,
  /// accepted().
  PortId listen();
  [[nodiscard]] std::vector<PortId> accepted(PortId listening) const;
  [[nodiscard]] Endpoint local(PortId port) const;
  /// Whether the peer has ended this TCP connection.
  [[nodiscard]] bool is_closed(PortId connection) const;
  /// What came of a message that was not whole is a packet from now on.
  void close(PortId port);
  /// Ends our half of a TCP connection: nothing is sent on it any more, and it is still read.
  void close_half(PortId connection);
  /// Packets tell that this TCP connection ends now, by us. That the peer ends one, they tell by themselves.
  void note_end(PortId connection);
  /// All but those of service discovery.
  void close_all();

  /// From the port of service discovery, to a host or the group.
  void send_sd(ByteView datagram, const Endpoint& to);
  void send(PortId port, ByteView datagram, const Endpoint& to);
  /// On a TCP connection. Bytes that are no whole message go, too.
  void send(PortId connection, ByteView bytes);

  /// Receives until the time is up, or `done` is true after something came. Whatever waits already is taken
  /// first.
  /// @return whether `done` was.
  bool receive(Duration within, const std::function<bool()>& done);
  /// Takes what has come by now.
  void receive_now() {
    receive(Duration{0}, [] { return false; });
  }

  /// `check` is called again and again while receive() waits, and ends that by throwing.
  void watch(std::function<void()> check) { check_ = std::move(check); }

  /// All that was sent and received since forget(); addresses stay.
  [[nodiscard]] std::deque<Packet>& packets() noexcept { return packets_; }
  void forget();

  /// The longest time that this program did not run although it wanted to, since forget(): it was late to
  /// return from a wait, or much time went by between two things that it sent or waited for.
  [[nodiscard]] Duration stalled() const noexcept { return stalled_; }
  /// What went on until now was no stall: the device was started, or a person was asked.
  void was_elsewhere();

 private:
  struct Port;

  Port& port(PortId id) const;
  PortId add(std::unique_ptr<Port> port);
  [[nodiscard]] std::unique_ptr<Port> bound(const Endpoint& local) const;
  Packet& note(bool sent, Transport transport, const Endpoint& from, const Endpoint& to, ByteView bytes);
  void read(PortId id);
  void read_datagrams(Port& from);
  void read_stream(Port& from);
  void note_rest(Port& from);
  void accept(PortId id);
  void send_from(const Port& from, ByteView datagram, const Endpoint& to);
  /// This program runs now.
  /// @param waited  so long it meant to wait since it ran last.
  void runs(Duration waited = {});

  IpAddress own_;
  IpAddress group_;
  std::uint16_t sd_port_;
  std::map<PortId, std::unique_ptr<Port>> ports_;
  std::uint32_t next_port_ = 0;
  PortId sd_unicast_{};
  PortId sd_multicast_{};
  std::deque<Packet> packets_;
  Duration stalled_{0};
  TimePoint ran_;  ///< when this program ran last
  std::function<void()> check_ = [] {};
};

}  // namespace trestle::conform
