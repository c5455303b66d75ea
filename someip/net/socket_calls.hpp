#pragma once
#include <sys/uio.h>

#include <cstdint>
#include <utility>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::someip {

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

/// Ports that are nobody's by agreement: from here to 65535.  [feat_req_someip_32] [feat_req_someip_661]
inline constexpr std::uint16_t first_dynamic_port = 49152;

/// bind(); with port 0, to a dynamic port that is free.
/// @param scope  of a link-local IPv6 address, else 0.
/// @return 0, or the error.
int bind_to(int fd, Endpoint local, unsigned scope);

/// Marks all packets that are sent with a class of service (DSCP).
/// @throws NetError when it is above 63.
void set_dscp(int fd, std::uint8_t dscp);

/// Sets how many hops unicast packets may take; 0: as the system has it.
void set_unicast_ttl(int fd, std::uint8_t hops) noexcept;

/// Sets a buffer's size, beyond the system's limit if we are allowed to.
void set_buffer(int fd, int forced_name, int name, int bytes) noexcept;
/// The size that was granted for one, SO_RCVBUF or SO_SNDBUF.
[[nodiscard]] int buffer_bytes(int fd, int name) noexcept;

/// A slice as sendmsg() wants it, which only reads but shares its structure with recvmsg().
[[nodiscard]] inline iovec to_iovec(ByteView slice) noexcept {
  return {const_cast<std::byte*>(slice.data()), slice.size()};
}

}  // namespace trestle::someip
