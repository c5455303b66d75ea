#pragma once
#include <sys/uio.h>

#include <utility>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::someip {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_{fd} {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_{other.release()} {}
  Descriptor& operator=(Descriptor&&) = delete;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const noexcept { return fd_; }
  int release() noexcept { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// Throws the NetError that says: this endpoint cannot do `what`, why, and what to do about it.
[[noreturn]] void fail(Transport transport, const Endpoint& endpoint, const char* what, int error);

/// Whether a call that failed with this error may succeed later.
[[nodiscard]] bool retry_later(int error) noexcept;

/// setsockopt() with a number; 0 for success.
int set_option(int fd, int level, int name, int number) noexcept;

/// Sets a buffer's size, beyond the system's limit if we are allowed to.
void set_buffer(int fd, int forced_name, int name, int bytes) noexcept;

/// A slice as sendmsg() wants it, which only reads but shares its structure with recvmsg().
[[nodiscard]] inline iovec to_iovec(ByteView slice) noexcept {
  return {const_cast<std::byte*>(slice.data()), slice.size()};
}

}  // namespace trestle::someip
