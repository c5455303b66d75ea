// MessageSender: small messages that leave together.
#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "someip/net/message_sender.hpp"

namespace trestle::someip::message_batch_test {
namespace {

using testing::Each;
using testing::ElementsAre;
using namespace std::chrono_literals;

constexpr Header event{.service = ServiceId{0x1234},
                       .method = MethodId{0x8001},
                       .interface_version = 1,
                       .type = MessageType::notification};

/// What arrived, told by session and size of the payload.
struct Arrival {
  std::uint16_t session = 0;
  std::size_t bytes = 0;
  friend bool operator==(const Arrival&, const Arrival&) = default;
};

class MessageBatchTest : public testing::Test {
 protected:
  MessageBatchTest() {
    note_at(first, at_first);
    note_at(second, at_second);
  }
  static void note_at(UdpSocket& socket, std::vector<Arrival>& arrived) {
    socket.receive([&arrived](ByteView datagram, const Endpoint&) {
      const auto message = decode(datagram);
      ASSERT_TRUE(message);
      ASSERT_EQ(message->size(), datagram.size()) << "one message in one datagram";
      ASSERT_THAT(message->payload, Each(static_cast<std::byte>(value(message->header.session))));
      arrived.push_back({value(message->header.session), message->payload.size()});
    });
  }
  bool send(const UdpSocket& to, std::uint16_t session, std::size_t bytes, MethodId method = event.method) {
    Header header = event;
    header.method = method;
    header.session = SessionId{session};
    // Gone when send() returns.
    const std::vector<std::byte> payload(bytes, static_cast<std::byte>(session));
    const std::vector<ByteView> halves{ByteView{payload}.first(bytes / 2),
                                       ByteView{payload}.subspan(bytes / 2)};
    return sender.send(to.local(), header, halves);
  }
  template <typename Condition>
  void run_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
    }
    ASSERT_TRUE(condition());
  }
  static std::vector<Arrival> in_order(std::uint16_t count, std::size_t bytes) {
    std::vector<Arrival> result;
    for (std::uint16_t i = 1; i <= count; ++i) {
      result.push_back({i, bytes});
    }
    return result;
  }

  boost::asio::io_context io{1};
  UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  UdpSocket first{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  UdpSocket second{io, {.local = {IpAddress::v4(127, 0, 0, 3), 0}}};
  MessageSender sender{io, socket, 1 << 20};
  std::vector<Arrival> at_first;
  std::vector<Arrival> at_second;
};

TEST_F(MessageBatchTest, ALoneMessageLeavesBeforeSendReturns) {
  EXPECT_TRUE(send(first, 1, 64));
  EXPECT_EQ(sender.counters().datagrams, 1U);
  EXPECT_TRUE(sender.idle());
  run_until([&] { return at_first.size() == 1; });
  EXPECT_TRUE(send(first, 2, 64)) << "another handler: alone again";
  EXPECT_EQ(sender.counters().datagrams, 2U);
  EXPECT_EQ(sender.counters().system_calls, 2U);
}

TEST_F(MessageBatchTest, AHandlersMessagesLeaveWithTwoSystemCalls) {
  boost::asio::post(io, [&] {
    for (std::uint16_t i = 1; i <= 65; ++i) {
      EXPECT_TRUE(send(first, i, 64));
    }
    EXPECT_EQ(sender.counters().datagrams, 1U);
    EXPECT_FALSE(sender.idle());
  });
  run_until([&] { return at_first.size() == 65; });
  EXPECT_EQ(at_first, in_order(65, 64));
  EXPECT_EQ(sender.counters().system_calls, 2U);
  EXPECT_EQ(sender.counters().messages, 65U);
  EXPECT_EQ(sender.counters().datagrams, 65U);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageBatchTest, AreSentWhenThereAreAsManyAsOneCallTakes) {
  for (std::uint16_t i = 1; i <= 66; ++i) {
    send(first, i, 8);
  }
  EXPECT_EQ(sender.counters().datagrams, 65U);
  run_until([&] { return at_first.size() == 66; });
  EXPECT_EQ(at_first, in_order(66, 8));
  EXPECT_EQ(sender.counters().system_calls, 3U);
}

TEST_F(MessageBatchTest, AreSentWhenTheyFillAnIpPacket) {
  for (std::uint16_t i = 1; i <= 47; ++i) {
    send(first, i, 1400);  // 45 datagrams of 1416 bytes are 63720
  }
  EXPECT_EQ(sender.counters().datagrams, 46U);
  run_until([&] { return at_first.size() == 47; });
  EXPECT_EQ(at_first, in_order(47, 1400));
}

TEST_F(MessageBatchTest, MayHaveAnySize) {
  const std::vector<std::size_t> sizes{0, 8, 8, 4, 8, 0, 0, 16, 1400, 1, 1400, 1400, 0};
  std::vector<Arrival> expected;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto session = static_cast<std::uint16_t>(i);
    send(first, session, sizes[i]);
    expected.push_back({session, sizes[i]});
  }
  run_until([&] { return at_first.size() == sizes.size(); });
  EXPECT_EQ(at_first, expected);
  EXPECT_EQ(sender.counters().system_calls, 2U);
}

TEST_F(MessageBatchTest, MayGoToSeveralReceivers) {
  for (std::uint16_t i = 1; i <= 20; ++i) {
    send(first, i, 32);
    send(second, i, 32);
  }
  run_until([&] { return at_first.size() + at_second.size() == 40; });
  EXPECT_EQ(at_first, in_order(20, 32));
  EXPECT_EQ(at_second, in_order(20, 32));
  EXPECT_EQ(sender.counters().system_calls, 2U);
}

// A server answers what came together with two system calls, without waiting for another handler.
TEST_F(MessageBatchTest, OfWhatWasReceivedTogetherLeavesWhenAllThatIsDone) {
  std::size_t requests = 0;
  socket.receive([&](ByteView, const Endpoint&) {
    send(first, static_cast<std::uint16_t>(++requests), 100);
    EXPECT_EQ(sender.counters().datagrams, 1U);
  });
  const std::vector<std::byte> requests_together(320);
  const Train train{socket.local(), requests_together, 10};
  ASSERT_EQ(first.send_trains({&train, 1}).sent, 32U);
  run_until([&] { return requests > 0; });
  EXPECT_EQ(requests, 32U);
  EXPECT_EQ(sender.counters().datagrams, 32U);
  EXPECT_EQ(sender.counters().system_calls, 2U);
  run_until([&] { return at_first.size() == 32; });
  EXPECT_EQ(at_first, in_order(32, 100));
}

// Each handler sends one, and the next one follows at once.
TEST_F(MessageBatchTest, OfHandlersThatFollowEachOtherLeaveTogether) {
  constexpr std::uint16_t count = 5000;
  UdpSocket receiver{io, {.local = {IpAddress::v4(127, 0, 0, 4), 0}}};
  std::uint16_t sent = 0;
  const std::function<void()> turn = [&] {
    send(receiver, ++sent, 16);
    if (sent < count) {
      boost::asio::post(io, turn);
    }
  };
  turn();
  run_until([&] { return sender.counters().messages == count; });
  EXPECT_TRUE(sender.idle()) << "once no handler follows";
  EXPECT_LT(sender.counters().system_calls, count);
  io.poll();
  send(receiver, count + 1, 16);
  EXPECT_EQ(sender.counters().messages, count + 1U) << "alone again";
  std::vector<Arrival> arrived;
  note_at(receiver, arrived);
  run_until([&] { return arrived.size() == count + 1U; });
  EXPECT_EQ(arrived, in_order(count + 1, 16));
}

TEST_F(MessageBatchTest, KeepTheirOrderBeforeAndAfterALargeMessage) {
  std::vector<std::string> arrived;
  UdpSocket receiver{io, {.local = {IpAddress::v4(127, 0, 0, 4), 0}}};
  receiver.receive([&](ByteView datagram, const Endpoint&) {
    const auto message = decode(datagram);
    arrived.push_back(std::to_string(value(message->header.session)) +
                      (is_tp(message->header.type) ? " TP" : ""));
  });
  send(receiver, 1, 1);
  send(receiver, 2, 1);
  send(receiver, 3, 1);
  send(receiver, 4, 2784);  // two segments
  send(receiver, 5, 1);
  run_until([&] { return arrived.size() == 6; });
  EXPECT_THAT(arrived, ElementsAre("1", "2", "3", "4 TP", "4 TP", "5"));
}

TEST_F(MessageBatchTest, LeaveWhenTheSenderIsClosed) {
  for (std::uint16_t i = 1; i <= 5; ++i) {
    send(first, i, 1);
  }
  sender.close();
  EXPECT_EQ(sender.counters().messages, 5U);
  EXPECT_EQ(sender.counters().abandoned, 0U);
  EXPECT_FALSE(send(first, 6, 1));
  EXPECT_EQ(sender.counters().abandoned, 1U);
  run_until([&] { return at_first.size() == 5; });
}

TEST_F(MessageBatchTest, LeaveWhenTheyAreFlushed) {
  send(first, 1, 1);
  send(first, 2, 1);
  sender.flush();
  EXPECT_EQ(sender.counters().messages, 2U);
  send(first, 3, 1);
  EXPECT_EQ(sender.counters().messages, 2U) << "still the same handler";
  run_until([&] { return at_first.size() == 3; });
}

TEST_F(MessageBatchTest, AreCountedOneByOneWhenTheSystemRefusesThem) {
  const Endpoint nowhere{IpAddress::v4(255, 255, 255, 255), 9};  // broadcast needs a permission it has not
  send(first, 1, 1);
  send(first, 2, 1);
  sender.send(nowhere, event, {});
  sender.send(nowhere, event, {});
  send(first, 3, 1);
  run_until([&] { return at_first.size() == 3; });
  EXPECT_EQ(at_first, in_order(3, 1));
  EXPECT_EQ(sender.counters().refused, 2U);
  EXPECT_EQ(sender.counters().messages, 3U);
}

TEST_F(MessageBatchTest, AreForgottenWithTheSender) {
  {
    UdpSocket other{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
    MessageSender brief{io, other};
    brief.send(first.local(), event, {});
    brief.send(first.local(), event, {});
  }
  run_until([&] { return at_first.size() == 2; });
  EXPECT_THAT(at_first, Each(Arrival{0, 0}));
}

}  // namespace
}  // namespace trestle::someip::message_batch_test
