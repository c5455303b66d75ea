// What the checker says of lost, repeated, late and missing messages.
#include <gmock/gmock.h>

#include <vector>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "test/covers.hpp"

namespace trestle::someip::e2e::e2e_sequence_test {
namespace {

using testing::ElementsAre;
using enum CheckStatus;

/// A sender and a receiver of `config`; messages are named by their counter.
class Stream {
 public:
  Stream(const Config& config, std::size_t bytes)
      : protector_{*Protector::create(config)}, checker_{*Checker::create(config)}, bytes_{bytes} {}

  CheckStatus receive(std::uint32_t counter) {
    std::vector<std::byte> data(bytes_);
    protector_.resume(counter);
    EXPECT_TRUE(protector_.protect(data));
    const CheckResult result = checker_.check(data);
    EXPECT_EQ(result.counter, counter);
    return result.status;
  }
  std::vector<CheckStatus> receive_all(std::initializer_list<std::uint32_t> counters) {
    std::vector<CheckStatus> statuses;
    for (const std::uint32_t counter : counters) {
      statuses.push_back(receive(counter));
    }
    return statuses;
  }
  CheckStatus receive_damaged(std::uint32_t counter) {
    std::vector<std::byte> data(bytes_);
    protector_.resume(counter);
    EXPECT_TRUE(protector_.protect(data));
    data.back() ^= std::byte{0x10};
    return checker_.check(data).status;
  }
  CheckStatus receive_nothing() { return checker_.no_new_data().status; }
  Checker& checker() { return checker_; }

 private:
  Protector protector_;
  Checker checker_;
  std::size_t bytes_;
};

Stream profile4(std::uint32_t max_delta) {
  return {Profile4{.max_delta_counter = max_delta}, 24};
}

TEST(E2eSequence, TellsLostRepeatedAndWrongFromGood) {
  Stream stream = profile4(3);
  EXPECT_THAT(stream.receive_all({0, 1, 3, 6, 10, 11, 11, 10}),
              ElementsAre(ok, ok, ok_some_lost, ok_some_lost, wrong_sequence, ok, repeated, wrong_sequence));
}

TEST(E2eSequence, LosesNothingAtAMaximumDeltaOfOne) {
  Stream stream = profile4(1);
  EXPECT_THAT(stream.receive_all({0, 1, 3, 4}), ElementsAre(ok, ok, wrong_sequence, ok));
}

TEST(E2eSequence, ReportsTheFirstMessageOfARunningStreamAsOutOfSequence) {
  Stream stream = profile4(3);
  EXPECT_THAT(stream.receive_all({1000, 1001}), ElementsAre(wrong_sequence, ok));
}

TEST(E2eSequence, IsNotMovedByADamagedMessage) {
  Stream stream = profile4(2);
  EXPECT_EQ(stream.receive(0), ok);
  EXPECT_EQ(stream.receive_damaged(1), error);
  EXPECT_EQ(stream.receive(2), ok_some_lost);
  EXPECT_EQ(stream.receive_damaged(900), error);
  EXPECT_EQ(stream.receive(3), ok);
}

TEST(E2eSequence, DoesNotCountSilenceInTheNewerProfiles) {
  Stream stream = profile4(1);
  EXPECT_EQ(stream.receive(0), ok);
  EXPECT_EQ(stream.receive_nothing(), no_new_data);
  EXPECT_EQ(stream.receive_nothing(), no_new_data);
  EXPECT_EQ(stream.receive(2), wrong_sequence);
}

TEST(E2eSequence, BeginsAnewAfterAReset) {
  Stream stream = profile4(1);
  EXPECT_THAT(stream.receive_all({0, 1, 2}), ElementsAre(ok, ok, ok));
  stream.checker().reset();
  EXPECT_EQ(stream.checker().state(), State::no_data);
  EXPECT_THAT(stream.receive_all({0, 1}), ElementsAre(ok, ok));
}

struct Wrap {
  const char* name;
  Config config;
  std::size_t bytes;
  std::uint32_t last;  ///< after it comes 0
};

TEST(E2eSequence, WrapsWhereTheCounterOfTheProfileEnds) {
  const std::array<Wrap, 8> wraps{{
      {"P04", Profile4{.max_delta_counter = 2}, 24, 0xffff},
      {"P44", Profile44{{.max_delta_counter = 2}}, 24, 0xffff},
      {"P05", Profile5{.data_bits = 96, .max_delta_counter = 2}, 12, 0xff},
      {"P06", Profile6{.max_delta_counter = 2}, 16, 0xff},
      {"P07", Profile7{.max_delta_counter = 2}, 28, 0xffffffff},
      {"P08", Profile8{{.max_delta_counter = 2}}, 24, 0xffffffff},
      {"P11", Profile11{.data_bits = 80, .max_delta_counter = 2}, 10, 14},
      {"P22", Profile22{.data_bits = 80, .max_delta_counter = 2}, 10, 15},
  }};
  for (const Wrap& wrap : wraps) {
    SCOPED_TRACE(wrap.name);
    Stream stream{wrap.config, wrap.bytes};
    stream.receive(wrap.last - 3);
    EXPECT_THAT(stream.receive_all({wrap.last - 2, wrap.last - 1, wrap.last, 0, 1}),
                ElementsAre(ok, ok, ok, ok, ok));
    stream.receive(wrap.last - 1);
    stream.receive(wrap.last);
    EXPECT_EQ(stream.receive(1), ok_some_lost) << "0 is missing";
    stream.receive(2);
    EXPECT_EQ(stream.receive(2), repeated);
    EXPECT_EQ(stream.receive(1), wrong_sequence) << "one step back is nearly a whole turn";
  }
}

TEST(E2eProtector, CountsRoundAndRound) {
  const std::array<Wrap, 6> wraps{{
      {"P01", Profile1{.data_bits = 80}, 10, 14},
      {"P02", Profile2{.data_bits = 80}, 10, 15},
      {"P04", Profile4{}, 24, 0xffff},
      {"P05", Profile5{.data_bits = 96}, 12, 0xff},
      {"P07", Profile7{}, 28, 0xffffffff},
      {"P22", Profile22{.data_bits = 80}, 10, 15},
  }};
  for (const Wrap& wrap : wraps) {
    SCOPED_TRACE(wrap.name);
    auto protector = Protector::create(wrap.config);
    std::vector<std::byte> data(wrap.bytes);
    protector->resume(wrap.last);
    EXPECT_EQ(protector->next_counter(), wrap.last);
    ASSERT_TRUE(protector->protect(data));
    EXPECT_EQ(protector->next_counter(), 0U);
    ASSERT_TRUE(protector->protect(data));
    EXPECT_EQ(protector->next_counter(), 1U);
    protector->resume(wrap.last + 1);
    EXPECT_EQ(protector->next_counter(), 0U);
  }
}

TEST(E2eProtector, BeginsAtOneWhereTheProfileCountsFirst) {
  EXPECT_EQ(Protector::create(Profile2{.data_bits = 80})->next_counter(), 1U);
  EXPECT_EQ(Protector::create(Profile22{.data_bits = 80})->next_counter(), 1U);
  EXPECT_EQ(Protector::create(Profile1{.data_bits = 80})->next_counter(), 0U);
  EXPECT_EQ(Protector::create(Profile4{})->next_counter(), 0U);
}

Stream profile1(EarlySequence sequence) {
  return {Profile1{.data_bits = 80, .sequence = sequence}, 10};
}

TEST(E2eEarlySequence, AcceptsAfterOneTwoAndThreeButNotFour) {
  // AUTOSAR's own example for MaxDeltaCounterInit = 1.
  for (const auto& [counter, status] : {std::pair{2U, ok}, {3U, ok_some_lost}, {4U, wrong_sequence}}) {
    Stream stream = profile1({.max_delta_counter_init = 1});
    stream.receive(1);
    EXPECT_EQ(stream.receive(counter), status) << counter;
  }
}

TEST(E2eEarlySequence, TakesTheFirstCounterAsItComes) {
  Stream newer = profile1({.behavior = Behavior::r4_2});
  EXPECT_THAT(newer.receive_all({9, 10}), ElementsAre(wrong_sequence, ok));
  Stream older = profile1({.behavior = Behavior::pre_r4_2});
  EXPECT_THAT(older.receive_all({9, 10}), ElementsAre(ok, ok));
}

TEST(E2eEarlySequence, AllowsOneMoreForEachCheckWithoutAValidMessage) {
  Stream stream = profile1({.max_delta_counter_init = 0});
  stream.receive(0);
  EXPECT_EQ(stream.receive(1), ok);
  EXPECT_EQ(stream.receive_nothing(), no_new_data);
  EXPECT_EQ(stream.receive_damaged(2), error);
  EXPECT_EQ(stream.receive(4), ok_some_lost);
  EXPECT_EQ(stream.receive(6), wrong_sequence) << "back to the initial tolerance";
}

TEST(E2eEarlySequence, KeepsTheOldCounterIfAJumpIsNotForgiven) {
  Stream stream = profile1({.max_delta_counter_init = 0});
  EXPECT_THAT(stream.receive_all({0, 1, 8, 9}),
              ElementsAre(wrong_sequence, ok, wrong_sequence, wrong_sequence));
  EXPECT_EQ(stream.receive(2), ok);
}

TEST(E2eEarlySequence, SynchronisesAfterAJump) {
  Stream newer = profile1({.max_delta_counter_init = 0, .sync_counter_init = 2});
  EXPECT_THAT(newer.receive_all({0, 1, 8, 9, 10, 11}),
              ElementsAre(wrong_sequence, ok, wrong_sequence, ok, ok, ok));
  Stream older =
      profile1({.max_delta_counter_init = 0, .sync_counter_init = 2, .behavior = Behavior::pre_r4_2});
  EXPECT_THAT(older.receive_all({0, 1, 8, 9, 10, 11}),
              ElementsAre(ok, ok, wrong_sequence, wrong_sequence, wrong_sequence, ok));
}

TEST(E2eEarlySequence, SynchronisesAfterTooManyRepetitionsOrTooLongASilence) {
  Stream stream = profile1({.max_delta_counter_init = 0,
                            .max_no_new_or_repeated_data = 2,
                            .sync_counter_init = 1,
                            .behavior = Behavior::pre_r4_2});
  EXPECT_THAT(stream.receive_all({0, 1, 1, 1, 2}), ElementsAre(ok, ok, repeated, repeated, ok));
  EXPECT_THAT(stream.receive_all({2, 2}), ElementsAre(repeated, repeated));
  EXPECT_EQ(stream.receive_nothing(), no_new_data);
  EXPECT_EQ(stream.receive(3), wrong_sequence) << "the one message of the synchronisation";
  EXPECT_EQ(stream.receive(4), ok);
}

TEST(E2eEarlySequence, ForgetsRepetitionsAtAReset) {
  Stream stream = profile1({.max_delta_counter_init = 0,
                            .max_no_new_or_repeated_data = 2,
                            .sync_counter_init = 1,
                            .behavior = Behavior::pre_r4_2});
  EXPECT_THAT(stream.receive_all({0, 1, 1, 1, 1}), ElementsAre(ok, ok, repeated, repeated, repeated));
  stream.checker().reset();
  EXPECT_THAT(stream.receive_all({0, 1}), ElementsAre(ok, ok)) << "nothing to synchronise after";
}

TEST(E2eEarlySequence, WrapsAfterFourteen) {
  Stream stream = profile1({});
  EXPECT_THAT(stream.receive_all({12, 13, 14, 0, 1}), ElementsAre(wrong_sequence, ok, ok, ok, ok));
  Stream losing = profile1({});
  EXPECT_THAT(losing.receive_all({13, 14, 1}), ElementsAre(wrong_sequence, ok, ok_some_lost));
}

TEST(E2eEarlySequence, IsTheSameInProfile2WithSixteenCounters) {
  Stream stream{Profile2{.data_bits = 80, .sequence = {.max_delta_counter_init = 0}}, 10};
  EXPECT_THAT(stream.receive_all({13, 14, 15, 0, 1, 1, 3}),
              ElementsAre(wrong_sequence, ok, ok, ok, ok, repeated, ok_some_lost));
}

}  // namespace
}  // namespace trestle::someip::e2e::e2e_sequence_test
