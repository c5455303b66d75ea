#include "test/someip/net/tcp_segments.hpp"

// The kernel's tcp_info, which has more than that of netinet/tcp.h; no file can include both.
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace trestle::test {

std::size_t data_segments_received(int fd) noexcept {
  tcp_info info{};
  socklen_t size = sizeof info;
  return getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 ? info.tcpi_data_segs_in : 0;
}

}  // namespace trestle::test
