#include <fmt/format.h>

#include <functional>
#include <limits>

#include "bridge/carry/config/elements.hpp"
#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/layout.hpp"

namespace trestle::carry {
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

documents::Format<e2e::Config> event_profile() {
  return documents::one_of<e2e::Config>({{"1", e2e::Profile1{}},
                                         {"2", e2e::Profile2{}},
                                         {"4", e2e::Profile4{}},
                                         {"5", e2e::Profile5{}},
                                         {"6", e2e::Profile6{}},
                                         {"7", e2e::Profile7{}},
                                         {"8", e2e::Profile8{}},
                                         {"11", e2e::Profile11{}},
                                         {"22", e2e::Profile22{}},
                                         {"44", e2e::Profile44{}}});
}

// Profiles 4m, 7m and 44m distinguish requests from answers.
documents::Format<e2e::Config> method_profile() {
  const auto with_m = documents::one_of<e2e::Config>(
      {{"4m", e2e::Profile4m{}}, {"7m", e2e::Profile7m{}}, {"44m", e2e::Profile44m{}}});
  const documents::Format<e2e::Config> others = event_profile();
  return {others.expected + ", 4m, 7m, 44m",
          [with_m, others](std::string_view text) -> std::optional<e2e::Config> {
            const auto found = with_m.read(text);
            return found ? found : others.read(text);
          }};
}

bool has_source_id(const e2e::Config& profile) {
  return std::holds_alternative<e2e::Profile4m>(profile) || std::holds_alternative<e2e::Profile7m>(profile) ||
         std::holds_alternative<e2e::Profile44m>(profile);
}

/// @param refused  called for each given key that only receivers have; reports it if it is not allowed.
std::optional<E2eSettings> load_settings(documents::Section& section,
                                         const documents::Format<e2e::Config>& profiles,
                                         const std::function<void(const char*)>& refused,
                                         documents::Problems& problems) {
  E2eSettings settings;
  if (!section.require("profile", profiles, settings.profile)) {
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
  if (has_source_id(settings.profile)) {
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

}  // namespace

std::optional<E2eSettings> load_e2e(const YAML::Node& node, std::optional<Direction> known,
                                    documents::Problems& problems) {
  documents::Section section{node, "e2e", problems};
  const auto refused = [&](const char* key) {
    if (known == Direction::dds_to_someip) {
      problems.error(section.use_mark(key),
                     fmt::format("{}: is for routes with direction: someip_to_dds", key));
    }
  };
  return load_settings(section, event_profile(), refused, problems);
}

std::optional<E2eSettings> load_method_e2e(const YAML::Node& node, std::optional<Server> known,
                                           documents::Problems& problems) {
  documents::Section section{node, "e2e", problems};
  const auto refused = [&](const char* key) {
    if (known == Server::ros && std::string_view{key} == "source_id") {
      problems.error(
          section.use_mark(key),
          "source_id: identifies the caller, with server: someip; an answer has the id of its request");
    }
  };
  return load_settings(section, method_profile(), refused, problems);
}

void load_e2e_of_parts(documents::Section& section, std::optional<Server> known,
                       std::initializer_list<E2ePart> parts, documents::Problems& problems) {
  const YAML::Node node = section.child("e2e");
  if (!node) {
    return;
  }
  documents::Section of_parts{node, "e2e", problems};
  for (const E2ePart& part : parts) {
    const YAML::Node settings = of_parts.child(part.key);
    if (!settings) {
      continue;
    }
    std::optional<Direction> direction;
    if (known) {
      direction = *known == Server::ros ? Direction::dds_to_someip : Direction::someip_to_dds;
    }
    *part.into =
        part.is_event ? load_e2e(settings, direction, problems) : load_method_e2e(settings, known, problems);
  }
  of_parts.finish();
}

}  // namespace trestle::carry
