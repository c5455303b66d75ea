#include "dds_adapter/socket_buffers.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

namespace trestle::dds::detail {
namespace {

int as_option(std::uint32_t bytes) noexcept {
  return static_cast<int>(std::min<std::uint32_t>(bytes, std::numeric_limits<int>::max()));
}

/// @param ask  a socket for a buffer of `bytes`; false: that cannot be done.
/// @param name  of it: SO_RCVBUF or SO_SNDBUF.
/// @return what is granted of so many bytes; all of them when that cannot be found out.
template <typename Ask>
std::uint32_t granted(std::uint32_t bytes, int name, Ask ask) noexcept {
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int charged = 0;
  socklen_t size = sizeof charged;
  const bool known = ask(probe) && getsockopt(probe, SOL_SOCKET, name, &charged, &size) == 0;
  close(probe);
  return known ? static_cast<std::uint32_t>(charged / 2) : bytes;  // half is for the kernel's bookkeeping
}

std::uint32_t granted(int name, std::uint32_t bytes) noexcept {
  return granted(bytes, name, [&](int probe) {
    const int wanted = as_option(bytes);
    return setsockopt(probe, SOL_SOCKET, name, &wanted, sizeof wanted) == 0;
  });
}

}  // namespace

std::vector<std::string> buffers_not_granted(std::uint32_t receive_bytes, std::uint32_t send_bytes) {
  std::vector<std::string> lines;
  const auto look = [&](const char* which, int name, std::uint32_t wanted, const char* limit,
                        const char* so) {
    const std::uint32_t got = granted(name, wanted);
    if (got < wanted) {
      lines.push_back("the system grants UDP " + std::string{which} + " buffers of " +
                      std::to_string(got >> 10U) + " KB only, not " + std::to_string(wanted >> 10U) + ": " +
                      so + "; as root: sysctl -w net.core." + limit + "=" + std::to_string(wanted));
    }
  };
  look("receive", SO_RCVBUF, receive_bytes, "rmem_max", "packets of large samples may be lost");
  look("send", SO_SNDBUF, send_bytes, "wmem_max", "large samples take longer");
  return lines;
}

void set_receive_buffer(int socket, std::uint32_t bytes) noexcept {
  const int wanted = as_option(bytes);
  if (setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0) {
    setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  }
}

std::uint32_t granted_receive_buffer(std::uint32_t bytes) noexcept {
  return granted(bytes, SO_RCVBUF, [&](int probe) {
    set_receive_buffer(probe, bytes);
    return true;
  });
}

}  // namespace trestle::dds::detail
