#include "sd/net/link_watch.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "sd/net/link_state.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::sd {
namespace {

constexpr std::size_t read_room = 32768;  // the kernel never puts more into one answer
constexpr int read_rounds = 64;           // before other handlers get their turn
constexpr int max_questions = 8;          // in a row, while the answers contradict themselves

[[noreturn]] void cannot_watch(int error) {
  throw someip::NetError{"cannot watch the link: " + std::generic_category().message(error)};
}

int open_netlink(bool v6) {
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
  someip::Descriptor socket{fd};
  if (fd < 0) {
    cannot_watch(errno);
  }
  sockaddr_nl own{};
  own.nl_family = AF_NETLINK;
  own.nl_groups = RTMGRP_LINK | (v6 ? RTMGRP_IPV6_IFADDR : RTMGRP_IPV4_IFADDR);
  sockaddr generic{};
  static_assert(sizeof generic >= sizeof own);
  std::memcpy(&generic, &own, sizeof own);
  if (::bind(fd, &generic, sizeof own) != 0) {
    cannot_watch(errno);
  }
  return socket.release();
}

}  // namespace

struct LinkWatch::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, const IpAddress& address, std::string name, Handler told)
      : descriptor{io, open_netlink(address.v6)}, fd{descriptor.native_handle()}, own{address}, interface {
    std::move(name)
  }, state{own, interface}, handler{std::move(told)} {
    if (!ask()) {
      cannot_watch(errno);
    }
    adopt(state.verdict());
  }

  void wait() {
    descriptor.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                          [self = shared_from_this()](const boost::system::error_code& error) {
                            if (!error && !self->closed) {
                              self->read();
                            }
                          });
  }

  void read() {
    for (int round = 0; round < read_rounds && !closed; ++round) {
      ByteView messages = receive();
      if (messages.empty() && errno == ENOBUFS) {
        lost = true;  // reported once; later messages can still be read
      } else if (messages.empty()) {
        break;
      }
      // One by one, so that a link which went down and up again is also reported as down.
      while (!closed && state.take(messages)) {
        tell();
      }
    }
    if (lost && !closed) {
      lost = !ask();
      tell();
    }
    if (!closed) {
      wait();
    }
  }

  // The messages of one datagram from the kernel; empty, with errno set, when there is none.
  ByteView receive() {
    for (;;) {
      sockaddr_nl sender{};
      iovec place{room.get(), read_room};
      msghdr header{};
      header.msg_name = &sender;
      header.msg_namelen = sizeof sender;
      header.msg_iov = &place;
      header.msg_iovlen = 1;
      const ssize_t size = recvmsg(fd, &header, 0);
      if (size < 0 && errno != EINTR) {
        return {};
      }
      if (size > 0 && sender.nl_pid == 0) {  // sent by the kernel itself
        return {room.get(), static_cast<std::size_t>(size)};
      }
    }
  }

  // Asks for the complete state; false, with errno set, if no consistent answer came.
  bool ask() {
    for (int i = 0; i < max_questions; ++i) {
      LinkState fresh{own, interface};
      if (ask(RTM_GETLINK, fresh) && ask(RTM_GETADDR, fresh)) {
        state = std::move(fresh);
        return true;
      }
    }
    return false;
  }

  // The kernel answers at once, so this does not wait. News may come between the answers, in the right order.
  bool ask(std::uint16_t what, LinkState& into) {
    struct {
      nlmsghdr header;
      rtgenmsg body;
    } question{};
    question.header.nlmsg_len = sizeof question.header + sizeof question.body;
    question.header.nlmsg_type = what;
    question.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
    question.body.rtgen_family = AF_UNSPEC;
    if (::send(fd, &question, question.header.nlmsg_len, 0) < 0) {
      return false;
    }
    for (bool whole = true;;) {
      ByteView messages = receive();
      if (messages.empty() && errno != ENOBUFS) {
        return false;
      }
      whole = whole && !messages.empty();
      while (const auto message = into.take(messages)) {
        if (*message == LinkState::Message::refusal) {
          errno = EOPNOTSUPP;
          return false;
        }
        if (*message == LinkState::Message::end) {
          errno = EAGAIN;
          return whole;
        }
        whole = whole && *message != LinkState::Message::interrupted;
      }
    }
  }

  void tell() {
    const LinkState::Verdict verdict = state.verdict();
    if (verdict.up != is_up) {
      adopt(verdict);
      handler(is_up, words);
    }
  }

  void adopt(const LinkState::Verdict& verdict) {
    is_up = verdict.up;
    if (!verdict.interface.empty()) {
      last_name = verdict.interface;
    }
    words =
        "link " + (last_name.empty() ? "" : last_name + " ") + (is_up ? "is up" : "is down: " + verdict.why);
  }

  boost::asio::posix::stream_descriptor descriptor;
  int fd;
  IpAddress own;
  std::string interface;
  LinkState state;
  Handler handler;
  bool closed = false;
  bool lost = false;  ///< messages of the kernel
  bool is_up = true;
  std::string last_name;
  std::string words;
  // Not zeroed: the system commits the pages as they are used.
  std::unique_ptr<std::byte[]> room{new std::byte[read_room]};
};

LinkWatch::LinkWatch(boost::asio::io_context& io, const IpAddress& own, const std::string& interface,
                     Handler handler)
    : state_{std::make_shared<State>(io, own, interface, std::move(handler))} {
  state_->wait();
}

LinkWatch::~LinkWatch() {
  state_->closed = true;
  boost::system::error_code ignored;
  state_->descriptor.close(ignored);
}

bool LinkWatch::up() const noexcept {
  return state_->is_up;
}
const std::string& LinkWatch::words() const noexcept {
  return state_->words;
}

}  // namespace trestle::sd
