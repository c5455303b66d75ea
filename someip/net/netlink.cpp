#include "someip/net/netlink.hpp"

#include <sys/socket.h>

#include <cerrno>

namespace trestle::someip {
namespace {

constexpr int max_netlink_answers = 8;  // read for one question; more than one comes only if one was lost

nlmsghdr netlink_header_of(ByteView message) noexcept {
  nlmsghdr header{};
  if (message.size() >= NLMSG_HDRLEN) {
    std::memcpy(&header, message.data(), sizeof header);
  }
  return header;
}

}  // namespace

NetlinkAnswer ask_netlink(int fd, ByteView question, ByteSpan room) noexcept {
  if (::send(fd, question.data(), question.size(), MSG_NOSIGNAL) < 0) {
    return {.error = errno};
  }
  for (int i = 0; i < max_netlink_answers; ++i) {
    sockaddr_nl from{};
    iovec place{room.data(), room.size()};
    msghdr parts{};
    parts.msg_name = &from;
    parts.msg_namelen = sizeof from;
    parts.msg_iov = &place;
    parts.msg_iovlen = 1;
    const ssize_t size = ::recvmsg(fd, &parts, MSG_DONTWAIT);
    if (size < 0 && errno != EINTR && errno != ENOBUFS) {
      return {.error = errno};
    }
    if (size < static_cast<ssize_t>(NLMSG_HDRLEN) || from.nl_pid != 0) {  // not of the kernel itself
      continue;
    }
    const ByteView message{room.first(static_cast<std::size_t>(size))};
    const nlmsghdr header = netlink_header_of(message);
    if (header.nlmsg_seq != netlink_header_of(question).nlmsg_seq) {
      continue;
    }
    NetlinkAnswer answer{.type = header.nlmsg_type, .body = message.subspan(NLMSG_HDRLEN)};
    if (header.nlmsg_type == NLMSG_ERROR) {
      const auto error = answer.front<nlmsgerr>();
      answer.error = error ? -error->error : EIO;
    }
    return answer;
  }
  return {.error = EAGAIN};
}

}  // namespace trestle::someip
