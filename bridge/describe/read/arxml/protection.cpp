// End-to-end protection, of the Adaptive Platform and of Classic.
#include <algorithm>
#include <array>

#include "bridge/describe/read/arxml/adaptive.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

namespace {

struct NumberKey {
  Tag tag;
  const char* key;
};
constexpr std::array profile_numbers{
    NumberKey{"MAX-DELTA-COUNTER"_tag, "max_delta_counter"},
    NumberKey{"MAX-NO-NEW-OR-REPEATED-DATA"_tag, "max_no_new_or_repeated_data"},
    NumberKey{"SYNC-COUNTER-INIT"_tag, "sync_counter_init"},
    NumberKey{"COUNTER-OFFSET"_tag, "counter_offset_bits"},
    NumberKey{"CRC-OFFSET"_tag, "crc_offset_bits"},
    NumberKey{"DATA-ID-NIBBLE-OFFSET"_tag, "data_id_nibble_offset_bits"},
    NumberKey{"OFFSET"_tag, "offset_bits"},
    NumberKey{"WINDOW-SIZE-INIT"_tag, "window_size_init"},
    NumberKey{"WINDOW-SIZE-VALID"_tag, "window_size_valid"},
    NumberKey{"WINDOW-SIZE-INVALID"_tag, "window_size_invalid"},
    NumberKey{"MIN-OK-STATE-INIT"_tag, "min_ok_init"},
    NumberKey{"MIN-OK-STATE-VALID"_tag, "min_ok_valid"},
    NumberKey{"MIN-OK-STATE-INVALID"_tag, "min_ok_invalid"},
    NumberKey{"MAX-ERROR-STATE-INIT"_tag, "max_error_init"},
    NumberKey{"MAX-ERROR-STATE-VALID"_tag, "max_error_valid"},
    NumberKey{"MAX-ERROR-STATE-INVALID"_tag, "max_error_invalid"},
};
constexpr std::array element_numbers{
    NumberKey{"DATA-LENGTH"_tag, "data_bits"},
    NumberKey{"MIN-DATA-LENGTH"_tag, "min_data_bits"},
    NumberKey{"MAX-DATA-LENGTH"_tag, "max_data_bits"},
    NumberKey{"SOURCE-ID"_tag, "source_id"},
};

}  // namespace

Protection protection_of(const Node* profile, const Node* properties, const Node* compatibility,
                         Problems& problems) {
  Protection protection;
  const auto numbers = [&](const Node* node, const auto& keys) {
    for (const NumberKey& key : keys) {
      const Node* const found = node == nullptr ? nullptr : node->child(key.tag);
      if (const auto value = number_in(found, 0, 0xffff'ffff, problems)) {
        protection.numbers[key.key] = *value;
      }
    }
  };
  numbers(profile, profile_numbers);
  numbers(properties, element_numbers);
  if (profile != nullptr) {
    std::string name{profile->child_text("PROFILE-NAME"_tag)};
    if (const std::size_t digits = name.find_first_of("0123456789"); digits != std::string::npos) {
      name.erase(0, digits);                 // PROFILE_04
      std::ranges::replace(name, 'M', 'm');  // PROFILE_04M
    }
    name.erase(0, std::min(name.find_first_not_of('0'), name.size()));
    protection.profile = name;
    const std::string_view mode = profile->child_text("DATA-ID-MODE"_tag);
    if (mode == "ALL-16-BIT") {
      protection.words["data_id_mode"] = "both";
    } else if (mode == "ALTERNATING-8-BIT") {
      protection.words["data_id_mode"] = "alternating";
    } else if (mode == "LOWER-8-BIT") {
      protection.words["data_id_mode"] = "low";
    } else if (mode == "LOWER-12-BIT") {
      protection.words["data_id_mode"] = "nibble";
    }
    if (const auto clears = boolean(profile->child_text("CLEAR-FROM-VALID-TO-INVALID"_tag))) {
      protection.words["clear_to_invalid"] = *clears ? "true" : "false";
    }
    if (compatibility != nullptr) {
      if (const auto extended = boolean(compatibility->child_text("TRANSIT-TO-INVALID-EXTENDED"_tag))) {
        protection.words["transit_to_invalid_extended"] = *extended ? "true" : "false";
      }
    }
    const std::string_view behavior = profile->child_text("PROFILE-BEHAVIOR"_tag);
    if (behavior == "PRE-R-4-2") {
      protection.words["behavior"] = "pre_r4_2";
    } else if (behavior == "R-4-2") {
      protection.words["behavior"] = "r4_2";
    }
  }
  std::vector<std::uint32_t> ids;
  each_in(properties, "DATA-IDS"_tag, "DATA-ID"_tag, [&](const Node& id) {
    if (const auto value = number_in(&id, 0, 0xffff'ffff, problems)) {
      ids.push_back(*value);
    }
  });
  if (ids.size() == 1) {
    protection.numbers["data_id"] = ids.front();
  } else if (!ids.empty()) {
    std::string& list = protection.words["data_id_list"];
    for (const std::uint32_t id : ids) {
      list += (list.empty() ? "" : " ") + std::to_string(id);
    }
  }
  return protection;
}

// --- which elements have it ------------------------------------------------------------------------------

namespace {

/// Adds what another instance says of one element: servers need not say what only clients do.
/// @return the first key of which they say something else, or "".
[[nodiscard]] std::string add(Protection& to, const Protection& from) {
  if (to.profile != from.profile) {
    return "PROFILE-NAME";
  }
  std::string other;
  const auto join = [&](auto& known, const auto& further) {
    for (const auto& [key, value] : further) {
      const auto [there, is_new] = known.try_emplace(key, value);
      if (!is_new && there->second != value && other.empty()) {
        other = key;
      }
    }
  };
  join(to.numbers, from.numbers);
  join(to.words, from.words);
  return other;
}

}  // namespace

void Adaptive::find_protections() {
  const auto find = [&](Tag kind, Tag reference) {
    for (const Node* const properties : tree_.all(kind)) {
      const Node* const target = tree_.follow(properties, reference);
      if (target == nullptr) {
        problems_.warning(properties->place(), Tree::path(properties) + " is left out: its " +
                                                   std::string{to_string(reference)} +
                                                   " is missing, or names nothing in the files");
      } else {
        protections_[target].push_back(properties);
      }
    }
  };
  find("END-2-END-EVENT-PROTECTION-PROPS"_tag, "EVENT-REF"_tag);
  find("END-2-END-METHOD-PROTECTION-PROPS"_tag, "METHOD-REF"_tag);
}

void Adaptive::read_protection(const Node* target, Protection& protection) {
  const auto found = protections_.find(target);
  if (found == protections_.end()) {
    return;
  }
  for (const Node* const properties : found->second) {
    const Node* const profile = tree_.follow(properties, "E-2-E-PROFILE-CONFIGURATION-REF"_tag);
    const Protection one = protection_of(
        profile, properties, tree_.follow(profile, "E-2-E-PROFILE-COMPATIBILITY-PROPS-REF"_tag), problems_);
    if (one.profile.empty()) {
      problems_.warning(properties->place(), Tree::path(properties) +
                                                 " is left out: the profile that it refers to has no "
                                                 "PROFILE-NAME, or is in none of the files");
    } else if (protection.profile.empty()) {
      protection = one;
    } else if (const std::string other = add(protection, one); !other.empty()) {
      problems_.warning(properties->place(), Tree::path(properties) + " has another " + other +
                                                 " than another instance of the service: what was read "
                                                 "first is taken for all instances");
    }
  }
}

void Adaptive::read_protections(const Parts& parts) {
  for (const auto& [node, event] : parts.events) {
    read_protection(node, event->e2e);
  }
  for (const auto& [node, method] : parts.methods) {
    read_protection(node, method->e2e);
  }
  for (const auto& [node, field] : parts.fields) {
    read_protection(node, field->e2e);
  }
  for (const auto& [node, protection] : parts.calls) {
    read_protection(node, *protection);
  }
}

}  // namespace trestle::describe::arxml
