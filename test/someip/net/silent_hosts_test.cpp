// A link whose hosts answer to ARP when a test says so.
#include <gmock/gmock.h>

#include <thread>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/net/message_sender_fixture.hpp"

namespace trestle::someip::message_sender_test {
namespace {

using test::covers;

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

// The answer to its subscription has not left, so nobody has asked for it yet.
TEST_F(MessageSenderTest, SendsOneDatagramToAHostForWhichTheSystemHasNotAsked) {
  const auto answer_of = [&](const IpAddress&) {
    return sender.counters().datagrams == 0 ? Neighbours::Answer::unasked : Neighbours::Answer::awaited;
  };
  sender.watch_link({.answer_of = answer_of, .entry_of = answer_of, .unreachable = [](const Endpoint&) {}});
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(5000);
  const ByteView view{payload};
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  }
  EXPECT_EQ(sender.counters().datagrams, 0U);
  await_datagrams(1);
  io.run_for(100ms);
  EXPECT_EQ(sender.counters().datagrams, 1U);
}

// The system forgets a host that has not answered before we do.
TEST_F(MessageSenderTest, SendsNothingToAHostThatTheSystemHasForgotten) {
  Neighbours::Answer answer = Neighbours::Answer::awaited;
  bool gone = false;
  sender.watch_link({.answer_of = [&](const IpAddress&) { return answer; },
                     .unreachable = [&](const Endpoint&) { gone = true; }});
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(100);
  const ByteView view{payload};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  io.run_for(300ms);
  answer = Neighbours::Answer::unasked;
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (!gone && std::chrono::steady_clock::now() < end) {
    io.run_one_for(50ms);
  }
  EXPECT_TRUE(gone);
  EXPECT_EQ(sender.counters().datagrams, 0U);
}

// Nobody looks at it in time, as where the machine stalls: what is just being sent is given up with all else.
// It is more than there are places that are kept for other messages.
TEST_F(MessageSenderTest, GivesUpAHostAsItIsSentMore) {
  std::vector<Endpoint> gone;
  sender.watch_link({.answer_of = [](const IpAddress&) { return Neighbours::Answer::awaited; },
                     .unreachable = [&](const Endpoint& one) { gone.push_back(one); }});
  sender.meet(receiver.local());
  const std::vector<std::byte> payload = numbers(100);
  const ByteView view{payload};
  constexpr std::uint64_t waiting = 500;
  for (std::uint64_t i = 0; i < waiting; ++i) {
    ASSERT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  }
  EXPECT_EQ(sender.counters().datagrams, 0U);
  std::this_thread::sleep_for(MessageSender::patience);
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_EQ(gone, std::vector{receiver.local()});
  EXPECT_EQ(sender.counters().refused, waiting + 1);
  EXPECT_TRUE(sender.idle());
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1})) << "as to anybody else";
  await_datagrams(1);
  EXPECT_EQ(arrival(0).payload.size(), payload.size());
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
  // Every 10 ms after so many messages, and 100 ms after few.
  EXPECT_LE(looks, 1 + (std::chrono::steady_clock::now() - begin) / 10ms);
  await_datagrams(100);
  EXPECT_TRUE(sender.idle());
}

TEST_F(GreetingTest, AsksOnceASecondWhetherSomebodyCanTell) {
  here = Neighbours::Answer::untold;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(answer(receiver.local(), 100));
  }
  EXPECT_LE(looks, 1 + (std::chrono::steady_clock::now() - begin) / 1s);
  await_datagrams(100);
}

// Sends events to it until one is kept.
TEST_F(GreetingTest, KeepsWhatIsForAReceiverThatHasGone) {
  const auto send_event = [this] {
    const ByteView view = ByteView{payload}.first(200);
    EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  };
  send_event();
  await_datagrams(1);
  EXPECT_TRUE(sender.idle());
  here = Neighbours::Answer::awaited;
  std::size_t sent = 1;
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (sender.idle() && std::chrono::steady_clock::now() < end) {
    send_event();
    ++sent;
    sender.flush();
    io.run_for(10ms);
  }
  ASSERT_FALSE(sender.idle()) << "it was looked at only once";
  const std::uint64_t left = sender.counters().datagrams;
  for (int i = 0; i < 10; ++i) {
    send_event();
    io.run_for(10ms);
  }
  EXPECT_EQ(sender.counters().datagrams, left);
  here = Neighbours::Answer::came;
  await_datagrams(sent + 10);
  EXPECT_TRUE(sender.idle());
  EXPECT_THAT(gone, testing::IsEmpty());
}

TEST_F(GreetingTest, GivesUpAReceiverThatHasGoneForGood) {
  const auto begin = std::chrono::steady_clock::now();
  while (gone.empty() && std::chrono::steady_clock::now() < begin + 30s) {
    const ByteView view = ByteView{payload}.first(200);
    static_cast<void>(sender.send(receiver.local(), event, {&view, 1}));
    io.run_for(20ms);
    here = Neighbours::Answer::awaited;
  }
  EXPECT_THAT(gone, testing::ElementsAre(receiver.local()));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, MessageSender::patience);
}

TEST_F(GreetingTest, LooksBeforeEachPartOfALargeMessage) {
  const std::vector<std::byte> large = numbers(300'000);
  const ByteView view{large};
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}, nullptr, {.burst = 1, .separation = 5ms}));
  EXPECT_EQ(sender.counters().datagrams, 1U);
  here = Neighbours::Answer::awaited;
  io.run_for(200ms);
  EXPECT_LE(sender.counters().datagrams, 3U) << "one as it has just been there, one so that the system asks";
  EXPECT_FALSE(sender.idle());
}

TEST_F(GreetingTest, WaitsOnlyOnceForAHostForWhichTheSystemDoesNotAsk) {
  here = Neighbours::Answer::unasked;
  const ByteView view = ByteView{payload}.first(200);
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
  EXPECT_EQ(sender.counters().datagrams, 1U);
  await_datagrams(2);
  for (std::size_t i = 3; i < 20; ++i) {
    EXPECT_TRUE(sender.send(receiver.local(), event, {&view, 1}));
    sender.flush();
    EXPECT_TRUE(sender.idle());
    await_datagrams(i);
    io.run_for(15ms);
  }
  EXPECT_GT(looks, 1);
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
