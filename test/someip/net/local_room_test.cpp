// How full the sockets of this host are, and what MessageSender makes of it.
#include "someip/net/local_room.hpp"

#include <gmock/gmock.h>

#include "test/someip/net/message_sender_fixture.hpp"

namespace trestle::someip::message_sender_test {
namespace {

class LocalRoomTest : public MessageSenderTest {
 protected:
  void SetUp() override {
    if (!room.of(socket.local(), receiver.local())) {
      GTEST_SKIP() << "the system does not tell of sockets (sock_diag)";
    }
  }

  LocalRoom room;
};

TEST_F(LocalRoomTest, IsToldOfAnySocketOfThisHost) {
  const auto before = room.of(socket.local(), receiver.local());
  ASSERT_TRUE(before);
  EXPECT_EQ(before->unread, 0U);
  EXPECT_EQ(before->most, 2U * static_cast<std::size_t>(receiver.receive_buffer_bytes()));
  const auto payload = numbers(1000);
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1});
  const auto after = room.of(socket.local(), receiver.local());
  ASSERT_TRUE(after);
  EXPECT_GE(after->unread, 1000U);
  await_datagrams(1);
}

TEST_F(LocalRoomTest, IsNotToldWhereNoSocketIs) {
  Endpoint nobody;
  {
    const UdpSocket gone{io, {.local = {IpAddress::v4(127, 0, 0, 3), 0}}};
    nobody = gone.local();
  }
  EXPECT_FALSE(room.of(socket.local(), nobody));
  EXPECT_TRUE(room.of(socket.local(), receiver.local())) << "it still tells of others";
}

TEST_F(LocalRoomTest, LetsALargeMessageLeaveWithoutPauses) {
  const auto payload = numbers(200 * tp_default_segment_bytes);
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, slow);
  EXPECT_EQ(sender.counters().datagrams, default_burst) << "without being asked";
  UdpSocket another{io, {.local = {IpAddress::v4(127, 0, 0, 3), 0}}};
  MessageSender asks{io, another};
  asks.ask_for_room(room);
  asks.send(receiver.local(), event, {&slice, 1}, nullptr, slow);
  EXPECT_EQ(asks.counters().datagrams, 200U);
}

// Much more than its socket has room for, and it reads in between.
TEST_F(LocalRoomTest, IsNotOverrun) {
  UdpSocket another{io, {.local = {IpAddress::v4(127, 0, 0, 3), 0}}};
  MessageSender asks{io, another};
  asks.ask_for_room(room);
  UdpSocket small{io, {.local = {IpAddress::v4(127, 0, 0, 4), 0}, .receive_buffer_bytes = 400'000}};
  const auto payload = numbers(2000 * tp_default_segment_bytes);
  const ByteView slice{payload};
  asks.send(small.local(), event, {&slice, 1});
  EXPECT_LT(asks.counters().datagrams, 600U) << "nothing has been read yet";
  const auto buffer = room.of(another.local(), small.local());
  ASSERT_TRUE(buffer);
  EXPECT_LE(buffer->unread, buffer->most * 3 / 4);
  std::size_t came = 0;
  small.receive([&](ByteView, const Endpoint&) { ++came; });
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (came < 2000 && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_EQ(came, 2000U);
  EXPECT_EQ(small.receive_overflows(), 0U);
}

}  // namespace
}  // namespace trestle::someip::message_sender_test
