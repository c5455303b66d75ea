#undef _FORTIFY_SOURCE  // whose headers have these functions already
#include "test/system_calls.hpp"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>

namespace trestle::test {
namespace {

std::atomic<OnSystemCall> told{nullptr};

void tell(const char* what, const void* data, std::size_t bytes) {
  if (const OnSystemCall watcher = told; watcher != nullptr && bytes > 0) {
    watcher(what, {static_cast<const std::byte*>(data), bytes});
  }
}
void tell(const char* what, std::span<const iovec> parts, std::size_t bytes = static_cast<std::size_t>(-1)) {
  for (const iovec& part : parts) {
    const std::size_t of_part = std::min(bytes, part.iov_len);
    tell(what, part.iov_base, of_part);
    bytes -= of_part;
  }
}
ssize_t received(ssize_t bytes, std::span<const iovec> parts) {
  if (bytes > 0) {
    tell("receive", parts, static_cast<std::size_t>(bytes));
  }
  return bytes;
}
std::span<const iovec> parts_of(const msghdr& message) {
  return {message.msg_iov, message.msg_iovlen};
}
std::span<const iovec> parts_of(const iovec* parts, int count) {
  return {parts, static_cast<std::size_t>(count)};
}

}  // namespace

void watch_system_calls(OnSystemCall watcher) {
  told = watcher;
}

}  // namespace trestle::test

using namespace trestle::test;

// The program's own functions go before those of the C library.
// NOLINTBEGIN(*-reserved-identifier, *-identifier-naming, cert-dcl*)
extern "C" {

ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  tell("send", parts_of(*message));
  return syscall(SYS_sendmsg, fd, message, flags);
}
int sendmmsg(int fd, mmsghdr* messages, unsigned count, int flags) {
  for (unsigned i = 0; i < count; ++i) {
    tell("send", parts_of(messages[i].msg_hdr));
  }
  return static_cast<int>(syscall(SYS_sendmmsg, fd, messages, count, flags));
}
ssize_t sendto(int fd, const void* data, size_t bytes, int flags, const sockaddr* to, socklen_t size) {
  tell("send", data, bytes);
  return syscall(SYS_sendto, fd, data, bytes, flags, to, size);
}
ssize_t send(int fd, const void* data, size_t bytes, int flags) {
  return sendto(fd, data, bytes, flags, nullptr, 0);
}
ssize_t write(int fd, const void* data, size_t bytes) {
  tell("send", data, bytes);
  return syscall(SYS_write, fd, data, bytes);
}
ssize_t writev(int fd, const iovec* parts, int count) {
  tell("send", parts_of(parts, count));
  return syscall(SYS_writev, fd, parts, count);
}
ssize_t recvmsg(int fd, msghdr* message, int flags) {
  return received(syscall(SYS_recvmsg, fd, message, flags), parts_of(*message));
}
int recvmmsg(int fd, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  const auto number = static_cast<int>(syscall(SYS_recvmmsg, fd, messages, count, flags, timeout));
  for (int i = 0; i < number; ++i) {
    received(messages[i].msg_len, parts_of(messages[i].msg_hdr));
  }
  return number;
}
ssize_t recvfrom(int fd, void* data, size_t bytes, int flags, sockaddr* from, socklen_t* size) {
  const iovec part{data, bytes};
  return received(syscall(SYS_recvfrom, fd, data, bytes, flags, from, size), {&part, 1});
}
ssize_t recv(int fd, void* data, size_t bytes, int flags) {
  return recvfrom(fd, data, bytes, flags, nullptr, nullptr);
}
ssize_t read(int fd, void* data, size_t bytes) {
  const iovec part{data, bytes};
  return received(syscall(SYS_read, fd, data, bytes), {&part, 1});
}
// What the C library's headers make of them where the size of the room is known.
ssize_t __recvfrom_chk(int fd, void* data, size_t bytes, size_t /*room*/, int flags, sockaddr* from,
                       socklen_t* size) {
  return recvfrom(fd, data, bytes, flags, from, size);
}
ssize_t __recv_chk(int fd, void* data, size_t bytes, size_t /*room*/, int flags) {
  return recv(fd, data, bytes, flags);
}
ssize_t __read_chk(int fd, void* data, size_t bytes, size_t /*room*/) {
  return read(fd, data, bytes);
}
ssize_t readv(int fd, const iovec* parts, int count) {
  return received(syscall(SYS_readv, fd, parts, count), parts_of(parts, count));
}

}  // extern "C"
// NOLINTEND(*-reserved-identifier, *-identifier-naming, cert-dcl*)
