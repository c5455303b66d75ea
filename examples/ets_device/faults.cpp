#undef _FORTIFY_SOURCE  // whose headers have these functions already
#include "faults.hpp"

#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace ets {
namespace {

const Fault* chosen = nullptr;

// --- Between the device and the system --------------------------------------------------------------------

bool is_stream(int fd) {
  int type = 0;
  socklen_t size = sizeof type;
  return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM;
}

bool is_ip(int fd) {
  int domain = 0;
  socklen_t size = sizeof domain;
  return getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 &&
         (domain == AF_INET || domain == AF_INET6);
}

/// A socket address of either family, and places in it.
struct SocketAddress {
  std::array<std::uint8_t, sizeof(sockaddr_in6)> bytes{};

  [[nodiscard]] bool is_v6() const {
    sa_family_t family = AF_UNSPEC;
    std::memcpy(&family, bytes.data() + offsetof(sockaddr_in, sin_family), sizeof family);
    return family == AF_INET6;
  }
  [[nodiscard]] Span address() {
    return is_v6() ? Span{bytes}.subspan(offsetof(sockaddr_in6, sin6_addr), 16)
                   : Span{bytes}.subspan(offsetof(sockaddr_in, sin_addr), 4);
  }
  /// At the same place in both families.
  [[nodiscard]] Span port() { return Span{bytes}.subspan(offsetof(sockaddr_in, sin_port), 2); }

  [[nodiscard]] Receiver receiver() {
    return {.address = {address().begin(), address().end()}, .port = port()[0] * 256U + port()[1]};
  }
  void set(const Receiver& to) {
    if (to.address.size() == address().size()) {
      std::ranges::copy(to.address, address().begin());
    }
    port()[0] = static_cast<std::uint8_t>(to.port >> 8U);
    port()[1] = static_cast<std::uint8_t>(to.port);
  }
};

bool is_group(const Bytes& address) {
  return address.size() == 16 ? address[0] == 0xff : address[0] >> 4U == 0xe;
}

unsigned port_of(int fd) {
  SocketAddress own;
  socklen_t size = sizeof own.bytes;
  getsockname(fd, reinterpret_cast<sockaddr*>(own.bytes.data()), &size);
  return own.receiver().port;
}

/// Where a datagram goes to; nothing: it is none.
std::optional<SocketAddress> receiver_of(const msghdr& message) {
  SocketAddress to;
  if (message.msg_name == nullptr || message.msg_namelen < sizeof(sockaddr_in)) {
    return std::nullopt;
  }
  std::memcpy(to.bytes.data(), message.msg_name, std::min<std::size_t>(message.msg_namelen, to.bytes.size()));
  return to;
}

/// @param how  to whom, and what else the system is told.
void put_out(int fd, msghdr how, Span bytes, int flags) {
  iovec part{bytes.data(), bytes.size()};
  how.msg_iov = &part;
  how.msg_iovlen = 1;
  syscall(SYS_sendmsg, fd, &how, flags);
}

/// The size of the datagrams that a train is to be cut into; nothing: it is one datagram.
std::optional<std::size_t> train_of(const msghdr& message) {
  msghdr copy = message;
  for (cmsghdr* one = CMSG_FIRSTHDR(&copy); one != nullptr; one = CMSG_NXTHDR(&copy, one)) {
    if (one->cmsg_level == SOL_UDP && one->cmsg_type == UDP_SEGMENT) {
      std::uint16_t size = 0;
      std::memcpy(&size, CMSG_DATA(one), sizeof size);
      return size;
    }
  }
  return std::nullopt;
}

ssize_t send_with_fault(int fd, const msghdr& message, int flags) {
  Bytes all;
  for (std::size_t at = 0; at < message.msg_iovlen; ++at) {
    const auto* begin = static_cast<const std::uint8_t*>(message.msg_iov[at].iov_base);
    all.insert(all.end(), begin, begin + message.msg_iov[at].iov_len);
  }
  const auto train = train_of(message);
  const std::size_t step = std::max<std::size_t>(train.value_or(all.size()), 1);
  msghdr how = message;
  if (train) {
    // It is cut here. Otherwise what stands there is the address that it comes from.
    how.msg_control = nullptr;
    how.msg_controllen = 0;
  }
  for (std::size_t at = 0; at < all.size(); at += step) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(at);
    Outgoing out{.bytes = {from, from + static_cast<std::ptrdiff_t>(std::min(step, all.size() - at))},
                 .stream = is_stream(fd),
                 .port = port_of(fd)};
    std::optional<SocketAddress> to = receiver_of(message);
    if (to) {
      out.to = to->receiver();
      out.multicast = is_group(out.to.address);
    }
    chosen->out(out);
    if (to) {
      to->set(out.to);
      how.msg_name = to->bytes.data();
    }
    for (int copy = 0; copy < out.copies; ++copy) {
      put_out(fd, how, out.bytes, flags);
    }
    if (to && !out.besides.empty()) {
      to->set(out.besides_to);
      put_out(fd, how, out.besides, flags);
    }
  }
  return static_cast<ssize_t>(all.size());
}

/// @return how many bytes the device sees.
std::size_t receive_with_fault(int fd, msghdr& message, std::size_t size) {
  if (message.msg_iovlen == 0 || size > message.msg_iov[0].iov_len) {
    return size;
  }
  Incoming in{.bytes = {static_cast<std::uint8_t*>(message.msg_iov[0].iov_base), size}};
  chosen->in(in);
  for (Bytes& bytes : in.answers) {
    msghdr how{};
    how.msg_name = message.msg_name;
    how.msg_namelen = message.msg_namelen;
    put_out(fd, how, bytes, 0);
  }
  return in.lost ? 0 : in.bytes.size();
}

}  // namespace

bool choose_fault(const std::string& name) {
  for (const auto* table : {&faults(), &bugs()}) {
    if (const auto found = std::ranges::find(*table, name, &Fault::name); found != table->end()) {
      chosen = &*found;
    }
  }
  return chosen != nullptr;
}

std::string list_of(const std::vector<Fault>& all) {
  std::string lines;
  for (const Fault& one : all) {
    lines += std::string{one.name} + "\t" + one.finders + "\t" + one.what + "\n";
  }
  return lines;
}

}  // namespace ets

using namespace ets;

// The program's own functions go before those of the C library.
// NOLINTBEGIN(*-reserved-identifier, *-identifier-naming, cert-dcl*)
extern "C" {

ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  if (chosen != nullptr && chosen->out && is_ip(fd)) {
    return send_with_fault(fd, *message, flags);
  }
  return syscall(SYS_sendmsg, fd, message, flags);
}

int sendmmsg(int fd, mmsghdr* messages, unsigned count, int flags) {
  if (chosen != nullptr && chosen->out && is_ip(fd)) {
    for (unsigned at = 0; at < count; ++at) {
      messages[at].msg_len = static_cast<unsigned>(send_with_fault(fd, messages[at].msg_hdr, flags));
    }
    return static_cast<int>(count);
  }
  return static_cast<int>(syscall(SYS_sendmmsg, fd, messages, count, flags));
}

ssize_t recvmsg(int fd, msghdr* message, int flags) {
  const ssize_t size = syscall(SYS_recvmsg, fd, message, flags);
  if (size > 0 && chosen != nullptr && chosen->in && (flags & MSG_ERRQUEUE) == 0 && is_ip(fd) &&
      !is_stream(fd)) {
    return static_cast<ssize_t>(receive_with_fault(fd, *message, static_cast<std::size_t>(size)));
  }
  return size;
}

int recvmmsg(int fd, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  const auto got = static_cast<int>(syscall(SYS_recvmmsg, fd, messages, count, flags, timeout));
  if (got > 0 && chosen != nullptr && chosen->in && (flags & MSG_ERRQUEUE) == 0 && is_ip(fd) &&
      !is_stream(fd)) {
    for (int at = 0; at < got; ++at) {
      messages[at].msg_len =
          static_cast<unsigned>(receive_with_fault(fd, messages[at].msg_hdr, messages[at].msg_len));
    }
  }
  return got;
}

}  // extern "C"
// NOLINTEND(*-reserved-identifier, *-identifier-naming, cert-dcl*)
