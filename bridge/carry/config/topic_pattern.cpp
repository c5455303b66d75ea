#include "bridge/carry/config/topic_pattern.hpp"

#include <algorithm>
#include <vector>

#include "bridge/messages/types/names.hpp"

namespace trestle::carry {
namespace {

constexpr std::string_view any_levels = "**";

std::vector<std::string_view> levels_of(std::string_view name) {
  std::vector<std::string_view> levels;
  name.remove_prefix(1);
  for (std::size_t slash = 0; (slash = name.find('/')) != std::string_view::npos;) {
    levels.push_back(name.substr(0, slash));
    name.remove_prefix(slash + 1);
  }
  levels.push_back(name);
  return levels;
}

bool is_hidden(std::string_view level) {
  return level.starts_with('_');
}

/// Compares one level, in which each '*' stands for any characters. Only the last '*' is ever extended, so
/// this takes at most as many steps as the product of both lengths.
bool level_matches(std::string_view pattern, std::string_view level) {
  if (is_hidden(level) && !is_hidden(pattern)) {
    return false;
  }
  std::size_t at = 0;
  std::size_t in_pattern = 0;
  std::size_t star = std::string_view::npos;  // the last '*' that was passed ...
  std::size_t taken = 0;                      // ... and the end of the text that it matches
  while (at < level.size()) {
    if (in_pattern < pattern.size() && pattern[in_pattern] == '*') {
      star = in_pattern++;
      taken = at;
    } else if (in_pattern < pattern.size() && pattern[in_pattern] == level[at]) {
      ++in_pattern;
      ++at;
    } else if (star != std::string_view::npos) {
      in_pattern = star + 1;
      at = ++taken;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', in_pattern) == std::string_view::npos;
}

}  // namespace

bool is_topic_pattern(std::string_view pattern) {
  // With every '*' replaced by a letter it must be a valid name; "**" must be a whole level.
  std::string name{pattern};
  std::ranges::replace(name, '*', 'x');
  return messages::is_topic_name(name) && std::ranges::all_of(levels_of(pattern), [](std::string_view level) {
           return level == any_levels || level.find(any_levels) == std::string_view::npos;
         });
}

bool matches(std::string_view pattern, std::string_view topic) {
  if (topic == "/rosout" || topic == "/parameter_events") {
    return pattern == topic;
  }
  const std::vector<std::string_view> wanted = levels_of(pattern);
  const std::vector<std::string_view> levels = levels_of(topic);
  // reached[i]: whether the levels of the pattern so far match the first i levels of the topic.
  std::vector<char> reached(levels.size() + 1, 0);
  reached[0] = 1;
  for (const std::string_view level : wanted) {
    if (level == any_levels) {
      for (std::size_t i = 0; i < levels.size(); ++i) {
        reached[i + 1] = static_cast<char>(reached[i + 1] != 0 || (reached[i] != 0 && !is_hidden(levels[i])));
      }
      continue;
    }
    for (std::size_t i = levels.size(); i > 0; --i) {
      reached[i] = static_cast<char>(reached[i - 1] != 0 && level_matches(level, levels[i - 1]));
    }
    reached[0] = 0;
  }
  return reached.back() != 0;
}

}  // namespace trestle::carry
