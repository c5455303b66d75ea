// What the kernel says of interfaces and addresses, byte by byte as rtnetlink(7) and netlink(7) have it:
// numbers are in the byte order of the host.
#include "sd/net/link_state.hpp"

#include <gmock/gmock.h>

#include <cstring>

#include "test/covers.hpp"

namespace trestle::sd::link_state_test {
namespace {

using test::covers;
using Bytes = std::vector<std::byte>;

constexpr unsigned is_up = 0x1;
constexpr unsigned loopback = 0x8;
constexpr unsigned running = 0x40;
constexpr std::uint8_t tentative = 0x40;
constexpr std::uint16_t new_link = 16;
constexpr std::uint16_t del_link = 17;
constexpr std::uint16_t new_address = 20;
constexpr std::uint16_t del_address = 21;
constexpr std::uint16_t error_message = 2;
constexpr std::uint16_t done = 3;
constexpr std::uint16_t interrupted = 0x10;
const IpAddress own = IpAddress::v4(10, 77, 0, 2);

template <typename Number>
void put(Bytes& bytes, Number number) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof number);
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

void pad(Bytes& bytes) {
  bytes.resize((bytes.size() + 3) / 4 * 4);
}

/// Length, type, flags, sequence number, port; and what follows.
Bytes message(std::uint16_t type, const Bytes& body, std::uint16_t flags = 0) {
  Bytes bytes;
  put(bytes, static_cast<std::uint32_t>(16 + body.size()));
  put(bytes, type);
  put(bytes, flags);
  put(bytes, std::uint32_t{0});
  put(bytes, std::uint32_t{0});
  bytes.insert(bytes.end(), body.begin(), body.end());
  pad(bytes);
  return bytes;
}

void put_attribute(Bytes& bytes, std::uint16_t type, const Bytes& content) {
  pad(bytes);
  put(bytes, static_cast<std::uint16_t>(4 + content.size()));
  put(bytes, type);
  bytes.insert(bytes.end(), content.begin(), content.end());
}

/// Family, -, device type, index, flags, change; IFLA_MTU and IFLA_IFNAME.
Bytes link(std::uint32_t index, std::uint32_t flags, const std::string& name, std::uint16_t type = new_link,
           std::uint8_t family = 0) {
  Bytes body;
  put(body, family);
  put(body, std::uint8_t{0});
  put(body, std::uint16_t{1});
  put(body, index);
  put(body, flags);
  put(body, std::uint32_t{0});
  put_attribute(body, 4, Bytes(4));
  Bytes text;
  for (const char letter : name) {
    put(text, letter);
  }
  put(text, '\0');
  put_attribute(body, 3, text);
  return message(type, body);
}

/// Family, prefix, flags, scope, index; IFA_ADDRESS.
Bytes address(std::uint32_t index, const IpAddress& value, std::uint8_t prefix,
              std::uint16_t type = new_address, std::uint8_t flags = 0) {
  Bytes body;
  put(body, static_cast<std::uint8_t>(value.v6 ? 10 : 2));
  put(body, prefix);
  put(body, flags);
  put(body, std::uint8_t{0});
  put(body, index);
  Bytes content;
  for (std::size_t i = 0; i < (value.v6 ? 16U : 4U); ++i) {
    put(content, value.bytes[i]);
  }
  put_attribute(body, 1, content);
  return message(type, body);
}

Bytes operator+(Bytes one, const Bytes& other) {
  one.insert(one.end(), other.begin(), other.end());
  return one;
}

/// Takes them all, and says how many there were.
std::size_t take(LinkState& state, ByteView bytes) {
  std::size_t count = 0;
  while (state.take(bytes)) {
    ++count;
  }
  EXPECT_TRUE(bytes.empty());
  return count;
}

TEST(LinkState, IsUpWhenTheInterfaceWithTheAddressRuns) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_1221"});
  LinkState state{own, ""};
  EXPECT_FALSE(state.verdict().up);
  EXPECT_EQ(state.verdict().why, "no interface has 10.77.0.2");
  EXPECT_EQ(
      take(state, link(1, is_up | loopback | running, "lo") + link(7, is_up, "eth0") + address(7, own, 24)),
      3U);
  EXPECT_FALSE(state.verdict().up);
  EXPECT_EQ(state.verdict().interface, "eth0");
  EXPECT_EQ(state.verdict().why, "it has no carrier");
  take(state, link(7, is_up | running, "eth0"));
  EXPECT_TRUE(state.verdict().up);
  EXPECT_EQ(state.verdict().interface, "eth0");
  take(state, link(7, running, "eth0"));
  EXPECT_FALSE(state.verdict().up);
  EXPECT_EQ(state.verdict().why, "it is switched off");
}

TEST(LinkState, NeedsTheAddress) {
  LinkState state{own, ""};
  take(state, link(7, is_up | running, "eth0") + address(7, own, 24));
  EXPECT_TRUE(state.verdict().up);
  take(state, address(7, IpAddress::v4(10, 77, 0, 3), 24, del_address));
  EXPECT_TRUE(state.verdict().up) << "that was another one";
  take(state, address(7, own, 24, del_address));
  EXPECT_FALSE(state.verdict().up);
  take(state, address(7, IpAddress::v4(10, 77, 0, 3), 24));
  EXPECT_FALSE(state.verdict().up) << "a neighbour's";
  take(state, link(9, is_up | running, "eth1") + address(9, own, 24));
  EXPECT_TRUE(state.verdict().up);
  EXPECT_EQ(state.verdict().interface, "eth1");
  take(state, link(9, is_up | running, "eth1", del_link));
  EXPECT_FALSE(state.verdict().up);
}

// IFA_ADDRESS is the other end's there, IFA_LOCAL ours.
TEST(LinkState, TakesTheOwnEndOfATunnel) {
  LinkState state{own, ""};
  Bytes both = address(7, IpAddress::v4(10, 77, 0, 9), 32);
  Bytes content;
  for (std::size_t i = 0; i < 4; ++i) {
    put(content, own.bytes[i]);
  }
  put_attribute(both, 2, content);
  both[0] = static_cast<std::byte>(both.size());  // its length; the number is below 256
  both[1] = std::byte{0};
  take(state, link(7, is_up | running, "tun0") + both);
  EXPECT_TRUE(state.verdict().up);
  both[4] = std::byte{del_address};
  take(state, both);
  EXPECT_FALSE(state.verdict().up);
}

TEST(LinkState, WaitsUntilAnAddressMayBeUsed) {
  IpAddress v6{.v6 = true};
  v6.bytes[0] = 0xfd;
  v6.bytes[15] = 2;
  LinkState state{v6, ""};
  take(state, link(7, is_up | running, "eth0") + address(7, v6, 64, new_address, tentative));
  EXPECT_FALSE(state.verdict().up);
  EXPECT_EQ(state.verdict().why, "no interface has fd00::2");
  take(state, address(7, v6, 64));
  EXPECT_TRUE(state.verdict().up);
}

TEST(LinkState, KnowsThatAllOfLoopbackIsOurs) {
  LinkState state{IpAddress::v4(127, 3, 4, 5), ""};
  take(state, link(1, is_up | loopback | running, "lo") + address(1, IpAddress::v4(127, 0, 0, 1), 8));
  EXPECT_TRUE(state.verdict().up);
  EXPECT_EQ(state.verdict().interface, "lo");
  take(state, link(1, loopback, "lo"));
  EXPECT_FALSE(state.verdict().up);
}

TEST(LinkState, FollowsTheInterfaceThatWasNamed) {
  LinkState state{own, "eth1"};
  take(state, link(7, is_up | running, "eth0") + address(7, own, 24));
  EXPECT_FALSE(state.verdict().up);
  EXPECT_EQ(state.verdict().why, "there is no such interface");
  EXPECT_EQ(state.verdict().interface, "eth1");
  take(state, link(9, is_up | running, "eth1"));
  EXPECT_TRUE(state.verdict().up) << "the address may be at another one";
  take(state, address(7, own, 24, del_address));
  EXPECT_FALSE(state.verdict().up);
}

TEST(LinkState, IgnoresWhatIsNotAboutTheInterfaceItself) {
  LinkState state{own, ""};
  take(state, link(7, is_up | running, "eth0") + address(7, own, 24));
  take(state, link(7, is_up, "eth0", del_link, 7));  // AF_BRIDGE: it is no port of a bridge any more
  take(state, message(24, Bytes(12)));               // RTM_NEWROUTE
  EXPECT_TRUE(state.verdict().up);
}

TEST(LinkState, TellsHowAnAnswerEnds) {
  LinkState state{own, ""};
  const Bytes all = message(done, Bytes(4)) + message(error_message, Bytes(20)) +
                    message(done, Bytes(4), interrupted) + message(new_link, Bytes(2), interrupted);
  ByteView rest{all};
  EXPECT_EQ(state.take(rest), LinkState::Message::end);
  EXPECT_EQ(state.take(rest), LinkState::Message::refusal);
  EXPECT_EQ(state.take(rest), LinkState::Message::interrupted);
  EXPECT_EQ(state.take(rest), LinkState::Message::interrupted);
  EXPECT_EQ(state.take(rest), std::nullopt);
}

TEST(LinkState, BearsWhateverLengthsItIsTold) {
  const Bytes good = link(7, is_up | running, "eth0") + address(7, own, 24);
  for (std::size_t size = 0; size < good.size(); ++size) {
    LinkState state{own, ""};
    // A copy of its own, so that a sanitizer sees whoever reads on behind it.
    const Bytes part{good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)};
    take(state, part);
    EXPECT_FALSE(state.verdict().up) << size;
  }
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const int value : {0, 1, 3, 4, 15, 16, 127, 255}) {
      LinkState state{own, ""};
      Bytes bad = good;
      bad[at] = static_cast<std::byte>(value);
      EXPECT_LE(take(state, bad), good.size() / 16);
      static_cast<void>(state.verdict());
    }
  }
}

}  // namespace
}  // namespace trestle::sd::link_state_test
