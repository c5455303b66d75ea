// What a UDP socket does where the system cannot do all that it may.
#include "someip/net/udp_transmitter.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "someip/net/message_sender.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip::udp_transmitter_test {
namespace {

using testing::ElementsAre;

/// From now on the system call ends with this error, in this thread, for good.
bool break_system_call(unsigned number, unsigned error) {
  std::array<sock_filter, 4> program{
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 1),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | error),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
  const sock_fprog filter{.len = program.size(), .filter = program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

/// Two receivers on loopback, which read without an io_context.
class UdpTransmitterTest : public testing::Test {
 protected:
  static Descriptor open_at(std::uint8_t host) {
    Descriptor result{::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    EXPECT_EQ(bind_to(result.get(), {IpAddress::v4(127, 0, 0, host), 0}, 0), 0);
    return result;
  }
  static Endpoint endpoint_of(const Descriptor& socket) {
    SocketAddress own;
    getsockname(socket.get(), own.data(), &own.size());
    return own.endpoint();
  }
  static std::vector<std::size_t> sizes_at(const Descriptor& socket) {
    std::vector<std::size_t> sizes;
    std::array<std::byte, 2048> room{};
    for (ssize_t got = 0; (got = recv(socket.get(), room.data(), room.size(), 0)) >= 0;) {
      sizes.push_back(static_cast<std::size_t>(got));
    }
    return sizes;
  }
  // Without checksums of UDP the kernel does no segmentation: it says EINVAL.
  void switch_offload(bool on) { set_option(sender.get(), SOL_SOCKET, SO_NO_CHECK, on ? 0 : 1); }

  Descriptor sender = open_at(1);
  Descriptor first = open_at(2);
  Descriptor second = open_at(3);
  Endpoint to_first = endpoint_of(first);
  Endpoint to_second = endpoint_of(second);
  UdpTransmitter transmitter{sender.get(), 0};
  const std::vector<std::byte> payload = std::vector<std::byte>(250, std::byte{1});
  const ByteView bytes{payload};
};

TEST_F(UdpTransmitterTest, SendsTrainsToSeveralReceiversWithOneCall) {
  const std::vector<Train> trains{{to_first, bytes, 100},
                                  {to_second, bytes.first(200), 100},
                                  {to_first, bytes.first(7), 7},
                                  {to_first, {}, 0}};
  const auto batch = transmitter.send_trains(trains);
  EXPECT_EQ(batch.status, SendStatus::sent);
  EXPECT_EQ(batch.sent, 7U);
  EXPECT_EQ(transmitter.counters().calls, 1U);
  EXPECT_THAT(sizes_at(first), ElementsAre(100, 100, 50, 7, 0));
  EXPECT_THAT(sizes_at(second), ElementsAre(100, 100));
}

TEST_F(UdpTransmitterTest, DoesWithoutOffloadForAReceiverThatItFailsFor) {
  switch_offload(false);
  const std::vector<Train> trains{{to_first, bytes, 100}, {to_second, bytes, 200}};
  EXPECT_EQ(transmitter.send_trains(trains).sent, 5U);
  EXPECT_THAT(sizes_at(first), ElementsAre(100, 100, 50));
  EXPECT_THAT(sizes_at(second), ElementsAre(200, 50));
  EXPECT_EQ(transmitter.counters().offload_refused, 2U);
  const std::uint64_t calls = transmitter.counters().calls;
  const std::vector<ByteView> slices{bytes.first(100), bytes.first(100)};
  const std::vector<std::uint8_t> counts{1, 1};
  EXPECT_EQ(transmitter.send_segments(to_first, slices, counts, 100).sent, 2U);
  EXPECT_THAT(sizes_at(first), ElementsAre(100, 100));
  EXPECT_EQ(transmitter.counters().calls, calls + 1) << "known to have none";
  EXPECT_EQ(transmitter.counters().offload_refused, 2U);
}

TEST_F(UdpTransmitterTest, TriesOffloadAgainAfterAWhile) {
  switch_offload(false);
  const Train train{to_first, bytes, 100};
  for (unsigned i = 0; i < UdpTransmitter::offload_pause; ++i) {
    ASSERT_EQ(transmitter.send_trains({&train, 1}).sent, 3U);
    ASSERT_EQ(sizes_at(first).size(), 3U);
  }
  EXPECT_EQ(transmitter.counters().offload_refused, 1U);
  EXPECT_EQ(transmitter.send_trains({&train, 1}).sent, 3U);
  EXPECT_EQ(sizes_at(first).size(), 3U);
  EXPECT_EQ(transmitter.counters().offload_refused, 2U);
  switch_offload(true);
  for (unsigned i = 0; i < UdpTransmitter::offload_pause; ++i) {
    ASSERT_EQ(transmitter.send_trains({&train, 1}).sent, 3U);
    ASSERT_EQ(sizes_at(first).size(), 3U);
  }
  EXPECT_EQ(transmitter.counters().offload_refused, 2U);
}

TEST_F(UdpTransmitterTest, OneReceiverWithoutOffloadTakesItFromNoOther) {
  switch_offload(false);
  const Train to_one{to_first, bytes, 100};
  EXPECT_EQ(transmitter.send_trains({&to_one, 1}).sent, 3U);
  switch_offload(true);
  const std::uint64_t calls = transmitter.counters().calls;
  const std::vector<Train> trains{{to_second, bytes, 100}, to_one};
  EXPECT_EQ(transmitter.send_trains(trains).sent, 6U);
  EXPECT_EQ(transmitter.counters().calls, calls + 1);
  EXPECT_EQ(transmitter.counters().offload_refused, 1U);
}

TEST_F(UdpTransmitterTest, DoesWithoutSendmmsg) {
  const auto child = [&] {
    switch_offload(false);
    if (!break_system_call(SYS_sendmmsg, ENOSYS)) {
      std::exit(77);
    }
    const std::vector<Train> trains{{to_first, bytes, 100}, {to_second, bytes, 200}};
    const auto batch = transmitter.send_trains(trains);
    const bool good = batch.sent == 5 && batch.status == SendStatus::sent &&
                      sizes_at(first) == std::vector<std::size_t>{100, 100, 50} &&
                      sizes_at(second) == std::vector<std::size_t>{200, 50};
    std::exit(good ? 0 : 1);
  };
  EXPECT_EXIT(child(), testing::ExitedWithCode(0), "");
}

// As a filter of system calls may have it, which knows sendmmsg() but not what it is to look at.
TEST_F(UdpTransmitterTest, DoesWithoutOffloadThatIsForbidden) {
  const auto child = [&] {
    if (!break_system_call(SYS_sendmsg, EPERM)) {
      std::exit(77);
    }
    const std::vector<Train> trains{{to_first, bytes, 100}};
    const auto batch = transmitter.send_trains(trains);
    const bool good = batch.sent == 3 && batch.status == SendStatus::sent &&
                      transmitter.counters().offload_refused == 1 &&
                      sizes_at(first) == std::vector<std::size_t>{100, 100, 50};
    std::exit(good ? 0 : 1);
  };
  EXPECT_EXIT(child(), testing::ExitedWithCode(0), "");
}

TEST_F(UdpTransmitterTest, ASocketDoesWithoutRecvmmsg) {
  const auto child = [&] {
    boost::asio::io_context io;
    UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
    if (!break_system_call(SYS_recvmmsg, ENOSYS)) {
      std::exit(77);
    }
    std::vector<std::size_t> sizes;
    socket.receive([&](ByteView datagram, const Endpoint&) { sizes.push_back(datagram.size()); });
    for (std::size_t i = 0; i < 20; ++i) {
      const ByteView slice = bytes.first(i);
      if (transmitter.send(socket.local(), {&slice, 1}) != SendStatus::sent) {
        std::exit(2);
      }
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{30};
    while (sizes.size() < 20 && std::chrono::steady_clock::now() < end) {
      io.run_one_for(std::chrono::milliseconds{100});
    }
    std::vector<std::size_t> expected(20);
    std::iota(expected.begin(), expected.end(), 0);
    std::exit(sizes == expected ? 0 : 1);
  };
  EXPECT_EXIT(child(), testing::ExitedWithCode(0), "");
}

// The system has no room for a batch: its messages wait in the queue, and keep their order.
TEST_F(UdpTransmitterTest, ABatchThatFindsNoRoomWaits) {
  const auto child = [&] {
    boost::asio::io_context io;
    UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
    MessageSender messages{io, socket};
    if (!break_system_call(SYS_sendmmsg, EAGAIN)) {
      std::exit(77);
    }
    const Header header{};
    for (std::size_t i = 0; i < 5; ++i) {
      for (const Endpoint& to : {to_first, to_second}) {
        const ByteView slice = bytes.first(i);
        messages.send(to, header, {&slice, 1});
      }
    }
    const bool waited = messages.counters().messages == 1 && !messages.idle();
    messages.flush();
    const std::vector<std::size_t> sizes{16, 17, 18, 19, 20};
    std::exit(waited && messages.counters().messages == 10 && messages.counters().refused == 0 &&
                      messages.idle() && sizes_at(first) == sizes && sizes_at(second) == sizes
                  ? 0
                  : 1);
  };
  EXPECT_EXIT(child(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace trestle::someip::udp_transmitter_test
