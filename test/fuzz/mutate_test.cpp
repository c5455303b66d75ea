#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "fuzz/mutate/generate.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::fuzz::mutate_test {
namespace {

constexpr std::size_t max_size = 1400;

const KnownService door{
    .service = 0x1234, .instance = 7, .major = 2, .minor = 5, .methods = {0x21, 0x42}, .eventgroups = {1, 2}};
const Endpoint own{.address = IpAddress::v4(10, 0, 0, 2), .port = 40'000};

TEST(Random, RepeatsItselfAndNothingElse) {
  Random one{5};
  Random same{5};
  Random other{6};
  EXPECT_EQ(one.next(), same.next());
  EXPECT_NE(one.next(), other.next());
  EXPECT_EQ(one.below(0), 0U);
  std::set<std::size_t> seen;
  for (int count = 0; count < 200; ++count) {
    seen.insert(one.below(4));
  }
  EXPECT_EQ(seen, (std::set<std::size_t>{0, 1, 2, 3}));
}

TEST(Generate, MakesRequestsThatAreWhole) {
  Random random{1};
  std::size_t known = 0;
  for (int count = 0; count < 500; ++count) {
    const Bytes request = make_request(door, 100, random);
    const auto message = someip::decode(request);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->size(), request.size());
    EXPECT_EQ(message->header.service, someip::ServiceId{0x1234});
    EXPECT_EQ(message->header.interface_version, 2);
    EXPECT_LE(message->payload.size(), 100U);
    known += static_cast<std::size_t>(std::ranges::count(door.methods, value(message->header.method)));
  }
  EXPECT_GT(known, 400U);
}

TEST(Generate, MakesDiscoveryWithoutFault) {
  Random random{2};
  std::set<sd::EntryKind> kinds;
  for (int count = 0; count < 500; ++count) {
    const Bytes bytes = make_discovery(door, own, random);
    const auto whole = someip::decode(bytes);
    ASSERT_TRUE(whole);
    const auto message = sd::decode(*whole);
    ASSERT_TRUE(message);
    EXPECT_EQ(sd::find_fault(*message), std::nullopt);
    ASSERT_GE(message->entry_count(), 1U);
    for (std::size_t at = 0; at < message->entry_count(); ++at) {
      kinds.insert(message->entry(at).kind());
    }
  }
  EXPECT_EQ(kinds.size(), 7U);  // all but the unknown one
}

TEST(Generate, SubscribesToWhatIsAskedFor) {
  const Bytes bytes = make_subscribe(door, 2, 30, own);
  const auto message = sd::decode(someip::decode(bytes).value()).value();
  ASSERT_EQ(message.entry_count(), 1U);
  const sd::Entry entry = message.entry(0);
  EXPECT_EQ(entry.kind(), sd::EntryKind::subscribe_eventgroup);
  EXPECT_EQ(entry.eventgroup(), someip::EventgroupId{2});
  EXPECT_EQ(entry.instance, someip::InstanceId{7});
  EXPECT_EQ(sd::EndpointOption::decode(message.option_of(entry, 0).value())->endpoint, own);
  const Bytes stop = make_subscribe(door, 2, 0, own);
  EXPECT_EQ(sd::decode(someip::decode(stop).value())->entry(0).kind(),
            sd::EntryKind::stop_subscribe_eventgroup);
}

TEST(Generate, OffersBothTransports) {
  const Bytes bytes = make_offer(door, 3, own);
  const auto message = sd::decode(someip::decode(bytes).value()).value();
  const sd::Entry entry = message.entry(0);
  EXPECT_EQ(entry.kind(), sd::EntryKind::offer_service);
  EXPECT_EQ(entry.minor(), 5U);
  ASSERT_EQ(entry.option_count(), 2U);
  EXPECT_EQ(sd::EndpointOption::decode(message.option_of(entry, 1).value())->transport, Transport::tcp);
}

TEST(Generate, CutsSegmentsThatFitTogether) {
  Random random{3};
  Bytes request = make_request(door, 0, random);
  for (int at = 0; at < 100; ++at) {
    request.push_back(static_cast<std::byte>(at));
  }
  repair_lengths(request);
  const std::vector<Bytes> segments = make_segments(request, 40);  // 32 of them, as 16 divides it
  ASSERT_EQ(segments.size(), 4U);
  Bytes payload;
  for (const Bytes& one : segments) {
    const auto message = someip::decode(one).value();
    EXPECT_EQ(message.size(), one.size());
    const someip::TpView segment = someip::decode_tp(message).value();
    EXPECT_EQ(segment.header.offset, payload.size());
    EXPECT_EQ(segment.header.more, &one != &segments.back());
    payload.insert(payload.end(), segment.slice.begin(), segment.slice.end());
  }
  EXPECT_TRUE(std::ranges::equal(payload, std::span{request}.subspan(16)));
  EXPECT_EQ(make_segments(request, 112).size(), 1U);
}

TEST(Mutate, ChangesNearlyEachMessageAndStaysInItsRoom) {
  Random random{4};
  std::size_t changed = 0;
  for (int count = 0; count < 2'000; ++count) {
    const Bytes before = count % 2 == 0 ? make_discovery(door, own, random) : make_request(door, 64, random);
    Bytes after = before;
    mutate(after, max_size, random);
    EXPECT_LE(after.size(), max_size);
    changed += after == before ? 0U : 1U;
  }
  EXPECT_GT(changed, 1'800U);
}

TEST(Mutate, MostlyLeavesLengthsRight) {
  Random random{5};
  std::size_t whole = 0;
  for (int count = 0; count < 2'000; ++count) {
    Bytes bytes = make_discovery(door, own, random);
    mutate(bytes, max_size, random);
    const auto message = someip::decode(bytes);
    whole += message && (!sd::is_sd(message->header) || sd::decode(*message)) ? 1U : 0U;
  }
  EXPECT_GT(whole, 1'400U);
  EXPECT_LT(whole, 2'000U);  // but not always
}

TEST(Mutate, ReachesEachFieldOfAnEntry) {
  Random random{6};
  const Bytes before = make_subscribe(door, 1, 3, own);
  std::set<std::size_t> places;
  for (int count = 0; count < 5'000; ++count) {
    Bytes after = before;
    mutate(after, max_size, random);
    if (after.size() == before.size()) {
      for (std::size_t at = 0; at < after.size(); ++at) {
        if (after[at] != before[at]) {
          places.insert(at);
        }
      }
    }
  }
  EXPECT_EQ(places.size(), before.size());
}

TEST(Mutate, TakesAnyBytes) {
  Random random{7};
  for (std::size_t size = 0; size < 64; ++size) {
    for (int count = 0; count < 200; ++count) {
      Bytes bytes(size);
      for (std::byte& one : bytes) {
        one = static_cast<std::byte>(random.next());
      }
      if (size >= 16 && count % 2 == 0) {  // as if it were service discovery
        constexpr std::array<unsigned, 4> id{0xff, 0xff, 0x81, 0x00};
        std::ranges::transform(id, bytes.begin(),
                               [](unsigned number) { return static_cast<std::byte>(number); });
      }
      Bytes more = cross_over(bytes, make_discovery(door, own, random), max_size, random);
      mutate(bytes, max_size, random);
      mutate(more, 20, random);
      EXPECT_LE(bytes.size(), max_size);
      EXPECT_LE(more.size(), 20U);
    }
  }
}

TEST(Mutate, WorksInThePlaceThatAFuzzerGives) {
  std::array<std::uint8_t, 64> room{};
  EXPECT_LE(mutate_in_place(room.data(), 0, room.size(), 1), room.size());
  std::array<std::uint8_t, 64> same = room;
  const std::size_t one = mutate_in_place(room.data(), 32, room.size(), 9);
  const std::size_t other = mutate_in_place(same.data(), 32, same.size(), 9);
  EXPECT_EQ(one, other);
  EXPECT_EQ(room, same);
}

TEST(CrossOver, JoinsEntriesAndOptions) {
  Random random{8};
  const Bytes one = make_subscribe(door, 1, 3, own);
  const Bytes both = cross_over(one, make_subscribe(door, 2, 3, own), max_size, random);
  const auto message = sd::decode(someip::decode(both).value()).value();
  ASSERT_EQ(message.entry_count(), 2U);
  EXPECT_EQ(message.entry(1).eventgroup(), someip::EventgroupId{2});
  EXPECT_TRUE(message.option(1));
}

}  // namespace
}  // namespace trestle::fuzz::mutate_test
