// What the sockets are set to, as the system tells.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <fstream>
#include <set>
#include <string>

#include "someip/net/addresses.hpp"
#include "someip/net/net_error.hpp"
#include "someip/net/tcp_client.hpp"
#include "someip/net/tcp_server.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/covers.hpp"
#include "test/loopback.hpp"

namespace trestle::someip::socket_options_test {
namespace {

using test::covers;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

/// The socket of this process that is bound there, and connected to `peer` if that is given.
int descriptor_of(const Endpoint& local, const std::optional<Endpoint>& peer = std::nullopt) {
  for (int fd = 3; fd < 256; ++fd) {
    SocketAddress own;
    if (getsockname(fd, own.data(), &own.size()) != 0 || own.endpoint() != local) {
      continue;
    }
    SocketAddress other;
    const bool connected = getpeername(fd, other.data(), &other.size()) == 0;
    if (connected == peer.has_value() && (!connected || other.endpoint() == peer)) {
      return fd;
    }
  }
  ADD_FAILURE() << "there is no such socket";
  return -1;
}

int option(int fd, int level, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  EXPECT_EQ(getsockopt(fd, level, name, &value, &size), 0);
  return value;
}

TEST(SocketOptions, OfUdp) {
  boost::asio::io_context io;
  const IpAddress own = test::own_address(1);
  const UdpSocket socket{io,
                         {.local = {own, 0},
                          .interface = MulticastInterface{own},
                          .multicast_ttl = 3,
                          .unicast_ttl = 7,
                          .dscp = 46,
                          .receive_buffer_bytes = 40'000,
                          .send_buffer_bytes = 30'000}};
  const int fd = descriptor_of(socket.local());
  EXPECT_EQ(option(fd, IPPROTO_IP, IP_TOS), 46 << 2);
  EXPECT_EQ(option(fd, IPPROTO_IP, IP_MULTICAST_TTL), 3);
  EXPECT_EQ(option(fd, IPPROTO_IP, IP_TTL), 7);
  EXPECT_EQ(option(fd, SOL_SOCKET, SO_RCVBUF), 80'000) << "the system doubles it";
  EXPECT_EQ(option(fd, SOL_SOCKET, SO_SNDBUF), 60'000);
  EXPECT_THROW((UdpSocket{io, {.local = {own, 0}, .dscp = 64}}), NetError);
}

TEST(SocketOptions, OfUdpOverIpv6) {
  boost::asio::io_context io;
  IpAddress loopback{.v6 = true};
  loopback.bytes[15] = 1;
  const UdpSocket socket{io,
                         {.local = {loopback, 0},
                          .interface = MulticastInterface{loopback},
                          .multicast_ttl = 3,
                          .unicast_ttl = 7,
                          .dscp = 10}};
  const int fd = descriptor_of(socket.local());
  EXPECT_EQ(option(fd, IPPROTO_IPV6, IPV6_TCLASS), 10 << 2);
  EXPECT_EQ(option(fd, IPPROTO_IPV6, IPV6_UNICAST_HOPS), 7);
  EXPECT_EQ(option(fd, IPPROTO_IPV6, IPV6_MULTICAST_HOPS), 3);
}

TEST(SocketOptions, OfTcpOverIpv6) {
  boost::asio::io_context io;
  IpAddress loopback{.v6 = true};
  loopback.bytes[15] = 1;
  TcpServer server{io, {.local = {loopback, 0}, .tcp = {.unicast_ttl = 9}}};
  std::optional<Endpoint> client_end;
  server.start({.message = {}, .connected = [&](const Endpoint& client) { client_end = client; }});
  const TcpClient client{
      io, {.local = loopback, .remote = server.local(), .tcp = {.unicast_ttl = 8}}, {.message = {}}};
  for (int i = 0; i < 100 && !(client_end && client.local()); ++i) {
    io.run_one_for(50ms);
  }
  ASSERT_TRUE(client_end);
  EXPECT_EQ(option(descriptor_of(*client_end, server.local()), IPPROTO_IPV6, IPV6_UNICAST_HOPS), 8);
  EXPECT_EQ(option(descriptor_of(server.local(), client_end), IPPROTO_IPV6, IPV6_UNICAST_HOPS), 9);
}

TEST(SocketOptions, OfBothEndsOfATcpConnection) {
  covers({"feat_req_someip_325"});
  boost::asio::io_context io;
  TcpServer server{io, {.local = {test::own_address(1), 0}, .tcp = {.dscp = 46}}};
  std::optional<Endpoint> client_end;
  server.start({.message = {}, .connected = [&](const Endpoint& client) { client_end = client; }});
  const TcpClient client{
      io, {.local = test::own_address(2), .remote = server.local(), .tcp = {.dscp = 26}}, {.message = {}}};
  for (int i = 0; i < 100 && !(client_end && client.local()); ++i) {
    io.run_one_for(50ms);
  }
  ASSERT_TRUE(client_end);
  ASSERT_EQ(client.local(), client_end);
  const int at_client = descriptor_of(*client_end, server.local());
  const int at_server = descriptor_of(server.local(), client_end);
  EXPECT_EQ(option(at_client, IPPROTO_TCP, TCP_NODELAY), 1) << "Nagle's algorithm is off";
  EXPECT_EQ(option(at_server, IPPROTO_TCP, TCP_NODELAY), 1);
  EXPECT_EQ(option(at_client, IPPROTO_IP, IP_TOS), 26 << 2);
  EXPECT_EQ(option(at_server, IPPROTO_IP, IP_TOS), 46 << 2);
}

TEST(SocketOptions, ChooseDynamicPorts) {
  covers({"feat_req_someip_32", "feat_req_someip_661"});
  boost::asio::io_context io;
  std::vector<int> ports;
  std::set<int> different;
  for (int i = 0; i < 20; ++i) {
    const UdpSocket udp{io, {.local = {test::own_address(1), 0}}};
    TcpServer tcp{io, {.local = {test::own_address(1), 0}}};
    tcp.start({.message = {}});
    const TcpClient client{io, {.local = test::own_address(2), .remote = tcp.local()}, {.message = {}}};
    for (int round = 0; round < 100 && !client.local(); ++round) {
      io.run_one_for(50ms);
    }
    ASSERT_TRUE(client.local());
    for (const int port : {udp.local().port, tcp.local().port, client.local()->port}) {
      ports.push_back(port);
      different.insert(port);
    }
  }
  EXPECT_THAT(ports, Each(Ge(49152)));
  EXPECT_GE(different.size(), 50U) << "of 60: they are drawn at random";
}

/// What is said of a port that this process has already.
std::string said_of(std::uint16_t port) {
  boost::asio::io_context io;
  const Endpoint local{test::own_address(1), port};
  const UdpSocket first{io, {.local = local}};
  try {
    const UdpSocket second{io, {.local = local}};
  } catch (const NetError& error) {
    return error.what();
  }
  return {};
}

TEST(SocketOptions, SayHowAPortIsKeptFromClients) {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  ASSERT_TRUE(std::ifstream{"/proc/sys/net/ipv4/ip_local_port_range"} >> first >> last);
  const std::string advice =
      "to programs that ask for any: add this one to sysctl net.ipv4.ip_local_reserved_ports";
  EXPECT_THAT(said_of(first), HasSubstr("another program has this port"));
  EXPECT_THAT(said_of(first),
              HasSubstr(std::to_string(first) + " to " + std::to_string(last) + " " + advice));
  EXPECT_THAT(said_of(static_cast<std::uint16_t>(first - 1)),
              AllOf(HasSubstr("another program has this port"), Not(HasSubstr("programs that ask"))));
}

}  // namespace
}  // namespace trestle::someip::socket_options_test
