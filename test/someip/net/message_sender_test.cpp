#include "someip/net/message_sender.hpp"

#include <gmock/gmock.h>

#include <boost/asio/post.hpp>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/net/message_sender_fixture.hpp"

namespace trestle::someip::message_sender_test {
namespace {

using test::covers;

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

// All of them come at once, without pauses: while the sender is busy, as the owner of a message sends them.
TEST_F(MessageSenderTest, AnAddressWithManyReceiversHasOneTurnOfEachRound) {
  const TpPacing at_once{.separation = 0us};
  const auto payload = numbers(std::size_t{200} * tp_default_segment_bytes);
  const ByteView slice{payload};
  UdpSocket own{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  MessageSender busy{io, own};
  std::size_t crowd = 0;
  std::size_t single = 0;
  const auto send_all = [&](const void*) {
    for (std::uint16_t port = 1; port <= 16; ++port) {
      const std::shared_ptr<const void> owner{&crowd, [&](const void*) { ++crowd; }};
      EXPECT_TRUE(busy.send({IpAddress::v4(127, 0, 0, 3), port}, event, {&slice, 1}, owner, at_once));
    }
    const std::shared_ptr<const void> owner{&single, [&](const void*) { ++single; }};
    EXPECT_TRUE(busy.send(receiver.local(), event, {&slice, 1}, owner, at_once));
  };
  const ByteView first = slice.first(std::size_t{2} * tp_default_segment_bytes);
  EXPECT_TRUE(busy.send(receiver.local(), event, {&first, 1}, {&payload, send_all}, at_once));
  EXPECT_EQ(single, 1U) << "it came last, and has an address of its own";
  EXPECT_LT(crowd, 4U);
  const std::uint64_t in_a_row = busy.counters().datagrams;
  EXPECT_LT(in_a_row, 1000U) << "others of this thread have their turn, too";

  // Until then nothing more leaves.
  EXPECT_TRUE(busy.send(receiver.local(), event, {&slice, 1}, nullptr, at_once));
  EXPECT_EQ(busy.counters().datagrams, in_a_row);
  bool between = false;
  boost::asio::post(io, [&] {
    between = !busy.idle();
    EXPECT_EQ(busy.counters().datagrams, in_a_row);
  });
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (!busy.idle() && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_TRUE(between);
  EXPECT_EQ(crowd, 16U);
  EXPECT_EQ(busy.counters().messages, 19U);
  EXPECT_EQ(busy.counters().datagrams, 2U + std::uint64_t{18} * 200);
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

}  // namespace
}  // namespace trestle::someip::message_sender_test
