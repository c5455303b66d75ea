#include "sd/net/link_state.hpp"

#include <linux/if_addr.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <type_traits>
#include <utility>

#include "someip/net/address_text.hpp"

namespace trestle::sd {
namespace {

/// The structure at the front; nothing when there are too few bytes.
template <typename Structure>
std::optional<Structure> front(ByteView bytes) {
  static_assert(std::is_trivially_copyable_v<Structure>);
  if (bytes.size() < sizeof(Structure)) {
    return std::nullopt;
  }
  Structure result;
  std::memcpy(&result, bytes.data(), sizeof result);
  return result;
}

/// The bytes behind the first `size`, which are padded to a multiple of four, though maybe not at the end.
ByteView behind(ByteView bytes, std::size_t size) {
  return bytes.subspan(std::min((size + 3) / 4 * 4, bytes.size()));
}

/// Calls `visit` with type and content of each attribute, up to the first one that is malformed.
template <typename Visit>
void for_each_attribute(ByteView bytes, Visit visit) {
  while (const auto attribute = front<rtattr>(bytes)) {
    if (attribute->rta_len < sizeof(rtattr) || attribute->rta_len > bytes.size()) {
      return;
    }
    visit(attribute->rta_type, bytes.first(attribute->rta_len).subspan(sizeof(rtattr)));
    bytes = behind(bytes, attribute->rta_len);
  }
}

bool in_one_subnet(const IpAddress& one, const IpAddress& other, unsigned prefix_bits) {
  for (unsigned bit = 0; bit < std::min(prefix_bits, one.v6 ? 128U : 32U); ++bit) {
    if (((one.bytes[bit / 8] ^ other.bytes[bit / 8]) & (0x80U >> bit % 8)) != 0) {
      return false;
    }
  }
  return true;
}

bool runs(unsigned flags) {
  return (flags & IFF_UP) != 0 && (flags & IFF_RUNNING) != 0;
}

}  // namespace

LinkState::LinkState(const IpAddress& own, std::string interface)
    : own_{own}, interface_{std::move(interface)} {}

std::optional<LinkState::Message> LinkState::take(ByteView& messages) {
  const auto header = front<nlmsghdr>(messages);
  if (!header || header->nlmsg_len < sizeof(nlmsghdr) || header->nlmsg_len > messages.size()) {
    messages = {};
    return std::nullopt;
  }
  const ByteView body = messages.first(header->nlmsg_len).subspan(sizeof(nlmsghdr));
  messages = behind(messages, header->nlmsg_len);
  switch (header->nlmsg_type) {
    case RTM_NEWLINK:
    case RTM_DELLINK:
      on_link(body, header->nlmsg_type == RTM_DELLINK);
      break;
    case RTM_NEWADDR:
    case RTM_DELADDR:
      on_address(body, header->nlmsg_type == RTM_DELADDR);
      break;
    case NLMSG_ERROR:
      return Message::refusal;
    default:
      break;
  }
  if ((header->nlmsg_flags & NLM_F_DUMP_INTR) != 0) {
    return Message::interrupted;
  }
  return header->nlmsg_type == NLMSG_DONE ? Message::end : Message::news;
}

void LinkState::on_link(ByteView body, bool gone) {
  const auto fixed = front<ifinfomsg>(body);
  // Messages of another family, such as of a network bridge about its ports, say nothing of the interface.
  if (!fixed || fixed->ifi_family != AF_UNSPEC) {
    return;
  }
  const auto index = static_cast<unsigned>(fixed->ifi_index);
  const auto known =
      std::find_if(links_.begin(), links_.end(), [&](const Link& link) { return link.index == index; });
  if (gone) {
    if (known != links_.end()) {
      links_.erase(known);
    }
    std::erase_if(addresses_, [&](const Address& one) { return one.index == index; });
    return;
  }
  Link& link = known != links_.end() ? *known : links_.emplace_back();
  link.index = index;
  link.flags = fixed->ifi_flags;
  for_each_attribute(behind(body, sizeof(ifinfomsg)), [&](unsigned type, ByteView content) {
    if (type == IFLA_IFNAME) {
      const auto end = std::find(content.begin(), content.end(), std::byte{0});
      link.name.clear();
      std::transform(content.begin(), end, std::back_inserter(link.name),
                     [](std::byte byte) { return static_cast<char>(byte); });
    }
  });
}

void LinkState::on_address(ByteView body, bool gone) {
  const auto fixed = front<ifaddrmsg>(body);
  if (!fixed || fixed->ifa_family != (own_.v6 ? AF_INET6 : AF_INET)) {
    return;
  }
  Address found{.index = fixed->ifa_index,
                .address = {.v6 = own_.v6},
                .ready = (fixed->ifa_flags & (IFA_F_TENTATIVE | IFA_F_DADFAILED)) == 0};
  bool local = false;
  bool any = false;
  for_each_attribute(behind(body, sizeof(ifaddrmsg)), [&](unsigned type, ByteView content) {
    // On a point-to-point link IFA_ADDRESS is the other end's address; then there is IFA_LOCAL too.
    if ((type == IFA_LOCAL || (type == IFA_ADDRESS && !local)) && content.size() == (own_.v6 ? 16U : 4U)) {
      std::memcpy(found.address.bytes.data(), content.data(), content.size());
      local = local || type == IFA_LOCAL;
      any = true;
    }
  });
  if (!any || !in_one_subnet(found.address, own_, fixed->ifa_prefixlen)) {
    return;
  }
  std::erase_if(addresses_,
                [&](const Address& one) { return one.index == found.index && one.address == found.address; });
  if (!gone) {
    addresses_.push_back(found);
  }
}

const LinkState::Link* LinkState::find(unsigned index) const {
  const auto found =
      std::find_if(links_.begin(), links_.end(), [&](const Link& link) { return link.index == index; });
  return found == links_.end() ? nullptr : &*found;
}

LinkState::Verdict LinkState::verdict() const {
  const Link* needed = nullptr;
  bool there = false;  // the address
  for (const Address& one : addresses_) {
    const Link* const link = find(one.index);
    if (link == nullptr || !one.ready || (one.address != own_ && (link->flags & IFF_LOOPBACK) == 0)) {
      continue;
    }
    there = true;
    if (interface_.empty() && (needed == nullptr || !runs(needed->flags))) {
      needed = link;
    }
  }
  for (const Link& link : links_) {
    if (!interface_.empty() && link.name == interface_) {
      needed = &link;
    }
  }
  Verdict result{.up = false, .interface = needed != nullptr ? needed->name : interface_, .why = {}};
  if (needed == nullptr && !interface_.empty()) {
    result.why = "there is no such interface";
  } else if (needed != nullptr && (needed->flags & IFF_UP) == 0) {
    result.why = "it is switched off";
  } else if (needed != nullptr && !runs(needed->flags)) {
    result.why = "it has no carrier";
  } else if (!there) {
    result.why = "no interface has " + someip::to_string(own_);
  } else {
    result.up = true;
  }
  return result;
}

}  // namespace trestle::sd
