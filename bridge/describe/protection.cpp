#include "bridge/describe/protection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "bridge/describe/e2e_profiles.hpp"
#include "someip/core/e2e/config.hpp"

namespace trestle::describe {
namespace {

std::optional<ProtectionHeader> own_header(const Protection& e2e) {
  if (e2e.profile.empty()) {
    return ProtectionHeader{};
  }
  const auto profiles = e2e_profiles();
  const auto profile = std::ranges::find(profiles, std::string_view{e2e.profile}, &E2eProfile::name);
  if (profile == profiles.end()) {
    return std::nullopt;
  }
  const auto only = e2e.words.find("payload_only");
  const std::uint64_t front =
      only != e2e.words.end() && only->second == "true" ? 0 : someip::e2e::someip_offset_bits;
  std::uint64_t begin = front;
  if (e2e.profile == "1" || e2e.profile == "11") {
    const auto offset = [&](std::string_view key, std::uint64_t otherwise) {
      const auto found = e2e.numbers.find(key);
      return found == e2e.numbers.end() ? otherwise : found->second;
    };
    begin = std::min(offset("crc_offset_bits", front), offset("counter_offset_bits", front + 8));
  } else if (const auto offset = e2e.numbers.find("offset_bits"); offset != e2e.numbers.end()) {
    begin = offset->second;
  }
  if (begin < front) {
    return std::nullopt;
  }
  return ProtectionHeader{static_cast<std::size_t>((begin - front) / 8), profile->header_bytes};
}

/// What one instance has otherwise: "profile 5, data_id 7".
std::string other_settings(const Protection& usual, const Protection& its) {
  if (its.profile.empty()) {
    return "none";
  }
  std::string text = its.profile == usual.profile ? std::string{} : "profile " + its.profile;
  const auto add = [&](const auto& known, const auto& settings, const auto& word) {
    for (const auto& [key, value] : settings) {
      if (const auto there = known.find(key); there == known.end() || there->second != value) {
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, word(key, value));
      }
    }
  };
  add(usual.numbers, its.numbers, [](const std::string& key, std::uint64_t value) {
    return key == "data_id" ? fmt::format("0x{:04x}", value) : fmt::to_string(value);
  });
  add(usual.words, its.words, [](const std::string&, const std::string& value) { return value; });
  return text.empty() ? "fewer settings" : text;
}

}  // namespace

std::optional<ProtectionHeader> protection_header(const Protection& e2e) {
  const std::optional<ProtectionHeader> header = own_header(e2e);
  const bool is_one = std::ranges::all_of(
      e2e.of_instances, [&](const auto& other) { return own_header(other.second) == header; });
  return is_one ? header : std::nullopt;
}

std::string no_header_text(const Protection& e2e) {
  return own_header(e2e) && !protection_header(e2e)
             ? "E2E protection that is not the same in all instances: " + other_instances(e2e)
             : "E2E profile " + e2e.profile;
}

std::string other_instances(const Protection& e2e) {
  constexpr std::size_t most = 3;
  std::string text;
  std::size_t told = 0;
  for (const auto& [instance, its] : e2e.of_instances) {
    if (told++ == most) {
      return text + fmt::format(", and others in {} more", e2e.of_instances.size() - most);
    }
    text += fmt::format("{}in instance 0x{:04x} {}", text.empty() ? "" : "; ", someip::value(instance),
                        other_settings(e2e, its));
  }
  return text;
}

std::string first_difference(const Protection& one, const Protection& other) {
  if (one.profile != other.profile) {
    return "profile";
  }
  const auto differing = [](const auto& all, const auto& others) {
    const auto found = std::ranges::find_if(all, [&](const auto& setting) {
      const auto there = others.find(setting.first);
      return there != others.end() && there->second != setting.second;
    });
    return found == all.end() ? std::string{} : found->first;
  };
  const std::string number = differing(one.numbers, other.numbers);
  if (!number.empty()) {
    return number;
  }
  // One id and a list are two ways to say the same.
  const auto has_id = [](const Protection& e2e) { return e2e.numbers.contains("data_id"); };
  const auto has_list = [](const Protection& e2e) { return e2e.words.contains("data_id_list"); };
  if ((has_id(one) && !has_list(one) && has_list(other) && !has_id(other)) ||
      (has_list(one) && !has_id(one) && has_id(other) && !has_list(other))) {
    return "data_id_list";
  }
  return differing(one.words, other.words);
}

}  // namespace trestle::describe
