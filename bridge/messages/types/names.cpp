#include "bridge/messages/types/names.hpp"

#include <algorithm>
#include <vector>

#include "bridge/messages/types/characters.hpp"

namespace trestle::messages {
namespace {

// DDS names have room for 255 characters; ROS 2 keeps 8 of them for prefixes such as "rt".
constexpr std::size_t topic_characters_max = 247;

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t slash = 0; (slash = text.find('/')) != std::string_view::npos;) {
    parts.push_back(text.substr(0, slash));
    text.remove_prefix(slash + 1);
  }
  parts.push_back(text);
  return parts;
}

bool is_token(std::string_view token) {
  return !token.empty() && !is_digit(token.front()) && std::ranges::all_of(token, is_in_word);
}

/// "package/KIND/Name"
bool is_name_of(std::string_view kind, std::string_view name) {
  const auto parts = split(name);
  return parts.size() == 3 && parts[1] == kind && std::ranges::all_of(parts, is_token);
}

}  // namespace

bool is_topic_name(std::string_view name) {
  return name.starts_with('/') && name.size() <= topic_characters_max &&
         std::ranges::all_of(split(name.substr(1)), is_token);
}

bool is_type_name(std::string_view name) {
  return is_name_of("msg", name);
}

bool is_service_type_name(std::string_view name) {
  return is_name_of("srv", name);
}

bool is_action_type_name(std::string_view name) {
  return is_name_of("action", name);
}

std::string name_pattern(const std::string& kind) {
  const std::string token = "[A-Za-z_][A-Za-z0-9_]*";
  return "^" + token + "/" + kind + "/" + token + "$";
}

}  // namespace trestle::messages
