// `e2e:` of a route, and `diagnostics:`.
#include <gmock/gmock.h>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::e2e_keys_test {
namespace {

using namespace std::chrono_literals;
namespace e2e = someip::e2e;
using testing::ElementsAre;
using testing::HasSubstr;

std::string in_route(const std::string& keys, const std::string& direction = "someip_to_dds, major: 1") {
  return "someip: {address: 127.0.0.1}\n"
         "routes:\n"
         "  - {topic: /a, type: std_msgs/msg/String, service: 1, instance: 2, eventgroup: 3, event: 0x8004,\n"
         "     direction: " +
         direction + ",\n     e2e: {" + keys + "}}\n";
}
const std::string server = "dds_to_someip, port: 40001";

carry::E2eSettings settings_of(const std::string& text) {
  const auto loaded = carry::parse_config(text, "b.yaml");
  if (!loaded) {
    ADD_FAILURE() << to_string(loaded.error().front());
    return {};
  }
  return loaded->config.routes.at(0).e2e.value();
}

TEST(E2eKeys, HaveTheNamesOfTheProfilesFields) {
  EXPECT_EQ(settings_of(in_route("profile: 4, data_id: 0x2d")).profile,
            e2e::Config{e2e::Profile4{.data_id = 0x2d}});
  EXPECT_EQ(settings_of(in_route("profile: 4, data_id: 0x0100002d, offset_bits: 72, min_data_bits: 200, "
                                 "max_data_bits: 800, max_delta_counter: 3"))
                .profile,
            (e2e::Config{e2e::Profile4{.data_id = 0x0100002d,
                                       .offset_bits = 72,
                                       .min_data_bits = 200,
                                       .max_data_bits = 800,
                                       .max_delta_counter = 3}}));
  EXPECT_EQ(settings_of(in_route("profile: 5, data_id: 303, data_bits: 320, crc_order: big")).profile,
            (e2e::Config{e2e::Profile5{.data_id = 303, .data_bits = 320, .crc_order = std::endian::big}}));
  EXPECT_EQ(
      settings_of(in_route("profile: 1, data_id: 0xa73, data_id_mode: nibble, data_bits: 128, "
                           "crc_offset_bits: 64, counter_offset_bits: 72, data_id_nibble_offset_bits: 76, "
                           "max_delta_counter_init: 2, max_no_new_or_repeated_data: 3, sync_counter_init: "
                           "1, behavior: pre_r4_2"))
          .profile,
      (e2e::Config{e2e::Profile1{.data_id = 0xa73,
                                 .data_id_mode = e2e::DataIdMode::nibble,
                                 .data_bits = 128,
                                 .sequence = {.max_delta_counter_init = 2,
                                              .max_no_new_or_repeated_data = 3,
                                              .sync_counter_init = 1,
                                              .behavior = e2e::Behavior::pre_r4_2}}}));
  EXPECT_EQ(
      settings_of(in_route("profile: 22, data_bits: 320, max_delta_counter: 2, "
                           "data_id_list: [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,0xff]"))
          .profile,
      (e2e::Config{e2e::Profile22{.data_id_list = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 255},
                                  .data_bits = 320,
                                  .max_delta_counter = 2}}));
  const std::vector<std::pair<std::string, std::size_t>> others{{"6", 5}, {"7", 6}, {"8", 8}, {"44", 11}};
  for (const auto& [name, index] : others) {
    EXPECT_EQ(settings_of(in_route("profile: " + name + ", data_id: 7")).profile.index(), index) << name;
  }
}

TEST(E2eKeys, TellWhatIsDoneWithWhatFails) {
  const auto usual = settings_of(in_route("profile: 4, data_id: 1"));
  EXPECT_FALSE(usual.pass_failed);
  EXPECT_FALSE(usual.payload_only);
  EXPECT_EQ(usual.state_machine, e2e::StateMachineConfig{});
  EXPECT_FALSE(settings_of(in_route("profile: 4, data_id: 1, failed: drop")).pass_failed);
  EXPECT_TRUE(settings_of(in_route("profile: 4, data_id: 1, failed: pass")).pass_failed);
  EXPECT_EQ(
      settings_of(
          in_route("profile: 4, data_id: 1, state_machine: {window_size_init: 4, window_size_valid: 6, "
                   "window_size_invalid: 5, min_ok_init: 2, min_ok_valid: 1, min_ok_invalid: 3, "
                   "max_error_init: 2, max_error_valid: 3, max_error_invalid: 0, clear_to_invalid: true, "
                   "transit_to_invalid_extended: true}"))
          .state_machine,
      (e2e::StateMachineConfig{.window_size_init = 4,
                               .window_size_valid = 6,
                               .window_size_invalid = 5,
                               .min_ok_init = 2,
                               .min_ok_valid = 1,
                               .min_ok_invalid = 3,
                               .max_error_init = 2,
                               .max_error_valid = 3,
                               .max_error_invalid = 0,
                               .clear_to_invalid = true,
                               .transit_to_invalid_extended = true}));
}

TEST(E2eKeys, CountFromThePayloadIfThatIsAllThatIsProtected) {
  const auto four = settings_of(in_route("profile: 4, data_id: 1, payload_only: true"));
  EXPECT_TRUE(four.payload_only);
  EXPECT_EQ(std::get<e2e::Profile4>(four.profile).offset_bits, 0U);
  const auto one = std::get<e2e::Profile1>(
      settings_of(in_route("profile: 1, data_id: 1, data_bits: 64, payload_only: true")).profile);
  EXPECT_EQ(one.crc_offset_bits, 0U);
  EXPECT_EQ(one.counter_offset_bits, 8U);
  EXPECT_EQ(one.data_id_nibble_offset_bits, 12U);
}

TEST(E2eKeys, NameWhatCannotBe) {
  const auto said = [](const std::string& keys) { return problems_of(in_route(keys)); };
  EXPECT_THAT(said("data_id: 1"), ElementsAre(HasSubstr("b.yaml:5:11: error: e2e: 'profile' is missing")));
  EXPECT_THAT(
      said("profile: 4m, data_id: 1"),
      ElementsAre("b.yaml:5:21: error: profile: expected one of 1, 2, 4, 5, 6, 7, 8, 11, 22, 44, found "
                  "'4m'"));
  EXPECT_THAT(said("profile: 4"), ElementsAre(HasSubstr("e2e: 'data_id' is missing")));
  EXPECT_THAT(said("profile: 5, data_id: 0x10000, data_bits: 320"),
              ElementsAre(HasSubstr("b.yaml:5:33: error: data_id: expected an id from 0x0000 to 0xffff")));
  EXPECT_THAT(said("profile: 5, data_id: 1"), ElementsAre(HasSubstr("e2e: 'data_bits' is missing")));
  EXPECT_THAT(said("profile: 5, data_id: 1, data_bits: 321"),
              ElementsAre(HasSubstr("b.yaml:5:47: error: data_bits: must be ")));
  EXPECT_THAT(said("profile: 4, data_id: 1, data_bits: 320"),
              ElementsAre(HasSubstr("unknown key 'data_bits' in e2e")));
  EXPECT_THAT(said("profile: 4, data_id: 1, offset_bits: 32"),
              ElementsAre(HasSubstr("b.yaml:5:49: error: offset_bits: must be at least 64")));
  EXPECT_THAT(said("profile: 4, data_id: 1, max_delta_counter: 0"),
              ElementsAre(HasSubstr("max_delta_counter: must be ")));
  EXPECT_THAT(
      said("profile: 2, data_bits: 320, data_id_list: [1, 2]"),
      ElementsAre(HasSubstr("data_id_list: expected 16 ids from 0 to 255, one for each counter, found 2")));
  EXPECT_THAT(said("profile: 1, data_id: 1, data_bits: 160, counter_offset_bits: 100"),
              ElementsAre(HasSubstr("data_id_nibble_offset_bits: must be neighbours")));
  EXPECT_THAT(said("profile: 4, data_id: 1, state_machine: {min_ok_init: 200}"),
              ElementsAre(HasSubstr(": must be ")));
}

TEST(E2eKeys, OfTheReceiverAreNotForTheSender) {
  EXPECT_THAT(
      problems_of(in_route("profile: 4, data_id: 1, failed: drop, state_machine: {min_ok_init: 2}", server)),
      ElementsAre(HasSubstr("error: failed: is for routes with direction: someip_to_dds"),
                  HasSubstr("error: state_machine: is for routes with direction: someip_to_dds")));
}

TEST(E2eKeys, AreShownByCheck) {
  const auto summary = [](const std::string& text) {
    const auto loaded = carry::parse_config(text, "b.yaml");
    return loaded ? carry::summary(loaded->config, {}) : to_string(loaded.error().front());
  };
  EXPECT_THAT(
      summary(in_route("profile: 4, data_id: 0x2d", server)),
      HasSubstr("  E2E   profile 4, data id 0x2d, header at bit 64 from the Request ID on; protected\n"));
  EXPECT_THAT(
      summary(in_route("profile: 11, data_id: 7, data_bits: 64, payload_only: true, failed: pass")),
      HasSubstr(
          "  E2E   profile 11, data id 0x7, CRC at bit 0, counter at bit 8, always 64 bits of the payload "
          "alone; checked, what fails is carried\n"));
  EXPECT_THAT(summary(in_route("profile: 4, data_id: 1") + "diagnostics: {topic: /d, period: 2 s}\n"),
              HasSubstr("checks are published on /d, every 2 s and when a state changes\n"));
}

TEST(DiagnosticsKeys, AreReadAndChecked) {
  const std::string route = in_route("profile: 4, data_id: 1");
  const auto loaded = carry::parse_config(route + "diagnostics: {topic: /d, period: 2 s}\n", "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->config.diagnostics.topic, "/d");
  EXPECT_EQ(loaded->config.diagnostics.period, 2s);
  EXPECT_TRUE(loaded->config.diagnostics.wanted);
  const auto usual = carry::parse_config(route, "b.yaml");
  ASSERT_TRUE(usual.has_value());
  EXPECT_EQ(usual->config.diagnostics.topic, "/diagnostics");
  EXPECT_EQ(usual->config.diagnostics.period, 1s);
  EXPECT_FALSE(usual->config.diagnostics.wanted);
  EXPECT_THAT(
      problems_of(route + "diagnostics: {topic: d, period: 1 ms}\n"),
      ElementsAre(HasSubstr("b.yaml:6:22: error: topic: expected "), HasSubstr("error: period: expected ")));
  EXPECT_THAT(problems_of(route + "diagnostics: {topic: /a}\n"),
              ElementsAre(HasSubstr("b.yaml:3:23: error: type: /a is where the diagnostics")));
}

}  // namespace
}  // namespace trestle::test::e2e_keys_test
