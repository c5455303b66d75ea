#pragma once
#include <functional>
#include <optional>

#include "sd/net/node.hpp"
#include "someip/net/udp_socket.hpp"

namespace trestle::traffic {

/// Hears service discovery without taking part in it: other SOME/IP stacks of this host are not disturbed.
class Listener {
 public:
  using Handler = std::function<void(ByteView datagram, const Endpoint& from, const Endpoint& to)>;

  /// @param handler  gets multicast datagrams, and after open_for_finding() also those to our address.
  /// @throws someip::NetError when the group cannot be joined.
  Listener(boost::asio::io_context& io, const sd::NodeConfig& network, Handler handler);

  /// Also sends FindService and hears the answers, which come by unicast. Once.
  /// @return false: another stack of this host has the address, so that only multicast is received.
  [[nodiscard]] bool open_for_finding();
  /// After open_for_finding().
  void find(someip::ServiceId service, someip::InstanceId instance);

 private:
  void on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to);

  boost::asio::io_context& io_;
  sd::NodeConfig network_;
  Handler handler_;
  someip::UdpSocket multicast_;
  std::optional<someip::UdpSocket> unicast_;
  std::uint16_t session_ = 0;
};

}  // namespace trestle::traffic
