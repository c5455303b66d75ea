#pragma once
#include <linux/netlink.h>

#include <cstring>
#include <optional>

#include "someip/wire/bytes.hpp"

namespace trestle::someip {

/// What the kernel says: an error, or a message, which points into the room that was given for it.
struct NetlinkAnswer {
  int error = 0;
  std::uint16_t type = 0;
  ByteView body{};  ///< behind the header

  /// The structure at the front of the body.
  template <typename Front>
  [[nodiscard]] std::optional<Front> front() const noexcept {
    Front front{};
    if (body.size() < sizeof front) {
      return std::nullopt;
    }
    std::memcpy(&front, body.data(), sizeof front);
    return front;
  }
};

/// Asks the kernel for one thing. It has answered when send() returns, so nothing here waits.
/// @param fd        a netlink socket.
/// @param question  begins with its nlmsghdr; the next one has another number in nlmsg_seq.
/// @param room      for the answer.
[[nodiscard]] NetlinkAnswer ask_netlink(int fd, ByteView question, ByteSpan room) noexcept;

}  // namespace trestle::someip
