// Preloaded (LD_PRELOAD), it makes the system one without UDP segmentation offload.
#include <dlfcn.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>

#include <cerrno>

namespace {

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int setsockopt(int fd, int level, int name, const void* value, socklen_t size) noexcept {
  static const auto real = next<int (*)(int, int, int, const void*, socklen_t)>("setsockopt");
  if (level == SOL_UDP && (name == UDP_SEGMENT || name == UDP_GRO)) {
    errno = ENOPROTOOPT;
    return -1;
  }
  return real(fd, level, name, value, size);
}

extern "C" ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  static const auto real = next<ssize_t (*)(int, const msghdr*, int)>("sendmsg");
  const cmsghdr* control = CMSG_FIRSTHDR(message);
  if (control != nullptr && control->cmsg_level == SOL_UDP && control->cmsg_type == UDP_SEGMENT) {
    errno = EINVAL;
    return -1;
  }
  return real(fd, message, flags);
}
