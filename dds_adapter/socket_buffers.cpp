#include "dds_adapter/socket_buffers.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

namespace trestle::dds::detail {
namespace {

/// @param name  SO_RCVBUF or SO_SNDBUF.
/// @return what is granted of so many bytes; all of them when that cannot be found out.
std::uint32_t granted(int name, std::uint32_t bytes) {
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int wanted = static_cast<int>(std::min<std::uint32_t>(bytes, std::numeric_limits<int>::max()));
  int charged = 0;
  socklen_t size = sizeof charged;
  const bool known = setsockopt(probe, SOL_SOCKET, name, &wanted, sizeof wanted) == 0 &&
                     getsockopt(probe, SOL_SOCKET, name, &charged, &size) == 0;
  close(probe);
  return known ? static_cast<std::uint32_t>(charged / 2) : bytes;  // half is for the kernel's bookkeeping
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

}  // namespace trestle::dds::detail
