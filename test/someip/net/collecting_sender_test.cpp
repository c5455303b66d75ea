// Several messages in one datagram.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/net/message_sender_fixture.hpp"

namespace trestle::someip::message_sender_test {
namespace {

using test::covers;

class CollectingSenderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    receiver.receive(
        [this](ByteView datagram, const Endpoint&) { arrived.push_back(test::to_hex(datagram)); });
    other.receive([this](ByteView datagram, const Endpoint&) { at_other.push_back(test::to_hex(datagram)); });
  }
  /// Runs until so many datagrams have come to both, or there is nothing more to come.
  void await_datagrams(std::size_t count) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (arrived.size() + at_other.size() < count && std::chrono::steady_clock::now() < end) {
      io.run_one_for(5ms);
    }
    while (sender.idle() && io.run_one_for(5ms) > 0) {
    }
  }
  /// Runs until all that was sent since `before` has come.
  void await_all() {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while ((!sender.idle() ||
            arrived.size() + at_other.size() < sender.counters().datagrams - before.datagrams) &&
           std::chrono::steady_clock::now() < end) {
      io.run_one_for(5ms);
    }
  }
  void run_for(std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      io.run_one_for(5ms);
    }
  }
  bool send(const UdpSocket& to, const std::vector<std::byte>& payload) {
    const ByteView slice{payload};
    return sender.send(to.local(), event, {&slice, 1});
  }

  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  UdpSocket receiver{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  UdpSocket other{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  MessageSender sender{io, socket, 1 << 20, 40ms};
  MessageSender::Counters before;
  std::vector<std::string> arrived;
  std::vector<std::string> at_other;
};

TEST_F(CollectingSenderTest, PutsWhatComesInShortTimeIntoOneDatagramForEachReceiver) {
  covers({"feat_req_someip_741", "feat_req_someip_166"});
  for (int tries = 0; tries < 20; ++tries) {  // until the machine lets us be as quick as that
    arrived.clear();
    at_other.clear();
    before = sender.counters();
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_TRUE(send(receiver, test::hex("aa")));
    EXPECT_TRUE(send(other, test::hex("bb")));
    EXPECT_TRUE(send(receiver, {}));
    EXPECT_FALSE(sender.idle());
    run_for(15ms);
    const bool none = arrived.empty();
    EXPECT_TRUE(send(receiver, test::hex("cccc")));
    if (std::chrono::steady_clock::now() - begin < 40ms) {
      EXPECT_TRUE(none) << "they wait for each other";
      await_all();
      break;
    }
    await_all();
  }
  EXPECT_THAT(arrived, ::testing::ElementsAre("12348001"
                                              "00000009"
                                              "00000007"
                                              "01010200"
                                              "aa"
                                              "12348001"
                                              "00000008"
                                              "00000007"
                                              "01010200"
                                              "12348001"
                                              "0000000a"
                                              "00000007"
                                              "01010200"
                                              "cccc"));
  EXPECT_THAT(at_other, ::testing::ElementsAre("12348001"
                                               "00000009"
                                               "00000007"
                                               "01010200"
                                               "bb"));
  EXPECT_EQ(sender.counters().messages - before.messages, 4U);
  EXPECT_EQ(sender.counters().datagrams - before.datagrams, 2U);
  EXPECT_TRUE(sender.idle());
  // And again.
  EXPECT_TRUE(send(receiver, test::hex("dd")));
  await_datagrams(3);
  EXPECT_EQ(arrived.size(), 2U);
}

TEST_F(CollectingSenderTest, SendsADatagramThatIsFull) {
  EXPECT_TRUE(send(receiver, numbers(700)));
  EXPECT_TRUE(send(receiver, numbers(668))) << "2 headers and 1368 bytes: just 1400";
  EXPECT_TRUE(send(receiver, numbers(1)));
  EXPECT_EQ(sender.counters().datagrams, 1U) << "without waiting";
  await_datagrams(1);
  EXPECT_EQ(arrived.at(0).size(), 2U * (16 + 700 + 16 + 668));
  await_datagrams(2);
  ASSERT_EQ(arrived.size(), 2U);
  EXPECT_TRUE(send(receiver, numbers(1400)));
  EXPECT_TRUE(send(receiver, numbers(1400)));
  await_datagrams(4);
  EXPECT_EQ(arrived.size(), 4U);
}

TEST_F(CollectingSenderTest, KeepsTheOrderBeforeALargeMessage) {
  EXPECT_TRUE(send(receiver, test::hex("01")));
  EXPECT_TRUE(send(receiver, numbers(1401)));
  EXPECT_EQ(sender.counters().datagrams, 3U) << "at once: the small one, then two segments";
  await_datagrams(3);
  ASSERT_EQ(arrived.size(), 3U);
  EXPECT_EQ(arrived[0],
            "12348001"
            "00000009"
            "00000007"
            "01010200"
            "01");
}

TEST_F(CollectingSenderTest, SendsWhatItHasCollectedWhenItIsClosed) {
  EXPECT_TRUE(send(receiver, test::hex("01")));
  EXPECT_TRUE(send(receiver, test::hex("02")));
  sender.close();
  EXPECT_EQ(sender.counters().messages, 2U);
  EXPECT_EQ(sender.counters().abandoned, 0U);
  await_datagrams(1);
  EXPECT_EQ(arrived.size(), 1U);
  EXPECT_FALSE(send(receiver, test::hex("03")));
}

TEST_F(CollectingSenderTest, WaitsNoLongerThanItIsToldThoughMoreComes) {
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(send(receiver, test::hex("01")));
    run_for(15ms);
  }
  EXPECT_GE(sender.counters().datagrams, 1U) << "the first has waited for 75 ms";
}

TEST_F(CollectingSenderTest, CollectsForSoManyReceiversAtOnce) {
  const auto send_to = [&](std::uint16_t port) {
    EXPECT_TRUE(sender.send({IpAddress::v4(127, 0, 0, 3), port}, event, {}));
  };
  for (std::uint16_t port = 1; port <= 64; ++port) {
    send_to(port);
  }
  EXPECT_EQ(sender.counters().datagrams, 0U);
  send_to(65);
  EXPECT_EQ(sender.counters().datagrams, 64U);
  while (!sender.idle()) {
    io.run_one_for(5ms);
  }
  EXPECT_EQ(sender.counters().datagrams, 65U);
}

TEST_F(CollectingSenderTest, CountsEachMessageThatTheSystemRefuses) {
  const Endpoint nowhere{IpAddress::v4(255, 255, 255, 255), 9};  // broadcast needs a permission it has not
  const Endpoint nowhere_else{nowhere.address, 10};
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(sender.send(nowhere, event, {}));
    EXPECT_TRUE(send(receiver, {}));
    EXPECT_TRUE(sender.send(nowhere_else, event, {}));
  }
  await_datagrams(1);
  EXPECT_EQ(sender.counters().refused, 6U);
  EXPECT_EQ(sender.counters().messages, 3U);
  EXPECT_EQ(arrived.size(), 1U);
  EXPECT_TRUE(sender.idle());
}

}  // namespace
}  // namespace trestle::someip::message_sender_test
