// End-to-end protection. AUTOSAR says it of each instance, the model of the service, and of instances that
// have another one.
#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "bridge/describe/member_names.hpp"
#include "bridge/describe/protection.hpp"
#include "bridge/describe/write/arxml/writer.hpp"
#include "bridge/documents/format.hpp"

namespace trestle::describe::arxml_writer {

namespace {

/// A key of a protection, and its element.
struct Key {
  const char* tag;
  const char* key;
};
/// Of a profile, in the order of the schema.
constexpr std::array profile_keys{
    Key{"CLEAR-FROM-VALID-TO-INVALID", "clear_to_invalid"},
    Key{"DATA-ID-MODE", "data_id_mode"},
    Key{"E-2-E-PROFILE-COMPATIBILITY-PROPS-REF", "transit_to_invalid_extended"},
    Key{"MAX-DELTA-COUNTER", "max_delta_counter"},
    Key{"MAX-ERROR-STATE-INIT", "max_error_init"},
    Key{"MAX-ERROR-STATE-INVALID", "max_error_invalid"},
    Key{"MAX-ERROR-STATE-VALID", "max_error_valid"},
    Key{"MIN-OK-STATE-INIT", "min_ok_init"},
    Key{"MIN-OK-STATE-INVALID", "min_ok_invalid"},
    Key{"MIN-OK-STATE-VALID", "min_ok_valid"},
    Key{"PROFILE-NAME", "profile"},
    Key{"WINDOW-SIZE-INIT", "window_size_init"},
    Key{"WINDOW-SIZE-INVALID", "window_size_invalid"},
    Key{"WINDOW-SIZE-VALID", "window_size_valid"},
};

/// What holds on the Adaptive Platform, which has no element to say it.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> always_so{{
    {"offset_bits", "64"},
    {"crc_offset_bits", "64"},
    {"counter_offset_bits", "72"},
    {"data_id_nibble_offset_bits", "76"},
    {"max_no_new_or_repeated_data", "14"},
    {"sync_counter_init", "0"},
    {"behavior", "r4_2"},
    {"crc_order", "little"},
    {"payload_only", "false"},
}};

/// "PROFILE_04", "PROFILE_44m".
[[nodiscard]] std::string profile_name(const std::string& profile) {
  const std::size_t digits = std::min(profile.find_first_not_of("0123456789"), profile.size());
  return (digits == 0 ? "" : digits == 1 ? "PROFILE_0" : "PROFILE_") + profile;
}

[[nodiscard]] std::string_view data_id_mode(std::string_view word) {
  return word == "both"          ? "ALL-16-BIT"
         : word == "alternating" ? "ALTERNATING-8-BIT"
         : word == "low"         ? "LOWER-8-BIT"
         : word == "nibble"      ? "LOWER-12-BIT"
                                 : "";
}

/// All keys as text.
[[nodiscard]] std::map<std::string, std::string> texts_of(const Protection& e2e) {
  std::map<std::string, std::string> texts{e2e.words.begin(), e2e.words.end()};
  for (const auto& [key, number] : e2e.numbers) {
    texts.insert_or_assign(key, std::to_string(number));
  }
  texts.insert_or_assign("profile", e2e.profile);
  // One element for what profiles 1 and 2 call otherwise.
  if (auto early = texts.extract("max_delta_counter_init"); !early.empty()) {
    early.key() = "max_delta_counter";
    texts.insert(std::move(early));
  }
  return texts;
}

/// Whether the schema takes it as a name of a profile.
[[nodiscard]] bool is_token(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  });
}

}  // namespace

/// The profile that has these settings, which are taken out of `texts`.
std::string Writer::profile_path(std::map<std::string, std::string>& texts) {
  const std::string package = std::string{own} + "/E2e";
  Xml xml;
  for (const Key& key : profile_keys) {
    const auto found = texts.find(key.key);
    if (found == texts.end()) {
      continue;
    }
    const std::string& value = found->second;
    const bool is_truth = value == "true" || value == "false";
    const std::string_view tag = key.tag;
    if (tag == "PROFILE-NAME") {
      xml.leaf(tag, profile_name(value));
    } else if (tag == "DATA-ID-MODE") {
      if (data_id_mode(value).empty()) {
        continue;
      }
      xml.leaf(tag, data_id_mode(value));
    } else if (tag == "CLEAR-FROM-VALID-TO-INVALID") {
      if (!is_truth) {
        continue;
      }
      xml.leaf(tag, value);
    } else if (tag == "E-2-E-PROFILE-COMPATIBILITY-PROPS-REF") {
      if (!is_truth) {
        continue;
      }
      const std::string name = value == "true" ? "Extended" : "NotExtended";
      Xml properties;
      properties.open("E-2-E-PROFILE-COMPATIBILITY-PROPS");
      properties.leaf("SHORT-NAME", name);
      properties.leaf("TRANSIT-TO-INVALID-EXTENDED", value);
      properties.close();
      packages_.add(package, name, properties.text());
      xml.reference(tag, "E-2-E-PROFILE-COMPATIBILITY-PROPS", package + "/" + name);
    } else {
      const auto number = documents::read_whole(value);
      if (!number) {
        continue;
      }
      xml.leaf(tag, std::to_string(*number));
    }
    texts.erase(found);
  }
  const auto [known, is_new] = profile_names_.try_emplace(xml.text());
  if (is_new) {
    known->second = "Profile" + std::to_string(profile_names_.size());
  }
  return package + "/Profiles/" + known->second;
}

void Writer::write_profiles() {
  if (profile_names_.empty()) {
    return;
  }
  std::map<std::string, const std::string*> sorted;
  for (const auto& [settings, name] : profile_names_) {
    sorted[name] = &settings;
  }
  Xml xml;
  xml.open("E-2-E-PROFILE-CONFIGURATION-SET");
  xml.leaf("SHORT-NAME", "Profiles");
  xml.open("E-2-E-PROFILE-CONFIGURATIONS");
  for (const auto& [name, settings] : sorted) {
    xml.open("E-2-E-PROFILE-CONFIGURATION");
    xml.leaf("SHORT-NAME", name);
    xml.raw(*settings);
    xml.close();
  }
  xml.close();
  xml.close();
  packages_.add(std::string{own} + "/E2e", "Profiles", xml.text());
}

/// What stands in END-2-END-…-PROTECTION-PROPS, without the name; empty: nothing does.
const std::string& Writer::protection_text(Protected& one, const Protection& e2e) {
  const auto [known, is_new] = one.texts.try_emplace(&e2e);
  if (is_new && is_token(e2e.profile)) {
    known->second = protection_of(one, e2e);
  } else if (is_new && !e2e.profile.empty()) {
    lost(one.element, "its E2E protection: profile is " + e2e.profile, one.place);
  }
  return known->second;
}

std::string Writer::protection_of(Protected& one, const Protection& e2e) {
  std::map<std::string, std::string> texts = texts_of(e2e);
  const bool has_list = e2e.profile == "2" || e2e.profile == "22";
  const std::string profile = profile_path(texts);
  const auto take = [&](const char* key) {
    const auto found = texts.find(key);
    const auto number = found == texts.end() ? std::nullopt : documents::read_whole(found->second);
    if (number) {
      texts.erase(found);
    }
    return number;
  };
  Xml xml;
  std::vector<std::uint64_t> ids;
  if (const auto list = texts.find("data_id_list");
      list != texts.end() && (has_list || !texts.contains("data_id"))) {
    std::istringstream words{list->second};
    bool all_are_numbers = true;
    for (std::string word; words >> word;) {
      const auto id = documents::read_whole(word);
      all_are_numbers = all_are_numbers && id;
      ids.push_back(id.value_or(0));
    }
    if (all_are_numbers) {
      texts.erase(list);
    } else {
      ids.clear();
    }
  } else if (const auto id = take("data_id")) {
    ids.push_back(*id);
  }
  if (!ids.empty()) {
    xml.open("DATA-IDS");
    for (const std::uint64_t id : ids) {
      xml.leaf("DATA-ID", std::to_string(id));
    }
    xml.close();
  }
  const auto length = [&](const char* tag, const char* key) {
    if (const auto bits = take(key)) {
      xml.leaf(tag, std::to_string(*bits));
    }
  };
  length("DATA-LENGTH", "data_bits");
  xml.reference("E-2-E-PROFILE-CONFIGURATION-REF", "E-2-E-PROFILE-CONFIGURATION", profile);
  if (one.is_event) {
    xml.reference("EVENT-REF", "SOMEIP-EVENT-DEPLOYMENT", one.path);
  }
  length("MAX-DATA-LENGTH", "max_data_bits");
  if (!one.is_event) {
    xml.reference("METHOD-REF", "SOMEIP-METHOD-DEPLOYMENT", one.path);
  }
  length("MIN-DATA-LENGTH", "min_data_bits");
  if (!one.is_event) {
    length("SOURCE-ID", "source_id");
  }
  for (const auto& [key, value] : texts) {
    if (std::ranges::find(always_so, std::pair<std::string_view, std::string_view>{key, value}) ==
        always_so.end()) {
      std::string what = "its E2E protection: " + key + " is " + value;
      if (one.told.insert(what).second) {
        lost(one.element, std::move(what), one.place);
      }
    }
  }
  return xml.text();
}

void Writer::note_protections(const Service& service, const std::string& deployment) {
  const std::string full = full_name(service.scope, service.name);
  const std::map<std::string, std::string>& names = member_names_[full];
  std::vector<Protected>& all = protected_[full];
  const auto add = [&](const Protection& e2e, bool is_event, const std::string& name, const char* part,
                       std::string element, Place place) {
    if (e2e.empty()) {
      return;
    }
    all.push_back({.e2e = &e2e,
                   .is_event = is_event,
                   .path = deployment + "/" + name + part,
                   .name = "E2e_" + name + part,
                   .element = std::move(element),
                   .place = place});
  };
  for (const Event& event : service.events) {
    add(event.e2e, true, names.at("event " + member_key(event.name, event.selector)), "",
        service.name + "." + event.name, event.place);
  }
  for (const Field& field : service.fields) {
    const auto name = names.find("field " + field.name);
    if (name == names.end()) {
      continue;  // the field is listed
    }
    const std::string element = service.name + "." + field.name;
    if (field.has_notifier) {
      add(field.e2e, true, name->second, "/notify", element, field.place);
    }
    if (field.has_getter) {
      add(field.getter_e2e, false, name->second, "/get", element + ".getter", field.place);
    }
    if (field.has_setter) {
      add(field.setter_e2e, false, name->second, "/set", element + ".setter", field.place);
    }
  }
  for (const Method& method : service.methods) {
    add(method.e2e, false, names.at("method " + member_key(method.name, method.selector)), "",
        service.name + "." + method.name, method.place);
  }
}

void Writer::write_protections(Xml& xml, const Instance& instance) {
  const auto found = protected_.find(instance.service);
  if (found == protected_.end() || found->second.empty()) {
    return;
  }
  std::vector<Protected>& all = found->second;
  if (protection_count_ + all.size() > max_protections) {
    lost(label_of(instance), "the E2E protection of its elements: there are too many", instance.place);
    return;
  }
  protection_count_ += all.size();
  Names names;
  for (const bool events : {true, false}) {
    const std::string kind = events ? "EVENT" : "METHOD";
    Xml list;
    for (Protected& one : all) {
      if (one.is_event != events) {
        continue;
      }
      const std::string& text = protection_text(one, one.e2e->of(instance.id));
      if (text.empty()) {
        continue;
      }
      list.open("END-2-END-" + kind + "-PROTECTION-PROPS");
      list.leaf("SHORT-NAME", names.take(short_name(one.name)));
      list.raw(text);
      list.close();
    }
    if (!list.text().empty()) {
      xml.open("E-2-E-" + kind + "-PROTECTION-PROPSS");
      xml.raw(list.text());
      xml.close();
    }
  }
}

void Writer::list_unwritten_protections() {
  for (const auto& of_service : protected_) {
    for (const Protected& one : of_service.second) {
      if (one.texts.empty()) {
        lost(one.element, "its E2E protection: its service has no instance", one.place);
        continue;
      }
      Protection gone = *one.e2e;
      std::erase_if(gone.of_instances, [&](const auto& its) {
        return std::ranges::any_of(model_.instances, [&](const Instance& instance) {
          return instance.service == of_service.first && instance.id == its.first;
        });
      });
      if (const std::string text = other_instances(gone); !text.empty()) {
        lost(one.element, "its E2E protection " + text + ": there is no such instance", one.place);
      }
    }
  }
}

}  // namespace trestle::describe::arxml_writer
