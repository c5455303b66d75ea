#include "someip/net/message_sender.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::message_sender_test {
namespace {

using test::covers;
using namespace std::chrono_literals;

const Header event{.service = ServiceId{0x1234},
                   .method = MethodId{0x8001},
                   .session = SessionId{7},
                   .interface_version = 1,
                   .type = MessageType::notification};

/// The second burst is not due while a test looks at the first one, however slow the machine is.
const TpPacing slow{.separation = 200ms};

std::vector<std::byte> numbers(std::size_t bytes) {
  std::vector<std::byte> result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    result[i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  return result;
}

class MessageSenderTest : public ::testing::Test {
 protected:
  MessageSenderTest() {
    receiver.receive([this](ByteView datagram, const Endpoint&) {
      const auto message = decode(datagram);
      ASSERT_TRUE(message);
      ASSERT_EQ(message->size(), datagram.size());
      arrived.emplace_back(datagram.begin(), datagram.end());
    });
  }
  void await_datagrams(std::size_t count) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (arrived.size() < count && std::chrono::steady_clock::now() < end) {
      io.run_one_for(50ms);
    }
    ASSERT_EQ(arrived.size(), count);
  }
  // Puts the segments that arrived together and checks each one's headers on the way.
  std::vector<std::byte> joined(const Header& original) {
    std::vector<std::byte> payload;
    for (std::size_t i = 0; i < arrived.size(); ++i) {
      const auto message = decode(arrived[i]);
      Header expected = original;
      expected.type = with_tp(original.type);
      EXPECT_EQ(message->header, expected);
      const auto segment = decode_tp(*message);
      EXPECT_TRUE(segment);
      EXPECT_EQ(segment->header.offset, payload.size());
      EXPECT_EQ(segment->header.more, i + 1 < arrived.size());
      payload.insert(payload.end(), segment->slice.begin(), segment->slice.end());
    }
    return payload;
  }
  Message arrival(std::size_t i) { return *decode(arrived.at(i)); }
  // What arrived of one message.
  std::vector<std::byte> payload_of(SessionId session) {
    std::vector<std::byte> payload;
    for (const auto& datagram : arrived) {
      const auto message = decode(datagram);
      if (message->header.session == session) {
        const auto segment = decode_tp(*message);
        EXPECT_TRUE(segment);
        EXPECT_EQ(segment->header.offset, payload.size());
        payload.insert(payload.end(), segment->slice.begin(), segment->slice.end());
      }
    }
    return payload;
  }

  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  UdpSocket receiver{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  MessageSender sender{io, socket, 1 << 20};
  std::vector<std::vector<std::byte>> arrived;
};

TEST_F(MessageSenderTest, SendsASmallMessageAtOnceHoweverManyPiecesItHas) {
  covers({"feat_req_someip_318", "feat_req_someip_36", "feat_req_someip_166"});
  const auto payload = numbers(max_plain_payload_bytes);
  std::vector<ByteView> slices;
  for (std::size_t i = 0; i < payload.size(); i += 14) {
    slices.push_back(ByteView{payload}.subspan(i, 14));
  }
  EXPECT_TRUE(sender.send(receiver.local(), event, slices));
  EXPECT_EQ(sender.counters().datagrams, 1U);
  await_datagrams(1);
  EXPECT_TRUE(sender.send(receiver.local(), event, {}));
  EXPECT_EQ(sender.counters().datagrams, 2U);
  await_datagrams(2);
  EXPECT_EQ(arrival(0).header, event);
  EXPECT_TRUE(std::ranges::equal(arrival(0).payload, payload));
  EXPECT_EQ(arrival(1).payload.size(), 0U);
}

TEST_F(MessageSenderTest, SegmentsWhatDoesNotFitADatagram) {
  covers({"feat_req_someip_318", "feat_req_someiptp_765", "feat_req_someiptp_773", "feat_req_someiptp_760",
          "feat_req_someiptp_763"});
  const auto payload = numbers(200'001);
  const ByteView slice{payload};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}));
  await_datagrams(144);  // 143 x 1392 and 945
  EXPECT_EQ(joined(event), payload);
  EXPECT_EQ(sender.counters().messages, 1U);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageSenderTest, GathersSegmentsFromPiecesOfAnySize) {
  const auto payload = numbers(30'000);
  std::vector<ByteView> slices;
  for (std::size_t at = 0, step = 1; at < payload.size(); at += step, step = step * 7 % 401 + 1) {
    slices.push_back(ByteView{payload}.subspan(at, std::min(step, payload.size() - at)));
  }
  sender.send(receiver.local(), event, slices, nullptr,
              {.segment_bytes = 160, .burst = 7, .separation = 10us});
  sender.send(receiver.local(), event, {}, nullptr, {});
  await_datagrams(189);
  EXPECT_EQ(arrival(188).payload.size(), 0U);
  arrived.pop_back();
  EXPECT_EQ(joined(event), payload);
}

TEST_F(MessageSenderTest, SendsOneBurstAtATime) {
  covers({"feat_req_someiptp_801"});
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr,
              {.segment_bytes = 16, .burst = 30, .separation = 1ms});
  EXPECT_EQ(sender.counters().datagrams, 30U);
  const auto begin = std::chrono::steady_clock::now();
  await_datagrams(100);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 2ms);
  EXPECT_EQ(joined(event), payload);
}

TEST_F(MessageSenderTest, SharesTheBurstsOfAReceiverAmongItsMessages) {
  covers({"feat_req_someiptp_801"});
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  const TpPacing pacing{.segment_bytes = 16, .burst = 130, .separation = 200ms};
  Header other = event;
  other.method = MethodId{0x8002};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, pacing);
  EXPECT_TRUE(sender.idle());
  EXPECT_EQ(sender.counters().datagrams, 100U);
  // The burst is remembered when its message is gone.
  sender.send(receiver.local(), other, {&slice, 1}, nullptr, pacing);
  EXPECT_EQ(sender.counters().datagrams, 130U);
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, pacing);
  EXPECT_EQ(sender.counters().datagrams, 130U);
  await_datagrams(300);
  EXPECT_EQ(sender.counters().messages, 3U);
}

TEST_F(MessageSenderTest, LetsNoReceiverWaitForThePausesOfAnother) {
  UdpSocket second{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  std::size_t at_second = 0;
  second.receive([&](ByteView, const Endpoint&) { ++at_second; });
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  const auto pacing = [](std::size_t burst, Duration separation) {
    return TpPacing{.segment_bytes = 16, .burst = burst, .separation = separation};
  };
  UdpSocket third{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  std::size_t at_third = 0;
  third.receive([&](ByteView, const Endpoint&) { ++at_third; });
  sender.send(second.local(), event, {&slice, 1}, nullptr, pacing(90, 200ms));
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, pacing(99, 10s));
  sender.send(third.local(), event, {&slice, 1}, nullptr, pacing(90, 200ms));
  EXPECT_EQ(sender.counters().datagrams, 90U + 99U + 90U);
  const auto end = std::chrono::steady_clock::now() + 9s;  // less than the long pause
  while (at_second + at_third < 200 && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_EQ(at_second, 100U);
  EXPECT_EQ(at_third, 100U);
  EXPECT_EQ(arrived.size(), 99U);
  EXPECT_FALSE(sender.idle());
}

// What waits the longest is last in line.
TEST_F(MessageSenderTest, WakesUpForTheShortestPause) {
  UdpSocket second{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  std::size_t at_second = 0;
  second.receive([&](ByteView, const Endpoint&) { ++at_second; });
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  sender.send(second.local(), event, {&slice, 1}, nullptr,
              {.segment_bytes = 16, .burst = 90, .separation = 1ms});
  sender.send(receiver.local(), event, {&slice, 1}, nullptr,
              {.segment_bytes = 16, .burst = 99, .separation = 10s});
  const auto end = std::chrono::steady_clock::now() + 9s;
  while (at_second < 100 && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_EQ(at_second, 100U);
}

// A train has to fit an IP packet, and the room for what lies in many pieces.
TEST_F(MessageSenderTest, SendsMoreThanFitsATrain) {
  const auto payload = numbers(100 * 1392);
  std::vector<ByteView> slices;
  for (std::size_t at = 0; at < payload.size(); at += 100) {
    slices.push_back(ByteView{payload}.subspan(at, std::min<std::size_t>(100, payload.size() - at)));
  }
  const auto owner = std::make_shared<int>(0);
  EXPECT_TRUE(sender.send(receiver.local(), event, slices, owner, {.burst = 100, .separation = 0us}));
  EXPECT_EQ(sender.counters().datagrams, 100U);
  EXPECT_EQ(sender.counters().offload_refused, 0U);
  await_datagrams(100);
  EXPECT_EQ(joined(event), payload);
}

TEST_F(MessageSenderTest, SendsOnWhenTheEndOfAMessageBringsForthAnother) {
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  int left = 5;
  std::function<void()> send = [&] {
    const std::shared_ptr<const void> owner{&left, [&](const void*) {
                                              if (--left > 0) {
                                                send();
                                              }
                                            }};
    sender.send(receiver.local(), event, {&slice, 1}, owner, {.segment_bytes = 160, .burst = 4});
  };
  send();
  await_datagrams(50);
  EXPECT_EQ(left, 0);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageSenderTest, CanBeClosedByTheOwnerOfAMessage) {
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, {.segment_bytes = 16, .burst = 99});
  sender.send(receiver.local(), event, {&slice, 1},
              std::shared_ptr<const void>{&payload, [&](const void*) { sender.close(); }},
              {.segment_bytes = 160});
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, {.segment_bytes = 160});
  await_datagrams(110);
  io.run_for(5ms);
  EXPECT_EQ(sender.counters().datagrams, 110U);
  EXPECT_EQ(sender.counters().abandoned, 1U);
}

// Of those who got something lately, the pace of so many is remembered; and nothing is lost.
TEST_F(MessageSenderTest, SendsToAnyNumberOfReceivers) {
  const auto payload = numbers(3200);
  const ByteView slice{payload};
  for (std::uint16_t port = 1; port <= 200; ++port) {
    sender.send({IpAddress::v4(127, 0, 0, 3), port}, event, {&slice, 1}, nullptr, {.segment_bytes = 320});
  }
  EXPECT_EQ(sender.counters().messages, 200U);
  EXPECT_EQ(sender.counters().datagrams, 2000U);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageSenderTest, KeepsWhatWaitsForAReceiverWhenManyOthersCome) {
  const auto payload = numbers(1600);
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr,
              {.segment_bytes = 16, .burst = 99, .separation = 100ms});
  for (std::uint16_t port = 1; port <= 100; ++port) {
    sender.send({IpAddress::v4(127, 0, 0, 3), port}, event, {&slice, 1}, nullptr,
                {.segment_bytes = 160, .burst = 10, .separation = 10s});
  }
  EXPECT_EQ(sender.counters().datagrams, 99U + 1000U) << "each receiver has a burst of its own";
  await_datagrams(100);
  EXPECT_EQ(joined(event), payload);
}

TEST_F(MessageSenderTest, HoldsWhatItSendsOnlyUntilItIsSent) {
  auto payload = std::make_shared<std::vector<std::byte>>(numbers(100'000));
  const std::weak_ptr<std::vector<std::byte>> alive = payload;
  const ByteView slice{*payload};
  sender.send(receiver.local(), event, {&slice, 1}, std::move(payload), slow);
  EXPECT_FALSE(alive.expired());
  await_datagrams(72);
  EXPECT_TRUE(alive.expired());
}

TEST_F(MessageSenderTest, CopiesWhatHasToWaitWhenNobodyKeepsItAlive) {
  auto payload = numbers(100'000);
  const auto original = payload;
  const ByteView slice{payload};
  sender.send(receiver.local(), event, {&slice, 1});
  std::ranges::fill(payload, std::byte{0});
  await_datagrams(72);
  EXPECT_EQ(joined(event), original);
}

// The first burst ends within a piece.
TEST_F(MessageSenderTest, CopiesWhatIsLeftOfPiecesAfterTheFirstBurst) {
  auto payload = numbers(10'000);
  const auto original = payload;
  for (const std::size_t burst : {1U, 10U, 60U, 62U}) {
    arrived.clear();
    payload = original;
    {
      std::vector<ByteView> slices;
      for (std::size_t at = 0; at < payload.size(); at += 300) {
        slices.push_back(ByteView{payload}.subspan(at, std::min<std::size_t>(300, payload.size() - at)));
        slices.emplace_back();
      }
      const std::uint64_t before = sender.counters().datagrams;
      EXPECT_TRUE(sender.send(receiver.local(), event, slices, nullptr,
                              {.segment_bytes = 160, .burst = burst, .separation = 1us}));
      EXPECT_EQ(sender.counters().datagrams - before, burst);
    }
    std::ranges::fill(payload, std::byte{0});
    await_datagrams(63);
    EXPECT_EQ(joined(event), original);
  }
}

TEST_F(MessageSenderTest, NeedsNoCopyOfWhatLeavesAtOnce) {
  auto payload = numbers(20'000);
  const auto original = payload;
  const ByteView slice{payload};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}));
  EXPECT_TRUE(sender.idle());
  std::ranges::fill(payload, std::byte{0});
  await_datagrams(15);
  EXPECT_EQ(joined(event), original);
}

// While a message leaves from memory that is the caller's, one before it ends, whose owner sends a third.
TEST_F(MessageSenderTest, CopiesWhatIsSentWhileAnotherLeaves) {
  const TpPacing pacing{.segment_bytes = 16, .burst = 60, .separation = 1us};
  const auto send = [&](std::uint16_t session, std::vector<std::byte> payload,
                        std::shared_ptr<const void> owner) {
    Header header = event;
    header.session = SessionId{session};
    const ByteView slice{payload};
    EXPECT_TRUE(sender.send(receiver.local(), header, {&slice, 1}, std::move(owner), pacing));
    std::ranges::fill(payload, std::byte{0});
  };
  const auto kept = numbers(16 * 100);
  const auto second = numbers(16 * 101);
  const auto third = numbers(16 * 102);
  {
    Header header = event;
    header.session = SessionId{1};
    const ByteView slice{kept};
    const std::shared_ptr<const void> owner{&kept, [&](const void*) { send(3, third, nullptr); }};
    EXPECT_TRUE(sender.send(receiver.local(), header, {&slice, 1}, owner, pacing));
  }
  EXPECT_EQ(sender.counters().messages, 0U);
  send(2, second, nullptr);
  EXPECT_EQ(sender.counters().messages, 1U);
  await_datagrams(303);
  EXPECT_EQ(payload_of(SessionId{1}), kept);
  EXPECT_EQ(payload_of(SessionId{2}), second);
  EXPECT_EQ(payload_of(SessionId{3}), third);
}

TEST_F(MessageSenderTest, CanBeDestroyedByTheOwnerOfAMessageWhileAnotherLeaves) {
  const auto payload = numbers(16 * 100);
  const ByteView slice{payload};
  const TpPacing pacing{.segment_bytes = 16, .burst = 60, .separation = 1us};
  auto brief = std::make_unique<MessageSender>(io, socket);
  brief->send(receiver.local(), event, {&slice, 1},
              std::shared_ptr<const void>{&payload, [&](const void*) { brief.reset(); }}, pacing);
  brief->send(receiver.local(), event, {&slice, 1}, nullptr, pacing);
  EXPECT_EQ(brief, nullptr);
  await_datagrams(100);
  io.run_for(5ms);
  EXPECT_EQ(arrived.size(), 100U);
}

TEST_F(MessageSenderTest, KeepsTheOrderOfOneEventAndLetsOthersPass) {
  const auto large = numbers(100'000);
  const ByteView slice{large};
  Header other = event;
  other.method = MethodId{0x8002};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, slow);
  sender.send(receiver.local(), event, {});
  sender.send(receiver.local(), other, {});
  EXPECT_EQ(sender.counters().datagrams, 49U);  // the first burst, and the other event
  await_datagrams(74);
  EXPECT_EQ(arrival(48).header, other);
  EXPECT_EQ(arrival(73).header, event);
}

TEST_F(MessageSenderTest, DropsAndCountsWhatWouldOverfillTheQueue) {
  const auto large = numbers(700'000);
  const ByteView slice{large};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}));
  EXPECT_FALSE(sender.send(receiver.local(), event, {&slice, 1}));
  EXPECT_EQ(sender.counters().queue_full, 1U);
  await_datagrams(503);
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}));
}

// The first message to a receiver that is slow has begun to leave, and the newest one waits behind it.
TEST_F(MessageSenderTest, DropsForASlowReceiverWhatANewerOneOvertakes) {
  const auto payload = numbers(5 * 1392);
  const ByteView slice{payload};
  const TpPacing hours{.burst = 2, .separation = 1h};
  std::size_t alive = 0;
  const WaitRule rule{.most = 1};
  for (std::uint16_t i = 1; i <= 4; ++i) {
    Header header = event;
    header.session = SessionId{i};
    const Room room = sender.make_room(receiver.local(), header, rule);
    EXPECT_TRUE(room.granted);
    EXPECT_EQ(room.dropped, i < 3 ? 0U : 1U) << i;
    ++alive;
    const std::shared_ptr<const void> owner{&alive, [&](const void*) { --alive; }};
    EXPECT_TRUE(sender.send(receiver.local(), header, {&slice, 1}, owner, hours));
  }
  EXPECT_EQ(alive, 2U) << "the first and the last";
  EXPECT_EQ(sender.counters().overtaken, 2U);
  EXPECT_EQ(sender.counters().queue_full, 0U);
  EXPECT_FALSE(sender.make_room(receiver.local(), event, {.most = 1, .keep_oldest = true}).granted);
  EXPECT_EQ(sender.counters().overtaken, 3U);
  EXPECT_EQ(alive, 2U);
  sender.close();
  EXPECT_EQ(alive, 0U);
}

// Whose owner sends another one then.
TEST_F(MessageSenderTest, SendsOnWhenAMessageThatGaveWayBringsForthAnother) {
  const auto payload = numbers(5 * 1392);
  const ByteView slice{payload};
  const TpPacing hours{.burst = 2, .separation = 1h};
  UdpSocket other{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  std::size_t brought = 0;
  const auto owner = [&]() -> std::shared_ptr<const void> {
    return {&brought, [&](const void*) {
              if (++brought == 1) {
                EXPECT_TRUE(sender.send(other.local(), event, {&slice, 1}, nullptr, slow));
              }
            }};
  };
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}, owner(), hours));
  EXPECT_TRUE(sender.send(receiver.local(), event, {&slice, 1}, owner(), hours));
  EXPECT_EQ(sender.make_room(receiver.local(), event, {.most = 1}).dropped, 1U);
  EXPECT_EQ(brought, 1U);
  EXPECT_EQ(sender.counters().datagrams, 2U + 5U);
  sender.close();
}

TEST_F(MessageSenderTest, CountsWhatTheSystemRefuses) {
  const Endpoint nowhere{IpAddress::v4(255, 255, 255, 255), 9};  // broadcast needs a permission it has not
  EXPECT_FALSE(sender.send(nowhere, event, {}));
  const auto large = numbers(100'000);
  const ByteView slice{large};
  sender.send(nowhere, event, {&slice, 1});
  EXPECT_EQ(sender.counters().refused, 2U);
  EXPECT_EQ(sender.counters().datagrams, 0U);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageSenderTest, CountsWhatItNoLongerSendsOnceItIsClosed) {
  const auto large = numbers(100'000);
  const ByteView slice{large};
  sender.send(receiver.local(), event, {&slice, 1}, nullptr, slow);
  sender.send(receiver.local(), event, {});
  sender.close();
  EXPECT_TRUE(sender.idle());
  EXPECT_FALSE(sender.send(receiver.local(), event, {}));
  EXPECT_EQ(sender.counters().abandoned, 3U);
  EXPECT_EQ(sender.counters().messages, 0U);
  await_datagrams(48);
  io.run_for(20ms);
  EXPECT_EQ(arrived.size(), 48U);
}

TEST_F(MessageSenderTest, CanBeDestroyedWhileMessagesWait) {
  auto payload = std::make_shared<std::vector<std::byte>>(numbers(100'000));
  const std::weak_ptr<std::vector<std::byte>> alive = payload;
  const ByteView slice{*payload};
  {
    MessageSender brief{io, socket};
    brief.send(receiver.local(), event, {&slice, 1}, std::move(payload), slow);
  }
  await_datagrams(48);
  io.run_for(20ms);
  EXPECT_TRUE(alive.expired());
  EXPECT_EQ(arrived.size(), 48U);
}

// --- Several messages in one datagram ---------------------------------------------------------------------

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
      await_datagrams(2);
      break;
    }
    await_datagrams(3);
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

// A link whose hosts answer to ARP when a test says so.
TEST_F(MessageSenderTest, KeepsWhatIsForAHostThatHasNotAnsweredToItsAddress) {
  Neighbours::Answer answer = Neighbours::Answer::unasked;
  std::vector<Endpoint> gone;
  sender.watch_link({.answer_of = [&](const IpAddress&) { return answer; },
                     .unreachable = [&](const Endpoint& one) { gone.push_back(one); }});
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(100);
  const ByteView view{payload};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_EQ(sender.counters().datagrams, 0U);
  answer = Neighbours::Answer::awaited;
  io.run_for(300ms);
  EXPECT_EQ(sender.counters().datagrams, 0U);
  EXPECT_FALSE(sender.idle());
  answer = Neighbours::Answer::came;
  await_datagrams(2);
  EXPECT_TRUE(sender.idle());
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_TRUE(sender.idle()) << "it is known now";
  EXPECT_TRUE(gone.empty());
}

TEST_F(MessageSenderTest, SendsToAHostForWhichTheSystemDoesNotAskHere) {
  sender.watch_link({.answer_of = [](const IpAddress&) { return Neighbours::Answer::unasked; },
                     .unreachable = [](const Endpoint&) { FAIL() << "nobody knows"; }});
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(100);
  const ByteView view{payload};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_FALSE(sender.idle());
  await_datagrams(1);
  EXPECT_TRUE(sender.idle());
}

TEST_F(MessageSenderTest, GivesUpAHostThatDoesNotAnswerToItsAddress) {
  std::vector<Endpoint> gone;
  const Endpoint silent{IpAddress::v4(127, 0, 0, 77), 4000};
  sender.watch_link({.answer_of =
                         [&](const IpAddress& host) {
                           return host == silent.address ? Neighbours::Answer::awaited
                                                         : Neighbours::Answer::untold;
                         },
                     .unreachable = [&](const Endpoint& one) { gone.push_back(one); }});
  sender.meet(silent);
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(5000);
  const ByteView view{payload};
  EXPECT_TRUE(sender.send(silent, event, {&view, 1}));
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  await_datagrams(4);
  EXPECT_FALSE(sender.idle()) << "nobody else waits for the silent one";
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (gone.empty() && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_EQ(gone, std::vector<Endpoint>{silent});
  EXPECT_TRUE(sender.idle());
  EXPECT_EQ(sender.counters().refused, 1U);
  EXPECT_EQ(sender.counters().datagrams, 4U);
}

TEST_F(MessageSenderTest, KeepsNothingForAHostThatHasGoneBeforeItAnswered) {
  sender.watch_link({.answer_of = [](const IpAddress&) { return Neighbours::Answer::awaited; },
                     .unreachable = [](const Endpoint&) { FAIL() << "it has gone by itself"; }});
  const auto kept = std::make_shared<int>();
  sender.meet(receiver.local());
  EXPECT_TRUE(sender.send(receiver.local(), event, {}, kept));
  EXPECT_TRUE(sender.send(receiver.local(), event, {}));
  EXPECT_EQ(kept.use_count(), 2);
  sender.part(receiver.local());
  EXPECT_EQ(kept.use_count(), 1);
  EXPECT_TRUE(sender.idle());
  EXPECT_EQ(sender.counters().refused, 2U);
  sender.part(receiver.local());
  EXPECT_TRUE(sender.send(receiver.local(), event, {})) << "as to anybody else";
  await_datagrams(1);
}

// Hosts that have asked for something, or in whose name somebody did.
class GreetingTest : public MessageSenderTest {
 protected:
  GreetingTest() {
    sender.watch_link({.answer_of = [this](const IpAddress& host) { return answer_of(host); },
                       .entry_of =
                           [this](const IpAddress& host) {
                             ++looks;
                             return answer_of(host);
                           },
                       .unreachable = [this](const Endpoint& one) { gone.push_back(one); }});
  }
  [[nodiscard]] Neighbours::Answer answer_of(const IpAddress& host) const {
    return host.bytes[1] == 1 ? Neighbours::Answer::awaited : here;
  }
  static Endpoint silent(unsigned i) {
    return {IpAddress::v4(127, 1, 0, static_cast<std::uint8_t>(i + 1)), 4000};
  }
  bool answer(const Endpoint& to, std::size_t bytes) {
    const ByteView view = ByteView{payload}.first(bytes);
    return sender.greet(to) && sender.send(to, event, {&view, 1});
  }

  Neighbours::Answer here = Neighbours::Answer::came;
  int looks = 0;
  std::vector<Endpoint> gone;
  const std::vector<std::byte> payload = numbers(5000);
};

TEST_F(GreetingTest, LooksForAHostThatIsKnownOnlyNowAndThen) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(answer(receiver.local(), 100));
  }
  EXPECT_LE(looks, 1 + (std::chrono::steady_clock::now() - begin) / 1s);
  await_datagrams(100);
  EXPECT_TRUE(sender.idle());
}

TEST_F(GreetingTest, SendsOneDatagramToAHostThatHasNotAnswered) {
  here = Neighbours::Answer::awaited;
  EXPECT_TRUE(answer(receiver.local(), 100));
  EXPECT_TRUE(answer(receiver.local(), 200));
  EXPECT_EQ(sender.counters().datagrams, 1U) << "so that the system asks";
  EXPECT_FALSE(sender.idle());
  here = Neighbours::Answer::came;
  await_datagrams(2);
  EXPECT_TRUE(sender.idle());
  EXPECT_THAT(gone, testing::IsEmpty());
}

TEST_F(GreetingTest, SendsOneSegmentOfALargeMessage) {
  here = Neighbours::Answer::unasked;
  EXPECT_TRUE(answer(receiver.local(), 5000));
  EXPECT_EQ(sender.counters().datagrams, 1U);
  here = Neighbours::Answer::came;
  await_datagrams(4);
  EXPECT_TRUE(sender.idle());
}

TEST_F(GreetingTest, LetsNoMoreThanAFewSilentHostsWait) {
  unsigned waiting = 0;
  for (unsigned i = 0; i < 200; ++i) {
    waiting += answer(silent(i), 100) ? 1 : 0;
  }
  EXPECT_EQ(waiting, MessageSender::max_silent);
  EXPECT_EQ(sender.counters().datagrams, MessageSender::max_silent) << "one each";
  unsigned more = 0;
  for (unsigned i = 0; i < 200; ++i) {
    more += answer(silent(0), 100) ? 1 : 0;
  }
  EXPECT_EQ(more, MessageSender::max_for_silent);
  EXPECT_TRUE(answer(receiver.local(), 100)) << "who is known does not wait";
  EXPECT_EQ(sender.counters().datagrams, MessageSender::max_silent + 1);
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (gone.size() < MessageSender::max_silent && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_EQ(gone.size(), MessageSender::max_silent);
  EXPECT_TRUE(sender.idle());
  EXPECT_TRUE(answer(silent(100), 100)) << "their places are free";
}

}  // namespace
}  // namespace trestle::someip::message_sender_test
