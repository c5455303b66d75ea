// End-to-end protection, of the Adaptive Platform and of Classic.
#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "bridge/describe/protection.hpp"
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

/// Adds what is said elsewhere of one element in the same instance: servers need not say what only clients
/// do.
void add(Protection& to, const Protection& from) {
  to.numbers.insert(from.numbers.begin(), from.numbers.end());
  to.words.insert(from.words.begin(), from.words.end());
}

/// Whether `one` cannot be added to what is known; tells so.
/// @param whose  what is known.
[[nodiscard]] bool differs(const SaidProtection& one, const Protection& known, const char* whose,
                           Problems& problems) {
  const std::string key = first_difference(known, one.e2e);
  if (!key.empty()) {
    problems.warning(one.node->place(), Tree::path(one.node) + " has another " +
                                            (key == "profile" ? "PROFILE-NAME" : key) + " than " + whose);
  }
  return !key.empty();
}

}  // namespace

std::optional<someip::InstanceId> said_instance_id(const Node* instance) {
  for (const Tag tag :
       {"SERVICE-INSTANCE-ID"_tag, "REQUIRED-SERVICE-INSTANCE-ID"_tag, "INSTANCE-IDENTIFIER"_tag}) {
    const Node* const text = instance == nullptr ? nullptr : instance->child(tag);
    const auto id = text == nullptr ? std::nullopt : integer(text->text);
    if (id && *id > 0 && *id < 0xffff) {
      return static_cast<someip::InstanceId>(static_cast<std::uint16_t>(*id));
    }
  }
  return std::nullopt;
}

Protection joined(const std::vector<SaidProtection>& all, Problems& problems) {
  // Said for providers of an instance, and for its users.
  std::vector<std::pair<someip::InstanceId, Protection>> instances;
  std::map<someip::InstanceId, std::size_t> places;
  Protection open;  // what is said without an instance
  for (const SaidProtection& one : all) {
    for (const someip::InstanceId id : one.instances) {
      const auto [known, is_new] = places.try_emplace(id, instances.size());
      if (is_new) {
        instances.emplace_back(id, one.e2e);
      } else if (Protection& its = instances[known->second].second;
                 !differs(one, its, "is said of the same instance elsewhere: what was read first is taken",
                          problems)) {
        add(its, one.e2e);
      }
    }
    if (one.instances.empty() && open.profile.empty()) {
      open = one.e2e;
    } else if (one.instances.empty() &&
               !differs(one, open,
                        "another instance of the service: what was read first is taken, as the instances "
                        "have no ids",
                        problems)) {
      add(open, one.e2e);
    }
  }
  if (instances.empty()) {
    return open;
  }
  Protection usual = instances.front().second;
  std::vector<bool> is_usual;
  for (const auto& [id, its] : instances) {
    is_usual.push_back(first_difference(usual, its).empty());
    if (is_usual.back()) {
      add(usual, its);
    }
  }
  // What is said without an instance is of all that do not say otherwise.
  bool is_of_any = open.profile.empty();
  const auto add_open = [&](Protection& to) {
    if (!open.profile.empty() && first_difference(to, open).empty()) {
      add(to, open);
      is_of_any = true;
    }
  };
  add_open(usual);
  for (std::size_t at = 0; at < instances.size(); ++at) {
    auto& [id, its] = instances[at];
    if (!is_usual[at]) {
      add_open(its);
      usual.set(id, its);
    }
  }
  if (!is_of_any) {
    const auto first =
        std::ranges::find_if(all, [](const SaidProtection& one) { return one.instances.empty(); });
    (void)differs(*first, usual,
                  "another instance of the service: what was read first is taken, as its instance has no id",
                  problems);
  }
  return usual;
}

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

void Adaptive::add_protections(const Node* target, std::vector<SaidProtection>& said) {
  const auto found = protections_.find(target);
  if (found == protections_.end()) {
    return;
  }
  for (const Node* const properties : found->second) {
    const Node* const profile = tree_.follow(properties, "E-2-E-PROFILE-CONFIGURATION-REF"_tag);
    SaidProtection one{
        .e2e = protection_of(profile, properties,
                             tree_.follow(profile, "E-2-E-PROFILE-COMPATIBILITY-PROPS-REF"_tag), problems_),
        .node = properties};
    if (one.e2e.profile.empty()) {
      problems_.warning(properties->place(), Tree::path(properties) +
                                                 " is left out: the profile that it refers to has no "
                                                 "PROFILE-NAME, or is in none of the files");
      continue;
    }
    const Node* const provided = properties->above("PROVIDED-SOMEIP-SERVICE-INSTANCE"_tag);
    if (const auto id = said_instance_id(
            provided == nullptr ? properties->above("REQUIRED-SOMEIP-SERVICE-INSTANCE"_tag) : provided)) {
      one.instances = {*id};
    }
    said.push_back(std::move(one));
  }
}

void Adaptive::read_protections(const Parts& parts) {
  // Of one element by its prototype, by its deployment and by its notifier.
  std::map<Protection*, std::vector<SaidProtection>> said;
  for (const auto& [node, event] : parts.events) {
    add_protections(node, said[&event->e2e]);
  }
  for (const auto& [node, method] : parts.methods) {
    add_protections(node, said[&method->e2e]);
  }
  for (const auto& [node, field] : parts.fields) {
    add_protections(node, said[&field->e2e]);
  }
  for (const auto& [node, protection] : parts.calls) {
    add_protections(node, said[protection]);
  }
  for (const auto& [protection, all] : said) {
    *protection = joined(all, problems_);
  }
}

}  // namespace trestle::describe::arxml
