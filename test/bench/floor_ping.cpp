// One message there and back, over and over: the floor of a call.
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "test/bench/floor_sd.hpp"

namespace trestle::floor {
namespace {

template <typename Trip>
void measure(const Options& options, Trip&& trip) {
  Figures figures;
  figures.bytes = options.bytes;
  const std::int64_t start = now_ns() + warm_up_ns;
  const std::int64_t end = start + static_cast<std::int64_t>(options.seconds * 1e9);
  std::int64_t before = now_ns();
  while (before < end) {
    const bool answered = trip();
    const std::int64_t after = now_ns();
    if (before >= start) {
      if (answered) {
        figures.latency.add(after - before);
        ++figures.received;
      } else {
        ++figures.lost;
      }
    }
    before = now_ns();
  }
  figures.seconds = options.seconds;
  figures.print();
}

/// What `call` brings; a busy one does not wait in the kernel, but calls again.
template <typename Call>
std::int64_t brought(const Options& options, const char* what, Call&& call) {
  std::int64_t got = 0;
  do {
    got = call(options.busy ? MSG_DONTWAIT : 0);
  } while (got < 0 && options.busy && (errno == EAGAIN || errno == EWOULDBLOCK));
  return check(got, what);
}

/// All of it; false when the other side has closed.
bool read_all(const Options& options, int fd, std::vector<std::byte>& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const std::int64_t got = brought(options, "recv", [&](int flags) {
      return recv(fd, bytes.data() + done, bytes.size() - done, flags);
    });
    if (got == 0) {
      return false;
    }
    done += static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace

void serve_udp(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.bind(options.at);
  std::vector<std::byte> bytes(65536);
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    auto* address = reinterpret_cast<sockaddr*>(&from);
    const auto got = brought(options, "recvfrom", [&](int flags) {
      return recvfrom(socket.fd(), bytes.data(), bytes.size(), flags, address, &size);
    });
    check(sendto(socket.fd(), bytes.data(), static_cast<std::size_t>(got), 0, address, size), "sendto");
  }
}

/// With an address of its own (own=) it calls the echo of `trestle perf server`, by a request that is made by
/// hand.
void ping_udp(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  std::vector<std::byte> bytes(options.bytes);
  sockaddr_in at = options.at;
  if (options.own.sin_family != 0) {
    constexpr std::uint16_t echo = 1;
    constexpr std::uint8_t request = 0;
    const RemoteService service = Discovery{options.own, options.at}.find();
    at = service.at;
    socket.bind(options.own);
    bytes = someip_message(service, echo, request, std::span{bytes}.subspan(someip_header_bytes));
  }
  std::vector<std::byte> answer(bytes.size());
  const auto* to = reinterpret_cast<const sockaddr*>(&at);
  measure(options, [&] {
    check(sendto(socket.fd(), bytes.data(), bytes.size(), 0, to, sizeof at), "sendto");
    return brought(options, "recv",
                   [&](int flags) { return recv(socket.fd(), answer.data(), answer.size(), flags); }) > 0;
  });
}

void serve_tcp(const Options& options) {
  const Socket socket{SOCK_STREAM};
  socket.option(SOL_SOCKET, SO_REUSEADDR, 1);
  socket.bind(options.at);
  check(listen(socket.fd(), 1), "listen");
  std::vector<std::byte> bytes(options.bytes);
  for (;;) {
    const auto fd = static_cast<int>(check(accept(socket.fd(), nullptr, nullptr), "accept"));
    const int on = 1;
    check(setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on), "setsockopt");
    while (read_all(options, fd, bytes)) {
      check(send(fd, bytes.data(), bytes.size(), 0), "send");
    }
    close(fd);
  }
}

void ping_tcp(const Options& options) {
  const Socket socket{SOCK_STREAM};
  socket.connect(options.at);
  socket.option(IPPROTO_TCP, TCP_NODELAY, 1);
  std::vector<std::byte> bytes(options.bytes);
  measure(options, [&] {
    check(send(socket.fd(), bytes.data(), bytes.size(), 0), "send");
    return read_all(options, socket.fd(), bytes);
  });
}

}  // namespace trestle::floor
