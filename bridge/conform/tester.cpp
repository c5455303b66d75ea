#include "bridge/conform/tester.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "someip/net/address_text.hpp"
#include "someip/net/socket_calls.hpp"
#include "someip/wire/header.hpp"

namespace trestle::conform {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// Below this, it is what any busy machine does.
constexpr Duration tolerated_stall = 100ms;

/// A socket address of either family.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;

  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  [[nodiscard]] sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
};

SocketAddress to_system(const Endpoint& endpoint) {
  SocketAddress address;
  if (endpoint.address.v6) {
    sockaddr_in6 v6{};
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(endpoint.port);
    std::memcpy(&v6.sin6_addr, endpoint.address.bytes.data(), 16);
    std::memcpy(&address.storage, &v6, sizeof v6);
    address.size = sizeof v6;
  } else {
    sockaddr_in v4{};
    v4.sin_family = AF_INET;
    v4.sin_port = htons(endpoint.port);
    std::memcpy(&v4.sin_addr, endpoint.address.bytes.data(), 4);
    std::memcpy(&address.storage, &v4, sizeof v4);
    address.size = sizeof v4;
  }
  return address;
}

Endpoint from_system(const SocketAddress& address) {
  Endpoint endpoint;
  if (address.storage.ss_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &address.storage, sizeof v6);
    endpoint.address.v6 = true;
    std::memcpy(endpoint.address.bytes.data(), &v6.sin6_addr, 16);
    endpoint.port = ntohs(v6.sin6_port);
  } else {
    sockaddr_in v4{};
    std::memcpy(&v4, &address.storage, sizeof v4);
    std::memcpy(endpoint.address.bytes.data(), &v4.sin_addr, 4);
    endpoint.port = ntohs(v4.sin_port);
  }
  return endpoint;
}

Endpoint local_of(int fd) {
  SocketAddress address;
  ::getsockname(fd, address.get(), &address.size);
  return from_system(address);
}

/// The number of the interface that has an IPv6 address; 0: none.
unsigned interface_of(const IpAddress& own) {
  ifaddrs* all = nullptr;
  unsigned index = 0;
  if (::getifaddrs(&all) == 0) {
    for (const ifaddrs* one = all; one != nullptr && index == 0; one = one->ifa_next) {
      if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET6) {
        SocketAddress address;
        std::memcpy(&address.storage, one->ifa_addr, sizeof(sockaddr_in6));
        index = from_system(address).address == own ? ::if_nametoindex(one->ifa_name) : 0;
      }
    }
    ::freeifaddrs(all);
  }
  return index;
}

/// What goes to a group goes out at the interface with our address.
bool send_groups_from(int fd, const IpAddress& own) {
  if (own.v6) {
    const unsigned index = interface_of(own);
    return index != 0 && ::setsockopt(fd, IPPROTO_IPV6, IPV6_MULTICAST_IF, &index, sizeof index) == 0;
  }
  in_addr address{};
  std::memcpy(&address, own.bytes.data(), 4);
  return ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &address, sizeof address) == 0;
}

bool join(int fd, const IpAddress& group, const IpAddress& own) {
  if (own.v6) {
    ipv6_mreq membership{};
    std::memcpy(&membership.ipv6mr_multiaddr, group.bytes.data(), 16);
    membership.ipv6mr_interface = interface_of(own);
    return ::setsockopt(fd, IPPROTO_IPV6, IPV6_JOIN_GROUP, &membership, sizeof membership) == 0;
  }
  ip_mreq membership{};
  std::memcpy(&membership.imr_multiaddr, group.bytes.data(), 4);
  std::memcpy(&membership.imr_interface, own.bytes.data(), 4);
  const bool joined = ::setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
  someip::set_option(fd, IPPROTO_IP, IP_MULTICAST_ALL, 0);
  return joined;
}

[[noreturn]] void fail(const std::string& what) {
  throw TesterError{what + ": " + std::strerror(errno)};
}

int open_socket(int type, bool v6) {
  const int fd = ::socket(v6 ? AF_INET6 : AF_INET, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) {
    fail("cannot open a socket");
  }
  return fd;
}

WallTime wall_now() {
  return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
}

}  // namespace

struct Tester::Port {
  explicit Port(int descriptor) : fd{descriptor} {}

  someip::Descriptor fd;
  Transport transport = Transport::udp;
  bool listens = false;
  bool closed = false;
  Endpoint local{};
  Endpoint peer{};                  ///< of a TCP connection
  std::vector<std::byte> stream{};  ///< of a TCP connection: what is no whole message yet
  std::vector<PortId> accepted{};
};

Tester::Tester(const IpAddress& own, const IpAddress& group, std::uint16_t sd_port)
    : own_{own}, group_{group}, sd_port_{sd_port}, ran_{Clock::now()} {
  auto unicast = bound(sd());
  if (!send_groups_from(unicast->fd.get(), own)) {
    fail("no interface for multicast has the tester's address " + someip::to_string(own));
  }
  auto multicast = bound(sd_group());
  if (!join(multicast->fd.get(), group, own)) {
    fail("cannot join " + someip::to_string(group));
  }
  sd_unicast_ = add(std::move(unicast));
  sd_multicast_ = add(std::move(multicast));
}

Tester::~Tester() = default;

bool Tester::is_ours(const IpAddress& address) {
  const someip::Descriptor fd{open_socket(SOCK_DGRAM, address.v6)};
  const SocketAddress own = to_system({address, 0});
  return ::bind(fd.get(), own.get(), own.size) == 0;
}

std::unique_ptr<Tester::Port> Tester::bound(const Endpoint& local) const {
  auto opened = std::make_unique<Port>(open_socket(SOCK_DGRAM, own_.v6));
  const int fd = opened->fd.get();
  someip::set_option(fd, SOL_SOCKET, SO_REUSEADDR, local.address.is_multicast() ? 1 : 0);
  const SocketAddress address = to_system(local);
  int result = ::bind(fd, address.get(), address.size);
  // A process that another tester of this program is about to start has all our sockets for a moment, also
  // those that are closed here.
  for (int tries = 0; result != 0 && errno == EADDRINUSE && tries < 50; ++tries) {
    std::this_thread::sleep_for(10ms);
    result = ::bind(fd, address.get(), address.size);
  }
  if (result != 0) {
    const std::string why =
        errno == EADDRINUSE ? "another SOME/IP stack on this host has it" : std::strerror(errno);
    throw TesterError{"the tester cannot use " + someip::to_string(local) + ": " + why};
  }
  opened->local = local;
  return opened;
}

Tester::Port& Tester::port(PortId id) const {
  return *ports_.at(id);
}

PortId Tester::add(std::unique_ptr<Port> opened) {
  someip::set_option(opened->fd.get(), SOL_SOCKET, SO_TIMESTAMPNS, 1);
  const PortId id{next_port_++};
  ports_.emplace(id, std::move(opened));
  return id;
}

PortId Tester::open_udp(std::optional<Endpoint> group) {
  auto opened = std::make_unique<Port>(open_socket(SOCK_DGRAM, own_.v6));
  const int fd = opened->fd.get();
  someip::set_buffer(fd, SO_RCVBUFFORCE, SO_RCVBUF, 4 << 20);
  if (group) {
    someip::set_option(fd, SOL_SOCKET, SO_REUSEADDR, 1);
  }
  const SocketAddress address = to_system(group.value_or(Endpoint{own_, 0}));
  if (::bind(fd, address.get(), address.size) != 0) {
    fail("the tester cannot open a UDP port");
  }
  // What a case sends to a group goes there from our address.
  (void)send_groups_from(fd, own_);
  if (group && !join(fd, group->address, own_)) {
    fail("cannot join " + someip::to_string(group->address));
  }
  opened->local = local_of(fd);
  return add(std::move(opened));
}

PortId Tester::open_udp_at(std::uint16_t port) {
  auto opened = bound({own_, port});
  someip::set_buffer(opened->fd.get(), SO_RCVBUFFORCE, SO_RCVBUF, 4 << 20);
  return add(std::move(opened));
}

std::optional<PortId> Tester::connect(const Endpoint& to, Duration within) {
  auto opened = std::make_unique<Port>(open_socket(SOCK_STREAM, own_.v6));
  const int fd = opened->fd.get();
  const SocketAddress own = to_system({own_, 0});
  if (::bind(fd, own.get(), own.size) != 0) {
    fail("the tester cannot open a TCP port");
  }
  someip::set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  const SocketAddress address = to_system(to);
  if (::connect(fd, address.get(), address.size) != 0 && errno != EINPROGRESS) {
    return std::nullopt;
  }
  pollfd wait{.fd = fd, .events = POLLOUT, .revents = 0};
  runs();
  const int ready = ::poll(&wait, 1, static_cast<int>(within / 1ms));
  runs(within);
  if (ready != 1) {
    return std::nullopt;
  }
  int error = 0;
  socklen_t size = sizeof error;
  if (::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) != 0 || error != 0) {
    return std::nullopt;
  }
  opened->transport = Transport::tcp;
  opened->local = local_of(fd);
  opened->peer = to;
  return add(std::move(opened));
}

PortId Tester::listen() {
  auto opened = std::make_unique<Port>(open_socket(SOCK_STREAM, own_.v6));
  const SocketAddress own = to_system({own_, 0});
  if (::bind(opened->fd.get(), own.get(), own.size) != 0 || ::listen(opened->fd.get(), 8) != 0) {
    fail("the tester cannot listen at a TCP port");
  }
  opened->transport = Transport::tcp;
  opened->listens = true;
  opened->local = local_of(opened->fd.get());
  return add(std::move(opened));
}

std::vector<PortId> Tester::accepted(PortId listening) const {
  return port(listening).accepted;
}

Endpoint Tester::local(PortId id) const {
  return port(id).local;
}

bool Tester::is_closed(PortId connection) const {
  return port(connection).closed;
}

void Tester::close(PortId id) {
  if (const auto known = ports_.find(id); known != ports_.end()) {
    note_rest(*known->second);
    ports_.erase(known);
  }
}

void Tester::close_half(PortId connection) {
  ::shutdown(port(connection).fd.get(), SHUT_WR);
  note_end(connection);
}

void Tester::note_end(PortId id) {
  const Port& one = port(id);
  note(true, Transport::tcp, one.local, one.peer, {}).ends = true;
}

void Tester::close_all() {
  for (const auto& [id, one] : ports_) {
    note_rest(*one);
  }
  std::erase_if(ports_,
                [this](const auto& one) { return one.first != sd_unicast_ && one.first != sd_multicast_; });
}

void Tester::send_sd(ByteView datagram, const Endpoint& to) {
  send_from(port(sd_unicast_), datagram, to);
}

void Tester::send(PortId id, ByteView datagram, const Endpoint& to) {
  send_from(port(id), datagram, to);
}

void Tester::send_from(const Port& from, ByteView datagram, const Endpoint& to) {
  const SocketAddress address = to_system(to);
  note(true, Transport::udp, from.local, to, datagram);
  // Errors of earlier datagrams (ICMP) come with the next call, which then has sent nothing.
  for (int tries = 0; tries < 3; ++tries) {
    if (::sendto(from.fd.get(), datagram.data(), datagram.size(), 0, address.get(), address.size) >= 0) {
      return;
    }
  }
  fail("the tester cannot send to " + someip::to_string(to));
}

void Tester::send(PortId connection, ByteView bytes) {
  Port& to = port(connection);
  note(true, Transport::tcp, to.local, to.peer, bytes);
  while (!bytes.empty()) {
    const ssize_t sent = ::send(to.fd.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    } else if (errno == EAGAIN) {
      pollfd wait{.fd = to.fd.get(), .events = POLLOUT, .revents = 0};
      runs();
      const int ready = ::poll(&wait, 1, 1000);
      runs(1s);
      if (ready != 1) {
        return;  // the device does not read
      }
    } else {
      to.closed = true;
      return;
    }
  }
}

bool Tester::receive(Duration within, const std::function<bool()>& done) {
  const Clock::time_point until = Clock::now() + within;
  for (bool first = true;; first = false) {
    check_();
    std::vector<pollfd> wait;
    std::vector<PortId> ids;
    for (const auto& [id, one] : ports_) {
      if (!one->closed) {
        wait.push_back({.fd = one->fd.get(), .events = POLLIN, .revents = 0});
        ids.push_back(id);
      }
    }
    runs();
    const Duration left = first || until <= ran_ ? Duration{0} : std::min<Duration>(until - ran_, 20ms);
    const timespec timeout{0, static_cast<long>(left.count())};
    const int ready = ::ppoll(wait.data(), wait.size(), &timeout, nullptr);
    runs(left);
    if (ready > 0) {
      const std::size_t known = packets_.size();
      bool ended = false;
      for (std::size_t at = 0; at < wait.size(); ++at) {
        if (wait[at].revents != 0) {
          read(ids[at]);
          ended = ended || port(ids[at]).closed || port(ids[at]).listens;
        }
      }
      if ((ended || packets_.size() > known) && done()) {
        return true;
      }
    } else if (ran_ >= until && !first) {
      return false;
    }
    if (first && done()) {
      return true;
    }
  }
}

void Tester::read(PortId id) {
  Port& from = port(id);
  if (from.listens) {
    accept(id);
  } else if (from.transport == Transport::tcp) {
    read_stream(from);
  } else {
    read_datagrams(from);
  }
}

void Tester::read_datagrams(Port& from) {
  std::vector<std::byte> room(65'536);
  for (int count = 0; count < 256; ++count) {
    SocketAddress sender;
    alignas(cmsghdr) std::array<char, 128> control{};
    iovec part{room.data(), room.size()};
    msghdr message{};
    message.msg_name = sender.get();
    message.msg_namelen = sender.size;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(from.fd.get(), &message, 0);
    if (size < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) {
        return;
      }
      continue;  // an ICMP error
    }
    const Endpoint source = from_system(sender);
    // Multicast comes back to its sender.
    if (source.address == own_) {
      continue;
    }
    Packet& packet =
        note(false, Transport::udp, source, from.local, ByteView{room}.first(static_cast<std::size_t>(size)));
    for (cmsghdr* one = CMSG_FIRSTHDR(&message); one != nullptr; one = CMSG_NXTHDR(&message, one)) {
      if (one->cmsg_level == SOL_SOCKET && one->cmsg_type == SCM_TIMESTAMPNS) {
        timespec time{};
        std::memcpy(&time, CMSG_DATA(one), sizeof time);
        packet.time = WallTime{std::chrono::seconds{time.tv_sec} + std::chrono::nanoseconds{time.tv_nsec}};
      }
    }
  }
}

void Tester::read_stream(Port& from) {
  std::array<std::byte, 65'536> room;
  const ssize_t size = ::recv(from.fd.get(), room.data(), room.size(), 0);
  if (size > 0) {
    from.stream.insert(from.stream.end(), room.begin(), room.begin() + size);
  } else if (size == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) {
    from.closed = true;
  }
  const bool is_reset = size < 0 && from.closed;
  ByteView rest{from.stream};
  auto message = someip::decode(rest);
  while (message) {
    note(false, Transport::tcp, from.peer, from.local, rest.first(message->size()));
    rest = rest.subspan(message->size());
    message = someip::decode(rest);
  }
  from.stream.assign(rest.begin(), rest.end());
  // Where one has a wrong Length, nobody knows where the next one begins.
  if (from.closed || message.error() != someip::WireError::truncated) {
    note_rest(from);
  }
  if (from.closed) {
    Packet& end = note(false, Transport::tcp, from.peer, from.local, {});
    end.ends = true;
    end.comment = is_reset ? "the device has reset the connection" : "the device has ended the connection";
  }
}

void Tester::note_rest(Port& from) {
  if (!from.stream.empty()) {
    note(false, Transport::tcp, from.peer, from.local, from.stream);
    from.stream.clear();
  }
}

void Tester::accept(PortId id) {
  SocketAddress peer;
  const int fd = ::accept4(port(id).fd.get(), peer.get(), &peer.size, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) {
    return;
  }
  auto opened = std::make_unique<Port>(fd);
  opened->transport = Transport::tcp;
  opened->local = port(id).local;
  opened->peer = from_system(peer);
  port(id).accepted.push_back(add(std::move(opened)));
}

Packet& Tester::note(bool sent, Transport transport, const Endpoint& from, const Endpoint& to,
                     ByteView bytes) {
  runs();
  return packets_.emplace_back(Packet{.number = packets_.size() + 1,
                                      .time = wall_now(),
                                      .sent = sent,
                                      .transport = transport,
                                      .from = from,
                                      .to = to,
                                      .bytes = {bytes.begin(), bytes.end()}});
}

void Tester::forget() {
  receive_now();
  packets_.clear();
  stalled_ = Duration{0};
}

void Tester::was_elsewhere() {
  ran_ = Clock::now();
}

void Tester::runs(Duration waited) {
  const Clock::time_point now = Clock::now();
  if (const Duration late = now - ran_ - waited; late > tolerated_stall) {
    stalled_ = std::max(stalled_, late);
  }
  ran_ = now;
}

}  // namespace trestle::conform
