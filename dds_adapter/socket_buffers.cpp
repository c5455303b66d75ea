#include "dds_adapter/socket_buffers.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

namespace trestle::dds::detail {
namespace {

// A few samples of this size fill any send buffer that is smaller than requested.
constexpr std::size_t large_sample = std::size_t{1} << 20U;

int as_option(std::uint32_t bytes) noexcept {
  return static_cast<int>(std::min<std::uint32_t>(bytes, std::numeric_limits<int>::max()));
}

/// @param ask   asks a socket for a buffer of `bytes`; false if that fails.
/// @param name  the option: SO_RCVBUF or SO_SNDBUF.
/// @return how many of these bytes the system grants; all of them if that cannot be found out.
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

std::optional<std::string> not_granted(const char* which, int name, std::uint32_t wanted, const char* limit,
                                       const char* so) {
  const std::uint32_t got = granted(name, wanted);
  if (got >= wanted) {
    return std::nullopt;
  }
  return "the system grants UDP " + std::string{which} + " buffers of " + std::to_string(got >> 10U) +
         " KB only, not " + std::to_string(wanted >> 10U) + ": " + so + "; as root: sysctl -w net.core." +
         limit + "=" + std::to_string(wanted);
}

}  // namespace

std::optional<std::string> receive_buffer_not_granted(std::uint32_t bytes) {
  return not_granted("receive", SO_RCVBUF, bytes, "rmem_max", "packets of large samples may be lost");
}

std::optional<std::string> send_buffer_not_granted(std::uint32_t bytes) {
  return not_granted("send", SO_SNDBUF, bytes, "wmem_max", "large samples take longer");
}

std::optional<std::size_t> needs_larger_send_buffer(std::uint32_t bytes) noexcept {
  const std::uint32_t got = granted(SO_SNDBUF, bytes);
  return got < bytes ? std::optional{std::min(std::size_t{got} / 2, large_sample)} : std::nullopt;
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
