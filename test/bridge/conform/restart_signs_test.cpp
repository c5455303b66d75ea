#include "bridge/conform/restart_signs.hpp"

#include <gtest/gtest.h>

namespace trestle::conform::restart_signs_test {
namespace {

using namespace std::chrono_literals;

/// An offer by multicast, with the Reboot flag.
SdSign offer(Duration time, std::uint16_t session) {
  return {.time = WallTime{time},
          .multicast = true,
          .session = someip::SessionId{session},
          .reboot = true,
          .offers = true};
}

/// The restart begins at 10 s, after the first message.
std::optional<std::size_t> begin_of(const std::vector<SdSign>& messages, std::optional<Duration> pause = {}) {
  NewLife life{WallTime{10s}, pause};
  life.before(messages.front());
  for (std::size_t at = 1; at < messages.size(); ++at) {
    if (life.begins_with(messages[at])) {
      return at;
    }
  }
  return std::nullopt;
}

TEST(NewLife, BeginsWithTheFirstSession) {
  EXPECT_EQ(begin_of({offer(9s, 7), offer(11s, 8), offer(12s, 1), offer(13s, 2)}), 2U);
  // Whatever the message is, and by whichever way.
  SdSign find = offer(11s, 1);
  find.offers = false;
  find.multicast = false;
  EXPECT_EQ(begin_of({offer(9s, 7), find, offer(12s, 1)}), 1U);
  // What it said before the restart began is of no interest.
  EXPECT_EQ(begin_of({offer(9s, 1), offer(11s, 2)}), std::nullopt);
}

TEST(NewLife, BeginsWhereTheSessionGoesBack) {
  // The first messages are lost where the network comes up late.
  EXPECT_EQ(begin_of({offer(9s, 7), offer(11s, 8), offer(12s, 3), offer(13s, 4)}), 2U);
  // Unicast has sessions of its own, and a copy is no new life.
  SdSign answer = offer(11s, 3);
  answer.multicast = false;
  EXPECT_EQ(begin_of({offer(9s, 7), answer, offer(12s, 8), offer(12s, 8)}), std::nullopt);
}

TEST(NewLife, NeedsTheRebootFlagForThat) {
  SdSign wrapped = offer(9s, 0xffff);
  wrapped.reboot = false;
  SdSign next = offer(11s, 1);
  next.reboot = false;
  EXPECT_EQ(begin_of({wrapped, next}), std::nullopt);
  // The flag comes back: that is a restart, with any session.
  EXPECT_EQ(begin_of({wrapped, next, offer(12s, 5)}), 2U);
}

TEST(NewLife, BeginsWithAnOfferAfterASilence) {
  EXPECT_EQ(begin_of({offer(9s, 7), offer(11s, 8), offer(14s, 9)}, 2s), 2U);
  EXPECT_EQ(begin_of({offer(9s, 7), offer(13s, 8)}, 2s), 1U);
  EXPECT_EQ(begin_of({offer(9s, 7), offer(11s, 8), offer(13s, 9)}, 2s), std::nullopt);
  EXPECT_EQ(begin_of({offer(9s, 7), offer(11s, 8), offer(99s, 9)}), std::nullopt);
  SdSign find = offer(14s, 8);
  find.offers = false;
  EXPECT_EQ(begin_of({offer(9s, 7), find, offer(15s, 9)}, 2s), std::nullopt);
}

TEST(NewLife, KnowsThePausesOfARunningDeviceFromItsTiming) {
  EXPECT_EQ(longest_pause({.cyclic_offer_delay = 500ms}), 1500ms);
  EXPECT_EQ(
      longest_pause(
          {.repetitions_base_delay = 200ms, .repetitions_max = std::uint8_t{3}, .cyclic_offer_delay = 500ms}),
      3200ms);
  EXPECT_EQ(
      longest_pause(
          {.repetitions_base_delay = 200ms, .repetitions_max = std::uint8_t{3}, .cyclic_offer_delay = 0ms}),
      3200ms);
  EXPECT_EQ(longest_pause({.repetitions_base_delay = 200ms, .repetitions_max = std::uint8_t{3}}),
            std::nullopt);
  EXPECT_EQ(longest_pause({.cyclic_offer_delay = 0ms}), std::nullopt);
}

}  // namespace
}  // namespace trestle::conform::restart_signs_test
