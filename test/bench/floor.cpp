#include "test/bench/floor.hpp"

#include <netinet/udp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace trestle::floor {

std::int64_t check(std::int64_t result, const char* what) {
  if (result < 0) {
    std::fprintf(stderr, "trestle_floor: %s: %s\n", what, std::strerror(errno));
    std::_Exit(1);
  }
  return result;
}

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

Socket::Socket(int type) : fd_{static_cast<int>(check(socket(AF_INET, type | SOCK_CLOEXEC, 0), "socket"))} {}
Socket::~Socket() {
  close(fd_);
}

void Socket::option(int level, int name, int value) const {
  check(setsockopt(fd_, level, name, &value, sizeof value), "setsockopt");
}

// The sockets interface of POSIX is made of these casts.
void Socket::bind(const sockaddr_in& address) const {
  check(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
}
void Socket::connect(const sockaddr_in& address) const {
  check(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "connect");
}

void Socket::large_buffers() const {
  constexpr int receive_bytes = 8 << 20;
  constexpr int send_bytes = 4 << 20;
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &receive_bytes, sizeof receive_bytes) != 0) {
    option(SOL_SOCKET, SO_RCVBUF, receive_bytes);
  }
  if (setsockopt(fd_, SOL_SOCKET, SO_SNDBUFFORCE, &send_bytes, sizeof send_bytes) != 0) {
    option(SOL_SOCKET, SO_SNDBUF, send_bytes);
  }
}

void Socket::receive_timeout(int milliseconds) const {
  const timeval limit{milliseconds / 1000, milliseconds % 1000 * 1000};
  check(setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit), "setsockopt");
}

void ask(const Socket& socket, const void* request, std::size_t bytes) {
  std::byte first{};
  do {
    check(send(socket.fd(), request, bytes, 0), "send");
  } while (recv(socket.fd(), &first, sizeof first, MSG_PEEK) <= 0);
}

void send_train(const Socket& socket, const sockaddr_in& to, std::span<iovec> parts, std::size_t segment) {
  sockaddr_in address = to;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint16_t))> control{};
  msghdr message{};
  message.msg_name = &address;
  message.msg_namelen = sizeof address;
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* size = CMSG_FIRSTHDR(&message);
  size->cmsg_level = SOL_UDP;
  size->cmsg_type = UDP_SEGMENT;
  size->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
  const auto number = static_cast<std::uint16_t>(segment);
  std::memcpy(CMSG_DATA(size), &number, sizeof number);
  check(sendmsg(socket.fd(), &message, 0), "sendmsg");
}

void Figures::print() const {
  const auto rate = seconds > 0 ? static_cast<double>(received) / seconds : 0;
  std::printf(R"({"payload_bytes":%zu,"seconds":%.3f,"received":%zu,"lost":%zu,"per_second":%.1f,)"
              R"("megabytes_per_second":%.3f,"latency_ns":{"count":%zu,"p50":%lld,"p99":%lld,"max":%lld}})"
              "\n",
              static_cast<std::size_t>(bytes), seconds, static_cast<std::size_t>(received),
              static_cast<std::size_t>(lost), rate, rate * static_cast<double>(bytes) / 1e6,
              static_cast<std::size_t>(latency.count()), static_cast<long long>(latency.percentile(50)),
              static_cast<long long>(latency.percentile(99)), static_cast<long long>(latency.max()));
}

}  // namespace trestle::floor
