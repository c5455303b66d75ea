#include "bridge/describe/load_e2e.hpp"

#include <gmock/gmock.h>

#include <string>
#include <variant>

#include "bridge/describe/e2e_profiles.hpp"
#include "bridge/describe/protection.hpp"
#include "someip/core/e2e/layout.hpp"

namespace trestle::describe::load_e2e_test {
namespace {

namespace e2e = someip::e2e;
using testing::HasSubstr;
using testing::StartsWith;

E2eSettings settings_of(const Protection& protection, E2eUse use = E2eUse::received_event) {
  const auto settings = e2e_settings(protection, use);
  EXPECT_TRUE(settings) << (settings ? "" : settings.error());
  return settings.value_or(E2eSettings{});
}

TEST(E2eOfDescriptions, IsThatOfANode) {
  const Protection protection{.profile = "4",
                              .numbers = {{"data_id", 0x2d}, {"max_delta_counter", 3}, {"offset_bits", 72}}};
  for (const E2eUse use : {E2eUse::sent_event, E2eUse::received_event, E2eUse::served, E2eUse::called}) {
    EXPECT_EQ(settings_of(protection, use).profile,
              (e2e::Config{e2e::Profile4{.data_id = 0x2d, .offset_bits = 72, .max_delta_counter = 3}}));
  }
}

TEST(E2eProfiles, HaveTheHeadersOfTheCore) {
  for (const E2eProfile& one : e2e_profiles()) {
    e2e::Config settings = one.settings;
    std::visit(
        [](auto& profile) {
          if constexpr (requires { profile.data_bits; }) {
            profile.data_bits = 240;
          }
        },
        settings);
    const auto layout = e2e::make_layout(settings);
    ASSERT_TRUE(layout) << one.name;
    EXPECT_EQ(layout->header_bytes(), one.header_bytes) << one.name;
    EXPECT_EQ(&e2e_profile(settings), &one);
    EXPECT_EQ(one.is_for_methods, std::string{one.name}.ends_with('m'));
    EXPECT_EQ(protection_header({.profile = one.name})->bytes, one.header_bytes) << one.name;
  }
  EXPECT_FALSE(protection_header({.profile = "9"}));
}

TEST(E2eProfiles, AreTheWordsOfConfigurations) {
  const auto refused = [](const char* profile, E2eUse use) {
    const auto settings = e2e_settings({.profile = profile, .numbers = {{"data_id", 1}}}, use);
    return settings ? std::string{} : settings.error();
  };
  EXPECT_THAT(refused("9", E2eUse::received_event),
              HasSubstr("expected one of 1, 2, 4, 5, 6, 7, 8, 11, 22, 44, found"));
  EXPECT_THAT(refused("4m", E2eUse::received_event), HasSubstr("22, 44, found"));
  EXPECT_THAT(refused("9", E2eUse::called), HasSubstr("22, 44, 4m, 7m, 8m, 44m, found"));
  EXPECT_EQ(refused("4m", E2eUse::called), "");
}

TEST(E2eOfDescriptions, LeavesOutParametersOfOtherProfiles) {
  const Protection protection{.profile = "4",
                              .numbers = {{"data_id", 1},
                                          {"counter_offset_bits", 8},
                                          {"data_bits", 128},
                                          {"source_id", 7},
                                          {"sync_counter_init", 2}},
                              .words = {{"behavior", "r4_2"}, {"data_id_mode", "both"}}};
  EXPECT_EQ(settings_of(protection).profile, (e2e::Config{e2e::Profile4{.data_id = 1}}));
}

TEST(E2eOfDescriptions, HasAStateMachineWhereSomethingIsReceived) {
  const Protection protection{.profile = "4",
                              .numbers = {{"data_id", 1}, {"window_size_init", 5}, {"window_size_valid", 6}},
                              .words = {{"clear_to_invalid", "true"}}};
  const e2e::StateMachineConfig machine = settings_of(protection).state_machine;
  EXPECT_EQ(machine.window_size_init, 5);
  EXPECT_EQ(machine.window_size_valid, 6);
  EXPECT_TRUE(machine.clear_to_invalid);
  EXPECT_EQ(settings_of(protection, E2eUse::sent_event).state_machine, e2e::StateMachineConfig{});
  // As a route has it.
  EXPECT_EQ(e2e_yaml(protection, E2eUse::received_event)["state_machine"]["window_size_init"].Scalar(), "5");
  EXPECT_FALSE(e2e_yaml(protection, E2eUse::sent_event)["state_machine"].IsDefined());
}

TEST(E2eOfDescriptions, HasTheDataIdsOfEachCounter) {
  const Protection protection{.profile = "2",
                              .numbers = {{"data_bits", 128}, {"max_delta_counter", 2}},
                              .words = {{"data_id_list", "1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16"}}};
  EXPECT_EQ(
      settings_of(protection).profile,
      (e2e::Config{e2e::Profile2{.data_id_list = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16},
                                 .data_bits = 128,
                                 .sequence = {.max_delta_counter_init = 2}}}));
}

TEST(E2eOfDescriptions, HasASourceWhereSomebodyCalls) {
  const Protection protection{.profile = "4m", .numbers = {{"data_id", 1}, {"source_id", 7}}};
  EXPECT_EQ(settings_of(protection, E2eUse::called).source_id, 7U);
  EXPECT_EQ(settings_of(protection, E2eUse::served).source_id, 0U);
}

TEST(E2eOfDescriptions, SaysWhatIsMissingOrWrong) {
  const auto error = [](const Protection& protection, E2eUse use = E2eUse::received_event) {
    const auto settings = e2e_settings(protection, use);
    return settings ? std::string{"none"} : settings.error();
  };
  EXPECT_THAT(error({.profile = "5", .numbers = {{"data_id", 1}}}), HasSubstr("data_bits"));
  EXPECT_THAT(error({.profile = "4"}), HasSubstr("data_id"));
  EXPECT_THAT(error({.profile = "3", .numbers = {{"data_id", 1}}}), StartsWith("profile: expected"));
  EXPECT_THAT(error({.profile = "4m", .numbers = {{"data_id", 1}}}), StartsWith("profile: expected"));
  EXPECT_EQ(error({.profile = "4m", .numbers = {{"data_id", 1}}}, E2eUse::called), "none");
  EXPECT_THAT(error({.profile = "4", .numbers = {{"data_id", 1}, {"offset_bits", 0}}}),
              HasSubstr("offset_bits: must be"));
}

}  // namespace
}  // namespace trestle::describe::load_e2e_test
