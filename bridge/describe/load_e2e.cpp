#include "bridge/describe/load_e2e.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/describe/e2e_profiles.hpp"
#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/layout.hpp"

namespace trestle::describe {
namespace {

namespace e2e = someip::e2e;

void load_sequence(documents::Section& section, e2e::EarlySequence& into) {
  section.read("max_delta_counter_init", documents::as<std::uint8_t>(documents::whole_number(0, 14)),
               into.max_delta_counter_init);
  section.read("max_no_new_or_repeated_data", documents::as<std::uint8_t>(documents::whole_number(0, 15)),
               into.max_no_new_or_repeated_data);
  section.read("sync_counter_init", documents::as<std::uint8_t>(documents::whole_number(0, 15)),
               into.sync_counter_init);
  section.read("behavior",
               documents::one_of<e2e::Behavior>(
                   {{"r4_2", e2e::Behavior::r4_2}, {"pre_r4_2", e2e::Behavior::pre_r4_2}}),
               into.behavior);
}

// The keys have the names of the fields: a field that the profile does not have is an unknown key. Values are
// checked when all of them are known.
template <typename Profile>
void load_profile(documents::Section& section, bool payload_only, Profile& into,
                  documents::Problems& problems) {
  const auto number =
      documents::as<std::uint32_t>(documents::whole_number(0, std::numeric_limits<std::uint32_t>::max()));
  const std::uint32_t front = payload_only ? 0 : e2e::someip_offset_bits;
  if constexpr (requires { into.data_id; }) {
    using Id = decltype(into.data_id);
    section.require("data_id", documents::as<Id>(documents::id_number(0, std::numeric_limits<Id>::max())),
                    into.data_id);
  }
  if constexpr (requires { into.data_id_list; }) {
    std::vector<std::uint8_t> ids;
    std::vector<documents::Mark> marks;
    section.read_list("data_id_list", documents::as<std::uint8_t>(documents::id_number(0, 255)), ids, marks);
    if (ids.size() == into.data_id_list.size()) {
      std::copy(ids.begin(), ids.end(), into.data_id_list.begin());
    } else {
      problems.error(
          section.use_mark("data_id_list"),
          fmt::format("data_id_list: expected 16 ids from 0 to 255, one for each counter, found {}",
                      ids.size()));
    }
  }
  if constexpr (requires { into.data_id_mode; }) {
    section.read("data_id_mode",
                 documents::one_of<e2e::DataIdMode>({{"both", e2e::DataIdMode::both},
                                                     {"alternating", e2e::DataIdMode::alternating},
                                                     {"low", e2e::DataIdMode::low},
                                                     {"nibble", e2e::DataIdMode::nibble}}),
                 into.data_id_mode);
  }
  if constexpr (requires { into.data_bits; }) {
    section.require("data_bits", number, into.data_bits);
  }
  if constexpr (requires { into.offset_bits; }) {
    into.offset_bits = front;
    section.read("offset_bits", number, into.offset_bits);
  } else {
    into.crc_offset_bits = front;
    into.counter_offset_bits = front + 8;
    into.data_id_nibble_offset_bits = front + 12;
    section.read("crc_offset_bits", number, into.crc_offset_bits);
    section.read("counter_offset_bits", number, into.counter_offset_bits);
    section.read("data_id_nibble_offset_bits", number, into.data_id_nibble_offset_bits);
  }
  if constexpr (requires { into.max_data_bits; }) {
    section.read("min_data_bits", number, into.min_data_bits);
    section.read("max_data_bits", number, into.max_data_bits);
  }
  if constexpr (requires { into.max_delta_counter; }) {
    section.read("max_delta_counter", number, into.max_delta_counter);
  }
  if constexpr (requires { into.crc_order; }) {
    section.read("crc_order",
                 documents::one_of<std::endian>({{"little", std::endian::little}, {"big", std::endian::big}}),
                 into.crc_order);
  }
  if constexpr (requires { into.sequence; }) {
    load_sequence(section, into.sequence);
  }
}

void load_state_machine(const YAML::Node& node, e2e::StateMachineConfig& into,
                        documents::Problems& problems) {
  documents::Section section{node, "state_machine", problems};
  const auto count = documents::as<std::uint8_t>(documents::whole_number(0, 255));
  section.read("window_size_init", count, into.window_size_init);
  section.read("window_size_valid", count, into.window_size_valid);
  section.read("window_size_invalid", count, into.window_size_invalid);
  section.read("min_ok_init", count, into.min_ok_init);
  section.read("min_ok_valid", count, into.min_ok_valid);
  section.read("min_ok_invalid", count, into.min_ok_invalid);
  section.read("max_error_init", count, into.max_error_init);
  section.read("max_error_valid", count, into.max_error_valid);
  section.read("max_error_invalid", count, into.max_error_invalid);
  section.read("clear_to_invalid", documents::truth(), into.clear_to_invalid);
  section.read("transit_to_invalid_extended", documents::truth(), into.transit_to_invalid_extended);
  section.finish();
  if (const auto machine = e2e::StateMachine::create(into); !machine) {
    const std::string field{machine.error().field};
    problems.error(section.use_mark(field.c_str()),
                   fmt::format("{}: must be {}", field, machine.error().must));
  }
}

// Checks that a message can have the layout that results from the settings.
void check_layout(const documents::Section& section, const E2eSettings& settings,
                  documents::Problems& problems) {
  const auto layout = e2e::make_layout(settings.profile);
  if (!layout) {
    const std::string field{layout.error().field};
    problems.error(section.use_mark(field.c_str()),
                   fmt::format("{}: must be {}", field, layout.error().must));
  } else if (!settings.payload_only && layout->header_at() < e2e::someip_offset_bits / 8) {
    problems.error(section.use_mark("offset_bits"),
                   "offset_bits: must be at least 64, behind the SOME/IP header (or set payload_only)");
  } else if (!layout->header_bytes()) {
    problems.error(section.use_mark("crc_offset_bits"),
                   "crc_offset_bits, counter_offset_bits, data_id_nibble_offset_bits: must be neighbours");
  }
}

/// @param is_method  it may be one of those that distinguish requests from answers.
documents::Format<e2e::Config> profile_name(bool is_method) {
  std::vector<E2eProfile> known;
  std::ranges::copy_if(e2e_profiles(), std::back_inserter(known),
                       [&](const E2eProfile& one) { return is_method || !one.is_for_methods; });
  std::string expected = "one of ";
  documents::Shape shape{.kind = documents::Shape::Kind::words};
  for (const E2eProfile& one : known) {
    expected += (shape.words.empty() ? "" : ", ") + std::string{one.name};
    shape.words.emplace_back(one.name);
  }
  return {std::move(expected),
          [known = std::move(known)](std::string_view text) -> std::optional<e2e::Config> {
            const auto found = std::ranges::find(known, text, &E2eProfile::name);
            return found == known.end() ? std::nullopt : std::optional{found->settings};
          },
          std::move(shape)};
}

constexpr std::array sequence_keys{"max_delta_counter_init", "max_no_new_or_repeated_data",
                                   "sync_counter_init", "behavior"};
constexpr std::array machine_keys{"window_size_init",
                                  "window_size_valid",
                                  "window_size_invalid",
                                  "min_ok_init",
                                  "min_ok_valid",
                                  "min_ok_invalid",
                                  "max_error_init",
                                  "max_error_valid",
                                  "max_error_invalid",
                                  "clear_to_invalid",
                                  "transit_to_invalid_extended"};

/// Whether a profile has such a parameter. Descriptions often have those of all profiles.
bool has_key(std::string_view profile, std::string_view key) {
  const auto is = [](std::string_view one, auto... others) { return ((one == others) || ...); };
  const bool early = is(profile, "1", "2");
  const bool with_list = is(profile, "2", "22");
  const bool with_places = is(profile, "1", "11");
  const bool any_length = !early && !with_list && !with_places && profile != "5";
  if (std::ranges::find(sequence_keys, key) != sequence_keys.end()) {
    return early;
  }
  return is(key, "payload_only") || (key == "data_id" && !with_list) ||
         (key == "data_id_list" && with_list) || (key == "data_bits" && !any_length) ||
         (key == "offset_bits" && !with_places) ||
         (is(key, "data_id_mode", "crc_offset_bits", "counter_offset_bits", "data_id_nibble_offset_bits") &&
          with_places) ||
         (is(key, "min_data_bits", "max_data_bits") && any_length) ||
         (key == "max_delta_counter" && !early) || (key == "crc_order" && profile == "5") ||
         (key == "source_id" && profile.ends_with('m'));
}

}  // namespace

std::optional<E2eSettings> load_e2e(documents::Section& section, bool is_method,
                                    const std::function<void(const char*)>& refused,
                                    documents::Problems& problems) {
  E2eSettings settings;
  if (!section.require("profile", profile_name(is_method), settings.profile)) {
    return std::nullopt;  // which keys there are depends on it
  }
  section.read("payload_only", documents::truth(), settings.payload_only);
  std::visit([&](auto& profile) { load_profile(section, settings.payload_only, profile, problems); },
             settings.profile);
  if (const YAML::Node machine = section.child("state_machine")) {
    load_state_machine(machine, settings.state_machine, problems);
    refused("state_machine");
  }
  if (section.read("failed", documents::one_of<bool>({{"drop", false}, {"pass", true}}),
                   settings.pass_failed)) {
    refused("failed");
  }
  if (e2e_profile(settings.profile).is_for_methods) {
    constexpr std::uint32_t source_id_max = 0x0fff'ffff;  // it has 28 bits
    if (section.read("source_id", documents::as<std::uint32_t>(documents::id_number(0, source_id_max)),
                     settings.source_id)) {
      refused("source_id");
    }
  }
  section.finish();
  if (!problems.has_errors()) {  // otherwise the problem may be a value that was not read
    check_layout(section, settings, problems);
  }
  return settings;
}

YAML::Node e2e_yaml(const Protection& e2e, E2eUse use) {
  YAML::Node yaml{YAML::NodeType::Map};
  yaml["profile"] = e2e.profile;
  YAML::Node machine{YAML::NodeType::Map};
  const auto put = [&](std::string_view given, const std::string& value) {
    const bool early = e2e.profile == "1" || e2e.profile == "2";
    const std::string key{early && given == "max_delta_counter" ? "max_delta_counter_init" : given};
    if (std::ranges::find(machine_keys, key) != machine_keys.end()) {
      machine[key] = value;
    } else if (key == "data_id_list" && has_key(e2e.profile, key)) {
      std::istringstream ids{value};
      for (std::string id; ids >> id;) {
        yaml[key].push_back(id);
      }
    } else if (has_key(e2e.profile, key) && (key != "source_id" || use == E2eUse::called)) {
      yaml[key] = value;
    }
  };
  for (const auto& [key, number] : e2e.numbers) {
    const bool is_id = key == "data_id" || key == "source_id";
    put(key, is_id ? fmt::format("{:#06x}", number) : fmt::to_string(number));
  }
  for (const auto& [key, word] : e2e.words) {
    put(key, word);
  }
  if (machine.size() != 0 && use != E2eUse::sent_event) {
    yaml["state_machine"] = machine;
  }
  return yaml;
}

tl::expected<E2eSettings, std::string> e2e_settings(const Protection& e2e, E2eUse use) {
  documents::Problems problems{"e2e"};
  std::optional<E2eSettings> settings;
  {
    documents::Section section{e2e_yaml(e2e, use), "e2e", problems};
    const bool is_method = use == E2eUse::served || use == E2eUse::called;
    settings = load_e2e(
        section, is_method, [](const char*) {}, problems);
  }
  if (problems.has_errors() || !settings) {
    const std::vector<documents::Problem> all = problems.take();
    return tl::unexpected{all.empty() ? "no profile" : all.front().text};
  }
  return *settings;
}

std::string e2e_fault(const Protection& e2e, E2eUse use) {
  const auto settings =
      e2e.profile.empty() ? tl::expected<E2eSettings, std::string>{} : e2e_settings(e2e, use);
  return settings ? std::string{} : settings.error();
}

WireSettings wire_settings(const Protection& e2e) {
  WireSettings settings{.profile = e2e.profile};
  for (const auto& [profile, same] :
       {std::pair{"11", "1"}, std::pair{"22", "2"}, std::pair{"44", "4"}, std::pair{"44m", "4m"}}) {
    if (e2e.profile == profile) {
      settings.profile = same;
    }
  }
  /// Empty: nobody gave it.
  const auto given = [&](std::string_view key) -> std::string {
    if (const auto number = e2e.numbers.find(key); number != e2e.numbers.end()) {
      return key == "data_id" ? fmt::format("{:#06x}", number->second) : fmt::to_string(number->second);
    }
    const auto word = e2e.words.find(key);
    return word == e2e.words.end() ? std::string{} : word->second;
  };
  const auto put = [&](const char* key, const std::string& otherwise) {
    std::string value = given(key);
    if (value.empty()) {
      value = otherwise;
    }
    if (has_key(e2e.profile, key) && !value.empty()) {
      settings.values.emplace(key, std::move(value));
    }
  };
  if (e2e.profile.empty()) {
    return settings;
  }
  const std::uint32_t front = given("payload_only") == "true" ? 0 : e2e::someip_offset_bits;
  put("payload_only", "false");
  put("data_id", {});
  put("data_bits", {});
  put("offset_bits", fmt::to_string(front));
  put("crc_offset_bits", fmt::to_string(front));
  put("counter_offset_bits", fmt::to_string(front + 8));
  put("data_id_mode", "both");
  if (given("data_id_mode") == "nibble") {
    put("data_id_nibble_offset_bits", fmt::to_string(front + 12));
  }
  put("crc_order", "little");
  std::string list;
  std::istringstream ids{given("data_id_list")};
  for (std::string id; ids >> id;) {
    const auto number = documents::read_whole(id);
    list += (list.empty() ? "" : " ") + (number ? fmt::to_string(*number) : id);
  }
  if (has_key(e2e.profile, "data_id_list") && !list.empty()) {
    settings.values.emplace("data_id_list", std::move(list));
  }
  return settings;
}

}  // namespace trestle::describe
