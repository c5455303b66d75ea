// What a UDP socket does with the errors that the network sends back for its datagrams.
#include <gmock/gmock.h>

#include <netinet/in.h>
#include <netinet/ip_icmp.h>
#include <sys/socket.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <vector>

#include "someip/net/addresses.hpp"
#include "someip/net/message_sender.hpp"
#include "someip/net/socket_calls.hpp"
#include "someip/net/udp_socket.hpp"

namespace trestle::someip::udp_errors_test {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using namespace std::chrono_literals;

IpAddress v6_loopback() {
  IpAddress result{.v6 = true};
  result.bytes[15] = 1;
  return result;
}

/// A sender that is told who is not there, a receiver that is, and one that is gone.
class UdpErrorsTest : public testing::TestWithParam<IpAddress> {
 protected:
  void SetUp() override {
    sender.receive([this](ByteView datagram, const Endpoint&) { answers.push_back(datagram.size()); });
    sender.report_unreachable([this](const Endpoint& receiver) { unreachable.push_back(receiver); });
    alive.receive([this](ByteView datagram, const Endpoint&) { sizes.push_back(datagram.size()); });
  }
  Endpoint gone() { return UdpSocket{io, {.local = {GetParam(), 0}}}.local(); }
  /// Runs until `condition` holds; false when it never does.
  template <typename Condition>
  bool run_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
    }
    return condition();
  }
  SendStatus send(const Endpoint& to, std::size_t bytes) {
    const ByteView slice = payload.first(bytes);
    return sender.send(to, {&slice, 1});
  }

  boost::asio::io_context io;
  UdpSocket sender{io, {.local = {GetParam(), 0}}};
  UdpSocket alive{io, {.local = {GetParam(), 0}}};
  const Endpoint dead = gone();
  std::vector<std::size_t> sizes;    ///< of what the one alive has received
  std::vector<std::size_t> answers;  ///< of what the sender has received
  std::vector<Endpoint> unreachable;
  const std::vector<std::byte> memory = std::vector<std::byte>(70'000);
  const ByteView payload{memory};
};

TEST_P(UdpErrorsTest, TellWhoIsNotThereOnceAndThenLetTheSocketRest) {
  EXPECT_EQ(send(dead, 10), SendStatus::sent);
  ASSERT_TRUE(run_until([&] { return !unreachable.empty(); }));
  EXPECT_EQ(unreachable, std::vector{dead});
  EXPECT_EQ(io.run_for(50ms), 0U) << "nothing wakes it any more";
  EXPECT_EQ(unreachable.size(), 1U);
  EXPECT_EQ(send(alive.local(), 10), SendStatus::sent);
  EXPECT_TRUE(run_until([&] { return sizes.size() == 1; }));
}

TEST_P(UdpErrorsTest, CostNoDatagramThatIsSentToOthers) {
  std::vector<std::size_t> wanted(50);
  std::iota(wanted.begin(), wanted.end(), 1U);
  for (const std::size_t bytes : wanted) {
    EXPECT_EQ(send(dead, bytes), SendStatus::sent);
    EXPECT_EQ(send(alive.local(), bytes), SendStatus::sent);
  }
  EXPECT_TRUE(
      run_until([&] { return sizes.size() == wanted.size() && unreachable.size() == wanted.size(); }));
  EXPECT_EQ(sizes, wanted);
  EXPECT_THAT(unreachable, Each(dead));
}

TEST_P(UdpErrorsTest, CostNoDatagramOfABatch) {
  const Endpoint other = gone();
  for (int round = 0; round < 10; ++round) {
    const std::vector<Train> trains{
        {dead, payload.first(1000), 100},     {alive.local(), payload.first(5), 5},
        {other, payload.first(7), 7},         {dead, payload.first(8), 8},
        {alive.local(), payload.first(9), 3}, {alive.local(), payload.first(2), 2}};
    const auto batch = sender.send_trains(trains);
    EXPECT_EQ(batch.status, SendStatus::sent);
    EXPECT_EQ(batch.sent, 10U + 1 + 1 + 1 + 3 + 1);
    sizes.clear();
    EXPECT_TRUE(run_until([&] { return sizes.size() == 5; }));
    EXPECT_EQ(sizes, (std::vector<std::size_t>{5, 3, 3, 3, 2}));
  }
  EXPECT_EQ(sender.send_counters().offload_refused, 0U);
  EXPECT_THAT(unreachable, IsSupersetOf({dead, other}));
}

TEST_P(UdpErrorsTest, CostNoDatagramThatIsReceived) {
  const ByteView slice = payload.first(1);
  for (int i = 0; i < 40; ++i) {
    send(dead, 1);
    EXPECT_EQ(alive.send(sender.local(), {&slice, 1}), SendStatus::sent);
  }
  EXPECT_TRUE(run_until([&] { return answers.size() == 40 && unreachable.size() == 40; }));
  EXPECT_EQ(answers.size(), 40U);
  EXPECT_EQ(unreachable.size(), 40U);
}

TEST_P(UdpErrorsTest, AreNotCountedAsRefusedMessages) {
  MessageSender messages{io, sender};
  const ByteView slice = payload.first(20);
  const ByteView large = payload;
  for (int i = 0; i < 20; ++i) {
    for (const Endpoint& to : {dead, alive.local()}) {
      EXPECT_TRUE(messages.send(to, {.type = MessageType::notification}, {&slice, 1}));
    }
  }
  messages.send(dead, {.type = MessageType::notification}, {&large, 1});
  messages.send(alive.local(), {.type = MessageType::notification}, {&large, 1});
  const std::size_t segments = (large.size() + tp_default_segment_bytes - 1) / tp_default_segment_bytes;
  EXPECT_TRUE(run_until([&] { return sizes.size() == 20 + segments && messages.idle(); }));
  EXPECT_EQ(sizes.size(), 20 + segments);
  EXPECT_EQ(messages.counters().messages, 42U);
  EXPECT_EQ(messages.counters().refused, 0U);
}

TEST_P(UdpErrorsTest, OfOurOwnAreNoSignThatTheReceiverIsNotThere) {
  EXPECT_EQ(send(alive.local(), 70'000), SendStatus::failed);
  EXPECT_EQ(send(alive.local(), 10), SendStatus::sent);
  EXPECT_TRUE(run_until([&] { return sizes.size() == 1; }));
  io.run_for(20ms);
  EXPECT_EQ(io.run_for(50ms), 0U) << "nothing wakes it any more";
  EXPECT_THAT(unreachable, IsEmpty());
}

TEST_P(UdpErrorsTest, MayEndTheSocket) {
  auto last = std::make_unique<UdpSocket>(io, UdpOptions{.local = {GetParam(), 0}});
  last->receive([](ByteView, const Endpoint&) {});
  last->report_unreachable([&](const Endpoint&) { last.reset(); });
  const ByteView slice = payload.first(1);
  for (int i = 0; i < 3; ++i) {
    last->send(dead, {&slice, 1});
  }
  EXPECT_TRUE(run_until([&] { return !last; }));
  io.run_for(10ms);
}

TEST_P(UdpErrorsTest, AreNotToldUnlessAskedFor) {
  UdpSocket deaf{io, {.local = {GetParam(), 0}}};
  deaf.receive([](ByteView, const Endpoint&) {});
  const ByteView slice = payload.first(1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(deaf.send(dead, {&slice, 1}), SendStatus::sent);
  }
  EXPECT_EQ(deaf.send_counters().calls, 3U) << "none had to be repeated";
  EXPECT_EQ(io.run_for(20ms), 0U);
}

std::uint16_t checksum(std::span<const std::uint8_t> bytes) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    sum += (std::uint32_t{bytes[i]} << 8U) | bytes[i + 1];
  }
  while (sum > 0xffff) {
    sum = (sum & 0xffffU) + (sum >> 16U);
  }
  return static_cast<std::uint16_t>(~sum);
}

/// Sends ICMP as somebody who has seen a datagram from `from` to `to`; false without the right to do so.
bool say_unreachable(const IpAddress& as, const Endpoint& from, const Endpoint& to) {
  const Descriptor raw{::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_ICMP)};
  if (raw.get() < 0) {
    return false;
  }
  std::array<std::uint8_t, 8 + 20 + 8> bytes{ICMP_DEST_UNREACH, ICMP_PORT_UNREACH};
  const std::span quoted = std::span{bytes}.subspan(8);
  quoted[0] = 0x45;
  quoted[3] = 28;
  quoted[8] = 64;
  quoted[9] = IPPROTO_UDP;
  const auto put = [&](std::size_t at, std::uint16_t number) {
    quoted[at] = static_cast<std::uint8_t>(number >> 8U);
    quoted[at + 1] = static_cast<std::uint8_t>(number);
  };
  std::memcpy(&quoted[12], from.address.bytes.data(), 4);
  std::memcpy(&quoted[16], to.address.bytes.data(), 4);
  put(20, from.port);
  put(22, to.port);
  put(24, 8);
  const std::uint16_t sum = checksum(bytes);
  bytes[2] = static_cast<std::uint8_t>(sum >> 8U);
  bytes[3] = static_cast<std::uint8_t>(sum);
  SocketAddress own{{as, 0}};
  SocketAddress victim{{from.address, 0}};
  return bind(raw.get(), own.data(), own.size()) == 0 &&
         sendto(raw.get(), bytes.data(), bytes.size(), 0, victim.data(), victim.size()) ==
             static_cast<ssize_t>(bytes.size());
}

TEST(ForgedUdpErrors, AreCountedAndNotBelieved) {
  boost::asio::io_context io;
  UdpSocket sender{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  std::vector<Endpoint> unreachable;
  sender.receive([](ByteView, const Endpoint&) {});
  sender.report_unreachable([&](const Endpoint& receiver) { unreachable.push_back(receiver); });
  const Endpoint receiver{IpAddress::v4(127, 0, 0, 2), 6000};
  if (!say_unreachable(IpAddress::v4(127, 0, 0, 9), sender.local(), receiver)) {
    if (std::getenv("TRESTLE_REQUIRE_PEERS") != nullptr) {
      FAIL() << "it may not open raw sockets";
    }
    GTEST_SKIP() << "it may not open raw sockets";
  }
  const auto run_until = [&](const auto& condition) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
    }
    return condition();
  };
  EXPECT_TRUE(run_until([&] { return sender.unreachable_ignored() == 1; }));
  EXPECT_THAT(unreachable, IsEmpty());
  for (const IpAddress& who : {receiver.address, sender.local().address}) {  // the receiver, and this host
    unreachable.clear();
    ASSERT_TRUE(say_unreachable(who, sender.local(), receiver));
    EXPECT_TRUE(run_until([&] { return !unreachable.empty(); }));
    EXPECT_EQ(unreachable, std::vector{receiver});
  }
  EXPECT_EQ(sender.unreachable_ignored(), 1U);
}

INSTANTIATE_TEST_SUITE_P(OnLoopback, UdpErrorsTest,
                         testing::Values(IpAddress::v4(127, 0, 0, 1), v6_loopback()),
                         [](const auto& one) { return one.param.v6 ? "v6" : "v4"; });

}  // namespace
}  // namespace trestle::someip::udp_errors_test
