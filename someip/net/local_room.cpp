#include "someip/net/local_room.hpp"

#include <linux/inet_diag.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <bit>

#include "someip/net/netlink.hpp"

namespace trestle::someip {
namespace {

struct RoomQuestion {
  nlmsghdr header{};
  inet_diag_req_v2 body{};
};
static_assert(sizeof(RoomQuestion) == NLMSG_ALIGN(sizeof(nlmsghdr)) + sizeof(inet_diag_req_v2),
              "without a gap, as the kernel reads it");

// The socket is found as for a datagram, whose source and destination are where their names say.
RoomQuestion room_question(const Endpoint& from, const Endpoint& to, std::uint32_t number) noexcept {
  RoomQuestion question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.header.nlmsg_seq = number;
  question.body.sdiag_family = to.address.v6 ? AF_INET6 : AF_INET;
  question.body.sdiag_protocol = IPPROTO_UDP;
  question.body.idiag_ext = 1U << (INET_DIAG_SKMEMINFO - 1U);
  question.body.idiag_states = ~0U;
  inet_diag_sockid& id = question.body.id;
  id.idiag_sport = htons(from.port);
  id.idiag_dport = htons(to.port);
  static_assert(sizeof id.idiag_src == sizeof from.address.bytes);
  std::memcpy(id.idiag_src, from.address.bytes.data(), sizeof id.idiag_src);
  std::memcpy(id.idiag_dst, to.address.bytes.data(), sizeof id.idiag_dst);
  id.idiag_cookie[0] = INET_DIAG_NOCOOKIE;
  id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  return question;
}

// Behind an inet_diag_msg come attributes.
std::optional<LocalRoom::Buffer> buffer_in(ByteView answer) noexcept {
  constexpr std::size_t header = NLA_ALIGN(sizeof(nlattr));
  for (ByteView rest = answer.subspan(NLMSG_ALIGN(sizeof(inet_diag_msg))); rest.size() >= header;) {
    nlattr attribute{};
    std::memcpy(&attribute, rest.data(), sizeof attribute);
    if (attribute.nla_len < header || attribute.nla_len > rest.size()) {
      return std::nullopt;
    }
    const ByteView value = rest.first(attribute.nla_len).subspan(header);
    constexpr std::size_t known = SK_MEMINFO_RCVBUF + 1;
    if (attribute.nla_type == INET_DIAG_SKMEMINFO && value.size() >= known * sizeof(std::uint32_t)) {
      const auto number = [&](std::size_t index) {
        return std::size_t{
            load<std::uint32_t>(value.data() + index * sizeof(std::uint32_t), std::endian::native)};
      };
      return LocalRoom::Buffer{.unread = number(SK_MEMINFO_RMEM_ALLOC), .most = number(SK_MEMINFO_RCVBUF)};
    }
    const std::size_t taken = NLA_ALIGN(attribute.nla_len);
    rest = taken < rest.size() ? rest.subspan(taken) : ByteView{};
  }
  return std::nullopt;
}

}  // namespace

std::optional<LocalRoom::Buffer> LocalRoom::of(const Endpoint& from, const Endpoint& to) {
  if (use_ == Use::untried) {
    socket_.emplace(::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
    use_ = ask(to, from) ? Use::told : Use::none;
  }
  return use_ == Use::told ? ask(from, to) : std::nullopt;
}

std::optional<LocalRoom::Buffer> LocalRoom::ask(const Endpoint& from, const Endpoint& to) {
  const RoomQuestion question = room_question(from, to, ++question_);
  std::array<std::byte, 1024> room;  // an answer takes some 160 bytes
  const NetlinkAnswer answer = ask_netlink(socket_->get(), std::as_bytes(std::span{&question, 1}), room);
  const bool told = answer.error == 0 && answer.type == SOCK_DIAG_BY_FAMILY &&
                    answer.body.size() >= NLMSG_ALIGN(sizeof(inet_diag_msg));
  return told ? buffer_in(answer.body) : std::nullopt;
}

}  // namespace trestle::someip
