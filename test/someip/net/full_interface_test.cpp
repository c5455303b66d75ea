// A UDP socket on a network interface that is slower than the sender, in a network that the test makes.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/socket.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

#include "someip/net/message_sender.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

using namespace std::chrono_literals;

// Whom nobody has to ask for. By turns, so that there are no trains: of one that has not enough room, the
// kernel may drop a part without a word.
const std::array receivers{Endpoint{IpAddress::v4(10, 9, 0, 2), 40000},
                           Endpoint{IpAddress::v4(10, 9, 0, 3), 40000}};

class FullInterfaceTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    made = (unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0) &&
           std::system(
               "ip link add v0 type veth peer name v1 && ip link set lo up && ip link set v1 up && "
               "ip link set v0 up && ip addr add 10.9.0.1/24 dev v0 && ip addr add 10.9.0.7/24 dev v0 && "
               "ip neigh add 10.9.0.2 lladdr 02:00:00:00:00:09 nud permanent dev v0 && "
               "ip neigh add 10.9.0.3 lladdr 02:00:00:00:00:0a nud permanent dev v0 && "
               "tc qdisc add dev v0 root tbf rate 20mbit burst 10kb limit 20kb && "
               // until it has its carrier
               "timeout 60 sh -c 'until ip link show v0 | grep -q \"state UP\"; do sleep 0.01; done'") ==
               0;  // NOLINT(cert-env33-c)
  }
  void SetUp() override {
    if (!made) {
      GTEST_SKIP() << "cannot make a network of its own";
    }
  }
  /// What has left by the interface.
  static std::size_t packets() {
    std::ifstream file{"/proc/net/dev"};
    std::string word;
    while (file >> word && word != "v0:") {
    }
    std::size_t sent = 0;
    for (int column = 0; column < 10; ++column) {
      file >> sent;
    }
    return sent;
  }
  static inline bool made = false;
};

TEST_F(FullInterfaceTest, IsWaitedForByWhoIsToldErrors) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket};
  const std::vector<std::byte> payload(1000);
  const ByteView slice{payload};
  constexpr std::size_t messages = 300;
  for (std::size_t i = 0; i < messages; ++i) {
    EXPECT_TRUE(sender.send(receivers[i % 2], {.type = MessageType::notification}, {&slice, 1}));
  }
  const auto end = std::chrono::steady_clock::now() + 60s;
  while ((!sender.idle() || packets() < messages) && std::chrono::steady_clock::now() < end) {
    io.run_one_for(20ms);
  }
  EXPECT_GE(packets(), messages) << "few others are of the system";
  EXPECT_EQ(sender.counters().messages, messages);
  EXPECT_EQ(sender.counters().refused, 0U);
  // It takes 0.13 s, each ms of which is a call.
  EXPECT_LT(sender.counters().system_calls, 2000U) << "it does not try without a pause";
}

template <typename Condition>
bool run(boost::asio::io_context& io, Condition condition) {
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (!condition() && std::chrono::steady_clock::now() < end) {
    io.run_one_for(5ms);
  }
  return condition();
}

/// What leaves by the interface, by the receiver's last byte. At its other end each processor has a queue of
/// its own for what arrives, which would mix up the order.
class Wire {
 public:
  Wire() {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_ALL);  // of one protocol alone, only what arrives is shown
    address.sll_ifindex = static_cast<int>(if_nametoindex("v0"));
    set_buffer(socket_.get(), SO_RCVBUFFORCE, SO_RCVBUF, 8 << 20);
    opened = bind(socket_.get(), reinterpret_cast<sockaddr*>(&address),  // NOLINT: that is the interface
                  sizeof address) == 0;
  }
  /// Reads what is there.
  void read() {
    std::array<std::byte, 2048> packet{};
    ssize_t bytes = 0;
    while ((bytes = recv(socket_.get(), packet.data(), packet.size(), MSG_DONTWAIT)) > 0) {
      constexpr std::size_t before = 14 + 20 + 8;  // Ethernet, IP and UDP
      const bool is_ip = packet[12] == std::byte{8} && packet[13] == std::byte{0};
      if (static_cast<std::size_t>(bytes) > before && is_ip && packet[14 + 9] == std::byte{17}) {
        const int receiver = std::to_integer<int>(packet[14 + 19]);
        at[receiver].emplace_back(packet.begin() + before, packet.begin() + bytes);
        if (at[3].empty()) {
          before_first_of_3 = at[2].size();
        }
      }
    }
  }

  /// Of all messages and segments to this receiver.
  std::vector<std::byte> payloads(int receiver) {
    std::vector<std::byte> all;
    for (const auto& datagram : at[receiver]) {
      const auto message = decode(datagram);
      EXPECT_TRUE(message);
      const auto segment = is_tp(message->header.type) ? decode_tp(*message) : tl::unexpected{WireError{}};
      const ByteView slice = segment ? segment->slice : message->payload;
      all.insert(all.end(), slice.begin(), slice.end());
    }
    return all;
  }

  bool opened = false;
  std::size_t before_first_of_3 = 0;  ///< datagrams to receiver 2
  std::map<int, std::vector<std::vector<std::byte>>> at;

 private:
  Descriptor socket_{socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0)};
};

// What comes out of the interface is what went in: to each receiver whole and in its order, and neither waits
// until the other has all.
TEST_F(FullInterfaceTest, LosesNothingAndKeepsTheOrderOfEachReceiver) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket};
  std::vector<std::byte> payload(50'000);
  for (std::size_t i = 0; i < payload.size(); ++i) {
    payload[i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  const ByteView large{payload};
  const ByteView small = large.first(1000);
  // One segment at a time, so that there are no trains.
  const TpPacing pacing{.segment_bytes = 1392, .burst = 1, .separation = Duration{0}};
  const auto send = [&](const Endpoint& to, std::uint16_t method, ByteView bytes) {
    const Header header{.method = MethodId{method}, .type = MessageType::notification};
    EXPECT_TRUE(sender.send(to, header, {&bytes, 1}, nullptr, pacing));
  };
  constexpr int small_ones = 20;
  for (int round = 1; round <= 2; ++round) {  // the second one finds used places
    Wire wire;
    ASSERT_TRUE(wire.opened);
    for (int i = 0; i < small_ones; ++i) {
      for (const Endpoint& to : receivers) {
        send(to, 1, small);
      }
    }
    for (const ByteView bytes : {large, small, large}) {
      for (const Endpoint& to : receivers) {
        send(to, 1, bytes);
      }
    }
    constexpr std::size_t datagrams = small_ones + 2 * 36 + 1;  // for each
    ASSERT_TRUE(run(io, [&] {
      wire.read();
      return wire.at[2].size() >= datagrams && wire.at[3].size() >= datagrams;
    }));
    EXPECT_TRUE(sender.idle());
    EXPECT_LT(wire.before_first_of_3, datagrams - 10);
    std::vector<std::byte> expected;
    const auto expect = [&](ByteView bytes) { expected.insert(expected.end(), bytes.begin(), bytes.end()); };
    for (int i = 0; i < small_ones; ++i) {
      expect(small);
    }
    for (const ByteView bytes : {large, small, large}) {
      expect(bytes);
    }
    EXPECT_TRUE(wire.payloads(2) == expected);
    EXPECT_TRUE(wire.payloads(3) == expected);
  }
}

// The interface is full in the middle of a message, of which the caller keeps nothing.
TEST_F(FullInterfaceTest, CopiesWhatFindsNoRoom) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket};
  Wire wire;
  ASSERT_TRUE(wire.opened);
  std::vector<std::byte> payload(50'000);
  for (std::size_t i = 0; i < payload.size(); ++i) {
    payload[i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  const std::vector<std::byte> original = payload;
  const std::array halves{ByteView{payload}.first(25'000), ByteView{payload}.subspan(25'000)};
  EXPECT_TRUE(sender.send(receivers[0], {.type = MessageType::notification}, halves, nullptr,
                          {.burst = 1, .separation = Duration{0}}));
  EXPECT_GT(sender.counters().datagrams, 0U);
  EXPECT_FALSE(sender.idle());
  std::ranges::fill(payload, std::byte{0});
  EXPECT_TRUE(run(io, [&] {
    wire.read();
    return wire.at[2].size() == 36;
  }));
  EXPECT_TRUE(wire.payloads(2) == original);
  EXPECT_EQ(sender.counters().messages, 1U);
}

// Of another kind, so that it need not wait for what is on its way: but there is no room for it.
TEST_F(FullInterfaceTest, TakesASmallMessageWhileALargeOneWaits) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket};
  Wire wire;
  ASSERT_TRUE(wire.opened);
  const std::vector<std::byte> payload(50'000);
  const ByteView large{payload};
  const Header other{.method = MethodId{2}, .type = MessageType::notification};
  EXPECT_TRUE(sender.send(receivers[0], {.method = MethodId{1}, .type = MessageType::notification},
                          {&large, 1}, nullptr, {.burst = 1, .separation = Duration{0}}));
  // Each larger than the one before, so that no two leave as a train: of a train that this interface takes
  // apart it loses what has no room, and tells nobody.
  for (std::size_t i = 0; i < 20; ++i) {
    const ByteView small = large.first(1020 + 20 * i);
    EXPECT_TRUE(sender.send(receivers[1], other, {&small, 1}));
  }
  EXPECT_TRUE(run(io,
                  [&] {
                    wire.read();
                    return wire.at[2].size() == 36 && wire.at[3].size() == 20;
                  }))
      << wire.at[2].size() << " and " << wire.at[3].size();
  EXPECT_EQ(sender.counters().messages, 21U);
}

// There is no room, and one of those that wait for it has gone: what is for it would take the room of others.
TEST_F(FullInterfaceTest, KeepsWhatIsForAHostThatHasGoneMeanwhile) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket};
  using enum Neighbours::Answer;
  Neighbours::Answer second = came;
  const auto answer_of = [&](const IpAddress& host) { return host == receivers[1].address ? second : came; };
  sender.watch_link({.answer_of = answer_of, .entry_of = answer_of, .unreachable = [](const Endpoint&) {}});
  Wire wire;
  ASSERT_TRUE(wire.opened);
  const std::vector<std::byte> payload(1400);
  const ByteView small{payload};
  constexpr std::size_t messages = 300;
  for (std::size_t i = 0; i < 2 * messages; ++i) {
    EXPECT_TRUE(sender.send(receivers[i % 2], {.type = MessageType::notification}, {&small, 1}));
  }
  second = awaited;
  ASSERT_TRUE(run(io, [&] {
    wire.read();
    return wire.at[2].size() == messages;
  }));
  EXPECT_LT(wire.at[3].size(), messages / 2) << "nothing more is sent";
  second = came;
  EXPECT_TRUE(run(io, [&] {
    wire.read();
    return wire.at[3].size() == messages;
  }));
  EXPECT_TRUE(sender.idle());
}

TEST_F(FullInterfaceTest, LosesNothingOfWhatWasCollected) {
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  socket.receive([](ByteView, const Endpoint&) {});
  socket.report_unreachable([](const Endpoint& to) { ADD_FAILURE() << to.port; });
  MessageSender sender{io, socket, std::size_t{1} << 20U, 1ms};
  Wire wire;
  ASSERT_TRUE(wire.opened);
  const std::vector<std::byte> payload(600);
  const ByteView slice{payload};
  for (int i = 0; i < 200; ++i) {
    EXPECT_TRUE(sender.send(receivers[0], {.type = MessageType::notification}, {&slice, 1}));
    EXPECT_TRUE(sender.send(receivers[1], {.type = MessageType::notification}, {&slice, 1}));
  }
  const auto bytes_at = [&](int receiver) {
    std::size_t bytes = 0;
    for (const auto& datagram : wire.at[receiver]) {
      bytes += datagram.size();
    }
    return bytes;
  };
  constexpr std::size_t bytes = 200U * (16 + 600);
  EXPECT_TRUE(run(io, [&] {
    wire.read();
    return bytes_at(2) == bytes && bytes_at(3) == bytes;
  }));
  EXPECT_EQ(sender.counters().messages, 400U);
  EXPECT_LT(sender.counters().datagrams, 400U);
}

TEST_F(FullInterfaceTest, TellsWhoHasAnsweredToItsAddress) {
  using enum Neighbours::Answer;
  const Neighbours neighbours{IpAddress::v4(10, 9, 0, 1), {}};
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(10, 9, 0, 2)), came);
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(10, 9, 0, 1)), untold) << "own";
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(10, 9, 0, 7)), untold) << "own, too";
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(10, 9, 1, 2)), untold) << "behind a router";
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(127, 0, 0, 1)), untold);
  const Endpoint silent{IpAddress::v4(10, 9, 0, 50), 40000};
  EXPECT_EQ(neighbours.answer_of(silent.address), unasked);
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(10, 9, 0, 1), 0}}};
  const std::array datagram{std::byte{1}};
  const ByteView view{datagram};
  EXPECT_EQ(socket.send(silent, {&view, 1}), SendStatus::sent);
  EXPECT_EQ(neighbours.answer_of(silent.address), awaited);
  EXPECT_FALSE(neighbours.known(silent.address));
  EXPECT_EQ(Neighbours(IpAddress::v4(127, 0, 0, 1), {}).answer_of(IpAddress::v4(127, 0, 0, 9)), untold);
}

// Gives the interface addresses of IPv6, one of which has a neighbour.
bool has_ipv6() {
  static const bool made = std::system(  // NOLINT(cert-env33-c)
                               "ip addr add fd00:9::1/64 dev v0 nodad && "
                               "ip addr add fd00:9::7/64 dev v0 nodad && "
                               "ip neigh add fd00:9::2 lladdr 02:00:00:00:00:09 nud permanent dev v0 && "
                               // until they are addresses of this host
                               "timeout 60 sh -c 'until ip -6 route get fd00:9::1 | grep -q ^local && "
                               "ip -6 route get fd00:9::7 | grep -q ^local; do sleep 0.01; done'") == 0;
  return made;
}

IpAddress v6(const std::string& text) {
  IpAddress address{.v6 = true};
  EXPECT_EQ(inet_pton(AF_INET6, text.c_str(), address.bytes.data()), 1);
  return address;
}

TEST_F(FullInterfaceTest, TellsWhoHasAnsweredToItsAddressOverIpv6) {
  if (!has_ipv6()) {
    GTEST_SKIP() << "there is no IPv6";
  }
  using enum Neighbours::Answer;
  const Neighbours neighbours{v6("fd00:9::1"), {}};
  EXPECT_EQ(neighbours.answer_of(v6("fd00:9::2")), came);
  EXPECT_TRUE(neighbours.known(v6("fd00:9::2")));
  EXPECT_EQ(neighbours.answer_of(v6("fd00:9::1")), untold) << "own";
  EXPECT_EQ(neighbours.answer_of(v6("fd00:9::7")), untold) << "own, too";
  EXPECT_EQ(neighbours.entry_of(v6("fd00:9::7")), unasked);
  EXPECT_EQ(neighbours.answer_of(v6("fd00:9:0:1::2")), untold) << "behind a router";
  EXPECT_EQ(neighbours.answer_of(v6("::1")), untold);
  EXPECT_EQ(neighbours.answer_of(IpAddress::v4(10, 9, 0, 2)), untold) << "not spoken to";
  EXPECT_EQ(neighbours.answer_of(v6("fe80::1234")), unasked) << "on each link";
  const Endpoint silent{v6("fd00:9::50"), 40000};
  EXPECT_EQ(neighbours.answer_of(silent.address), unasked);
  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {v6("fd00:9::1"), 0}}};
  const std::array datagram{std::byte{1}};
  const ByteView view{datagram};
  EXPECT_EQ(socket.send(silent, {&view, 1}), SendStatus::sent);
  EXPECT_EQ(neighbours.answer_of(silent.address), awaited);
  EXPECT_FALSE(neighbours.known(silent.address));
  EXPECT_EQ(Neighbours(v6("fd00:9::1"), "v0").answer_of(silent.address), awaited)
      << "by the interface's name";
  EXPECT_EQ(Neighbours(v6("fd00:9::1"), "v1").answer_of(silent.address), unasked) << "of another interface";
  EXPECT_EQ(Neighbours(v6("fd00:9::1"), "v9").answer_of(silent.address), untold) << "there is none";
  EXPECT_EQ(Neighbours(v6("::1"), {}).answer_of(v6("::1")), untold);
}

TEST_F(FullInterfaceTest, TellsTheSameOfBothKindsOfAddresses) {
  if (!has_ipv6()) {
    GTEST_SKIP() << "there is no IPv6";
  }
  using enum Neighbours::Answer;
  const Neighbours over_v4{IpAddress::v4(10, 9, 0, 1), {}};
  const Neighbours over_v6{v6("fd00:9::1"), {}};
  const std::vector<std::pair<std::string, Neighbours::Answer>> states{
      {"permanent", came}, {"reachable", came}, {"stale", came},
      {"delay", came},     {"probe", came},     {"noarp", unasked}};
  for (const auto& [state, answer] : states) {
    for (const std::string host : {"10.9.0.60", "fd00:9::60"}) {
      ASSERT_EQ(std::system(("ip neigh replace " + host + " lladdr 02:00:00:00:00:60 dev v0 nud " + state)
                                .c_str()),  // NOLINT(cert-env33-c)
                0);
    }
    EXPECT_EQ(over_v4.answer_of(IpAddress::v4(10, 9, 0, 60)), answer) << state;
    EXPECT_EQ(over_v6.answer_of(v6("fd00:9::60")), answer) << state;
  }
  for (const std::string host : {"10.9.0.60", "fd00:9::60"}) {
    ASSERT_EQ(
        std::system(("ip neigh replace " + host + " dev v0 nud failed").c_str()),  // NOLINT(cert-env33-c)
        0);
  }
  // One that has failed: nobody knows when the system throws it away.
  EXPECT_THAT(over_v4.answer_of(IpAddress::v4(10, 9, 0, 60)), testing::AnyOf(awaited, unasked));
  EXPECT_THAT(over_v6.answer_of(v6("fd00:9::60")), testing::AnyOf(awaited, unasked));
}

}  // namespace
}  // namespace trestle::someip
