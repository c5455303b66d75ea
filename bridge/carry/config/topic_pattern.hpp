#pragma once
#include <string>
#include <string_view>

namespace trestle::carry {

/// Whether this is a pattern of topics: absolute ROS names in which `*` stands for any characters of one
/// level and `**`, as a level of its own, for any number of levels, none included.
[[nodiscard]] bool is_topic_pattern(std::string_view pattern);

/// Whether a topic is one of those. What ROS hides (a level that begins with '_', /rosout,
/// /parameter_events) only matches where the pattern spells it out.
/// @param pattern  is_topic_pattern()
/// @param topic  an absolute ROS name.
[[nodiscard]] bool matches(std::string_view pattern, std::string_view topic);

}  // namespace trestle::carry
