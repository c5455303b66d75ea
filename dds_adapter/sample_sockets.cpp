#include "dds_adapter/sample_sockets.hpp"

#include <arpa/inet.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

#include "dds_adapter/participant.hpp"
#include "dds_adapter/socket_buffers.hpp"

namespace trestle::dds::detail {
namespace {

constexpr std::size_t largest_datagram = 65536;
// What is taken from a socket at once: two of the largest datagrams (a sample of 64 KB), or small ones.
constexpr std::size_t most_bytes = 2 * largest_datagram;
constexpr std::size_t most_datagrams = 32;

sockaddr* as_address(sockaddr_in& address) noexcept {
  return reinterpret_cast<sockaddr*>(&address);
}

/// @return -1 if it cannot be opened.
int open_at(sockaddr_in at, std::uint32_t buffer_bytes) {
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) {
    return -1;
  }
  if (buffer_bytes > 0) {
    set_receive_buffer(descriptor, buffer_bytes);
  }
  if (bind(descriptor, as_address(at), sizeof at) != 0) {
    ::close(descriptor);
    return -1;
  }
  return descriptor;
}

std::vector<sockaddr_in> places(const std::vector<std::string>& addresses, std::uint16_t port) {
  std::vector<sockaddr_in> result;
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  for (const std::string& address : addresses) {
    if (inet_pton(AF_INET, address.c_str(), &at.sin_addr) == 1) {
      result.push_back(at);
    }
  }
  if (addresses.empty()) {
    at.sin_addr.s_addr = htonl(INADDR_ANY);
    result.push_back(at);
  }
  return result;
}

}  // namespace

SampleSockets::SampleSockets() : epoll_{epoll_create1(EPOLL_CLOEXEC)} {
  if (epoll_ < 0) {
    throw DdsError{"there is no descriptor for the sockets of DDS: " + std::string{std::strerror(errno)}};
  }
  datagram_.resize(largest_datagram);
}

SampleSockets::~SampleSockets() {
  close_all(sockets_);
  ::close(epoll_);
}

void SampleSockets::close_all(const std::vector<Socket>& sockets) noexcept {
  for (const Socket& socket : sockets) {
    if (socket.descriptor >= 0) {
      ::close(socket.descriptor);
    }
  }
}

bool SampleSockets::open(std::uint16_t port, const std::vector<std::string>& addresses,
                         std::uint32_t buffer_bytes, Taker taker) {
  std::vector<Socket> opened;
  for (const sockaddr_in& at : places(addresses, port)) {
    opened.push_back({open_at(at, buffer_bytes), port, taker});
  }
  const bool good = !opened.empty() && std::ranges::all_of(opened, [&](const Socket& socket) {
    epoll_event readable{.events = EPOLLIN, .data = {}};
    return socket.descriptor >= 0 && epoll_ctl(epoll_, EPOLL_CTL_ADD, socket.descriptor, &readable) == 0;
  });
  if (!good) {
    close_all(opened);
    return false;
  }
  const std::lock_guard lock{mutex_};
  std::ranges::move(opened, std::back_inserter(sockets_));
  return true;
}

bool SampleSockets::is_open(std::uint16_t port) const {
  const std::lock_guard lock{mutex_};
  return std::ranges::find(sockets_, port, &Socket::port) != sockets_.end();
}

bool SampleSockets::close(std::uint16_t port) {
  const std::lock_guard lock{mutex_};
  const auto kept =
      std::partition(sockets_.begin(), sockets_.end(), [&](const Socket& one) { return one.port != port; });
  const std::vector<Socket> closed{kept, sockets_.end()};
  sockets_.erase(kept, sockets_.end());
  close_all(closed);
  return !closed.empty();
}

void SampleSockets::receive() {
  const std::lock_guard lock{mutex_};
  for (const Socket& socket : sockets_) {
    std::size_t bytes = 0;
    std::size_t datagrams = 0;
    while (bytes < most_bytes && datagrams < most_datagrams) {
      sockaddr_in from{};
      socklen_t from_bytes = sizeof from;
      const ssize_t got =
          recvfrom(socket.descriptor, datagram_.data(), datagram_.size(), 0, as_address(from), &from_bytes);
      if (got < 0) {
        break;
      }
      const auto size = static_cast<std::size_t>(got);
      bytes += size;
      ++datagrams;
      socket.taker(std::span{datagram_}.first(size), from);
    }
  }
}

}  // namespace trestle::dds::detail
