#include "someip/core/e2e/state_machine.hpp"

#include <gmock/gmock.h>

#include <string>
#include <string_view>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "test/covers.hpp"

namespace trestle::someip::e2e::e2e_state_machine_test {
namespace {

/// The states, a letter each, that the checks lead through, a letter each:
/// checks o(k), l(ost some), r(epeated), w(rong sequence), e(rror), n(o new data);
/// states D (no data), I(nit), V(alid), X (invalid).
std::string states(StateMachine& machine, std::string_view checks) {
  std::string result;
  for (const char check : checks) {
    const State state = machine.on_check(check == 'o'   ? CheckStatus::ok
                                         : check == 'l' ? CheckStatus::ok_some_lost
                                         : check == 'r' ? CheckStatus::repeated
                                         : check == 'w' ? CheckStatus::wrong_sequence
                                         : check == 'e' ? CheckStatus::error
                                                        : CheckStatus::no_new_data);
    EXPECT_EQ(machine.state(), state);
    result += state == State::no_data ? 'D' : state == State::init ? 'I' : state == State::valid ? 'V' : 'X';
  }
  return result;
}
std::string states(const StateMachineConfig& config, std::string_view checks) {
  auto machine = StateMachine::create(config);
  return states(*machine, checks);
}

constexpr StateMachineConfig small{.window_size_init = 3,
                                   .window_size_valid = 4,
                                   .window_size_invalid = 3,
                                   .min_ok_init = 2,
                                   .min_ok_valid = 1,
                                   .min_ok_invalid = 3,
                                   .max_error_init = 1,
                                   .max_error_valid = 2,
                                   .max_error_invalid = 0};

// The defaults: valid from the third good message on, invalid after three checks without a good one.
TEST(E2eStateMachine, SuitsACyclicEventUnlessToldOtherwise) {
  EXPECT_EQ(states(StateMachineConfig{}, "oooeeeo"), "IIVVVXX");
}

TEST(E2eStateMachine, WaitsForSomethingUsable) {
  EXPECT_EQ(states(small, "neneneee"), "DDDDDDDD");
  EXPECT_EQ(states(small, "no"), "DI");
  EXPECT_EQ(states(small, "nl"), "DI");
  EXPECT_EQ(states(small, "nr"), "DI");
  EXPECT_EQ(states(small, "nw"), "DI");
}

TEST(E2eStateMachine, DoesNotCountTheMessageThatEndsNoData) {
  EXPECT_EQ(states(small, "ooo"), "IIV");
  EXPECT_EQ(states(small, "wlo"), "IIV");
}

TEST(E2eStateMachine, BecomesInvalidByErrorsInInit) {
  EXPECT_EQ(states(small, "oeoo"), "IIIV");
  EXPECT_EQ(states(small, "oee"), "IIX");
  EXPECT_EQ(states(small, "oeneonee"), "IIIXXXXX");
  EXPECT_EQ(states(small, "oennenno"), "IIIIIIII") << "the first error has left the window of three";
}

TEST(E2eStateMachine, StaysInitWithoutEnoughGoodOnes) {
  EXPECT_EQ(states(small, "onnonnonnoo"), "IIIIIIIIIIV");
  EXPECT_EQ(states(small, "orrrwwwnnn"), "IIIIIIIIII");
}

TEST(E2eStateMachine, BecomesInvalidByErrorsInValid) {
  EXPECT_EQ(states(small, "oooeoe"), "IIVVVV");
  EXPECT_EQ(states(small, "oooeee"), "IIVVVX");
  EXPECT_EQ(states(small, "oooeeonne"), "IIVVVVVVV") << "no three errors within four checks";
}

TEST(E2eStateMachine, BecomesInvalidByLackOfGoodOnesInValid) {
  EXPECT_EQ(states(small, "ooonnn"), "IIVVVV") << "one good message is left in the window";
  EXPECT_EQ(states(small, "ooonnnn"), "IIVVVVX");
  EXPECT_EQ(states(small, "ooorrrr"), "IIVVVVX");
  EXPECT_EQ(states(small, "ooowwww"), "IIVVVVX");
}

TEST(E2eStateMachine, RecoversWhenTheWindowOfInvalidIsGood) {
  EXPECT_EQ(states(small, "oeeooo"), "IIXXXV");
  EXPECT_EQ(states(small, "oeeooeooo"), "IIXXXXXXV");
  EXPECT_EQ(states(small, "oeeononoolo"), "IIXXXXXXXVV");
}

TEST(E2eStateMachine, KeepsTheWindowOnTheWayToInvalidUnlessToldToClearIt) {
  const StateMachineConfig keeping{.window_size_init = 5,
                                   .window_size_valid = 5,
                                   .window_size_invalid = 5,
                                   .min_ok_init = 2,
                                   .min_ok_valid = 2,
                                   .min_ok_invalid = 2,
                                   .max_error_init = 1,
                                   .max_error_valid = 1,
                                   .max_error_invalid = 1};
  StateMachineConfig clearing = keeping;
  clearing.clear_to_invalid = true;
  // Two errors in the window: the first must leave it, or be forgotten.
  EXPECT_EQ(states(keeping,
                   "oooee"
                   "oooo"),
            "IIVVXXXXV");
  EXPECT_EQ(states(clearing,
                   "oooee"
                   "oo"),
            "IIVVXXV");
}

TEST(E2eStateMachine, DoesNotTakeBackWhatHasLeftASmallerWindow) {
  const StateMachineConfig config{.window_size_init = 1,
                                  .window_size_valid = 4,
                                  .window_size_invalid = 1,
                                  .min_ok_init = 1,
                                  .min_ok_valid = 1,
                                  .min_ok_invalid = 1,
                                  .max_error_init = 0,
                                  .max_error_valid = 1,
                                  .max_error_invalid = 0};
  // Two errors in a row would end valid, but those of before do not count there.
  EXPECT_EQ(states(config,
                   "oeeoe"
                   "e"),
            "IXXVVX");
}

TEST(E2eStateMachine, GivesUpOnSilenceInNoDataIfExtended) {
  StateMachineConfig extended = small;
  extended.transit_to_invalid_extended = true;
  EXPECT_EQ(states(extended, "nnn"), "DDX");
  EXPECT_EQ(states(extended, "een"), "DDX");
  EXPECT_EQ(states(extended, "nno"), "DDX");
  EXPECT_EQ(states(extended, "no"), "DI");
  EXPECT_EQ(states(small, "nnnnnnnn"), "DDDDDDDD");
}

TEST(E2eStateMachine, GivesUpInInitWhenTooFewCanBeGoodIfExtended) {
  StateMachineConfig extended = small;
  extended.transit_to_invalid_extended = true;
  EXPECT_EQ(states(extended, "ononn"), "IIIXX") << "two of three cannot be good any more";
  EXPECT_EQ(states(extended, "onoo"), "IIIV");
  EXPECT_EQ(states(extended, "oww"), "IIX");
  EXPECT_EQ(states(small, "oww"), "III");
}

TEST(E2eStateMachine, BeginsAnewAfterReset) {
  auto machine = StateMachine::create(small);
  EXPECT_EQ(states(*machine, "ooo"), "IIV");
  machine->reset();
  EXPECT_EQ(machine->state(), State::no_data);
  EXPECT_EQ(states(*machine, "noo"), "DII");
}

TEST(E2eStateMachine, HasWindowsOfUpTo255) {
  const StateMachineConfig wide{.window_size_init = 255,
                                .window_size_valid = 255,
                                .window_size_invalid = 255,
                                .min_ok_init = 255,
                                .min_ok_valid = 255,
                                .min_ok_invalid = 255,
                                .max_error_init = 0,
                                .max_error_valid = 0,
                                .max_error_invalid = 0};
  EXPECT_EQ(states(wide, "o" + std::string(255, 'o')), std::string(255, 'I') + "V");
  EXPECT_EQ(states(wide, std::string(256, 'o') + "r" + std::string(255, 'o')),
            std::string(255, 'I') + "V" + std::string(255, 'X') + "V");
}

std::string_view broken(const StateMachineConfig& config) {
  const auto machine = StateMachine::create(config);
  const auto checker = Checker::create(Profile4{}, config);
  EXPECT_EQ(machine.has_value(), checker.has_value());
  return machine ? std::string_view{} : machine.error().field;
}

TEST(E2eStateMachine, NamesTheSettingThatCannotBe) {
  const auto with = [](auto change) {
    StateMachineConfig config = small;
    change(config);
    return broken(config);
  };
  EXPECT_EQ(broken({}), "");
  EXPECT_EQ(broken(small), "");
  EXPECT_EQ(with([](auto& c) { c.window_size_valid = 0; }), "window_size_valid");
  EXPECT_EQ(with([](auto& c) { c.window_size_init = 5; }), "window_size_init");
  EXPECT_EQ(with([](auto& c) { c.window_size_init = 0; }), "window_size_init");
  EXPECT_EQ(with([](auto& c) { c.window_size_invalid = 5; }), "window_size_invalid");
  EXPECT_EQ(with([](auto& c) { c.window_size_invalid = 0; }), "window_size_invalid");
  EXPECT_EQ(with([](auto& c) { c.min_ok_valid = 0; }), "min_ok_valid");
  EXPECT_EQ(with([](auto& c) { c.min_ok_valid = 3; }), "min_ok_init");
  EXPECT_EQ(with([](auto& c) { c.min_ok_invalid = 1; }), "min_ok_invalid");
  EXPECT_EQ(with([](auto& c) { c.max_error_init = 3; }), "max_error_init");
  EXPECT_EQ(with([](auto& c) { c.max_error_invalid = 2; }), "max_error_invalid");
  EXPECT_EQ(with([](auto& c) { c.max_error_valid = 4; }), "max_error_valid");
  EXPECT_EQ(with([](auto& c) { c.max_error_init = 2; }), "max_error_init");
  EXPECT_EQ(with([](auto& c) { c.max_error_invalid = 1; }), "max_error_invalid");
}

TEST(E2eChecker, FeedsItsStateMachine) {
  auto protector = Protector::create(Profile4{});
  auto checker = Checker::create(Profile4{}, small);
  ASSERT_TRUE(protector && checker);
  std::vector<std::byte> data(24);
  const auto next = [&] {
    EXPECT_TRUE(protector->protect(data));
    return checker->check(data).state;
  };
  EXPECT_EQ(checker->state(), State::no_data);
  EXPECT_EQ(checker->no_new_data().state, State::no_data);
  EXPECT_EQ(next(), State::init);
  EXPECT_EQ(next(), State::init);
  EXPECT_EQ(next(), State::valid);
  EXPECT_EQ(checker->check(ByteView{data}.first(3)).state, State::valid);
  EXPECT_EQ(checker->check(ByteView{data}.first(3)).state, State::valid);
  EXPECT_EQ(checker->check(ByteView{data}.first(3)).state, State::invalid);
  EXPECT_EQ(checker->state(), State::invalid);
}

}  // namespace
}  // namespace trestle::someip::e2e::e2e_state_machine_test
