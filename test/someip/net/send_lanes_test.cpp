// What waits to be sent, without sockets.
#include "someip/net/send_lanes.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::send_lanes_test {
namespace {

using testing::ElementsAre;
using namespace std::chrono_literals;

constexpr TimePoint start{1000s};

Endpoint receiver(std::uint16_t port) {
  return {IpAddress::v4(10, 0, 0, 2), port};
}

Header header(std::uint16_t service, std::uint16_t method) {
  return {.service = ServiceId{service}, .method = MethodId{method}};
}

class SendLanesTest : public testing::Test {
 protected:
  PendingMessage* add(const Endpoint& to, const std::vector<std::byte>& payload, bool keep = false) {
    const ByteView view{payload};
    return lanes.add(to, {&view, 1}, payload.size(), keep);
  }
  SendLane& lane(const Endpoint& to) { return *std::ranges::find(lanes.all(), to, &SendLane::to); }
  /// A burst to this receiver, which is remembered; nothing waits.
  void burst(const Endpoint& to, TimePoint now) {
    ASSERT_NE(add(to, {}), nullptr);
    ASSERT_EQ(lane(to).pace.room(pacing, now), 10U) << "a new receiver";
    lane(to).pace.sent(10);
    lanes.finish(lane(to));
  }
  std::size_t room_for(const Endpoint& to, TimePoint now) {
    EXPECT_NE(add(to, {}), nullptr);
    const std::size_t room = lane(to).pace.room(pacing, now);
    lanes.finish(lane(to));
    return room;
  }

  const TpPacing pacing{.burst = 10, .separation = 10s};
  std::optional<SendLanes> all{std::in_place, 1U << 20U};
  SendLanes& lanes = *all;  // anew with all.emplace()
};

TEST_F(SendLanesTest, TakeBytesFromSlicesOfAnySize) {
  const auto bytes = test::hex("0102030405060708090a");
  const ByteView all{bytes};
  const std::vector<ByteView> slices{all.first(3), {}, all.subspan(3, 1), all.subspan(4)};
  SliceCursor cursor;
  const auto next = [&](std::size_t count) {
    std::vector<ByteView> pieces;
    take(slices, cursor, count, pieces);
    std::vector<std::string> result;
    for (const ByteView piece : pieces) {
      result.push_back(test::to_hex(piece));
    }
    return result;
  };
  EXPECT_THAT(next(2), ElementsAre("0102"));
  EXPECT_THAT(next(3), ElementsAre("03", "04", "05"));
  EXPECT_THAT(next(0), ElementsAre());
  EXPECT_THAT(next(5), ElementsAre("060708090a"));
}

TEST_F(SendLanesTest, HoldBackWhatWouldOvertakeItsLike) {
  ASSERT_NE(add(receiver(1), {}), nullptr);
  lane(receiver(1)).queue.back().header = header(0x1234, 0x8001);
  EXPECT_TRUE(lanes.must_wait(receiver(1), header(0x1234, 0x8001)));
  EXPECT_FALSE(lanes.must_wait(receiver(1), header(0x1234, 0x8002)));
  EXPECT_FALSE(lanes.must_wait(receiver(1), header(0x4321, 0x8001))) << "of another service";
  EXPECT_FALSE(lanes.must_wait(receiver(2), header(0x1234, 0x8001)));
  // In a datagram with several messages may be any.
  ASSERT_NE(add(receiver(1), {}), nullptr);
  lane(receiver(1)).queue.back().datagram = true;
  EXPECT_TRUE(lanes.must_wait(receiver(1), header(0x4321, 0x8001)));
  EXPECT_FALSE(lanes.must_wait(receiver(2), header(0x4321, 0x8001)));
}

TEST_F(SendLanesTest, GiveAwayNoLaneInWhichSomethingWaits) {
  const auto payload = test::hex("0102");
  ASSERT_NE(add(receiver(1), payload), nullptr);
  for (std::uint16_t port = 2; port <= 100; ++port) {
    burst(receiver(port), start + std::chrono::seconds{port});
  }
  ASSERT_EQ(lane(receiver(1)).queue.size(), 1U);
  EXPECT_EQ(test::to_hex(lane(receiver(1)).queue.front().slices.front()), "0102");
  EXPECT_EQ(lanes.all().size(), 64U);
}

TEST_F(SendLanesTest, ForgetTheBurstThatIsTheLongestAgo) {
  for (std::uint16_t port = 1; port <= 64; ++port) {
    burst(receiver(port), start + std::chrono::milliseconds{port});
  }
  // Another one has a pace of its own, in the place of the first.
  burst(receiver(65), start + 65ms);
  EXPECT_EQ(lanes.all().size(), 64U);
  for (std::uint16_t port = 2; port <= 65; ++port) {
    EXPECT_EQ(room_for(receiver(port), start + 1s), 0U) << port;
  }
  EXPECT_EQ(room_for(receiver(1), start + 1s), 10U);
}

TEST_F(SendLanesTest, GrowWithThoseForWhomSomethingWaits) {
  for (std::uint16_t port = 1; port <= 200; ++port) {
    ASSERT_NE(add(receiver(port), test::hex("01")), nullptr);
  }
  EXPECT_EQ(lanes.all().size(), 200U);
  EXPECT_EQ(lanes.clear(), 200U);
}

TEST_F(SendLanesTest, ReuseThePlacesOfMessagesWithoutTheirBytes) {
  const auto first = test::hex("0102030405");
  const auto second = test::hex("0a0b");
  PendingMessage* const place = add(receiver(1), first);
  ASSERT_NE(place, nullptr);
  EXPECT_EQ(place->slices.at(0).data(), first.data()) << "where it lies";
  SendLanes::own(*place);
  EXPECT_EQ(test::to_hex(place->slices.at(0)), "0102030405");
  EXPECT_NE(place->slices.at(0).data(), first.data()) << "a copy";
  lanes.finish(lane(receiver(1)));
  ASSERT_EQ(add(receiver(1), second), place) << "its place again";
  SendLanes::own(*place);
  ASSERT_EQ(place->slices.size(), 1U);
  EXPECT_EQ(test::to_hex(place->slices[0]), "0a0b");
  lanes.finish(lane(receiver(1)));
  ASSERT_EQ(add(receiver(1), second, true), place);
  EXPECT_EQ(place->slices.at(0).data(), second.data());
  EXPECT_EQ(place->copy.capacity(), 0U) << "somebody keeps it";
}

TEST_F(SendLanesTest, OwnWhatIsLeftOfAMessage) {
  const auto bytes = test::hex("0102030405060708090a");
  const ByteView all{bytes};
  const std::vector<ByteView> parts{all.first(3), {}, all.subspan(3, 4), all.subspan(7)};
  PendingMessage* const place = lanes.add(receiver(1), parts, bytes.size(), false);
  ASSERT_NE(place, nullptr);
  std::vector<ByteView> taken;
  take(place->slices, place->cursor, 5, taken);
  SendLanes::own(*place);
  ASSERT_EQ(place->slices.size(), 1U);
  EXPECT_EQ(test::to_hex(place->slices[0]), "060708090a");
  taken.clear();
  take(place->slices, place->cursor, 5, taken);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].data(), place->slices[0].data()) << "the cursor is at the front of it";
}

TEST_F(SendLanesTest, UseTheMemoryOfLargeCopiesAgain) {
  const std::vector<std::byte> large(500'000);
  PendingMessage* const first = add(receiver(1), large);
  ASSERT_NE(first, nullptr);
  const std::byte* const memory = first->copy.data();
  // The place goes to a small message, and the memory to a large one.
  lanes.finish(lane(receiver(1)));
  ASSERT_EQ(add(receiver(1), test::hex("01")), first);
  EXPECT_NE(first->copy.data(), memory);
  PendingMessage* const second = add(receiver(1), large);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(second->copy.data(), memory);
}

TEST_F(SendLanesTest, TakeNoMoreThanMayWait) {
  all.emplace(1000);
  EXPECT_EQ(add(receiver(1), std::vector<std::byte>(1001)), nullptr);
  EXPECT_TRUE(lanes.empty());
  ASSERT_NE(add(receiver(1), std::vector<std::byte>(1000)), nullptr);
  lane(receiver(1)).queue.front().begun = true;
  EXPECT_EQ(add(receiver(2), std::vector<std::byte>(1)), nullptr);
  lanes.finish(lane(receiver(1)));
  ASSERT_NE(add(receiver(1), std::vector<std::byte>(1000)), nullptr);
  EXPECT_EQ(lanes.clear(), 1U);
  ASSERT_NE(add(receiver(1), std::vector<std::byte>(1000)), nullptr);
}

// A receiver that takes nothing has filled what may wait.
TEST_F(SendLanesTest, MakeTheOneForWhomTheMostWaitsGiveWay) {
  all.emplace(100'000);
  const std::vector<std::byte> payload(10'000);
  PendingMessage* const begun = add(receiver(1), payload);
  ASSERT_NE(begun, nullptr);
  begun->begun = true;
  PendingMessage* const oldest = add(receiver(1), payload);
  ASSERT_NE(oldest, nullptr);
  bool let_go = false;
  oldest->keep_alive = std::shared_ptr<const void>{&let_go, [&](const void*) { let_go = true; }};
  while (lanes.gave_way() == 0 && lane(receiver(1)).queue.size() < 20) {
    if (add(receiver(1), payload) == nullptr) {
      break;
    }
  }
  const std::size_t full = lane(receiver(1)).queue.size();
  EXPECT_EQ(lanes.gave_way(), 0U) << "nothing of one's own gives way";
  EXPECT_LT(full, 11U);

  ASSERT_NE(add(receiver(2), payload), nullptr);
  EXPECT_EQ(lanes.gave_way(), 1U);
  EXPECT_EQ(lane(receiver(1)).queue.size(), full - 1);
  EXPECT_EQ(&lane(receiver(1)).queue.front(), begun) << "it has begun to leave";
  EXPECT_FALSE(let_go) << "not before the new one has its place";
  ASSERT_TRUE(lanes.some_gave_way());
  lanes.let_go();
  EXPECT_TRUE(let_go);
  EXPECT_FALSE(lanes.some_gave_way());

  // In the end both have the same.
  std::size_t more = 1;
  while (add(receiver(2), payload) != nullptr) {
    ++more;
  }
  EXPECT_LE(lane(receiver(1)).queue.size(), more + 1);
  EXPECT_GE(lane(receiver(1)).queue.size() + 1, more);
}

// Each of them has less than the new message.
TEST_F(SendLanesTest, GiveAnAddressWithManyReceiversNoMoreThanOneWithOne) {
  all.emplace(200'000);
  const Endpoint other{IpAddress::v4(10, 0, 0, 3), 1};
  const std::vector<std::byte> little(8'000);
  std::uint16_t crowd = 0;
  while (crowd < 100 && add(receiver(static_cast<std::uint16_t>(crowd + 1)), little) != nullptr) {
    ++crowd;
  }
  EXPECT_LT(crowd, 100) << "there is an end";
  EXPECT_EQ(lanes.gave_way(), 0U) << "all of the address have the same";
  const std::vector<std::byte> much(30'000);
  std::size_t taken = 0;
  while (taken < 10 && add(other, much) != nullptr) {
    ++taken;
  }
  EXPECT_EQ(taken, 3U) << "half of all";
  EXPECT_GE(lanes.gave_way(), 10U);
  while (add(receiver(1000), little) != nullptr) {
    ASSERT_LT(lane(receiver(1000)).queue.size(), 3U)
        << "a new one of the same address takes nothing of the other";
  }
  EXPECT_EQ(lane(other).queue.size(), 3U);
}

TEST_F(SendLanesTest, CountWhatWaitsForTheAddressThatTakesOverALane) {
  all.emplace(64'000);
  for (std::uint16_t port = 1; port <= 64; ++port) {
    burst(receiver(port), start + std::chrono::seconds{port});
  }
  const Endpoint other{IpAddress::v4(10, 0, 0, 3), 1};
  const std::vector<std::byte> payload(10'000);
  while (add(other, payload) != nullptr) {
  }
  EXPECT_EQ(lanes.all().size(), 64U);
  const SendLane& its = lane(other);
  EXPECT_EQ(its.share->bytes, its.bytes);
  EXPECT_EQ(its.share->lanes, 1U);
  EXPECT_EQ(lane(receiver(2)).share->lanes, 63U);
  EXPECT_EQ(lane(receiver(2)).share->bytes, 0U);
  EXPECT_NE(add(receiver(2), payload), nullptr);
  EXPECT_EQ(lanes.gave_way(), 1U);
}

TEST_F(SendLanesTest, MakeTheOldestOfAnEventGiveWayToANewOneByItsRule) {
  const Header of_event = header(0x1234, 0x8001);
  const auto put = [&](const Header& what) {
    PendingMessage* const place = add(receiver(1), test::hex("01"));
    place->header = what;
    return place;
  };
  const WaitRule rule{.most = 2};
  EXPECT_TRUE(lanes.make_room(receiver(1), of_event, rule).granted);
  put(of_event)->begun = true;
  PendingMessage* const other = put(header(0x1234, 0x8002));
  put(of_event);
  EXPECT_EQ(lanes.make_room(receiver(1), of_event, rule).dropped, 0U) << "only one waits";
  PendingMessage* const second = put(of_event);
  EXPECT_EQ(lanes.make_room(receiver(2), of_event, rule).dropped, 0U) << "of another receiver";
  EXPECT_EQ(lanes.make_room(receiver(1), of_event, {.most = 3}).dropped, 0U);
  EXPECT_EQ(lanes.make_room(receiver(1), of_event, {}).dropped, 0U) << "no limit";

  Room room = lanes.make_room(receiver(1), of_event, {.most = 2, .keep_oldest = true});
  EXPECT_FALSE(room.granted);
  EXPECT_EQ(room.dropped, 1U);
  EXPECT_EQ(lane(receiver(1)).queue.size(), 4U);

  room = lanes.make_room(receiver(1), of_event, rule);
  EXPECT_TRUE(room.granted);
  EXPECT_EQ(room.dropped, 1U);
  lanes.let_go();
  ASSERT_EQ(lane(receiver(1)).queue.size(), 3U);
  EXPECT_TRUE(lane(receiver(1)).queue.front().begun);
  EXPECT_EQ(&*std::next(lane(receiver(1)).queue.begin()), other);
  EXPECT_EQ(&lane(receiver(1)).queue.back(), second);
}

// Somebody subscribes in the name of hosts that are not there: their old clouds would fill the memory.
TEST_F(SendLanesTest, KeepOneLargeMessageOfAnEventForAHostThatIsNotThere) {
  const Header of_event = header(0x1234, 0x8001);
  const std::vector<std::byte> large(max_plain_payload_bytes + 1);
  const auto put = [&](const std::vector<std::byte>& payload) {
    PendingMessage* const place = add(receiver(1), payload);
    place->header = of_event;
    return place;
  };
  lanes.await_host(receiver(1), {});
  put(test::hex("01"));
  put(large)->begun = true;  // by the datagram that asks for the host
  const WaitRule rule{.most = 10};
  const Room oldest = lanes.make_room(receiver(1), of_event, {.most = 10, .keep_oldest = true});
  EXPECT_FALSE(oldest.granted);
  EXPECT_EQ(oldest.dropped, 1U);
  EXPECT_EQ(lanes.make_room(receiver(1), header(0x1234, 0x8002), rule).dropped, 0U) << "another event";
  const Room room = lanes.make_room(receiver(1), of_event, rule);
  EXPECT_TRUE(room.granted);
  EXPECT_EQ(room.dropped, 1U);
  lanes.let_go();
  ASSERT_EQ(lane(receiver(1)).queue.size(), 1U) << "small ones wait by the rule";
  put(large)->lent = true;
  EXPECT_EQ(lanes.make_room(receiver(1), of_event, rule).dropped, 0U) << "the caller's memory is being sent";

  lane(receiver(1)).host.reset();  // it has answered
  put(large);
  EXPECT_EQ(lanes.make_room(receiver(1), of_event, rule).dropped, 0U);
}

TEST_F(SendLanesTest, GiveNoPlaceOfOthersToHostsThatAreNotThere) {
  const std::vector<std::byte> half(std::size_t{500} << 10U);
  const Endpoint silent{IpAddress::v4(10, 0, 0, 3), 1};
  lanes.await_host(silent, {});
  ASSERT_NE(add(silent, half), nullptr);
  lane(silent).queue.front().begun = true;
  ASSERT_NE(add(receiver(2), half), nullptr);
  ASSERT_NE(add(receiver(2), half), nullptr) << "that of the silent host has given way, which has less";
  EXPECT_EQ(lanes.gave_way(), 1U);
  lanes.let_go();
  EXPECT_TRUE(lane(silent).queue.empty());
  EXPECT_EQ(add(silent, half), nullptr);
}

// Answers, say, of which somebody takes none.
TEST_F(SendLanesTest, LookThroughNoMoreMessagesThanIsQuick) {
  const Header of_event = header(0x1234, 0x8001);
  for (std::size_t i = 0; i <= max_looked_through; ++i) {
    ASSERT_NE(add(receiver(1), {}), nullptr);
  }
  EXPECT_FALSE(lanes.make_room(receiver(1), of_event, {.most = 2}).granted);
}

// Who asks us much that is answered with nothing, while a large answer of the same kind is on its way.
TEST_F(SendLanesTest, TakeNoMessagesWithoutPayloadWithoutEnd) {
  std::size_t taken = 0;
  while (taken < 100'000 && add(receiver(1), {}) != nullptr) {
    ++taken;
  }
  EXPECT_GT(taken, 1000U);
  EXPECT_LT(taken * sizeof(PendingMessage), 2U << 20U);
}

TEST_F(SendLanesTest, LetGoOfTheOwnerLast) {
  const std::shared_ptr<int> number = std::make_shared<int>(7);
  bool empty_then = false;
  bool taken_then = false;
  const auto second = test::hex("02");
  PendingMessage* const place = add(receiver(1), test::hex("01"));
  ASSERT_NE(place, nullptr);
  place->keep_alive = std::shared_ptr<const void>{number.get(), [&](const void*) {
                                                    empty_then = lanes.empty();
                                                    taken_then = add(receiver(1), second) == place;
                                                  }};
  lanes.finish(lane(receiver(1)));
  EXPECT_TRUE(empty_then);
  EXPECT_TRUE(taken_then) << "also its place is free already";
  EXPECT_EQ(test::to_hex(place->slices.at(0)), "02");
}

TEST_F(SendLanesTest, CountTheMessagesThatAreDropped) {
  ASSERT_NE(add(receiver(1), test::hex("01")), nullptr);
  PendingMessage* const datagram = add(receiver(2), test::hex("02"));
  ASSERT_NE(datagram, nullptr);
  datagram->messages = 3;
  EXPECT_EQ(lanes.clear(), 4U);
  EXPECT_TRUE(lanes.empty());
  EXPECT_EQ(lanes.clear(), 0U);
}

TEST_F(SendLanesTest, AreFullOnlyForWhomNobodyGivesWay) {
  const std::vector<std::byte> most(900'000);
  const std::vector<std::byte> some(300'000);
  EXPECT_FALSE(lanes.is_full_for(receiver(1), most.size()));
  ASSERT_NE(add(receiver(1), most), nullptr);
  EXPECT_TRUE(lanes.is_full_for(receiver(1), some.size()));
  EXPECT_FALSE(lanes.is_full_for(receiver(1), 100'000));
  EXPECT_FALSE(lanes.is_full_for(receiver(1), (1U << 20U) + 1)) << "there never is room for so much";
  EXPECT_FALSE(lanes.is_full_for(receiver(2), some.size())) << "the other one has more";
  lane(receiver(1)).queue.front().begun = true;
  EXPECT_TRUE(lanes.is_full_for(receiver(2), some.size())) << "what has begun to leave gives no way";
  EXPECT_EQ(add(receiver(2), some), nullptr);
  lanes.finish(lane(receiver(1)));
  EXPECT_FALSE(lanes.is_full_for(receiver(1), some.size()));
  EXPECT_FALSE(lanes.is_full_for(receiver(2), some.size()));
  EXPECT_EQ(lanes.gave_way(), 0U) << "asking changes nothing";
}

}  // namespace
}  // namespace trestle::someip::send_lanes_test
