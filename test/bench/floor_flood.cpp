// Small datagrams one way, as many as the system takes, each with a buffer of its own: the floor of calls in
// flight and of small events.
#include <sys/socket.h>

#include <array>
#include <cstring>

#include "test/bench/floor.hpp"

namespace trestle::floor {
namespace {

constexpr std::size_t batch = 32;

/// Buffers for a batch of datagrams.
class Batch {
 public:
  explicit Batch(std::size_t bytes) : bytes_(batch * bytes) {
    for (std::size_t i = 0; i < batch; ++i) {
      parts_[i] = {bytes_.data() + i * bytes, bytes};
      messages_[i].msg_hdr.msg_iov = &parts_[i];
      messages_[i].msg_hdr.msg_iovlen = 1;
    }
  }
  [[nodiscard]] mmsghdr* messages() noexcept { return messages_.data(); }

 private:
  std::vector<std::byte> bytes_;
  std::array<iovec, batch> parts_{};
  std::array<mmsghdr, batch> messages_{};
};

}  // namespace

/// Whoever sends how many seconds it wants gets datagrams for so long.
void serve_flood(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.bind(options.at);
  Batch datagrams{options.bytes};
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    double seconds = 0;
    check(recvfrom(socket.fd(), &seconds, sizeof seconds, 0, reinterpret_cast<sockaddr*>(&from), &size),
          "recvfrom");
    for (std::size_t i = 0; i < batch; ++i) {
      datagrams.messages()[i].msg_hdr.msg_name = &from;
      datagrams.messages()[i].msg_hdr.msg_namelen = size;
    }
    const std::int64_t end = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
    while (now_ns() < end) {
      check(sendmmsg(socket.fd(), datagrams.messages(), batch, 0), "sendmmsg");
    }
  }
}

void receive_flood(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.receive_timeout(100);
  Batch datagrams{options.bytes};
  Figures figures;
  figures.bytes = options.bytes;
  const double wanted = options.seconds + static_cast<double>(warm_up_ns) / 1e9;
  std::byte first{};
  do {  // until the server, which may still serve the one before, begins
    check(sendto(socket.fd(), &wanted, sizeof wanted, 0, reinterpret_cast<const sockaddr*>(&options.at),
                 sizeof options.at),
          "sendto");
  } while (recv(socket.fd(), &first, sizeof first, MSG_PEEK) <= 0);
  const std::int64_t start = now_ns() + warm_up_ns;
  const std::int64_t end = start + static_cast<std::int64_t>(options.seconds * 1e9);
  for (std::int64_t now = now_ns(); now < end; now = now_ns()) {
    const int count = recvmmsg(socket.fd(), datagrams.messages(), batch, MSG_WAITFORONE, nullptr);
    if (now >= start && count > 0) {
      figures.received += static_cast<std::uint64_t>(count);
    }
  }
  figures.seconds = options.seconds;
  figures.print();
}

}  // namespace trestle::floor
